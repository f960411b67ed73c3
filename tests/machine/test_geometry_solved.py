"""What is solved of a geometry: flux linkage, torque, force and how far the mesh is off."""

from types import SimpleNamespace

import numpy as np
import pytest
from geometries import COARSE, GEOMETRIES, geometry
from scipy.constants import mu_0

from reluctance import _core
from reluctance.base.schema import checked
from reluctance.base.toml_file import read_toml
from reluctance.machine.copper import COPPER_RESISTIVITY
from reluctance.machine.geometry import convergence
from reluctance.machine.geometry import solved as solved_module
from reluctance.machine.geometry.by_products import SHAFT_DENSITY, SHEET_DENSITY
from reluctance.machine.geometry.file import Geometry
from reluctance.machine.geometry.force import stress
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.position import at_angle
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solve import solve
from reluctance.machine.geometry.solved import by_products_of, solved, system_of
from reluctance.machine.library import flattened
from reluctance.machine.maps import fit_surface
from reluctance.machine.maps.pole_force import read_pole_force

PLACE = "reluctance.machine.geometry"


@pytest.mark.parametrize(("width", "height"), [(8.0, 12.0), (6.0, 10.0), (5.0, 14.0)])
def test_a_stated_coil_has_its_width_times_its_height(width, height):
    """R, wire and copper follow from the area w h, whatever the mesh."""
    case = geometry(
        winding__coil_width_mm=width, winding__coil_height_mm=height, winding__slot_fill=0.5
    )
    for grid in (COARSE, None):
        position = at_angle(system_of(case, grid), 0.1)
        assert position.coil_area == pytest.approx(width * height * 1e-6, rel=1e-12)
    turn = 2 * (50e-3 + 2 * case.cross_section.half_width_s + np.pi / 2 * width * 1e-3)
    R = COPPER_RESISTIVITY * 2 * 90 * turn / (0.5 * width * height * 1e-6 / 90)
    assert by_products_of(case).R_ohm == pytest.approx(R, rel=1e-6)


def test_a_thicker_shaft_is_solid_steel_where_there_were_sheets():
    """The moment of a cylinder, m r^2/2: what the shaft gains, the stacked sheets lose, of whose
    edge the mesh has the chords, 2.4 % less."""
    thin, thick = (geometry(rotor__shaft_diameter_mm=d) for d in (12.0, 16.0))
    gained = np.pi / 2 * 50e-3 * (8e-3**4 - 6e-3**4)
    sheets = SHEET_DENSITY * thin.lamination.stacking_factor
    assert by_products_of(thick).J_kgm2 - by_products_of(thin).J_kgm2 == pytest.approx(
        gained * (SHAFT_DENSITY - sheets), abs=0.03 * gained * sheets
    )


@pytest.mark.long
def test_torque_between_the_nodes_is_the_field_s():
    """0.2 % rms of the peak at points of no node, on the default grid of the map."""
    seed = int(np.random.SeedSequence().generate_state(1)[0])
    print(f"seed {seed}")
    random = np.random.default_rng(seed)
    case = geometry(map__angles=None, map__currents=None)
    solution, system = solved(case), system_of(case)
    machine = fit_surface(solution.table(4)).machine
    theta_e, i = random.uniform(0, np.pi, 40), random.uniform(0.3, 15, 40)
    found = _core.magnetics(machine, i, theta_e)
    exact = []
    for angle, current in zip(theta_e, i, strict=True):
        field = solve(at_angle(system, rotor_angle(system, angle)), current * np.eye(3)[0])
        exact.append((field.psi[0] + solution.L_end_H * current, field.tau))
    psi, tau = np.array(exact).T
    assert np.sqrt(np.mean((found[:, 2] - tau) ** 2)) < 2e-3 * solution.tau.max()
    assert np.abs(found[:, 0] - psi).max() < 2e-3 * solution.psi.max()


@pytest.mark.long
def test_end_windings_turns_and_paths_scale_as_they_must():
    few = {"map__angles": 13, "map__currents": 6}
    base = geometry(**few)
    more = geometry(**few, winding__turns_per_pole=180, map__current_max_A=7.5)
    one, two = solved(base), solved(more)
    np.testing.assert_allclose(two.tau, one.tau, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(two.psi, 2 * one.psi, rtol=1e-6, atol=1e-9)
    assert two.R_ohm == pytest.approx(4 * one.R_ohm)
    assert two.L_end_H == pytest.approx(4 * one.L_end_H)
    fixed = solved(geometry(**few, winding__end_winding=2.0))
    extra = (2e-3 - one.L_end_H) * one.i[:, None]
    np.testing.assert_allclose(fixed.psi, one.psi + extra, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(fixed.tau, one.tau, rtol=1e-9, atol=1e-12)


@pytest.mark.long
def test_the_radial_force_is_that_of_the_flux_of_the_pole():
    """Aligned and unsaturated, the stress on the pole is B^2/(2 mu_0), B its flux over its area."""
    solution, case = solved(geometry()), geometry()
    flux = (solution.psi[1, -1] - solution.L_end_H * solution.i[1]) / (2 * 90)
    width = 28e-3 * np.radians(30)
    B = flux / (width * 50e-3)
    force = B**2 / (2 * mu_0) * width * 50e-3
    assert case.air_gap.length_mm == 0.3
    assert solution.pole_force[1, -1] == pytest.approx(force, rel=0.15)
    assert list(solution.orders[:3]) == [0, 2, 4]
    # Two opposite poles pull: order 0 and 2 are the largest, and no order is odd.
    amplitude = solution.stress_orders[:, -1, -1]
    assert amplitude[1] > amplitude[3:].max()


def test_a_field_has_its_end_windings_and_tells_each_position_and_current(monkeypatch):
    told = []
    stressed = SimpleNamespace(
        pole_force=lambda *_: 0.0, orders=lambda n: (np.arange(n), np.zeros(n))
    )

    def sampled(system, i, theta_e, look):
        shape = len(i), len(theta_e)
        for column in range(shape[1]):
            for row in range(shape[0]):
                look(row, column, SimpleNamespace(steps=1))
        parts = ("coenergy", "psi", "tau", "L_inc", "psi_theta")
        return SimpleNamespace(**dict.fromkeys(parts, np.zeros(shape)))

    monkeypatch.setattr(solved_module, "stress", lambda field: stressed)
    monkeypatch.setattr(solved_module, "sample", sampled)
    case = geometry(map__angles=13, map__currents=6)
    found = solved_module._solve(case, COARSE, told.append)
    n = 13 * 7  # currents from none on
    assert told == pytest.approx(np.arange(1, n + 1) / n)
    assert found.steps == n
    i, L_end_H = found.i[:, None] + 0 * found.theta_e, by_products_of(case).L_end_H
    assert L_end_H > 0  # of the end windings alone, where the field is nothing
    for name, expected in (("psi", i), ("coenergy", i**2 / 2), ("L_inc", i**0)):  # COARSE: 1e-5
        assert getattr(found, name) == pytest.approx(L_end_H * expected, rel=1e-4), name


@pytest.mark.long
def test_the_convergence_report_has_five_points():
    points = convergence(geometry())
    assert [p["theta_e_deg"] for p in points] == pytest.approx([0, 45, 90, 135, 180])
    assert max(abs(p["psi_change"]) for p in points) < 5e-4
    assert max(abs(p["tau_change"]) for p in points) < 2e-3
    assert max(abs(p["tau_rough"]) for p in points) < 5e-3


def test_a_polarity_that_does_not_reverse_is_solved_whole():
    """A, A, -A, -A around the stator: other paths of the flux than A, -A, A, -A."""
    twelve = dict(
        machine__stator_poles=12,
        machine__rotor_poles=8,
        stator__pole_arc_deg=14.0,
        rotor__pole_arc_deg=15.0,
        map__angles=13,
        map__currents=6,
    )
    usual = geometry(**twelve)
    assert usual.polarity == "NNNSSSNNNSSS"
    other = geometry(**twelve, winding__polarity="NNNNNNSSSSSS")
    assert usual.coils.reverses(4) and not other.coils.reverses(4)
    fields = []
    for case in (usual, other):
        system = system_of(case, COARSE)
        fields.append(solve(at_angle(system, 0.0), np.array([15.0, 0, 0])))
    small, whole = (f.position.system.n for f in fields)
    assert whole > 3.9 * small
    less = 1 - fields[1].psi[0] / fields[0].psi[0]
    assert 1e-4 < less < 0.05  # longer paths through the yokes


@pytest.mark.parametrize("path", GEOMETRIES, ids=lambda path: path.stem)
def test_a_stored_map_is_that_of_its_geometry(path):
    """At two nodes; the whole map takes a while."""
    table = flattened(read_toml(path))
    del table["model"]
    case = checked(Geometry, table, path.name)
    stored = np.loadtxt(path.parents[1] / f"{path.stem}.csv", delimiter=",", skiprows=1)
    system = system_of(case)
    force = read_pole_force(path.parents[1] / f"{path.stem}_force.csv")
    machine = read_toml(path.parents[1] / f"{path.stem}.toml")["machine"]
    assert machine["source"].endswith(f"map computed from {path.name} (2-D field)")
    for theta_deg in (90.0, 180.0):
        near = np.abs(stored[:, 1] - theta_deg) < 1e-9
        i, _, psi, tau = stored[near][10]
        unit = np.eye(case.phases)[0]
        field = solve(at_angle(system, rotor_angle(system, np.radians(theta_deg))), i * unit)
        own = field.psi[0] + by_products_of(case).L_end_H * i
        assert own == pytest.approx(psi, rel=1e-5)
        assert field.tau == pytest.approx(tau, abs=1e-4 * stored[:, 3].max())
        pull = stress(field).pole_force(0, case.stator_poles)
        assert force.at(i, np.radians(theta_deg)) == pytest.approx(pull, rel=1e-3)


def test_there_is_a_geometry_of_each_kind():
    poles = set()
    for path in GEOMETRIES:
        head = read_toml(path)["machine"]
        poles.add((head["stator_poles"], head["rotor_poles"]))
        assert head["source"] and head["licence"] and head["assumed"]
    assert poles >= {(6, 4), (8, 6), (10, 8), (12, 8), (18, 12)}


def test_how_far_a_mesh_is_off_is_told_in_parts_of_the_greatest(monkeypatch):
    """On fields that are formulae: the finer mesh has 2 % more flux linkage and 4 % more torque,
    and the co-energy rises by 3 % more than the coarse torque says."""

    def solve(at, i):
        fine, theta = at
        assert [*i] == [7.5, 0, 0]
        return SimpleNamespace(
            psi=[(1.02 if fine else 1.0) * (2 - np.cos(theta))],
            tau=(1.04 if fine else 1.0) * np.sin(theta),
            coenergy=-1.03 * np.cos(theta),
        )

    section = SimpleNamespace(beta_s=0.5, beta_r=0.55)
    usual = Grid()

    def system_of(geometry, grid):
        return SimpleNamespace(section=section, fine=grid != usual)

    monkeypatch.setattr(solved_module, "system_of", system_of)
    monkeypatch.setattr(f"{PLACE}.samples.rotor_angle", lambda system, theta: theta)
    monkeypatch.setattr(f"{PLACE}.position.at_angle", lambda system, at: (system.fine, at))
    monkeypatch.setattr(f"{PLACE}.solve.solve", solve)
    rows = solved_module.convergence(geometry())
    theta = np.radians([row["theta_e_deg"] for row in rows])
    assert theta[0] == 0 and theta[-1] == pytest.approx(np.pi)
    psi, tau = 2 - np.cos(theta), np.sin(theta)
    assert [row["psi_Wb"] for row in rows] == pytest.approx(1.02 * psi)
    assert [row["tau_Nm"] for row in rows] == pytest.approx(1.04 * tau)
    parts = {
        "psi_change": -0.02 * psi / (1.02 * psi.max()),
        "tau_change": -0.04 * tau / (1.04 * tau.max()),
        "tau_rough": -0.03 * tau / (1.04 * tau.max()),
    }
    for name, expected in parts.items():
        assert [row[name] for row in rows] == pytest.approx(expected, abs=1e-4), name
