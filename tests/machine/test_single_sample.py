"""One mistyped sample of a flux table is found and named; what machines have is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import command, refused
from test_flux_map import sampled

import reluctance as rl
from reluctance.machine.maps import FluxTable, check_map, read_map
from reluctance.machine.maps.single_sample import _off, wrong_sample

MACHINES = Path(__file__).parents[2] / "machines"
MAPS = sorted(
    p.stem
    for p in MACHINES.glob("*.toml")
    if p.with_suffix(".csv").exists() and "pairs" not in p.stem
)
GOOD = sampled(np.linspace(0, 450, 46), np.linspace(0, np.pi, 31))


def of_library(name: str) -> FluxTable:
    machine = rl.load(
        MACHINES.parent / "examples" / "sharing_cubic.toml",
        [f"machine={MACHINES / name}.toml"],
        check_torque=False,
    ).machine
    return read_map(MACHINES / f"{name}.csv", N_r=machine.N_r)


def mistyped(table: FluxTable, k: int, n: int, factor: float) -> FluxTable:
    psi = table.psi.copy()
    psi[k, n] *= factor
    return replace(table, psi=psi)


def every(table: FluxTable, currents: int, angles: int) -> FluxTable:
    """A coarse part of a table, with both ends of its half period."""
    rows = np.arange(0, len(table.i), currents)
    columns = np.unique(np.append(np.arange(0, len(table.theta_e), angles), len(table.theta_e) - 1))
    part = table.psi[np.ix_(rows, columns)]
    return FluxTable(table.N_r, table.i[rows], table.theta_e[columns], part)


@pytest.mark.parametrize("torque", ["given", "absent"])
@pytest.mark.parametrize(
    ("k", "n", "factor"),
    [(20, 15, 1.08), (20, 15, 0.98), (3, 28, 1.05), (1, 25, 1.1), (30, 0, 1.03), (44, 30, 0.97)],
)
def test_one_mistyped_sample_is_refused_and_named_with_what_it_should_be(
    k: int, n: int, factor: float, torque: str
) -> None:
    table = GOOD if torque == "given" else replace(GOOD, tau=None)
    report = check_map(mistyped(table, k, n, factor))
    assert report.verdict == "refused"
    angle = f"{np.degrees(GOOD.theta_e[n]):.5g}"
    assert f"the sample at {GOOD.i[k]:.5g} A, {angle} deg el. is off by" in report.reasons[0]
    assert report.sample_error == pytest.approx(abs(factor - 1), rel=0.05)
    found = wrong_sample(mistyped(table, k, n, factor))
    assert found is not None and found.more == 0
    assert found.expected == pytest.approx(GOOD.psi[k, n], rel=2e-3)
    assert check_map(table).sample_error == 0


@pytest.mark.parametrize(
    ("currents", "angles", "judged"),
    [(7, 10, True), (7, 9, False), (6, 12, True), (5, 20, False), (10, 7, True), (11, 6, False)],
)
def test_a_table_is_judged_from_six_currents_seven_angles_and_sixty_samples_on(
    currents: int, angles: int, judged: bool
) -> None:
    """Those at 0 A are none of the sixty: every machine has them."""
    table = sampled(np.linspace(0, 450, currents), np.linspace(0, np.pi, angles))
    found = wrong_sample(mistyped(table, currents // 2, angles // 2, 1.3))
    assert (found is not None) == judged


def test_two_mistyped_samples_are_both_counted() -> None:
    found = wrong_sample(mistyped(mistyped(GOOD, 20, 15, 1.08), 30, 5, 0.95))
    assert found is not None and (found.i, found.more) == (200.0, 1)


@pytest.mark.parametrize(("apart", "more"), [(2, 0), (3, 1)])
@pytest.mark.parametrize("way", [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_a_sample_beyond_the_cubics_of_another_is_counted(
    way: tuple[int, int], apart: int, more: int
) -> None:
    other = mistyped(GOOD, 20 + apart * way[0], 15 + apart * way[1], 1.07)
    found = wrong_sample(mistyped(other, 20, 15, 1.08))
    assert found is not None and (found.i, found.more) == (200.0, more)


def test_the_last_current_weighs_by_what_its_cubic_leaves_open() -> None:
    """There the cubic is continued past its samples, and noise counts six times as much."""
    both = mistyped(mistyped(GOOD, 45, 10, 1.1), 20, 20, 1.07)
    found = wrong_sample(both)
    assert found is not None and found.psi == both.psi[20, 20]


def test_a_sample_of_a_whole_period_is_found() -> None:
    whole = sampled(np.linspace(0, 450, 46), np.linspace(0, 2 * np.pi, 61)[:-1])
    assert wrong_sample(whole) is None
    found = wrong_sample(mistyped(whole, 20, 59, 1.04))
    assert found is not None and found.theta_e == pytest.approx(whole.theta_e[59])


@pytest.mark.parametrize("n", [0, 1, 2, 3, 30, 57, 58, 59])
def test_a_sample_of_a_whole_period_is_expected_on_the_cubic_around_the_circle(n: int) -> None:
    """Through the two samples before it and the two behind; by Lagrange's weights -1/6, 2/3."""
    whole = sampled(np.linspace(0, 450, 46), np.linspace(0, 2 * np.pi, 61)[:-1])
    wrong = mistyped(whole, 20, n, 1.2)
    found = wrong_sample(wrong)
    assert found is not None and (found.more, found.theta_e) == (0, whole.theta_e[n])
    near = [whole.psi[20, (n + step) % 60] for step in (-2, -1, 1, 2)]
    assert found.expected == pytest.approx(np.dot([-1, 4, 4, -1], near) / 6, rel=1e-9)
    assert found.psi == wrong.psi[20, n]
    least = 0.05 * np.abs(wrong.psi).max()
    off = (found.psi - found.expected) / max(found.expected, least)
    assert found.error == pytest.approx(off, rel=1e-9)


def test_samples_are_compared_with_the_cubics_through_their_four_neighbours() -> None:
    """By numpy's polynomials, at uneven steps; the deviation of noise by a sample of many."""
    random = np.random.default_rng(5)
    x = np.cumsum(random.uniform(0.5, 2, 9))
    values = random.normal(size=(9, 2000))
    off, noise = _off(x, values, 2, 7)
    assert off.shape == (7, 2000) and noise.shape == (7, 1)
    for row, n in enumerate(range(2, 9)):
        start = min(n - 2, 4)
        near = [m for m in range(start, start + 5) if m != n]
        cubics = np.polynomial.polynomial.polyfit(x[near], values[near], 3)
        expected = np.polynomial.polynomial.polyval(x[n], cubics)
        assert off[row] == pytest.approx(values[n] - expected, abs=1e-8)
        assert off[row].std() == pytest.approx(noise[row, 0], rel=0.05)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_of_the_library_has_none_but_where_one_is_put_in(name: str) -> None:
    table = of_library(name)
    assert wrong_sample(table) is None
    if len(table.i) < 6:
        return
    k, n = len(table.i) // 2, 2 * len(table.theta_e) // 3
    found = wrong_sample(mistyped(table, k, n, 1.05))
    assert found is not None and found.i == table.i[k]
    assert found.error == pytest.approx(0.05, rel=0.2)
    for currents in (1, 2, 3):
        for angles in (2, 3, 4, 5):
            assert wrong_sample(every(table, currents, angles)) is None, (currents, angles)


@pytest.mark.parametrize("share", [1e-4, 1e-3, 1e-2])
def test_noise_is_no_wrong_sample(share: float) -> None:
    random = np.random.default_rng(1)
    for _ in range(40):
        noise = share * random.normal(size=GOOD.psi.shape)
        assert wrong_sample(replace(GOOD, psi=GOOD.psi * (1 + noise))) is None


@pytest.mark.parametrize("step", [3.0, 6.0, 12.0, 20.0])
@pytest.mark.parametrize("knee", [2, 8, 40])
def test_corners_over_angle_and_current_are_no_wrong_sample(step: float, knee: int) -> None:
    """Poles that begin to overlap at 45 to 62.5 degrees, and iron that saturates within a step."""
    theta = np.radians(np.arange(0.0, 180.1, step))
    for at in (45.0, 57.0, 60.0, 62.5):
        for n_i in (6, 8, 11, 21):
            i = np.linspace(0, 10, n_i)
            past = np.degrees(theta) - at
            L = 0.002 + 7e-4 * (past + np.hypot(past, 0.1)) / 2 - 0.0002 * np.cos(theta)
            linked = i[:, None] * L
            psi = linked / (1 + (linked / 0.12) ** knee) ** (1 / knee) + 1e-3 * i[:, None]
            assert wrong_sample(FluxTable(4, i, theta, psi)) is None, (at, n_i)


def test_the_command_names_the_sample_and_its_remedy_works(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    rows = [
        [f"{i:g}", f"{np.degrees(angle):g}", f"{psi:.6f}"]
        for i, line in zip(GOOD.i, GOOD.psi, strict=True)
        for angle, psi in zip(GOOD.theta_e, line, strict=True)
    ]
    wrong = next(row for row in rows if row[:2] == ["200", "120"])
    wrong[2] = f"{1.06 * float(wrong[2]):.6f}"

    def check() -> str:
        head = "i_A,theta_e_deg,psi_Wb\n"
        path.write_text(head + "".join(",".join(row) + "\n" for row in rows))
        return command("map", "check", path, "--N_r", "4").out

    told = check()
    assert "the sample at 200 A, 120 deg el. is off by 6 %, need at most 0.5 %" in told
    wrong[2] = told.partition("its neighbours give ")[2].split()[0]
    assert "off by" not in check() and "good" in check()


@pytest.mark.parametrize("seed", range(6))
def test_noise_at_0_A_is_taken_off_so_that_a_noisy_table_can_be_repaired(
    seed: int, tmp_path: Path
) -> None:
    """Readings of 1 % noise, those at 0 A too: the table is refused for its noise, and repaired."""
    noise = 0.01 * GOOD.psi.max() * np.random.default_rng(seed).normal(size=GOOD.psi.shape)
    path, mended = tmp_path / "map.csv", tmp_path / "mended.csv"

    def write(off: np.ndarray) -> None:
        rows = [
            f"{i:g},{np.degrees(angle):g},{psi:.6f}\n"
            for i, line in zip(GOOD.i, GOOD.psi + off, strict=True)
            for angle, psi in zip(GOOD.theta_e, line, strict=True)
        ]
        path.write_text("i_A,theta_e_deg,psi_Wb\n" + "".join(rows))

    write(noise)
    line = ("map", "check", path, "--N_r", "4")
    told = command(*line)
    assert told.code == 1 and "at 0 A" in told.out and "set to 0" in told.out
    assert "noise of flux" in told.out and "use --repair" in told.out
    assert command(*line, "--repair", mended).code == 0
    for off in (0.03 * GOOD.psi.max(), 0.03 * np.cos(GOOD.theta_e)[np.newaxis]):
        write(noise / 10 + off)  # an offset, and a curve over the angle
        asked = refused(*line)
        assert "flux at 0 A is" in asked and "it is noise: leave the samples at 0 A out" in asked


def test_flux_that_falls_is_told_with_the_step_where_it_falls_most() -> None:
    psi = GOOD.psi.copy()
    psi[20:, 12] -= 0.2  # from 190 to 200 A at 72 degrees
    psi[30:, 3] -= 0.02
    told = check_map(replace(GOOD, psi=psi)).reasons
    assert any("most from 190 to 200 A at 72 deg el.; mend" in reason for reason in told)
