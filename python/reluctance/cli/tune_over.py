"""`reluctance tune --over`: conduction angles over speed and torque, as a table."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reluctance.drive.drive import Drive


def tune_over(
    drive: Drive,
    axes: Mapping[str, list[Any]],
    minimise: str | None,
    options: Mapping[str, Any],
    *,
    out: Path | None,
    plot: Path | None,
    as_json: bool,
) -> None:
    """Tunes the nodes, writes what is asked for, and prints the table."""
    from rich.console import Console
    from rich.table import Table

    from reluctance.cli.progress import progress_bar
    from reluctance.explore.tuning import tune_angles

    with progress_bar(f"tuning {drive.name}", 1.0) as told:
        found = tune_angles(drive, axes, minimise, progress=told, **options)
    if out is not None:
        found.save(out)
    if plot is not None:
        from reluctance.explore.tuning.angle_plots import (
            save,  # Matplotlib: half of the start-up time
        )

        save(found, plot)
    if as_json:
        rows = [node.row for node in found.nodes]
        print(json.dumps({"goal": str(found.goal), "trials": found.tried, "nodes": rows}))
        return
    print(f"{found.goal}: {found.tried} trials, {found.ran} runs made now")
    table = Table()
    figure = found.goal.figure
    for name in ("speed_rpm", "torque_Nm", "theta_on_deg", "theta_off_deg", figure):
        table.add_column(name, justify="right")
    for node in found.nodes:
        value = node.figures.get(figure)
        angles = (f"{node.theta_on_deg:.1f}", f"{node.theta_off_deg:.1f}")
        shown = "" if value is None else f"{value:.4g}"
        table.add_row(f"{node.speed_rpm:g}", f"{node.torque_Nm:g}", *angles, shown)
    Console().print(table)
    for node in found.nodes:
        if node.note:
            print(f"{node.speed_rpm:g} rpm, {node.torque_Nm:g} N m: {node.note}")
    for path in (out, plot):
        if path is not None:
            print(path)
