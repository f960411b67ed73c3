"""The table of pairs of a machine file: what is refused."""

from pathlib import Path

import pytest
from command import refused
from geometries import drive_file

from reluctance.base.errors import ParameterError
from reluctance.machine.coupling import Neighbours
from reluctance.machine.pair_file import check_ring

MACHINES = Path(__file__).parents[2] / "machines"


def rewritten(tmp_path, change):
    """The library's machine with a pair table that went through `change(rows)`."""
    stored = (MACHINES / "onelab_6_4_pairs.csv").read_text()
    rows = [line.split(",") for line in stored.splitlines()]
    change(rows)
    (tmp_path / "p.csv").write_text("\n".join(",".join(row) for row in rows) + "\n")
    for name in ("onelab_6_4.csv", "onelab_6_4_force.csv"):
        (tmp_path / name).write_text((MACHINES / name).read_text())
    text = (MACHINES / "onelab_6_4_pairs.toml").read_text().replace("onelab_6_4_pairs.csv", "p.csv")
    (tmp_path / "m.toml").write_text(text)
    return drive_file(tmp_path, tmp_path / "m.toml")


def scaled(column, factor):
    def change(rows):
        n = rows[0].index(column)
        for row in rows[1:]:
            row[n] = repr(float(row[n]) * factor)

    return change


def cell(column, text):
    def change(rows):
        rows[5][rows[0].index(column)] = text

    return change


def every(column, old, new):
    def change(rows):
        n = rows[0].index(column)
        for row in rows[1:]:
            row[n] = row[n].replace(old, new)

    return change


def all_scaled(factor):
    def change(rows):
        for column in ("energy_J", "tau_Nm", "psi_first_Wb", "psi_second_Wb"):
            scaled(column, factor)(rows)

    return change


REFUSED = [
    (scaled("tau_Nm", -1), "tau_Nm is not the derivative of energy_J over the angle"),
    (scaled("tau_Nm", 1000), "check the columns, their units and the sign"),
    (scaled("psi_first_Wb", 1000), "psi_first_Wb is not the derivative of energy_J"),
    (all_scaled(12), "take flux map and pair table from the same source"),
    (lambda rows: rows[0].__setitem__(4, "W"), "column energy_J is missing"),
    (lambda rows: rows.pop(7), "rows are no grid"),
    (cell("tau_Nm", "much"), "data row 5, tau_Nm: `much` is not a number"),
    (every("pairs", "ac", "ad"), "pair `ad` is none of phases a, b, c"),
    (every("pairs", " cb", ""), "pairs bc are missing beside ac, ba: each of 3 phases has"),
    (every("pairs", " cb", " ac"), "pair ac is named twice; remove one"),
    (every("pairs", " cb", " ca"), "pair ca is named twice"),  # from the other side
    (lambda rows: rows.clear(), "the file has no rows"),
    (scaled("i_first_A", 0.5), "rows are no grid"),
]


@pytest.mark.parametrize(("change", "text"), REFUSED, ids=[text for _, text in REFUSED])
def test_a_pair_table_that_is_none_gets_one_line(tmp_path, change, text):
    assert text in refused("run", rewritten(tmp_path, change))


@pytest.mark.parametrize(
    ("n", "named", "lacking"),
    [
        (2, "ab", None), (2, "ab ba", None), (3, "ab bc ca", None), (3, "ab bc ac", None),
        (4, "ad dc cb ba", None), (4, "ab bc ca", "cd, ad, bd"), (4, "ac bd", None),
        (4, "ab bc cd da ac", "bd"), (5, "ab bc cd de", "ae"), (6, "ad be", "cf"),
    ],
)  # fmt: skip
def test_every_phase_has_the_same_neighbours(n, named, lacking):
    pairs = [Neighbours("abcdef".index(a), "abcdef".index(b), None) for a, b in named.split()]
    if lacking is None:
        return check_ring(pairs, n)
    with pytest.raises(ParameterError, match=f"^pairs {lacking} are missing beside "):
        check_ring(pairs, n)


def test_pairs_that_end_below_the_current_limit_get_one_line(tmp_path):
    def shorter(rows):
        i = max(float(row[2]) for row in rows[1:])
        rows[1:] = [row for row in rows[1:] if max(float(row[2]), float(row[3])) < i]

    assert "below i_max_A = 12" in refused("run", rewritten(tmp_path, shorter))


def test_a_pair_file_that_is_missing_gets_one_line(tmp_path):
    path = rewritten(tmp_path, lambda rows: None)
    (tmp_path / "p.csv").unlink()
    assert "no such file" in refused("run", path)
