"""The geometry file: tables with units in their keys, and what makes a cross-section impossible."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from math import asin, ceil, degrees, floor, gcd, log10, pi, radians, sin
from typing import Literal

from pydantic import Field, model_validator
from scipy.constants import mu_0

from reluctance.base.schema import Section
from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.steel_file import SteelName
from reluctance.machine.geometry.winding import Coil, Winding

MM = 1e-3

# Iron saturates near 2 T. Ampere-turns of a pole that would drive this many tesla over its gap on
# top of this field over the iron are so far beyond that the map would consist of air: a slip of
# units or turns, not a machine. The curves of the library end at this field.
GAP_FIELD_MOST = 32.0  # [T]
IRON_FIELD_MOST = 2e5  # [A/m]
LEAST_GAP = 1 / 2000  # of the bore diameter: 0.5 mm at a metre, half of what is built
ROUNDING = 1e-8  # of a limit that a message names with its digits
LEAST_OUTER = 5.0  # no stamped lamination is smaller [mm]
LEAST_STACK = 1 / 50  # of the bore diameter; machines have 0.3 to 3
LEAST_ARC = 0.1  # of a pole pitch; machines have 0.3 to 0.55
MOST_PHASES = 6
CLEARANCE = 1e-6  # below which parts touch [m]


class Lamination(Section):
    """[lamination]"""

    stack_length_mm: float = Field(gt=0)
    stacking_factor: float = Field(0.97, gt=0.5, le=1)  # share of steel in the stack
    steel: SteelName  # a grade of the library, or a B-H file
    saturation_polarisation_T: float | None = Field(None, gt=1)


class Stator(Section):
    """[stator]"""

    outer_diameter_mm: float = Field(gt=0)
    bore_diameter_mm: float = Field(gt=0)
    pole_arc_deg: float = Field(gt=0)  # at the bore
    pole_height_mm: float = Field(gt=0)  # from bore to slot floor
    pole_face: Literal["arc", "flat"] = "arc"


class Rotor(Section):
    """[rotor]"""

    pole_arc_deg: float = Field(gt=0)
    pole_height_mm: float = Field(gt=0)
    shaft_diameter_mm: float = Field(gt=0)


class Gap(Section):
    """[air_gap]"""

    length_mm: float = Field(gt=0)


class Coils(Section):
    """[winding]"""

    turns_per_pole: int = Field(gt=0)
    parallel_paths: int = Field(1, gt=0)
    polarity: str | None = Field(None, pattern="^[NS]+$")  # of poles 1, 2, ...; None: by sectors
    slot_fill: float = Field(0.4, gt=0, le=0.8)  # copper over the area of the coil sides
    temperature_degC: float = Field(20.0, gt=-200, le=300)
    end_winding: Literal["auto"] | float = "auto"  # inductance of a phase [mH]
    coil_width_mm: float | None = Field(None, gt=0)  # None: half of the slot
    coil_height_mm: float | None = Field(None, gt=0)
    coil_to_pole_mm: float = Field(0.0, ge=0)
    coil_to_bore_mm: float = Field(0.0, ge=0)


class MapGrid(Section):
    """[map]"""

    current_max_A: float = Field(gt=0)
    angles: int = Field(31, ge=13, le=181)  # from unaligned to aligned
    currents: int = Field(20, ge=6, le=100)  # above zero
    coupling: Literal["none", "pairs"] = "none"
    pair_rank: int | None = Field(None, ge=1, le=8)  # functions of one current; None: by tolerance


class Geometry(Section):
    """A geometry file, the keys of its [machine] first."""

    name: str = ""
    source: str = "own design"
    licence: str = "not stated"
    assumed: str = ""
    stator_poles: int = Field(ge=4, le=96)
    rotor_poles: int = Field(ge=2, le=96)
    phases: int = Field(ge=2, le=MOST_PHASES)
    i_max_A: float | None = Field(None, gt=0)  # current limit of the drive; None: current_max_A
    J_kgm2: float | None = Field(None, gt=0)  # None: computed
    R_ohm: float | None = Field(None, ge=0)  # None: computed
    B_Nms: float = Field(0.0, ge=0)
    temp_w_degC: float | None = Field(None, gt=-200, le=300)  # of the run; None: temperature_degC
    lamination: Lamination
    stator: Stator
    rotor: Rotor
    air_gap: Gap
    winding: Coils
    map: MapGrid

    @model_validator(mode="after")
    def is_a_machine(self) -> Geometry:
        _check_phases(self)
        _check_sizes(self)
        _check_coil(self)
        _check_polarity(self)
        _check_map(self)
        return self

    @property
    def cross_section(self) -> CrossSection:
        """Dimensions in SI."""
        s, r = self.stator, self.rotor
        return CrossSection(
            N_s=self.stator_poles,
            N_r=self.rotor_poles,
            r_shaft=r.shaft_diameter_mm / 2 * MM,
            r_rotor=(s.bore_diameter_mm / 2 - self.air_gap.length_mm) * MM,
            r_bore=s.bore_diameter_mm / 2 * MM,
            r_out=s.outer_diameter_mm / 2 * MM,
            beta_s=radians(s.pole_arc_deg),
            beta_r=radians(r.pole_arc_deg),
            h_s=s.pole_height_mm * MM,
            h_r=r.pole_height_mm * MM,
            flat_face=s.pole_face == "flat",
        )

    @property
    def coils(self) -> Winding:
        """The winding in SI."""
        w, section = self.winding, self.cross_section
        coil = None
        if w.coil_width_mm is not None and w.coil_height_mm is not None:
            coil = Coil(
                from_middle=section.half_width_s + w.coil_to_pole_mm * MM,
                width=w.coil_width_mm * MM,
                r_inner=section.r_bore + w.coil_to_bore_mm * MM,
                height=w.coil_height_mm * MM,
            )
        return Winding(
            n_phases=self.phases,
            polarity=tuple(1 if letter == "N" else -1 for letter in self.polarity),
            turns=w.turns_per_pole,
            parallel_paths=w.parallel_paths,
            coil=coil,
        )

    @property
    def polarity(self) -> str:
        """Of all stator poles, N or S: reversed from each sector that repeats to the next."""
        if self.winding.polarity is not None:
            return self.winding.polarity
        sectors = gcd(self.stator_poles, self.rotor_poles)
        each = self.stator_poles // sectors
        return "".join("NS"[n % 2] * each for n in range(sectors))


def _check_phases(g: Geometry) -> None:
    phases = g.stator_poles // gcd(g.stator_poles, g.rotor_poles)
    if phases != g.phases:
        raise ValueError(
            f"phases = {g.phases}, but {g.stator_poles}/{g.rotor_poles} poles make {phases}; set "
            "phases or the poles"
        )
    if g.stator_poles // phases % 2:
        other = "/".join(map(str, _near_poles(g.stator_poles, g.rotor_poles)))
        raise ValueError(
            f"stator_poles = {g.stator_poles} and rotor_poles = {g.rotor_poles} leave "
            f"{g.stator_poles // phases} to a phase, need an even number, half of them N and half "
            f"S, or the flux has no way back; the next poles that do are {other}"
        )


def _near_poles(n_s: int, n_r: int) -> tuple[int, int]:
    """The poles next to these whose phases have as many N as S."""
    near = range(-MOST_PHASES, MOST_PHASES + 1)
    ways = [(n_s + a, n_r + b) for a in near for b in near if n_s + a >= 4 and n_r + b >= 2]
    fits = [(s, r) for s, r in ways if gcd(s, r) % 2 == 0 and 2 <= s // gcd(s, r) <= MOST_PHASES]
    return min(fits, key=lambda way: (abs(way[0] - n_s), abs(way[1] - n_r)))


def _check_sizes(g: Geometry) -> None:
    s, bore = g.cross_section, g.stator.bore_diameter_mm
    if s.gap > 0.5 * s.r_bore:
        raise ValueError(
            f"air_gap.length_mm = {g.air_gap.length_mm:g} is over a quarter of "
            f"stator.bore_diameter_mm = {bore:g}; check the units of both (millimetres)"
        )
    if g.air_gap.length_mm < (1 - ROUNDING) * LEAST_GAP * bore:
        raise ValueError(
            f"air_gap.length_mm = {g.air_gap.length_mm:g}, need at least "
            f"{_three_digits(LEAST_GAP * bore, ceil):g}, 1/2000 of the bore; check its unit "
            "(millimetres)"
        )
    if g.lamination.stack_length_mm < (1 - ROUNDING) * LEAST_STACK * bore:
        raise ValueError(
            f"lamination.stack_length_mm = {g.lamination.stack_length_mm:g}, need at least "
            f"{_three_digits(LEAST_STACK * bore, ceil):g}, 1/50 of the bore; check its unit "
            "(millimetres)"
        )
    for side, height in (("stator", s.h_s), ("rotor", s.h_r)):
        if height < s.gap:
            raise ValueError(
                f"{side}.pole_height_mm = {height / MM:g}, need at least the air gap, "
                f"{s.gap / MM:.3g}; check its unit (millimetres)"
            )
    if s.r_bore >= s.r_out - CLEARANCE:
        raise ValueError(
            f"stator.outer_diameter_mm = {g.stator.outer_diameter_mm:g}, need more than "
            f"bore_diameter_mm = {bore:g}; check the units of both (millimetres)"
        )
    if g.stator.outer_diameter_mm < LEAST_OUTER:
        raise ValueError(
            f"stator.outer_diameter_mm = {g.stator.outer_diameter_mm:g}, need at least "
            f"{LEAST_OUTER:g}; check the units of all lengths (millimetres)"
        )
    if s.r_slot_s >= s.r_out - CLEARANCE:
        raise ValueError(
            f"stator.pole_height_mm = {g.stator.pole_height_mm:g} leaves no yoke: need less than "
            f"{(s.r_out - s.r_bore) / MM:.4g}; "
            + _for_a_yoke(s.r_out - s.r_bore, s.half_width_s, "raise stator.outer_diameter_mm")
        )
    if s.r_rotor <= s.r_shaft + CLEARANCE:
        raise ValueError(
            f"rotor.shaft_diameter_mm = {g.rotor.shaft_diameter_mm:g} leaves no rotor within "
            f"stator.bore_diameter_mm = {bore:g}; check both, and air_gap.length_mm"
        )
    if s.r_slot_r <= s.r_shaft + CLEARANCE:
        raise ValueError(
            f"rotor.pole_height_mm = {g.rotor.pole_height_mm:g} leaves no yoke: need less than "
            f"{(s.r_rotor - s.r_shaft) / MM:.4g}; "
            + _for_a_yoke(s.r_rotor - s.r_shaft, s.half_width_r, "lower the shaft diameter")
        )
    for side, arc, n, reach in (
        ("stator", g.stator.pole_arc_deg, s.N_s, 1.0),
        ("rotor", g.rotor.pole_arc_deg, s.N_r, s.r_slot_r / s.r_rotor),
    ):
        # Parallel sides: a pole of the rotor is widest in angle at its root.
        most = degrees(2 * asin(min(1.0, reach * sin(pi / n))))
        if arc < LEAST_ARC * 360 / n:
            raise ValueError(
                f"{side}.pole_arc_deg = {arc:g}, need at least {LEAST_ARC * 360 / n:.3g} for {n} "
                f"poles; check its unit ({arc:g} rad are {degrees(arc):.4g} deg)"
            )
        if arc >= most:
            raise ValueError(
                f"{side}.pole_arc_deg = {arc:g}: neighbouring poles overlap, need less than "
                f"{most:.4g} for {n} poles; lower the arc or the number of poles"
            )


def _for_a_yoke(room: float, half_width: float, other: str) -> str:
    """The remedy with a yoke that takes the flux of a pole: half as thick as the pole is wide."""
    if room - half_width < room / 4:  # short poles are no machine either
        return other
    height = _three_digits((room - half_width) / MM, floor)
    return f"at {height:g} the yoke is half as thick as a pole is wide; or {other}"


def _check_coil(g: Geometry) -> None:
    w = g.winding
    if (w.coil_width_mm is None) != (w.coil_height_mm is None):
        raise ValueError("winding.coil_width_mm and coil_height_mm go together; set both or none")
    coil, s = g.coils.coil, g.cross_section
    if coil is None:
        if w.coil_to_pole_mm or w.coil_to_bore_mm:
            raise ValueError(
                "winding.coil_to_pole_mm and coil_to_bore_mm place a coil of stated size; set "
                "coil_width_mm and coil_height_mm too"
            )
        return
    top = coil.r_inner + coil.height
    far = coil.from_middle + coil.width
    # The narrowest place is the inner corner: the middle of the slot runs along pi/N_s.
    room = coil.r_inner * sin(pi / s.N_s) / abs(1 - sin(pi / s.N_s) ** 2) ** 0.5
    if far > room:
        raise ValueError(
            f"winding.coil_width_mm = {w.coil_width_mm:g} does not fit the slot: need at most "
            f"{max(room - coil.from_middle, 0) / MM:.4g} at coil_to_bore_mm = "
            f"{w.coil_to_bore_mm:g}; make the coil narrower or move it outwards"
        )
    if (top**2 + far**2) ** 0.5 > s.r_slot_s:
        most = max(s.r_slot_s**2 - far**2, 0.0) ** 0.5 - coil.r_inner
        raise ValueError(
            f"winding.coil_height_mm = {w.coil_height_mm:g} does not fit the slot: need at most "
            f"{max(most, 0) / MM:.4g}; lower it or raise stator.pole_height_mm"
        )


def _check_polarity(g: Geometry) -> None:
    polarity = g.polarity
    n = g.stator_poles
    example = "".join("NS"[k % 2] * g.phases for k in range(n // g.phases))
    if len(polarity) != n:
        raise ValueError(
            f"winding.polarity = {polarity!r} has {len(polarity)} letters, need {n}: one a stator "
            f"pole, as {example!r}"
        )
    winding = g.coils
    if not winding.balanced:
        raise ValueError(
            f"winding.polarity = {polarity!r} is no winding of this machine: each phase (every "
            f"{g.phases}th pole) needs as many N as S, or its flux has no way back; use {example!r}"
        )
    per_phase = n // g.phases
    if per_phase % winding.parallel_paths:
        raise ValueError(
            f"winding.parallel_paths = {winding.parallel_paths}, need a divisor of the {per_phase} "
            "poles of a phase"
        )


def _three_digits(value: float, way: Callable[[Decimal], int]) -> float:
    """A limit as a message has it: rounded to the side that is allowed, > 0."""
    step = Decimal(1).scaleb(floor(log10(value)) - 2)
    return float(way(Decimal(f"{value:.9g}") / step) * step)


def _check_map(g: Geometry) -> None:
    turns = g.winding.turns_per_pole / g.winding.parallel_paths
    s = g.cross_section
    iron = s.h_s + s.h_r + s.r_out - s.r_shaft  # about what a pole's flux passes [m]
    most = (GAP_FIELD_MOST * s.gap / mu_0 + IRON_FIELD_MOST * iron) / turns
    if g.map.current_max_A > (1 + ROUNDING) * most:
        raise ValueError(
            f"map.current_max_A = {g.map.current_max_A:g} is far beyond saturation with "
            f"{turns:g} turns: need at most {_three_digits(most, floor):g}, or fewer turns"
        )
    if g.map.coupling == "none" and g.map.pair_rank is not None:
        raise ValueError("map.pair_rank has no effect with coupling = 'none'; set 'pairs'")
