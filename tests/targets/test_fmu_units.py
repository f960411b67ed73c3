"""Units and variables of functional mock-up units: powers of the SI, numbers, roles, starts."""

import re
from collections import Counter
from typing import ClassVar
from xml.etree import ElementTree

import pytest

from reluctance.targets.export.fmu_description import UNITS, description
from reluctance.targets.export.fmu_variables import Variable, _variables

DEFINED = {"N": "kg.m/s2", "J": "N.m", "W": "J/s", "V": "W/A", "Wb": "V.s"}
DEFINED |= {"H": "Wb/A", "Ohm": "V/A", "F": "A.s/V", "degC": "K"}


def powers(name: str) -> dict[str, int]:
    """Of base units, by the definitions of the SI."""
    found: Counter[str] = Counter()
    for sign, part in zip((1, -1), name.split("/"), strict=False):
        for symbol, power in re.findall(r"([A-Za-z]+)(\d*)", part):
            inner = powers(DEFINED[symbol]) if symbol in DEFINED else {symbol: 1}
            for base, n in inner.items():
                found[base] += sign * int(power or 1) * n
    return {base: n for base, n in found.items() if n}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_has_the_base_units_of_its_name(name):
    assert UNITS[name] == powers(name)


class Tables:
    """Of a compiled unit: names of each table, and values that tell their places."""

    NAMES: ClassVar[dict[str, list[str]]] = {
        "parameter": ["machine.R", "law.n", "theta_m", "law.B"],
        "input": ["u_dc", "omega_m", "H_static", "reference"],
        "waveform": ["t", "i_0", "tau", "leg_1", "theta_m"],
        "period": ["t", "tau", "turn_ons"],
        "last_period": ["tau_ref", "i_peak"],
        "measurement": ["i_0", "theta_e"],
        "order": ["leg_0_1", "i_ref_2", "gate_enable"],
        "leg": ["leg_0"],
        "states": ["t", "mode", "status"],
    }

    def names(self, table: str) -> list[str]:
        return self.NAMES[table]

    def values(self, table: str) -> list[float]:
        return [10.0 * n + 0.5 for n in range(len(self.NAMES[table]))]


FLOATS = {"machine.R", "theta_m", "law.B"}


def variables(part: str, reference: str = "torque") -> dict[str, Variable]:
    found = _variables(Tables(), part, FLOATS, reference)  # type: ignore[arg-type]
    return {v.name: v for v in found}


def test_variables_have_the_number_of_their_table_and_place() -> None:
    """65536 times the table plus the index plus 1; include/srm/fmi/instance.hpp."""
    tables = [*Tables.NAMES]
    found = variables("stage")
    for name, table, index in (
        ("machine.R", "parameter", 0),
        ("theta_start", "parameter", 2),  # theta_m is a state's name
        ("omega_held", "input", 1),
        ("i_0", "waveform", 1),
        ("period.turn_ons", "period", 2),
        ("measured.theta_e", "measurement", 1),
        ("order.i_ref_2", "order", 1),
        ("states.status", "states", 2),
    ):
        assert found[name].reference == 65536 * tables.index(table) + index + 1, name
    assert not {"law.n", "t", "states.t", "leg_0", "waveform.t"} & found.keys()
    assert "period.t" in found


@pytest.mark.parametrize(
    ("part", "name", "role"),
    [
        ("drive", "machine.R", ("parameter", "fixed")),
        ("drive", "u_source", ("input", "continuous")),
        ("drive", "i_0", ("output", "continuous")),
        ("drive", "period.tau", ("output", "continuous")),
        ("drive", "last_period.i_peak", ("output", "discrete")),
        ("drive", "leg_1", ("output", "discrete")),  # a whole number
        ("stage", "order.i_ref_2", ("input", "discrete")),
        ("stage", "measured.i_0", ("output", "continuous")),
        ("controller", "measured.i_0", ("input", "discrete")),
        ("controller", "order.i_ref_2", ("output", "discrete")),
        ("controller", "tau", ("output", "discrete")),  # it works at its samples
        ("drive", "states.mode", ("output", "discrete")),
    ],
)
def test_what_a_part_is_given_is_an_input_and_what_it_makes_an_output(
    part: str, name: str, role: tuple[str, str]
) -> None:
    found = variables(part)[name]
    assert (found.causality, found.variability) == role
    assert (found.start is None) == (role[0] == "output")


def test_a_drive_has_no_measurements_and_orders_of_its_own() -> None:
    assert not [name for name in variables("drive") if name.startswith(("measured", "order"))]


def test_variables_have_unit_meaning_and_start_of_their_last_word() -> None:
    found = variables("stage")
    assert (found["i_0"].unit, found["i_0"].description) == ("A", "phase current")
    assert found["period.tau"].unit == "N.m.s"
    assert found["period.tau"].description == "integral of the machine torque"
    assert found["last_period.tau_ref"].description == (
        "integral of the torque reference, at the end of the last electrical period"
    )
    assert found["tau"].unit == "N.m"
    whole = {v.name for v in found.values() if v.integer}
    assert whole == {"leg_1", "order.leg_0_1", "order.gate_enable", "states.mode", "states.status"}
    starts = {name: found[name].start for name in ("machine.R", "law.B", "u_source", "H_static")}
    assert starts == {"machine.R": 0.5, "law.B": 30.5, "u_source": 0.5, "H_static": 20.5}


@pytest.mark.parametrize(
    ("kind", "unit", "said"),
    [
        *(("torque", "N.m", "torque"), ("speed", "rad/s", "speed")),
        *(("pv", "rad/s", "greatest speed"), ("none", None, "-1 to brake")),
    ],
)
def test_a_reference_has_the_unit_and_meaning_of_its_kind(
    kind: str, unit: str | None, said: str
) -> None:
    found = variables("drive", kind)["reference"]
    assert found.unit == unit and said in found.description


@pytest.mark.parametrize("version", [2, 3])
def test_the_description_has_every_variable_with_its_type_unit_start_and_output(
    version: int,
) -> None:
    found = list(variables("stage").values())
    text = description(
        version, "my_stage", "<token>", found, part="stage", text="a & b", until=0.5, step=2e-5
    )
    root = ElementTree.fromstring(text)
    assert root.get("fmiVersion") == f"{version}.0" and root.get("description") == "a & b"
    assert root.get("guid" if version == 2 else "instantiationToken") == "<token>"
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    assert (experiment.get("stopTime"), experiment.get("stepSize")) == ("0.5", "2e-05")
    units = {unit.get("name"): unit[0] for unit in root.find("UnitDefinitions") or ()}
    assert units.keys() == {v.unit for v in found if v.unit} | {"s"}
    listed = list(root.find("ModelVariables") or ())
    if version == 3:
        time = listed.pop(0)
        assert (time.get("name"), time.get("valueReference")) == ("time", "0")
    outputs = []
    for n, (entry, v) in enumerate(zip(listed, found, strict=True), 1):
        typed = entry[0] if version == 2 else entry
        kinds = {2: ("Real", "Integer"), 3: ("Float64", "Int32")}[version]
        assert typed.tag == kinds[v.integer] and entry.get("name") == v.name
        assert entry.get("valueReference") == str(v.reference)
        assert (entry.get("causality"), entry.get("variability")) == (v.causality, v.variability)
        assert typed.get("unit") == (None if v.integer else v.unit)
        shown = typed.get("start")
        assert (shown is None) == (v.start is None)
        if v.start is not None:
            assert float(shown or "nan") == (int(v.start) if v.integer else v.start)
        if version == 2:
            usual = {"parameter": "exact", "output": "calculated"}
            assert entry.get("initial") == usual.get(v.causality)
        if v.causality == "output":
            outputs.append(str(n if version == 2 else v.reference))
    structure = root.find("ModelStructure")
    assert structure is not None
    if version == 2:
        lists = [[u.get("index") for u in part] for part in structure]
    else:
        lists = [
            [u.get("valueReference") for u in structure.findall(kind)]
            for kind in ("Output", "InitialUnknown")
        ]
    assert lists == [outputs, outputs]


def test_degrees_celsius_have_their_offset() -> None:
    v = Variable("temp_cell", 1, "input", "continuous", False, "degC", "", 25.0)
    text = description(3, "m", "t", [v], part="stage", text="", until=1.0, step=1.0)
    base = ElementTree.fromstring(text).find(".//Unit[@name='degC']/BaseUnit")
    assert base is not None and base.attrib == {"K": "1", "offset": "273.15"}
