"""The judge of machines that are drawn from seeds: studies/drawn.py."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import reluctance as rl

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "studies"))
import drawn  # noqa: E402
import quadrants  # noqa: E402

# A machine of the wide ranges may miss the point that its aligned curve is given by.
pytestmark = pytest.mark.filterwarnings("ignore:.*the line that the aligned curve ends in")


@pytest.mark.long
@pytest.mark.parametrize("ranges", [*drawn.RANGES])
def test_each_drive_file_gives_its_point(
    ranges: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quadrants, "SPEEDS", (0.5,))
    ((seed, at),) = drawn.benches([77], ranges, tmp_path)
    listed = drawn.points(seed, at, ["deadbeat"], board=False)
    assert {np.sign(p.drive.load.omega[1][0]) for p in listed} <= {1, -1}
    path = tmp_path / "drive.toml"
    path.write_text(drawn.drive_file(listed[1].drive), encoding="utf-8")
    (row,) = quadrants.run_all(listed[1:2])
    kpis = rl.simulate(rl.load(path), until=listed[1].length, record=None).kpis
    assert kpis.tau_mean / row.tau_ref_Nm - 1 == pytest.approx(row.mean_error)


def test_a_bound_counts_and_finds_the_worst() -> None:
    row: dict[str, Any] = dict.fromkeys(quadrants.Row.__dataclass_fields__, 0.0)
    rows = [
        quadrants.Row(**row | {"refused": "", "torque_part": 0.5, "mean_error": e})
        for e in (0.01, -0.05)
    ]
    bound = drawn.Bound(parts=(0.5,), within=0.02, held=0.5, worst=0.1)
    assert bound.verdict(rows) == (
        True,
        "    1 of     2 within 2 %, worst   -5.00 %, 0 refused",
    )
    assert not drawn.Bound(parts=(0.5,), within=0.02, held=0.9, worst=0.1).verdict(rows)[0]
    assert not drawn.Bound(parts=(0.5,), within=0.02, held=0.5, worst=0.04).verdict(rows)[0]
