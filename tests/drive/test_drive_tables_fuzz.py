"""Any table gives a drive or one line."""

import os
from pathlib import Path
from typing import Any

import hypothesis.strategies as st
import pytest
from hypothesis import HealthCheck, given, settings

import reluctance as rl
from reluctance.base.schema import Section
from reluctance.drive.all_tables import TABLES
from reluctance.drive.drive import drive_from
from reluctance.drive.laws import LAWS, table_of

FOLDER = Path(__file__).parents[2] / "examples"
EXAMPLES = [FOLDER / f"{name}.toml" for name in ("paper_pump", "deadbeat", "map_mpc", "battery")]
CASES = int(os.environ.get("RELUCTANCE_FUZZ", "10000"))
BASES = [rl.load(path).tables() for path in EXAMPLES]

# What the values of a TOML file can be: of the right kind, of a wrong one, and out of any range.
NUMBERS = st.one_of(
    st.floats(),
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from([0, -1, 1, 1e-300, 1e300, 0.5, 90.0, 360]),
)
TEXTS = st.sampled_from(["", "a", "linear", "map", "\\n", "θ", "speed", "T_s_us"])
LEAVES = st.one_of(NUMBERS, st.booleans(), TEXTS, st.lists(NUMBERS, max_size=4))
VALUES = st.recursive(LEAVES, lambda v: st.dictionaries(TEXTS, v, max_size=2))


def keys(table: str) -> list[str]:
    kinds: list[type[Section]] = [*map(table_of, LAWS)] if table == "control" else [TABLES[table]]
    return sorted({key for kind in kinds for key in kind.model_fields} - {"law"})


KEYS = [(t, key) for t in (*TABLES, "control") for key in keys(t)]
CHANGES = st.lists(st.tuples(st.sampled_from(KEYS), VALUES), min_size=1, max_size=3)


@pytest.mark.long
@settings(
    max_examples=CASES,
    deadline=None,
    derandomize="RELUCTANCE_FUZZ" not in os.environ,
    database=None,
    suppress_health_check=list(HealthCheck),
)
@given(st.sampled_from(BASES), CHANGES, st.sampled_from([*LAWS, "", "pid", None]))
def test_any_table_gives_a_drive_or_one_line(
    base: dict[str, dict[str, Any]], changes: list[Any], law: str | None
) -> None:
    tables = {name: dict(table) for name, table in base.items()}
    if law is not None:
        tables["control"]["law"] = law
        if law in LAWS:
            known = table_of(law).model_fields
            tables["control"] = {k: v for k, v in tables["control"].items() if k in known}
    for (table, key), value in changes:
        tables.setdefault(table, {})[key] = value
    try:
        drive = drive_from(tables)
    except rl.ParameterError as fault:
        assert str(fault) and "\n" not in str(fault)
        return
    assert drive_from(drive.tables()) == drive


@pytest.mark.parametrize("text", ["", "[", "a = ", "machine = 3", "[control]\nlaw = []", "\0"])
def test_any_text_is_one_line(text: str, tmp_path: Path) -> None:
    path = tmp_path / "drive.toml"
    path.write_text(text)
    with pytest.raises(rl.ParameterError) as fault:
        rl.load(path)
    assert "\n" not in str(fault.value)
