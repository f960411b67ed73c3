"""The source paper's study: printed algebra, physical bounds, and a report that is whole."""

import json
import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from command import command, on_terminal
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from typer.testing import CliRunner

from reluctance import paper
from reluctance.base.errors import ParameterError
from reluctance.cli import app
from reluctance.paper import figures, printed, pump, study
from reluctance.paper.claim import Claim, line
from reluctance.paper.claims_results import torque_ripple
from reluctance.paper.points import HALF, RATED, Runs
from reluctance.paper.response import LEVEL, least_time, least_voltage

COARSE = paper.Grid(
    u_dc=(240.0,), angle_step_deg=3.5, settings={"N_p": [3], "N_c": [1, 2], "r_w": [0.05]}
)
KEYS = ["claim", "paper_says", "model_gives", "unit", "physical_limit", "verdict", "why"]
MACHINE = RATED.drive().machine
RPM = np.pi / 30
L_U, L_SAT, A = 0.67e-3, 0.15e-3, 0.468 - 0.15e-3 * 450  # sect. 3 of the paper, psi_m as printed
B, R = (23.62e-3 - L_SAT) / A, 0.72


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[paper.Report, Path]]:
    """The report on coarse sweeps, with a cache of its own that later tests share."""
    folder = tmp_path_factory.mktemp("paper")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RELUCTANCE_CACHE", str(folder / "cache"))
        patch.setattr(study, "FULL", COARSE)
        yield paper.write(folder / "new" / "report"), folder / "new" / "report"


@pytest.fixture(scope="module")
def found(written: tuple[paper.Report, Path]) -> study.Study:
    """What the report was made from."""
    return study.study()


def rows_of(folder: Path) -> list[dict[str, object]]:
    rows = json.loads((folder / "claims.json").read_text(encoding="utf-8"))
    assert isinstance(rows, list)
    return rows


def row(folder: Path, start: str) -> dict[str, object]:
    (found,) = [r for r in rows_of(folder) if str(r["claim"]).startswith(start)]
    return found


# The paper's angle from alignment; independent of the core.
def le_huy(
    i: NDArray, theta: NDArray, A: float = A, B: float = B
) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """psi, tau towards alignment, dpsi/di, dpsi/dtheta_m forwards; theta in [-pi/4, pi/4]."""
    a = np.abs(theta)
    f = 128 / np.pi**3 * a**3 - 48 / np.pi**2 * a**2 + 1
    slope = -np.sign(theta) * (96 / np.pi**2 * a - 384 / np.pi**3 * a**2)
    rise = L_SAT * i + A * (1 - np.exp(-B * i)) - L_U * i
    bracket = (L_SAT - L_U) * i**2 / 2 + A * i - A / B * (1 - np.exp(-B * i))
    L_inc = L_U + (L_SAT - L_U + A * B * np.exp(-B * i)) * f
    return L_U * i + rise * f, bracket * slope, L_inc, rise * slope


def from_alignment(theta_m: float) -> NDArray:
    """Angles of the three phases from alignment; theta_m = 0 has phase a unaligned."""
    theta = theta_m - np.pi / 4 - np.arange(3) * np.pi / 6
    return (theta + np.pi / 4) % (np.pi / 2) - np.pi / 4


@pytest.mark.parametrize(("a", "b", "rpm"), [(0.28e-3, -0.6, 1500), (11.0, 3.0, 10), (1, 0, 0)])
def test_no_input_reaches_the_output_of_the_printed_matrices(
    a: float, b: float, rpm: float
) -> None:
    matrices = printed.matrices(a, b, rpm * RPM)
    assert not printed.markov(*matrices, 12).any()
    assert printed.controllability_rank(*matrices[:2]) == 3
    F, Phi = printed.prediction(*matrices, N_p=3, N_c=2)
    assert F.any() and not Phi.any()
    assert not printed.increments(F, Phi, np.ones(7), reference=41.339, r_w=0.05).any()


def test_printed_matrices_have_two_runaway_poles_at_1500_rpm() -> None:
    matrix, _, _ = printed.matrices(0.28e-3, -0.6, 1500 * RPM)
    poles = np.sort(np.linalg.eigvals(matrix).real)
    np.testing.assert_allclose(poles[-2:], [41.339, 4628.9], rtol=1e-5)


@pytest.mark.parametrize(
    ("r_w", "moves"), [(0.0, [7.2, -6.4, 0, 0]), (10.0, [0.1269, 0.1034, 0.0829, 0.0650])]
)
def test_prediction_is_the_textbooks(r_w: float, moves: list[float]) -> None:
    F, Phi = printed.prediction(
        np.array([[0.8]]), np.array([[0.1]]), np.array([[1.0]]), N_p=10, N_c=4
    )
    assert (Phi.T @ Phi)[0, 0] == pytest.approx(1.1541, abs=5e-5)
    np.testing.assert_allclose((Phi.T @ F)[0], [9.2325, 3.2147], atol=5e-5)
    u = printed.increments(F, Phi, np.array([0.1, 0.2]), reference=1.0, r_w=r_w)
    np.testing.assert_allclose(u, moves, atol=6e-5)


def test_position_function_as_printed_is_six_where_it_must_be_zero() -> None:
    assert printed.position(np.pi / 4) == pytest.approx(6, rel=1e-15)
    assert printed.position(0.0) == printed.position(np.pi / 2) == 1


@pytest.mark.parametrize("i", [5.0, 50.0, 117.0])
def test_printed_and_mended_torque_differ_by_the_place_of_one_bracket(i: float) -> None:
    theta = np.linspace(0, np.pi / 4, 9)
    _, tau, _, _ = le_huy(np.full(9, i), -theta)
    slope = -(96 / np.pi**2 * theta - 384 / np.pi**3 * theta**2)
    outside = (L_SAT - L_U) * i**2 / 2 + A * i  # what the printed bracket leaves without f'
    as_printed = [printed.torque(i, t, L_sat=L_SAT, A=A, B=B) for t in theta]
    np.testing.assert_allclose(-tau - np.array(as_printed), outside * (slope - 1), atol=1e-9)
    np.testing.assert_allclose(MACHINE.tau(i, np.pi - 4 * theta), tau, atol=1e-9)


@pytest.mark.parametrize(("tau", "rpm"), [(41.339, 1522.9), (20.669, 1059.1)])
def test_pump_comes_to_rest_where_the_torques_balance(tau: float, rpm: float) -> None:
    def surplus(omega_m: float) -> float:
        return tau - 0.0015 * omega_m**2 - 0.02 * omega_m

    root = brentq(surplus, 0, 1000, xtol=1e-12)
    assert pump.equilibrium_speed(tau, k_pump=0.0015, B=0.02) == pytest.approx(root, rel=1e-12)
    assert root / RPM == pytest.approx(rpm, abs=0.05)
    rate = (surplus(root + 1e-4) - surplus(root - 1e-4)) / 2e-4 / 0.008
    assert pump.pole(root, k_pump=0.0015, B=0.02, J=0.008) == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize(
    ("u", "deg", "rpm", "tau"),
    [(240, 5, 1500, 39.27), (240, 0, 1500, 39.27), (400, 20, 0, 41.339), (300, 25, 1060.7, 19.6)],
)
def test_bound_is_the_torque_of_full_voltage_on_all_phases_that_help(
    u: float, deg: float, rpm: float, tau: float
) -> None:
    """Against SciPy's DOP853 on the flux linkages, the level located as an event."""
    omega_m, start = rpm * RPM, np.radians(deg)

    def current(psi: NDArray, theta: NDArray) -> NDArray:
        return np.array(
            [
                brentq(lambda i, p=p, a=a: le_huy(i, a)[0] - p, -1, 2000, xtol=1e-12)
                for p, a in zip(psi, theta, strict=True)
            ]
        )

    def slope(t: float, psi: NDArray) -> NDArray:
        return u - R * current(psi, from_alignment(start + omega_m * t))

    def short(t: float, psi: NDArray) -> float:
        theta = from_alignment(start + omega_m * t)
        return float(np.maximum(le_huy(current(psi, theta), theta)[1], 0).sum() - tau)

    short.terminal = True  # type: ignore[attr-defined]
    run = solve_ivp(
        slope, (0, 4e-3), np.zeros(3), method="DOP853", events=short, rtol=1e-8, atol=1e-10
    )
    bound = least_time(MACHINE, tau=tau, omega_m=omega_m, u_dc=u, theta_m=start, horizon=4e-3)
    assert bound.item() == pytest.approx(run.t_events[0][0], abs=1e-8)


def test_no_voltage_pattern_beats_the_bound() -> None:
    """2000 random patterns of -u, 0, +u in each phase: none is at the torque before the bound."""
    u, omega_m, start, tau = 240.0, 1500 * RPM, np.radians(2.0), 39.27
    bound = least_time(
        MACHINE, tau=tau, omega_m=omega_m, u_dc=u, theta_m=start, horizon=4e-3
    ).item()
    rng = np.random.default_rng(1)
    n, dt = 400, bound / 400
    likely = rng.uniform(0, 1, (3, 2000))  # share of full voltage, up to always
    full = rng.uniform(size=(n, 3, 2000)) < likely**0.2
    pattern = np.where(full, u, rng.choice([-u, 0.0], (n, 3, 2000)))
    i, greatest = np.zeros((3, 2000)), np.zeros(2000)
    for step in range(n):
        theta = from_alignment(start + omega_m * dt * (step + 0.5))[:, None]
        _, _, L_inc, psi_theta = le_huy(i, theta)
        i = np.maximum(i + dt * (pattern[step] - R * i - omega_m * psi_theta) / L_inc, 0)
        end = from_alignment(start + omega_m * dt * (step + 1))[:, None]
        greatest = np.maximum(greatest, le_huy(i, end)[1].sum(axis=0))
    assert 0.5 * tau < greatest.max() < tau * 1.001


@pytest.mark.parametrize(("point", "u_flux"), [(RATED, 304), (HALF, 250)])
def test_least_voltage_lies_between_flux_alone_and_flux_with_greatest_drop(
    point: object, u_flux: float
) -> None:
    """At standstill (u - R i) t <= psi <= u t; one phase needs u_flux for its flux alone."""
    tau, within = point.tau_ref, point.response  # type: ignore[attr-defined]
    deg = np.arange(0, 30, 0.5)
    least = least_voltage(MACHINE, tau=tau, omega_m=0.0, theta_m=np.radians(deg), within=within)
    i = np.linspace(0, 700, 14001)
    for angle, u in zip(deg, least, strict=True):
        theta = from_alignment(np.radians(angle))
        curves = [le_huy(i, np.full_like(i, a)) for a in theta if a < -1e-9]

        def torque(psi: float, curves: list = curves) -> float:
            return sum(np.interp(psi, c[0], c[1]) for c in curves)

        psi = brentq(lambda psi: torque(psi) - tau, 0, 3)
        i_end = max(np.interp(psi, c[0], i) for c in curves)
        assert psi / within < u < psi / within + R * i_end
    theta = np.linspace(-np.pi / 4, 0, 901)[:, None]
    A_other = 0.486 - L_SAT * 450  # of the generic machine, for which u_flux was published
    psi, torque_one, _, _ = le_huy(i[None], theta, A_other, (23.62e-3 - L_SAT) / A_other)
    assert psi[torque_one >= tau].min() / within == pytest.approx(u_flux, rel=0.005)


@pytest.mark.long
def test_controller_is_never_faster_than_physics(found: study.Study) -> None:
    for response in (found.rated_response, found.half_response):
        assert np.isfinite(response.reached).all()
        assert (response.reached >= response.bound - 1e-7).all()
        assert response.reached.min() < 1.5 * response.bound.min()
        assert response.u_least <= response.u_reached


@pytest.mark.long
def test_command_writes_what_it_says_and_the_same_bytes_again(
    written: tuple[paper.Report, Path], tmp_path: Path
) -> None:
    _, first = written
    second = tmp_path / "out"
    answer = CliRunner().invoke(app, ["paper", "--out", str(second)])
    assert answer.exit_code == 0, answer.output
    names = {f"{p.name}.png" for p in figures.PICTURES} | {"claims.json", "report.html"}
    assert {p.name for p in second.iterdir()} == names
    for name in names:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
        assert str(second / name) in answer.output
    assert "not confirmed" in answer.output


@pytest.mark.long
def test_every_claim_has_the_same_seven_fields(written: tuple[paper.Report, Path]) -> None:
    report, folder = written
    rows = rows_of(folder)
    assert len(rows) == len(report.claims) >= 30
    for r in rows:
        assert list(r) == KEYS
        assert r["verdict"] in ("confirmed", "not confirmed", "cannot be checked")
        for key in ("claim", "why", "unit"):
            assert isinstance(r[key], str)
        assert r["claim"] and r["why"]
        for key in ("paper_says", "model_gives", "physical_limit"):
            assert r[key] is None or isinstance(r[key], str | float | int)
    assert len({r["claim"] for r in rows}) == len(rows)


@pytest.mark.long
@pytest.mark.parametrize(
    ("start", "says", "gives", "verdict"),
    [
        ("Table 1: 6 kW", 41.339, 38.197, "not confirmed"),
        ("Section 4: with 41.339 N m the pump", 1500, 1522.9, "not confirmed"),
        ("Section 4: with 20.669 N m the pump", 1060.7, 1059.1, "not confirmed"),
        ("Section 3: the position function", 6, 0, "not confirmed"),
        ("Section 3: the torque equation", 19.4, 0, "not confirmed"),
        ("Section 3: the flux at the maximum point", 0.468, 0.486, "not confirmed"),
        ("Section 3: the maximum point lies", 0.468, 0.438, "not confirmed"),
        ("Eq. 3.1: the printed pair", 6, 3, "not confirmed"),
        ("Eq. 3.1, A row 4", 4629, -61.4, "not confirmed"),
        ("Section 4: in steady state at rated torque", 0, None, "not confirmed"),
        ("Section 4: in steady state at half torque", 0, None, "not confirmed"),
        ("Section 4: in steady state at 1500 rpm the speed", 0, None, "confirmed"),
        ("Section 4: in steady state at 1060.7 rpm the speed", 0, None, "confirmed"),
        ("Fig. 8: from standstill the drive reaches and holds 1500", 1500, 1500, "confirmed"),
        ("Section 4: the torque response time at rated", 0.35, None, "not confirmed"),
        ("Section 4: the torque response time at half", 0.28, None, "not confirmed"),
        ("Section 5: no dc-dc converter is needed", "none needed", -3.1236, "confirmed"),
    ],
)
def test_claim_is_there_with_its_numbers(
    written: tuple[paper.Report, Path],
    start: str,
    says: float | str,
    gives: float | None,
    verdict: str,
) -> None:
    found = row(written[1], start)
    assert found["paper_says"] == (says if isinstance(says, str) else pytest.approx(says, rel=2e-3))
    if gives is not None:
        assert found["model_gives"] == pytest.approx(gives, rel=1e-3, abs=1e-9)
    assert found["verdict"] == verdict


@pytest.mark.long
def test_physical_limits_are_the_published_ones(written: tuple[paper.Report, Path]) -> None:
    for load, i_rms, p_cu in (("rated", 48.9, 5171), ("half", 28.7, 1780)):
        current = row(written[1], f"Abstract: the MPC minimises the stator currents ({load}")
        assert current["physical_limit"] == pytest.approx(i_rms, rel=2e-3)
        assert i_rms * 0.999 < float(str(current["model_gives"])) < i_rms * 1.08
        loss = row(written[1], f"Table 1: R_s = 0.72 ohm in a 6 kW machine (copper loss at {load}")
        assert loss["physical_limit"] == pytest.approx(p_cu, rel=2e-3)


@pytest.mark.long
def test_bound_of_the_report_is_that_of_95_percent(written: tuple[paper.Report, Path]) -> None:
    least = row(written[1], "Section 4: the dc-link voltage that 0.35 ms")
    u = float(str(least["physical_limit"]))
    angles = np.radians(np.arange(0, 30, 0.25))
    for factor, possible in ((0.999, False), (1.001, True)):
        time = least_time(
            MACHINE,
            tau=LEVEL * 41.339,
            omega_m=1500 * RPM,
            u_dc=factor * u,
            theta_m=angles,
            horizon=0.35e-3,
        )
        assert np.isfinite(time).any() == possible


@pytest.mark.long
def test_report_needs_no_other_file(written: tuple[paper.Report, Path]) -> None:
    text = (written[1] / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"https?:|<script|<link|@import|url\(", text)
    sources = re.findall(r'src="([^"]*)"', text)
    assert len(sources) == len(figures.PICTURES)
    for source, picture in zip(sources, figures.PICTURES, strict=True):
        image = b64decode(source.removeprefix("data:image/png;base64,"))
        assert image == (written[1] / f"{picture.name}.png").read_bytes()
        assert image.startswith(b"\x89PNG")
    assert text.count('class="verdict') == len(written[0].claims)
    for needed in ("240 V", "20 µs", "0.15 mH", "reluctance paper --out"):
        assert needed in text


@pytest.mark.long
def test_every_axis_has_a_label(found: study.Study) -> None:
    for picture in figures.PICTURES:
        for ax in picture.draw(found).axes:
            assert ax.get_ylabel(), picture.name
            assert ax.get_xlabel() or picture.name == "settings"


@pytest.mark.long
def test_interrupted_command_leaves_nothing(
    written: tuple[paper.Report, Path], tmp_path: Path
) -> None:
    def interrupt(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        paper.write(tmp_path / "a" / "b", progress=interrupt)
    assert not any(tmp_path.iterdir())


def test_file_in_place_of_the_folder_is_named_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(ParameterError, match="taken is a file"):
        paper.write(tmp_path / "taken" / "report")
    assert (tmp_path / "taken").read_text() == "mine"


@pytest.mark.long
@pytest.mark.parametrize("picture", figures.PICTURES, ids=lambda p: p.name)
def test_no_title_overlaps_a_legend(picture: figures.Picture, found: study.Study) -> None:
    figure = picture.draw(found)
    figure.draw_without_rendering()
    for ax in figure.axes:
        legend = ax.get_legend()
        if legend is None:
            continue
        for title in (ax.title, ax._left_title):  # type: ignore[attr-defined]
            if title.get_text():
                assert not title.get_window_extent().overlaps(legend.get_window_extent())


@pytest.mark.long
def test_claims_stand_below_each_other_on_a_narrow_screen(
    written: tuple[paper.Report, Path],
) -> None:
    """Each figure of a claim has its label then, since the head of the table is gone."""
    text = (written[1] / "report.html").read_text(encoding="utf-8")
    table = text.partition("<table class=claims>")[2].partition("</table>")[0]
    rows = table.split("<tr>")[1:]
    assert len(rows) == len(rows_of(written[1]))
    assert all(row.count("data-label=") == 4 for row in rows)
    narrow = text.partition("@media(max-width:50em)")[2].partition("</style>")[0]
    assert ".claims td{display:block}" in narrow and "content:attr(data-label)" in narrow


def test_claims_are_cut_at_the_width_of_a_terminal_and_whole_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    claim = Claim("a claim of many words " * 5, 1.0, 2.0, "%", None, "confirmed", "")
    report = SimpleNamespace(claims=(claim,), files=())
    monkeypatch.setattr("reluctance.paper.write", lambda *_, **__: report)
    whole, narrow = command("paper", "--out", tmp_path).out, on_terminal("paper", "--out", tmp_path)
    assert line(claim) in whole
    assert line(claim)[:80] in narrow and max(map(len, narrow)) == 80


def test_a_claim_of_the_ripple_is_in_percent_of_the_torque() -> None:
    kpis = {"torque_ripple_pp": 0.035, "torque_error_rms": 0.01, "f_switch": 1e4, "i_rms": 49.0}
    runs = SimpleNamespace(
        locked=SimpleNamespace(kpis=SimpleNamespace(**kpis)),
        best=SimpleNamespace(tau_error_max=0.1),
        point=SimpleNamespace(tau_ref=40.0, label="a point"),
    )
    claim = torque_ripple(cast(Runs, runs))
    assert (claim.unit, claim.verdict) == ("%", "not confirmed")
    assert (claim.model_gives, claim.physical_limit) == (pytest.approx(3.5), pytest.approx(0.5))
