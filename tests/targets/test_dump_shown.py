"""A dump of the recorder as a figure, and how answers that differ are found and told."""

import numpy as np
import pytest

from reluctance.targets.export.dump import Dump, Segment, record_type
from reluctance.targets.export.dump_plot import dump_figure
from reluctance.targets.export.replay_dump import LONGEST, Replayed, _difference, _text


def made(trigger: int | None = 105) -> Dump:
    """Three phases, two segments: samples 100 to 103 and 104 to 107, 50 us each."""
    records = np.zeros(8, record_type(3))
    records["i"] = np.arange(24).reshape(8, 3)
    records["u_dc"] = np.linspace(300, 310, 8)
    records["omega_m"] = np.pi * np.arange(8)
    records["order"]["leg"][:, 0, 0] = [1, 1, 0, 0, -1, -1, -1, 0]
    records["order"]["leg"][:, 2, 0] = -1
    state = np.zeros(2, np.uint32)
    segments = [Segment(100, state, records[:4]), Segment(104, state, records[4:])]
    return Dump(7, 3, 2, 50e-6, trigger, 8, 1, 0.0, 0.0, segments)


def test_all_samples_are_drawn_over_the_time_from_the_trigger() -> None:
    dump = made()
    drawn = dump_figure(Replayed(dump, "sensor dead", 0, None), "mine")
    currents, legs, link, speed = drawn.axes
    t = 0.05 * (np.arange(100, 108) - 105)
    for k in range(3):
        assert currents.lines[k].get_xdata() == pytest.approx(t)
        assert [*currents.lines[k].get_ydata()] == [*range(k, 24, 3)]
        assert currents.lines[k].get_label() == f"phase {'abc'[k]}"
    assert link.lines[0].get_ydata() == pytest.approx(np.linspace(300, 310, 8))
    assert speed.lines[0].get_ydata() == pytest.approx(30 * np.arange(8), rel=1e-6)
    ticks = dict(
        zip((t.get_text() for t in legs.get_yticklabels()), legs.get_yticks(), strict=True)
    )
    first = [*legs.lines[0].get_ydata()]
    assert first[0] == ticks["a on"] and first[2] == ticks["a freewheel"]
    assert first[4] == ticks["a off"] and {*legs.lines[2].get_ydata()} == {ticks["c off"]}
    assert {*legs.lines[1].get_ydata()} == {ticks["b freewheel"]} and len({*ticks.values()}) == 9
    for ax in drawn.axes:
        assert {*ax.lines[-1].get_xdata()} == {0.0}  # the trigger
    (cause,) = currents.texts
    assert cause.get_text() == "sensor dead" and drawn.get_suptitle() == "mine"
    assert speed.get_xlabel() == "time from the trigger (ms)"


def test_without_a_trigger_the_last_sample_is_at_zero() -> None:
    drawn = dump_figure(Replayed(made(None), "", 0, None), "mine")
    currents = drawn.axes[0]
    assert currents.lines[0].get_xdata()[-1] == 0 and len(currents.lines) == 3
    assert not currents.texts and made().samples == 8


def test_the_first_answer_that_differs_in_a_bit_is_named_with_both_values() -> None:
    target = made().segments[0].records[:1]
    assert _difference(target, target.copy()) is None
    for name, value in (("mode", 5), ("gate_enable", 1), ("chopper", 1), ("status", -1)):
        desk = target.copy()
        desk[name] = value
        assert _difference(target, desk) == (name, "0", f"{value}")
    given = target.copy()
    given["i"] = 9.0  # what it was given is no answer
    assert _difference(target, given) is None
    desk = target.copy()
    desk["order"]["leg"][0, 1, 0] = 1
    desk["mode"] = 5
    found = _difference(target, desk)
    assert found is not None and found[0] == "order" and found[1] != found[2]


def test_a_long_answer_is_cut() -> None:
    assert _text("a  b\nc") == "a b c"
    assert _text("x" * LONGEST) == "x" * LONGEST
    assert _text("x" * (LONGEST + 1)) == "x" * LONGEST + " ..."
    assert Replayed(made(), "", 0, None).exact and not Replayed(made(), "", 1, None).exact
