"""Each fault of the plant against an integration of its circuit that is written here."""

import csv
import importlib.util
import json
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import reluctance as rl
from reluctance import _core
from reluctance.cli.schema import json_schema
from reluctance.drive.tables.faults import NEEDS, Fault

EXAMPLES = Path(__file__).parents[2] / "examples"
BENCH = Path(__file__).parents[2] / "bench"
T_S = 20e-6
UP, FREE, DOWN = rl.Leg.magnetize, rl.Leg.freewheel, rl.Leg.demagnetize
# Of one phase, in samples: built up, freewheeling, built up again, demagnetized to zero, again.
SCHEDULE = [(UP, 20), (FREE, 15), (UP, 10), (DOWN, 40), (FREE, 5), (UP, 10), (DOWN, 30)]
LEGS = [leg for leg, count in SCHEDULE for _ in range(count)]
END = T_S * len(LEGS)
VALUES = {
    "R_ohm": 0.5,
    "gain": 0.8,
    "offset_A": -5.0,
    "angle_deg": 30.0,
    "part": 0.1,
    "other": "b",
}


class Schedule(rl.Law):
    """The legs of the list for phase a, the others off; what the sensors show is kept."""

    def reset(self, known):
        self.seen = []

    def step(self, y, tau_ref):
        self.seen.append((list(y.i), y.theta_e, y.u_dc, y.omega_m))
        n = len(self.seen) - 1
        leg = LEGS[min(n, len(LEGS) - 1)]
        return [rl.Order.hold(leg), *[rl.Order.hold(DOWN)] * (y.n_phases - 1)]


def fault(kind, **values):
    """A fault with the keys that it needs."""
    return Fault(kind=kind, **{key: VALUES[key] for key in NEEDS[kind]} | values)


def drive(*faults, theta_deg=5.0, source=None, **values):
    """A shaft that is held, drops in the bridge, a machine with much resistance."""
    base = rl.load(EXAMPLES / "paper_rated.toml").with_values(
        {
            "control.T_s_us": T_S * 1e6,
            "simulation.theta_start_deg": theta_deg,
            "simulation.until_s": END,
            "converter.v_switch_V": 1.0,
            "converter.v_diode_V": 0.8,
            "converter.R_switch_ohm": 0.02,
            "converter.R_diode_ohm": 0.01,
            "load.speed_rpm": 900,
            **(source or {}),
            **values,
        }
    )
    return base.with_values({"faults": list(faults)})


@pytest.mark.parametrize("gain", [1.0, 0.8])
def test_a_comparator_holds_the_current_that_its_channel_shows(gain):
    base = rl.load(EXAMPLES / "hysteresis_200A.toml")
    channel = Fault(kind="sensor_gain", phase="b", gain=gain, t_s=0.0)
    broken = rl.simulate(base.with_values({"faults": [channel]}), record=1e-5)
    top = 200 + base.control.i_band_A
    assert broken.i.max(axis=1) == pytest.approx([top, top / gain, top], abs=0.5)
    if gain == 1.0:
        assert np.array_equal(broken.i, rl.simulate(base, record=1e-5).i)


ACCURATE = {"rtol": 1e-9, "atol": 1e-9, "method": "DOP853"}
HEALTHY = {UP: 1, FREE: 0, DOWN: -1}


def zero(t, x):
    return x[0]


zero.terminal, zero.direction = True, -1
BATTERY = {"source.kind": "battery", "source.R_ohm": 0.4, "source.C_uF": 500.0}


@dataclass
class Circuit:
    """One phase and its half bridges, written from the circuit: switches, diodes, winding."""

    drive: rl.Drive
    broken: dict[rl.Leg, int]  # what the switches make of an order, healthy 1, 0, -1
    start: int = 0  # from this sample on

    def magnetics(self, i, t):
        omega = self.drive.load.omega[1][0]
        theta = 4 * (np.radians(5.0) + omega * t) % (2 * np.pi)
        psi, _, _, L, psi_theta = self.drive.machine.magnetics.magnetics(
            np.array([i]), np.array([theta])
        )[0]
        return psi, L, psi_theta * omega

    def outer(self, level, u_dc):
        """The bridge at its terminals."""
        c = self.drive.converter
        on = level + 1
        R = on * c.R_switch_ohm + (2 - on) * c.R_diode_ohm
        return level * u_dc - on * c.v_switch_V - (2 - on) * c.v_diode_V, R

    def rates(self, t, x, leg, level):
        """Of the current, and what the bridge draws."""
        i, u_dc = x
        u, R = self.outer(level, u_dc)
        _, L, emf = self.magnetics(max(i, 0.0), t)
        return (u - (R + self.drive.machine.R) * i - emf) / L, level * i

    def run(self, at):
        """Currents and dc-link voltages at times of which each is the end of a sample."""
        source = self.drive.source
        x, found = np.array([0.0, self.drive.converter.u_dc_V]), []
        for n, leg in enumerate(LEGS):
            level = (HEALTHY if n < self.start else self.broken)[leg]

            def slope(t, x, leg=leg, level=level):
                di, i_dc = self.rates(t, x, leg, level)
                if source.kind == "stiff":
                    return [di, 0.0]
                i_in = (self.drive.converter.u_dc_V - x[1]) / source.R_ohm
                return [di, (i_in - i_dc) / (source.C_uF * 1e-6)]

            t, end = n * T_S, (n + 1) * T_S
            while t < end:
                flows = x[0] > 0 or level == 1

                def held(t, x, flows=flows, slope=slope):
                    di, du = slope(t, x)
                    return [di if flows else 0.0, du]

                y = solve_ivp(held, (t, end), x, events=zero if flows else None, **ACCURATE)
                t, x = y.t[-1], y.y[:, -1]
                x[0] = x[0] if flows and y.status == 0 else 0.0
            found.append(x)
        return np.array(found)[np.round(np.asarray(at) / T_S).astype(int) - 1]


def simulated(drive):
    """Current of phase a and dc-link voltage at the ends of all samples, and what was shown."""
    law = Schedule()
    result = rl.simulate(drive, law=law, record=T_S)
    t = result.t[1:-1]
    return t, result.i[0, 1:-1], result.u_dc[1:-1], np.array([s[0] for s in law.seen])


def compare(drive, circuit):
    t, i, u_dc, shown = simulated(drive)
    reference = circuit.run(t)
    assert np.abs(reference[:, 0]).max() > 30
    np.testing.assert_allclose(i, reference[:, 0], atol=2e-5 * reference[:, 0].max())
    np.testing.assert_allclose(u_dc, reference[:, 1], atol=2e-5 * 240)
    return reference, shown


LEVELS = {
    None: HEALTHY,
    "upper_open": {UP: 0, FREE: 0, DOWN: -1},
    "lower_open": {UP: 0, FREE: -1, DOWN: -1},
    "upper_shorted": {UP: 1, FREE: 1, DOWN: 0},
    "lower_shorted": {UP: 1, FREE: 0, DOWN: 0},
}


@pytest.mark.parametrize("kind", LEVELS)
@pytest.mark.parametrize("source", [{}, BATTERY], ids=["stiff", "battery"])
def test_switches(kind, source):
    if kind in ("upper_open", "lower_open"):  # from the start no current ever flows
        one = drive(fault(kind), source=source)
        assert simulated(one)[1].max() == 0
        one = drive(fault(kind, t_s=10 * T_S), source=source)
        compare(one, Circuit(one, LEVELS[kind], start=10))
        return
    one = drive(*([] if kind is None else [fault(kind)]), source=source)
    compare(one, Circuit(one, LEVELS[kind]))


def test_open_wire():
    """The current ends in an arc against twice the voltage, and never comes back."""
    start = 12 * T_S
    one = drive(fault("open_wire", t_s=start))
    law = Schedule()
    result = rl.simulate(one, law=law)
    i, t = result.i[0], result.t
    healthy = rl.simulate(drive(), law=Schedule())
    before = t < start - 1e-9
    np.testing.assert_allclose(i[before], np.interp(t[before], healthy.t, healthy.i[0]), atol=1e-6)
    circuit = Circuit(one, HEALTHY)

    def slope(t, x):
        _, L, emf = circuit.magnetics(max(x[0], 0), t)
        return [(-2 * 240 - one.machine.R * x[0] - emf) / L]

    i_start = np.interp(start, healthy.t, healthy.i[0])
    y = solve_ivp(slope, (start, END), [i_start], events=lambda t, x: x[0], rtol=1e-9)
    extinct = y.t_events[0][0]
    assert extinct - start < 6 * T_S
    assert t[(t > start) & (i == 0)][0] == pytest.approx(extinct, abs=1e-9)
    assert i[t > extinct + 1e-9].max() == 0


class Shunted(Circuit):
    """A resistance across the dc link while the upper switch is on."""

    def rates(self, t, x, leg, level):
        di, i_dc = super().rates(t, x, leg, level)
        return di, i_dc + (x[1] / 0.5 if leg == UP else 0.0)


@pytest.mark.parametrize("kind", ["diode_shorted", "winding_to_ground"])
def test_shoot_through(kind):
    """The dc link feeds the failed part; only the current channel of a grounded winding sees it."""
    one = drive(fault(kind), source=BATTERY)
    reference, shown = compare(one, Shunted(one, HEALTHY))
    assert reference[:, 1].min() < 150
    for n in (5, 40, 60):
        i, u_dc = reference[n - 1]
        more = u_dc / 0.5 if kind == "winding_to_ground" and LEGS[n - 1] == UP else 0.0
        assert shown[n, 0] == pytest.approx(i + more, rel=1e-3)


@dataclass
class ShortedTurns(Circuit):
    """Two loops: the turns that the current takes, and those that the fault bridges.

    u = (1 - s)(R i_1 + psi') + v;  v = s (R i_2 + psi') = R_f (i_1 - i_2);
    i = (1 - s) i_1 + s i_2 with psi(i); where the diodes block i_1 = 0 instead of the first.
    """

    s: float = 0.1
    R_f: float = 0.5

    def loops(self, i, u, R_out, blocked):
        """i_1, i_2, psi'."""
        s, R, R_f = self.s, self.drive.machine.R, self.R_f
        first = [1, 0, 0] if blocked else [(1 - s) * R + R_out + R_f, -R_f, 1 - s]
        A = np.array([first, [R_f, -R_f - s * R, -s], [1 - s, s, 0]])
        return np.linalg.solve(A, [0 if blocked else u, 0, i])

    def terminals(self, x, level):
        """i_1 and psi'."""
        i, u_dc = x
        u, R_out = self.outer(level, u_dc)
        i_1, _, slope = self.loops(i, u, R_out, False)
        if level < 1 and i_1 <= 0:
            i_1, _, slope = self.loops(i, u, R_out, True)
        return i_1, slope

    def rates(self, t, x, leg, level):
        i, _ = x
        i_1, slope = self.terminals(x, level)
        _, L, emf = self.magnetics(max(i, 0.0), t)
        return (slope - emf) / L, level * i_1


@pytest.mark.parametrize(("part", "R"), [(0.1, 0.5), (0.3, 0.2), (0.05, 1e-3)])
@pytest.mark.parametrize("source", [{}, BATTERY], ids=["stiff", "battery"])
def test_shorted_turns(part, R, source):
    one = drive(fault("turns_shorted", part=part, R_ohm=R), source=source)
    circuit = ShortedTurns(one, HEALTHY, s=part, R_f=R)
    reference, shown = compare(one, circuit)
    legs = LEGS[: len(reference)]
    expected = np.array(
        [circuit.terminals(x, HEALTHY[leg])[0] for x, leg in zip(reference, legs, strict=True)]
    )
    assert shown[1 : len(expected) + 1, 0] == pytest.approx(expected, rel=1e-4, abs=2e-3)
    assert expected[9] > reference[9, 0]
    assert ((expected == 0) & (reference[:, 0] > 1)).any()  # the diodes block, the turns do not


class BehindContact(ShortedTurns):
    """Half an ohm between the bridge and the winding."""

    def outer(self, level, u_dc):
        u, R = super().outer(level, u_dc)
        return u, R + 0.5


class Contact(BehindContact):
    """Of a winding without shorted turns."""

    rates = Circuit.rates


@pytest.mark.parametrize("source", [{}, BATTERY], ids=["stiff", "battery"])
def test_poor_contact(source):
    one = drive(fault("poor_contact"), source=source)
    compare(one, Contact(one, HEALTHY))
    both = drive(fault("poor_contact"), fault("turns_shorted"), source=source)
    compare(both, BehindContact(both, HEALTHY))


@pytest.mark.parametrize(
    ("kind", "shown"),
    [
        ("sensor_gain", lambda i, kept: 0.8 * i),
        ("sensor_offset", lambda i, kept: i - 5),
        ("sensor_stuck", lambda i, kept: kept + 0 * i),
        ("sensor_dead", lambda i, kept: 0 * i),
    ],
)
def test_current_channels(kind, shown):
    start = 12
    t, i, _, seen = simulated(drive(fault(kind, t_s=(start - 0.5) * T_S)))
    kept = np.interp((start - 0.5) * T_S, t, i)
    assert seen[1:start, 0] == pytest.approx(i[: start - 1], abs=1e-5)
    expected = shown(i[start:], kept)
    assert seen[start + 1 : len(i) + 1, 0] == pytest.approx(np.maximum(expected, 0), abs=2e-3)


def test_comparators_see_the_channel():
    """A channel that shows 80 % lets the comparator raise the current by a quarter."""
    base = rl.load(EXAMPLES / "sharing_cubic.toml").with_values({"simulation.until_s": 0.03})
    sound = rl.simulate(base, record=None).kpis.i_peak
    faults = [fault("sensor_gain", phase=p) for p in "abc"]
    worse = rl.simulate(base.with_values({"faults": faults}), record=None).kpis.i_peak
    band = base.control.i_band_A
    assert worse - band / 0.8 == pytest.approx((sound - band) / 0.8, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "shown"),
    [
        ("encoder_off", lambda theta, kept: theta + 30),
        ("encoder_frozen", lambda theta, kept: kept + 0 * theta),
        ("encoder_lost_counts", lambda theta, kept: kept + 0.9 * (theta - kept)),
        ("encoder_reversed", lambda theta, kept: -theta),
    ],
)
def test_rotor_sensors(kind, shown):
    start = 12
    law = Schedule()
    rl.simulate(drive(fault(kind, t_s=(start - 0.5) * T_S)), law=law, record=None)
    theta = 20 + 900 * 6 * 4 * T_S * np.arange(len(law.seen))
    expected = np.where(
        np.arange(len(theta)) < start, theta, shown(theta, theta[start] - 900 * 6 * 4 * T_S / 2)
    )
    seen = np.degrees([s[1] for s in law.seen])
    assert (seen - expected + 180) % 360 - 180 == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("kinds", [["power"], ["sensors"], ["power", "sensors"]])
def test_exchanged_phases(kinds):
    """Orders for phase a reach winding b; its current is shown by b, by a with both exchanged."""
    one = drive(*[fault(f"{kind}_exchanged") for kind in kinds])
    law = Schedule()
    result = rl.simulate(one, law=law, record=T_S)
    driven = 1 if "power" in kinds else 0
    assert result.i[driven].max() > 20
    assert result.i[1 - driven].max() == 0
    shown = np.array([s[0] for s in law.seen])
    channel = 1 - driven if "sensors" in kinds else driven
    assert shown[20, channel] == pytest.approx(result.i[driven, 20], abs=1e-5)
    assert shown[:, 1 - channel].max() == 0


def test_exchanged_cables_are_another_order_of_the_phases():
    """Cables of b and c exchanged, with their sensors: the machine runs as one whose phases follow
    in the other order, so that reversing the angle as well restores the torque."""
    base = rl.load(EXAMPLES / "deadbeat.toml").with_values({"simulation.until_s": 0.03})
    pair = {"phase": "b", "other": "c"}
    crossed = [fault("power_exchanged", **pair), fault("sensors_exchanged", **pair)]
    wrong = rl.simulate(base.with_values({"faults": crossed}), record=None).kpis
    sound = rl.simulate(base, record=None).kpis
    assert wrong.tau_mean < 0.7 * sound.tau_mean


def test_sag_of_the_dc_link():
    one = drive(fault("dc_sag", part=0.4, t_s=10 * T_S, end_s=30.5 * T_S))
    _, _, u_dc, _ = simulated(one)
    n = np.arange(1, len(u_dc) + 1)
    assert u_dc == pytest.approx(np.where((n >= 10) & (n <= 30), 96.0, 240.0))
    soft = drive(fault("dc_sag", part=0.4, t_s=10 * T_S), source=BATTERY)
    _, _, u_dc, _ = simulated(soft)
    assert u_dc[9] > 150
    assert u_dc[-1] < 150


@pytest.mark.parametrize("example", ["deadbeat", "paper_rated", "single_pulse", "battery"])
@pytest.mark.parametrize("kind", NEEDS)
def test_energy_closes(kind, example):
    """The balance of every faulted run, with comparators, timers, windows and a capacitor."""
    base = rl.load(EXAMPLES / f"{example}.toml").with_values({"simulation.until_s": 0.03})
    values = {"phase": "b", "t_s": 0.004, "theta_e_deg": 70.0}
    values |= {"other": "c"} if "other" in NEEDS[kind] else {}
    if kind == "dc_sag":
        del values["theta_e_deg"]
    result = rl.simulate(base.with_values({"faults": [fault(kind, **values)]}))
    assert result.kpis.energy_residual < 1e-6
    (begun,) = result.faults
    assert begun[0] >= 0.004


def test_a_fault_begins_at_its_angle():
    base = rl.load(EXAMPLES / "deadbeat.toml").with_values({"simulation.until_s": 0.02})
    late = [fault("open_wire", phase="c", t_s=0.005, theta_e_deg=200.0)]
    result = rl.simulate(base.with_values({"faults": late}))
    ((t, _),) = result.faults
    omega_e = 4 * base.load.omega[1][0]
    theta = np.degrees(omega_e * t) - 240
    assert (theta - 200 + 180) % 360 - 180 == pytest.approx(0, abs=1e-4)
    assert 0.005 <= t < 0.005 + 2 * np.pi / omega_e
    assert result.i[2, result.t > t + 1e-3].max() == 0


def test_a_fault_ends():
    base = rl.load(EXAMPLES / "deadbeat.toml").with_values({"simulation.until_s": 0.04})
    short = [fault("sensor_dead", phase="b", t_s=0.005, end_s=0.01)]
    again = rl.simulate(base.with_values({"faults": short}), record=None).kpis
    assert again.tau_mean == pytest.approx(rl.simulate(base, record=None).kpis.tau_mean, rel=1e-4)


def test_sweeps_and_many_runs_have_the_faults(tmp_path, monkeypatch):
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path))
    base = rl.load(EXAMPLES / "deadbeat.toml").with_values(
        {"simulation.until_s": 0.03, "faults": [fault("open_wire", t_s=0.01)]}
    )
    table = rl.sweep(base, {"faults.0.phase": ["a", "b"], "faults.0.t_s": [0.002, 1.0]})
    tau = table.figures["tau_mean_Nm"]
    sound = rl.simulate(base.with_values({"faults": None}), record=None).kpis.tau_mean
    assert tau[[1, 3]] == pytest.approx(sound, rel=1e-9)
    assert np.all(tau[[0, 2]] < 0.8 * sound)
    alone = rl.simulate(base, record=None).kpis.tau_mean
    assert rl.simulate_all([base])[0].tau_mean == pytest.approx(alone, rel=1e-12)


def test_a_file_has_them_and_keeps_them(tmp_path):
    base = rl.load(EXAMPLES / "deadbeat.toml")
    faults = [fault("turns_shorted", phase="c", t_s=0.1), fault("encoder_off", theta_e_deg=10.0)]
    one = base.with_values({"faults": faults})
    one.save(tmp_path / "one.toml")
    text = (tmp_path / "one.toml").read_text(encoding="utf-8")
    assert len(tomllib.loads(text)["faults"]) == 2
    assert rl.load(tmp_path / "one.toml").faults == one.faults
    assert one.with_values({"faults.1.angle_deg": 20.0}).faults.each[1].angle_deg == 20.0


@pytest.mark.parametrize(
    ("values", "line"),
    [
        (
            {"faults.0.kind": "open_wir"},
            "no such fault; did you mean `open_wire`?",
        ),
        ({"faults.0.t_s": 0.1}, "missing key `kind` in [faults.0]"),
        ({"faults.1.kind": "open_wire"}, "`1`, need 0, the first"),
        ({"faults.kind": "open_wire"}, "faults.0.kind=open_wire"),
        ({"faults.0": 3}, "faults.0.kind=open_wire"),
        ({"faults": {"kind": "open_wire"}}, "[faults] is no list of tables; write [[faults]] with"),
        ({"faults": 3}, "[faults] is no list of tables; write [[faults]] with two brackets"),
        ({"faults": [{"kind": "sensor_gain"}]}, "[faults.0] kind = 'sensor_gain' needs gain"),
        ({"faults": [{"kind": "open_wire", "gain": 2.0}]}, "gain has no effect"),
        ({"faults": [{"kind": "open_wire", "phase": "d"}]}, "phase = 'd', need one of the 3"),
        ({"faults": [{"kind": "open_wire", "t_s": 0.2, "end_s": 0.1}]}, "end_s = 0.1, need more"),
        ({"faults": [{"kind": "power_exchanged", "other": "a"}]}, "need another one than phase"),
        ({"faults": [{"kind": "open_wire"}] * 9}, "9 tables, need at most 8"),
        (
            {"faults": [{"kind": "open_wire"}], "converter.bridge": "shared_switch"},
            "needs [converter] bridge = 'asymmetric'",
        ),
    ],
)
def test_errors_are_one_line(values, line):
    with pytest.raises(rl.ParameterError) as error:
        rl.load(EXAMPLES / "deadbeat.toml").with_values(values)
    assert line in str(error.value)
    assert "\n" not in str(error.value)


def test_an_editor_completes_them():
    below = json_schema()["$defs"]
    assert below["Faults"]["items"] == {"$ref": "#/$defs/Fault"}
    assert below["Faults"]["type"] == "array"
    assert below["Fault"]["properties"]["kind"]["enum"] == [*NEEDS]


def test_the_list_is_that_of_the_core():
    assert [*NEEDS][:-1] == [*_core.Broken.__members__]


@pytest.mark.parametrize(
    ("fault", "told"),
    [
        ({"kind": "dc_sag", "part": 0.5, "theta_e_deg": 10}, "theta_e_deg has no effect with"),
        ({"kind": "open_wire", "gain": 2}, "gain has no effect with kind = 'open_wire'"),
        ({"kind": "open_wier"}, "no such fault; did you mean `open_wire`"),
        ({"kind": "dc_sag"}, "kind = 'dc_sag' needs part"),
        ({"kind": "open_wire", "phase": "d"}, "need one of the 3 phases of the machine"),
    ],
)
def test_a_fault_that_cannot_be_is_refused(fault, told):
    with pytest.raises(rl.ParameterError, match=told):
        rl.load(EXAMPLES / "deadbeat.toml").with_values(
            {f"faults.0.{key}": value for key, value in fault.items()}
        )


def test_what_does_not_know_faults_refuses_them(tmp_path):
    one = rl.load(EXAMPLES / "deadbeat.toml").with_values({"faults.0.kind": "open_wire"})
    from reluctance.targets.export.blob import blob

    with pytest.raises(rl.ParameterError, match="has no form in the C interface"):
        blob(one)


def test_the_command_line_marks_them(tmp_path):
    done = subprocess.run(
        [
            *(sys.executable, "-m", "reluctance", "run", EXAMPLES / "deadbeat.toml", "--json"),
            *("--until", "0.02", "--plot", tmp_path / "run.svg"),
            *("--set", "faults.0.kind=open_wire", "--set", "faults.0.t_s=0.01"),
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout)["faults"] == [{"t_s": 0.01, "fault": "open_wire, phase a"}]
    assert "open_wire, phase a" in (tmp_path / "run.svg").read_text(encoding="utf-8")


def benchmark(name):
    """The script, a file's cases, and the rows that it has written of them."""
    spec = importlib.util.spec_from_file_location("bench_faults", BENCH / "faults.py")
    bench = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = bench
    spec.loader.exec_module(bench)
    with (BENCH / f"{name}.csv").open(encoding="utf-8") as file:
        kept = list(csv.DictReader(file))
    every = bench.cases(BENCH / f"{name}.toml")
    assert len(kept) == len(every)
    return bench, every, kept


@pytest.mark.parametrize(
    ("name", "fault"),
    [("faults", "power_exchanged c"), ("faults_published", "encoder_off 15.0")],
)
def test_a_row_of_the_benchmark_is_a_function_of_its_seeds(name, fault):
    bench, every, kept = benchmark(name)
    n = next(n for n, row in enumerate(kept) if row["fault"] == fault)
    row = bench.row(every[n], bench.run(every[n]))
    assert {key: str(value) for key, value in row.items()} == kept[n]


def test_of_the_published_faults_none_is_missed():
    """And a sound drive raises no alarm. A trial before the law runs finds a zero off by 15 deg."""
    _, every, kept = benchmark("faults_published")
    assert len(kept) == 9 * 8  # speeds and currents, conditions
    for row in kept:
        fault, found = row["fault"].split()[0], int(row["found"])
        assert row["before"] == "0"
        if fault == "none":
            assert found == 0
            continue
        assert found == int(row["instants"])
        assert fault == "encoder_off" or int(row["right_phase"]) == found
    assert {case.drive.converter.u_dc_V for case in every} == {540}
