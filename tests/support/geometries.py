"""A good geometry file, with changes, and a drive of its machine."""

import json
from copy import deepcopy

from reluctance.base.resources import resources
from reluctance.base.schema import checked
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.library import flattened

GEOMETRIES = sorted((resources("machines") / "geometry").glob("*.toml"))
COARSE = Grid(cell=3.0, growth=1.5, yoke=2)
GOOD = {
    "machine": {"stator_poles": 6, "rotor_poles": 4, "phases": 3},
    "lamination": {"stack_length_mm": 50.0, "steel": "M400-50A"},
    "stator": {
        "outer_diameter_mm": 110.0,
        "bore_diameter_mm": 56.0,
        "pole_arc_deg": 30.0,
        "pole_height_mm": 16.0,
    },
    "rotor": {"pole_arc_deg": 32.0, "pole_height_mm": 9.0, "shaft_diameter_mm": 14.0},
    "air_gap": {"length_mm": 0.3},
    "winding": {"turns_per_pole": 90},
    "map": {"current_max_A": 15.0, "angles": 17, "currents": 10},
}


def changed(**changes):
    """The good file with section__key = value; None takes the key out."""
    data = deepcopy(GOOD)
    for name, value in changes.items():
        section, key = name.split("__")
        data[section].pop(key, None)
        if value is not None:
            data[section][key] = value
    return data


def write(path, data):
    lines = []
    for section, values in data.items():
        lines += [f"[{section}]", *(f"{k} = {json.dumps(v)}" for k, v in values.items())]
    path.write_text("\n".join(lines) + "\n")
    return path


def geometry(**changes):
    table = flattened(changed(**changes))
    del table["model"]
    return checked(Geometry, table, "[machine]")


def drive(machine, law="angles", **control):
    """Tables of a drive at a held speed."""
    return {
        "machine": machine,
        "converter": {"u_dc_V": 150},
        "load": {"kind": "locked", "speed_rpm": 700},
        "reference": {"kind": "torque", "tau_Nm": 1.5},
        "control": {"law": law, "T_s_us": 25, **control},
        "simulation": {"until_s": 0.06},
    }


def drive_file(folder, machine, **control):
    """A file of such a drive, of a machine that is a file."""
    path = write(folder / "d.toml", drive({}, **control))
    path.write_text(f'machine = "{machine}"\n' + path.read_text().replace("[machine]\n", ""))
    return path
