"""Orders as timers take them: what the edges do is what was ordered, to a tick."""

import ctypes

import numpy as np
import pytest
from firmware_tools import Native, drive
from hypothesis import given as any_given
from hypothesis import strategies as st

import reluctance as rl
from reluctance.targets.export.recording import record
from reluctance.targets.export.target import PHASE

TICKS = 2_000  # of a control period


class Switch(ctypes.Structure):
    _fields_ = (
        ("on", ctypes.c_uint8),
        ("count", ctypes.c_uint8),
        ("tick", ctypes.c_uint16 * 4),
    )


class LegEdges(ctypes.Structure):
    _fields_ = (("upper", Switch), ("lower", Switch))


class Hrtim(ctypes.Structure):
    _fields_ = (
        ("cmp", ctypes.c_uint16 * 4),
        *((name, ctypes.c_uint8) for name in ("set1", "reset1", "set2", "reset2")),
    )


class Epwm(ctypes.Structure):
    _fields_ = (("xcmp", ctypes.c_uint16 * 8), ("start", ctypes.c_uint8))


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    made = Native(drive("edge_mpc_late"), tmp_path_factory.mktemp("ticks")).library
    made.reluctance_edges.restype = LegEdges
    made.reluctance_edges.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint16]
    return made


T_S = 20e-6


def order_of(legs, edges, gate=1):
    order = np.zeros(1, PHASE)
    order["leg"], order["gate"] = legs, gate
    order["t_edge"] = [*edges, *[1e30] * (4 - len(edges))]
    return order


def levels(switch, ticks):
    """The switch at the ticks."""
    on = np.full(len(ticks), switch.on)
    for tick in list(switch.tick)[: switch.count]:
        on = np.where(ticks >= tick, 1 - on, on)
    return on


def assert_decodes(library, order, lower_freewheels):
    """Away from its edges by more than a tick the leg is the ordered one."""
    edges = library.reluctance_edges(order.ctypes.data, lower_freewheels, TICKS)
    ticks = np.arange(0.5, TICKS)
    leg = levels(edges.upper, ticks) + levels(edges.lower, ticks) - 1
    t_edge = order["t_edge"][0].astype(float) / T_S * TICKS
    ordered = order["leg"][0][np.searchsorted(t_edge, ticks, side="right")]
    near = np.min(np.abs(ticks[:, None] - t_edge), axis=1) <= 1.0
    assert np.array_equal(leg[~near], ordered[~near])
    for switch in (edges.upper, edges.lower):
        used = list(switch.tick)[: switch.count]
        assert used == sorted(set(used))
        assert all(0 < tick < TICKS for tick in used)
    return edges


legs = st.lists(st.sampled_from([-1, 0, 1]), min_size=5, max_size=5)
instants = st.lists(st.floats(0, 2.2e-5), max_size=4).map(sorted)


@any_given(legs, instants, st.sampled_from([0, 1]))
def test_the_switches_give_the_ordered_leg(library, legs, instants, lower):
    assert_decodes(library, order_of(legs, instants), lower)


@pytest.mark.parametrize("name", ["edge_mpc_late", "deadbeat", "pwm_current"])
def test_recorded_orders_come_back_from_edges_and_registers(library, name):
    """All orders of 500 samples: legs to a tick, HRTIM and XCMP images to the last edge."""
    commands = record(drive(name), steps=1000).commands[500:, :-1].reshape(500, 3, -1)
    refused = 0
    for n, command in enumerate(commands):
        for row in command:
            order = order_of(row[:5], row[7:11], int(row[5]))
            edges = assert_decodes(library, order, n % 2)
            refused += not hrtim_agrees(library, edges)
            assert_epwm_agrees(library, edges)
    assert refused <= 0.01 * 1500


def hrtim_agrees(library, edges):
    """True where four compare units suffice; then outputs 1 and 2 are those of the switches."""
    to = Hrtim()
    if not library.reluctance_to_hrtim(ctypes.byref(edges), ctypes.byref(to)):
        return False
    outputs = ((edges.upper, to.set1, to.reset1), (edges.lower, to.set2, to.reset2))
    for switch, sets, resets in outputs:
        assert sets & resets == 0
        assert (sets >> 4 & 1, resets >> 4 & 1) == (switch.on, 1 - switch.on)
        events = sorted(
            (to.cmp[n], bool(sets >> n & 1)) for n in range(4) if (sets | resets) >> n & 1
        )
        level, ticks = switch.on, []
        for tick, rises in events:
            assert rises != bool(level)
            level = int(rises)
            ticks.append(tick)
        assert ticks == list(switch.tick)[: switch.count]
    return True


def assert_epwm_agrees(library, edges):
    to = Epwm()
    library.reluctance_to_epwm(ctypes.byref(edges), ctypes.byref(to))
    for side, switch in enumerate((edges.upper, edges.lower)):
        assert to.start >> side & 1 == switch.on
        used = [tick for tick in to.xcmp[4 * side : 4 * side + 4] if tick != 0xFFFF]
        assert used == list(switch.tick)[: switch.count]


def test_no_pulse_comes_from_orders_that_are_none(library):
    for order in (
        order_of([-1] * 5, []),
        order_of([1] * 5, [], gate=0),
        order_of([1] * 5, [], gate=2),
        order_of([-1] * 5, [np.nan, np.nan]),
    ):
        edges = library.reluctance_edges(order.ctypes.data, 0, TICKS)
        for switch in (edges.upper, edges.lower):
            assert (switch.on, switch.count) == (0, 0)


@pytest.mark.parametrize("name", ["edge_mpc_late", "deadbeat", "pwm_current"])
def test_no_pulse_is_shorter_than_the_least_and_no_edge_disturbs_a_sample(name):
    t_min, blank = 1e-6, 1.5e-6
    limited = drive(name).with_values({"converter.min_pulse_us": 1.0, "sensing.blank_us": 1.5})
    recording = record(limited, steps=2000)
    rows = recording.commands[:, :-1].reshape(2000, 3, -1).astype(float)
    T_s = limited.control.T_s
    edges, legs = rows[:, :, 7:11], rows[:, :, :5]
    inside = edges < T_s
    assert np.all(edges[inside] <= T_s - blank + 1e-11)
    steps = np.diff(np.concatenate([np.zeros((2000, 3, 1)), edges], axis=2), axis=2)
    assert np.all((steps[inside] < 1e-12) | (steps[inside] >= t_min - 1e-11))
    plain = rl.simulate(drive(name), until=0.03, record=None).kpis
    kpis = rl.simulate(limited, until=0.03, record=None).kpis
    assert kpis.tau_mean == pytest.approx(plain.tau_mean, rel=0.01)
    assert kpis.torque_error_rms < 2 * plain.torque_error_rms
    assert legs.min() == -1
