"""Environments for learning: Gymnasium's own checks, the same drive by all ways, and prices that
are those of the key figures."""

import csv
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import reluctance as rl
import reluctance.targets.gym as rg
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.targets.gym.episodes import default_prices
from reluctance.targets.gym.spaces import observed

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
SENSORS = {"sensing.adc_bits": 12, "sensing.i_range_A": 200, "sensing.encoder_counts": 4096}
TASKS, ACTIONS = ("torque", "current", "speed"), ("legs", "duties", "currents")
each_kind = pytest.mark.parametrize(
    ("task", "action"), [(task, action) for task in TASKS for action in ACTIONS]
)


@each_kind
def test_gymnasium_finds_nothing_to_say(task, action):
    env = gymnasium.make(f"reluctance/{task.capitalize()}-v0", action=action).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


@each_kind
def test_observations_stay_within_their_space(task, action):
    env = rg.DriveEnv(task=task, action=action, randomise={"plant.R": (0.5, 2.0)}, length=200)
    env.action_space.seed(0)
    seen, _ = env.reset(seed=0)
    assert len(observed(env.episodes)) == len(seen)
    for _ in range(600):
        seen, reward, tripped, over, _ = env.step(env.action_space.sample())
        assert seen in env.observation_space and reward <= 0
        if tripped or over:
            seen, _ = env.reset()


@each_kind
def test_many_drives_are_as_many_single_ones(task, action):
    """Bit for bit, across the ends of episodes."""
    randomise = {"plant.R": (0.8, 1.4), "plant.machine.flux_factor": (0.9, 1.1)}
    given = {"task": task, "action": action, "randomise": randomise, "length": 40}
    name = f"reluctance/{task.capitalize()}-v0"
    many = gymnasium.make_vec(
        name,
        num_envs=3,
        vectorization_mode="vector_entry_point",
        action=action,
        randomise=randomise,
        length=40,
    )
    ones = [rg.DriveEnv(**given) for _ in range(3)]
    seen, _ = many.reset(seed=7)
    singles = [one.reset(seed=7 + k)[0] for k, one in enumerate(ones)]
    many.action_space.seed(1)
    ended = np.zeros(3, bool)
    for _ in range(100):
        assert seen.tobytes() == np.array(singles).tobytes()
        actions = many.action_space.sample()
        seen, rewards, tripped, over, info = many.step(actions)
        for k, one in enumerate(ones):
            if ended[k]:
                singles[k] = one.reset()[0]
                assert rewards[k] == 0 and not tripped[k] and not over[k]
                continue
            singles[k], reward, *ends, figures = one.step(actions[k])
            assert (reward, *ends) == (rewards[k], tripped[k], over[k])
            for key, value in figures.items():
                assert info[key][k] == value and info[f"_{key}"][k]
        ended = tripped | over


def test_seeds_repeat_an_episode_and_differ():
    env = rg.DriveEnv(action="duties", randomise=rg.TOLERANCES)

    def episode(seed):
        env.action_space.seed(0)
        seen = [env.reset(seed=seed)[0]]
        return np.array(seen + [env.step(env.action_space.sample())[0] for _ in range(50)])

    assert episode(3).tobytes() == episode(3).tobytes() != episode(4).tobytes()


@pytest.mark.parametrize("part", [1.0, 0.5])
def test_speed_and_voltage_are_seen_in_parts_of_those_of_the_drive(part):
    """At the speed of the drive file, which is held."""
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    env = rg.DriveEnv(drive, action="duties", randomise={"plant.source.u_dc.value_0": (part, part)})
    seen = dict(zip([each.name for each in observed(env.episodes)], env.reset()[0], strict=True))
    assert seen["omega_m"] == pytest.approx(1, rel=1e-6)
    assert seen["u_dc"] == pytest.approx(part, rel=1e-6)


def test_many_drives_may_be_one():
    assert rg.DriveVectorEnv(1).num_envs == 1
    with pytest.raises(ParameterError, match="num_envs = 0, need >= 1"):
        rg.DriveVectorEnv(0)


def test_seeds_repeat_the_episodes_of_many_drives_and_without_one_others_follow():
    env = gymnasium.make_vec(
        "reluctance/Torque-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        randomise={"plant.R": (0.2, 5.0)},
    )

    def begun(seed):
        env.reset(seed=seed)
        actions = np.ones_like(env.action_space.sample())
        return np.array([env.step(actions)[0] for _ in range(5)]).tobytes()

    first, after = begun(3), begun(None)
    assert begun(3) == first == begun([3, 4]) != after
    assert begun(None) == after


def play(env, choose, steps):
    """Currents of a run: (steps, n_phases), and rewards."""
    seen, _ = env.reset(seed=5)
    rows, rewards = [], []
    for n in range(steps):
        seen, reward, *_ = env.step(choose(seen, n))
        rows.append(env.batch.sample(0)[:3])
        rewards.append(reward)
    return np.array(rows), np.array(rewards)


@pytest.mark.parametrize("task", ["torque", "speed"])
@pytest.mark.parametrize("law", ["random", "hysteresis"])
def test_long_steps_give_what_short_ones_give(task, law):
    """Steps of 20 us, one a sample where the currents allow it, against steps of 0.25 us."""
    rng = np.random.default_rng(2)
    legs = rng.integers(0, 3, (1500, 3))

    def choose(seen, n):
        if law == "random":
            return legs[n]
        theta = np.arctan2(seen[4], seen[3]) - 2 * np.pi * np.arange(3) / 3
        return np.where(theta % (2 * np.pi) < 2.4, np.where(seen[:3] < 0.2, 2, 1), 0)

    example = EXAMPLES / ("sharing_cubic.toml" if task == "torque" else "fan.toml")
    drive = rl.load(example)
    held = rg.DriveEnv(drive, task=task, action="legs", length=2000)
    short = {"simulation.dt_max_us": 0.25}
    loop = rg.DriveEnv(drive.with_values(short), task=task, action="legs", length=2000)
    currents, rewards = play(held, choose, 1500)
    expected, prices = play(loop, choose, 1500)
    assert np.abs(currents - expected).max() < 2e-6 * drive.machine.i_max_A
    assert rewards == pytest.approx(prices, rel=1e-4, abs=2e-5)
    for one, other in zip(held.batch.figures(0), loop.batch.figures(0), strict=True):
        assert one == pytest.approx(other, rel=1e-5)


def test_the_price_is_that_of_the_key_figures():
    """A law played in the environment, and the run of its drive, from the same angle."""
    drive = rl.load(EXAMPLES / "sharing_cubic.toml").with_values(SENSORS)
    env = rg.DriveEnv(drive, reference=(1.0, 1.0), length=1000)
    env.reset(seed=11)
    theta = np.random.default_rng(11).random() * 2 * np.pi / drive.machine.N_r
    law = rg.LawPolicy(drive)
    total = 0.0
    for _ in range(1000):
        _, reward, _, _, info = env.obey(law.orders(env))
        total += reward
    start = {"simulation.theta_start_deg": np.degrees(theta)}
    run = rl.simulate(drive.with_values(start), until=0.02, record=None)
    last = {
        name: column[-1]
        for name, column in zip(run.periods.names, run.periods.values.T, strict=True)
    }
    squared = sum(last[f"i_squared_{k}"] for k in range(3))
    f_switch = last["turn_ons"] / 6 / 0.02
    tau = drive.tau_max
    assert info["tau_mean"] == pytest.approx(last["tau"] / 0.02, rel=1e-9)
    assert info["f_switch"] == pytest.approx(f_switch, rel=1e-12)
    assert info["p_cu"] == pytest.approx(drive.machine.R * squared / 0.02, rel=1e-9)
    assert info["p_mech"] == pytest.approx(last["E_mech"] / 0.02, rel=1e-9)
    error = last["error_squared"] / 0.02 / tau**2
    assert info["torque_error_rms"] == pytest.approx(np.sqrt(error), rel=1e-9)
    prices = rg.Prices()
    expected = (
        prices.error * error
        + prices.copper * info["p_cu"] / (tau * drive.omega_nominal)
        + prices.switching * f_switch / 20e3
    )
    assert -total / 1000 == pytest.approx(expected, rel=1e-9)


def test_more_flux_gives_more_torque_at_the_same_current():
    def mean(factor):
        name = "plant.machine.flux_factor"
        env = rg.DriveEnv(action="currents", randomise={name: (factor, factor)}, length=500)
        seen, _ = env.reset(seed=0)
        for _ in range(500):
            theta = np.arctan2(seen[4], seen[3]) - 2 * np.pi * np.arange(3) / 3
            seen, *_, info = env.step(np.where(theta % (2 * np.pi) < 2.4, 0.15, 0.0))
        return info["tau_mean"]

    assert mean(1.1) == pytest.approx(1.1 * mean(1.0), rel=0.05)


def test_an_over_current_ends_the_episode_at_its_price():
    env = rg.DriveEnv(action="legs", prices=rg.Prices(trip=50.0))
    env.reset(seed=0)
    for _ in range(1000):
        _, reward, tripped, over, _ = env.step(np.array([2, 2, 2]))
        if tripped:
            break
    assert tripped and not over and reward < -50


@pytest.mark.parametrize(("part", "trips"), [(1.98, False), (2.02, True)])
def test_twice_the_nominal_speed_ends_an_episode(part, trips):
    """At which this shaft is held."""
    env = rg.DriveEnv(action="legs", randomise={"plant.shaft.omega.value_0": (part, part)})
    env.reset(seed=0)
    _, _, tripped, _, _ = env.step(np.array([0, 0, 0]))
    assert tripped == trips


def test_a_map_machine_with_a_battery_and_a_shared_switch_is_an_environment():
    drive = rl.load(EXAMPLES / "map_mpc.toml").with_values(
        {"source.kind": "battery", "source.R_ohm": 0.1, "source.C_uF": 1000}
    )
    for action in ACTIONS:
        env = rg.DriveEnv(drive, action=action, randomise={"plant.source.E.value_0": (0.9, 1.1)})
        env.action_space.seed(0)
        env.reset(seed=0)
        for _ in range(200):
            seen, *_ = env.step(env.action_space.sample())
        assert seen in env.observation_space and seen[:3].max() > 0


def _standing():
    return rl.load(EXAMPLES / "sharing_cubic.toml").with_values({"load.speed_rpm": 0.0})


def test_wrong_arguments_are_told():
    for given, told in (
        ({"task": "torqe"}, "did you mean"),
        ({"action": "orders"}, "need one of"),
        ({"task": "speed", "drive": str(EXAMPLES / "sharing_cubic.toml")}, "holds the speed"),
        ({"randomise": {"plant.r": (1, 2)}}, "plant.R"),
        ({"randomise": {"plant.R": (2, 1)}}, "low <= high"),
        ({"randomise": {"plant.R": (-1, 1)}}, "> 0"),
        ({"randomise": {"plant.R": 1.2}}, r"= 1.2, need \(low, high\)"),
        ({"randomise": {"plant.R": ("1", "2")}}, r"need \(low, high\)"),
        ({"reference": (1.0, 0.5)}, "low <= high"),
        ({"length": 0}, ">= 1"),
        ({"drive": _standing()}, "a working speed; set speed_rpm"),
    ):
        with pytest.raises(ParameterError, match=told):
            rg.DriveEnv(**given)
    with pytest.raises(ParameterError, match="num_envs"):
        rg.DriveVectorEnv(0)
    with pytest.raises(ParameterError, match="seeds"):
        rg.DriveVectorEnv(2).reset(seed=[1])
    env = rg.DriveEnv(action="legs")
    rows = np.zeros((1, 2)), np.zeros(1, bool), np.zeros((1, 11), np.float32), np.zeros(1)
    with pytest.raises(ValueError, match="each phase"):
        env.batch.step(*rows, np.zeros(1, bool))


def test_the_package_alone_needs_no_gymnasium():
    code = "import sys; sys.modules['gymnasium'] = None; import reluctance.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "pip install 'reluctance[gym]'" in done.stderr.splitlines()[-1]


# ---- the page

FOLDER = ROOT / "docs" / "gymnasium"


def table(path):
    with path.open(newline="") as file:
        return list(csv.reader(file))


def test_the_policies_of_the_page_play_as_it_says():
    """A law and the learned policy; the others are of the same command."""
    sys.path.insert(0, str(ROOT / "studies"))
    import gym_policy as study

    rows = {row[0]: row for row in table(FOLDER / "policies.csv")}
    env = study.environment()
    law = rg.LawPolicy(study.law_drive("torque_sharing, cubic"))
    for name, played in (
        ("torque_sharing, cubic", rg.played(env, law, study.JUDGED)),
        ("learned, Fourier series of the angle", study.learned(env, study.saved(), study.JUDGED)),
    ):
        found, expected = study.row(name, played)[1:], rows[name][1:]
        assert [float(v) for v in found] == pytest.approx([float(v) for v in expected], rel=0.01)


def test_numbers_of_a_drive_are_those_of_the_field_lists():
    env = rg.DriveEnv()
    names = dict(env.batch.numbers())
    assert {"plant.R", "plant.machine.model.L_u", "plant.shaft.J", "theta_m"} <= names.keys()
    assert names["plant.R"] == env.episodes.drive.machine.R
    assert set(rg.TOLERANCES) <= names.keys()
    assert _core.Task.torque != _core.Task.speed


@pytest.mark.parametrize(
    ("task", "names", "ones"),
    [
        ("torque", ["tau_ref"], [("N.m", "tau_max")]),
        ("speed", ["omega_ref"], [("rad/s", "omega_nominal")]),
        ("current", ["i_ref_0", "i_ref_1", "i_ref_2"], [("A", "i_max")] * 3),
    ],
)
def test_each_number_of_an_observation_is_a_part_of_what_the_page_says(task, names, ones):
    env = rg.DriveEnv(task=task, action="duties")
    drive = env.episodes.drive
    of = {
        "tau_max": drive.tau_max,
        "omega_nominal": drive.omega_nominal,
        "i_max": drive.machine.i_max_A,
    }
    found = observed(env.episodes)
    n = drive.machine.n_phases
    assert [o.name for o in found] == [
        *(f"i_{k}" for k in range(n)), "cos_theta_e", "sin_theta_e", "omega_m", "u_dc",
        *(f"last_{k}" for k in range(n)), *names,
    ]  # fmt: skip
    by_name = {o.name: (o.one, o.unit, o.least, o.most) for o in found}
    assert by_name["i_1"] == (of["i_max"], "A", -2, 2)
    assert by_name["cos_theta_e"] == by_name["sin_theta_e"] == (1, "", -1, 1)
    assert by_name["omega_m"] == (of["omega_nominal"], "rad/s", -2, 2)
    assert by_name["u_dc"] == (drive.converter.u_dc_V, "V", -2, 2)
    assert by_name["last_0"] == (1, "", -1, 1)
    for name, (unit, one) in zip(names, ones, strict=True):
        assert by_name[name] == (of[one], unit, -2, 2)


def test_prices_and_lengths_are_those_of_the_page():
    """1, 0.02 and 0.001, 100 for the error of a speed, 100 for a trip."""
    assert rg.Prices() == rg.Prices(error=1, copper=0.02, switching=0.001, trip=100)
    assert default_prices("torque") == default_prices("current") == rg.Prices()
    assert default_prices("speed") == rg.Prices(error=100)
    for task, length in (("torque", 1000), ("current", 1000), ("speed", 5000)):
        assert rg.DriveEnv(task=task, action="currents").episodes.length == length


def test_an_episode_begins_within_a_period_of_the_rotor_and_of_what_is_asked():
    for task, one in (("torque", "tau_max"), ("current", None), ("speed", "omega_nominal")):
        episodes = rg.DriveEnv(task=task, action="legs").episodes
        drive = episodes.drive
        unit = drive.machine.i_max_A if one is None else getattr(drive, one)
        assert episodes.drawn["theta_m"] == pytest.approx((0, 2 * np.pi / drive.machine.N_r))
        low, high = episodes.drawn["reference"]
        assert 0 < low < high <= unit * (1 + 1e-12)
        turns = "plant.shaft.omega.value_0" in episodes.drawn
        assert turns == (drive.load.kind != "locked")
        drawn = np.array([episodes.draw(np.random.default_rng(n)) for n in range(200)])
        for column, ends in zip(drawn.T, episodes.drawn.values(), strict=True):
            assert ends[0] <= column.min() and column.max() <= ends[1]
            assert np.ptp(column) > 0.9 * (ends[1] - ends[0])
    fixed = rg.DriveEnv(task="torque", action="legs", reference=(0.5, 0.5), length=7).episodes
    assert fixed.drawn["reference"] == pytest.approx((0.5 * drive_tau(fixed),) * 2)
    assert fixed.length == 7


def drive_tau(episodes):
    return episodes.drive.tau_max


def test_factors_are_on_the_numbers_of_the_drive_and_what_cannot_be_is_refused():
    episodes = rg.DriveEnv(task="torque", action="legs", randomise={"plant.R": (0.8, 1.4)}).episodes
    R = episodes.drive.machine.R
    assert episodes.drawn["plant.R"] == pytest.approx((0.8 * R, 1.4 * R))
    for wrong in ((0.0, 1.0), (1.2, 0.8), (0.5,), (-1.0, 1.0), (1.0, 2000.0)):
        with pytest.raises(ParameterError, match="randomise"):
            rg.DriveEnv(task="torque", action="legs", randomise={"plant.R": wrong})
    for wrong in ((1.0, 0.5), (-3.0, 1.0), (0.1, 1001.0)):
        with pytest.raises(ParameterError, match=r"reference = .*need"):
            rg.DriveEnv(task="torque", action="legs", reference=wrong)
    with pytest.raises(ParameterError, match="length = 0, need >= 1"):
        rg.DriveEnv(task="torque", action="legs", length=0)


@pytest.mark.parametrize(
    ("action", "good", "bad"),
    [
        ("legs", [0, 1, 2], [[-1, 0, 0], [0, 3, 0]]),
        ("duties", [-1.0, 0.5, 1.0], [[-1.01, 0, 0], [0, 0, 1.01]]),
        ("currents", [0.0, 0.5, 1.0], [[-0.01, 0, 0], [0, 0, 1.01]]),
    ],
)
def test_an_action_beyond_its_space_is_refused_and_its_ends_pass(action, good, bad):
    env = rg.DriveEnv(task="torque", action=action)
    env.reset(seed=1)
    env.step(np.array(good))
    for wrong in (*bad, [np.nan, 0, 0]):
        with pytest.raises(ParameterError, match="need numbers from"):
            env.step(np.array(wrong))
    with pytest.raises(ParameterError, match="need"):
        env.step(np.array(good[:2]))
