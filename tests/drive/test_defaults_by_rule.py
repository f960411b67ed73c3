"""Defaults that follow from the drive: the page's words, written out, give the same controller."""

from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.targets.studio.controls import parameters

EXAMPLES = Path(__file__).parents[2] / "examples"
LAW = {  # 150 A, 240 V, 41.339 N m at 1500 rpm, 20 us
    name: ["paper_rated", f"control.law={name}"]
    for name in ("angles", "pwm_current", "ditc", "torque_sharing", "deadbeat", "edge_mpc",
                 "finite_set_mpc", "paper_mpc")
}  # fmt: skip
SUN = ["sun_cloud"]


def numbers(name: str, *given: str) -> dict[str, object]:
    drive = rl.load(EXAMPLES / f"{name}.toml", list(given))
    return parameters(drive, of_control=True)


WRITTEN_OUT = [  # docs/drive_file.md
    (LAW["angles"], ["control.i_band_A=3"]),  # 2 % of i_max_A
    (LAW["angles"], ["control.start_speed_rpm=150"]),  # 10 % of the design speed
    (LAW["angles"], ["control.tau_max_Nm=41.339"]),  # greatest torque of the reference
    (LAW["pwm_current"], [f"control.bandwidth_Hz={0.3 / (2 * np.pi * 20e-6)!r}"]),  # 0.048/T_s
    (LAW["ditc"], ["control.tau_band_Nm=0.41339"]),  # 1 %
    (LAW["ditc"], ["control.tau_band_Nm=0.41339", "control.tau_band_outer_Nm=0.82678"]),  # twice
    (LAW["torque_sharing"], ["control.i_band_A=3"]),
    (LAW["paper_mpc"], ["control.i_band_A=1.5"]),  # 1 % of i_max_A
    (LAW["paper_mpc"], ["control.N_p=3", "control.N_c=2", "control.r_w=0.05", "control.w_i=0.05"]),
    (LAW["edge_mpc"], ["control.guide_speed_rpm=[1500]", "control.f_switch_kHz=16"]),
    (LAW["edge_mpc"], ["control.ripple_weight=100", "control.guide=least_copper"]),
    (LAW["finite_set_mpc"], ["control.horizon=1", "control.w_i=0", "control.guided=true"]),
    (["paper_pump"], ["control.torque_limit_Nm=1e30"]),  # none
    (SUN, ["pv_control.u_ref_min_V={0.6 * u}", "pv_control.u_ref_max_V={1.3 * u}"]),
    (SUN, ["pv_control.step_V={u / 120}"]),
    (SUN, ["pv_control.u_full_V={0.55 * u}", "pv_control.u_stop_V={0.45 * u}"]),
    (SUN, ["pv_control.u_wake_V={0.7 * u}", "pv_control.wake_s=1", "pv_control.sleep_s=60"]),
    (SUN, ["pv_control.dry_speed_rpm={0.7 * rpm}", "pv_control.dry_s=5", "pv_control.rest_s=600"]),
    (SUN, ["pv_control.acceleration_rpmps=1000", "pv_control.notch_damping=0.02"]),
    (SUN, ["pv_control.interval_ms=50", "control.speed_bandwidth_Hz=20"]),
]


@pytest.mark.parametrize(
    ("drive", "given"), WRITTEN_OUT, ids=[f"{d[-1]} {g[0].split('=')[0]}" for d, g in WRITTEN_OUT]
)
def test_a_default_written_out_gives_the_same_controller(
    drive: list[str], given: list[str]
) -> None:
    name, *rest = drive
    gone = [f"{text.split('=')[0]}=" for text in given if not text.startswith("control.speed_b")]
    of = rl.load(EXAMPLES / f"{name}.toml", rest)
    names = {"u": of.converter.u_dc_V, "rpm": of.omega_nominal * 30 / np.pi}
    out = [text if "{" not in text else _filled(text, names) for text in given]
    kept = [key for key in gone if _there(of, key[:-1])]
    default, written = numbers(name, *rest, *kept), numbers(name, *rest, *out)
    assert default.keys() == written.keys()
    for key, value in default.items():
        assert written[key] == pytest.approx(value, rel=1e-3, abs=1e-300), key


def _there(drive: rl.Drive, key: str) -> bool:
    """Whether the drive gives a key."""
    table, _, name = key.partition(".")
    return name in drive.sections()[table].model_fields_set


def _filled(text: str, names: dict[str, float]) -> str:
    key, _, formula = text.partition("=")
    factor, _, of = formula.strip("{}").partition(" * ")
    if of:
        return f"{key}={float(factor) * names[of]!r}"
    of, _, part = formula.strip("{}").partition(" / ")
    return f"{key}={names[of] / float(part)!r}"


TOLD = {  # for LAW, and for the same with a speed reference and no i_band_A
    "angles": "theta_on_deg theta_off_deg start_speed_rpm",
    "pwm_current": "theta_on_deg theta_off_deg start_speed_rpm bandwidth_Hz",
    "ditc": "theta_on_deg theta_off_deg start_speed_rpm tau_band_Nm tau_band_outer_Nm",
    "torque_sharing": "theta_on_deg theta_ov_deg",
    "deadbeat": "theta_on_deg theta_ov_deg",
    "edge_mpc": "",
    "finite_set_mpc": "",
    "paper_mpc": "",
}
SPEED = [  # paper_rated has a torque reference, a speed that is held, and the band of paper_mpc
    *("reference.kind=speed", "reference.speed_rpm=1500", "reference.tau_Nm=", "load.kind=fan"),
    *("load.k_fan_Nms2=1e-3", "control.tau_max_Nm=40", "control.i_band_A="),
]


@pytest.mark.parametrize("speed", [False, True])
@pytest.mark.parametrize("law", LAW)
def test_what_rules_chose_gives_the_same_controller_when_it_is_written_out(
    law: str, speed: bool
) -> None:
    """But for what acts on angles by rule alone: `ditc` moves them with the torque, and shares are
    left where the voltage does not suffice for them."""
    name, *rest = LAW[law]
    rest += SPEED if speed else ()
    drive = rl.load(EXAMPLES / f"{name}.toml", rest)
    rule = drive.by_rule
    more = ["K_p_Nms"] if speed else ["tau_max_Nm"]
    if speed and "theta_off_deg" in TOLD[law]:
        more += ["brake_on_deg", "brake_off_deg"]
    more += ["i_band_A"] if speed and law in ("angles", "torque_sharing", "paper_mpc") else []
    assert set(rule) == {*TOLD[law].split(), *more}
    found = numbers(name, *rest)
    written = numbers(name, *rest, *(f"control.{key}={value!r}" for key, value in rule.items()))
    assert set(written) == set(found)
    of_rule = ("control.law.turn_on.tau_max", "control.law.feasible.motoring")
    for key in (key for key in found if not key.startswith(of_rule)):
        assert written[key] == pytest.approx(found[key], rel=1e-9), key
    assert drive.with_values({f"control.{key}": x for key, x in rule.items()}).by_rule == {}


def test_keys_that_have_no_effect_are_not_told_as_chosen_by_rule() -> None:
    whole = rl.load(EXAMPLES / "single_pulse.toml", ["control.start_speed_rpm="]).by_rule
    assert whole == {"start_speed_rpm": pytest.approx(300.0)}
    table = set(rl.load(EXAMPLES / "angle_table.toml").by_rule)
    assert table == {"K_p_Nms", "brake_on_deg", "brake_off_deg", "start_speed_rpm"}
    optimal = rl.load(EXAMPLES / "sharing_cubic.toml", ["control.sharing=optimal"]).by_rule
    assert set(optimal) == {"tau_max_Nm"}


def test_gains_of_the_voltage_controller_are_per_unit_of_the_drive() -> None:
    """4.36 and 218/s of tau_max/u_dc; 0.706 and 28.2/s of the greatest speed over u_dc."""
    for keys, unit, one in (
        (("K_p_NmpV", "K_i_NmpVs"), (4.36, 218.0), "tau"),
        (("K_p_rpmpV", "K_i_rpmpVs"), (0.706, 28.2), "speed"),
    ):
        actuator = f"pv_control.actuator={'torque' if one == 'tau' else 'speed'}"
        drive = rl.load(EXAMPLES / "sun_cloud.toml", [actuator])
        size = drive.tau_max if one == "tau" else drive.omega_nominal * 30 / np.pi
        values = [u * size / drive.converter.u_dc_V for u in unit]
        given = [f"pv_control.{k}={v!r}" for k, v in zip(keys, values, strict=True)]
        default, written = numbers("sun_cloud", actuator), numbers("sun_cloud", actuator, *given)
        changed = {key for key in default if default[key] != written[key]}
        for key in default:
            assert written[key] == pytest.approx(default[key], rel=2e-3), key  # as it is printed
        assert len(changed) <= 2


def test_the_gain_waits_for_the_time_in_which_a_counted_angle_shows_a_torque() -> None:
    """An ideal angle shows it at once, whatever bandwidth its observer is given; counts as the
    observer is told, or in the time of a step."""
    bandwidth = 2 * np.pi * 40

    def lags(*given: str) -> float:
        drive = rl.load(EXAMPLES / "paper_pump.toml", given)
        return drive.J / (2 * drive.control.gains(drive.known())[0])

    counts, told = "sensing.encoder_counts=1024", "sensing.tracker_bandwidth_Hz=40"
    ideal = lags()
    assert lags(told) == ideal
    drive = rl.load(EXAMPLES / "paper_pump.toml")
    step = np.sqrt(2 * (2 * np.pi / 1024) * drive.J / drive.tau_max)
    assert lags(counts) == pytest.approx(ideal + step, rel=1e-9)
    assert lags(counts, told) == pytest.approx(ideal + 1 / bandwidth, rel=1e-9)


def test_a_given_bandwidth_sets_both_gains_of_a_speed_loop() -> None:
    """K_p is the bandwidth times the inertia, K_i half the bandwidth times K_p."""
    drive = rl.load(EXAMPLES / "paper_pump.toml", ["control.speed_bandwidth_Hz=5"])
    w = 2 * np.pi * 5
    K_p, K_i = drive.control.gains(drive.known())
    assert K_p == pytest.approx(w * drive.J) and K_i == pytest.approx(K_p * w / 2)
    given = drive.with_values({"control.K_p_Nms": 3.0})
    assert given.control.gains(given.known()) == (3.0, pytest.approx(1.5 * w))
    both = given.with_values({"control.K_i_Nm": 7.0})
    assert both.control.gains(both.known()) == (3.0, 7.0)
    plain = rl.load(EXAMPLES / "paper_rated.toml")
    assert plain.control.gains(plain.known()) == (0.0, None)
    slow = drive.with_values({"control.speed_rate_rpmps": 300.0})
    assert slow.control.speed_rate == pytest.approx(10 * np.pi)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["control.theta_on_deg=10"], "needs both theta_on_deg and theta_off_deg"),
        (["control.brake_on_deg=190"], "needs both brake_on_deg and brake_off_deg"),
        (["control.theta_on_deg=10", "control.theta_off_deg=10"], "above theta_on_deg by less"),
        (["control.brake_on_deg=179", "control.brake_off_deg=540"], "above brake_on_deg by less"),
        (["control.regulate=none", "control.i_band_A=1", "control.theta_on_deg=0",
          "control.theta_off_deg=150", "reference.kind=none", "reference.tau_Nm="],
         "i_band_A has no effect with regulate"),
        (["control.angle_table=a.csv", "control.theta_on_deg=1", "control.theta_off_deg=20"],
         "angle_table has the angles"),
        (["control.i_band_A=150"], "i_band_A = 150, need less than"),
        (["control.law=ditc", "control.tau_band_outer_Nm=1"], "need >= tau_band_Nm"),
        (["control.law=ditc", "control.tau_band_Nm=2", "control.tau_band_outer_Nm=1.9"],
         "tau_band_outer_Nm = 1.9, need >= tau_band_Nm"),
        (["control.law=ditc", "control.tau_band_Nm=41.4"], "need less than the greatest torque"),
        (["control.law=ditc", "control.theta_on_deg=0", "control.theta_off_deg=119"],
         "need >= 120 with 3 phases"),
        (["control.law=pwm_current", "control.bandwidth_Hz=7960"], "need <= 7957.7"),
    ],
)  # fmt: skip
def test_numbers_of_a_law_that_contradict_each_other_are_refused(
    given: list[str], told: str
) -> None:
    with pytest.raises(rl.ParameterError, match=told):
        rl.load(EXAMPLES / "paper_rated.toml", ["control.law=angles", *given])


def test_voltages_of_an_array_rise() -> None:
    for key, value in (("u_stop_V", 150.0), ("u_full_V", 200.0), ("u_ref_min_V", 300.0)):
        with pytest.raises(rl.ParameterError, match="need rising voltages"):
            rl.load(EXAMPLES / "sun_cloud.toml", [f"pv_control.{key}={value}"])


LIMITS = [  # docs/drive_file.md: what is still taken, and what is not
    ("paper_mpc", "N_p", [1, 10], [0, 11], {"N_c": 1}),
    ("paper_mpc", "N_c", [1, 4], [0, 5], {"N_p": 10}),
    ("paper_mpc", "N_c", [3], [4], {"N_p": 3}),
    ("paper_mpc", "r_w", [1e-9], [0], {}),
    ("paper_mpc", "w_i", [0], [-1e-9], {}),
    ("finite_set_mpc", "horizon", [1, 4], [0, 5], {}),
    ("finite_set_mpc", "w_i", [0], [-1e-9], {}),
    ("edge_mpc", "f_switch_kHz", [1e-3, 1e4], [0, 10001], {}),
    ("edge_mpc", "ripple_weight", [1e-3], [0], {}),
    ("edge_mpc", "guide_speed_rpm", [0, 1500], [-1], {}),
    ("ditc", "tau_band_Nm", [1e-3], [0], {}),
    ("ditc", "tau_band_outer_Nm", [1], [0], {"tau_band_Nm": 1e-3}),
    ("torque_sharing", "i_band_A", [1e-3, 149], [0, 150], {}),
    ("paper_mpc", "i_band_A", [1e-3, 149], [0, 150], {}),
    ("angles", "i_band_A", [1e-3, 149], [0, 150], {}),
]


@pytest.mark.parametrize(("law", "key", "taken", "refused", "beside"), LIMITS)
def test_numbers_of_a_law_are_taken_up_to_their_limits(
    law: str, key: str, taken: list[float], refused: list[float], beside: dict[str, float]
) -> None:
    def load(value: float) -> rl.Drive:
        given = [f"control.{name}={number}" for name, number in (beside | {key: value}).items()]
        return rl.load(EXAMPLES / "paper_rated.toml", [f"control.law={law}", *given])

    for value in taken:
        assert getattr(load(value).control, key) in (value, [value])
    for value in refused:
        with pytest.raises(rl.ParameterError, match=key):
            load(value)
