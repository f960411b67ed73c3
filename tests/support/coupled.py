"""A machine whose neighbouring phases couple: a flux map of the library, and pairs by a formula.

    W(phi, a, b) = -K [h(phi) g(a) g(b) + 0.2 sin(phi) (g(a) q(b) - q(a) g(b))]

with h = 1 + 0.5 cos(phi) + 0.1 cos(2 phi), g = x/(1 + x/2), q = x^2/(1 + x)^2, x the current over
i_max: what a second phase takes from the first, more so near alignment.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reluctance.machine.coupling import Coupling, Neighbours
from reluctance.machine.maps.pairs import Array, PairSamples, PairTable, pair_table
from reluctance.machine.pair_file import write_pairs

MACHINES = Path(__file__).parents[2] / "machines"
N_r, I_MAX = 4, 12.0
K = 0.2  # [J]
# Where the drives of the tests work with this machine, whatever else they are; and range of their
# current sensors.
WORKING = ["converter.u_dc_V=160", "load.speed_rpm=1500", "reference.tau_Nm=2.5"]
SENSED = ["sensing.i_range_A=20"]
BAND = ["control.i_band_A=0.1"]


def g(x: Array) -> tuple[Array, Array]:
    """And its derivative."""
    return x / (1 + x / 2), 1 / (1 + x / 2) ** 2


def q(x: Array) -> tuple[Array, Array]:
    return x**2 / (1 + x) ** 2, 2 * x / (1 + x) ** 3


@dataclass(frozen=True)
class Formula:
    """What a pair adds, by the formula."""

    K: float = K

    def at(self, phi: Array, a: Array, b: Array) -> tuple[Array, Array, Array, Array]:
        """Energy [J], torque [N m], both flux linkages [Wb]."""
        (ga, da), (qa, ea) = g(a / I_MAX), q(a / I_MAX)
        (gb, db), (qb, eb) = g(b / I_MAX), q(b / I_MAX)
        h = 1 + 0.5 * np.cos(phi) + 0.1 * np.cos(2 * phi)
        dh = -0.5 * np.sin(phi) - 0.2 * np.sin(2 * phi)
        s, c = 0.2 * np.sin(phi), 0.2 * np.cos(phi)
        energy = h * ga * gb + s * (ga * qb - qa * gb)
        tau = N_r * (dh * ga * gb + c * (ga * qb - qa * gb))
        first = (h * da * gb + s * (da * qb - ea * gb)) / I_MAX
        second = (h * ga * db + s * (ga * eb - qa * db)) / I_MAX
        return -self.K * energy, -self.K * tau, -self.K * first, -self.K * second

    def samples(self, angles: int = 13, currents: int = 7) -> PairSamples:
        phi = np.linspace(0, np.pi, angles)
        i = I_MAX * np.arange(1, currents + 1) / currents
        return PairSamples(phi, i, *self.at(*np.meshgrid(phi, i, i, indexing="ij")))


def table(K: float = K) -> PairTable:
    return pair_table(Formula(K).samples(), N_r, tolerance=1e-9)


def coupling(K: float = K) -> Coupling:
    """All neighbours alike."""
    alike = table(K)
    return Coupling(3, tuple(Neighbours(k, (k + 1) % 3, alike) for k in range(3)))


def unlike(*K: float) -> Coupling:
    """Of three phases; by default two neighbours of one kind and one of another, as a winding in
    groups has them."""
    kinds = {x: table(x) for x in K or (-0.2, 0.15)}
    ring = [kinds[x] for x in K or (-0.2, -0.2, 0.15)]
    return Coupling(3, tuple(Neighbours(k, (k + 1) % 3, kind) for k, kind in enumerate(ring)))


def machine_file(folder: Path, pairs: Coupling | None = None) -> Path:
    """The library's 6/4 machine with these pairs, by default those of the formula."""
    text = (MACHINES / "onelab_6_4.toml").read_text()
    for name in ("onelab_6_4.csv", "onelab_6_4_force.csv"):
        shutil.copy(MACHINES / name, folder / name)
    write_pairs(coupling() if pairs is None else pairs, folder / "pairs.csv")
    path = folder / "coupled.toml"
    path.write_text(text.rstrip() + '\npairs = "pairs.csv"\n')
    return path
