"""modelDescription.xml of a functional mock-up unit, for FMI 2.0 and 3.0."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

from reluctance.targets.export.fmu_variables import Part, Variable

UNITS: dict[str, dict[str, int]] = {  # exponents of SI base units
    "A": {"A": 1},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "V.A": {"kg": 1, "m": 2, "s": -3},
    "Wb": {"kg": 1, "m": 2, "s": -2, "A": -1},
    "H": {"kg": 1, "m": 2, "s": -2, "A": -2},
    "F": {"kg": -1, "m": -2, "s": 4, "A": 2},
    "Ohm": {"kg": 1, "m": 2, "s": -3, "A": -2},
    "N.m": {"kg": 1, "m": 2, "s": -2},
    "N.m.s": {"kg": 1, "m": 2, "s": -1},
    "N2.m2.s": {"kg": 2, "m": 4, "s": -3},
    "A.s": {"A": 1, "s": 1},
    "A2.s": {"A": 2, "s": 1},
    "J": {"kg": 1, "m": 2, "s": -2},
    "kg.m2": {"kg": 1, "m": 2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "s": {"s": 1},
    "m": {"m": 1},
    "W/m2": {"kg": 1, "s": -3},
    "degC": {"K": 1},
}
FLAGS = 'canHandleVariableCommunicationStepSize="true" canBeInstantiatedOnlyOncePerProcess="false"'


def description(
    version: int,
    name: str,
    token: str,
    found: list[Variable],
    *,
    part: Part,
    text: str,
    until: float,
    step: float,
) -> str:
    """The XML. name: of the model; token: GUID or instantiation token; text: what it is."""
    units = sorted({v.unit for v in found if v.unit})
    shared = "\n".join(
        [
            f"  {_units(units)}",
            f'  <DefaultExperiment startTime="0" stopTime="{until!r}" stepSize="{step!r}"/>',
        ]
    )
    head = '<?xml version="1.0" encoding="UTF-8"?>\n'
    about = (
        f'modelName={quoteattr(name)} description={quoteattr(text)} generationTool="reluctance" '
        'variableNamingConvention="structured" license="Apache-2.0"'
    )
    if version == 2:
        return head + "\n".join(
            [
                f'<fmiModelDescription fmiVersion="2.0" guid={quoteattr(token)} {about}>',
                f'  <CoSimulation modelIdentifier="{name}" {FLAGS} canGetAndSetFMUstate="true" '
                'canSerializeFMUstate="true">',
                f'    <SourceFiles><File name="{name}.cpp"/></SourceFiles>',
                "  </CoSimulation>",
                shared,
                "  <ModelVariables>",
                *(_variable_2(v) for v in found),
                "  </ModelVariables>",
                f"  <ModelStructure>{_structure_2(found)}</ModelStructure>",
                "</fmiModelDescription>\n",
            ]
        )
    return head + "\n".join(
        [
            f'<fmiModelDescription fmiVersion="3.0" instantiationToken={quoteattr(token)} {about}>',
            f'  <CoSimulation modelIdentifier="{name}" {FLAGS} canGetAndSetFMUState="true" '
            'canSerializeFMUState="true"/>',
            shared,
            "  <ModelVariables>",
            '    <Float64 name="time" valueReference="0" causality="independent" '
            'variability="continuous" unit="s"/>',
            *(_variable_3(v) for v in found),
            "  </ModelVariables>",
            f"  <ModelStructure>{_structure_3(found)}</ModelStructure>",
            "</fmiModelDescription>\n",
        ]
    )


def _units(names: list[str]) -> str:
    found = []
    for name in sorted({*names, "s"}):
        base = " ".join(f'{unit}="{power}"' for unit, power in UNITS[name].items())
        offset = ' offset="273.15"' if name == "degC" else ""
        found.append(f'<Unit name="{name}"><BaseUnit {base}{offset}/></Unit>')
    return f"<UnitDefinitions>{''.join(found)}</UnitDefinitions>"


def _common(v: Variable) -> str:
    told = f" description={quoteattr(v.description)}" if v.description else ""
    return (
        f'name={quoteattr(v.name)} valueReference="{v.reference}"{told} '
        f'causality="{v.causality}" variability="{v.variability}"'
    )


def _type(v: Variable) -> str:
    unit = f' unit="{v.unit}"' if v.unit and not v.integer else ""
    value = "" if v.start is None else repr(int(v.start) if v.integer else v.start)
    return unit + (f' start="{value}"' if value else "")


def _variable_2(v: Variable) -> str:
    initial = {"parameter": ' initial="exact"', "output": ' initial="calculated"'}
    kind = "Integer" if v.integer else "Real"
    return (
        f"    <ScalarVariable {_common(v)}{initial.get(v.causality, '')}>"
        f"<{kind}{_type(v)}/></ScalarVariable>"
    )


def _variable_3(v: Variable) -> str:
    return f"    <{'Int32' if v.integer else 'Float64'} {_common(v)}{_type(v)}/>"


def _structure_2(found: list[Variable]) -> str:
    unknowns = "".join(
        f'<Unknown index="{j}"/>' for j, v in enumerate(found, 1) if v.causality == "output"
    )
    return f"<Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns>"


def _structure_3(found: list[Variable]) -> str:
    outputs = [v.reference for v in found if v.causality == "output"]
    return "".join(
        f'<{kind} valueReference="{r}"/>' for kind in ("Output", "InitialUnknown") for r in outputs
    )
