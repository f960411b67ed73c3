"""Searches and maps whose runs are given: what is asked for, and what becomes of the answers."""

import sys
from pathlib import Path
from types import SimpleNamespace as Namespace

import numpy as np
import pytest

import reluctance as rl
from reluctance.base.errors import Note
from reluctance.explore.comparison import comparison
from reluctance.explore.efficiency_map import map as maps
from reluctance.explore.sweeps.sweep import Sweep
from reluctance.explore.tuning import angles, compass, optuna_search, search
from reluctance.explore.tuning.goal import bound
from reluctance.explore.tuning.match import Lever, Target, match

EXAMPLES = Path(__file__).parents[2] / "examples"
ON, OFF = "control.theta_on_deg", "control.theta_off_deg"


# Conduction angles over speed and torque.


def test_each_node_begins_with_the_rule_and_its_neighbours_and_holds_its_torque(monkeypatch):
    """Left of it and below it; within the ranges. What is left over counts for the table."""
    drive = rl.load(EXAMPLES / "paper_rated.toml", ["control.law=angles"])
    made, starts, told = [], [], []

    class Trials:
        def __init__(self, here, goal, **given):
            self.here, self.goal, self.given = here, goal, given
            self.tried, self.ran = [None] * 5, 3
            made.append(self)

    monkeypatch.setattr(angles, "Trials", Trials)
    monkeypatch.setattr(angles, "search", lambda trials, from_: starts.append(from_))
    monkeypatch.setattr(angles, "_by_rule", lambda here: (-999.0, 90.0))
    node = iter(range(6))

    def found(here, speed, torque, trials, rule):
        n = next(node)
        return angles.Node(speed, torque, 10.0 * n, 100.0 + n, {}, "")

    monkeypatch.setattr(angles, "_node", found)
    vary = {ON: [-50.0, 60.0]}
    grid = {"speed_rpm": [600, 1200, 1800], "torque_Nm": [10, 20]}
    table = angles.tune_angles(
        drive, grid, maximise="efficiency", keep=["i_rms_A<50"], vary=vary, budget=7, jobs=2,
        progress=told.append,
    )  # fmt: skip
    assert (table.tried, table.ran, table.name) == (30, 18, drive.name)
    at = [(n.speed_rpm, n.torque_Nm) for n in table.nodes]
    assert at == [(w, x) for w in (600, 1200, 1800) for x in (10, 20)]
    assert told == pytest.approx(np.arange(1, 7) / 6)
    begun = [[(s[ON], s[OFF]) for s in of] for of in starts]
    rule = (-50.0, 90.0)  # cut to the range
    before = [(10.0 * n, 100.0 + n) for n in range(6)]
    assert begun == [
        [rule], [rule, before[0]],
        [rule, before[0]], [rule, before[2], before[1]],
        [rule, before[2]], [rule, before[4], before[3]],
    ]  # fmt: skip
    for trials, (speed, torque) in zip(made, at, strict=True):
        assert [str(b) for b in trials.goal.bounds] == [
            f"tau_mean_Nm > {0.98 * torque:g}", "i_rms_A < 50",
        ]  # fmt: skip
        assert (trials.goal.figure, trials.goal.most) == ("efficiency", True)
        assert trials.given["vary"][ON] == [-50, 60] and trials.given["budget"] == 7
        assert trials.given["jobs"] == 2
        assert trials.here.omega_nominal == pytest.approx(speed * np.pi / 30)
        assert trials.here.reference.course[1] == [torque] and trials.here.tau_max == torque
        period = 2 * np.pi / (4 * speed * np.pi / 30)
        assert trials.given["until"] == pytest.approx(max(6 * period, 0.02))


# Maps of efficiency.


def swept_of(columns, answer):
    """Figures by the torque of a point, or why it has none."""
    count = len(columns["reference.tau_Nm"])
    found = [answer({k: v[n] for k, v in columns.items()}) for n in range(count)]
    names = ("tau_mean_Nm", *maps.FIGURES, *maps.LOSSES)
    figures = {n: np.array([f.get(n, np.nan) for f in found], float) for n in names}
    return Namespace(figures=figures, why=[f.get("why", "") for f in found], count=count)


def test_a_point_whose_tables_do_not_reach_is_run_again_with_its_own_torque(monkeypatch):
    """Tables for the greatest torque of the drive are tried first; what fails has tables for the
    torque of its point, and nothing else is run twice."""
    drive, asked = rl.load(EXAMPLES / "sharing_cubic.toml"), []
    fits = 1.5 * drive.tau_max

    def swept(base, columns, shape, **_):
        asked.append((columns, shape))

        def answer(point):
            if point["control.tau_max_Nm"] > fits and len(asked) == 1:
                return {"why": "out of reach"}
            tau = point["reference.tau_Nm"]
            return {"tau_mean_Nm": tau} | dict.fromkeys((*maps.FIGURES, *maps.LOSSES), 0.1 * tau)

        given = swept_of(columns, answer)
        return Made(given)

    class Made:
        def __init__(self, given):
            self.figures, self.why, self.ran = given.figures, given.why, given.count

        failed = property(lambda self: sum(map(bool, self.why)))

        def reason(self):
            return "none"

    def replaced(found, *, why, ran):
        found.why, found.ran = why, ran
        return found

    monkeypatch.setattr(maps, "swept", swept)
    monkeypatch.setattr(maps, "replace", replaced)
    monkeypatch.setattr(maps, "_over_achieved", lambda *given: given)
    torques = [drive.tau_max / 2, 2 * drive.tau_max]
    _, _, _, _, figures, ran = maps.efficiency(drive, omega=[50.0, 100.0], tau=torques)
    (first, shape), (again, none) = asked
    assert shape == (2, 2, 1) and none == () and ran == 6
    assert first["control.tau_max_Nm"] == [drive.tau_max, 2 * drive.tau_max] * 2
    assert again["reference.tau_Nm"] == again["control.tau_max_Nm"] == [2 * drive.tau_max] * 2
    assert again["load.speed_rpm"] == pytest.approx([50 * 30 / np.pi, 100 * 30 / np.pi])
    assert figures["tau_mean_Nm"].tolist() == [torques] * 2


def test_a_map_is_of_speeds_above_none_and_of_a_drive_that_runs(monkeypatch):
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    nothing = {n: np.full(4, np.nan) for n in ("tau_mean_Nm", *maps.FIGURES, *maps.LOSSES)}
    failed = Namespace(figures=nothing, failed=0, ran=4, reason=lambda: "too weak")
    monkeypatch.setattr(maps, "swept", lambda *_, **__: failed)
    with pytest.raises(rl.ParameterError, match="runs at no point of the map: too weak"):
        maps.efficiency(drive, omega=[50.0, 100.0], tau=[1.0, 2.0])
    still = drive.with_values({"load.speed_rpm": 0})
    with pytest.raises(rl.ParameterError, match=r"the drive stands still.*--speed"):
        maps.efficiency(still, tau=[1.0, 2.0])


def test_the_map_of_a_drive_that_turns_backwards_is_over_positive_speeds_and_told():
    drive = rl.load(EXAMPLES / "sharing_cubic.toml", ["load.speed_rpm=-900"])
    with pytest.warns(Note, match="works at -900 rpm; .*positive where it motors"):
        speeds = maps._usual_speeds(drive)
    assert speeds == pytest.approx(np.linspace(180, 1800, 10) * np.pi / 30)


# A comparison, a sweep, a tuning.


def test_contenders_work_side_by_side_but_one_alone_or_in_one_process(monkeypatch):
    """In no more processes than there are contenders."""
    asked = []

    class Pool:
        def __init__(self, count, initializer):
            asked.append((count, initializer))

        def __enter__(self):
            return self

        def __exit__(self, *_):
            return False

        def imap_unordered(self, work, tasks):
            return map(work, tasks)

    context = Namespace(Pool=Pool)
    monkeypatch.setattr(comparison.multiprocessing, "get_context", lambda kind: context)
    monkeypatch.setattr(comparison, "_work", lambda task: task * 10)
    assert [*comparison._worked([1, 2, 3], 1)] == [10, 20, 30] and not asked
    assert [*comparison._worked([1], 8)] == [10] and not asked
    assert [*comparison._worked([1, 2, 3], 8)] == [10, 20, 30]
    assert [*comparison._worked([1, 2, 3], 2)] == [10, 20, 30]
    assert [count for count, _ in asked] == [3, 2]


@pytest.mark.parametrize("f_switch", [0.0, -5e3, 1e9, np.nan])
def test_a_comparison_is_at_a_frequency_that_a_switch_may_have(f_switch):
    drive = rl.load(EXAMPLES / "sharing_cubic.toml")
    with pytest.raises(rl.ParameterError, match="Hz, need > 0"):
        comparison.compare(drive, ["sharing_cubic"], f_switch=f_switch)


def test_a_contender_without_tables_leaves_the_others_theirs(monkeypatch):
    made = []

    def contender(name):
        def drive(point, values):
            if name == "weak":
                raise RuntimeError("no optimum")
            return Namespace(controller=lambda: made.append(name))

        return Namespace(drive=drive)

    monkeypatch.setattr(comparison, "contender", contender)
    comparison._fill_the_cache(None, ["a", "weak", "b"])
    assert made == ["a", "b"]


def test_without_optional_packages_one_line_says_what_to_install(monkeypatch):
    for name in ("pandas", "optuna", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    sweep = Sweep("d", {"a": [1]}, {}, [""], (1,), ran=0, known=0)
    with pytest.raises(rl.ParameterError, match="needs pandas; `pip install pandas`"):
        sweep.to_dataframe()
    with pytest.raises(rl.ParameterError, match=r"pip install 'reluctance\[tune\]'"):
        optuna_search.search(None)
    from reluctance.explore.sweeps import cluster

    with pytest.raises(rl.ParameterError, match=r"pip install 'reluctance\[cluster\]'"):
        next(cluster.finished_on("a", iter([])))


def test_optuna_is_told_the_worth_and_the_miss_of_each_trial_until_the_runs_are_spent():
    """Four at once; a trial without figures failed; where nothing new is tried, it ends."""
    pytest.importorskip("optuna")
    told, asked = [], []

    class One:
        def suggest_float(self, name, low, high):
            assert (low, high) == (0.0, 1.0)
            return 0.25

        def suggest_categorical(self, name, values):
            assert values == [0, 1, 2]
            return 2

    study = Namespace(
        ask=lambda: asked.append(1) or One(),
        tell=lambda one, worth=None, state=None: told.append(
            worth if state is None else state.name
        ),
    )

    class Trials:
        vary, ranges = {"x": [0, 10], "law": ["a", "b", "c"]}, {"x": (0, 10)}

        def __init__(self, left, steps):
            self.left, self.steps, self.places = left, iter(steps), []

        def at(self, unit, choices):
            return tuple(unit), choices

        def run(self, places):
            self.places.append(places)
            self.left -= next(self.steps)
            answers = [("", 5.0, 0.0), ("", -5.0, 0.1), ("bad", 1.0, 0.0), ("", np.nan, 0.0)]
            return [
                Namespace(why=why, worth=worth, rank=(miss, worth))
                for why, worth, miss in answers[: len(places)]
            ]

    trials = Trials(6, [4, 2])
    optuna_search._ask(study, trials)
    assert [len(places) for places in trials.places] == [4, 2] and trials.left == 0
    assert trials.places[0][0] == ((0.25,), {"law": "c"})
    missed = pytest.approx(-5.0 + 0.1 * 6 * 10)
    assert told == [5.0, missed, "FAIL", "FAIL", 5.0, missed]
    trials = Trials(6, [4, 0])
    optuna_search._ask(study, trials)
    assert len(trials.places) == 2 and trials.left == 2


@pytest.mark.parametrize(
    ("ranges", "worth", "refined"), [(["x"], 5.0, True), ([], 5.0, False), (["x"], np.nan, False)]
)
def test_the_first_half_of_a_search_is_its_starts_and_even_points(
    monkeypatch, ranges, worth, refined
):
    """At least one of the latter; then the best is refined, where it has figures and a range."""
    asked, begun = [], []
    best = Namespace(worth=worth)
    monkeypatch.setattr(search, "refine", lambda trials, start: begun.append(start))
    for budget, starts, even in ((20, 3, 7), (20, 0, 10), (7, 0, 3), (6, 3, 1), (4, 9, 1)):
        trials = Namespace(
            drive=rl.load(EXAMPLES / "sharing_cubic.toml"),
            vary={"control.i_band_A": [1.0, 3.0]},
            budget=budget,
            ranges=ranges,
            run=asked.append,
            best=lambda: best,
        )
        given = [{"control.i_band_A": 1.0 + n / 10} for n in range(starts)]
        search.search(trials, given)
        assert asked[-1][:starts] == given and len(asked[-1]) == starts + even
        assert all(1 <= row["control.i_band_A"] <= 3 for row in asked[-1])
    assert begun == [best] * (5 if refined else 0)


@pytest.mark.parametrize(("worth", "scale"), [(-4.0, 4.0), (0.0, 1.0)])
def test_a_refinement_asks_for_parts_of_the_best_figure_and_room_within_bounds_and_ranges(
    monkeypatch, worth, scale
):
    asked, tried = {}, []
    answers = {0.25: (6.0, (0.5, -0.2)), 0.5: (np.nan, (np.nan, 0.0))}

    def run(rows):
        (row,) = rows
        tried.append(row)
        if row["x"] not in answers:
            return []  # the budget is spent
        found, misses = answers[row["x"]]
        return [Namespace(worth=found, misses=misses)]

    def minimize(of, start, **how):
        asked.update(how, of=of, start=start)
        (limits,) = how["constraints"]
        assert of([0.25, 0.75]) == 6 / scale and of([0.5, 1.0]) == 1e3
        assert limits["type"] == "ineq"
        assert limits["fun"]([0.25, 0.75]) == pytest.approx([-0.5, 0.2, 0.25, 0.75, 0.75, 0.25])
        assert limits["fun"]([0.5, 1.0]) == pytest.approx([-1e3, 0, 0.5, 1, 0.5, 0])
        asked["ends"] = True
        of([0.9, 0.9])
        raise AssertionError("goes on with a budget that is spent")

    trials = Namespace(
        ranges=["x", "y"],
        budget=30,
        at=lambda unit, choices: dict(zip("xy", unit, strict=True)) | choices,
        place=lambda values: [0.1, 0.2],
        run=run,
    )
    monkeypatch.setattr("scipy.optimize.minimize", minimize)
    search.refine(trials, Namespace(worth=worth, values={"law": "ditc"}))
    assert asked["ends"] and [*asked["start"]] == [0.1, 0.2] and asked["method"] == "COBYLA"
    assert asked["options"] == {"rhobeg": 0.15, "tol": 1e-3, "maxiter": 20 * 3 * 30}
    assert all(row["law"] == "ditc" for row in tried)


def test_a_compass_on_a_plain_stays_and_halves_its_step():
    """From the first of 25 cells of a fifth, 0.1 aside at first, down to a hundredth."""
    asked = []

    def rank(x, y):
        asked.append((round(x, 9), round(y, 9)))
        return 1.0

    compass.compass(rank, lambda: len(asked) < 500)
    cells = [0.1, 0.3, 0.5, 0.7, 0.9]
    assert asked[:25] == [(x, y) for x in cells for y in cells]
    aside = {(x, y) for x, y in asked[25:]} - {(0.1, 0.1)}
    steps = [0.1, 0.05, 0.025, 0.0125]
    assert {round(np.hypot(x - 0.1, y - 0.1), 9) for x, y in aside} == {*steps}
    assert len(aside) == 4 * len(steps)


@pytest.mark.parametrize("text", ["i_rms_A", "i_rms_A<", "<5", "i_rms_A<many", "i_rms_A<inf"])
def test_a_bound_is_a_figure_and_a_number(text):
    with pytest.raises(rl.ParameterError, match=f"--keep {text}: need FIGURE<VALUE or"):
        bound(text)


@pytest.mark.parametrize(("start", "sign"), [(1.009, -1), (0.991, 1)])
def test_a_step_towards_the_target_is_a_fiftieth_at_least(start, sign):
    """On a logarithmic scale, where a tolerance is finer than what is asked for; here the figure
    does not follow the parameter at all."""
    tried = []

    def run(value):
        tried.append(value)
        return Namespace(figures={"f_switch_Hz": 1e4 * start})

    lever = Lever(0.1, 10.0, 1.0)
    match(run, Target("f_switch_Hz", 1e4, 1e-4), lever, 1.0)
    steps = np.diff(np.log(tried[:4]))
    assert steps == pytest.approx(np.full(3, sign * 0.02), rel=5e-3)
