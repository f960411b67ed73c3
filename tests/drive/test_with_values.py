"""The Python surface: values changed in a drive, arguments of a wrong kind, key figures by name."""

import json
import subprocess
import sys
from dataclasses import fields, replace
from inspect import cleandoc
from pathlib import Path

import numpy as np
import pytest

import reluctance as rl
from reluctance.base.units import UNITS, from_si, name_and_unit, si, to_si
from reluctance.drive.drive import drive_from

EXAMPLES = Path(__file__).parents[2] / "examples"
RATED = EXAMPLES / "paper_rated.toml"
every_example = pytest.mark.parametrize(
    "path",
    sorted(p for p in EXAMPLES.glob("*.toml") if "[site]" not in p.read_text()),
    ids=lambda p: p.stem,
)


@every_example
def test_tables_of_a_drive_give_the_same_drive(path: Path) -> None:
    drive = rl.load(path)
    assert drive_from(drive.tables(), name=drive.name) == drive
    assert drive.with_values({}) == drive


@pytest.mark.parametrize(
    ("values", "overrides"),
    [
        (
            {"converter.u_dc_V": 300, "control.i_band_A": 0.5},
            ["converter.u_dc_V=300", "control.i_band_A=0.5"],
        ),
        ({"control.law": "ditc"}, ["control.law=ditc"]),
        ({"control.i_band_A": np.float64(0.5)}, ["control.i_band_A=0.5"]),
        ({"control.guide_speed_rpm": (750, 1500.0)}, ["control.guide_speed_rpm=[750, 1500.0]"]),
        ({"machine": "generic_60kw_6_4"}, ["machine=generic_60kw_6_4"]),
        ({"machine.iron": None}, None),
        ({"control.N_p": None}, ["control.N_p="]),
    ],
)
def test_with_values_is_set(values: dict[str, object], overrides: list[str] | None) -> None:
    drive = rl.load(RATED, ["control.N_p=3"])
    if overrides is None:
        with pytest.raises(rl.ParameterError, match="no such key to remove"):
            drive.with_values(values)
        return
    assert drive.with_values(values) == rl.load(RATED, ["control.N_p=3", *overrides])
    assert drive == rl.load(RATED, ["control.N_p=3"])  # itself unchanged


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"converter.u_dc_V": -1}, r"\[converter\] u_dc_V = -1, need > 0"),
        ({"converter.u_dc": 300}, "did you mean `u_dc_V`"),
        ({"u_dc_V": 300}, "need section.key=value"),
        ({"control.law": "pid"}, "law = 'pid' is unknown"),
        ({3: 4}, "is not a `section.key`"),
        ("control.law=ditc", "takes a dict"),
    ],
)
def test_a_wrong_value_is_one_line(values: dict[str, object], text: str) -> None:
    with pytest.raises(rl.ParameterError, match=text) as fault:
        rl.load(RATED).with_values(values)
    assert "\n" not in str(fault.value)


DRIVE = rl.load(RATED)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: rl.load(RATED, "control.N_p=3"), "need a list of texts"),
        (lambda: rl.load(RATED, [3]), "need a text as in"),
        (lambda: rl.load(3), "takes the path of a drive file"),
        (lambda: rl.simulate("paper_rated.toml"), r"takes a Drive.*reluctance\.load"),
        (lambda: rl.limit("paper_rated.toml"), r"limit takes a Drive.*reluctance\.load"),
        (lambda: rl.compare("paper_rated.toml"), r"compare takes a Drive.*reluctance\.load"),
        (lambda: rl.efficiency("paper_rated.toml"), r"efficiency takes a Drive"),
        (lambda: rl.tune("paper_rated.toml", {}), r"tune takes a Drive"),
        (lambda: rl.export.firmware("paper_rated.toml", "x"), r"firmware takes a Drive"),
        (lambda: rl.simulate(DRIVE, until="0.1"), "until = '0.1', need a number"),
        (lambda: rl.simulate(DRIVE, until=-1), "until = -1 s, need > 0"),
        (lambda: rl.simulate(DRIVE, until=float("nan")), "until = nan s, need > 0"),
        (lambda: rl.simulate(DRIVE, record=-1), "record = -1 s, need >= 0"),
        (lambda: rl.simulate(DRIVE, record=True), "record = True, need a number"),
        (lambda: rl.simulate(DRIVE, record=np.inf), "record = inf s, need >= 0"),
        (lambda: rl.simulate(DRIVE, until=0), "until = 0 s, need > 0"),
        (lambda: rl.simulate(DRIVE, until=np.inf), "until = inf s, need > 0"),
        (lambda: DRIVE.converter.model_copy(update={"u_dc_V": "high"}), "u_dc_V = 'high'"),
        (lambda: rl.simulate(DRIVE, until=1e-3, record=None).plot(), "no waveforms"),
    ],
)
def test_an_argument_of_the_wrong_kind_is_one_line(call, text) -> None:
    with pytest.raises(rl.ParameterError, match=text) as fault:
        call()
    assert "\n" not in str(fault.value)


@pytest.fixture(scope="module")
def result() -> rl.Result:
    return rl.simulate(DRIVE, until=0.03)


def test_key_figures_have_one_name(result: rl.Result) -> None:
    """The attribute is the key of the JSON without its unit, and the JSON is it in that unit."""
    figures = result.kpis.with_units()
    names = [figure.name for figure in fields(result.kpis)]
    assert len(names) == len(figures)
    for name, (key, value) in zip(names, figures.items(), strict=True):
        unit = key.removeprefix(name).removeprefix("_") or None
        own = getattr(result.kpis, name)
        assert (value is own is None) or value == pytest.approx(from_si(own, unit), rel=1e-15)
        assert f"\n{name} : " in cleandoc(rl.Kpis.__doc__ or "")
    for field in fields(result):
        assert any(f"\n{field.name} : " in cleandoc(c.__doc__ or "") for c in rl.Result.__mro__)


def test_key_figures_are_plain(result: rl.Result) -> None:
    for field in fields(result.kpis):
        assert type(getattr(result.kpis, field.name)) in (float, int, type(None)), field.name
    assert json.loads(json.dumps(result.kpis.with_units())) == result.kpis.with_units()


def test_result_shows_itself(result: rl.Result) -> None:
    assert len(repr(result)) < 120
    k = result.kpis
    torque, end = f"{k.tau_mean:.4g} N m", f", {k.f_switch / 1e3:.4g} kHz; {result.t.size} rows"
    ripple = f", ripple {k.torque_ripple_pp:.2%}"
    assert repr(result).startswith(f"Result(paper_rated: {torque}{ripple}{end} of waveforms)")
    plain = replace(result, kpis=replace(k, torque_ripple_pp=None))
    assert repr(plain).startswith(f"Result(paper_rated: {torque}{end}")
    assert "torque_ripple_pp" in result._repr_html_()
    assert len(result.plot().axes) == 4


def test_dataframe_has_the_columns_of_a_file_or_says_what_is_missing(result: rl.Result) -> None:
    try:
        import pandas  # noqa: F401
    except ImportError:
        with pytest.raises(rl.ParameterError, match="pip install pandas"):
            result.to_dataframe()
    else:
        table = result.to_dataframe()
        assert list(table)[:3] == ["t_s", "theta_m_deg", "speed_rpm"]
        assert table["theta_m_deg"].to_numpy() == pytest.approx(np.degrees(result.theta_m))


@pytest.mark.parametrize(
    ("speed", "torque", "sign"), [(1500.0, 20.0, (1, 1)), (1500.0, -20.0, (-1, -1))]
)
def test_efficiency_is_of_the_way_that_the_power_takes(
    speed: float, torque: float, sign: tuple[int, int]
) -> None:
    values = {"load.speed_rpm": speed, "reference.tau_Nm": torque, "control.law": "torque_sharing"}
    kpis = rl.simulate(DRIVE.with_values(values), until=0.04, record=None).kpis
    assert (np.sign(kpis.p_mech), np.sign(kpis.p_in)) == sign
    small, large = sorted((abs(kpis.p_mech), abs(kpis.p_in)))
    assert kpis.efficiency == pytest.approx(small / large)


def test_braking_that_feeds_losses_from_both_sides_has_no_efficiency() -> None:
    values = {"load.speed_rpm": 20.0, "reference.tau_Nm": -20.0, "control.law": "torque_sharing"}
    kpis = rl.simulate(DRIVE.with_values(values), until=0.2, record=None).kpis
    assert kpis.p_mech < 0 < kpis.p_in
    assert kpis.efficiency is None


def test_standstill_has_no_speed_ripple() -> None:
    values = {"load.speed_rpm": 0.0, "control.law": "torque_sharing"}
    kpis = rl.simulate(DRIVE.with_values(values), until=0.01, record=None).kpis
    assert kpis.speed_ripple_pp is kpis.with_units()["speed_ripple_pp"] is None


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_there_and_back_changes_nothing(unit: str) -> None:
    for value in (1500.0, 0.1, 123.456, -7e-3):
        assert from_si(to_si(value, unit), unit) == pytest.approx(value, rel=1e-15)


def test_suffixes_are_units_and_counts_are_not() -> None:
    assert name_and_unit("speed_rpm") == ("speed", "rpm")
    assert name_and_unit("N_s") == ("N_s", None)
    assert name_and_unit("i_band") == ("i_band", None)
    assert si({"t_s": [1.0, 2.0], "dead_time_us": 2.0, "N_r": 4, "kind": "pump"}) == {
        "t": [1.0, 2.0],
        "dead_time": 2e-6,
        "N_r": 4,
        "kind": "pump",
    }
    assert DRIVE.converter.si["u_dc"] == DRIVE.converter.u_dc_V


def test_types_are_published() -> None:
    """A user's mypy reads the annotations of an installed package only with this file in it."""
    place = subprocess.check_output(
        [sys.executable, "-c", "import reluctance; print(reluctance.__path__[0])"], text=True
    )
    assert (Path(place.strip()) / "py.typed").is_file()


def test_a_torque_out_of_reach_is_refused_of_a_changed_drive_as_of_a_file() -> None:
    with pytest.raises(rl.ParameterError, match="out of reach"):
        rl.load(RATED).with_values({"reference.tau_Nm": 4000})
