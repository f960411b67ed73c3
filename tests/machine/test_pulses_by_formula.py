"""Pulses whose integrals are formulae: of a constant inductance, of straight ramps."""

from dataclasses import replace

import numpy as np
import pytest

from reluctance import ParameterError
from reluctance.machine.maps import FluxTable, repair_map
from reluctance.machine.maps.identify import _at, _closing, _positions, _smoothed, identify
from reluctance.machine.maps.pulses import Pulse, Recording, Trace, _known, read_pulses, trace
from reluctance.machine.maps.repair import SMOOTHING, likeliest, penalised

DT, U, L, R = 1e-4, 50.0, 0.02, 1.5


def pulse(rest=20, up=60, mean=False, offset=0.0, noise=0.0, R=R):
    """On a constant inductance: u for `up` rows, then -u until the current is gone."""
    u = np.concatenate([np.zeros(rest), np.full(up, U), np.full(3 * up, -U)])
    i, x = [], 0.0
    for k, v in enumerate(u):
        if k:
            x = max((x - v / R) * np.exp(-R / L * DT) + v / R, 0.0) if R else max(x + v * DT / L, 0)
        i.append(x)
    i = np.array(i)
    rng = np.random.default_rng(1)
    return Pulse(
        30.0, DT * np.arange(len(u)), u + offset, i + offset + noise * rng.normal(size=len(u)), mean
    )


def test_flux_linkage_over_a_pulse_is_that_of_the_inductance():
    """Voltages that are means since the row before: psi = L i to the trapezoid rule's error."""
    found = trace(pulse(mean=True))
    psi = found.volt_seconds - R * found.charge
    assert psi == pytest.approx(L * found.i, abs=2e-4 * L * found.i.max())
    top = found.i.argmax()
    assert found.i[-1] >= 0.03 * found.i[top]  # its end is not used
    assert found.i[-1] - U * DT / L < 0.03 * found.i[top]
    assert found.noise == 0 and len(found.i) == len(found.charge) == len(found.volt_seconds)


def test_a_voltage_of_the_instant_is_integrated_by_the_trapezoid_rule():
    t = np.arange(12.0)
    u = np.array([0, 0, 0, 0, 0, 0, 2.0, 4.0, 4.0, 4.0, 2.0, 0.0])
    i = np.array([0, 0, 0, 0, 0, 0, 0, 1.0, 3.0, 5.0, 6.0, 6.0])
    found = trace(Pulse(0, t, u, i, False))
    assert found.volt_seconds == pytest.approx([3, 7, 11, 14, 15])  # from above half of the top on
    assert found.charge == pytest.approx([0.5, 2.5, 6.5, 12, 18])
    assert [*found.i] == [1, 3, 5, 6, 6]
    found = trace(Pulse(0, t, u, i, True))
    assert found.volt_seconds == pytest.approx([4, 8, 12, 14, 14])


def test_offsets_are_the_means_before_a_pulse_where_enough_rows_are_at_rest():
    clean = trace(pulse(mean=True))
    shifted = trace(pulse(mean=True, offset=0.3))
    for name in ("i", "volt_seconds", "charge"):
        assert getattr(shifted, name) == pytest.approx(getattr(clean, name), abs=1e-12)
    few = pulse(rest=4, mean=True, offset=0.3)  # three rows: no mean of them
    assert trace(few).i[0] == pytest.approx(few.i[4])
    assert trace(pulse(rest=5, mean=True, offset=0.3)).i[0] == pytest.approx(clean.i[0])
    noisy = pulse(noise=0.01)
    assert trace(noisy).noise == pytest.approx(noisy.i[:19].std())


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"u": 0.0}, "has no positive voltage"),
        ({"i": -1.0}, "check the column of the current and its polarity"),
        ({"cut": 20}, "begins with its voltage on; record some rows before it"),
    ],
)
def test_a_pulse_that_shows_nothing_is_refused(change, told):
    whole = pulse()
    cut = slice(change.get("cut", 0), None)
    u, i = change.get("u", 1.0) * whole.u, change.get("i", 1.0) * whole.i
    with pytest.raises(ParameterError, match=told):
        trace(Pulse(0, whole.t[cut], u[cut], i[cut], False))


@pytest.mark.parametrize("offset", [0.0, 0.1, 0.3, 0.7, 0.99, -0.1])
def test_a_reversed_current_is_refused_whatever_its_offset(offset):
    """The mean of equal numbers is not always that number: what is left of it is no current."""
    one = pulse()
    with pytest.raises(ParameterError, match="check the column of the current and its polarity"):
        trace(Pulse(0, one.t, one.u, offset - one.i, False))


@pytest.mark.parametrize(("rest", "told"), [(2, 4), (4, 4), (5, 0)])
def test_offsets_that_are_left_in_for_want_of_rows_at_rest_are_told(rest, told):
    """One of the two pulses of each angle has few rows before it."""
    pulses = []
    for angle in (0.0, 15.0, 30.0, 45.0):
        for n in (rest, 20):
            one = pulse(rest=n, offset=0.01, mean=True)
            pulses.append(replace(one, angle=angle, i=one.i * (1 - angle / 90)))
    assert [trace(one).rested for one in pulses[:2]] == [not told, True]
    notes = identify(Recording(tuple(pulses), "deg", None), N_r=4, R=R).table.notes
    found = [note.partition(" rows")[0] for note in notes if "at rest before them" in note]
    assert found == ([f"{told} of 8 pulses have fewer than 5"] if told else [])


def test_a_current_that_does_not_leave_its_noise_is_refused():
    """Four times the noise."""
    i = np.tile([-1.0, 1.0], 10)
    u = np.repeat([0.0, 10.0], [11, 9])
    for top, good in ((3.99, False), (4.01, True)):
        j = i.copy()
        j[-1] = top
        one = Pulse(0, np.arange(20.0), u, j, False)
        if good:
            assert trace(one).noise == pytest.approx(1)
        else:
            with pytest.raises(ParameterError, match="with 1 A of noise"):
                trace(one)


@pytest.mark.parametrize("resistance", [0.4, 1.5, 3.0])
def test_rising_and_falling_currents_agree_with_the_resistance(resistance):
    traces = [trace(pulse(up=n, mean=True, R=resistance)) for n in (150, 200)]
    assert _closing(traces) == pytest.approx(resistance, rel=2e-3)
    rising = [
        Trace(t.i[: t.i.argmax()], *(x[: t.i.argmax()] for x in (t.volt_seconds, t.charge)), 0.0)
        for t in traces
    ]
    assert _closing(rising) is None


@pytest.mark.parametrize(
    ("near_level", "told"),
    [
        ([1.91, 2.0, 2.05], True),
        ([1.91, 2.05], False),  # two samples
        ([1.96, 1.97, 2.005], False),  # of 0.045 A together: less than half of how near they are
        ([1.96, 1.97, 2.015], True),
        ([1.89, 1.92, 2.11], False),  # one within 0.1 A, the others beyond
    ],
)
def test_a_level_is_read_by_a_straight_line_from_three_samples_that_are_apart(near_level, told):
    """Volt-seconds and charge of straight lines over the current, read at 2 A within 0.1 A."""
    i = np.array([0.5, *near_level, 3.5, 2.0, 2.0, 2.0])
    t = Trace(i, 0.3 + 0.2 * i, 0.05 - 0.01 * i, 0.0)
    found = _at(t, slice(0, len(near_level) + 2), 2.0, 0.1)
    assert found == (pytest.approx((0.7, 0.03)) if told else None)


def test_angles_of_one_clamped_position_are_one():
    """Their mean, each as often as it was recorded."""
    traces = [trace(pulse(up=n, mean=True)) for n in (50, 60, 70)]
    at = {0.0: traces[:1], 0.001: traces[1:], 45.0: traces[:1], 90.0: traces}
    angles, groups = _positions(at)
    assert angles == pytest.approx([0.002 / 3, 45, 90]) and [len(g) for g in groups] == [3, 1, 3]


def noisy_sine(columns):
    """A polynomial's basis, the penalty of its coefficients, and rows with noise."""
    rng = np.random.default_rng(7)
    x = np.linspace(0, 1, 40)
    rows = np.sin(3 * x)[:, None] + 0.05 * rng.normal(size=(40, columns))
    return np.vander(x, 9, increasing=True), np.diff(np.eye(9), 2, axis=0), rows


def test_a_smooth_fit_is_the_least_of_its_cost_at_the_weight_that_leaves_least_out():
    """By brute force: |basis x - row|^2 + w |penalty x|^2 for each w, cross-validated."""
    basis, penalty, rows = noisy_sine(1)
    row = rows[:, 0]
    scores, costs = [], []
    for weight in SMOOTHING:
        hat = basis @ np.linalg.solve(basis.T @ basis + weight * penalty.T @ penalty, basis.T)
        costs.append(((row - hat @ row) ** 2).sum())
        scores.append(costs[-1] / (40 - np.trace(hat)) ** 2)
    best = int(np.argmin(scores))
    fast = _smoothed(basis, penalty, row)
    assert ((row - basis @ fast) ** 2).sum() == pytest.approx(costs[best], rel=0.02)
    one = penalised(basis, penalty, rows, 0.3)[:, 0]
    gradient = basis.T @ (basis @ one - row) + 0.3 * penalty.T @ (penalty @ one)
    assert gradient == pytest.approx(0 * one, abs=1e-9)


def test_the_likeliest_weight_is_that_of_the_density_of_what_no_straight_line_tells():
    """By brute force: contrasts of the rows are normal, with the variance of noise and of x."""
    basis, penalty, rows = noisy_sine(3)
    rough = penalty.T @ penalty
    _, _, axes = np.linalg.svd(penalty)
    free = basis @ axes[7:].T  # what the penalty lets pass
    contrasts = np.linalg.svd(free)[0][:, 2:]
    seen, scores = contrasts.T @ rows, []
    for weight in SMOOTHING:
        of_x = basis @ np.linalg.pinv(rough) @ basis.T / weight
        variance = contrasts.T @ (np.eye(40) + of_x) @ contrasts
        fit = np.trace(seen.T @ np.linalg.solve(variance, seen))
        scores.append(38 * np.log(fit) + np.linalg.slogdet(variance)[1])
    assert likeliest(basis, penalty, rows)[1] == SMOOTHING[int(np.argmin(scores))]


def test_of_two_penalties_the_one_is_likelier_whose_values_are_straight_where_the_row_is():
    """Both let only a constant pass: values that are mirrored at the ends."""
    n = np.arange(20)
    mirrored = np.eye(20)[[2, 1, *n, 18, 17]]
    noise = 1e-3 * np.random.default_rng(5).normal(size=20)
    kinked, bent = np.clip(n - 7.0, 0, 6), np.cos(n * np.pi / 19)
    for row, best in ((kinked + noise, 0), (bent + noise, 1)):
        found = [
            likeliest(np.eye(20), np.diff(mirrored, order, axis=0), row[:, None])[0]
            for order in (2, 4)
        ]
        assert int(np.argmax(found)) == best


@pytest.mark.parametrize("seed", range(8))
def test_inexact_angles_do_not_pass_for_flux_linkage(seed):
    """All currents of a clamped angle share its error, here up to 0.1 deg of eight poles."""
    i, theta = np.linspace(0, 20, 41), np.linspace(0, np.pi, 26)
    held = np.abs(theta + np.random.default_rng(seed).uniform(-0.014, 0.014, 26))
    psi = np.tanh(i[:, None] / 9) * (0.1 - 0.06 * np.cos(held)) + 1e-3 * i[:, None]
    repaired = repair_map(FluxTable(N_r=8, i=i, theta_e=theta, psi=psi)).table.psi
    slope = np.diff(repaired[-1]) / np.diff(theta)
    exact = np.tanh(20 / 9) * -0.06 * np.diff(np.cos(theta)) / np.diff(theta)
    assert np.abs(slope - exact).max() < 0.02 * exact.max()


@pytest.mark.parametrize(
    ("quantity", "name", "factor"),
    [
        ("t", "t_s", 1), ("t", "time [ms]", 1e-3), ("t", "Time (us)", 1e-6), ("t", "t", 1),
        ("t", "Second", 1), ("u", "u_V", 1), ("u", "u_mean_V", 1), ("u", "Voltage [mV]", 1e-3),
        ("u", "v_kV", 1e3), ("u", "CH1 [V]", 1), ("t", "X", None), ("u", "CH1", None),
        ("t", "t_V", None), ("i", "i_A", 1), ("i", "i_mA", 1e-3), ("i", "u_V", None),
        ("theta", "theta_m_deg", 1), ("theta", "i_A", None),
    ],
)  # fmt: skip
def test_columns_are_known_by_their_name_or_their_unit(quantity, name, factor):
    found = _known(quantity, name, stated=False)
    assert found is None if factor is None else found.factor == factor
    assert _known("t", "X", stated=True).factor == 1
    assert _known("u", "CH1 [mV]", stated=True).factor == 1e-3


def test_start_and_increment_stand_in_the_place_of_times_and_a_probe_scales(tmp_path):
    rows = "\n".join(f"{v},{c}" for v, c in zip([0] * 6 + [5] * 6, range(12), strict=True))
    path = tmp_path / "a.csv"
    path.write_text(f"Start,Increment\n-2.5,0.5\nCH1 [V],CH2 [V]\n{rows}\n")
    names = {"u": "CH1 [V]", "i": "CH2 [V]"}
    (one,) = read_pulses([path], angles=[12.5], names=names, probe=10.0).pulses
    bare = read_pulses([path], angles=[12.5], names={"u": "CH1", "i": "CH2"}, probe=10.0)
    assert (bare.pulses[0].i == one.i).all()  # a name without its unit
    assert one.t == pytest.approx(-2.5 + 0.5 * np.arange(12)) and one.angle == 12.5
    assert one.i == pytest.approx(10.0 * np.arange(12)) and not one.mean
    path.write_text(f"Start,Increment\n-2.5,0\nCH1 [V],CH2 [V]\n{rows}\n")
    with pytest.raises(ParameterError, match="no number below `Increment`"):
        read_pulses([path], angles=[12.5], names=names)
    with pytest.raises(ParameterError, match="2 angles for 1 files"):
        read_pulses([path], angles=[1, 2])


def test_a_pulse_ends_where_the_time_falls_back_or_the_angle_changes(tmp_path):
    path = tmp_path / "a.csv"
    lines = [
        f"{t},{a},{5 * (t > 3)},{t}"
        for a, n in ((0, 2), (10, 1))
        for _ in range(n)
        for t in range(8)
    ]
    path.write_text("t_ms,theta_e_deg,u_mean_V,i_A\n" + "\n".join(lines))
    found = read_pulses([path])
    assert [p.angle for p in found.pulses] == [0, 0, 10] and all(p.mean for p in found.pulses)
    assert all(p.t == pytest.approx(1e-3 * np.arange(8)) for p in found.pulses)
    assert (found.unit, found.kind) == ("deg", "electrical")
    path.write_text("t_ms,theta_e_deg,u_mean_V,i_A\n" + "\n".join(lines[:15]))
    with pytest.raises(ParameterError, match="data row 9: the pulse there has 7 rows, need 8"):
        read_pulses([path])


@pytest.mark.parametrize("below", ["", "(time),(mean),(of it),(rotor)\n", "s,V,A,deg\n"])
def test_a_row_of_words_below_the_names_is_no_row_of_numbers(below, tmp_path):
    """Where it says no units, those of the names count."""
    path = tmp_path / "a.csv"
    lines = [f"{t},{5 * (t > 3)},{t},30" for t in range(9)]
    path.write_text("t_s,u_V,i_A,theta_m_deg\n" + below + "\n".join(lines))
    (one,) = read_pulses([path]).pulses
    assert np.array_equal(one.i, np.arange(9.0)) and np.array_equal(one.t, one.i)


def test_a_column_that_is_missing_is_told_with_the_options_that_help(tmp_path):
    """An angle may be given for each file, what is measured may not."""
    path, rows = tmp_path / "a.csv", "\n0,0,0" * 9
    for quantity, head in (("u", "t_s,what,i_A"), ("theta", "t_s,u_V,i_A")):
        path.write_text(head + rows)
        with pytest.raises(ParameterError, match=f"no column for {quantity}, need") as fault:
            read_pulses([path], angles=[] if quantity == "theta" else [1.0])
        assert f"say --name {quantity}=NAME" in str(fault.value)
        assert ("or --angle for each file" in str(fault.value)) == (quantity == "theta")


def test_a_repair_tells_what_it_changed_where_and_leaves_a_clean_table():
    i, theta = np.linspace(0, 10, 11), np.linspace(0, np.pi, 13)
    clean = np.outer(np.tanh(i / 6), 0.1 - 0.06 * np.cos(theta))
    assert repair_map(FluxTable(N_r=4, i=i, theta_e=theta, psi=clean)).psi_change_max < 1e-3
    spoilt = clean.copy()
    spoilt[6, 4] += 0.02
    found = repair_map(FluxTable(N_r=4, i=i, theta_e=theta, psi=spoilt))
    change = (found.table.psi - spoilt) / spoilt.max()
    assert found.psi_change_rms == pytest.approx(np.sqrt((change**2).mean()))
    assert found.psi_change_max == pytest.approx(abs(change).max())
    assert (found.i_worst, found.theta_e_worst) == (6, pytest.approx(np.pi / 3))
    assert found.falling_before == int((np.diff(spoilt, axis=0) <= 0).sum()) > 0
    assert np.all(np.diff(found.table.psi, axis=0) > 0) and not found.table.psi[0].any()
    (note,) = found.notes
    assert f"at most {100 * found.psi_change_max:.2g} % of its maximum at 6 A, 60 deg el." in note
    assert f"{found.falling_before} falling current steps removed" in note
