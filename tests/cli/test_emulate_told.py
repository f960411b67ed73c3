"""What the commissioning commands print of findings that are given: no board is emulated."""

from dataclasses import make_dataclass
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace as Namespace

import pytest
from command import refused

from reluctance.base.resources import resources
from reluctance.cli import emulate


def found(**values):
    usual = {"sensor": (0, 1, 2), "sign": (1, 1, 1), "R": (0.5, 0.75, 0.7), "direction": 1}
    usual |= {"place": (0, 1, 2), "zero_deg": 0.0, "spread_deg": 0.1}
    return Namespace(**usual | values)


def test_wiring_is_as_it_must_be_where_sensors_stand_in_order_with_their_signs():
    lines = emulate._lines("wiring", found())
    assert lines == [f"leg {k}: sensor {k}, sign +1" for k in range(3)] + ["as it must be"]
    for wrong in ({"sensor": (0, 2, 1)}, {"sign": (1, -1, 1)}):
        lines = emulate._lines("wiring", found(**wrong))
        assert lines[-1] == "correct sensors and signs, then run `wiring` again"
    assert lines[1] == "leg 1: sensor 1, sign -1"


def test_resistances_have_their_mean():
    assert emulate._lines("resistance", found()) == ["R [ohm]: 0.5000, 0.7500, 0.7000; mean 0.6500"]


@pytest.mark.parametrize(
    ("values", "near", "told"),
    [
        ({"zero_deg": 0.1}, "0.100", "as it must be"),
        ({"zero_deg": 359.95, "spread_deg": 0.0}, "-0.050", "as it must be"),
        ({"zero_deg": 0.06, "spread_deg": 0.01}, "0.060", "subtract the zero from the angle"),
        ({"zero_deg": 200.0}, "-160.000", "subtract the zero from the angle"),
        ({"direction": -1}, "0.000", "the angle counts against the order of the legs."),
        ({"direction": 0}, "0.000", "the legs are in another order: exchange them, and run"),
    ],
)
def test_an_alignment_says_what_to_do_about_its_zero(values, near, told):
    """Within the spread, or a twentieth of a degree; from half a turn on it is negative."""
    place, zero, what = emulate._lines("alignment", found(**values))
    assert place == "place of legs 0, 1, 2: 0, 1, 2"
    assert f"zero {near} deg electrical, spread" in zero and what.startswith(told)


def test_a_step_that_fails_on_a_board_that_was_never_corrected_is_answered_with_it(monkeypatch):
    wiring = import_module("reluctance.targets.commission.wiring")
    for straight in (True, False):
        monkeypatch.setattr(
            wiring, "read_wiring", lambda _, straight=straight: Namespace(straight=straight)
        )
        for step in emulate.STEPS:
            hint = emulate._hint(Path("p"), step)
            asks = straight and step not in ("precharge", "wiring")
            before = (
                "was `wiring`"
                if step in ("resistance", "alignment")
                else "were `wiring` and `alignment`"
            )
            assert (f"{before} done?" in hint) == asks, step
            assert ("--whole-period" in hint) == (step == "alignment"), step


def test_a_finding_is_written_into_the_wiring_of_the_package(monkeypatch):
    wiring, wrote = import_module("reluctance.targets.commission.wiring"), []

    class Now:
        def with_sensors(self, *given):
            return Namespace(lines=lambda: [f"sensors {given}"])

        def with_angle(self, *given):
            return Namespace(lines=lambda: [f"angle {given}"])

    monkeypatch.setattr(wiring, "read_wiring", lambda _: Now())
    monkeypatch.setattr(wiring, "write_wiring", lambda place, now: wrote.append(now.lines()))
    on = Namespace(package=Path("p"))
    values = {"sensor": "s", "sign": "+", "direction": 1, "zero_deg": 5.0, "place": "abc"}
    for step, told in (("wiring", "sensors ('s', '+')"), ("alignment", "angle (1, 5.0, 'abc')")):
        assert emulate._corrected(on, step, values) == [
            f"wrote {Path('p') / wiring.HEADER}:",
            f"  {told}",
        ]
        assert wrote.pop() == [told]


@pytest.mark.parametrize(
    ("step", "options", "told"),
    [
        ("dance", [], "step `dance`, need one of: precharge, wiring, resistance, alignment"),
        ("spin", ["--correct"], "--correct goes with wiring or alignment, not with `spin`"),
        ("wiring", ["--out", "a.csv"], "--out goes with pulses, not with `wiring`"),
        ("trip", ["--until", "1"], "--until goes with spin, not with `trip`"),
        ("pulses", ["--reference", "1"], "--reference goes with spin or trip, not with `pulses`"),
        ("spin", ["--held", "1"], "--held goes with pulses, not with `spin`"),
        ("pulses", ["--phase", "3"], "--phase 3, need less than 3"),
        ("pulses", ["--held", "1"], "--held and --held_A go together: a phase and its current"),
        ("pulses", ["--held_A", "1"], "--held and --held_A go together: a phase and its current"),
        ("pulses", [], "`pulses` needs --out PULSES.csv"),
        ("pulses", ["--out", "a.txt"], "ending `.txt`, need one of .csv"),
    ],
)
def test_an_option_goes_with_its_step(step, options, told):
    assert told in refused(
        "emulate",
        "package",
        step,
        "--drive",
        resources("examples") / "sharing_cubic.toml",
        *options,
    )


def test_trips_are_told_with_what_they_lack(monkeypatch):
    steps = import_module("reluctance.targets.commission.steps")
    good = {"what": "a", "off": True, "stays": True, "clears": True, "late_us": 12.4}
    Trip = make_dataclass("Trip", [*good, "text", "began"])
    for lacks, done, told in (
        ({}, True, "a: legs off after 12 us, t; stays, clears once the cause is gone"),
        ({"off": False}, False, "a: LEGS ARE ON after 12 us"),
        ({"stays": False}, False, "t; DOES NOT STAY, clears"),
        ({"clears": False}, False, "stays, DOES NOT CLEAR"),
    ):
        one = Trip(**good | lacks, text="t", began=True)
        monkeypatch.setattr(steps, "trips", lambda *_, one=one, **__: [one])
        values, (line,) = emulate._step(None, "trip", None, None, None, reference=None, until=None)
        assert values["done"] == done and told in line
        assert values["text"] == (
            "all stop the drive" if done else "a cause does not stop the drive as it must"
        )
    never = Trip(**good | {"off": False}, text="it did not run", began=False)
    monkeypatch.setattr(
        steps, "trips", lambda *_, **__: [Trip(**good, text="t", began=True), never]
    )
    values, lines = emulate._step(None, "trip", None, None, None, reference=None, until=None)
    assert (values["done"], values["text"], len(lines)) == (False, "it did not run", 1)


@pytest.mark.parametrize("done", [True, False])
def test_a_routine_that_did_not_end_is_told_without_what_it_did_not_find(monkeypatch, done):
    steps = import_module("reluctance.targets.commission.steps")
    names = ["done", "text", "rows", "sensor", "sign", "R"]
    one = make_dataclass("Found", names)(done, "t", [1, 2], (0, 1), (1, 1), (0.5, 0.7))
    monkeypatch.setattr(steps, "routine", lambda *_, **__: one)
    given = (None, "resistance", None, (12, 1, 0, None, False), None)
    values, lines = emulate._step(*given, reference=None, until=None)
    assert values["done"] is done and values["text"] == "t" and "rows" not in values
    assert lines == (["R [ohm]: 0.5000, 0.7000; mean 0.6000"] if done else [])


@pytest.mark.parametrize("done", [True, False])
def test_a_precharge_tells_its_states_and_the_offsets_of_one_that_was_reached(monkeypatch, done):
    steps = import_module("reluctance.targets.commission.steps")
    one = steps.PowerUp(done, "t", [(0.0, "precharge"), (0.25, "ready")], (0.1, -0.02))
    monkeypatch.setattr(steps, "precharge", lambda *_, **__: one)
    values, lines = emulate._step(None, "precharge", None, None, None, reference=None, until=None)
    assert values["done"] is done
    states = ["  0.0000 s  precharge", "  0.2500 s  ready"]
    assert lines == states + (["offsets [A]: 0.100, -0.020"] if done else [])


def test_a_spin_tells_its_speeds_and_the_greatest_current(monkeypatch):
    steps = import_module("reluctance.targets.commission.steps")
    one = steps.Spin(True, "t", [(0.5, "run")], speed_rpm=99.6, fastest_rpm=120.4, i_peak=3.14)
    monkeypatch.setattr(steps, "spin", lambda *_, **__: one)
    values, lines = emulate._step(None, "spin", None, None, None, reference=None, until=None)
    assert values["done"] and lines == [
        "  0.5000 s  run",
        "100 rpm at the end, 120 rpm at most; greatest current 3.1 A",
    ]
