"""Whole ways through the program, command by command as a user types them."""

import re

import numpy as np
import pytest
from command import command
from emulated_board import MACHINES, walk
from firmware_tools import ROOT, needs_target

import reluctance as rl

HEADER = "i_A,theta_deg,psi_Wb,tau_Nm"  # as docs/your_machine.md has it
OWN = ROOT / "examples" / "own_law" / "own_law.toml"


def done(*arguments):
    found = command(*arguments)
    assert found.code == 0, found.error
    return found.out


def own_table(path):
    """Flux linkage and torque of the 6/4 machine, in mechanical degrees from unaligned."""
    machine = rl.load(ROOT / "examples" / "paper_rated.toml").machine
    rows = [HEADER]
    for i in np.linspace(0, machine.i_max_A, 31):
        for theta_e in np.linspace(0, np.pi, 46):
            values = machine.psi(i, theta_e), machine.tau(i, theta_e)
            angle = np.degrees(theta_e) / machine.N_r
            rows.append(",".join(f"{float(x):.7g}" for x in (i, angle, *values)))
    path.write_text("\n".join(rows) + "\n")
    return machine


@needs_target
@pytest.mark.long
def test_from_an_own_table_to_a_rotor_that_turns(tmp_path, monkeypatch):
    """The table has the header that the page quotes; the emulated board is commissioned with its
    own commands, and ends with a turning rotor."""
    assert HEADER in (ROOT / "docs" / "your_machine.md").read_text()
    machine = own_table(tmp_path / "fe.csv")
    assert "good" in done("map", "check", tmp_path / "fe.csv", "--N_r", machine.N_r)
    winding = ("--N_s", 6, "--N_r", machine.N_r, "--R_ohm", machine.R_ohm)
    winding += ("--J_kgm2", machine.J_kgm2)
    done("map", "import", tmp_path / "fe.csv", *winding, "--out", tmp_path / "motor.toml")
    monkeypatch.setitem(MACHINES, "motor.toml", MACHINES["paper_6_4"])
    walked, said = walk("motor.toml", tmp_path)
    assert walked.torque_error_pct < 2
    assert walked.zero_error_counts < 1
    assert 0.8 < walked.spin_rpm / (walked.speed_limit_rpm + 1) < 1  # printed in whole rpm
    assert walked.trips == 4
    assert "as it must be" in said["wiring"]


def test_from_an_own_law_to_a_figure_with_its_letters(tmp_path):
    """A law in Python, run and drawn at the width of a column: the file has its letters in it."""
    figure = tmp_path / "own.pdf"
    done("run", OWN, "--trust", "--until", "0.05", "--plot", figure, "--width", "88mm")
    page = figure.read_bytes()
    assert page.startswith(b"%PDF")
    fonts = re.findall(rb"/BaseFont /(\S+)", page)
    assert fonts and page.count(b"/FontFile2") >= len(set(fonts))
    assert b"/Type3" not in page
    (box,) = set(re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ", page))
    assert float(box) / 72 * 25.4 == pytest.approx(88, abs=1)
