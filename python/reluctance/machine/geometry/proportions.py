"""Proportions of a cross-section that no machine has: a length in another unit than the others."""

from __future__ import annotations

from collections.abc import Iterator

from reluctance.machine.geometry.file import Geometry

# Usual proportions, wide: machines of the library have air gaps of 1/133 to 1/320 of the bore,
# stacks of 0.6 to 1.1 of it, bores of 0.48 to 0.67 of the outer diameter, poles of the stator of
# 0.60 to 0.71 of the room between the two, poles of the rotor of 0.19 to 0.52 of its radius, shafts
# of 0.20 to 0.56 of the bore. A length in cm is a tenth of what it should be.
LEAST_BUILT = 0.1  # air gap [mm]
UNITS = {"cm": 10.0, "inches": 25.4, "m": 1000.0}  # [mm]


def questions(g: Geometry) -> list[str]:
    """What to ask of lengths that fit none of the others."""
    odd = list(_odd(g))
    if not odd and g.air_gap.length_mm < LEAST_BUILT:
        return [
            f"air_gap.length_mm = {g.air_gap.length_mm:g}, while gaps that are built begin at "
            f"{LEAST_BUILT:g}: are all lengths in millimetres?"
        ]
    return odd[:1] if odd and "bore_diameter" in odd[0] else odd


def _odd(g: Geometry) -> Iterator[str]:
    bore, outer = g.stator.bore_diameter_mm, g.stator.outer_diameter_mm
    room, radius = (outer - bore) / 2, bore / 2 - g.air_gap.length_mm
    for name, length, of, whole, least, most in (
        ("stator.bore_diameter_mm", bore, "the outer diameter", outer, 0.25, 0.95),
        ("air_gap.length_mm", g.air_gap.length_mm, "the bore", bore, 1 / 800, 1 / 20),
        ("lamination.stack_length_mm", g.lamination.stack_length_mm, "the bore", bore, 0.15, 6.0),
        (
            "stator.pole_height_mm",
            g.stator.pole_height_mm,
            "the room from bore to rim",
            room,
            0.2,
            1,
        ),
        ("rotor.pole_height_mm", g.rotor.pole_height_mm, "the rotor's radius", radius, 0.06, 1.0),
        ("rotor.shaft_diameter_mm", g.rotor.shaft_diameter_mm, "the bore", bore, 0.06, 1.0),
    ):
        part = length / whole
        if least <= part <= most:
            continue
        fits = [
            f"{unit}? Then write {length * size:.4g}"
            for unit, size in UNITS.items()
            if least <= part * size <= most
        ]
        asked = f"is it in {fits[0]}" if fits else "check its unit"
        yield (
            f"{name} = {length:g} is {part:.3g} of {of}, where machines have {least:.3g} to "
            f"{most:.3g}; {asked}"
        )
