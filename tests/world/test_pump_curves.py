"""Curves of catalogues: flat or rising at low flow, or beginning above it."""

from pathlib import Path

import numpy as np
import pytest

from reluctance.base.errors import Note, ParameterError
from reluctance.plant.hydraulics.curve import RPM, Curve
from reluctance.plant.hydraulics.pump import pump_from

PLAIN = "0,60,0 2,59.4,.3 4,58,.5 6,54,.61 8,48,.65 10,40,.63 12,29,.55 14,15,.38"
FLAT = "0,58,0 2,58,.3 4,58,.5 6,54,.61 8,48,.65 10,40,.63 12,29,.55 14,15,.38"
DROOP = "0,56,0 2,57.5,.3 4,58,.5 6,54,.61 8,48,.65 10,40,.63 12,29,.55 14,15,.38"
LOW = "4,58,.5 6,54,.61 8,48,.65 10,40,.63 12,29,.55 14,15,.38"


def curve(folder: Path, points: str, *, head: str = "Q_m3ph,H_m,eta") -> Curve:
    (folder / "p.csv").write_text("\n".join([head, *points.split()]))
    return pump_from({"n_ref_rpm": 2900.0, "curve_csv": "p.csv"}, folder).curve()


@pytest.mark.parametrize("points", [FLAT, DROOP, LOW])
def test_a_curve_as_a_catalogue_prints_it_works_where_the_pump_works(
    tmp_path: Path, points: str
) -> None:
    plain = curve(tmp_path, PLAIN)
    with pytest.warns(Note, match=r"H_m .* at shut-off to 58 m at Q_m3ph = 4"):
        found = curve(tmp_path, points)
    Q = np.linspace(6, 14, 30) / 3600
    ones = np.ones(30)
    assert found.omega_ref == pytest.approx(2900 * RPM)
    assert found.head(Q, ones) == pytest.approx(plain.head(Q, ones), rel=1e-9)
    assert found.shaft_power(Q, ones) == pytest.approx(plain.shaft_power(Q, ones), rel=1e-9)
    low = np.linspace(0, 14, 200) / 3600
    assert (np.diff(found.head(low, np.ones(200))) < 0).all() and 58 < found.H_0 < 64


def test_shaft_powers_of_a_flat_curve_stay_those_of_the_maker(tmp_path: Path) -> None:
    points = "0,58,900 2,58,1000 4,58,1200 6,54,1450 8,48,1600"
    with pytest.warns(Note):
        found = curve(tmp_path, points, head="Q_m3ph,H_m,p_shaft_W")
    Q = np.array([4, 6, 8]) / 3600
    assert found.shaft_power(Q, np.ones(3)) == pytest.approx([1200, 1450, 1600])
    assert found.shaft_power(np.zeros(1), np.ones(1))[0] == pytest.approx(900, rel=0.1)


def test_exchanged_flows_and_heads_are_asked_for_and_the_remedy_works(tmp_path: Path) -> None:
    plain, rows = curve(tmp_path, PLAIN), PLAIN.split()
    heads_first = [",".join([H, Q, eta]) for Q, H, eta in (row.split(",") for row in rows)]
    wrong, turned = " ".join(heads_first), " ".join(rows[::-1])
    for points in (wrong, turned):
        with pytest.raises(
            ParameterError, match=r"are Q_m3ph and H_m exchanged.*order of the rows"
        ):
            curve(tmp_path, points)
    assert curve(tmp_path, wrong, head="H_m,Q_m3ph,eta").H_0 == plain.H_0
    with pytest.raises(ParameterError) as fault:  # no order at all: nothing to exchange
        curve(tmp_path, " ".join([rows[2], rows[1], rows[0], *rows[3:]]))
    assert "heads rise" not in str(fault.value)
