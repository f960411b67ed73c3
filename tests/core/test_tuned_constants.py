"""docs/control/tuned_constants.csv has every tuned constant of the laws, as it is."""

import csv

import pytest
import tuned_constants as study


def table() -> list[dict[str, str]]:
    with study.TABLE.open() as file:
        return list(csv.DictReader(file))


def test_every_constant_was_tried_with_the_value_that_it_has() -> None:
    """A new constant, or another value, needs a new table."""
    rows = table()
    tried = {(row["header"], row["constant"], row["value"]) for row in rows}
    assert tried == {(one.header, one.name, one.value) for one in study.constants()}


@pytest.mark.long
@pytest.mark.parametrize("name", ["wide_band", "most"])
def test_the_table_is_current(name: str) -> None:
    (constant,) = (one for one in study.constants() if one.name == name)
    rows = [row for row in table() if row["constant"] == name]
    law = rows[0]["law"]
    for way, factor in zip(("less", "more"), study.FACTORS, strict=True):
        found = study.figures(law, constant, factor)
        for row in (row for row in rows if row["law"] == law):
            rms, mean = found[row["point"]]
            assert rms == pytest.approx(float(row[f"{way}_rms_pct"]), rel=0.02)
            assert mean == pytest.approx(float(row[f"{way}_mean_pct"]), abs=0.05)
