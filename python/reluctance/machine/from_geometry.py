"""The public entry: a geometry file in, a solved machine out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance.errors import ParameterError
from reluctance.figures import save_figure
from reluctance.files import read_toml
from reluctance.geometry.file import Geometry
from reluctance.geometry.samples import rotor_angle
from reluctance.geometry.solve import at_angle, solve
from reluctance.geometry.solved import Solution, solved, system_of
from reluctance.machine.geometry_machine import flattened, is_geometry, with_steel_path
from reluctance.machine.write_geometry import write_machine
from reluctance.picture import Picture
from reluctance.schema import checked


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
    """

    geometry: Geometry
    solution: Solution
    name: str

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
            "R_ohm": s.R_ohm,
            "L_end_H": s.L_end_H,
            "J_kgm2": s.J_kgm2,
            "copper_kg": s.copper_kg,
            "iron_kg": s.stator_iron_kg + s.rotor_iron_kg,
            "wire_area_mm2": 1e6 * s.wire_area_m2,
            "turns_per_pole": float(turns),
        }

    def lines(self) -> list[str]:
        """The figures as text."""
        f, g = self.figures, self.geometry
        i_max = g.map.current_max_A
        return [
            f"{g.stator_poles}/{g.rotor_poles}, {g.phases} phases: {f['unknowns']:.0f} unknowns, "
            f"{g.map.angles} angles x {g.map.currents} currents",
            f"at {i_max:g} A: flux linkage {f['psi_aligned_Wb']:.4g} Wb aligned, "
            f"{f['psi_unaligned_Wb']:.4g} Wb unaligned; torque {f['tau_peak_Nm']:.4g} N m peak, "
            f"{f['tau_mean_Nm']:.4g} N m mean of one phase; radial force on a pole up to "
            f"{f['pole_force_max_N']:.3g} N",
            f"R = {f['R_ohm']:.4g} ohm at {g.winding.temperature_degC:g} degC, end windings "
            f"{1e3 * f['L_end_H']:.3g} mH, wire {f['wire_area_mm2']:.3g} mm2 (estimates)",
            f"J = {f['J_kgm2']:.3g} kg m2, copper {f['copper_kg']:.3g} kg, iron "
            f"{f['iron_kg']:.3g} kg",
        ]

    def save(self, out: str | Path) -> list[Path]:
        """Writes the machine file, and the flux map next to it."""
        return write_machine(self.geometry, self.solution, Path(out), made_of=self.name)

    def plot(self, path: str | Path, *, theta_e_deg: float = 120.0) -> None:
        """Writes the cross-section, and the field of phase a at half of the largest current."""
        from reluctance.geometry.draw import draw, draw_field  # Matplotlib: half of the start-up

        system = system_of(self.geometry)
        alpha = rotor_angle(system, np.radians(theta_e_deg))
        i = np.eye(self.geometry.phases)[0] * self.geometry.map.current_max_A / 2
        picture = Picture(11, 5)
        left, right = picture.subplots(1, 2)
        draw(system, alpha=alpha, axes=left)
        draw_field(solve(at_angle(system, alpha), i), axes=right)
        left.set_title(self.name)
        right.set_title(f"{i[0]:g} A, {theta_e_deg:g} deg el.")
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
    table = with_steel_path(flattened(data), path.parent)
    table.pop("model")
    try:
        checked_file = checked(Geometry, table, "[machine]")
        return FromGeometry(checked_file, solved(checked_file, progress=progress), path.name)
    except ParameterError as fault:
        raise ParameterError(f"{path}: {fault}") from None
