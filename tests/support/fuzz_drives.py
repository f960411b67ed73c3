"""Random drive files: an example or tables made from the JSON schema, with changes of values, keys,
tables and bytes."""

import json
from datetime import date

from reluctance.base.toml_file import read_toml
from reluctance.cli.examples import example_files
from reluctance.cli.schema import json_schema
from reluctance.machine.library import machines

NUMBERS = [0, 0.0, -0.0, 1, -1, 2, 7, 0.5, 1e-3, 1e-6, 1e-9, 1e-30, 5e-324, 1e3, 1e6, 1e9, 1e30]
NUMBERS += [1e300, 1.7976931348623157e308, -1e9, -1e300, 2**31, 2**63 - 1, -(2**63), 10**40]
NUMBERS += [float("nan"), float("inf"), float("-inf"), 0.1, 100, 240, 1500, 3.141592653589793]
TEXTS = ["", " ", "a", "none", "lehuy", "map", "[red]x[/]", "[/]", "{x}", "$\\frac$", "%s", "../x"]
TEXTS += ["\x00", "\x1b[31m", "\n", "ä", "𝛙", "a" * 3000, "/dev/null", "/", ".", "-", "--", "nul"]
TEXTS += ["<script>", "*/ int x; /*", "python:x.py:Y", "python:", "python::", '"', "\\", "'''"]
KEYS = ["x", "until", "T_s", "t_s", "values", "kind", "law", "machine", "", "a.b", "é", "u_dc"]
EXAMPLES = {name: read_toml(path) for name, path in example_files().items()}
EXAMPLES = {name: data for name, data in EXAMPLES.items() if "control" in data}
MACHINES = [entry.key for entry in machines() if entry.machine.model == "lehuy"]
SCHEMA = json_schema()


def any_value(r, depth=0):
    """A value of any type."""
    kind = r.random()
    if kind < 0.55:
        return r.choice(NUMBERS)
    if kind < 0.75:
        return r.choice(TEXTS)
    if kind < 0.85:
        return r.random() < 0.5
    if depth > 2:
        return 10 ** r.uniform(-6, 6)
    if kind < 0.95:
        return [any_value(r, depth + 1) for _ in range(r.choice([0, 1, 2, 3, 40]))]
    return {r.choice(KEYS): any_value(r, depth + 1) for _ in range(r.randrange(3))}


def of_schema(r, node):
    """A value that a node of the schema allows, more or less."""
    if "$ref" in node:
        node = SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[1]]
    if "anyOf" in node:
        return of_schema(r, r.choice(node["anyOf"]))
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return r.choice(node["enum"])
    kind = node.get("type")
    if kind == "object":
        needed = node.get("required", [])
        return {
            key: of_schema(r, child)
            for key, child in node.get("properties", {}).items()
            if key in needed or r.random() < 0.25
        }
    if kind == "array":
        return sorted(10 ** r.uniform(-3, 3) for _ in range(r.randrange(4)))
    if kind == "number":
        return r.choice([10 ** r.uniform(-5, 4), r.uniform(0, 100), node.get("default", 1.0)])
    if kind == "integer":
        return r.choice([r.randrange(0, 20), node.get("default", 1)])
    if kind == "boolean":
        return r.random() < 0.5
    return None if kind == "null" else r.choice(TEXTS)


def drive_data(r):
    """The tables of a drive file, more or less."""
    if r.random() < 0.25:
        data = of_schema(r, SCHEMA)
        data["machine"] = r.choice([data["machine"], r.choice(MACHINES)])
    else:
        data = json.loads(json.dumps(EXAMPLES[r.choice(list(EXAMPLES))]))
        if r.random() < 0.3:
            data["machine"] = r.choice(MACHINES)
    for _ in range(r.choice([0, 0, 1, 1, 1, 2, 3, 8])):
        change(r, data)
    return data


def change(r, data):
    """One change somewhere in the tables."""
    path = [data]
    while isinstance(path[-1], dict) and path[-1] and (len(path) == 1 or r.random() < 0.7):
        key = r.choice(list(path[-1]))
        if not isinstance(path[-1][key], dict):
            break
        path.append(path[-1][key])
    table = path[-1]
    if not isinstance(table, dict) or not table:
        return
    key, kind = r.choice(list(table)), r.random()
    value = table[key]
    if kind < 0.5 and isinstance(value, int | float) and not isinstance(value, bool):
        factor = r.choice([r.uniform(0.3, 3), 10.0 ** r.randrange(-9, 10), -1, 0])
        table[key] = value * factor
    elif kind < 0.65:
        table[key] = any_value(r)
    elif kind < 0.75:
        del table[key]
    elif kind < 0.85:
        table[r.choice([*KEYS, key + "x", key[:-1], key.upper()])] = any_value(r)
    else:
        section = r.choice(list(SCHEMA["properties"]))
        data[section] = of_schema(r, SCHEMA["properties"][section])


def toml(data):
    """Tables as TOML text."""
    lines, below = [], []
    for key, value in data.items():
        name = json.dumps(str(key), ensure_ascii=False)
        if isinstance(value, dict):
            below.append((name, value))
        elif value is not None:
            lines.append(f"{name} = {inline(value)}")
    for name, table in below:
        lines.append(f"[{name}]")
        lines += [
            f"{json.dumps(str(k), ensure_ascii=False)} = {inline(v)}"
            for k, v in table.items()
            if v is not None
        ]
    return "\n".join(lines) + "\n"


def inline(value):
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, dict):
        pairs = (f"{json.dumps(str(k))} = {inline(v)}" for k, v in value.items() if v is not None)
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(inline(v) for v in value if v is not None) + "]"
    return json.dumps(value) if isinstance(value, str) else repr(value)


def damaged(r, content):
    """Bytes with some changed, cut, doubled or put in."""
    content = bytearray(content)
    for _ in range(r.choice([1, 1, 2, 5])):
        place = r.randrange(len(content) + 1)
        kind = r.random()
        if kind < 0.3 and content:
            content[place % len(content)] = r.randrange(256)
        elif kind < 0.5:
            del content[place : place + r.choice([1, 5, 50])]
        elif kind < 0.7:
            content[place:place] = r.choice(
                [b"[", b"]", b"=", b'"', b"\n", b"e9", b"-", b"[[a]]\n"]
            )
        elif kind < 0.85:
            content[place:place] = bytes(r.randrange(256) for _ in range(r.randrange(1, 9)))
        else:
            content = content[:place]
    return bytes(content)
