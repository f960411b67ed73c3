"""The page of the report has the study's numbers, and the files of a report are those it names."""

import json
import math
import re
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from brief_study import brief

from reluctance.base.picture import Picture as Canvas
from reluctance.paper import figures, page, report
from reluctance.paper.claim import Claim, text
from reluctance.paper.claims import claims
from reluctance.paper.points import Runs

RPM = np.pi / 30
UNITS = {"%": 0.01, "rpm": RPM, "kHz": 1e3}
IMAGES = {picture.name: picture.name.encode() for picture in figures.PICTURES}


def written() -> str:
    found = brief().found
    return page.page(found, claims(found), IMAGES)


def cells(row: str) -> list[str]:
    return [unescape(cell) for cell in re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row)]


def key_figures() -> dict[str, list[str]]:
    """Rows of the table by their labels."""
    table = written().partition("<h2>Key figures</h2>")[2].partition("</table>")[0]
    rows = [cells(row) for row in table.split("<tr>")[1:]]
    return {row[0]: row[1:] for row in rows}


@pytest.mark.parametrize(
    ("label", "key", "digits"),
    [
        ("mean torque (N m)", "tau_mean", 3),
        ("torque ripple, peak to peak (%)", "torque_ripple_pp", 2),
        ("torque error, rms (%)", "torque_error_rms", 2),
        ("switching frequency per switch (kHz)", "f_switch", 2),
        ("phase current, rms (A)", "i_rms", 2),
        ("phase current, peak (A)", "i_peak", 1),
        ("copper loss (W)", "p_cu", 0),
        ("mechanical power (W)", "p_mech", 0),
        ("efficiency (%)", "efficiency", 2),
        ("mean speed (rpm)", "speed_mean", 2),
        ("speed ripple, peak to peak (%)", "speed_ripple_pp", 4),
    ],
)
def test_key_figures_are_those_of_the_four_steady_states(label: str, key: str, digits: int) -> None:
    found = brief().found
    unit = UNITS.get(label.rpartition("(")[2].rstrip(")"), 1.0)
    runs = (found.rated.locked, found.half.locked, found.rated.pump, found.half.pump)
    for shown, run in zip(key_figures()[label], runs, strict=True):
        assert len(shown.partition(".")[2]) == digits
        error = abs(float(shown) * unit - getattr(run.kpis, key))
        assert error <= 0.51 * 10**-digits * unit


def test_limits_stand_below_the_held_points_and_times_below_the_pump() -> None:
    table, found = key_figures(), brief().found
    assert table[""] == [
        "41.339 N m, 1500 rpm held",
        "20.669 N m, 1060.7 rpm held",
        "pump, speed loop at 1500 rpm",
        "pump, speed loop at 1060.7 rpm",
    ]
    for label, key in (("– physical limit (A)", "i_rms"), ("– physical limit (W)", "p_cu")):
        rated, half, *empty = table[label]
        limits = [getattr(runs.best, key) for runs in (found.rated, found.half)]
        assert [float(rated), float(half)] == pytest.approx(limits, rel=1e-3)
        assert empty == ["", ""]
    *empty, rated, half = table["time to 98 % of the speed (s)"]
    assert empty == ["", ""]
    for shown, runs in ((rated, found.rated), (half, found.half)):
        assert speed_at(runs, float(shown) - 1e-3) < 0.98 < speed_at(runs, float(shown) + 1e-3)


def speed_at(runs: Runs, t: float) -> float:
    """Over its reference."""
    return float(np.interp(t, runs.pump.t, runs.pump.omega_m)) / (runs.point.speed_rpm * RPM)


def test_assumptions_and_shortest_response_are_told() -> None:
    words, r = " ".join(written().split()), brief().found.rated_response
    for told in (
        "U_dc = 240 V",
        "T_s = 20 µs",
        "L_sat = 0.15 mH",
        "(6 stator poles, 4 rotor poles)",
        f"current limit {r.start.drive.machine.i_max_A:g} A",
        f"at 240 V and rated torque is {r.bound[1].min() * 1e3:.3f} ms for physics "
        f"and {r.reached[1].min() * 1e3:.3f} ms for this controller",
    ):
        assert told in words


def test_claims_are_counted_by_their_verdicts_and_each_has_its_row() -> None:
    rows, html = claims(brief().found), written()
    for verdict in ("confirmed", "not confirmed", "cannot be checked"):
        count = sum(row.verdict == verdict for row in rows)
        assert count and re.search(rf"\b{count} {verdict}[,.]", html)
        assert html.count(f'class="verdict {verdict.replace(" ", "-")}">{verdict}<') == count
    table = html.partition("<table class=claims>")[2].partition("</table>")[0]
    shown = [cells(row) for row in table.split("<tr>")[1:]]
    assert len(shown) == len(rows)
    for cell, row in zip(shown, rows, strict=True):
        assert cell[0] == f"{row.claim}<br><span class=why>{row.why}</span>"
        assert cell[1:] == [
            *map(text, (row.paper_says, row.model_gives, row.physical_limit)),
            row.unit,
            row.verdict,
        ]


def test_sign_of_html_in_a_claim_is_text() -> None:
    claim = Claim("a < b", "<b>", 1.0, "A & B", None, "confirmed", "x > y")
    html = page.page(brief().found, [claim], IMAGES)
    assert "a &lt; b" in html and "&lt;b&gt;" in html and "A &amp; B" in html and "x &gt; y" in html


def test_report_is_every_picture_the_claims_and_the_page_and_progress_ends_at_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stamp(_: object) -> Canvas:
        return Canvas(1, 1)

    pictures = [figures.Picture(name, name, "", stamp) for name in ("first", "second")]
    grids: list[object] = []

    def study(grid: object, *, progress: object) -> object:
        grids.append(grid)
        return brief().found

    shares: list[float] = []
    monkeypatch.setattr(report, "study", study)
    monkeypatch.setattr(report, "PICTURES", pictures)
    monkeypatch.setattr(page, "PICTURES", pictures)
    done = report.write(tmp_path / "new" / "report", progress=shares.append)
    assert grids == [None]
    names = ["first.png", "second.png", "claims.json", "report.html"]
    assert [file.name for file in done.files] == names
    assert sorted(file.name for file in (tmp_path / "new" / "report").iterdir()) == sorted(names)
    assert all(file.read_bytes().startswith(b"\x89PNG") for file in done.files[:2])
    told = (tmp_path / "new" / "report" / "claims.json").read_text(encoding="utf-8")
    rows = [claim.as_json() for claim in done.claims]
    assert json.loads(told) == rows and told.endswith("]\n")
    # No number that JSON does not have, and then no report at all.
    monkeypatch.setattr(Claim, "as_json", lambda claim: {"ours": math.nan})
    with pytest.raises(ValueError, match="not JSON compliant"):
        report.write(tmp_path / "none")
    assert not (tmp_path / "none").exists()
    assert len(done.claims) == len(claims(brief().found))
    assert shares == sorted(shares) and shares[0] > brief().shares[-1] and shares[-1] == 1
