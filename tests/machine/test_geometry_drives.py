"""The machine of a geometry in a drive: as from its machine file, with keys of its own."""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command import command
from geometries import GOOD, changed, drive, geometry, write

import reluctance as rl
from reluctance.base.toml_file import read_toml
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.machine.geometry import geometry_machine
from reluctance.machine.geometry.geometry_machine import geometry_of
from reluctance.machine.geometry.solved import solved
from reluctance.machine.geometry.steel_file import grade
from reluctance.machine.library import flattened
from reluctance.machine.maps import check_map


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A geometry file, the machine file that the command makes of it, and what it prints."""
    folder = tmp_path_factory.mktemp("geometry")
    path, out = write(folder / "g.toml", GOOD), folder / "m.toml"
    figure = folder / "m.png"
    done = command("machine", "from-geometry", path, "--out", out, "--plot", figure, "--json")
    assert done.code == 0, done.error
    assert figure.stat().st_size > 20_000
    return path, out, json.loads(done.out)


@pytest.mark.long
def test_machine_file_and_geometry_file_give_the_same_drive(made, tmp_path):
    """Resistance and inertia of the file are rounded to four digits."""
    geometry_path, machine_path, _ = made
    kpis = []
    for name in (geometry_path, machine_path):
        path = write(tmp_path / "d.toml", drive({}))
        tables = path.read_text().replace("[machine]\n", "")
        path.write_text(f'machine = "{name}"\n' + tables)
        kpis.append(rl.simulate(rl.load(path)).kpis)
    assert kpis[0].tau_mean == pytest.approx(1.5, rel=0.05)
    assert kpis[0].tau_mean == pytest.approx(kpis[1].tau_mean, rel=2e-3)
    assert kpis[0].i_rms == pytest.approx(kpis[1].i_rms, rel=2e-3)
    assert max(abs(k.energy_residual) for k in kpis) < 1e-6


@pytest.mark.long
def test_keys_of_the_geometry_are_keys_of_the_drive(made, tmp_path):
    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load(path)
    shorter = first.with_values({"machine.lamination.stack_length_mm": 25.0})
    assert shorter.machine.J_kgm2 == pytest.approx(first.machine.J_kgm2 / 2, rel=1e-6)
    torque = [d.machine.tau(10.0, 1.8) for d in (first, shorter)]
    assert torque[1] == pytest.approx(torque[0] / 2, rel=1e-6)
    warm = first.with_values({"machine.temp_w_degC": 120.0})
    assert warm.machine.R == pytest.approx(first.machine.R * 1.393, rel=1e-6)
    with pytest.raises(rl.ParameterError, match="neighbouring poles overlap"):
        first.with_values({"machine.stator.pole_arc_deg": 70.0})


@pytest.mark.long
def test_a_control_may_know_the_geometry_wrong(made, tmp_path):
    """[mismatch] scales what the control knows of flux linkage and resistance."""
    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    one, other = (rl.load(path, [f"mismatch.flux_factor={x}"]).known() for x in (1.0, 1.2))
    for figure in ("psi", "tau"):
        known, scaled = (float(getattr(x.machine, figure)(9.0, 2.0)) for x in (one, other))
        assert scaled == pytest.approx(1.2 * known, rel=1e-6)


@pytest.mark.long
def test_the_map_is_energy_consistent_and_judged_good(made):
    solution = solved(geometry())
    report = check_map(solution.table(4))
    assert report.verdict == "good"
    assert report.area_error < 2e-3
    work = np.trapezoid(solution.tau[-1], solution.theta_e) / 4
    gain = solution.coenergy[-1, -1] - solution.coenergy[-1, 0]
    assert work == pytest.approx(gain, rel=0.02)
    assert made[2]["R_ohm"] == pytest.approx(solution.R_ohm)
    assert made[2]["tau_peak_Nm"] == pytest.approx(solution.tau.max())


@pytest.mark.long
def test_a_machine_of_a_geometry_is_copied_and_its_file_fits_the_schema(made, tmp_path):
    import jsonschema

    path = write(tmp_path / "d.toml", drive({}))
    path.write_text(f'machine = "{made[0]}"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load(path)
    machine = first.machine.model_copy(update={"R_ohm": 1.0})
    assert machine.R == pytest.approx(1.0) and machine.J_kgm2 == first.machine.J_kgm2
    first.save(tmp_path / "saved.toml")
    judge = jsonschema.Draft202012Validator(json.loads(command("schema").out))
    saved = read_toml(tmp_path / "saved.toml")
    assert judge.is_valid(saved), list(judge.iter_errors(saved))[:1]
    saved["machine"]["stator"]["pole_arcs_deg"] = 3.0
    assert not judge.is_valid(saved)


@pytest.mark.long
def test_a_saved_machine_of_a_geometry_keeps_its_steel_and_is_one_of_a_kind(tmp_path, monkeypatch):
    """The B-H file is found from another folder, and a store of sweeps has all of the geometry: a
    coarser map changes no other key of the machine."""
    (tmp_path / "given").mkdir()
    (tmp_path / "saved").mkdir()
    monkeypatch.chdir(tmp_path / "given")
    points = [f"{h},{b}" for h, b in zip(*grade("M400-50A"), strict=True)]
    Path("bh.csv").write_text("\n".join(points))
    coarse = {"map__angles": 13, "map__currents": 6}
    write(Path("lam.toml"), changed(lamination__steel="bh.csv", **coarse))
    write(Path("d.toml"), drive({}))
    path = Path("d.toml")
    path.write_text('machine = "lam.toml"\n' + path.read_text().replace("[machine]\n", ""))
    first = rl.load("d.toml")
    first.save("../saved/d.toml")
    monkeypatch.chdir(tmp_path)
    assert rl.load("saved/d.toml").machine.R == first.machine.R
    assert [file.name for file in first.machine.files] == ["bh.csv"]
    monkeypatch.chdir(tmp_path / "given")
    finer = rl.load("d.toml", ["machine.map.angles=14"])
    assert finer.machine.R == first.machine.R
    assert fingerprint(finer, 0.1) != fingerprint(first, 0.1)


def test_pairs_of_a_geometry_are_scaled_by_what_a_control_believes(monkeypatch):
    """By the factor on all flux linkage and by the one on pairs; the field is not solved for it."""
    monkeypatch.setattr(
        geometry_machine, "_solution", lambda *_: SimpleNamespace(R_ohm=1.0, J_kgm2=1e-3)
    )
    monkeypatch.setattr(
        geometry_machine, "_coupling", lambda *_: SimpleNamespace(times=lambda x: x)
    )
    table = flattened(changed(map__coupling="pairs"))
    machine = geometry_machine.GeometryMachine.from_table(table, "[machine]")
    assert machine.coupled and machine.coupling == 1
    assert machine.computed(psi_factor=0.5, pair_factor=0.8).coupling == pytest.approx(0.4)
    monkeypatch.setattr(geometry_machine, "_coupling", lambda *_: None)
    assert machine.coupling is None


def test_pairs_are_held_against_the_magnetics_that_were_solved(monkeypatch):
    """Without the factors of what a control believes: those come later, for both alike."""
    geometry = geometry_of(flattened(changed(map__coupling="pairs")), "[machine]")
    monkeypatch.setattr(geometry_machine, "_magnetics", lambda *given: given)
    monkeypatch.setattr(geometry_machine, "coupling_of", lambda *given: given)
    text = geometry.model_dump_json()
    pairs_of = geometry_machine._coupling.__wrapped__
    found, magnetics, i_max = pairs_of(text, b"steel", 4, 12.0)
    assert (found, i_max) == (geometry, 12.0) and magnetics == (text, b"steel", 4, 1.0)
    alone = geometry_of(flattened(changed()), "[machine]").model_dump_json()
    assert pairs_of(alone, b"steel", 4, 12.0) is None
