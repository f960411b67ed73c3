"""Whether a drive's controller can run on a board: what its drive file leaves out, and whether a
microcontroller has the time, the timers, the comparators and the memory for it."""

from __future__ import annotations

from dataclasses import dataclass

from reluctance.base.errors import ParameterError
from reluctance.drive.drive import Drive
from reluctance.drive.run.safety import coarse_angle
from reluctance.targets.export.cost import Cost
from reluctance.targets.export.target import Cpu

LATE = 0.1  # of the period: a step that takes longer is not "at once"
LOAD = 0.8  # of the period that the step may take; the rest is for conversion and all other code
TIMER, COMPARATOR, WINDOW = 1, 2, 3  # gates, as in reluctance_controller.h
LEVELS = {"analog": 3, "two_level": 2, "sampled": 0}  # comparators a phase, each with its DAC


@dataclass(frozen=True)
class Mcu:
    """A microcontroller, by its data sheet. Cycles per instruction hold without wait states."""

    name: str
    core: Cpu
    clock_MHz: float
    cpi: tuple[float, float]  # cycles per instruction, least and most
    flash_KiB: int
    ram_KiB: int
    timers: int  # units with four compare values and two outputs
    comparators: int  # with a DAC each
    code: tuple[str, int]  # memory without wait states for code, and its size [KiB]
    tables: tuple[str, int]  # likewise for tables and stack
    wait: int  # cycles of the core that an instruction out of flash may wait


# Of the manufacturer's data sheets and manuals (DS12288, RM0440; DS12110, RM0433). Cycles: a model
# of the Cortex-M4F without wait states gives 1.6 to 2.1 (docs/firmware.md); that of the Cortex-M7
# is an assumption. Flash: four wait states, at 170 MHz of the core on the G474, whose cache holds
# 1 KiB of code; of the bus, at half the core's clock, on the H743.
MCUS = {
    "stm32g474": Mcu(
        *("stm32g474", "cortex-m4", 170.0, (1.6, 2.1), 512, 128, 6, 7),
        *(("CCM SRAM", 32), ("SRAM", 96), 4),
    ),
    "stm32h743": Mcu(
        *("stm32h743", "cortex-m7", 480.0, (1.0, 1.5), 2048, 1024, 5, 2),
        *(("ITCM", 64), ("DTCM", 128), 8),
    ),
}


# What a port has beside the controller where nothing waits: interrupt, registers and recorder; a
# stack of 4 KiB, and state. The recorder's memory is what is left (firmware/ports).
PORT_CODE_B, PORT_RAM_B = 7 * 1024, 6 * 1024


def mcu(name: str) -> Mcu:
    """The microcontroller of this name.

    Raises
    ------
    ParameterError
        If it is not in the table.
    """
    if name not in MCUS:
        raise ParameterError(f"microcontroller {name!r}, need one of: {', '.join(MCUS)}")
    return MCUS[name]


def left_out(drive: Drive, gates: set[int]) -> list[str]:
    """What a board has and the drive file does not: one line each."""
    sensing, found = drive.sensing, []
    if drive.faults.each:
        found.append("[[faults]] are left out: they act in simulations, and firmware ignores them")
    if sensing.adc_bits == 0:
        found.append("current sensors are ideal: set [sensing] adc_bits, i_range_A and i_noise_LSB")
    elif sensing.i_noise_LSB == 0:
        found.append("current sensors have no noise: set [sensing] i_noise_LSB")
    if not sensing.counted_angle:
        found.append("the angle sensor is ideal: set [sensing] encoder_counts or hall")
    found += coarse_angle(drive)
    if sensing.delay_samples == 0:
        found.append(
            f"orders act at the sample: a step longer than {LATE * drive.control.T_s_us:g} us "
            "comes later than simulated; set [sensing] delay_samples = 1"
        )
    if gates & {COMPARATOR, WINDOW} and sensing.comparators != "sampled":
        count = LEVELS[sensing.comparators] * drive.machine.n_phases
        found.append(
            f"the law orders comparators: the board needs {count} of them with DACs, or [sensing] "
            'comparators = "two_level" or "sampled"'
        )
    return found


def verdict(
    drive: Drive, part: Mcu, spent: Cost, gates: set[int], *, ported: bool = False
) -> list[tuple[bool, str]]:
    """Whether the microcontroller suffices, and why: one (yes or no, reason) each. ported: with the
    port of the package."""
    T_s_us = drive.control.T_s_us
    least, most = (spent.instructions_max * cpi / part.clock_MHz for cpi in part.cpi)
    allowed = T_s_us * (LOAD if drive.sensing.delay_samples else LATE)
    n_phases = drive.machine.n_phases
    (code, code_KiB), (tables, tables_KiB) = part.code, part.tables
    code_B, tables_B, beside = spent.text, spent.rodata + spent.stack, ""
    if ported:
        code_B, tables_B, beside = (
            spent.text + PORT_CODE_B,
            spent.rodata + PORT_RAM_B,
            ", with port",
        )
    waiting = most + spent.instructions_max * part.wait / part.clock_MHz
    rows = [
        (
            most <= allowed,
            f"step: {least:.1f} to {most:.1f} us at {part.clock_MHz:g} MHz "
            f"({spent.instructions_max} instructions, {part.cpi[0]:g} to {part.cpi[1]:g} cycles "
            f"each without wait states); the period of {T_s_us:g} us allows {allowed:.3g} us with "
            f"delay_samples = {drive.sensing.delay_samples}",
        ),
        (
            code_B <= code_KiB * 1024 and tables_B <= tables_KiB * 1024,
            f"memory without wait states{beside}: {code_B / 1024:.1f} KiB of code in {code} of "
            f"{code_KiB} KiB, "
            f"{tables_B / 1024:.1f} KiB of tables and stack in {tables} of {tables_KiB} KiB; if "
            f"each instruction waited {part.wait} cycles for flash, the step would take "
            f"{waiting:.1f} us",
        ),
        (
            part.timers >= n_phases,
            f"timers: {n_phases} legs of {part.timers} units with four compare values",
        ),
        (
            code_B + spent.rodata <= part.flash_KiB * 1024,
            f"flash{beside}: {(code_B + spent.rodata) / 1024:.1f} KiB of {part.flash_KiB}",
        ),
        (
            spent.stack + 2048 <= part.ram_KiB * 1024,
            f"RAM: {spent.stack} B of stack and 2 KiB of state and orders, of {part.ram_KiB} KiB",
        ),
    ]
    if gates & {COMPARATOR, WINDOW}:
        count = LEVELS[drive.sensing.comparators] * n_phases
        rows.append(
            (
                part.comparators >= count,
                f"comparators: {count} with DACs for the orders, of {part.comparators}; the "
                "hardware trip takes more",
            )
        )
    return rows
