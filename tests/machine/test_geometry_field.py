"""The field solver obeys its own energy, and agrees with closed forms."""

from dataclasses import dataclass, replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from scipy.constants import mu_0

from reluctance.machine.geometry.air_gap import fourier
from reluctance.machine.geometry.cross_section import CrossSection
from reluctance.machine.geometry.draw import draw, draw_field
from reluctance.machine.geometry.force import stress
from reluctance.machine.geometry.mesh import STEEL, Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.steel import Steel
from reluctance.machine.geometry.steel_file import GRADES, H_GUARANTEED, grade
from reluctance.machine.geometry.system import assemble
from reluctance.machine.geometry.winding import Winding

COARSE = Grid(cell=3.0, growth=1.5, yoke=2)
MM = 1e-3
STACK = 40 * MM
SEED = int(np.random.SeedSequence().generate_state(1)[0])


def machine(N_s=12, N_r=8, *, flat=False, gap=0.4):
    """A made-up machine with a bore of 72 mm."""
    return CrossSection(
        N_s=N_s,
        N_r=N_r,
        r_shaft=9 * MM,
        r_rotor=(36 - gap) * MM,
        r_bore=36 * MM,
        r_out=65 * MM,
        beta_s=0.45 * 2 * np.pi / N_s,
        beta_r=0.36 * 2 * np.pi / N_r,
        h_s=20 * MM,
        h_r=10 * MM,
        flat_face=flat,
    )


def winding(section, turns=60):
    """Polarity reversed from sector to sector."""
    sectors = section.n_sectors
    phases = section.N_s // sectors
    polarity = tuple(1 - 2 * (n % 2) for n in range(sectors) for _ in range(phases))
    return Winding(phases, polarity, turns, parallel_paths=1)


def steel(J_sat=None, share=1.0):
    return Steel(*grade("M530-50A"), J_sat=J_sat, stacking_factor=share)


@dataclass(frozen=True)
class WholeMachine(Winding):
    """The same winding, solved without the symmetry of the sectors."""

    def reverses(self, n_sectors):
        return False


def turned(position, turn):
    """The rotor turned further on the same meshes: only the coupling over the gap changes."""
    alpha, system, linear = position.alpha + turn, position.system, position.linear
    change = position.gap.coupling(alpha) - position.gap.coupling(position.alpha)
    linear = linear + sum(system.sparsity.sum(place, change) for place in system.place.gap)
    return replace(position, alpha=alpha, linear=linear)


@pytest.mark.parametrize("odd", [False, True])
def test_orders_of_a_ring_are_integrals_of_its_quadratic_edges(odd):
    """By Gauss's rule; both where an edge is short and where it has many waves."""
    corners = np.array([0.1, 0.13, 0.2, 0.5, 1.1])
    orders = np.arange(0.0, 60.0, 0.7)
    found = fourier(SimpleNamespace(ring_theta=corners), orders, 1.0, odd=odd)
    x, weight = np.polynomial.legendre.leggauss(40)
    shapes = np.array([x * (x - 1) / 2, 1 - x**2, x * (x + 1) / 2])
    nodes = np.vstack([np.eye(8), (-1 if odd else 1) * np.eye(8)[:1]])  # unknowns at every node
    exact = np.zeros((len(orders), 8), complex)
    for n, (start, end) in enumerate(pairwise(corners)):
        theta = start + (end - start) * (1 + x) / 2
        wave = np.exp(-1j * np.outer(orders, theta)) * weight * (end - start) / 2
        exact += 2 * wave @ shapes.T @ nodes[2 * n : 2 * n + 3]
    assert found == pytest.approx(exact, abs=1e-12)


POINTS = [(12, 8, False, 2.0, 15.0), (12, 8, True, 1.2, 30.0), (8, 6, False, 2.6, 8.0)]


@pytest.mark.parametrize(("N_s", "N_r", "flat", "theta_e", "current"), POINTS)
def test_torque_and_flux_are_derivatives_of_the_coenergy(N_s, N_r, flat, theta_e, current):
    section = machine(N_s, N_r, flat=flat)
    coils = winding(section)
    system = assemble(section, steel(), coils, stack=STACK, grid=COARSE)
    alpha, unit = rotor_angle(system, theta_e), np.eye(coils.n_phases)[0]
    position = at_angle(system, alpha)

    def coenergy(turn=0.0, more=0.0):
        return solve(turned(position, turn), (current + more) * unit).coenergy

    field = solve(position, current * unit)
    h, d = 2e-5, 1e-3
    # A central difference of fourth order: its own error is below 1e-8 here.
    slope = (8 * (coenergy(h) - coenergy(-h)) - coenergy(2 * h) + coenergy(-2 * h)) / (12 * h)
    assert field.tau == pytest.approx(slope, rel=1e-6)
    rise = (coenergy(more=d) - coenergy(more=-d)) / (2 * d)
    assert field.psi[0] == pytest.approx(rise, rel=1e-6)
    _, dpsi, dtau = field.tangent(0)
    more, less = (solve(position, (current + x) * unit) for x in (d, -d))
    assert dpsi[0] == pytest.approx((more.psi[0] - less.psi[0]) / (2 * d), rel=1e-4)
    assert dtau == pytest.approx((more.tau - less.tau) / (2 * d), rel=1e-4)


@pytest.mark.parametrize(("N_s", "N_r", "flat", "theta_e", "current"), POINTS)
def test_maxwell_stress_at_any_radius_gives_the_torque(N_s, N_r, flat, theta_e, current):
    section = machine(N_s, N_r, flat=flat)
    system = assemble(section, steel(), winding(section), stack=STACK, grid=COARSE)
    i = np.eye(system.winding.n_phases)[0] * current
    field = solve(at_angle(system, rotor_angle(system, theta_e)), i)
    for at in (0.1, 0.5, 0.9):
        assert stress(field, at=at).torque == pytest.approx(field.tau, rel=1e-5)
    forces = [stress(field, at=at).pole_force(0, N_s) for at in (0.2, 0.8)]
    assert forces[0] == pytest.approx(forces[1], rel=1e-3)
    assert forces[0] > 10 * abs(stress(field).pole_force(1, N_s))


@pytest.mark.parametrize(("N_s", "N_r"), [(12, 8), (8, 6), (6, 4)])
def test_a_sector_is_the_whole_machine(N_s, N_r):
    section = machine(N_s, N_r)
    coils = winding(section)
    whole = WholeMachine(coils.n_phases, coils.polarity, coils.turns, coils.parallel_paths)
    i = np.array([12.0, 7.0, 0.0, 0.0][: coils.n_phases])
    fields = []
    for case in (coils, whole):
        system = assemble(section, steel(), case, stack=STACK, grid=COARSE)
        fields.append(solve(at_angle(system, rotor_angle(system, 2.0)), i))
    sector, full = fields
    assert full.position.system.n > 1.9 * sector.position.system.n
    assert full.tau == pytest.approx(sector.tau, rel=1e-6)
    np.testing.assert_allclose(full.psi, sector.psi, rtol=1e-6, atol=1e-9)


def test_the_phases_are_alike_and_mirror_images_about_alignment():
    print(f"seed {SEED}")
    random = np.random.default_rng(SEED)
    section = machine()
    system = assemble(section, steel(), winding(section), stack=STACK, grid=COARSE)
    theta_e, current = random.uniform(0.1, 3.0), random.uniform(1, 30)
    fields = [
        solve(at_angle(system, rotor_angle(system, theta_e, k)), current * np.eye(3)[k])
        for k in range(3)
    ]
    mirrored = solve(at_angle(system, rotor_angle(system, -theta_e)), current * np.eye(3)[0])
    for k, field in enumerate(fields):
        assert field.tau == pytest.approx(fields[0].tau, rel=1e-6)
        assert field.psi[k] == pytest.approx(fields[0].psi[0], rel=1e-6)
    assert mirrored.tau == pytest.approx(-fields[0].tau, rel=1e-6)
    assert mirrored.psi[0] == pytest.approx(fields[0].psi[0], rel=1e-6)


def test_a_linear_aligned_machine_is_its_magnetic_circuit():
    """Poles that fill their pitch, steel of high permeability, a short gap: the field is that of a
    uniform gap, B = mu_0 N i/g under one pole of a pair of phases with neighbours unexcited."""
    ideal = Steel(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.5, 1.0, 1.5]))
    inductances = []
    for gap in (0.2, 0.1):
        section = machine(6, 4, gap=gap)
        coils = winding(section, turns=10)
        system = assemble(section, ideal, coils, stack=STACK, grid=Grid())
        field = solve(at_angle(system, 0.0), np.array([1e-3, 0, 0]))
        inductances.append((gap, field.psi[0] / 1e-3))
    # L = N^2 mu_0 l w/(g) of each of two poles in series with two gaps, plus a leakage of no gap:
    # two gaps give both. The width is that of the narrower pole at the middle of the gap.
    (g1, L1), (g2, L2) = inductances
    slope = (L2 - L1) / (1 / g2 - 1 / g1)
    width = 2 * 36 * MM * np.arcsin(np.sin(0.36 * 2 * np.pi / 4 / 2))
    width = min(width, 36 * MM * 0.45 * 2 * np.pi / 6)
    expected = 2 * 10**2 * mu_0 * STACK * width / MM
    assert slope == pytest.approx(expected, rel=0.02)


def test_air_alone_is_the_logarithm_of_the_radii():
    """Steel of the permeability of air: a current sheet's field has no iron to lean on, so flux is
    proportional to current and no torque acts. Newton's method needs one step for it."""
    H = np.linspace(0, 4e6, 8)
    section = machine()
    system = assemble(section, Steel(H, mu_0 * H), winding(section), stack=STACK, grid=COARSE)
    one, two = (solve(at_angle(system, 0.1), x * np.eye(3)[0]) for x in (5.0, 10.0))
    assert one.steps == two.steps == 1
    assert two.psi[0] == pytest.approx(2 * one.psi[0], rel=1e-9)
    assert abs(two.tau) < 1e-3 * two.coenergy


@pytest.mark.long
@pytest.mark.parametrize(("N_s", "N_r", "current"), [(8, 6, 8.0), (12, 8, 20.0)])
def test_doubling_the_mesh_moves_little(N_s, N_r, current):
    """Of the largest values: flux linkage 0.05 %, torque 0.1 % rms."""
    section = machine(N_s, N_r)
    values = []
    for grid in (Grid(), Grid().doubled()):
        system = assemble(section, steel(), winding(section), stack=STACK, grid=grid)
        unit = np.eye(system.winding.n_phases)[0]
        fields = [
            solve(at_angle(system, rotor_angle(system, x)), current * unit, tolerance=1e-5)
            for x in (0.0, 1.0, 1.8, np.pi)
        ]
        values.append([(f.psi[0], f.tau) for f in fields])
    coarse, fine = np.array(values)
    change = (coarse - fine) / np.abs(fine).max(axis=0)
    assert np.abs(change[:, 0]).max() < 5e-4
    assert np.sqrt(np.mean(change[:, 1] ** 2)) < 1e-3


def test_the_energy_of_steel_is_the_integral_of_its_field_strength():
    for curve in (
        steel(),
        steel(share=0.95),
        Steel(*(x[:90] for x in grade("M400-50A")), J_sat=2.0),
    ):
        B = np.linspace(0, 2.6, 4001)
        nu, slope, energy = curve.reluctivity(B)
        H = nu * B
        assert np.diff(H).min() > 0
        work = np.concatenate([[0], np.cumsum((H[1:] + H[:-1]) / 2 * np.diff(B))])
        assert energy[-1] == pytest.approx(work[-1], rel=1e-4)
        assert slope[1:-1] == pytest.approx(np.gradient(H, B)[1:-1], rel=0.1)


def test_the_tail_approaches_its_saturation_polarisation():
    H, B = (x[:90] for x in grade("M530-50A"))
    curve = Steel(H, B, J_sat=2.05)
    far_H, far_B = curve.curve
    J = far_B - mu_0 * far_H
    assert 2.05 - 0.02 < J[-1] < 2.05
    assert np.diff(J[len(H) - 1 :]).min() > 0
    at_end = (far_B[len(H)] - B[-1]) / (far_H[len(H)] - H[-1])
    assert at_end == pytest.approx((B[-1] - B[-2]) / (H[-1] - H[-2]), rel=0.3)


@pytest.mark.parametrize("name", GRADES)
def test_a_grade_has_the_polarisation_of_its_standard(name):
    H, B = grade(name)
    J = np.interp(H_GUARANTEED, H, B - mu_0 * H)
    assert J == pytest.approx(GRADES[name], abs=5e-3)
    assert 1.8 < (B - mu_0 * H)[-1] < 2.1


def test_parallel_paths_share_the_current():
    section = machine()
    series = winding(section, turns=60)
    parallel = replace(series, parallel_paths=2)
    fields = []
    for coils, current in ((series, 10.0), (parallel, 20.0)):
        system = assemble(section, steel(), coils, stack=STACK, grid=COARSE)
        fields.append(solve(at_angle(system, 0.1), current * np.eye(3)[0]))
    assert fields[1].tau == pytest.approx(fields[0].tau, rel=1e-9)
    assert fields[1].psi[0] == pytest.approx(fields[0].psi[0] / 2, rel=1e-9)


def area(collection):
    """Of the outlines of a collection, by the shoelace formula [mm^2]."""
    found = 0.0
    for path in collection.get_paths():
        x, y = path.vertices[:6].T
        found += abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    return found


@pytest.mark.parametrize("odd", [True, False])
def test_a_drawing_has_the_steel_and_a_coil_of_each_phase_in_millimetres(odd):
    """6/4: the parts fill what the section has of them; the rotor turns about the shaft."""
    section = machine(6, 4)
    kind, of = Winding if odd else WholeMachine, winding(section)
    coils = kind(of.n_phases, of.polarity, 60, parallel_paths=1)
    system = assemble(section, steel(), coils, stack=STACK, grid=COARSE)
    assert system.odd == odd
    ax = draw(system, Figure().add_subplot())
    by_colour = {}
    for part in ax.collections:
        colour = tuple(np.round(part.get_facecolor()[0], 3)) if len(part.get_paths()) else None
        by_colour[colour] = by_colour.get(colour, 0.0) + area(part)
    by_colour.pop(None, None)
    grey = by_colour.pop(tuple(np.round(to_rgba("0.75"), 3)))
    meshes = [at_angle(system, 0.0).rotor, at_angle(system, 0.0).stator]
    copies = section.n_sectors if odd else 1
    iron = copies * sum(m.elements.weight[m.mesh.region == STEEL].sum() for m in meshes)
    assert grey == pytest.approx(1e6 * iron, rel=0.02)  # straight sides of curved elements
    assert len(by_colour) == 3  # phases, each with as much copper
    coil = [v / np.mean([*by_colour.values()]) for v in by_colour.values()]
    assert coil == pytest.approx([1, 1, 1], rel=1e-3)
    still = draw(system, Figure().add_subplot(), alpha=0.0)
    drawn = [
        [path.vertices.tolist() for part in of.collections for path in part.get_paths()]
        for of in (ax, still)
    ]
    assert drawn[0] == drawn[1]
    low, high = ax.dataLim.min, ax.dataLim.max
    assert [*low, *high] == pytest.approx([-65, -65, 65, 65], rel=1e-2)
    assert ax.get_aspect() == 1 and ax.get_xlabel() == "x [mm]"


def test_the_field_is_drawn_in_tesla_with_lines_of_the_potential():
    section = machine(6, 4)
    system = assemble(section, steel(), winding(section), stack=STACK, grid=COARSE)
    position = at_angle(system, 0.2)
    field = solve(position, np.array([10.0, 0.0, 0.0]))
    ax = draw_field(field, Figure().add_subplot())
    parts = [part for part in ax.collections if isinstance(part, PolyCollection)]
    assert len(parts) == 2
    for part, side, turn in zip(parts, (position.rotor, position.stator), (0.2, 0), strict=True):
        places = np.concatenate([path.vertices for path in part.get_paths()]) @ [1, 1j]
        first, last = side.mesh.theta.min(), side.mesh.theta.max()
        middle = (first + last) / 2
        angles = np.angle(places * np.exp(-1j * (turn + middle))) + middle
        assert (angles.min(), angles.max()) == pytest.approx((first, last), abs=1e-6)
    B = np.concatenate([part.get_array() for part in parts])
    assert 1.0 < B.max() < 2.5 and B.min() >= 0
    assert parts[0].get_clim() == (0, 2.2)
    lines = [part for part in ax.collections if isinstance(part, QuadContourSet)]
    potential = np.append(field.A, 0.0)
    for part in lines:
        inner = np.linspace(potential.min(), potential.max(), 26)[1:-1]
        assert part.levels == pytest.approx(inner)
    (_, bar) = ax.figure.axes
    assert bar.get_ylabel() == "|B| [T]"
