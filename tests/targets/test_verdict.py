"""What `export firmware` says of a drive file and of a microcontroller."""

from dataclasses import replace

import pytest
from firmware_tools import ROOT

import reluctance as rl
from reluctance.targets.export.cost import Cost
from reluctance.targets.export.package_text import gates_of
from reluctance.targets.export.verdict import left_out, mcu, verdict

STEP = Cost("", "", "cortex-m4", 1, True, 3000.0, 4000, 20_000, 30_000, 0, 1000, ())


def example(name, *overrides):
    return rl.load(ROOT / "examples" / f"{name}.toml", list(overrides))


@pytest.mark.parametrize(
    "name, words",
    [
        (
            "sharing_cubic",
            ["current sensors are ideal", "angle sensor", "act at the sample", "9 of"],
        ),
        ("paper_rated", ["current sensors are ideal", "angle sensor", "act at the sample", "9 of"]),
        ("deadbeat", ["current sensors are ideal", "angle sensor", "act at the sample"]),
        ("edge_mpc_mcu", ["no noise: set [sensing] i_noise_LSB"]),
    ],
)
def test_what_the_drive_file_leaves_out_is_said(name, words):
    given = example(name)
    found = left_out(given, gates_of(given))
    assert len(found) == len(words)
    for word, line in zip(words, found, strict=True):
        assert word in line


def test_comparators_that_the_board_need_not_have_are_not_asked_for():
    for comparators, count in (("analog", "9 of"), ("two_level", "6 of"), ("sampled", None)):
        given = example("sharing_cubic", f"sensing.comparators={comparators}")
        lines = [line for line in left_out(given, gates_of(given)) if "comparators" in line]
        assert (count is None and not lines) or count in lines[0]


def test_the_verdict_compares_cycles_with_the_period():
    """4000 instructions at 2.1 cycles and 170 MHz take 49.4 us: 80 % of 62 us, not of 61."""
    for T_s_us, fits in ((61.0, False), (62.0, True)):
        given = example("edge_mpc_mcu", f"control.T_s_us={T_s_us}")
        (yes, reason), *_ = verdict(given, mcu("stm32g474"), STEP, {1})
        assert yes is fits
        assert "37.6 to 49.4 us" in reason


def test_the_cycles_hold_only_where_code_and_tables_need_not_wait():
    """4000 instructions at 2.1 + 4 cycles and 170 MHz take 143.5 us; CCM SRAM has 32 KiB."""
    given = example("edge_mpc_mcu", "control.T_s_us=200")
    for changes, fits in (
        ({"text": 32 * 1024}, True),
        ({"text": 32 * 1024 + 1}, False),
        ({"rodata": 95 * 1024}, True),
        ({"rodata": 96 * 1024 - 999}, False),
    ):
        rows = verdict(given, mcu("stm32g474"), replace(STEP, **changes), {1})
        yes, reason = next(row for row in rows if row[1].startswith("memory"))
        assert yes is fits
        assert "of code in CCM SRAM of 32 KiB" in reason
        assert "the step would take 143.5 us" in reason


def test_a_port_takes_memory_too():
    given = example("deadbeat_g474")
    for changes, fits in (
        ({"text": 25 * 1024}, True),
        ({"text": 25 * 1024 + 1}, False),
        ({"rodata": 90 * 1024}, True),
        ({"rodata": 90 * 1024 + 1}, False),
    ):
        spent = replace(STEP, **changes)
        (row,) = (r for r in verdict(given, mcu("stm32g474"), spent, {1}, ported=True)[1:2])
        assert row[0] is fits and row[1].startswith("memory without wait states, with port: ")
        assert verdict(given, mcu("stm32g474"), spent, {1})[1][0]


def test_without_a_delay_the_step_must_be_short():
    late = example("edge_mpc_mcu", "control.T_s_us=200", "sensing.delay_samples=0")
    assert not verdict(late, mcu("stm32g474"), STEP, {1})[0][0]
    assert verdict(late, mcu("stm32g474"), replace(STEP, instructions_max=1500), {1})[0][0]


def test_missing_comparators_memory_and_names_are_told():
    given = example("sharing_cubic", "sensing.delay_samples=1")
    answers = {r.partition(":")[0]: y for y, r in verdict(given, mcu("stm32h743"), STEP, {2})}
    assert answers["comparators"] is False  # 9 of 2
    assert answers["flash"] is True
    big = replace(STEP, rodata=600_000)
    rows = verdict(given, mcu("stm32g474"), big, {1})
    assert not next(yes for yes, reason in rows if reason.startswith("flash"))
    with pytest.raises(rl.ParameterError, match="need one of: stm32g474, stm32h743"):
        mcu("z80")
