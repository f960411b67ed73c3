"""Many drives in one call: the same numbers as one by one, on threads that need no Python."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.run.bounds import Bounds
from reluctance.drive.run.plant import closed_loop

EXAMPLES = Path(__file__).parents[2] / "examples"
CUBIC = EXAMPLES / "sharing_cubic.toml"
UNTIL = 0.03
KINDS = (  # every way through the loop: maps, phase counts, links, shafts, own laws, iron loss
    *("sharing_cubic", "five_phases_losses", "shared_switch", "single_pulse", "fan", "battery"),
    *("pwm_current", "deadbeat", "own_law/own_law"),
)


def compared(kpis: rl.Kpis) -> rl.Kpis:
    """But for the time that it took."""
    return replace(kpis, wall_s_per_sim_s=0.0)


def test_key_figures_are_those_of_one_run_each() -> None:
    drives = [rl.load(EXAMPLES / f"{name}.toml", trust=True) for name in KINDS]
    together = rl.simulate_all(drives, until=UNTIL, jobs=2)
    for drive, found in zip(drives, together, strict=True):
        assert isinstance(found, rl.Kpis), found
        alone = rl.simulate(drive, until=UNTIL, record=None).kpis
        assert compared(found) == compared(alone), drive.name


def test_order_and_numbers_do_not_depend_on_the_threads() -> None:
    drive = rl.load(CUBIC)
    drives = [drive.with_values({"control.i_band_A": 0.5 + n / 20}) for n in range(30)]
    runs = [rl.simulate_all(drives, until=0.02, jobs=jobs) for jobs in (1, 2, 5)]
    told = [[compared(kpis) for kpis in found] for found in runs]  # type: ignore[arg-type]
    assert told[0] == told[1] == told[2]
    rates = [kpis.f_switch for kpis in told[0]]
    assert rates[0] > rates[-1]


def test_a_run_that_fails_says_why_in_its_place() -> None:
    drive = rl.load(CUBIC)
    falls = drive.with_values(
        {"load.kind": "torque", "load.tau_Nm": -3000, "reference.tau_Nm": 1, "load.speed_rpm": 0}
    )
    with pytest.raises(rl.ParameterError) as alone:
        rl.simulate(falls, until=60, record=None)
    first, second, third = rl.simulate_all([drive, falls, drive], until=0.5)
    assert isinstance(first, rl.Kpis) and isinstance(third, rl.Kpis)
    assert isinstance(second, rl.ParameterError)
    assert str(second).split(" after ")[0][:12] == str(alone.value)[:12] == "the speed is"


def test_arguments_of_a_wrong_kind_are_one_line() -> None:
    drive = rl.load(CUBIC)
    for arguments in ({"jobs": 0}, {"jobs": 1.5}, {"until": -1}, {"until": "long"}):
        with pytest.raises(rl.ParameterError):
            rl.simulate_all([drive], **arguments)  # type: ignore[arg-type]
    with pytest.raises(rl.ParameterError, match="takes a Drive"):
        rl.simulate_all(["drive.toml"])  # type: ignore[list-item]


def test_the_part_done_is_told() -> None:
    told: list[float] = []
    rl.simulate_all([rl.load(CUBIC)] * 5, until=0.01, progress=told.append)
    assert told == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_the_core_runs_while_python_holds_its_lock() -> None:
    """This thread gives the lock back only in `take`; the processor time of the other one grows
    before."""
    drive = rl.load(CUBIC)
    end = 5.0
    runs = _core.Runs(1)
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e3)
    try:
        loop = closed_loop(drive, drive.controller(), -1.0)
        runs.add(7, loop, end, Bounds(drive, end, None).within())
        own, all_threads = time.thread_time(), time.process_time()
        while time.process_time() - all_threads - (time.thread_time() - own) < 0.02:
            assert time.thread_time() - own < 60, "the thread of the run got no processor"
        tag, t, _, _ = runs.take()
    finally:
        sys.setswitchinterval(before)
        runs.close()
    assert (tag, t) == (7, end)


def test_threads_end_before_their_runs_do() -> None:
    drive = rl.load(CUBIC)
    runs = _core.Runs(2)
    within = Bounds(drive, 1000, None).within()
    for n in range(6):
        runs.add(n, closed_loop(drive, drive.controller(), -1.0), 1000.0, within)
    start = time.process_time()
    runs.close()
    assert time.process_time() - start < 10  # a run takes some 30 s of processor time
    with pytest.raises(ValueError, match="ended"):
        runs.add(0, closed_loop(drive, drive.controller(), -1.0), 1.0, within)
