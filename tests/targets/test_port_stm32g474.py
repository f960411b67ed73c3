"""The reference port to the STM32G474: registers by the maker's description, the timer as a model,
the plant in the loop, and the image for the target."""

import copy
import csv
import ctypes
import json
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from firmware_tools import ROOT, needs_target
from stm32g474 import ADDRESS, INTERRUPT, REGISTER, TIMERS, Hrtim, field, word_of

import reluctance as rl
from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.targets.export import firmware
from reluctance.targets.export.on_desk import SOURCES
from reluctance.targets.export.target import PHASE
from reluctance.targets.export.verdict import PORT_CODE_B, PORT_RAM_B

FILE = ROOT / "examples" / "deadbeat_g474.toml"
CLOCK = 170e6
ADC = ("ADC1", "ADC2", "ADC3")
CONVERSION = 340  # ticks from the trigger to the interrupt: two channels at 42.5 MHz
ALL_OUTPUTS = 0b111111
TO_RUN = 1600  # periods of precharge, calibration and ready

# Not in the maker's description, but in its low-level driver (stm32g4xx_ll_adc.h):
# LL_ADC_INJ_TRIG_EXT_HRTIM_TRG2 = ADC_JSQR_JEXTSEL_4 | _1 | _0, LL_ADC_INJ_TRIG_EXT_RISING = 1.
HRTIM_TRG2, RISING = 0b10011, 1
# Of the core, by the Cortex-M4 technical reference manual: interrupt set-enable 0.
ADDRESS["NVIC.ISER0"] = 0xE000E100
REGISTER[ADDRESS["NVIC.ISER0"]] = "NVIC.ISER0"

SEEN = ctypes.CFUNCTYPE(None, ctypes.c_uint32, ctypes.c_uint32)


class Port:
    """The port on the desk, its timers the model."""

    def __init__(self, folder):
        self.drive = rl.load(FILE)
        package = firmware(self.drive, folder / "package", port="stm32g474").folder
        self.package = package
        mock = ROOT / "tests" / "firmware" / "mocked_registers.c"
        port = ("stm32g474/board.c", "stm32g474/drive.c", str(mock))
        warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wno-sign-conversion", "-Werror"]
        flags = ["-O1", "-DREGISTERS_MOCKED", "-I.", "-Iinclude", *warnings]
        library = build([*SOURCES, *port], "port.so", flags, folder=package, what="the port")
        self.library = ctypes.CDLL(str(library))
        self.library.peek.restype = self.library.touched_at.restype = ctypes.c_uint32
        self.library.port_orders.restype = ctypes.c_void_p
        for name in ("peek", "poke"):
            getattr(self.library, name).argtypes = [ctypes.c_uint32] * (2 if name == "poke" else 1)
        self.timers = Hrtim()
        self._seen = SEEN(self._write)
        self.library.on_write(self._seen)
        self.library.main()
        self.library.settle()
        self.sequence = 0
        self.ask(enable=0)
        self.advance = self.drive.machine.N_r * self.drive.omega_nominal * self.drive.control.T_s
        self.theta_e = -(TO_RUN + 1) * self.advance

    def _write(self, address, word):
        name = REGISTER.get(address, "")
        if name.startswith("HRTIM"):
            self.library.poke(address, self.timers.write(name, word))
            self._reads()

    def _reads(self):
        for name, word in self.timers.reads().items():
            self[name] = word

    def __getitem__(self, name):
        return self.library.peek(ADDRESS[name])

    def __setitem__(self, name, word):
        self.library.poke(ADDRESS[name], word)

    def field(self, register, name):
        return field(self[register], register, name)

    def ask(self, *, enable=1, clear=0, reference=0.0):
        """What the main loop asks for; a new command each time."""
        words = np.zeros(5, "<u4")
        self.sequence += 1
        words[:4] = enable, clear, 0, self.sequence
        words[4] = np.float32(reference).view(np.uint32)
        symbol = (ctypes.c_uint32 * 5).in_dll(self.library, "port_request")
        symbol[:] = words.tolist()

    def period(self, i=(0.0, 0.0, 0.0), theta_e=None, u_dc=240.0, *, late=False):
        """A control period of the timers, from one's beginning to the next's, with the interrupt at
        these readings once they are converted; late: with the next period begun by its end. Without
        an angle the rotor turns on."""
        if theta_e is None:
            self.theta_e = theta_e = (self.theta_e + self.advance) % (2 * np.pi)
        step = self.drive.sensing.i_range_A / 4096
        for adc, current in zip(ADC, i, strict=True):
            self[f"{adc}.JDR1"] = min(max(round(current / step) + 64, 0), 4095)
        self["ADC1.JDR2"] = round(u_dc / (1.25 * 300 / 4096))
        counts, N_r = self.drive.sensing.encoder_counts, self.drive.machine.N_r
        self["TIM3.CNT"] = round(theta_e / (2 * np.pi) * counts) // N_r
        self.timers.run(CONVERSION - self.timers.master.count)
        self._reads()
        if late:
            self.timers.write = self._late(self.timers.write)
        self.library.ADC1_2_IRQHandler()
        self.library.settle()
        self.timers.to_roll_over()
        self._reads()

    def _late(self, write):
        """The next write of the timer's registers comes a whole period late."""

        def delayed(name, word):
            self.timers.write = write
            told = write(name, word)
            self.timers.run(self.timers.master.active["PERR"])
            return told

        return delayed

    def orders(self):
        """What the step ordered."""
        address = self.library.port_orders()
        return np.frombuffer(ctypes.string_at(address, 3 * PHASE.itemsize), PHASE)

    def next_period(self):
        """Of the period that begins now, with the outputs enabled: for each leg the ticks at which
        its pins change from the first levels on, and its states."""
        timers = copy.deepcopy(self.timers)
        assert timers.master.count == 0
        timers.enabled = ALL_OUTPUTS
        timers.run(3)  # the first levels are set by then
        states, ticks = [[timers.state(k)] for k in range(3)], [[] for _ in range(3)]
        timers.shown = [timers.state(k) for k in range(3)]
        timers.changes.clear()
        begin = timers.time - 3
        timers.run(timers.master.active["PERR"] - 4)
        for time, k, state in timers.changes:
            ticks[k].append(time - begin)
            states[k].append(state)
        return list(zip(ticks, states, strict=True))

    def to_run(self, reference):
        """Through precharge, calibration and ready. The first time, the next angle is zero."""
        self.ask()
        for _ in range(TO_RUN - 1):
            self.period()
        self.ask(reference=reference)
        self.period()


@pytest.fixture
def port(tmp_path):
    return Port(tmp_path)


def test_every_register_that_the_port_uses_is_in_the_makers_description(port):
    port.to_run(reference=5.0)
    used = {port.library.touched_at(n) for n in range(port.library.touched())}
    assert {hex(address) for address in used - set(REGISTER)} == set()
    assert len(used) >= 90


def test_the_clock_tree_gives_170_mhz(port):
    """24 MHz / 6 * 85 / 2, full words: no other bit is set."""
    assert port["RCC.PLLCFGR"] == word_of(
        "RCC.PLLCFGR", PLLSRC=3, PLLM=6 - 1, PLLN=85, PLLREN=1, PLLR=0
    )
    assert 24e6 / 6 * 85 / 2 == CLOCK
    assert port.field("RCC.CR", "HSEON") == port.field("RCC.CR", "PLLON") == 1
    assert port["RCC.CFGR"] == word_of("RCC.CFGR", SW=3)  # the PLL, not divided
    assert port.field("PWR.CR5", "R1MODE") == 0  # boost
    assert port["FLASH.ACR"] == word_of("FLASH.ACR", LATENCY=4, PRFTEN=1, ICEN=1, DCEN=1)
    assert port["RCC.APB2ENR"] == word_of("RCC.APB2ENR", HRTIM1EN=1)
    assert port["RCC.APB1ENR1"] == word_of("RCC.APB1ENR1", TIM3EN=1, PWREN=1)
    assert port["RCC.AHB2ENR"] == word_of(
        "RCC.AHB2ENR", GPIOAEN=1, GPIOBEN=1, GPIOCEN=1, ADC12EN=1, ADC345EN=1
    )


def test_the_timers_run_at_the_control_period_and_start_the_converters(port):
    ticks = round(port.drive.control.T_s * CLOCK)
    counters = dict(CKPSC=5, CONT=1)  # a tick is one period of 170 MHz
    assert port["HRTIM_MASTER.PERR"] == ticks
    assert port["HRTIM_MASTER.CR"] == word_of(
        "HRTIM_MASTER.CR", **counters, MCEN=1, TACEN=1, TBCEN=1, TCCEN=1
    )
    assert port["HRTIM_MASTER.CMP1R"] == 3
    assert port["HRTIM_COMMON.ADC2R"] == word_of("HRTIM_COMMON.ADC2R", MPER=1)
    for name in TIMERS:
        timer = f"HRTIM_TIM{name}"
        assert port[f"{timer}.PERR"] == ticks
        assert port[f"{timer}.CR"] == word_of(f"{timer}.CR", **counters, TRSTU=1, PREEN=1)
    for adc, channels in zip(ADC, ((1, 3), (2,), (1,)), strict=True):
        places = {f"JSQ{n + 1}": channel for n, channel in enumerate(channels)}
        sequence = dict(JL=len(channels) - 1, JEXTSEL=HRTIM_TRG2, JEXTEN=RISING, **places)
        assert port[f"{adc}.JSQR"] == word_of(f"{adc}.JSQR", **sequence)
        assert port[f"{adc}.SMPR1"] == word_of(f"{adc}.SMPR1", SMP1=2, SMP2=2, SMP3=2)  # 12.5
        assert port[f"{adc}.CFGR"] == word_of(f"{adc}.CFGR", JQDIS=1)  # 12 bits, right
        assert port[f"{adc}.CR"] == word_of(f"{adc}.CR", ADVREGEN=1, ADEN=1, JADSTART=1)
    for common in ("ADC12_COMMON", "ADC345_COMMON"):
        assert port[f"{common}.CCR"] == word_of(f"{common}.CCR", CKMODE=3)
    assert port["ADC1.IER"] == word_of("ADC1.IER", JEOSIE=1)
    assert port["NVIC.ISER0"] == 1 << INTERRUPT


def started(order, timers=None):
    """The model after this order of set-up: when the preload is switched on, and what updates."""
    timers = timers or Hrtim()
    runs = dict(CKPSC=5, CONT=1)
    timers.write("HRTIM_MASTER.CR", word_of("HRTIM_MASTER.CR", **runs))
    timers.write("HRTIM_MASTER.PERR", 8500)
    for action in order:
        for name in TIMERS:
            timer = f"HRTIM_TIM{name}"
            if action == "preload":
                control = word_of(f"{timer}.CR", **runs, TRSTU=1, PREEN=1)
                timers.write(f"{timer}.CR", control)
            elif action == "period":
                timers.write(f"{timer}.PERR", 8500)
            else:
                update = word_of("HRTIM_COMMON.CR2", **{f"T{name}SWU": 1})
                timers.write("HRTIM_COMMON.CR2", update)
    on = word_of("HRTIM_MASTER.CR", **runs, MCEN=1, TACEN=1, TBCEN=1, TCCEN=1)
    timers.write("HRTIM_MASTER.CR", on)
    timers.run(20 * 8500 + 1234)
    return timers.behind()


def test_a_period_that_waits_in_its_preload_register_sets_the_timers_out_of_phase():
    """The first period is then the reset value of 65 503 ticks; 65 503 mod 8 500 = 6 003."""
    assert started(["preload", "period"]) == [6003] * 3
    assert started(["preload", "period", "update"]) == [0] * 3
    assert started(["period", "preload"]) == [0] * 3


def test_the_timers_are_in_phase_with_the_master_from_the_start_and_after_a_trip(port):
    ticks = round(port.drive.control.T_s * CLOCK)
    port.to_run(reference=5.0)
    assert port.timers.behind() == [0] * 3
    port.timers.fault(True)
    port.period()
    assert port.timers.enabled == 0
    port.timers.fault(False)
    port.ask(enable=0, clear=1)
    port.period()  # clears the latch of the timer
    port.period()  # clears the fault of the controller
    port.to_run(reference=5.0)
    assert port.timers.enabled == ALL_OUTPUTS
    assert port.timers.behind() == [0] * 3
    assert set(np.diff(port.timers.conversions)) == {ticks}
    assert port.timers.conversions[0] == ticks


def test_no_switch_conducts_before_the_drive_runs_nor_out_of_its_orders_as_it_begins(port):
    """From power-up through precharge, and in the period in which the outputs are enabled."""
    port.to_run(reference=5.0)
    assert port.timers.enabled == ALL_OUTPUTS
    assert port.timers.changes == []
    assert any(states != [-1] for _, states in port.next_period())


def test_the_trip_input_takes_all_outputs_off_without_software(port):
    assert port["HRTIM_COMMON.FLTINR1"] == word_of(
        "HRTIM_COMMON.FLTINR1", FLT1E=1, FLT1P=1, FLT1SRC=0, FLT1F=2
    )
    for name in TIMERS:
        timer = f"HRTIM_TIM{name}"
        assert port[f"{timer}.FLTR"] == word_of(f"{timer}.FLTR", FLT1EN=1)
        # Inactive at a fault, active is high, no dead time: the switches are not complementary.
        assert port[f"{timer}.OUTR"] == word_of(f"{timer}.OUTR", FAULT1=2, FAULT2=2)
    assert port.timers.enabled == 0  # nothing is enabled before the drive runs
    port.to_run(reference=5.0)
    assert port.timers.enabled == ALL_OUTPUTS
    port.timers.fault(True)
    assert [port.timers.state(k) for k in range(3)] == [-1, -1, -1]
    port.timers.fault(False)
    port.timers.run(8500)
    assert [port.timers.state(k) for k in range(3)] == [-1, -1, -1]


def pins():
    """(register, field, value) of each pin by the assumption sheet."""
    for at, number, mode, function in (
        *(("A", n, 3, 0) for n in (0, 1, 2)),
        ("B", 1, 3, 0),
        *(("A", n, 2, 13) for n in (8, 9, 10, 11, 12)),
        *(("B", n, 2, 13) for n in (12, 13)),
        *(("A", n, 2, 2) for n in (6, 7)),
        *(("C", n, 1, 0) for n in (0, 1, 2)),
    ):
        half = "L" if number < 8 else "H"
        yield f"GPIO{at}.MODER", f"MODER{number}", mode
        yield f"GPIO{at}.AFR{half}", f"AFR{half}{number}", function


def test_the_pins_are_those_of_the_assumption_sheet(port):
    for register, name, value in pins():
        assert port.field(register, name) == value
    assert port["TIM3.ARR"] == port.drive.sensing.encoder_counts - 1
    assert port["TIM3.SMCR"] == word_of("TIM3.SMCR", SMS=3)  # both edges of both
    assert port["TIM3.CCMR1_INPUT"] == word_of("TIM3.CCMR1_INPUT", CC1S=1, CC2S=1)
    assert port["TIM3.CR1"] == word_of("TIM3.CR1", CEN=1)


def test_the_watchdog_is_fed_by_a_step_in_time_only(port):
    assert port["IWDG.RLR"] == 20  # of 8 kHz: 50 periods
    port.to_run(reference=0.0)
    port["IWDG.KR"] = 0
    port.period()
    assert port["IWDG.KR"] == 0xAAAA
    port["IWDG.KR"] = 0
    port.period(late=True)
    assert port["IWDG.KR"] == 0
    assert port.timers.enabled == 0
    port.period()
    assert port.timers.enabled == 0  # the drive has tripped
    assert (port.orders()["leg"] == -1).all()
    assert port["IWDG.KR"] == 0  # until a person clears the fault, or the watchdog resets
    port.ask(enable=0, clear=1)
    port.period()
    assert port["IWDG.KR"] == 0xAAAA


def test_outputs_are_enabled_once_so_that_a_trip_lasts(port):
    """A trip that comes after the request is read is seen one period later: until then software
    must not enable what the hardware has disabled, even if the trip's cause has gone."""
    port.to_run(reference=5.0)
    assert port.timers.enabled == ALL_OUTPUTS
    port.timers.enabled = 0  # a trip that is not seen in the latch
    port.period()
    assert port.timers.enabled == 0


def test_a_hardware_trip_ends_the_run_until_a_person_clears_it(port):
    port.to_run(reference=5.0)
    gates = word_of("GPIOC.BSRR", BS0=1, BS1=1)  # gate enable, precharge relay
    assert port["GPIOC.BSRR"] == gates | word_of("GPIOC.BSRR", BR2=1)
    port.timers.fault(True)
    port.timers.fault(False)
    assert port.timers.latched
    port.period()
    assert port.timers.enabled == 0
    assert port["GPIOC.BSRR"] == word_of("GPIOC.BSRR", BR0=1, BR1=1, BR2=1)
    assert port.next_period() == [([], [-1])] * 3
    port.ask(enable=0, clear=1)
    port.period()
    assert not port.timers.latched
    for _ in range(20):
        port.ask()
        port.period()
    assert port.field("GPIOC.BSRR", "BS0") == 0  # precharge again, not run
    assert port.timers.enabled == 0


def test_a_trip_whose_cause_lasts_cannot_be_cleared(port):
    port.to_run(reference=5.0)
    port.timers.fault(True)
    port.period()
    port.ask(enable=0, clear=1)
    port.period()
    assert port.timers.latched
    port.to_run(reference=5.0)
    assert port.timers.enabled == 0


def test_the_port_drives_the_plant_as_the_simulation_does(port):
    """Readings go into the converters' registers; what comes back is what the pins of the timers
    show in the period that follows."""
    drive, T_s = port.drive, port.drive.control.T_s
    reference = float(drive.reference.course[1][0])
    columns = _core.ORDER_COLUMNS
    worst = []

    def step(y, asked):
        port.ask(reference=asked)
        port.period(y.i, y.theta_e, y.u_dc)
        row = []
        for order, (ticks, states) in zip(port.orders(), port.next_period(), strict=True):
            worst.append(decoded(order, ticks, states, T_s))
            found = dict.fromkeys(columns, 0.0)
            found |= {"gate": 1.0} | {f"leg_{n}": float(states[-1]) for n in range(5)}
            found |= {f"leg_{n}": float(state) for n, state in enumerate(states)}
            edges = [tick / CLOCK for tick in ticks] + [1e30] * (4 - len(ticks))
            found |= {f"t_edge_{n}": edge for n, edge in enumerate(edges)}
            row += [found[name] for name in columns]
        return [*row, reference]

    port.to_run(reference)
    closed = rl.simulate(
        drive, until=0.05, record=None, controller=_core.controller_from(3, step)
    ).kpis
    plain = rl.simulate(drive, until=0.05, record=None).kpis
    assert max(worst) <= 1.0
    assert (ctypes.c_uint32 * 2).in_dll(port.library, "port")[1] == 0  # no order was refused
    assert closed.tau_mean == pytest.approx(plain.tau_mean, rel=0.01)
    assert closed.torque_error_rms == pytest.approx(plain.torque_error_rms, rel=0.1)


def decoded(order, ticks, states, T_s):
    """Greatest distance [ticks] of a register's edge from one that was ordered; the states between
    edges must be the ordered ones. A state that lasts no time is none."""
    edges = [*order["t_edge"], np.inf]
    kept = [n for n in range(4) if edges[n] < T_s and edges[n] < edges[n + 1]]
    legs = [int(order["leg"][0])] + [int(order["leg"][n + 1]) for n in kept]
    times = [float(order["t_edge"][n]) * CLOCK for n in kept]
    wanted, now = [], legs[0]
    for time, leg in zip(times, legs[1:], strict=True):
        if leg != now:
            wanted.append(time)
        now = leg
    merged = [legs[0]] + [b for a, b in pairwise(legs) if a != b]
    assert states == merged
    return max((abs(a - b) for a, b in zip(ticks, wanted, strict=True)), default=0.0)


@needs_target
def test_the_image_for_the_target_has_its_fast_code_in_ccm(tmp_path):
    made = firmware(rl.load(FILE), tmp_path / "package", port="stm32g474").folder / "stm32g474"
    subprocess.run(["make", "-s"], cwd=made, check=True)
    image = made / "build" / "drive.elf"
    listed = subprocess.run(
        ["arm-none-eabi-nm", str(image)], capture_output=True, text=True, check=True
    ).stdout
    symbols = {line.split()[2]: int(line.split()[0], 16) for line in listed.splitlines()}
    fast = (
        "ADC1_2_IRQHandler",
        "reluctance_run",
        "reluctance_edges",
        "board_write_orders",
        "memcpy",
    )
    for name in fast:
        assert 0x10000000 <= symbols[name] < 0x10008000
    subprocess.run(
        ["arm-none-eabi-objcopy", "-O", "binary", "-j", ".vectors", str(image), "vectors"],
        cwd=made,
        check=True,
    )
    vectors = np.fromfile(made / "vectors", "<u4")
    assert vectors[0] == 0x20000000 + 96 * 1024
    assert vectors[1] == symbols["reset"] | 1
    assert vectors[16 + INTERRUPT] == symbols["ADC1_2_IRQHandler"] | 1
    assert len(vectors) == 16 + 102


@needs_target
def test_the_port_takes_no_more_than_the_verdict_says_and_links_up_to_there(tmp_path):
    """Beside controller and tables. The recorder has what they leave."""
    made = firmware(rl.load(FILE), tmp_path / "package", port="stm32g474").folder / "stm32g474"

    for name, there in (("Makefile", "startup.o"), ("link.ld", "*recorder.o(.rodata*)")):
        more = {"Makefile": "more.o", "link.ld": "KEEP(*more.o(.rodata*))"}[name]
        text = (made / name).read_text()
        (made / name).write_text(text.replace(there, f"{there} {more}"))

    def linked(more_B=0):
        (made.parent / "more.cpp").write_text(f"extern const char more[{more_B} + 1] = {{1}};\n")
        return subprocess.run(["make", "-s"], cwd=made, capture_output=True, text=True)

    assert linked().returncode == 0
    sizes = subprocess.run(
        ["arm-none-eabi-size", "-A", "controller.o", "drive.elf"],
        **{"cwd": made / "build", "capture_output": True, "text": True, "check": True},
    ).stdout.replace("size", "0")
    of_controller, of_image = (
        {words[0]: int(words[1]) for words in map(str.split, part.splitlines()) if len(words) == 3}
        for part in sizes.split("drive.elf")
    )
    code = sum(v for k, v in of_controller.items() if k.startswith(".text"))
    tables = sum(v for k, v in of_controller.items() if k.startswith(".rodata"))
    assert code < of_image[".fast"] <= code + PORT_CODE_B
    assert of_image[".data"] + of_image[".bss"] + 4096 <= tables + PORT_RAM_B
    most = 96 * 1024 - PORT_RAM_B - tables
    assert linked(most - 64).returncode == 0
    assert "less than 4 KiB are left for the stack" in linked(96 * 1024 - 6000).stderr


@pytest.mark.parametrize(
    "change, message",
    [
        ({"sensing.delay_samples": 0}, "delay_samples = 1"),
        ({"sensing.adc_bits": 10}, "adc_bits = 12"),
        ({"converter.min_pulse_us": 0}, "min_pulse_us"),
        ({"control.T_s_us": 50.001}, "need a whole number"),
        ({"machine": "generic_1hp_8_6", "reference.tau_Nm": 2.0}, "machine with three phases"),
    ],
)
def test_a_drive_that_the_port_cannot_run_is_refused(change, message, tmp_path):
    with pytest.raises(rl.ParameterError, match=message):
        firmware(rl.load(FILE).with_values(change), tmp_path / "package", port="stm32g474")
    with pytest.raises(rl.ParameterError, match="need one of: stm32g474"):
        firmware(rl.load(FILE), tmp_path / "package", port="stm32f030")


@needs_target
@pytest.mark.long
def test_the_example_has_the_numbers_of_the_table_and_the_verdict_says_that_it_fits(tmp_path):
    with (ROOT / "bench" / "g474.csv").open() as file:
        row = next(r for r in csv.DictReader(file) if r["case"] == "deadbeat 50 us")
    done = subprocess.run(
        [
            *(sys.executable, "-m", "reluctance", "export", "firmware", str(FILE), "--json"),
            *("--out", str(tmp_path / "package"), "--port", "stm32g474", "--mcu", "stm32g474"),
        ],
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    told = json.loads(done.stdout)
    assert all(answer["fits"] for answer in told["verdict"]) == (row["fits"] == "yes")
    assert f"{row['instructions_max']} instructions" in told["verdict"][0]["reason"]
    assert "warnings" not in told
    kpis = rl.simulate(rl.load(FILE), record=None).kpis
    assert kpis.torque_error_rms == pytest.approx(float(row["torque_error_rms"]), abs=1e-5)
