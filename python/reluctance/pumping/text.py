"""Key figures of pumping as people read them."""

import math

import pandas as pd

CAUSES = {  # one name for one loss, in tables and figures
    "off_mpp": "off the maximum power point",
    "converter": "dc-dc converter",
    "below_threshold": "too little power to lift water",
    "above_limit": "speed, torque, voltage or well limit",
    "drive": "drive and motor",
    "friction": "motor friction",
    "pump": "pump",
    "pipe": "pipe",
}
LABELS = {
    "water_m3": ("water pumped", "m³"),
    "water_m3_per_day": ("water a day", "m³"),
    "water_m3_per_kWp": ("water per nominal power", "m³/kWp"),
    "pumping_h": ("pumping", "h"),
    "days": ("days", ""),
    "array_kWp": ("array", "kWp"),
    "poa_kWh_m2": ("insolation on the array's plane", "kWh/m²"),
    "e_mp_kWh": ("energy at the maximum power point", "kWh"),
    "lost_off_mpp_kWh": (f"  lost: {CAUSES['off_mpp']}", "kWh"),
    "lost_converter_kWh": (f"  lost: {CAUSES['converter']}", "kWh"),
    "lost_below_threshold_kWh": (f"  unused: {CAUSES['below_threshold']}", "kWh"),
    "lost_above_limit_kWh": (f"  unused: {CAUSES['above_limit']}", "kWh"),
    "e_in_kWh": ("energy drawn by the drive", "kWh"),
    "e_shaft_kWh": ("energy into the pump", "kWh"),
    "e_lift_kWh": ("energy of the water lifted", "kWh"),
    "used_of_mp": ("drawn, of the maximum power point", "%"),
    "eta_motor": ("efficiency of drive and motor", "%"),
    "eta_pump": ("efficiency of the pump", "%"),
    "eta": ("efficiency, array to water", "%"),
    "speed_max_rpm": ("largest speed", "rpm"),
    "Q_max_m3ph": ("largest flow", "m³/h"),
    "u_oc_max_V": ("greatest open-circuit voltage", "V"),
    "u_oc_cold_V": ("open-circuit voltage, full sun, coldest cell", "V"),
    "temp_cold_degC": ("  coldest cell ([limits] temp_cold_degC)", "degC"),
    "u_mp_hot_V": ("operating voltage, hottest cells", "V"),
    "limited_h": ("at a limit", "h"),
    "limited_speed_h": ("  of the speed", "h"),
    "limited_torque_h": ("  of the torque", "h"),
    "limited_voltage_h": ("  of the torque at this voltage", "h"),
    "limited_well_h": ("  of the well", "h"),
    "demand_m3": ("demand", "m³"),
    "missing_m3": ("missing water", "m³"),
    "overflow_m3": ("overflow of the tank", "m³"),
    "level_start_m3": ("water in the tank at the start", "m³"),
    "level_end_m3": ("water in the tank at the end", "m³"),
    "loss_of_load_probability": ("loss of load probability", "%"),
}


SHOWN_IF = {key for key in LABELS if key.startswith("limited_") and key != "limited_h"}


SIZE_HEADS = {  # the table of two varied values fits a terminal of 80 columns
    "array_kWp": "kWp",
    "water_m3": "water\nm3",
    "water_m3_per_kWp": "m3/kWp",
    "pumping_h": "hours",
    "used_of_mp": "% of\nmax.\npower",  # drawn, of the energy at the maximum power point
    "eta": "efficiency\n%",
    "loss_of_load_probability": "loss of\nload %",
}


def size_table(table: pd.DataFrame, varied: list[str], best: int | None) -> list[str]:
    """The rows of `sizes` under short heads; the best is marked, and why a size cannot work is
    told below by numbers."""
    why = list(dict.fromkeys(text for text in table["why"] if text))
    shown = {name.replace(".", ".\n"): table[name] for name in varied}
    shown |= {h: scale(h) * table[key] for key, h in SIZE_HEADS.items() if key in table}
    columns = [[*head.splitlines(), *map(number, values)] for head, values in shown.items()]
    marks = [
        f"[{why.index(text) + 1}]" if text else "*" if row == best else ""
        for row, text in table["why"].items()
    ]
    height = max(map(len, columns))
    columns = [[""] * (height - len(column)) + column for column in columns]
    marks = [""] * (height - len(marks)) + marks
    widths = [max(map(len, column)) for column in columns]
    lines = [
        " ".join(cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
        for cells in zip(*columns, strict=True)
    ]
    lines = [f"{a} {b}".rstrip() for a, b in zip(lines, marks, strict=True)]
    return [*lines, *(f"[{k}] {line}" for k, line in enumerate(why, 1))]


def scale(head: str) -> float:
    """From a figure to its value under a head or a unit: ratios are shown in percent."""
    return 100.0 if "%" in head else 1.0


def number(value: float) -> str:
    """Four digits, and no exponent."""
    if math.isnan(value):
        return "-"
    return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:.4g}"


def rows(figures: dict[str, float | None]) -> list[tuple[str, str]]:
    """Label and value of what there is."""
    found = []
    for key, (label, unit) in LABELS.items():
        value = figures[key]
        if value is not None and (value or key not in SHOWN_IF):
            found.append((label, f"{number(scale(unit) * value)} {unit}".rstrip()))
    return found
