"""The STM32G474 on the desk: its registers by the maker's description, and its high-resolution
timer as a model with active and preload registers.

The model follows the reference manual RM0440, "Register preload and update management" and "Output
management". While PREEN is 0 a write reaches the active register at once. While it is 1 the write
waits for an update, which comes at a roll-over (TRSTU) or by software (TxSWU). A counter runs from
0 to its active period. A reset of an output wins over a set at the same tick. A fault disables the
outputs of each timer that listens to it; they cannot be enabled while it lasts.
"""

import csv
from pathlib import Path

TABLE = Path(__file__).parents[1] / "firmware" / "stm32g474_registers.csv"
with TABLE.open() as _file:
    _rows = list(csv.DictReader(line for line in _file if not line.startswith("#")))
ADDRESS = {row["register"]: int(row["address"], 16) for row in _rows if row["address"]}
REGISTER = {address: name for name, address in ADDRESS.items()}
FIELD = {
    (row["register"], row["field"]): (int(row["bit"]), int(row["width"]))
    for row in _rows
    if row["field"]
}
INTERRUPT = next(int(row["bit"]) for row in _rows if row["register"] == "interrupt ADC1_2")

TIMERS = ("A", "B", "C")
PRELOADED = (
    *("PERR", "CMP1R", "CMP2R", "CMP3R", "CMP4R", "RSTR", "DTR"),
    *("SET1R", "RST1R", "SET2R", "RST2R"),
)
RESET_PERIOD = 0xFFDF  # of MPER and PERx, RM0440


def field(word, register, name):
    """The value of a register's field in this word."""
    bit, width = FIELD[register, name]
    return word >> bit & (1 << width) - 1


def word_of(register, **values):
    """The word with these fields; all other bits are zero."""
    word = 0
    for name, value in values.items():
        bit, width = FIELD[register, name]
        assert 0 <= value < 1 << width, f"{register}.{name} = {value}"
        word |= value << bit
    return word


class Counter:
    """The master (name None) or one of timers A to C."""

    def __init__(self, name):
        self.name = name
        self.peripheral = f"HRTIM_TIM{name}" if name else "HRTIM_MASTER"
        self.control = 0
        self.running = False
        self.count = 0
        self.active = {"PERR": RESET_PERIOD}
        self.preload = {"PERR": RESET_PERIOD}
        self.out = self.fault_inputs = 0
        self.level = [False, False]  # as set and reset, whether enabled or not

    def bit(self, name):
        return field(self.control, f"{self.peripheral}.CR", name)

    def write(self, register, word):
        if register == "CR":
            self.control = word
        elif register == "OUTR":
            self.out = word
        elif register == "FLTR":
            self.fault_inputs = word
        else:
            self.preload[register] = word
            if not self.bit("PREEN"):
                self.active[register] = word

    def update(self):
        self.active |= self.preload

    def to_next(self):
        """Ticks to the next event."""
        places = [self.active.get(f"CMP{n}R", 0) for n in (1, 2, 3, 4)]
        return min(p - self.count for p in [*places, self.active["PERR"]] if p > self.count)

    def happening(self):
        """Names of the events at this tick; compare values below 3 are ignored."""
        told = [
            f"CMP{n}" for n in (1, 2, 3, 4) if 3 <= self.active.get(f"CMP{n}R", 0) == self.count
        ]
        return {f"MST{name}" for name in told} if self.name is None else set(told)

    def act(self, events):
        for n in (0, 1):
            for kind, level in (("SET", True), ("RST", False)):  # the reset wins
                register = f"{kind}{n + 1}R"
                word = self.active.get(register, 0)
                if any(field(word, f"{self.peripheral}.{register}", event) for event in events):
                    self.level[n] = level
        if field(self.out, f"{self.peripheral}.OUTR", "DTEN"):
            self.level[1] = not self.level[0]


class Hrtim:
    """Master and timers A to C. `write` takes a written word and gives what a read then returns."""

    def __init__(self):
        self.master = Counter(None)
        self.timers = [Counter(name) for name in TIMERS]
        self.time = 0
        self.enabled = 0  # bit 2 k: upper switch of leg k, 2 k + 1: its lower one
        self.input_high = False
        self.input = self.trigger = self.disabled_updates = 0
        self.period_began = self.latched = False
        self.conversions = []  # times of trigger 2
        self.changes = []  # (time, leg, state) as the pins show them
        self.shown = [-1, -1, -1]

    @property
    def counters(self):
        return [self.master, *self.timers]

    def write(self, name, word):
        peripheral, register = name.split(".")
        if peripheral == "HRTIM_COMMON":
            word = self._common(name, register, word)
        else:
            counter = next(c for c in self.counters if c.peripheral == peripheral)
            if counter is self.master and register == "ICR":
                self.period_began &= not field(word, name, "REPC")
                word = 0
            else:
                counter.write(register, word)
            if counter is self.master and register == "CR":
                for other, bit in zip(
                    self.counters, ("MCEN", "TACEN", "TBCEN", "TCCEN"), strict=True
                ):
                    other.running = bool(field(word, name, bit))
        self._show()
        return word

    def _common(self, name, register, word):
        if register == "CR1":
            self.disabled_updates = word
        elif register == "CR2":
            for counter in self.counters:
                letter = "M" if counter is self.master else f"T{counter.name}"
                if field(word, name, f"{letter}SWU"):
                    counter.update()
                if field(word, name, f"{letter}RST"):
                    counter.count = 0
            return 0
        elif register == "ICR":
            self.latched &= not field(word, name, "FLT1C")
            self._fault()
            return 0
        elif register == "OENR":
            self.enabled |= word
            self._fault()
            return self.enabled
        elif register == "ODISR":
            self.enabled &= ~word
            return 0
        elif register == "ADC2R":
            self.trigger = word
        elif register == "FLTINR1":
            self.input = word
            self._fault()
        return word

    def reads(self):
        """What the read-only registers hold."""
        return {
            "HRTIM_MASTER.ISR": word_of("HRTIM_MASTER.ISR", REP=int(self.period_began)),
            "HRTIM_COMMON.ISR": word_of("HRTIM_COMMON.ISR", FLT1=int(self.latched)),
            "HRTIM_COMMON.OENR": self.enabled,
        }

    def fault(self, high):
        """The level of the fault input, past its filter."""
        self.input_high = high
        self._fault()
        self._show()

    def _fault(self):
        name = "HRTIM_COMMON.FLTINR1"
        if not field(self.input, name, "FLT1E"):
            return
        if self.input_high != bool(field(self.input, name, "FLT1P")):
            return
        self.latched = True
        for k, timer in enumerate(self.timers):
            if field(timer.fault_inputs, f"{timer.peripheral}.FLTR", "FLT1EN"):
                for n in (0, 1):
                    if field(timer.out, f"{timer.peripheral}.OUTR", f"FAULT{n + 1}"):
                        self.enabled &= ~(1 << 2 * k + n)

    def state(self, k):
        """+1, 0, -1: switches of leg k that conduct, less one."""
        return (
            sum(on and self.enabled >> 2 * k + n & 1 for n, on in enumerate(self.timers[k].level))
            - 1
        )

    def _show(self):
        for k in range(3):
            if self.state(k) != self.shown[k]:
                self.shown[k] = self.state(k)
                self.changes.append((self.time, k, self.shown[k]))

    def run(self, ticks):
        """Lets this time pass."""
        end = self.time + ticks
        while self.time < end:
            running = [c for c in self.counters if c.running]
            assert all(c.bit("CKPSC") == 5 for c in running), "a tick is one period of the clock"
            step = min([end - self.time, *(c.to_next() for c in running)])
            self.time += step
            for counter in running:
                counter.count += step
                if counter.count == counter.active["PERR"]:
                    self._roll_over(counter)
            events = {counter: counter.happening() for counter in running}
            for timer in self.timers:
                timer.act(events.get(timer, set()) | events.get(self.master, set()))
            self._show()

    def _roll_over(self, counter):
        assert counter.bit("CONT")
        counter.count = 0
        if counter is self.master:
            self.period_began = True
            if field(self.trigger, "HRTIM_COMMON.ADC2R", "MPER"):
                self.conversions.append(self.time)
            return
        held = field(self.disabled_updates, "HRTIM_COMMON.CR1", f"T{counter.name}UDIS")
        if counter.bit("TRSTU") and not held:
            counter.update()

    def to_roll_over(self):
        """Lets time pass until the master's next period begins."""
        self.run(self.master.active["PERR"] - self.master.count)

    def behind(self):
        """Ticks by which timers A to C are behind the master."""
        period = self.master.active["PERR"]
        return [(self.master.count - timer.count) % period for timer in self.timers]
