"""A dump of the recorder as a figure, and how answers that differ are found and told."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from reluctance.base.errors import ParameterError
from reluctance.targets.export.dump import (
    API,
    HEADER,
    MAGIC,
    NO_SAMPLE,
    VERSION,
    Dump,
    Segment,
    read_dump,
    record_type,
)
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
    assert found is not None and found == ("order.leg[1][0]", "0", "1")


def test_a_long_answer_is_cut() -> None:
    assert _text("a  b\nc") == "a b c"
    assert _text("x" * LONGEST) == "x" * LONGEST
    assert _text("x" * (LONGEST + 1)) == "x" * LONGEST + " ..."
    assert Replayed(made(), "", 0, None).exact and not Replayed(made(), "", 1, None).exact


def written(path: Path, n_phases: int = 1, *, left: bytes = b"", **changed: int) -> Path:
    """A dump of two segments of one and two samples, with a state of one word."""
    record = record_type(n_phases)
    head = np.zeros(1, HEADER)
    usual = {"magic": MAGIC, "version": VERSION, "api": API, "phases": n_phases, "phase": -1}
    usual |= {"state_words": 1, "record_words": record.itemsize // 4, "segments": 2}
    usual |= {"trigger": 7, "fingerprint": 5, "T_s": 50e-6, "value": 3.5, "limit": 2.5}
    for name, value in (usual | changed).items():
        head[name] = value
    data = head.tobytes()
    for first, n in ((6, 1), (9, 2)):
        records = np.zeros(n, record)
        records["u_dc"] = first + np.arange(n)
        data += struct.pack("<III", first, n, 10 * first) + records.tobytes()
    data += left
    path.write_bytes(data + struct.pack("<I", zlib.crc32(data)))
    return path


def test_a_dump_is_read_as_it_lies_in_memory(tmp_path: Path) -> None:
    for n_phases in (1, 3, 6):
        found = read_dump(written(tmp_path / "d.bin", n_phases))
        assert (found.fingerprint, found.n_phases, found.trigger) == (5, n_phases, 7)
        assert (found.value, found.limit, found.T_s) == pytest.approx((3.5, 2.5, 50e-6))
        assert [s.first for s in found.segments] == [6, 9] and found.samples == 3
        assert [s.state.tolist() for s in found.segments] == [[60], [90]]
        assert found.segments[1].records["u_dc"].tolist() == [9, 10]
    assert read_dump(written(tmp_path / "d.bin", trigger=NO_SAMPLE)).trigger is None
    assert read_dump(written(tmp_path / "d.bin", 3, phase=2)).phase == 2
    empty = np.zeros(1, HEADER)
    for name, value in {"magic": MAGIC, "version": VERSION, "api": API, "phases": 3}.items():
        empty[name] = value
    empty["record_words"] = record_type(3).itemsize // 4
    data = empty.tobytes()
    (tmp_path / "e.bin").write_bytes(data + struct.pack("<I", zlib.crc32(data)))
    assert read_dump(tmp_path / "e.bin").samples == 0


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"phases": 0}, "phases = 0, need 1 to 6"),
        ({"phases": 7}, "phases = 7, need 1 to 6"),
        ({"phase": -2}, "phase = -2, need -1 to 0"),
        ({"phase": 1}, "phase = 1, need -1 to 0"),
        ({"record_words": 1}, "samples of 1 words are unknown"),
        ({"segments": 1}, "its segments do not fill it"),
        ({"segments": 3}, "its segments do not fill it"),
        ({"state_words": 2}, "its segments do not fill it"),
        ({"left": b"1234"}, "its segments do not fill it"),
        ({"left": b"123"}, "bytes are no dump of the recorder"),
        ({"magic": 1}, "does not begin with `RELD`"),
        ({"version": VERSION + 1}, f"version {VERSION + 1} of the dump, need {VERSION}"),
        ({"api": API + 1}, f"api {API + 1} of the dump, need {API}"),
    ],
)
def test_a_dump_of_another_form_is_told(tmp_path: Path, changed: dict[str, int], told: str) -> None:
    with pytest.raises(ParameterError, match=told):
        read_dump(written(tmp_path / "d.bin", **changed))  # type: ignore[arg-type]
