"""The comparison as a table: one record a law under border names, and as people read it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from reluctance.base.key_figures import NOT_HELD
from reluctance.explore.comparison.comparison import Comparison
from reluctance.explore.comparison.conditions import conditions
from reluctance.explore.comparison.contenders import Contender, contender
from reluctance.explore.comparison.contest import Entry

Record = dict[str, Any]
NOT_COMPARABLE = "the mean torque is not held: ripple and current are those of another torque"


def records(found: Comparison) -> list[Record]:
    """One record a law; figures are absent where the law cannot work."""
    return [_record(found, entry) for entry in found.entries]


def _record(found: Comparison, entry: Entry) -> Record:
    entrant = contender(entry.name)
    record: Record = {"control": entry.name, "law": entrant.law, "met": entry.met}
    k = entry.kpis
    if k is not None:
        tau_ref = found.bound.tau_ref
        record |= {
            "f_switch_Hz": float(k.f_switch),
            "torque_ripple_pp": k.torque_ripple_pp,
            "torque_ripple_rms": k.torque_ripple_rms,
            "torque_error_rms": k.torque_error_rms,
            "torque_error_mean": float(k.tau_mean / tau_ref - 1),
            "i_rms_A": k.i_rms,
            "i_rms_over_limit": float(k.i_rms / found.bound.i_rms),
            "i_peak_A": k.i_peak,
            "i_peak_over_limit": float(k.i_peak / found.bound.i_peak),
            "p_cu_W": float(k.p_cu),
            "efficiency": k.efficiency,
            "speed_ripple_pp": entry.speed_ripple,
            "control_period_s": entry.T_s,
            "ns_per_step": found.step_time[entry.name] * 1e9,
        }
    return record | {
        "free_parameter": entrant.free.key,
        "values": entry.values,
        "needs": needs(found, entrant),
        "runs": entry.runs,
        "note": entry.note,
        "front": [
            {
                "f_switch_Hz": p.f_switch,
                "torque_error_rms": p.torque_error_rms,
                "torque_ripple_pp": p.torque_ripple_pp,
                "i_rms_A": p.i_rms,
            }
            for p in entry.front
        ],
    }


def needs(found: Comparison, entrant: Contender) -> str:
    """What a law needs beside sensors, where currents are compared as they are here."""
    if found.point.sensing.comparators == "analog":
        return entrant.needs
    return entrant.needs.replace("one current comparator per phase", "fast sampling")


def as_json(found: Comparison) -> Record:
    """Everything, under names with units."""
    return {
        "conditions": conditions(found.point),
        "f_switch_target_Hz": found.f_target,
        "limit": {
            "i_rms_A": found.bound.i_rms,
            "i_peak_A": found.bound.i_peak,
            "p_cu_W": found.bound.p_cu,
            "torque_error_max_Nm": found.bound.tau_error_max,
            "torque_error_rms_Nm": found.bound.tau_error_rms,
            "ripple_bound_rms_Nm": found.floor.bound_rms,
        },
        "controls": records(found),
    }


@dataclass(frozen=True)
class Column:
    """How a figure is shown."""

    key: str
    head: tuple[str, str]  # two lines on a terminal
    form: str  # of str.format
    scale: float = 1.0

    def cell(self, record: Record) -> str:
        value = record.get(self.key)
        return "" if value is None else self.form.format(value * self.scale)


COLUMNS = (
    Column("f_switch_Hz", ("f sw.", "kHz"), "{:.2f}", 1e-3),
    Column("torque_ripple_pp", ("ripple", "p-p %"), "{:.2f}", 100),
    Column("torque_ripple_rms", ("ripple", "rms %"), "{:.2f}", 100),
    Column("torque_error_rms", ("error", "rms %"), "{:.2f}", 100),
    Column("torque_error_mean", ("mean", "error %"), "{:+.2f}", 100),
    Column("i_rms_over_limit", ("i rms", "/ limit"), "{:.3f}"),
    Column("i_peak_over_limit", ("i peak", "/ limit"), "{:.3f}"),
    Column("p_cu_W", ("copper", "W"), "{:.0f}"),
    Column("efficiency", ("effic.", "%"), "{:.2f}", 100),
    Column("speed_ripple_pp", ("speed", "ripple %"), "{:.4f}", 100),
    Column("control_period_s", ("T_s", "us"), "{:.4g}", 1e6),
    Column("ns_per_step", ("ns /", "step"), "{:.0f}"),
)


def limit_line(found: Comparison) -> str:
    """The physical limit in a sentence."""
    b = found.bound
    error = (
        "no ripple"
        if b.tau_error_max < 1e-4 * b.tau_ref
        else f"error at least {b.tau_error_max:.3g} N m ({b.tau_error_rms:.3g} rms)"
    )
    return (
        f"least known rms current: {error} at {b.i_rms:.2f} A rms, {b.i_peak:.1f} A peak, "
        f"{b.p_cu:.0f} W copper"
    )


def tuned(record: Record) -> str:
    """The values of a law, as in its [control] table."""
    return ", ".join(f"{key} = {value:g}" for key, value in record["values"].items())


def markdown(found: Comparison) -> str:
    """The table and the tuned values as Markdown; a missed frequency is marked and explained."""
    rows = records(found)
    head = ["control", *(" ".join(c.head) for c in COLUMNS)]
    lines = [
        "| " + " | ".join(head) + " |",
        "|---|" + "---:|" * len(COLUMNS),
        *(
            "| " + " | ".join([f"`{label(r)}`" + star(r), *(c.cell(r) for c in COLUMNS)]) + " |"
            for r in rows
        ),
    ]
    mark = {True: "", False: "\\* "}
    notes = [f"{mark[r['met']]}`{label(r)}`: {r['note']}." for r in rows if r["note"]]
    notes += [f"! `{label(r)}`: {NOT_COMPARABLE}." for r in rows if star(r).endswith("!")]
    if notes:
        lines += ["", "  \n".join(notes)]
    values = [f"| `{label(r)}` | {tuned(r)} | {r['needs']} |" for r in rows]
    return "\n".join([*lines, "", "| control | tuned | needs |", "|---|---|---|", *values]) + "\n"


def plain(found: Comparison) -> list[str]:
    """The table in aligned columns, at most 110 wide, then what the misses are."""
    rows = records(found)
    cells = [[name, *(c.head[j] for c in COLUMNS)] for j, name in enumerate(("control", ""))]
    cells += [[label(r) + star(r), *(c.cell(r) for c in COLUMNS)] for r in rows]
    widths = [max(len(row[j]) for row in cells) for j in range(len(cells[0]))]
    lines = [
        " ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]) for row in cells
    ]
    notes = [f"{label(r)}{star(r)}: {r['note']}" for r in rows if r["note"]]
    notes += [f"{label(r)} !: {NOT_COMPARABLE}" for r in rows if star(r).endswith("!")]
    values = [f"{label(r)}: {tuned(r)}" for r in rows if r["values"]]
    return [*lines, *notes, "", "tuned values, for [control]:", *values]


def label(record: Record) -> str:
    return contender(record["control"]).label


def star(record: Record) -> str:
    """Marks: another switching frequency, another mean torque than asked for."""
    off = abs(record.get("torque_error_mean", 0.0)) > NOT_HELD
    return ("" if record["met"] else " *") + (" !" if off else "")


def flat(found: Comparison) -> list[Record]:
    """Records for CSV: one number or text a column, the same columns for all."""
    keys = [key for key in max(records(found), key=len) if key not in ("values", "front")]
    return [
        {key: record.get(key, np.nan) for key in keys} | {"values": tuned(record)}
        for record in records(found)
    ]
