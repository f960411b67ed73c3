"""What commands of maps and machines print of findings that are given: nothing is solved."""

import json
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace as Namespace

import pytest
from command import command, refused, words

import reluctance as rl
from reluctance.base.errors import ParameterError
from reluctance.cli import map_identify, map_identify_pairs, map_import_pairs

# map identify --pairs --out


@pytest.mark.parametrize(("good", "told"), [(7.0, "pass --i_max_A 6.94, here"), (0.0, "")])
def test_pairs_that_make_no_machine_are_answered_with_a_current_that_does(monkeypatch, good, told):
    """The first of 10 A times a power of 0.97 at which they do; nothing is written."""

    def check(coupling, magnetics, i_max):
        if i_max > good:
            raise ParameterError(f"no inductance at {i_max:g} A")

    coupling = import_module("reluctance.machine.coupling")
    pairs = import_module("reluctance.machine.measured_pairs")
    file = import_module("reluctance.machine.pair_file")
    found = Namespace(coupling=Namespace(pairs=()), i_reached=10.0)
    monkeypatch.setattr(coupling, "check_pairs", check)
    monkeypatch.setattr(pairs, "kinds_of", lambda *_: [])
    monkeypatch.setattr(pairs, "measured_pairs", lambda *_, **__: found)
    monkeypatch.setattr(file, "check_ring", lambda *_: None)
    machine = Namespace(coupling=None, magnetics=None, n_phases=3)
    with pytest.raises(ParameterError) as fault:
        map_identify_pairs._table(Namespace(machine=machine, tau_max=1.0), [], 0.5, None, 10.0)
    line = str(fault.value)
    assert line.startswith("no inductance at 10 A")
    if told:
        assert line.endswith(f"; {told} and in the machine file")
        assert 10 * 0.97**11 > 7 > 10 * 0.97**12 > 6.93
    else:
        assert "--i_max_A" not in line


# machine from-geometry


def test_a_machine_is_not_written_from_a_mesh_that_moves_by_a_twentieth(monkeypatch, tmp_path):
    room = import_module("reluctance.machine.geometry.from_geometry")
    package = import_module("reluctance.machine.geometry")
    saved = []
    made = Namespace(
        geometry="g", figures={"N_r": 4}, lines=lambda: ["a line"],
        save=lambda out: saved.append(out) or [out], plot=lambda path: saved.append(path),
    )  # fmt: skip
    monkeypatch.setattr(room, "machine_from_geometry", lambda path, progress: made)
    out, plot = tmp_path / "m.toml", tmp_path / "p.png"
    order = ("machine", "from-geometry", "g.toml", "--out", out, "--plot", plot)
    for name in ("psi_change", "tau_change", "tau_rough"):
        for value, passes in ((0.049, True), (-0.051, False)):
            point = {"theta_e_deg": 45.0, "psi_change": 0.001, "tau_change": 0.002}
            point |= {"tau_rough": 0.003} | {name: value}
            monkeypatch.setattr(package, "convergence", lambda _, point=point: [point])
            saved.clear()
            if not passes:
                line = refused(*order, "--convergence")
                assert "moves flux linkage or torque by 5.1 %, need at most 5 %" in line
                assert not saved
                continue
            told = command(*order, "--convergence")
            assert told.code == 0 and saved == [out, plot]
            said = words(told.out)
            assert said.startswith("a line mesh doubled at 45 deg el.: flux linkage moves by")
            assert "the mesh is fine enough: no change over 5 %" in said
            assert f"{out} {plot} next: reluctance run DRIVE.toml --set machine={out}" in said
    shown = json.loads(command(*order[:3], "--json").out)
    assert shown == {"N_r": 4, "convergence": []}
    plain = command(*order[:3]).out
    assert plain == "a line\n"


# map identify


def test_pairs_are_told_by_their_factor_and_what_its_error_costs(monkeypatch, capsys):
    pairs = import_module("reluctance.machine.identify_pairs")
    told = Namespace(
        n_pulses=9, n_positions=3, factor=1.25, error=0.02, of_pair={"ab": 1.2, "bc": 1.3},
        residual=1e-4, psi_rms=4e-3, differ=False,
    )  # fmt: skip
    monkeypatch.setattr(pairs, "pair_factor", lambda *_: told)
    monkeypatch.setattr(pairs, "phase_of_first", lambda *_: 0)
    monkeypatch.setattr(pairs, "pair_torque", lambda *_: 2.0)
    machine = Namespace(coupling="c", magnetics="m", pair_factor=0.8)
    drive = Namespace(machine=machine, tau_max=10.0, omega_nominal=1.0, at=lambda omega: None)
    map_identify_pairs._factor(drive, [], 0.5, alone=True)
    assert words(capsys.readouterr().out) == (
        "9 pulses at 3 clamped positions the pairs are 1.2500 +- 0.0200 of those believed (ab "
        "1.200, bc 1.300) left over: 0.1 mWb rms, where the pairs add 5 mWb the pairs as believed "
        "make 2 N m rms at 10 N m: the error of the factor costs 0.4 % of the torque, the believed "
        "factor 5 % next: pair_factor = 1 in the machine file, or --set machine.pair_factor=1"
    )
    told.differ = True
    with pytest.raises(ParameterError, match=r"right: ab 1\.200, bc 1\.300; .*: --out PAIRS\.csv$"):
        map_identify_pairs._factor(drive, [], 0.5, alone=True)
    map_identify_pairs._factor(drive, [], 0.5, alone=False)  # a table comes next
    monkeypatch.setattr(pairs, "phase_of_first", lambda *_: 2)
    with pytest.raises(ParameterError, match="where leg a drives phase c, and every other leg"):
        map_identify_pairs._factor(drive, [], 0.5, alone=False)


@pytest.mark.parametrize(
    ("coupling", "out", "ran"),
    [
        (None, None, "refused"), (Namespace(factor=0.0), None, "refused"),
        (Namespace(factor=1.0), None, ["factor"]),
        (Namespace(factor=1.0), "p.csv", ["factor", 5.0]), (None, "p.csv", [5.0]),
    ],
)  # fmt: skip
def test_a_factor_needs_pairs_that_are_believed_and_a_table_a_place(
    monkeypatch, tmp_path, coupling, out, ran
):
    calls = []
    machine = Namespace(coupling=coupling, n_phases=3, i_max_A=5.0)
    monkeypatch.setattr(map_identify_pairs, "load", lambda _: Namespace(machine=machine))
    held = import_module("reluctance.machine.held_pulses")
    monkeypatch.setattr(held, "read_held_pulses", lambda *_, **__: [])
    monkeypatch.setattr(map_identify_pairs, "_factor", lambda *_, alone: calls.append("factor"))
    monkeypatch.setattr(map_identify_pairs, "_table", lambda *given: calls.append(given[-1]))
    place = None if out is None else tmp_path / out

    def identify(i_max):
        map_identify_pairs.identify_pairs([], Path("d.toml"), 0.5, place, i_max)

    if ran == "refused":
        with pytest.raises(ParameterError, match=r"the machine of d\.toml has no pairs, need"):
            identify(None)
        return
    identify(None)
    assert calls == ran
    identify(3.0)
    assert calls[len(ran) :] == [3.0 if call == 5.0 else call for call in ran]


@pytest.mark.parametrize("most", [11.7, 8.1, 3.0])
def test_pairs_without_inductance_are_answered_with_a_current_that_has_one(
    monkeypatch, tmp_path, most
):
    """Asked for 13.6 A; a table to `most` is the greatest that has one."""
    room = "reluctance.machine"
    measured, coupling, filed = (
        import_module(f"{room}.{name}") for name in ("measured_pairs", "coupling", "pair_file")
    )

    def check(_, __, i_max):
        if i_max > most:
            raise ParameterError("no inductance")

    def measure(*_, i_max, **__):
        return Namespace(coupling=Namespace(pairs=()), i_reached=min(i_max, 14.3))

    monkeypatch.setattr(measured, "kinds_of", lambda *_: [])
    monkeypatch.setattr(measured, "measured_pairs", measure)
    monkeypatch.setattr(coupling, "check_pairs", check)
    monkeypatch.setattr(filed, "check_ring", lambda *_: None)
    machine = Namespace(coupling="c", magnetics="m", n_phases=3)
    drive = Namespace(machine=machine, tau_max=10.0)
    with pytest.raises(ParameterError) as fault:
        map_identify_pairs._table(drive, [], 0.5, tmp_path / "p.csv", 13.6)
    line = str(fault.value)
    if most < 13.6 / 2:
        assert line == "no inductance"
        return
    able = float(line.partition("no inductance; pass --i_max_A ")[2].partition(",")[0])
    assert 0.965 * most < able <= most


def test_names_of_columns_are_stated_for_known_quantities():
    assert map_identify._names(["t=time", "u=U 1", "theta=a=b"]) == {
        "t": "time", "u": "U 1", "theta": "a=b",
    }  # fmt: skip
    assert map_identify._names(None) == {}
    for wrong in ("t", "t=", "x=time", "=time"):
        with pytest.raises(ParameterError, match=f"--name {wrong}: need t=NAME"):
            map_identify._names([wrong])


def test_options_of_a_map_do_not_go_with_pairs():
    map_identify._only_with_a_map(N_r=None, zero=None)
    with pytest.raises(ParameterError, match="--N_r goes with a flux table, not with --pairs"):
        map_identify._only_with_a_map(zero=None, N_r=4)


# map import --pairs


@pytest.mark.parametrize(
    ("factors", "on_flux", "on_pairs"),
    [({}, 1.0, 1.0), ({"psi_factor": 2.0, "pair_factor": 0.5}, 2.0, 0.5)],
)
def test_pairs_are_taken_over_with_both_factors(monkeypatch, factors, on_flux, on_pairs):
    """That of the flux linkage is in the pairs, and that of the pairs stays a key."""
    monkeypatch.setattr(map_import_pairs, "replace", lambda pairs, factor: (pairs, factor))

    def taken(N_r=4, n_phases=3, coupling="pairs"):
        machine = Namespace(coupling=coupling, N_r=4, n_phases=3, **factors)
        monkeypatch.setattr(rl, "load", lambda _: Namespace(machine=machine))
        return map_import_pairs.taken_over(Path("d.toml"), N_r, n_phases)

    assert taken() == (("pairs", on_flux), on_pairs)
    with pytest.raises(ParameterError, match=r"d\.toml has no pairs; leave --pairs out"):
        taken(coupling=None)
    for other in ({"N_r": 6}, {"n_phases": 4}):
        with pytest.raises(ParameterError, match="has 3 phases and 4 rotor poles, the map "):
            taken(**other)
