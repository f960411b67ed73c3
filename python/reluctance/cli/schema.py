"""`reluctance schema`: the JSON schema of drive files, with which an editor completes keys."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic.json_schema import models_json_schema

from reluctance.base.files import check_ending, write_text
from reluctance.base.schema import Section
from reluctance.drive.all_tables import OPTIONAL, TABLES
from reluctance.drive.laws import LAWS, table_of
from reluctance.drive.laws.own_law import OwnLaw
from reluctance.machine.library import model_class
from reluctance.machine.models import MODELS


def json_schema() -> dict[str, Any]:
    """The schema, made from the tables that check a drive file."""
    machines = [model_class(model).filed() for model in MODELS]
    tables: list[type[Section]] = [*TABLES.values(), *machines, *map(table_of, LAWS), OwnLaw]
    places, below = models_json_schema([(table, "validation") for table in tables])

    def place(table: type[Section]) -> dict[str, Any]:
        return places[table, "validation"]

    law = below["$defs"]["OwnLaw"]["properties"]["law"]
    law["pattern"] = "^python:"
    geometry = below["$defs"]["Geometry"]  # in a drive file a table like the other models
    geometry["properties"]["model"] = {"const": "geometry"}
    geometry["required"].append("model")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Drive file of reluctance",
        "type": "object",
        "additionalProperties": False,
        "required": ["machine", "control", *(name for name in TABLES if name not in OPTIONAL)],
        "properties": {
            "machine": {
                "description": "name from the library, path to a machine file, or a table",
                "anyOf": [{"type": "string"}, *map(place, machines)],
            },
            "control": {"anyOf": [*(place(table_of(law)) for law in LAWS), place(OwnLaw)]},
            **{name: place(table) for name, table in TABLES.items()},
        },
        **below,
    }


def schema(
    out: Annotated[
        Path | None, typer.Option(metavar="FILE.json", help="Write it there instead.")
    ] = None,
) -> None:
    """Print the JSON schema of drive files, for an editor."""
    text = json.dumps(json_schema(), indent=1)
    if out is None:
        print(text)
        return
    check_ending(out, {".json"})
    write_text(out, text + "\n")
    print(f"first line of a drive file: #:schema {out}")
