"""Random command lines with the files that they name."""

import random

from fuzz_drives import (
    EXAMPLES,
    KEYS,
    MACHINES,
    NUMBERS,
    SCHEMA,
    TEXTS,
    any_value,
    change,
    damaged,
    drive_data,
    inline,
    of_schema,
    toml,
)

from reluctance.base.resources import resources

STEPS = 3000  # a run is cut to about so many: its length is no part of the question
GUIDED = {"edge_mpc", "paper_mpc", "deadbeat", "torque_sharing", "ditc", "finite_set_mpc"}


def until(data):
    """An end of the run that keeps it short, or None where its numbers say nothing."""
    steps = []
    for section, key, usual in (("control", "T_s_us", 20.0), ("simulation", "dt_max_us", 20.0)):
        table = data.get(section)
        value = table.get(key, usual) if isinstance(table, dict) else usual
        if isinstance(value, int | float) and 0 < value < 1e9:
            steps.append(value)
    return STEPS * min(steps, default=1.0) * 1e-6


def is_short(data):
    """True where the file's own end of the run is one that need not be cut."""
    simulation = data.get("simulation")
    end = simulation.get("until_s") if isinstance(simulation, dict) else None
    return not (isinstance(end, int | float) and end > 0.3)


def case(seed, folder):
    """The command line of a case; its files are made in the folder."""
    r = random.Random(seed)
    kind = r.random()
    if kind < 0.06:
        return other_command(r, folder)
    if kind < 0.14:
        return map_command(r, folder)
    data = drive_data(r)
    control = data.get("control")
    guided = isinstance(control, dict) and str(control.get("law")) in GUIDED
    if guided and r.random() < 0.93:  # their tables take seconds to compute
        data["control"] = {"law": "angles", "T_s_us": control.get("T_s_us", 20)}
        if r.random() < 0.5:
            change(r, data)
    content = toml(data).encode("utf-8", "surrogatepass")
    if r.random() < 0.1:
        content = damaged(r, content)
    name = r.choice(
        ["drive.toml"] * 12 + ["[red].toml", "a{b}.toml", "$x$.toml", "x", "é &<b>.toml"]
    )
    (folder / name).write_bytes(content)
    command = "run" if r.random() < 0.97 else r.choice(["limit", "export firmware"])
    given = [*command.split(), str(folder / name)]
    if command == "run":
        own = r.random() >= 0.97 and is_short(data)
        given += [] if own else ["--until", repr(until(data))]
        given += options(r, folder)
    elif command != "limit":
        given += ["--out", str(folder / "firmware")]
    for _ in range(r.choice([0, 0, 0, 1, 2])):
        given += ["--set", override(r)]
    return mangled(r, given) if r.random() < 0.05 else given


def override(r):
    section = r.choice([*SCHEMA["properties"], *KEYS])
    table = SCHEMA["properties"].get(section, {})
    node = SCHEMA["$defs"].get(table.get("$ref", "").rsplit("/", 1)[-1], {})
    key = r.choice([*node.get("properties", KEYS)])
    value = r.choice(
        [
            any_value(r),
            of_schema(r, node["properties"][key]) if key in node.get("properties", {}) else 1,
        ]
    )
    return r.choice(
        [
            f"{section}.{key}={inline(value) if value is not None else ''}",
            f"{section}={value}",
            f"{section}.{key}",
            "",
            "=",
            ".",
        ]
    )


def options(r, folder):
    """Options of `run`, mostly few."""
    found = []
    if r.random() < 0.15:
        found.append("--json")
    if r.random() < 0.06:
        name = r.choice(
            [
                "w.csv",
                "w.npz",
                "w.mat",
                "w",
                "no/w.csv",
                ".csv",
                "w.xls",
                "a\x00.csv",
                "b" * 300 + ".csv",
            ]
        )
        found += ["--out", str(folder / name)]
    if r.random() < 0.02:
        found += ["--plot", str(folder / r.choice(["p.svg", "p.html", "p.png", "p.txt", "/p.png"]))]
    if r.random() < 0.05:
        found += ["--record-us", str(r.choice(NUMBERS))]
    if r.random() < 0.03:
        found += ["--until", str(r.choice([0, -1, 1e-30, 1e-7, 1e9, 1e300, "nan", "inf", "x", ""]))]
    return found


def mangled(r, given):
    """A command line with a word too many, too few, or wrong."""
    given = list(given)
    place = r.randrange(len(given) + 1)
    kind = r.random()
    if kind < 0.4:
        given.insert(place, r.choice([*TEXTS, "--help", "--json", "--nope", "-x", "--until"]))
    elif kind < 0.7 and given:
        del given[min(place, len(given) - 1)]
    else:
        r.shuffle(given)
    return given


def other_command(r, folder):
    given = r.choice(
        [
            [],
            ["machines", r.choice([*MACHINES, *TEXTS])],
            ["examples", r.choice([*EXAMPLES, *TEXTS])],
            ["examples", "--copy", str(folder / "made")],
            ["schema"],
            ["map"],
            ["export", "firmware", str(folder)],
            [r.choice(["run", "limit", "compare", "map", "paper"]), "--help"],
            ["run", r.choice(TEXTS)],
            ["limit", "/dev/null"],
            ["map", "check", r.choice(TEXTS)],
        ]
    )
    return mangled(r, given) if r.random() < 0.5 else given


def map_command(r, folder):
    """A flux map, read from a library's file with changes, or made up."""
    source = r.choice(sorted(resources("machines").glob("*.csv")))
    if r.random() < 0.7:
        lines = [x for x in source.read_text().splitlines() if not x.startswith("#")]
        content = "\n".join(lines[: r.choice([3, 50, 400])]).encode()
        content = damaged(r, content) if r.random() < 0.8 else content
    else:
        cells = [[str(r.choice(NUMBERS[:12])) for _ in range(5)] for _ in range(6)]
        content = "\n".join(r.choice([",", ";", "\t", " "]).join(row) for row in cells).encode()
    path = (
        folder / f"map.{r.choice(['csv', 'csv', 'csv', 'txt', 'json', 'mat', 'xlsx', 'dat', 'x'])}"
    )
    path.write_bytes(content)
    given = ["map", r.choice(["check", "check", "fit"]), str(path)]
    for option, values in (
        ("--N_r", [4, 6, 0, -1, 10**9]),
        ("--angle_unit", ["deg", "rad", "x"]),
        ("--angle_kind", ["mechanical", "electrical"]),
        ("--zero", ["aligned", "unaligned", "0"]),
        ("--aligned_at", [0, 45, "nan", 1e300, -1e-300]),
        ("--layout", ["currents_down", "angles_down"]),
        ("--turns_factor", [1, 2, 0, "nan", "inf", 1e300]),
        ("--name", ["i=1", "psi=2", "theta=x", "=", "tau="]),
    ):
        if r.random() < (0.9 if option == "--N_r" else 0.12):
            given += [option, str(r.choice(values))]
    return given
