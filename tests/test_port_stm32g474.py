"""The reference port to the STM32G474: registers as words of memory, the plant in the loop, and
the image for the target. Addresses and bits are those of RM0440, written a second time."""

import csv
import ctypes
import json
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from firmware_tools import ROOT, needs_target

import reluctance as rl
from reluctance import _core
from reluctance.export import firmware
from reluctance.export.target import PHASE

FILE = ROOT / "examples" / "deadbeat_g474.toml"
CLOCK = 170e6
RCC, FLASH, PWR, HRTIM, TIM3, IWDG = (
    *(0x40021000, 0x40022000, 0x40007000, 0x40016800, 0x40000400, 0x40003000),
)
ADC = (0x50000000, 0x50000100, 0x50000400)
GPIO = (0x48000000, 0x48000400, 0x48000800)
COMMON = HRTIM + 0x380
ALL_OUTPUTS = 0b111111


def timer(k):
    return HRTIM + 0x80 * (k + 1)


def bits(word, low, count):
    return word >> low & (1 << count) - 1


class Port:
    """The port on the desk."""

    def __init__(self, folder):
        self.drive = rl.load(FILE)
        package = firmware(self.drive, folder / "package", port="stm32g474").folder
        self.package = package
        flags = ["-O1", "-ffp-contract=off", "-fPIC", "-I.", "-Iinclude", "-c"]
        objects = []
        for source in ("controller", "run_time", "recorder", "peripherals"):
            objects.append(f"{source}.o")
            self._run("g++", "-std=c++20", *flags, f"{source}.cpp", "-o", objects[-1])
        mock = ROOT / "tests" / "firmware" / "mocked_registers.c"
        warnings = ["-std=c99", "-Wall", "-Wextra", "-Wconversion"]
        warnings += ["-Wno-sign-conversion", "-Werror"]
        for source in ("stm32g474/board.c", "stm32g474/drive.c", str(mock)):
            objects.append(f"{len(objects)}.o")
            self._run("gcc", *warnings, "-DREGISTERS_MOCKED", *flags, source, "-o", objects[-1])
        self._run("g++", "-shared", *objects, "-o", "port.so")
        self.library = ctypes.CDLL(str(package / "port.so"))
        self.library.peek.restype = ctypes.c_uint32
        self.library.port_orders.restype = ctypes.c_void_p
        for name in ("peek", "poke"):
            getattr(self.library, name).argtypes = [ctypes.c_uint32] * (2 if name == "poke" else 1)
        self.library.main()
        self.sequence = 0

    def _run(self, *command):
        subprocess.run(list(map(str, command)), cwd=self.package, check=True)

    def __getitem__(self, address):
        return self.library.peek(address)

    def __setitem__(self, address, word):
        self.library.poke(address, word)

    def ask(self, *, enable=1, clear=0, reference=0.0):
        """What the main loop asks for; a new command each time."""
        words = np.zeros(5, "<u4")
        self.sequence += 1
        words[:4] = enable, clear, 0, self.sequence
        words[4] = np.float32(reference).view(np.uint32)
        symbol = (ctypes.c_uint32 * 5).in_dll(self.library, "port_request")
        symbol[:] = words.tolist()

    def interrupt(self, i=(0.0, 0.0, 0.0), theta_e=0.0, u_dc=240.0):
        """One control interrupt at these readings."""
        step = self.drive.sensing.i_range_A / 4096
        for adc, current in zip(ADC, i, strict=True):
            self[adc + 0x80] = min(max(round(current / step) + 64, 0), 4095)
        self[ADC[0] + 0x84] = round(u_dc / (1.25 * 300 / 4096))
        counts, N_r = self.drive.sensing.encoder_counts, self.drive.machine.N_r
        self[TIM3 + 0x24] = round(theta_e / (2 * np.pi) * counts) // N_r
        self.library.ADC1_2_IRQHandler()

    def orders(self):
        """What the step ordered."""
        address = self.library.port_orders()
        return np.frombuffer(ctypes.string_at(address, 3 * PHASE.itemsize), PHASE)

    def legs(self, k):
        """Ticks at which leg k changes, and its states, as the registers have them."""
        at = timer(k)
        compare = [self[at + offset] for offset in (0x1C, 0x24, 0x28, 0x2C)]
        levels = []
        for set_, reset in ((0x3C, 0x40), (0x44, 0x48)):
            sets, resets = self[at + set_], self[at + reset]
            assert sets & resets == 0
            assert (sets | resets) & ~(0b1111 << 3 | 1 << 8) == 0  # compares, master compare 1
            assert (sets | resets) >> 8 & 1  # each period starts from a known level
            used = [n for n in range(4) if bits(sets | resets, 3 + n, 1)]
            changes = {compare[n]: bool(bits(sets, 3 + n, 1)) for n in used}
            levels.append((bool(sets >> 8 & 1), changes))
        ticks = sorted(set(levels[0][1]) | set(levels[1][1]))
        on = [level for level, _ in levels]
        states = [sum(on) - 1]
        for tick in ticks:
            on = [changes.get(tick, was) for was, (_, changes) in zip(on, levels, strict=True)]
            states.append(sum(on) - 1)
        return ticks, states

    def to_run(self, reference):
        """Through precharge, calibration and ready, with the rotor turning up to angle 0."""
        T_s, N_r = self.drive.control.T_s, self.drive.machine.N_r
        advance = N_r * self.drive.omega_nominal * T_s
        self.ask()
        calls = 1600
        for n in range(calls):
            if n == calls - 1:
                self.ask(reference=reference)
            self.interrupt(theta_e=(n - calls) * advance % (2 * np.pi))


@pytest.fixture
def port(tmp_path):
    return Port(tmp_path)


def test_the_clock_tree_gives_170_mhz(port):
    pll = port[RCC + 0x0C]
    assert bits(pll, 0, 2) == 3  # crystal
    hertz = 24e6 / (bits(pll, 4, 4) + 1) * bits(pll, 8, 7) / (2 * (bits(pll, 25, 2) + 1))
    assert hertz == CLOCK
    assert bits(pll, 24, 1) == 1
    assert bits(port[RCC + 0x00], 16, 1) == bits(port[RCC + 0x00], 24, 1) == 1
    assert bits(port[RCC + 0x08], 0, 2) == 3
    assert bits(port[RCC + 0x08], 4, 4) == 0  # bus clock not divided
    assert bits(port[PWR + 0x80], 8, 1) == 0  # boost
    assert bits(port[FLASH + 0x00], 0, 4) == 4  # wait states
    assert bits(port[RCC + 0x60], 26, 1) == bits(port[RCC + 0x58], 1, 1) == 1  # HRTIM, TIM3
    assert bits(port[RCC + 0x4C], 13, 2) == 3  # converters
    assert bits(port[RCC + 0x4C], 0, 3) == 7  # ports


def test_the_timers_run_at_the_control_period_and_start_the_converters(port):
    ticks = port.drive.control.T_s * CLOCK
    assert port[HRTIM + 0x14] == ticks
    assert port[HRTIM + 0x00] == 5 | 1 << 3 | 0b1111 << 16  # /1, continuous, master and A to C
    assert port[HRTIM + 0x1C] == 3
    assert port[COMMON + 0x40] == 1 << 4  # trigger 2: master period
    for k in range(3):
        assert port[timer(k) + 0x14] == ticks
        assert port[timer(k) + 0x00] == 5 | 1 << 3 | 1 << 18 | 1 << 27  # update at roll-over
        assert bits(port[timer(k) + 0x64], 8, 1) == 0  # no dead time: no complementary switches
    for adc, channels in zip(ADC, ((1, 3), (2,), (1,)), strict=True):
        sequence = port[adc + 0x4C]
        assert bits(sequence, 0, 2) == len(channels) - 1
        assert (bits(sequence, 2, 5), bits(sequence, 7, 2)) == (19, 1)  # HRTIM trigger 2, rising
        assert [bits(sequence, 9 + 6 * n, 5) for n in range(len(channels))] == list(channels)
        assert all(bits(port[adc + 0x14], 3 * n, 3) == 2 for n in channels)  # 12.5 periods
        assert bits(port[adc + 0x0C], 3, 2) == 0  # 12 bits
        assert bits(port[adc + 0x08], 28, 2) == 1  # regulator on, not in deep power-down
        assert port[adc + 0x08] & (1 << 0 | 1 << 3) == 1 << 0 | 1 << 3
    assert port[ADC[0] + 0x04] == 1 << 6
    assert port[0xE000E100] == 1 << 18


def test_the_trip_input_takes_all_outputs_off_without_software(port):
    fault = port[COMMON + 0x50]
    assert (bits(fault, 0, 1), bits(fault, 1, 1), bits(fault, 2, 1)) == (1, 1, 0)  # pin, high
    for k in range(3):
        assert port[timer(k) + 0x68] == 1  # fault 1
        out = port[timer(k) + 0x64]
        assert (bits(out, 4, 2), bits(out, 20, 2)) == (2, 2)  # inactive at a fault
        assert (bits(out, 1, 1), bits(out, 17, 1)) == (0, 0)  # active is high
    assert port[COMMON + 0x14] == 0  # nothing is enabled before the drive runs


PINS = [  # port, pin, mode, alternate function
    *((0, n, 3, 0) for n in (0, 1, 2)),
    (1, 1, 3, 0),
    *((0, n, 2, 13) for n in (8, 9, 10, 11, 12)),
    *((1, n, 2, 13) for n in (12, 13)),
    *((0, n, 2, 2) for n in (6, 7)),
    *((2, n, 1, 0) for n in (0, 1, 2)),
]


def test_the_pins_are_those_of_the_assumption_sheet(port):
    for at, number, mode, function in PINS:
        assert bits(port[GPIO[at] + 0x00], 2 * number, 2) == mode
        assert bits(port[GPIO[at] + 0x20 + 4 * (number // 8)], 4 * (number % 8), 4) == function
    assert port[TIM3 + 0x2C] == port.drive.sensing.encoder_counts - 1
    assert (bits(port[TIM3 + 0x08], 0, 3), port[TIM3 + 0x00]) == (3, 1)  # encoder mode 3


def test_the_watchdog_is_fed_by_a_step_in_time_only(port):
    assert port[IWDG + 0x08] == 20  # of 8 kHz: 50 periods
    port.to_run(reference=0.0)
    port[IWDG] = 0
    port.interrupt()
    assert port[IWDG] == 0xAAAA
    port[IWDG], port[COMMON + 0x18] = 0, 0
    port[HRTIM + 0x04] = 1 << 4  # the next period has begun
    port.interrupt()
    assert port[IWDG] == 0
    assert port[COMMON + 0x18] == ALL_OUTPUTS
    port[HRTIM + 0x04] = 0
    port[COMMON + 0x18] = 0
    port.interrupt()
    assert port[COMMON + 0x18] == ALL_OUTPUTS  # the drive has tripped
    assert (port.orders()["leg"] == -1).all()
    assert port[IWDG] == 0  # until a person clears the fault, or the watchdog resets
    port.ask(enable=0, clear=1)
    port.interrupt()
    assert port[IWDG] == 0xAAAA


def test_outputs_are_enabled_once_so_that_a_trip_lasts(port):
    """The latch of a trip that comes after the request is read is seen one period later: until then
    software must not enable what the hardware has disabled."""
    port.to_run(reference=5.0)
    assert port[COMMON + 0x14] == ALL_OUTPUTS
    port[COMMON + 0x14] = 0
    port.interrupt()
    assert port[COMMON + 0x14] == 0


def test_a_hardware_trip_ends_the_run_until_a_person_clears_it(port):
    port.to_run(reference=5.0)
    assert port[COMMON + 0x14] == ALL_OUTPUTS
    assert port[GPIO[2] + 0x18] & 7 == 3  # gate enable, precharge relay
    port[COMMON + 0x08] = 1  # the latch of fault 1
    port[COMMON + 0x18] = 0
    port.interrupt()
    assert port[COMMON + 0x18] == ALL_OUTPUTS
    assert port[GPIO[2] + 0x18] == 7 << 16
    assert all(port.legs(k) == ([], [-1]) for k in range(3))
    port.ask(enable=0, clear=1)
    port.interrupt()
    assert port[COMMON + 0x0C] == 1
    port[COMMON + 0x08] = port[COMMON + 0x18] = 0
    port[COMMON + 0x14] = 0
    for _ in range(20):
        port.ask()
        port.interrupt()
    assert port[GPIO[2] + 0x18] & 1 == 0  # precharge again, not run
    assert port[COMMON + 0x14] == 0


def test_the_port_drives_the_plant_as_the_simulation_does(port):
    """Readings go into the converters' registers; what comes back is read from the timers'."""
    drive, T_s = port.drive, port.drive.control.T_s
    reference = float(drive.reference.course[1][0])
    columns = _core.ORDER_COLUMNS
    worst = []

    def step(i, theta_e, omega_m, u_dc, asked, i_source):
        port.ask(reference=asked)
        port.interrupt(i, theta_e, u_dc)
        row = []
        for k, order in enumerate(port.orders()):
            ticks, states = port.legs(k)
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
    edges must be the ordered ones."""
    kept = [n for n in range(4) if order["t_edge"][n] < T_s]
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
    assert vectors[16 + 18] == symbols["ADC1_2_IRQHandler"] | 1
    assert len(vectors) == 16 + 102


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
            *(sys.executable, "-m", "reluctance.cli", "export", "firmware", str(FILE), "--json"),
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
