"""Parts of an export, each alone and nothing compiled: texts of a README, levels of the routines,
words of the target, ports, sizes of an object, and what is refused."""

import re
import struct
import zipfile
import zlib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace as Namespace
from typing import Any

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.drive.guard.trip_levels import current_error, protection
from reluctance.targets.export import cost, package, package_text, replay_dump, target
from reluctance.targets.export.array_text import array_marks
from reluctance.targets.export.blob import exported_controller
from reluctance.targets.export.commission_levels import commission, levels
from reluctance.targets.export.constants import Tables, constant, literal
from reluctance.targets.export.more_interface import more_marks
from reluctance.targets.export.pair_text import pair_marks
from reluctance.targets.export.port import port_marks
from reluctance.targets.export.self_test import _orders, self_test_marks, stored_tables

EXAMPLES = Path(__file__).parents[2] / "examples"


def drive(name: str = "deadbeat", *given: str) -> rl.Drive:
    return rl.load(EXAMPLES / f"{name}.toml", list(given))


# Texts.


def values(*given: str, name: str = "deadbeat") -> dict[str, str]:
    return package_text.values(drive(name, *given), "srm::Deadbeat<float>", 0x1234ABCD)


def test_marks_of_a_template_are_the_numbers_of_the_drive() -> None:
    found = values("sensing.delay_samples=1")
    for mark, text in {
        "phases": "3",
        "straight": "0, 1, 2",
        "positive": "1, 1, 1",
        "swapped": "0, 2, 1",
        "exchanged": "1, 0, 2",
        "turned": "1, -1, 1",
        "letters": "a, b, c",
        "N_s": "6",
        "N_r": "4",
        "R_ohm": "0.72",
        "T_s_us": "20",
        "T_s": "2e-05F",
        "delay": "1",
        "reference": "torque [N m]",
        "i_source": "not used, give 0",
        "fingerprint": "0x1234ABCD",
        "law": "srm::Deadbeat<float>",
        "i_max_A": "150",
        "adc": "ideal",
        "encoder": "ideal",
        "dead_time": "none is needed, and none was simulated.",
        "speed": "from more than the last two angles",
        "frozen": "not checked: it needs noise in `[sensing]`",
    }.items():
        assert found[mark] == text, mark
    assert found["delay_text"].startswith("Orders act at the next sample")
    assert found["without_comparators"] == package_text.NO_FAST_LOOP
    five = values(name="five_phases_losses")
    assert (five["swapped"], five["turned"]) == ("0, 2, 1, 3, 4", "1, -1, 1, 1, 1")
    assert five["letters"] == "a, b, c, d, e" and five["exchanged"] == "1, 0, 2, 3, 4"


def test_marks_follow_sensors_gates_and_references() -> None:
    counted = ["sensing.adc_bits=12", "sensing.i_range_A=400", "sensing.i_noise_LSB=2"]
    counted += ["sensing.encoder_counts=4096", "converter.dead_time_us=1.5"]
    found = values(*counted)
    assert found["adc"] == "12 bits over 400 A"
    assert found["encoder"] == "4096 counts per revolution"
    assert found["speed"] == "ignored: the controller tracks it on the angle"
    assert re.fullmatch(r"\d+ equal codes in a row", found["frozen"])
    assert "given as 1.5 us late at turn-on" in found["dead_time"]
    assert found["delay_text"].startswith("The simulation lets the orders act at the instant")
    assert values(name="paper_pump")["reference"] == "speed [rad/s]"
    assert values(name="single_pulse")["reference"].startswith("1 to motor with the law's own")
    cubic = values(name="sharing_cubic")
    assert cubic["without_comparators"] == package_text.FAST_LOOP
    assert "`RELUCTANCE_COMPARATOR`" in cubic["gates"] and "four thresholds" in cubic["gates"]
    two = values("sensing.comparators=two_level", name="sharing_cubic")
    assert "Simulated with two thresholds" in two["gates"]
    named = replace(drive(), machine=drive().machine.computed(name="a*b`c"))
    assert package_text.values(named, "", 0)["machine"] == "a?b?c"


@pytest.mark.parametrize(
    ("slack", "bend", "block", "told"),
    [
        (0.1, 0.0, 0, "the angle differs from the integral of the speed by 5.73 deg electrical"),
        (0.1, 0.05, 20, "turns by 14.32 deg electrical more or less than in the 4 ms before"),
        (1.5, 0.1, 20, "turns by 177.6 deg electrical more or less than in the 4 ms before"),
        (1.5, 0.15, 20, "not checked: the steps of the angle are too wide"),
    ],
)
def test_an_angle_that_is_stuck_is_told_with_both_slacks(
    slack: float, bend: float, block: int, told: str
) -> None:
    """Twice the slack and the bend, over 10 parts of 20 samples of 20 us."""
    guard = Namespace(
        levels=Namespace(angle_slack=slack),
        advance=Namespace(block=block, bend=bend, parts=10),
        flux=Namespace(T_s=20e-6),
    )
    assert told in package_text._stuck_angle(guard)  # type: ignore[arg-type]


def test_a_drive_with_more_has_its_memory_and_its_functions() -> None:
    def marks(learns: bool, diagnosis: bool, flux_angle: bool) -> dict[str, str]:
        return more_marks(learns, Namespace(diagnosis=diagnosis, flux_angle=flux_angle))  # type: ignore[arg-type]

    assert marks(False, False, False) == {
        "memory": "uint32_t word[256];", "more_interface": "", "more_code": "",
    }  # fmt: skip
    assert marks(False, True, False)["memory"] == "uint32_t word[1024];"
    assert "void* aligned" in marks(True, True, False)["memory"]
    for learns, follows in ((True, False), (False, True), (True, True)):
        found = marks(learns, True, follows)
        for name, given in (("get_learned", learns), ("get_flux_estimate", follows)):
            assert (name in found["more_interface"]) == (name in found["more_code"]) == given
    for name, guarded in (
        ([], package_text.UNDIAGNOSED),
        (["protection.diagnosis=true"], package_text.DIAGNOSED),
        (["protection.diagnosis=true", "protection.flux_angle=true"], package_text.FOLLOWED),
    ):
        assert package_text.guarded(drive("deadbeat_g474", *name)) == guarded


def test_a_drive_on_an_array_tells_its_voltages_and_times() -> None:
    sun = drive("sun_cloud")
    found, law = array_marks(sun), sun.pv_control
    of = law.voltages(sun.converter.u_dc_V)
    states = found["array_states"].replace("\n", " ")
    for text in (
        f"between {of['u_ref_min']:.4g} and {of['u_ref_max']:.4g} V every {law.interval_ms:g} ms",
        f"above {of['u_wake']:.4g} V for {law.wake_s:g} s",
        f"after {law.sleep_s:g} s below {law.p_sleep_W:g} W",
        f"at {sun.source.temp_cold_degC:g} degC, the array gives {sun.source.cold_voltage:.4g} V",
    ):
        assert text in states, text
    assert f"a supply of {sun.converter.u_dc_V:g} V" in found["array_spin"]
    assert f"a tenth of {sun.reference.speed_rpm:g} rpm" in found["array_spin"]
    assert found["first_request"] == "a tenth of the speed"
    assert ("analog" in found["array_signal"]) == (law.current == "sensor")
    parts = {"reference": sun.reference, "converter": sun.converter, "source": sun.source}
    for change, mark, text in (
        ({"k_dry_Nms2": None}, "array_states", "Dry running is not watched"),
        ({"k_dry_Nms2": 1e-6}, "array_states", f"stops for {law.rest_s:g} s"),
        ({"current": "legs"}, "array_signal", "computed from the phase currents"),
        ({"current": "sensor"}, "array_signal", "in, analog"),
    ):
        other = Namespace(**parts, pv_control=law.computed(**change))
        assert text in array_marks(other)[mark]  # type: ignore[arg-type]
    assert array_marks(drive())["first_request"] == "a tenth of the torque"


def test_pairs_of_each_kind_are_recorded_at_three_currents() -> None:
    coupled = drive("coupled_phases")
    found, m = pair_marks(coupled), coupled.machine
    assert found["import_pairs"] == " --pairs DRIVE.toml"
    text = found["pair_pulses"]
    assert f"for I in {' '.join(f'{part * m.i_max_A:.3g}' for part in (0.25, 0.5, 0.75))}" in text
    assert f"--R_ohm {m.R:g} --pairs" in text
    assert m.coupling is not None
    first: dict[int, Any] = {}
    for pair in m.coupling.pairs:
        first.setdefault(id(pair.table), pair)
    recorded = re.findall(r"--phase (\d) --held (\d) .*\n.* --out held_(\w+)_\$I", text)
    assert recorded == [(str(p.first), str(p.second), p.letters) for p in first.values()]
    assert pair_marks(drive()) == {"import_pairs": "", "pair_pulses": ""}


# Words of the target.


def test_words_of_the_target_are_columns_of_a_step() -> None:
    """Five leg states, gate, chop and a byte between; four instants and eight numbers; then the
    torque reference. At the end the fingerprint and the stack."""
    phases = [([1, 0, -1, 0, 1], 2, 1, [0.1, 0.2, 0.3, 0.4], [k + n / 8 for n in range(8)])
              for k in range(3)]  # fmt: skip
    data = b""
    for status, step in ((0, 900), (7, 1000)):
        data += struct.pack("<III", status, step, step + 100)
        for leg, gate, chop, edges, numbers in phases:
            data += struct.pack("<5bbbx", *leg, gate, chop) + struct.pack("<12f", *edges, *numbers)
        data += struct.pack("<f", 41.5)
    found = target._answers(data + struct.pack("<II", 0xCAFE, 640), 3)
    assert found.status.tolist() == [0, 7] and found.step.tolist() == [900, 1000]
    assert found.run.tolist() == [1000, 1100]
    assert (found.fingerprint, found.stack) == (0xCAFE, 640)
    row = found.commands[1]
    columns = list(_core.ORDER_COLUMNS)
    assert len(row) == 3 * len(columns) + 1 and row[-1] == 41.5
    for k in range(3):
        of = row[k * len(columns) : (k + 1) * len(columns)]
        assert of[columns.index("gate")] == 2 and of[columns.index("chop")] == 1
        assert of[:5].tolist() == [1, 0, -1, 0, 1]
        assert of[-8:] == pytest.approx([k + n / 8 for n in range(8)])
    again = _orders(found.commands, 3)  # the words of the self-test
    assert again.shape == (2, 3)
    assert again.tobytes() == 2 * b"".join(
        struct.pack("<5bbbx12f", *p[0], p[1], p[2], *p[3], *p[4]) for p in phases
    )


def test_samples_of_the_target_have_an_angle_of_one_turn() -> None:
    samples = np.array([[1.0, 2.0, 3.0, 7.0, 50.0, 240.0, 0.5, 41.0]] * 2)
    samples[1, 3] = -0.5
    found = target.target_samples(samples)
    assert found.dtype == np.float32
    assert found[:, 3] == pytest.approx([7 - 2 * np.pi, 2 * np.pi - 0.5])
    assert np.array_equal(np.delete(found, 3, axis=1), np.delete(samples, 3, axis=1))


class Pipe:
    """Gives its bytes two at a time."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def read(self, size: int) -> bytes:
        part, self.data = self.data[: min(size, 2)], self.data[min(size, 2) :]
        return part


def test_an_answer_is_read_in_parts_and_its_end_is_told() -> None:
    assert target._read(Pipe(b"abcdefg"), 5) == b"abcde"  # type: ignore[arg-type]
    with pytest.raises(rl.ParameterError, match="stopped before the simulation did"):
        target._read(Pipe(b"abc"), 4)  # type: ignore[arg-type]
    dead = Namespace(poll=lambda: 1)
    with pytest.raises(rl.ParameterError, match="stopped before the simulation did"):
        target._writing_end(Path("nowhere"), dead)  # type: ignore[arg-type]
    for name in ("cortex-m4", "cortex-m7"):
        assert target.known_cpu(name) == name
    with pytest.raises(rl.ParameterError, match="--cpu z80, need one of: cortex-m4, cortex-m7"):
        target.known_cpu("z80")


def test_sizes_of_an_object_are_the_sums_of_its_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    told = {
        "size": "controller.o  :\nsection size addr\n.text 10 0\n.text._Z3runv 200 0\n"
        ".rodata 3 0\n.rodata.table_0 4000 0\n.data 50 0\n.bss 7 0\n.bss.state 600 0\n"
        ".comment 99 0\n.ARM.attributes 54 0\nTotal 5000\n",
        "nm": "         U sqrtf\n         U memcpy\n",
    }
    monkeypatch.setattr(cost, "_tool", lambda name, *_: told[name])
    assert cost.sizes(Path("controller.o")) == (210, 4003, 657)
    assert cost.outside_symbols(Path("controller.o")) == ("memcpy", "sqrtf")
    row = cost.Cost("d", "L", "cortex-m4", 9, True, 1234.56, 2000, 1, 2, 3, 4, ("a", "b"))
    assert row.with_units() == {
        "drive": "d", "law": "L", "cpu": "cortex-m4", "steps": 9, "bit_exact": True,
        "instructions_mean": 1234.6, "instructions_max": 2000, "text_B": 1, "rodata_B": 2,
        "data_B": 3, "stack_B": 4, "outside": "a b",
    }  # fmt: skip


def test_tables_are_listed_with_their_checksum_in_whole_words() -> None:
    """Each is filled up to four bytes."""
    tables = Tables()
    constant({"table": "float", "values": [1.0, 2.0]}, tables, "a")
    constant({"table": "std::uint8_t", "values": [1, 2, 3, 4, 5]}, tables, "b")
    text = stored_tables(tables)
    data = struct.pack("<2f", 1, 2) + bytes([1, 2, 3, 4, 5, 0, 0, 0])
    assert "stored_tables[] = {{table_0, 8}, {table_1, 5}};" in text
    assert f"tables_crc = 0x{zlib.crc32(data):08X};" in text
    assert "{nullptr, 0}" in stored_tables(Tables()) and "0x00000000" in stored_tables(Tables())
    assert self_test_marks(False)["self_test_text"] == ""
    assert "256 stored samples" in self_test_marks(True)["self_test_text"].replace("\n", " ")
    for value in (np.inf, np.nan, 1e39):
        with pytest.raises(rl.ParameterError, match="cannot be exported, need a finite float"):
            literal(value, "x")


# Levels of the routines.


def test_levels_of_the_routines_are_parts_of_the_greatest_current() -> None:
    """150 A, 240 V and 0.72 ohm: 1.5 R i_max is below the link, so the top is i_max; what holds is
    36 % of what half the link drives through R."""
    given = drive("deadbeat", "sensing.adc_bits=12", "sensing.i_range_A=400")
    found, R, u = levels(given), 0.72, 240.0
    most = 0.36 * 0.5 * u / R
    assert found.i_top == pytest.approx(150) and found.i_beside == pytest.approx(127.5)
    assert found.i_hold == pytest.approx(min(60, most)) and found.i_low == pytest.approx(18)
    assert (found.i_1, found.i_2) == pytest.approx((15, 45))
    assert found.i_detect == pytest.approx(max(7.5, 4 * current_error(given)))
    i, theta = np.meshgrid(np.linspace(0, 150, 41), np.linspace(0, np.pi, 31))
    at = _core.magnetics(given.machine.magnetics, i.ravel(), theta.ravel())
    least = at[:, 3].min()
    duty = max(0.05 * 150 * least / (u * 20e-6), 1.5 * R * 150 / u)
    assert found.duty == pytest.approx(min(duty, 1))
    assert found.t_pulse == pytest.approx(10 * at[:, 0].max() / (found.duty * u))
    assert found.slack == pytest.approx(np.radians(0.3))
    times = (found.t_rest, found.t_wait, found.t_settle, found.t_mean, found.t_max)
    assert times == (0.5, 10.0, 0.3, 0.5, 300.0)
    counted = levels(drive("deadbeat", "sensing.encoder_counts=4096"))
    assert counted.slack == pytest.approx(max(1.25 * 4 * 2 * np.pi / 4096, np.radians(0.3)))


def test_a_swinging_rotor_is_held_by_no_less_than_what_the_current_falls_to_in_time() -> None:
    """In an eighth of a quarter of the free swing about alignment, by half of the link; a third of
    the holding current or more. The torque is the change of the co-energy."""
    given = replace(drive(), converter=drive().converter.computed(u_dc_V=30.0))
    heavy = levels(replace(given, machine=given.machine.model_copy(update={"J_kgm2": 1.0})))
    assert heavy.i_low == pytest.approx(0.3 * heavy.i_hold)
    light = replace(given, machine=given.machine.model_copy(update={"J_kgm2": 2e-4}))
    found, magnetics = levels(light), light.machine.magnetics
    away = np.linspace(0.05, 0.6, 200)
    W_c = _core.magnetics(magnetics, np.full(200, found.i_hold), np.pi - away)[:, 1]
    tau = -4 * np.gradient(W_c, away)
    quarter = np.pi / 2 * np.sqrt(2e-4 / (4 * (tau / away).max()))
    psi = _core.magnetics(magnetics, np.array([found.i_low, found.i_hold]), np.full(2, np.pi))[:, 0]
    assert 0.3 * found.i_hold < found.i_low < found.i_hold
    assert (psi[1] - psi[0]) / (0.5 * 30) == pytest.approx(quarter / 8, rel=0.02)


@pytest.mark.parametrize("torque", [0.0, -1e-9])
def test_a_rotor_without_torque_about_alignment_does_not_swing(
    monkeypatch: pytest.MonkeyPatch, torque: float
) -> None:
    def flat(machine: object, i: Any, theta_e: Any) -> Any:
        return np.column_stack([0.01 * i, 0.005 * i * i, np.full_like(i, torque), 0.01 + 0 * i])

    module = import_module("reluctance.targets.export.commission_levels")
    monkeypatch.setattr(module._core, "magnetics", flat)
    assert module._low(drive(), 50.0) == 0


def test_less_flows_through_a_greater_resistance() -> None:
    """At 30 V: u/(1.5 R) at most, at full voltage; a held current of 36 % of u/(2 R)."""
    weak = replace(drive(), converter=drive().converter.computed(u_dc_V=30.0))
    found = levels(weak)
    assert found.i_top == pytest.approx(30 / (1.5 * 0.72)) and found.duty == 1
    assert found.i_hold == found.i_2 == pytest.approx(0.36 * 15 / 0.72)
    assert found.i_1 == pytest.approx(found.i_2 / 3)
    loud = replace(weak, sensing=weak.sensing.computed(adc_bits=8, i_range_A=800.0))
    assert levels(loud).i_detect == pytest.approx(4 * current_error(loud))
    assert commission(drive()) is not None


# Ports and what is refused.


def test_a_port_has_the_ticks_codes_and_watchdog_of_the_drive() -> None:
    given = drive("deadbeat_g474")
    gates = package_text.gates_of(given)
    found = port_marks("stm32g474", given, gates)
    T_s = given.control.T_s
    assert found["period_ticks"] == str(round(170e6 * T_s))
    assert found["encoder_counts"] == str(given.sensing.encoder_counts)
    assert found["watchdog"] == str(max(int(np.ceil(50 * T_s * 8e3)), 8))
    A, V = (float(found[name].rstrip("F")) for name in ("A_per_code", "V_per_code"))
    assert pytest.approx(given.sensing.i_range_A / 4096) == A
    assert pytest.approx(1.25 * protection(given).levels.u_dc_max / 4096) == V
    for T_s_us, passes in ((385.2, True), (385.4, False), (20.003, False)):
        other = replace(given, control=given.control.computed(T_s_us=T_s_us))
        if passes:
            assert port_marks("stm32g474", other, gates)["watchdog"] == "155"
            continue
        with pytest.raises(rl.ParameterError, match="ticks of the timer, need a whole number"):
            port_marks("stm32g474", other, gates)
    with pytest.raises(rl.ParameterError, match="--port pic16, need one of: stm32g474"):
        port_marks("pic16", given, gates)


@pytest.mark.parametrize("prefix", ["Left", "1st", "a-b", "", "a" * 32, "_x"])
def test_a_prefix_is_a_lower_case_name_of_c(prefix: str, tmp_path: Path) -> None:
    with pytest.raises(rl.ParameterError, match="need a lower-case C name of at most 31"):
        package.firmware(drive(), tmp_path / "p", prefix=prefix)
    assert package.NAME.fullmatch("a" * 31) and package.NAME.fullmatch("left_2")


def test_a_struct_without_a_header_cannot_be_exported() -> None:
    assert package._header_of("Protection").startswith("srm/control/")
    with pytest.raises(rl.ParameterError, match="no header defines srm::Nothing; the law cannot"):
        package._header_of("Nothing")


def test_phases_and_bridges_that_firmware_does_not_have_are_refused() -> None:
    shared = drive("shared_switch")
    with pytest.raises(rl.ParameterError, match="bridge = 'shared_switch' cannot be exported"):
        package.described(shared)
    six = Namespace(machine=Namespace(n_phases=6))
    with pytest.raises(rl.ParameterError, match="n_phases = 6, need 3 to 5 for export"):
        package.described(six)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"n_phases": 4}, "phases = 4, deadbeat has 3; give the drive file that was flashed"),
        ({"fingerprint": 8}, "is of fingerprint 0x00000008, deadbeat exports 0x00000007"),
        ({"state_words": 9}, "a state of 9 words, need 5; replay it with the release"),
    ],
)
def test_a_dump_of_another_package_is_refused(
    change: dict[str, int], told: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    dump = {"n_phases": 3, "fingerprint": 7, "state_words": 5, "segments": [], "status": 0}
    monkeypatch.setattr(replay_dump, "read_dump", lambda _: Namespace(**dump | change))
    made = Namespace(folder=Path("p"), fingerprint=7)
    monkeypatch.setattr(replay_dump, "firmware", lambda *_: made)
    desk = Namespace(state_words=5, describe=lambda status: f"status {status}")
    monkeypatch.setattr(replay_dump, "DeskPackage", lambda *_: desk)
    with pytest.raises(rl.ParameterError, match=told):
        replay_dump.replay_dump("d.bin", drive())
    with pytest.raises(rl.ParameterError, match="what a law has learned is not replayed"):
        replay_dump.replay_dump("d.bin", drive("deadbeat_learning"))


def test_a_law_that_learns_or_has_a_long_name_has_no_form_in_the_c_interface(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    exported_controller(drive())
    with pytest.raises(rl.ParameterError, match="learn = true has no form in the C interface"):
        exported_controller(drive("deadbeat_learning"))
    for letters, taken in ((24, True), (25, False)):
        name = "x" * letters
        monkeypatch.setattr(_core, "law_of", lambda _, name=name: name)
        if taken:
            exported_controller(drive())
            continue
        with pytest.raises(rl.ParameterError, match=f"the law `{name}` has no name of 1 to 24"):
            exported_controller(drive())


def test_every_sample_is_computed_again_from_the_state_of_its_segment(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Two segments of three samples; the desk differs at two samples of the second."""
    records = np.zeros(3, [("status", "<i4"), ("mode", "<i4")])
    segments = [Namespace(first=n, state=n, records=records.copy()) for n in (100, 200)]
    monkeypatch.setattr(replay_dump, "ANSWERS", ("status", "mode"))
    calls: list[int] = []

    class Desk:
        state_words = 5

        def restore(self, state: int) -> None:
            calls.append(state)

        def run(self, row: np.ndarray) -> np.ndarray:
            calls.append(len(row))
            other = row.copy()
            other["mode"] = 7 if len(calls) in (7, 8) else 0
            return other

        def describe(self, status: int) -> str:
            return f"status {status}"

    desk = Desk()
    monkeypatch.setattr(replay_dump, "DeskPackage", lambda *_: desk)
    made = Namespace(folder=Path("p"), fingerprint=7)
    monkeypatch.setattr(replay_dump, "firmware", lambda *_: made)
    for status, cause in ((0, "trigger"), (4, "status 4")):
        calls.clear()
        dump = {"n_phases": 3, "fingerprint": 7, "state_words": 5, "status": status}
        kept = Namespace(**dump, segments=segments)
        monkeypatch.setattr(replay_dump, "read_dump", lambda _, kept=kept: kept)
        found = replay_dump.replay_dump("d.bin", drive())
        assert calls == [100, 1, 1, 1, 200, 1, 1, 1]
        assert (found.different, found.cause, found.exact) == (2, cause, False)
        assert found.first == replay_dump.Difference(201, "mode", "0", "7")


def test_a_unit_is_of_version_2_or_3_and_of_a_known_part(tmp_path: Path) -> None:
    """The same files make the same archive, whatever their order."""
    unit = import_module("reluctance.targets.export.fmu")
    for given, told in (
        ({"version": 1}, "version = 1, need 2 or 3"),
        ({"version": 4}, "version = 4"),
        ({"part": "pump"}, "part = 'pump', need one of drive, stage, controller"),
    ):
        with pytest.raises(rl.ParameterError, match=told):
            unit.fmu(drive(), tmp_path / "a.fmu", **given)  # type: ignore[arg-type]
    unit._zip(tmp_path / "a.zip", {"b": b"2", "a": b"1"})
    unit._zip(tmp_path / "b.zip", {"a": b"1", "b": b"2"})
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert archive.namelist() == ["a", "b"] and archive.read("b") == b"2"
