"""The public entry: a geometry file in, a solved machine out."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from reluctance.base.errors import Note, ParameterError
from reluctance.base.figures import save_figure
from reluctance.base.picture import Picture
from reluctance.base.toml_file import read_toml
from reluctance.machine.copper import resistance_ratio
from reluctance.machine.coupling import Coupling
from reluctance.machine.geometry.coupling_of import coupling_of
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import Solution, solved, system_of
from reluctance.machine.geometry.write_geometry import write_machine
from reluctance.machine.library import flattened, is_geometry, placed_machine
from reluctance.machine.maps.surface import surface

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FAR = 5.0  # a given R or J is asked about beyond so many times the computed one, or its part
SELF_PART = 0.25  # of the time, where pairs are solved too: for the progress


@dataclass(frozen=True)
class FromGeometry:
    """A geometry and its solution.

    Attributes
    ----------
    geometry : Geometry
        The checked file.
    solution : Solution
        Flux linkage, torque and forces over current and angle; resistance, inertia, masses.
    name : str
        Of the geometry file.
    coupling : Coupling or None
        What neighbouring phases add to each other, with [map] coupling = "pairs".
    """

    geometry: Geometry
    solution: Solution
    name: str
    coupling: Coupling | None = None

    @property
    def figures(self) -> dict[str, float]:
        """What the command prints."""
        s, turns = self.solution, self.geometry.winding.turns_per_pole
        return {
            "unknowns": s.unknowns,
            "newton_steps": s.steps,
            "psi_aligned_Wb": float(s.psi[-1, -1]),
            "psi_unaligned_Wb": float(s.psi[-1, 0]),
            "tau_peak_Nm": float(s.tau[-1].max()),
            "tau_mean_Nm": float(
                np.ptp(s.coenergy[-1, [0, -1]]) * self.geometry.rotor_poles / np.pi
            ),
            "pole_force_max_N": float(s.pole_force.max()),
            "R_ohm": s.R_ohm if self.geometry.R_ohm is None else self.geometry.R_ohm,
            "L_end_H": s.L_end_H,
            "J_kgm2": s.J_kgm2 if self.geometry.J_kgm2 is None else self.geometry.J_kgm2,
            "copper_kg": s.copper_kg,
            "iron_kg": s.stator_iron_kg + s.rotor_iron_kg,
            "wire_area_mm2": 1e6 * s.wire_area_m2,
            "turns_per_pole": float(turns),
        }

    def pair_lines(self) -> list[str]:
        """What both phases of each pair give together at the largest current, as text."""
        if self.coupling is None:
            return ['one phase at a time; [map] coupling = "pairs" solves two']
        i_max, peak = self.geometry.map.current_max_A, self.figures["tau_peak_Nm"]
        lines = []
        for table in dict.fromkeys(pair.table for pair in self.coupling.pairs):
            x = table.at(np.linspace(-np.pi, np.pi, 361), i_max, i_max)
            names = " ".join(p.letters for p in self.coupling.pairs if p.table is table)
            lines.append(
                f"pairs {names}: at {i_max:g} A in both the torque differs from the sum of each "
                f"alone by {100 * float(np.sqrt((x.tau**2).mean())) / peak:.3g} % rms and up to "
                f"{100 * float(np.abs(x.tau).max()) / peak:.3g} % of the peak (rank {table.rank}, "
                f"{table.numbers} numbers)"
            )
        return lines

    def lines(self) -> list[str]:
        """The figures as text."""
        f, g, s = self.figures, self.geometry, self.solution
        i_max = g.map.current_max_A
        warm = f"{g.winding.temperature_degC:g} degC"
        R = f"R = {f['R_ohm']:.4g} ohm at {warm}"
        if g.R_ohm is not None:
            T = g.winding.temperature_degC if g.temp_w_degC is None else g.temp_w_degC
            run = g.R_ohm * resistance_ratio(T)
            R = f"R = {g.R_ohm:g} ohm as given at 20 degC, {run:.4g} ohm at {T:g} degC in the run "
            R += f"(computed: {s.R_ohm:.4g} ohm at {warm})"
        J = f"J = {f['J_kgm2']:.3g} kg m2"
        if g.J_kgm2 is not None:
            J = f"J = {g.J_kgm2:g} kg m2 as given (computed: {s.J_kgm2:.3g} kg m2)"
        return [
            f"{g.stator_poles}/{g.rotor_poles}, {g.phases} phases: {f['unknowns']:.0f} unknowns, "
            f"{g.map.angles} angles x {g.map.currents} currents",
            f"at {i_max:g} A: flux linkage {f['psi_aligned_Wb']:.4g} Wb aligned, "
            f"{f['psi_unaligned_Wb']:.4g} Wb unaligned; torque {f['tau_peak_Nm']:.4g} N m peak, "
            f"{f['tau_mean_Nm']:.4g} N m mean of one phase; radial force on a pole up to "
            f"{f['pole_force_max_N']:.3g} N",
            f"{R}, end windings {1e3 * f['L_end_H']:.3g} mH, wire {f['wire_area_mm2']:.3g} mm2 "
            "(estimates)",
            f"{J}, copper {f['copper_kg']:.3g} kg, iron {f['iron_kg']:.3g} kg",
            *self.pair_lines(),
        ]

    def save(self, out: str | Path) -> list[Path]:
        """Writes the machine file, and the flux map next to it."""
        return write_machine(
            self.geometry, self.solution, Path(out), made_of=self.name, coupling=self.coupling
        )

    def draw(self, axes: Axes, *, theta_e_deg: float = 120.0) -> Axes:
        """The cross-section, with the coils of each phase in a colour [mm]."""
        from reluctance.machine.geometry.draw import draw  # Matplotlib: half of the start-up

        system = system_of(self.geometry)
        axes.set_title(self.name, parse_math=False)
        return draw(system, axes, alpha=rotor_angle(system, np.radians(theta_e_deg)))

    def draw_field(
        self, axes: Axes, *, theta_e_deg: float = 120.0, i_A: float | None = None
    ) -> Axes:
        """|B| and field lines in the sector that is solved [mm], with a current in the phase of the
        first pole; by default half of the largest one."""
        from reluctance.machine.geometry.draw import draw_field

        system = system_of(self.geometry)
        current = self.geometry.map.current_max_A / 2 if i_A is None else i_A
        position = at_angle(system, rotor_angle(system, np.radians(theta_e_deg)))
        axes.set_title(f"{current:g} A, {theta_e_deg:g} deg el.")
        return draw_field(solve(position, current * np.eye(self.geometry.phases)[0]), axes)

    def plot(self, path: str | Path) -> None:
        """Writes the cross-section, the field, and the torque of one phase over angle."""
        from reluctance.machine.maps.plot import plot_torque

        picture = Picture(16, 5)
        left, middle, right = picture.subplots(1, 3)
        self.draw(left)
        self.draw_field(middle)
        plot_torque(surface(self.solution.table(self.geometry.rotor_poles)), axes=right)
        save_figure(picture, Path(path), title=self.name)


def machine_from_geometry(
    geometry: str | Path, *, progress: Callable[[float], None] | None = None
) -> FromGeometry:
    """Solve the field of a cross-section over current and angle.

    Parameters
    ----------
    geometry : str or Path
        A geometry file.
    progress : callable, optional
        Gets the share that is done, 0 to 1.

    Raises
    ------
    ParameterError
        With one line: a key, a value out of range, parts that do not fit, a B-H curve that is none.
    """
    path = Path(geometry)
    data = read_toml(path)
    if not is_geometry(data):
        raise ParameterError(
            f"{path} is no geometry file: need [machine], [lamination], [stator], [rotor], "
            "[air_gap], [winding] and [map]"
        )
    try:
        checked_file = geometry_of(placed_machine(flattened(data), path.parent), "[machine]")
        pairs = checked_file.map.coupling == "pairs"
        first = SELF_PART if pairs else 1.0
        told = progress or (lambda part: None)
        solution = solved(checked_file, progress=lambda part: told(first * part))
        _check_rises(solution)
        coupling = None
        if pairs:
            share = 1 - SELF_PART
            coupling = coupling_of(
                checked_file,
                surface(solution.table(checked_file.rotor_poles)),
                float(solution.i[-1]),
                told=lambda part: told(first + share * part),
            )
        for question in _far_from_computed(checked_file, solution):
            warnings.warn(f"{path}: {question}", Note, stacklevel=2)
        return FromGeometry(checked_file, solution, path.name, coupling)
    except ParameterError as fault:
        line = str(fault).replace("[machine.", "[")  # here the tables stand by themselves
        raise ParameterError(f"{path}: {line}") from None


def _far_from_computed(g: Geometry, s: Solution) -> Iterator[str]:
    """What to ask of a given resistance or inertia that the dimensions do not lead to."""
    T = g.winding.temperature_degC
    if g.R_ohm is not None:  # it holds at 20 degC
        cold = s.R_ohm / resistance_ratio(T)
        yield from _far("R_ohm", g.R_ohm, cold, "ohm at 20 degC")
    if g.J_kgm2 is not None:
        yield from _far("J_kgm2", g.J_kgm2, s.J_kgm2, "kg m2")


def _far(key: str, given: float, computed: float, unit: str) -> Iterator[str]:
    if not computed / FAR <= given <= FAR * computed:
        yield (
            f"{key} = {given:g} is given, while {computed:.3g} {unit} follow from the dimensions: "
            "check its unit and the dimensions"
        )


def _check_rises(solution: Solution) -> None:
    """Raises ParameterError where a phase has no more flux linkage aligned than unaligned."""
    unaligned, aligned = (float(solution.psi[-1, k]) for k in (0, -1))
    if not aligned > unaligned:
        raise ParameterError(
            f"at {solution.i[-1]:g} A a phase has {aligned:.3g} Wb aligned and {unaligned:.3g} Wb "
            "unaligned: the iron behind the poles is too thin; give the yokes about half of a "
            "pole's width (outer diameter, shaft diameter, pole heights)"
        )
