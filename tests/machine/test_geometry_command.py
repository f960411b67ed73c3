"""The command from-geometry: what it prints, writes, overwrites and draws."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from command import command, refused
from geometries import COARSE, changed, geometry, write
from matplotlib.figure import Figure

import reluctance as rl
from reluctance.base.toml_file import read_toml
from reluctance.machine.geometry import draw, from_geometry, write_geometry
from reluctance.machine.geometry import solved as solved_module
from reluctance.machine.geometry.mesh import Grid
from reluctance.machine.geometry.samples import rotor_angle
from reluctance.machine.geometry.solved import by_products_of
from reluctance.machine.library import machine_from, machine_table


def test_a_given_resistance_holds_at_20_degrees_and_is_what_the_command_prints(
    tmp_path, monkeypatch
):
    """With given inertia; a value far from the computed one is asked about."""
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: COARSE)
    path, out = tmp_path / "g.toml", tmp_path / "m.toml"
    warm = {"winding__temperature_degC": 90.0}
    own = by_products_of(geometry(**warm))
    for R, J, far in ((0.25, 4e-4, []), (25.0, 2.0, ["R_ohm = 25", "J_kgm2 = 2"])):
        write(path, changed(machine__R_ohm=R, machine__J_kgm2=J, **warm))
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            done = command("machine", "from-geometry", path, "--out", out)
        assert done.code == 0, done.error
        run = f"R = {R:g} ohm as given at 20 degC, {R * 1.2751:.4g} ohm at 90 degC in the run"
        assert run in done.out and f"J = {J:g} kg m2 as given" in done.out
        assert [note for note in far if note in str([w.message for w in told])] == far
        assert len(told) == len(far)
        machine = read_toml(out)["machine"]
        assert "temp_R_degC" not in machine and machine["temp_w_degC"] == 90
        assert (machine["R_ohm"], machine["J_kgm2"]) == (R, J)
        assert machine_from(machine_table(str(out), tmp_path)).R == pytest.approx(R * 1.2751)
    write(path, changed(**warm))
    done = command("machine", "from-geometry", path, "--out", out)
    assert f"R = {own.R_ohm:.4g} ohm at 90 degC" in done.out
    assert read_toml(out)["machine"]["temp_R_degC"] == 90


def test_a_convergence_that_fails_is_an_error(tmp_path, monkeypatch):
    coarsest = Grid(cell=30.0, growth=30.0, yoke=1)
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: coarsest)
    path = write(tmp_path / "g.toml", changed(map__angles=13, map__currents=6))
    out = tmp_path / "m.toml"
    line = refused("machine", "from-geometry", path, "--out", out, "--convergence")
    assert "need at most 5 %: this map is not to be used" in line
    assert not out.exists()


def test_a_map_that_cannot_be_used_is_not_written(tmp_path, monkeypatch):
    bad = SimpleNamespace(verdict="poor", reasons=["flux linkage falls"])
    monkeypatch.setattr(write_geometry, "check_map", lambda table: bad)
    solution = SimpleNamespace(table=lambda N_r: None)
    with pytest.raises(rl.ParameterError, match=r"17 angles x 10 currents .*flux linkage falls"):
        write_geometry.write_machine(geometry(), solution, tmp_path / "m.toml", made_of="g.toml")
    assert not list(tmp_path.iterdir())


def test_a_machine_file_that_was_edited_is_not_overwritten(tmp_path, monkeypatch):
    monkeypatch.setattr("reluctance.machine.geometry.solved.Grid", lambda: COARSE)
    path = write(tmp_path / "g.toml", changed())
    order = ("machine", "from-geometry", path, "--out", tmp_path / "m.toml")
    for _ in range(2):  # the second time over its own files
        assert command(*order).code == 0
    out = tmp_path / "m.toml"
    out.write_text(out.read_text().replace("R_ohm = ", "R_ohm = 1"))
    mine = out.read_text()
    line = refused(*order)
    assert "m.toml has been edited; remove m.toml, m.csv, m_force.csv, or choose another" in line
    assert out.read_text() == mine
    for name in ("m.toml", "m.csv", "m_force.csv"):
        (tmp_path / name).unlink()
    assert command(*order).code == 0
    assert "g.toml exists, and may have been" in refused(*order[:-1], path)


@pytest.mark.parametrize(("coupling", "first"), [("none", 1.0), ("pairs", 0.25)])
def test_progress_of_a_geometry_rises_to_one_and_pairs_take_the_greater_part(
    tmp_path, monkeypatch, coupling, first
):
    told = []
    kept = SimpleNamespace(table=lambda N_r: N_r, i=np.array([0.0, 15.0]), psi=np.eye(2))

    def field(geometry, *, progress):
        progress(0.5), progress(1.0)
        return kept

    def coupled(geometry, machine, i_last, *, told):
        assert (machine, i_last) == (("surface", 4), 15.0)
        told(0.5), told(1.0)
        return "coupled"

    monkeypatch.setattr(from_geometry, "solved", field)
    monkeypatch.setattr(from_geometry, "coupling_of", coupled)
    monkeypatch.setattr(from_geometry, "surface", lambda table: ("surface", table))
    path = write(tmp_path / "g.toml", changed(map__coupling=coupling))
    found = from_geometry.machine_from_geometry(path, progress=told.append)
    rest = [first + (1 - first) / 2, 1.0] if first < 1 else []
    assert told == pytest.approx([first / 2, first, *rest])
    assert (found.solution, found.name) == (kept, "g.toml")
    assert found.coupling == ("coupled" if first < 1 else None)
    assert from_geometry.machine_from_geometry(path).solution is kept


def test_a_field_is_drawn_with_half_of_the_largest_current_or_the_given_one(monkeypatch):
    solved_with = []
    monkeypatch.setattr(from_geometry, "at_angle", lambda system, alpha: alpha)
    monkeypatch.setattr(from_geometry, "solve", lambda at, i: solved_with.append((at, i)))
    monkeypatch.setattr(draw, "draw_field", lambda field, axes: axes)
    monkeypatch.setattr(draw, "draw", lambda system, axes, *, alpha: solved_with.append(alpha))
    found = from_geometry.FromGeometry(geometry(), None, "mine")
    system = solved_module.system_of(geometry())
    axes = Figure().subplots()
    found.draw_field(axes)
    assert axes.get_title() == "7.5 A, 120 deg el."
    found.draw_field(axes, theta_e_deg=90, i_A=4.0)
    assert axes.get_title() == "4 A, 90 deg el."
    found.draw(axes, theta_e_deg=60)
    found.draw(axes)
    assert axes.get_title() == "mine"
    (a, first), (b, second), *c = solved_with
    assert [*first] == [7.5, 0, 0] and [*second] == [4, 0, 0]
    angles = [rotor_angle(system, np.radians(degrees)) for degrees in (120, 90, 60, 120)]
    assert [a, b, *c] == pytest.approx(angles)
