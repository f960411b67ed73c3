"""`reluctance machines`: the machine library."""

import json

from reluctance.cli.options import AsJson
from reluctance.drive.library import entries


def machines(as_json: AsJson = False) -> None:
    """List the machine library."""
    found = entries()
    if as_json:
        print(json.dumps([entry.with_units() for entry in found]))
        return
    for entry in found:
        m = entry.machine
        print(f"{entry.key}: {m.name}")
        torque = f"{entry.tau_peak:.3g} N m static from one phase at {m.i_max_A:g} A"
        print(f"  model {m.model}, {torque}")
        print(f"  source: {m.source}")
        print(f"  licence: {m.licence}")
