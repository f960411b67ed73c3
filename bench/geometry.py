"""Torque of machines with short gaps: the field solver against a closed form.

    python bench/geometry.py [--out FILE.csv]

While a rotor pole passes under a stator pole of iron without a drop of its own, the torque is that
of the overlap, less what the two parts of the poles that do not overlap lose:

    tau = n/2 (N i)^2 mu_0 l/ln(r_s/r_r) [1 - 2 g dP/db]

for n poles of a phase. P(b) is the permeance about the end of an overlap, where one pole stands out
by b: two corners over a gap g, in closed form by the map

    dz/dw = C sqrt((w - 1) (w + a))/w

of the half plane (Schwarz and Christoffel). It takes slots for infinitely deep and other poles for
infinitely far away. They are some tens of gaps away at 1:50, and the closed form is a few per cent
too high there; a mesh with half as long cells then tells mesh from model.

Iron of a permeability that is not infinite takes a part of the ampere-turns. A magnetic circuit
with one reluctance of iron lowers the torque as the square of the flux linkage, and the flux
linkage of both irons is solved.

The rows are three machines with a bore of 92 mm, six gaps, two irons. Of five angles of the
overlap, `difference_pct` is the mean and `worst_pct` the farthest from the closed form.
`rough_pct` is the greatest difference of the torque and the slope of the co-energy over two
thousandths of the pole arc, `doubled_pct` how far a mesh with twice as many cells moves the torque
on ideal iron.
"""

import argparse
from functools import lru_cache
from pathlib import Path

import numpy as np
from scipy.constants import mu_0
from scipy.integrate import quad
from scipy.optimize import brentq

from reluctance.base.table_file import write_table
from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import Field, solve
from reluctance.machine.geometry.steel import Array, Steel
from reluctance.machine.geometry.system import System, assemble
from reluctance.machine.geometry.winding import Winding

MM = 1e-3
MACHINES = {(6, 4): 30.0, (8, 6): 22.0, (12, 8): 15.0}  # pole arcs [deg]
RATIOS = (50, 100, 200, 460, 1000, 2000)  # of bore and gap
PERMEABILITIES = (1e7, 8e4)  # relative; the first one stands for an ideal iron
BORE, STACK, TURNS = 92 * MM, 80 * MM, 60
OVERLAPS = (0.3, 0.4, 0.5, 0.6, 0.7)  # of the pole arc
STEP = 1e-3  # of the pole arc, for the derivative of the co-energy
CURRENT = 1e-3  # [A]


def section(N_s: int, N_r: int, ratio: float) -> CrossSection:
    """A machine with equal pole arcs."""
    arc, gap = np.radians(MACHINES[N_s, N_r]), BORE / ratio
    r = BORE / 2
    return CrossSection(
        N_s, N_r, 12.5 * MM, r - gap, r, 90 * MM, arc, arc, 26 * MM, 18 * MM, flat_face=False
    )


def system(N_s: int, N_r: int, ratio: float, mu: float, grid: Grid | None = None) -> System:
    """With iron of a constant relative permeability."""
    case = section(N_s, N_r, ratio)
    H = np.linspace(0, 40, 20)
    phases = N_s // case.n_sectors
    polarity = tuple(1 - 2 * (k % 2) for k in range(case.n_sectors) for _ in range(phases))
    winding = Winding(phases, polarity, TURNS, parallel_paths=1)
    return assemble(case, Steel(H, mu * mu_0 * H), winding, stack=STACK, grid=grid or Grid())


def field(of: System, overlap: float, more: float = 0.0) -> Field:
    """Where a share of the pole arc overlaps, one phase with CURRENT."""
    case = of.section
    theta_e = np.pi - case.N_r * case.beta_r * (1 - overlap - more)
    i = np.eye(of.winding.n_phases)[0] * CURRENT
    return solve(at_angle(of, rotor_angle(of, theta_e)), i)


def closed_form(case: CrossSection, n_poles: int, overlap: float) -> float:
    """Torque with ideal iron [N m]."""
    whole = n_poles / 2 * (TURNS * CURRENT) ** 2 * mu_0 * STACK
    b = (1 - overlap) * case.beta_r * (case.r_bore + case.r_rotor) / 2
    return float(whole / np.log(case.r_bore / case.r_rotor) * (1 - 2 * _slope(b / case.gap)))


def _slope(b: float) -> float:
    """dP/db in mu_0 over the gap, for a length b in gaps that a pole stands out."""
    log_a = brentq(lambda x: _standing_out(np.exp(x)) - b, -1.0, 25.0)
    low, high = np.exp(log_a - STEP), np.exp(log_a + STEP)
    return float((_permeance(high) - _permeance(low)) / (_standing_out(high) - _standing_out(low)))


def _part(to: float, other: float) -> float:
    """int_0^to (sqrt((to - t) (other + t)) - sqrt(to other))/t dt."""
    start = np.sqrt(to * other)
    return float(quad(lambda t: (np.sqrt((to - t) * (other + t)) - start) / t, 0, to, limit=500)[0])


def _standing_out(a: float) -> float:
    """b/g of the map's parameter."""
    return float(np.log(a) + (_part(a, 1.0) - _part(1.0, a)) / np.sqrt(a)) / np.pi


def _permeance(a: float) -> float:
    """P/mu_0 but for a constant, of the end of an overlap whose start is fixed to the pole."""
    return float(np.log(a) / 2 - _part(1.0, a) / np.sqrt(a)) / np.pi


@lru_cache
def ideal(N_s: int, N_r: int, ratio: float) -> list[float]:
    """Flux linkages with ideal iron at the angles [Wb]."""
    of = system(N_s, N_r, ratio, PERMEABILITIES[0])
    return [float(field(of, x).psi[0]) for x in OVERLAPS]


@lru_cache
def doubled(N_s: int, N_r: int, ratio: float) -> float:
    """Change of the torque at half an overlap from a mesh with twice as many cells to ours [1]."""
    tau, fine = (
        field(system(N_s, N_r, ratio, PERMEABILITIES[0], grid), 0.5).tau
        for grid in (Grid(), Grid().doubled())
    )
    return tau / fine - 1


def row(N_s: int, N_r: int, ratio: float, mu: float) -> dict[str, float | str]:
    """One machine over the angles."""
    of = system(N_s, N_r, ratio, mu)
    fields = [field(of, x) for x in OVERLAPS]
    tau = np.array([x.tau for x in fields])
    n_poles = N_s // of.winding.n_phases
    exact = np.array([closed_form(of.section, n_poles, x) for x in OVERLAPS])
    exact *= [(x.psi[0] / psi) ** 2 for x, psi in zip(fields, ideal(N_s, N_r, ratio), strict=True)]
    difference = 100 * (tau / exact - 1)
    angle = 2 * STEP * of.section.beta_r
    work = [field(of, x, STEP).coenergy - field(of, x, -STEP).coenergy for x in OVERLAPS]
    middle = OVERLAPS.index(0.5)
    return {
        "machine": f"{N_s}/{N_r}",
        "bore_over_gap": ratio,
        "permeability": mu,
        "unknowns": of.n,
        "closed_form_Nm_per_A2": _digits(exact[middle] / CURRENT**2),
        "tau_Nm_per_A2": _digits(tau[middle] / CURRENT**2),
        "difference_pct": _digits(difference.mean()),
        "worst_pct": _digits(difference[np.abs(difference).argmax()]),
        "rough_pct": _digits(100 * np.abs(np.array(work) / angle / tau - 1).max()),
        "doubled_pct": _digits(100 * doubled(N_s, N_r, ratio)),
    }


def _digits(x: float) -> float:
    return float(f"{x:.4g}")


def table(rows: list[dict[str, float | str]]) -> dict[str, Array]:
    """Columns of the file."""
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".csv"))
    options = parser.parse_args()
    rows = []
    for machine in MACHINES:
        for ratio in RATIOS:
            for mu in PERMEABILITIES:
                rows.append(row(*machine, ratio, mu))
                print(rows[-1], flush=True)
    write_table(options.out, table(rows))


if __name__ == "__main__":
    main()
