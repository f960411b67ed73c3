"""What strangers type on the command line: each remedy, followed to the letter, works."""

from pathlib import Path

import pytest
from command import command, refused

ROOT = Path(__file__).parents[2]
RATED = ROOT / "examples" / "paper_rated.toml"


@pytest.mark.parametrize(
    "line",
    [
        ("sweep", RATED, "--vary", "control.i_band_A=1,2"),
        ("efficiency", RATED, "--speed", "500,1000", "--torque", "10,20"),
        *[("tune", RATED, "--vary", "control.i_band_A=1,2", "--minimise", "torque_error_rms")],
    ],
    ids=lambda line: line[0],
)
def test_a_cache_that_cannot_be_written_is_told_with_the_variable_that_moves_it(
    line, tmp_path, monkeypatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "file" / "cache"))
    assert "set RELUCTANCE_CACHE in the environment to a folder of your own" in refused(*line)
    monkeypatch.setenv("RELUCTANCE_CACHE", str(tmp_path / "cache"))
    assert command(*line).code == 0
