"""What the page of the studio is written with, without a browser."""

import contextlib
import http.client
import json
import shutil
import subprocess
import sys
from importlib import import_module
from threading import Thread

import numpy as np
import pytest
from firmware_tools import ROOT
from needs import needs

import reluctance as rl
from reluctance.targets.studio import controls, write
from reluctance.targets.studio.controls import (
    CONTROLS,
    Control,
    around,
    between,
    choice,
    given_value,
    offered,
    parameters,
    periods,
    tables,
)
from reluctance.targets.studio.serve import page
from reluctance.targets.studio.starts import STARTS
from reluctance.targets.studio.write import curves

OF_A_TRIP = {"supervision.fault", "supervision.fault_s"}


def test_the_curves_behind_the_energy_loop_are_flux_linkages():
    """Unaligned, the flux linkage of this model is L_u i; aligned, it saturates below L_a i."""
    drive = rl.load(ROOT / "examples" / "paper_rated.toml")
    machine, found = drive.machine, curves(drive)
    i, psi = np.array(found["i"]), np.array(found["psi"])
    assert (found["deg"][0], found["deg"][-1]) == (0, 180)
    assert (i[0], i[-1]) == (0, machine.i_max_A)
    assert psi[0] == pytest.approx(machine.L_u_H * i, rel=1e-4)
    assert np.all(np.diff(psi, axis=0)[:, 1:] > 0)
    assert np.all(psi[-1, 1:] < machine.L_a_H * i[1:])


def test_the_page_has_a_file_of_each_drive_that_keeps_every_point_and_a_list(monkeypatch, tmp_path):
    def content(drive, *, record):
        return f"{drive.control.law} {record:g}".encode()

    monkeypatch.setattr(write, "blob", content)
    monkeypatch.setattr(write, "STARTS", STARTS[:2])
    monkeypatch.setattr(write, "about", lambda start, drive: {"name": start.name})
    names = [start.name for start in STARTS[:2]]
    files = write.write_data(tmp_path)
    assert [file.name for file in files] == ["drives.json", *(f"{name}.srm" for name in names)]
    assert json.loads(files[0].read_text()) == [{"name": name} for name in names]
    assert [file.read_text() for file in files[1:]] == [
        f"{start.drive().control.law} 0" for start in STARTS[:2]
    ]


def test_values_of_a_control_lie_around_the_given_one_and_hold_it():
    values = around(0.1, 2.0)(1500)
    assert values[0] == 150 and values[-1] == 3000 and 1500.0 in values and len(values) <= 26
    assert values == sorted({*values}) and all(v == float(f"{v:.2g}") for v in values)
    assert 1234.0 in around(0.5, 1.5)(1234)  # not rounded
    assert between(-4, 4, 2)(None) == [-4, -2, 0, 2, 4]
    assert between(-4, 4, 2)(1) == [-4, -2, 0, 1, 2, 4]
    assert between(0.1, 0.3, 0.1)(0.2) == [0.1, 0.2, 0.3]
    assert choice(0, 4, 2)(3) == [0, 2, 3, 4]
    assert periods(20) == [5, 10, 20, 50, 100] and periods(4) == [2, 4, 5, 10, 20]
    assert periods(25) == [10, 20, 25, 50, 100]


def test_a_control_sets_the_numbers_of_the_drive_with_its_value():
    given = ["sensing.i_range_A=200", "sensing.adc_bits=8"]
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml", given)
    for key, name in (
        ("sensing.adc_bits", "Current resolution"),
        ("converter.dead_time_us", "Dead time"),
    ):
        (control,) = [c for c in CONTROLS if c.key == key]
        found = offered(drive, control)
        assert found["label"] == name and found["given"] in found["values"]
        assert found["values"] == sorted(found["values"]) and not found["off_design"]
        for value, n in ((found["values"][0], 0), (found["values"][-1], -1)):
            one = drive.with_values({key: value})
            numbers = parameters(one, of_control=False) | parameters(one, of_control=True)
            for name, column in found["sets"].items():
                assert column[n] == numbers[name], name
        unlike = {name for name, column in found["sets"].items() if len(set(column)) > 1}
        assert unlike == set(found["sets"]) and unlike


def test_a_control_that_a_drive_does_not_have_is_not_offered():
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml")
    absent = {c.key for c in CONTROLS if c.key in ("control.i_ref_A", "control.f_switch_kHz")}
    assert absent
    for control in CONTROLS:
        if control.key in absent:
            assert offered(drive, control) is None
    with pytest.raises(KeyError):
        given_value(drive, "control.i_ref_A")
    assert given_value(drive, "load.speed_rpm") == 1500


def test_every_control_is_offered_by_a_drive_of_the_page():
    """A key that no drive has any more would leave its slider out without a word."""
    left = {control.key for control in CONTROLS}
    for start in STARTS:
        drive = start.drive()
        for key in sorted(left):
            with contextlib.suppress(KeyError):
                if given_value(drive, key) is not None:
                    left.discard(key)
    assert left <= OF_A_TRIP, left
    supervised = next(s for s in STARTS if s.name == "supervised").drive()
    assert all(given_value(supervised, key) is not None for key in OF_A_TRIP)


def test_only_numbers_become_a_table_and_not_more_than_fifty():
    given = {1: {"a": 1.0, "b": 2.0}, 2: {"a": 1.5, "b": 2.0}}
    assert tables(given, 1) == {"a": {1: 1.0, 2: 1.5}}
    assert tables({1: {"a": 1.0}, 2: {"b": 1.0}}, 1) is None  # another drive
    assert tables({1: {"a": (1.0,)}, 2: {"a": (2.0,)}}, 1) is None  # a long table differs
    assert tables({1: {"a": (1.0,)}, 2: {"a": (1.0,)}}, 1) == {}
    assert tables({1: {"x|kind": 1.0}, 2: {"x|kind": 2.0}}, 1) is None
    for count in (50, 51):
        many = {v: {f"n{k}": float(v) for k in range(count)} for v in (1, 2)}
        assert (tables(many, 1) is None) == (count > 50)


@needs("make")
@pytest.mark.parametrize("installed", [True, False], ids=["installed", "in the source tree"])
def test_make_studio_puts_the_page_where_the_command_serves_it(installed, tmp_path, monkeypatch):
    """With a compiler and a `reluctance` that only write files: the steps of the target."""
    package = tmp_path / ("site" if installed else "python") / "reluctance"
    (package / "base").mkdir(parents=True)
    for part in ("base/__init__.py", "__init__.py"):
        (package / part).touch()
    shutil.copy(ROOT / "python/reluctance/base/resources.py", package / "base")
    tools = tmp_path / "bin"
    tools.mkdir()
    scripts = {
        "c++": 'for last; do true; done; case "$last" in -) ;; *) echo wasm > "$last";; esac',
        "reluctance": 'mkdir -p "$3" && echo "{}" > "$3/drives.json"',
        "python": f'exec env PYTHONPATH="{package.parent}" {sys.executable} "$@"',
    }
    for name, line in scripts.items():
        (tools / name).write_text(f"#!/bin/sh\n{line}\n")
        (tools / name).chmod(0o755)
    shutil.copy(ROOT / "Makefile", tmp_path)
    pages = [tmp_path / "web", *([package / "web"] if installed else [])]
    for folder in pages:
        folder.mkdir()
        (folder / "index.html").touch()
    kept = [word for name in ("installed", "made") for word in ("-o", f".venv/{name}")]
    subprocess.run(
        ["make", "studio", *kept, f"BIN={tools}", f"WASM_CXX={tools}/c++"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    monkeypatch.setitem(page.__globals__, "resources", lambda name: pages[-1])
    assert page() == pages[-1]  # which needs all that the browser loads


def test_two_controls_of_one_parameter_do_not_stand_side_by_side(monkeypatch):
    """The first stays; of an operating point what the plant has of it."""
    sets = {
        "a": {"control.x": [1], "load.y": [1]},
        "b": {"control.x": [2], "plant.z": [2]},  # an operating point
        "c": {"load.y": [3]},
        "d": None,
        "e": {"plant.w": [5]},
        "f": {"control.x": [6]},  # an operating point of the control alone
    }
    given = [Control(key, "", "", lambda value: [], off_design=key in "bf") for key in sets]
    monkeypatch.setattr(controls, "CONTROLS", given)
    monkeypatch.setattr(
        controls,
        "offered",
        lambda drive, control: (
            sets[control.key] and {"key": control.key, "off_design": 0, "sets": sets[control.key]}
        ),
    )
    kept = {one["key"]: one for one in controls.controls_of(None)}
    assert [*kept] == ["a", "b", "e", "f"]
    assert kept["a"]["sets"] == sets["a"] and kept["e"]["sets"] == sets["e"]
    assert kept["b"]["sets"] == {"plant.z": [2]} and kept["b"]["off_design"] is True
    assert kept["f"]["sets"] == {} and kept["a"]["off_design"] == 0


class Valued:
    """A drive that is its value."""

    def __init__(self, value):
        self.value = value

    def with_values(self, values):
        (value,) = values.values()
        if value == 9:
            raise rl.ParameterError("not of this drive")
        return Valued(value)


@pytest.mark.parametrize("off_design", [False, True])
@pytest.mark.parametrize("law", ["numbers", "tables", "nothing"])
@pytest.mark.parametrize("plant", ["numbers", "nothing", "tables"])
def test_a_control_is_offered_where_single_numbers_follow_it(monkeypatch, plant, law, off_design):
    """Those of the plant always; where the law has tables, an operating point leaves its design."""

    def numbers(drive, *, of_control):
        kind, name = (law, "control.g") if of_control else (plant, "load.s")
        found = {"numbers": drive.value, "tables": (drive.value,) * 20, "nothing": 0.0}[kind]
        return {name: found, "load.J": 1.0} if not of_control else {name: found}

    monkeypatch.setattr(controls, "given_value", lambda drive, key: 2)
    monkeypatch.setattr(controls, "parameters", numbers)
    one = controls.offered(
        Valued(2), Control("k", "Label", "A", lambda value: [3, 2, 1, 9], off_design)
    )
    changes = plant == "numbers" or law == "numbers"
    if plant == "tables" or (law == "tables" and not off_design) or not changes:
        assert one is None
        return
    assert (one["key"], one["label"], one["unit"], one["given"]) == ("k", "Label", "A", 2)
    assert one["values"] == [1, 2, 3] and one["off_design"] is (law == "tables")
    assert one["sets"] == {
        **({"load.s": [1, 2, 3]} if plant == "numbers" else {}),
        **({"control.g": [1, 2, 3]} if law == "numbers" else {}),
    }
    assert controls.offered(Valued(2), Control("k", "", "", lambda value: [2])) is None
    two = controls.offered(Valued(2), Control("k", "", "", lambda value: [2, 1], off_design))
    assert two is not None and two["values"] == [1, 2]


def test_a_drive_without_a_torque_has_no_limit_to_show(monkeypatch):
    class Limit:
        def with_units(self):
            return {"tau_Nm": 3.0}

    monkeypatch.setattr(write.limits, "limit", lambda drive: Limit())
    assert write.limit(None) == {"tau_Nm": 3.0}

    def none(drive):
        raise rl.ParameterError("asks for no torque")

    monkeypatch.setattr(write.limits, "limit", none)
    assert write.limit(None) is None


def test_the_server_names_the_kinds_of_its_files_and_writes_no_line_for_each(
    tmp_path, monkeypatch, capsys
):
    server = import_module("reluctance.targets.studio.serve")
    monkeypatch.setattr(server, "page", lambda: tmp_path)
    kinds = {"a.js": "text/javascript", "b.wasm": "application/wasm", "c.html": "text/html"}
    kinds["d.srm"] = "application/octet-stream"
    for name in kinds:
        (tmp_path / name).write_text(name)
    with server.serve(0) as running:
        port = running.server_address[1]
        thread = Thread(target=running.serve_forever)
        thread.start()
        try:
            for name, kind in kinds.items():
                link = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                link.request("GET", f"/{name}")
                answer = link.getresponse()
                assert answer.read().decode() == name
                assert answer.headers["Content-Type"].partition(";")[0] == kind
                link.close()
            with pytest.raises(rl.ParameterError, match=f"--port {port}: .*; take another"):
                server.serve(port)
        finally:
            running.shutdown()
            thread.join()
    assert capsys.readouterr() == ("", "")


def test_the_page_knows_a_drive_by_its_file(monkeypatch):
    """With the machine by its name in the library, also where the page changes it."""
    for name in ("controls_of", "limit", "curves"):
        monkeypatch.setattr(write, name, lambda drive, name=name: name)
    drive = rl.load(ROOT / "examples" / "sharing_cubic.toml")
    found = write.about(write.Start("short", "sharing_cubic"), drive)
    assert (found["name"], found["law"]) == ("short", "torque_sharing")
    assert found["title"] == drive.control.title
    assert write.about(write.Start("s", "sharing_cubic", title="mine"), drive)["title"] == "mine"
    machine = drive.machine
    poles = (machine.N_s, machine.N_r, machine.n_phases)
    assert (found["N_s"], found["N_r"], found["n_phases"]) == poles
    assert (found["i_max"], found["R"]) == (machine.i_max_A, machine.R_ohm)
    assert found["i_known"] == 1e12  # of a formula: JSON has no infinity
    assert found["follows_torque"] is True and found["supervised"] is False
    assert found["until"] == drive.simulation.until_s
    assert [found[name] for name in ("controls", "limit", "curves")] == [
        "controls_of",
        "limit",
        "curves",
    ]
    assert found["tables"]["machine"] == "paper_6_4"
    assert found["tables"]["control"]["law"] == "torque_sharing"
    other = write.Start("s", "sharing_cubic", {"machine": "npf_vector_6_4"})
    assert write.given_tables(other, drive)["machine"] == "npf_vector_6_4"
    assert all(found["tables"].values())
