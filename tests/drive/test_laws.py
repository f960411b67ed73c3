"""The [control] tables: what they compute at set-up, what they refuse, what the laws then do."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.toml_file import read_toml
from reluctance.drive.drive import drive_from
from reluctance.drive.laws import pulses as pulses_module
from reluctance.drive.laws.current_table import Window
from reluctance.drive.laws.least_copper import least_copper_angles
from reluctance.drive.laws.pulses import FixedLaw, chopped, pulses
from reluctance.machine.library import machine_table

EXAMPLES = Path(__file__).parents[2] / "examples"
SHARING, DITC, PWM = (EXAMPLES / f"{n}.toml" for n in ("sharing_cubic", "ditc", "pwm_current"))
DEMO, PULSE, DEADBEAT = (
    EXAMPLES / f"{n}.toml" for n in ("hysteresis_200A", "single_pulse", "deadbeat")
)


def run(path: Path, *overrides: str, until: float = 0.04) -> rl.Kpis:
    return rl.simulate(rl.load(path, list(overrides)), until=until, record=None).kpis


@pytest.mark.parametrize("path", [SHARING, DITC, DEADBEAT, PWM], ids=lambda p: p.stem)
@pytest.mark.parametrize("precision", ["double", "float"])
def test_laws_give_the_torque_that_is_asked(path: Path, precision: str) -> None:
    kpis = run(path, f"control.precision='{precision}'")
    assert kpis.tau_mean == pytest.approx(41.339, rel=0.01)


def test_the_default_bandwidth_given_in_hertz_gives_the_same_currents() -> None:
    control: Any = rl.load(PWM).control
    given = run(PWM, f"control.bandwidth_Hz={control.bandwidth / (2 * np.pi)!r}")
    assert given.i_rms == pytest.approx(run(PWM).i_rms, rel=1e-9)


def test_negative_torque_is_the_mirror_image() -> None:
    """Braking forwards gives the currents of motoring, from the machine's symmetry, backwards."""
    for path in (SHARING, DEADBEAT):
        kpis = run(path, "reference.tau_Nm=-41.339", "load.speed_rpm=-1500")
        assert kpis.tau_mean == pytest.approx(-run(path).tau_mean, rel=2e-3)


@pytest.mark.parametrize("tau", [10.0, 20.0, 41.339])
@pytest.mark.parametrize("law", ["angles", "pwm_current"])
def test_current_table_gives_its_torque_in_the_loop(tau: float, law: str) -> None:
    kpis = run(
        PWM,
        f"control.law='{law}'",
        f"reference.tau_Nm={tau}",
        "control.tau_max_Nm=41.339",
    )
    assert kpis.tau_mean == pytest.approx(tau, rel=0.02)


def chopped_pulses(*, brakes: bool = False) -> FixedLaw:
    return chopped(rl.load(PWM).known(), 1.0, brakes=brakes, hard=False)


def test_pulses_are_those_of_the_running_drive() -> None:
    """A fixed window and current, once by the set-up's run and once by `simulate`."""
    own = {"theta_on_deg": 20.0, "theta_off_deg": 145.0, "i_ref_A": 60.0, "i_band_A": 1.0}
    overrides = [f"control.{key}={value}" for key, value in own.items()]
    drive = rl.load(
        PWM, ["control.law=angles", "reference.kind=none", "reference.tau_Nm=", *overrides]
    )
    found = pulses(chopped_pulses(), np.radians(20), np.radians(145), 60.0)
    kpis = rl.simulate(drive, record=None).kpis
    assert float(found.tau) == pytest.approx(kpis.tau_mean, rel=1e-3)
    assert float(found.i_rms) == pytest.approx(kpis.i_rms, rel=2e-3)


def test_pulses_are_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    law, ends = chopped_pulses(), np.radians([20, 145])
    i = np.array([20.0, 60.0, 120.0])
    coarse = pulses(law, *ends, i)
    monkeypatch.setattr(pulses_module, "STEPS", 8 * pulses_module.STEPS)
    monkeypatch.setattr(pulses_module, "SETTLED", 6)
    fine = pulses(law, *ends, i)
    np.testing.assert_allclose(coarse.tau, fine.tau, rtol=1e-4)
    np.testing.assert_allclose(coarse.i_rms, fine.i_rms, rtol=1e-4)


def test_least_copper_angles_have_no_better_neighbour() -> None:
    on, off = least_copper_angles(rl.load(PWM).known(), 41.339)
    i, law = np.linspace(1, 150, 150), chopped_pulses()

    def copper(on: float, off: float) -> float:
        found = pulses(law, on, off, i)
        return float(np.interp(41.339, found.tau, found.i_rms, right=np.inf))

    best = copper(on, off)
    for d_on, d_off in ((10, 0), (-10, 0), (0, 10), (0, -10)):
        assert best < copper(on + np.radians(d_on), off + np.radians(d_off)) * 1.001


@pytest.mark.parametrize("brakes", [False, True])
def test_current_table_gives_its_torques(brakes: bool) -> None:
    ends = (2.8, 5.6) if brakes else (0.35, 2.5)
    law = chopped_pulses(brakes=brakes)
    table = Window(*ends, law).currents(41.339)
    assert table[0] == 0.0
    assert all(a < b for a, b in pairwise(table))
    np.testing.assert_allclose(
        pulses(law, *ends, table).tau, np.linspace(0, 41.339, len(table)), atol=0.003 * 41.339
    )


def test_own_angles_that_do_not_motor_are_refused() -> None:
    own = ["control.theta_on_deg=170", "control.theta_off_deg=300"]
    with pytest.raises(rl.ParameterError, match="give a mean torque of at most"):
        rl.load(PWM, own).controller()


@pytest.mark.parametrize("shape", ["linear", "cubic", "sinusoidal", "exponential", "table"])
@pytest.mark.parametrize("n_phases", [3, 4, 5, 6])
def test_shares_sum_to_one(shape: str, n_phases: int) -> None:
    free = np.pi - 2 * np.pi / n_phases
    table = [float(x) for x in np.linspace(0, 1, 33) ** 2]
    sharing = _core.Sharing(
        shape=getattr(_core.Shape, shape), theta_on=0.1 * free, theta_ov=0.8 * free, table=table
    )
    assert sharing.is_feasible(n_phases)
    for theta in np.linspace(0, 2 * np.pi, 200):
        shares = [
            sharing.share(n_phases, theta - 2 * np.pi * k / n_phases) for k in range(n_phases)
        ]
        assert sum(shares) == pytest.approx(1, abs=1e-12)
        # Only a phase before alignment can give torque.
        assert all(
            s == 0
            for s, k in zip(shares, range(n_phases), strict=True)
            if (theta - 2 * np.pi * k / n_phases) % (2 * np.pi) > np.pi + 1e-9
        )


def test_table_of_a_straight_line_is_the_linear_sharing() -> None:
    line = [float(x) for x in np.linspace(0, 1, 33)]
    a = run(SHARING, "control.sharing='linear'")
    b = run(SHARING, "control.sharing='table'", f"control.share_table={line}")
    assert a.tau_mean == pytest.approx(b.tau_mean, rel=1e-6)


def test_single_pulse_knows_no_current() -> None:
    """Without regulation every pulse is one turn-on of each switch."""
    result = rl.simulate(rl.load(PULSE), until=0.02)
    assert result.kpis.f_switch == pytest.approx(3000 / 60 * 4, rel=1e-6)
    assert not result.tau_ref.any()
    assert not result.i_ref.any()


def test_hysteresis_stays_in_its_band() -> None:
    result = rl.simulate(rl.load(DEMO), until=0.06)
    assert result.i.max() == pytest.approx(210, abs=1e-3)
    for k in range(3):
        theta = (4 * result.theta_m - 2 * np.pi * k / 3) % (2 * np.pi)
        inside = (theta > np.radians(40)) & (theta < np.radians(119.9)) & (result.t > 0.03)
        assert result.i[k][inside].min() > 190 - 1e-3


@pytest.mark.parametrize(
    ("path", "settings", "message"),
    [
        (SHARING, ["control.theta_on_deg=20.0"], "needs both theta_on_deg and theta_ov_deg"),
        (
            SHARING,
            ["control.theta_on_deg=20.0", "control.theta_ov_deg=50.0"],
            "together at most 60",
        ),
        (SHARING, ["control.theta_on_deg=-1.0", "control.theta_ov_deg=20.0"], "theta_on_deg >= 0"),
        (SHARING, ["control.theta_on_deg=0.0", "control.theta_ov_deg=0.0"], "theta_ov_deg > 0"),
        (SHARING, ["control.sharing='table'"], "share_table: need 33 shares"),
        (
            SHARING,
            ["control.sharing='table'", f"control.share_table={[0.0, *[1.02] * 31, 1.0]}"],
            "share_table: 0 to 1.02, need shares from 0 to 1 of the torque",
        ),
        (
            SHARING,
            ["control.sharing='table'", f"control.share_table={[0.0, *[-0.02] * 31, 1.0]}"],
            "share_table: -0.02 to 1, need shares from 0 to 1 of the torque",
        ),
        (SHARING, ["control.sharing='square'"], "sharing = 'square', need 'linear'"),
        (SHARING, ["control.share_table=[0.0, 1.0]"], "share_table has no effect"),
        (SHARING, ["control.i_band_A=0"], "i_band_A = 0, need > 0"),
        (
            SHARING,
            ["machine.N_s=4", "machine.N_r=2", "machine.n_phases=2"],
            "n_phases = 2 no angle has two",
        ),
        (
            PULSE,
            ["reference.kind='torque'", "reference.tau_Nm=1.0"],
            "takes .reference. kind = 'none'",
        ),
        (
            PULSE,
            ["control.law='torque_sharing'"],  # drops `regulate` and the angles
            "needs a torque or speed to follow",
        ),
        (PULSE, ["reference.tau_Nm=0.0"], "tau_Nm has no effect with kind = 'none'"),
        (PULSE, ["control.i_ref_A=10.0"], "i_ref_A has no effect with regulate = 'none'"),
        (PULSE, ["control.theta_off_deg=-10.0"], "need theta_off_deg above theta_on_deg"),
        (DEMO, ["control.i_band_A=500"], "i_band_A = 500, need less than"),
        (DEMO, ["control.i_ref_A=451"], "i_ref_A = 451, need <= "),
        (DITC, ["control.theta_on_deg=20.0", "control.theta_off_deg=130.0"], "need >= 120"),
        (DITC, ["control.tau_band_Nm=2.0", "control.tau_band_outer_Nm=1.0"], "need >= tau_band_Nm"),
        (PWM, ["control.bandwidth_Hz=10000"], "need <= 7957"),
        (PWM, ["control.theta_on=20"], "did you mean `theta_on_deg`"),
    ],
)
def test_wrong_table_is_refused_in_one_line(path: Path, settings: list[str], message: str) -> None:
    with pytest.raises(ParameterError, match=message) as fault:
        rl.load(path, settings)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("law", ["angles", "pwm_current", "torque_sharing", "ditc", "deadbeat"])
def test_law_without_anything_to_follow_is_refused(law: str) -> None:
    data = read_toml(SHARING)
    data |= {
        "machine": machine_table("paper_6_4", EXAMPLES),
        "reference": {"kind": "none"},
        "control": {"law": law, "T_s_us": 20},
    }
    with pytest.raises(ParameterError, match="needs a torque or speed to follow"):
        drive_from(data)


def test_torque_beyond_the_angles_is_refused() -> None:
    drive = rl.load(PWM, ["control.theta_on_deg=100.0", "control.theta_off_deg=120.0"])
    with pytest.raises(ParameterError, match="give a mean torque of at most"):
        rl.simulate(drive, until=0.01)


@pytest.mark.parametrize(
    ("values", "names"),
    [
        (["control.theta_on_deg=40", "control.theta_off_deg=70", "reference.tau_Nm=49"], True),
        (["control.theta_on_deg=40", "control.theta_off_deg=70", "reference.tau_Nm=2"], False),
        (["reference.tau_Nm=990"], True),
        (["reference.tau_Nm=2"], False),
    ],
)
def test_the_remedy_for_a_torque_out_of_reach_names_every_key_above_it(
    values: list[str], names: bool
) -> None:
    limit = "control.tau_max_Nm=" + ("50" if len(values) == 3 else "1000")
    with pytest.raises(rl.ParameterError) as fault:
        rl.load(PWM, [*values, limit]).controller()
    line = str(fault.value)
    assert ("[reference] torque, and tau_max_Nm" in line) == names and "tau_max_Nm" in line
    most = float(re.search(r"(?:at most|more than) ([\d.]+) N m", line)[1])  # type: ignore[index]
    lower = [f"control.tau_max_Nm={0.99 * most:.4g}"]
    lower += [f"reference.tau_Nm={0.99 * most:.4g}"] if names else []
    if len(values) == 3:
        rl.load(PWM, [*values, *lower]).controller()
    else:  # the machine can, and the law may still not
        rl.load(PWM, [*values, *lower])


@pytest.mark.parametrize(
    "machine", ["paper_6_4", "generic_60kw_6_4", "generic_1hp_8_6", "design_10_8"]
)
def test_optimised_shares_are_feasible_and_sum_to_one(machine: str) -> None:
    table = machine_table(machine, EXAMPLES)
    tau = 0.02 * table["i_max_A"] if machine == "generic_1hp_8_6" else 0.1 * table["i_max_A"]
    drive = rl.load(
        EXAMPLES / "sharing_cubic.toml",
        [
            f"machine={machine}",
            "control.sharing=optimal",
            f"reference.tau_Nm={tau}",
            "load.speed_rpm=200",
            "control.i_band_A=0.1",
        ],
    )
    sharing = drive.control.shares(drive.known())
    assert sharing.is_feasible(drive.machine.n_phases)
    n_phases = drive.machine.n_phases
    for theta in np.linspace(0, 2 * np.pi, 100):
        shares = [
            sharing.share(n_phases, theta - 2 * np.pi * k / n_phases) for k in range(n_phases)
        ]
        assert sum(shares) == pytest.approx(1, abs=1e-12)
        assert min(shares) >= -1e-12


def test_optimised_sharing_is_smoother_than_cubic_for_no_more_current() -> None:
    path = EXAMPLES / "sharing_cubic.toml"
    cubic, optimal = (
        rl.simulate(rl.load(path, overrides), until=0.06, record=None).kpis
        for overrides in ([], ["control.sharing=optimal"])
    )
    assert optimal.torque_error_rms < 0.8 * cubic.torque_error_rms
    assert optimal.i_rms < cubic.i_rms
    assert optimal.f_switch < 1.05 * cubic.f_switch
