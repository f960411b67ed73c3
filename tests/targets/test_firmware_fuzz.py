"""No undefined behaviour for any bit pattern: the exported controller under the sanitizers."""

import subprocess

import pytest
from firmware_fuzz import built, ran
from firmware_tools import ROOT, drive

from reluctance.base.toolchain import build

OTHERS = ["angles", "sharing", "ditc", "paper_mpc_map", "finite_set_2", "deadbeat", "pwm_current"]
OTHERS += ["sun_cloud", "sun_cloud_no_sensor"]
EACH_LAW = ["edge_mpc", *(pytest.param(name, marks=pytest.mark.long) for name in OTHERS)]


@pytest.mark.parametrize("name", EACH_LAW)
def test_no_bit_pattern_of_samples_or_parameters_is_undefined_behaviour(name, tmp_path):
    assert ran(built(drive(name), tmp_path), 10_000) == ""


def test_the_comparator_in_software_follows_the_gate_drive_of_the_simulation(tmp_path):
    program = tmp_path / "comparator_check"
    source = ROOT / "tests" / "firmware" / "comparator_check.cpp"
    build([str(source)], program, ["-O1", "-Iinclude"], folder=ROOT, what="the check", link=())
    done = subprocess.run([str(program)], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout) == (0, "0\n")
