"""Tuning: the best of what was tried, bounds that hold, a drive file that reads as the drive."""

import inspect
import json
from pathlib import Path

import numpy as np
import pytest
from command import command, refused

import reluctance as rl
from reluctance.base.schema import field_of
from reluctance.cli.tune import tune as cli_tune
from reluctance.explore.tuning import Trial, angles, tune
from reluctance.explore.tuning.compass import GRID, LAST_STEP, compass
from reluctance.explore.tuning.goal import Target, bound
from reluctance.explore.tuning.match import Lever, match
from reluctance.explore.tuning.tune import BUDGET

EXAMPLES = Path(__file__).parents[2] / "examples"
CUBIC = EXAMPLES / "sharing_cubic.toml"
UNTIL = 0.03
BAND = {"control.i_band_A": [0.3, 3.0]}


@pytest.fixture(scope="module")
def drive() -> rl.Drive:
    return rl.load(CUBIC)


@pytest.mark.long
def test_the_least_error_at_a_switching_frequency_is_that_of_a_fine_scan(drive: rl.Drive) -> None:
    """The band trades error for frequency: the least error is where the bound is met."""
    found = tune(drive, BAND, "torque_error_rms", keep=["f_switch_Hz<8e3"], until=UNTIL, budget=40)
    bands = np.linspace(0.3, 3.0, 200)
    scan = rl.sweep(drive, {"control.i_band_A": bands}, until=UNTIL)
    kept = scan.figure("f_switch") < 8e3
    least = scan.figure("torque_error_rms")[kept].min()
    assert found.best.kept and found.best.figures["f_switch_Hz"] < 8e3
    assert found.best.figures["torque_error_rms"] <= 1.03 * least


def test_it_is_the_same_however_often_and_never_above_its_budget(drive: rl.Drive) -> None:
    vary = {**BAND, "control.theta_on_deg": [20, 40], "control.theta_ov_deg": [5, 20]}
    first, second = (
        tune(drive, vary, "i_rms", keep=["f_switch_Hz<1e4"], until=UNTIL, budget=30)
        for _ in range(2)
    )
    assert [t.values for t in first.tried] == [t.values for t in second.tried]
    assert second.ran == 0 < first.ran <= 30 and len(first.tried) <= 30
    assert first.best.rank == min(t.rank for t in first.tried)
    half = min((t for t in first.tried[:15]), key=lambda t: t.rank)
    assert first.best.rank <= half.rank  # the refinement loses nothing


def test_the_compass_finds_the_least_of_a_bowl_within_its_last_step() -> None:
    asked: dict[tuple[float, float], float] = {}

    def rank(x: float, y: float) -> float:
        asked[x, y] = (x - 0.237) ** 2 + 2 * (y - 0.811) ** 2
        return asked[x, y]

    compass(rank, lambda: True)
    best = min(asked, key=lambda at: asked[at])
    assert np.hypot(best[0] - 0.237, best[1] - 0.811) < 2 * LAST_STEP
    assert len(asked) < 80
    asked.clear()
    compass(rank, lambda: False)  # nothing to spend: the grid alone
    assert len(asked) == GRID**2


def test_the_compass_search_is_one_of_tune(drive: rl.Drive) -> None:
    vary = {"control.theta_on_deg": [0, 15], "control.theta_ov_deg": [25, 45]}
    options = {"until": UNTIL, "budget": 45, "method": "compass"}
    found = tune(drive, vary, "torque_error_rms", **options)  # type: ignore[arg-type]
    grid = min(found.tried[: GRID**2], key=lambda t: t.rank)
    assert GRID**2 < len(found.tried) <= 45 and found.best.rank < grid.rank
    with pytest.raises(rl.ParameterError, match="takes two ranges, not 1"):
        tune(drive, BAND, "i_rms", method="compass")


def test_a_target_is_met_by_one_value_or_the_end_of_its_range_is_told(drive: rl.Drive) -> None:
    target = Target("f_switch_Hz", 6e3)

    def run(band: float) -> Trial:
        k = rl.simulate(drive.with_values({"control.i_band_A": band}), until=UNTIL, record=None)
        return Trial({"band": band}, k.kpis.with_units(), 0.0, (), "")  # type: ignore[arg-type]

    found = match(run, target, Lever(0.1, 10, slope=-1.0), 1.0)
    assert target.met(found.trial.figures) and not found.ran_out
    assert abs(found.trial.figures["f_switch_Hz"] / 6e3 - 1) <= 0.02
    assert target.miss({"f_switch_Hz": 6.3e3}) == pytest.approx(0.03)
    assert match(run, target, Lever(2, 10, slope=-1.0), 3.0).ran_out


def test_bounds_hold_at_every_operating_point(drive: rl.Drive) -> None:
    at = [{"load.speed_rpm": 800, "reference.tau_Nm": 20}, {"load.speed_rpm": 1500}]
    with pytest.raises(rl.ParameterError, match="same keys"):
        tune(drive, BAND, "i_rms", at=at)
    at[1]["reference.tau_Nm"] = 40
    found = tune(
        drive, BAND, "torque_error_rms", keep=["f_switch_Hz<6e3"], at=at, until=UNTIL, budget=16
    )
    for point in at:
        k = rl.simulate(found.drive.with_values(point), until=UNTIL, record=None).kpis
        assert k.f_switch < 6e3


def test_bounds_that_none_keeps_are_missed_by_least_and_said(drive: rl.Drive) -> None:
    found = tune(drive, BAND, "i_rms", keep=["f_switch_Hz<10"], until=UNTIL, budget=12)
    assert not found.best.kept
    assert found.best.figures["f_switch_Hz"] == min(t.figures["f_switch_Hz"] for t in found.tried)
    line = ("tune", CUBIC, "--vary", "control.i_band_A=0.3:3", "--minimise", "i_rms")
    rest = ("--keep", "f_switch_Hz<10", "--budget", "12", "--until", UNTIL)
    assert "no trial keeps all bounds" in command(*line, *rest).out


def test_a_key_of_a_table_within_a_table_is_found(drive: rl.Drive) -> None:
    machine = type(drive.machine).filed()
    found = field_of(machine, ["iron", "alpha"])
    assert found is not None and found.annotation is float
    for path in (["iron", "n"], ["R_ohm", "alpha"], ["nothing", "alpha"]):
        assert field_of(machine, path) is None


def test_choices_and_whole_numbers(drive: rl.Drive) -> None:
    vary = {"control.sharing": ["cubic", "linear", "cosine"], "sensing.adc_bits": [8, 14]}
    based = drive.with_values({"sensing.i_range_A": 200.0, "sensing.adc_bits": 8})
    found = tune(based, vary, "torque_ripple_rms", until=UNTIL, budget=12)
    assert {t.values["control.sharing"] for t in found.tried} == {"cubic", "linear", "cosine"}
    assert all(type(t.values["sensing.adc_bits"]) is int for t in found.tried)


@pytest.mark.parametrize(
    "name", ["paper_rated", "five_phases_losses", "sun_cloud", "fan", "angle_table"]
)
def test_a_written_drive_reads_as_the_same(name: str, tmp_path: Path) -> None:
    drive = rl.load(EXAMPLES / f"{name}.toml")
    drive.save(tmp_path / f"{name}.toml", comment="Tuned.")
    assert rl.load(tmp_path / f"{name}.toml") == drive


def test_a_map_machine_is_written_with_its_path(tmp_path: Path) -> None:
    drive = rl.load(CUBIC, ["machine=npf_vector_6_4", "reference.tau_Nm=1"], check_torque=False)
    drive.save(tmp_path / "m.toml")
    again = rl.load(tmp_path / "m.toml", check_torque=False)
    assert again.machine.files == [file.absolute() for file in drive.machine.files] != []


def test_the_command_writes_the_tuned_drive(tmp_path: Path) -> None:
    line = ("tune", CUBIC, "--vary", "control.i_band_A=0.3:3", "--minimise", "torque_error_rms")
    rest = ("--keep", "f_switch_Hz<8e3", "--budget", "12", "--until", UNTIL)
    out = (
        "--out",
        tmp_path / "t.toml",
        "--table",
        tmp_path / "t.csv",
        "--plot",
        tmp_path / "t.png",
    )
    told = json.loads(command(*line, *rest, *out, "--json").out)
    tuned = rl.load(tmp_path / "t.toml")
    assert tuned.control.i_band_A == told["values"]["control.i_band_A"]  # type: ignore[attr-defined]
    assert told["kept"] and told["trials"] <= 12
    assert "12 trials" in command(*line, *rest).out


def test_optuna_searches_and_goes_on_from_its_store(drive: rl.Drive, tmp_path: Path) -> None:
    import optuna

    options = {"keep": ["f_switch_Hz<8e3"], "until": UNTIL, "method": "optuna"}
    study = tmp_path / "study.db"
    first = tune(drive, BAND, "torque_error_rms", budget=12, study=study, **options)  # type: ignore[arg-type]
    assert len(first.tried) == 12 and first.best.kept
    tune(drive, BAND, "torque_error_rms", budget=4, study=study, **options)  # type: ignore[arg-type]
    storage = optuna.storages.RDBStorage(f"sqlite:///{study}")
    (name,) = optuna.get_all_study_names(storage)
    assert len(optuna.load_study(study_name=name, storage=storage).trials) >= 16
    storage.remove_session()
    storage.engine.dispose()


def test_what_cannot_be_meant_is_one_line() -> None:
    line = ("tune", CUBIC, "--vary", "control.i_band_A=0.3:3")
    assert "need either a figure" in refused(*line)
    assert "no key figure" in refused(*line, "--minimise", "torque")
    assert "need FIGURE<VALUE" in refused(*line, "--minimise", "i_rms", "--keep", "i_rms=3")
    assert "KEY=VALUE" in refused(*line, "--minimise", "i_rms", "--at", "load.speed_rpm")
    assert "at least 2 trials" in refused(*line, "--minimise", "i_rms", "--budget", "1")
    assert "none of the" in refused(
        "tune", CUBIC, "--vary", "control.i_band_A=-2:-1", "--minimise", "i_rms", "--budget", "4"
    )
    assert bound("efficiency>0.8").miss({"efficiency": 0.6}) == pytest.approx(0.25)
    assert bound("i_rms<50").miss({"i_rms_A": 40.0}) == pytest.approx(-0.2)


def test_the_help_names_the_budgets_that_serve() -> None:
    (option,) = inspect.signature(cli_tune).parameters["budget"].annotation.__metadata__
    assert option.help == f"Trials: {BUDGET}, or {angles.BUDGET} at each node of a table."
