"""Whatever is written is written whole or not at all, and what the disk, the pipe or a signal does
to it is one line and exit code 2."""

import contextlib
import ctypes
import os
import resource
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from command import command, refused

from reluctance import _core, paper
from reluctance.paper import report

ROOT = Path(__file__).parents[2]
RATED = ROOT / "examples" / "paper_rated.toml"
DAY = ROOT / "examples" / "sun_day.toml"
OWN = ROOT / "examples" / "own_law" / "own_law.hpp"
CUBIC = ROOT / "examples" / "sharing_cubic.toml"
RUN = ("run", RATED, "--until", "0.02")
SWEEP = ("sweep", RATED, "--vary", "control.i_band_A=1,2", "--until", "0.02")
MAPPED = ("efficiency", CUBIC, "--speed", "900,1500", "--torque", "10,30", "--no-envelope")
TUNED = (
    *("tune", CUBIC, "--vary", "control.i_band_A=1:2", "--minimise", "i_rms"),
    *("--budget", "4", "--until", "0.02"),
)
MAP = ("--N_r", 4)
WINDING = ("--N_s", "6", "--R_ohm", "1", "--J_kgm2", "0.01")

# Every writer of a file or folder: its command but for the place, and the name of what it writes.
WRITERS = {
    "csv": ((*RUN, "--out"), "w.csv"),
    "npz": ((*RUN, "--out"), "w.npz"),
    "parquet": ((*RUN, "--out"), "w.parquet"),
    "mat": ((*RUN, "--out"), "w.mat"),
    "png": ((*RUN, "--plot"), "w.png"),
    "svg": ((*RUN, "--plot"), "w.svg"),
    "pdf": ((*RUN, "--plot"), "w.pdf"),
    "html": ((*RUN, "--plot"), "w.html"),
    "energy loop": ((*RUN, "--energy-loop"), "w.png"),
    "limit profile": (("limit", RATED, "--out"), "w.csv"),
    "limit envelope": (("limit", RATED, "--envelope"), "w.csv"),
    "limit figure": (("limit", RATED, "--plot"), "w.png"),
    "map figure": (("map", "plot", "MAP", *MAP, "--out"), "w.png"),
    "map repair": (("map", "check", "MAP", *MAP, "--repair"), "w.csv"),
    "machine file": (("map", "import", "MAP", *MAP, *WINDING, "--out"), "w.toml"),
    "schema": (("schema", "--out"), "w.json"),
    "firmware": (("export", "firmware", RATED, "--out"), "firmware"),
    "blob": (("export", "blob", RATED, "--out"), "w.srm"),
    "fmu": (("export", "fmu", RATED, "--out"), "w.fmu"),
    "compare": (("compare", RATED, "--controls", "sharing_cubic", "--out"), "compared"),
    "compare figure": (("compare", RATED, "--controls", "sharing_cubic", "--plot"), "w.png"),
    "sweep store": ((*SWEEP, "--out"), "w.sqlite"),
    "sweep table": ((*SWEEP, "--table"), "w.csv"),
    "sweep figure": ((*SWEEP, "--plot"), "w.png"),
    "tuned drive": ((*TUNED, "--out"), "w.toml"),
    "tuning table": ((*TUNED, "--table"), "w.csv"),
    "tuning figure": ((*TUNED, "--plot"), "w.png"),
    "efficiency table": ((*MAPPED, "--out"), "w.csv"),
    "efficiency figure": ((*MAPPED, "--plot"), "w.png"),
    "paper": (("paper", "--out"), "paper"),
    "examples": (("examples", "--copy"), "copied"),
    "pump": (("pump", DAY, "--out"), "pumped"),
    "drive of a pump": (("pump", DAY, "--write-drive"), "w.toml"),
    "studio": (("studio", "--data"), "data"),
    "law": (("law", "build", OWN, "DeadbeatPulse", "--out"), "w.so"),
    "size": (("size", DAY, "--vary", "array.n_parallel=5:7", "--out"), "sized"),
}
FOLDERS = {"firmware", "compare", "paper", "examples", "pump", "size", "studio"}
# These write as others do, after work that is long or needs a file of its own.
LIKE = {
    ("replay", "--plot"): "png",
    ("emulate", "--out"): "limit profile",
    ("map identify", "--out"): "map repair",
    ("machine from-geometry", "--out"): "machine file",
    ("machine from-geometry", "--plot"): "png",
}
READ = {"--torque", "--cycle", "--drive", "--pairs", "--wires"}
GROUPS = ("map", "export", "machine", "law")
# Among the proofs: those that write as another one does.
ALIKE = {
    *("parquet", "mat", "svg", "pdf", "html", "energy loop", "limit envelope", "map figure"),
    *("compare figure", "sweep table", "fmu"),
}
each_writer = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long) if name in ALIKE else name for name in WRITERS],
)


@pytest.fixture(scope="module")
def flux_map(tmp_path_factory):
    """A whole flux map, to be read."""
    path = tmp_path_factory.mktemp("map") / "map.csv"
    machine = _core.LeHuy(N_r=4, L_u=8.7e-3, L_a=0.25, L_sat=0.5e-3, i_m=5, psi_m=0.3)
    angles = np.linspace(0, np.pi, 13)
    rows = [",".join(["0", *(f"{np.degrees(a):g}" for a in angles)])]
    for i in np.linspace(0, 5, 9):
        psi = _core.magnetics(machine, np.full(13, i), angles)[:, 0]
        rows.append(",".join([f"{i:g}", *(f"{v:.9g}" for v in psi)]))
    path.write_text("\n".join(rows))
    return path


@pytest.fixture(autouse=True, scope="module")
def _quick(tmp_path_factory):
    """Long work is done once: the report's study, the comparison and its guide tables."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "study", lambda grid, progress: None)
        patch.setattr(report, "claims", lambda found: [])
        patch.setattr(
            report,
            "_contents",
            lambda *_: {"report.html": b"x" * 200_000, "claims.json": b"y" * 200_000},
        )
        _compiled_once(patch, tmp_path_factory.mktemp("unit") / "unit.so")
        patch.setattr(import_module("reluctance.base.toolchain"), "build", _any_library)
        patch.setattr(import_module("reluctance.targets.studio.write"), "about", lambda *_: {})
        _once(patch, "reluctance.explore.comparison", "compare")
        _once(patch, "reluctance.explore.limits", "limit")
        _once(patch, "reluctance.explore.limits", "envelope_of")
        _once(patch, "reluctance.cli.run", "simulate")
        yield


def _once(patch, module, name):
    place = import_module(module)
    original, known = getattr(place, name), {}

    def kept(*arguments, **options):
        if name not in known:
            known[name] = original(*arguments, **options)
        return known[name]

    patch.setattr(place, name, kept)


def _compiled_once(patch, made):
    """The mock-up unit: all of its writers give the same one."""
    module = sys.modules["reluctance.targets.export.fmu"]
    original = module.build

    def kept(sources, library, *arguments, **options):
        if not made.exists():
            original(sources, made, *arguments, **options)
        library.write_bytes(made.read_bytes())

    patch.setattr(module, "build", kept)


def arguments(name, place, flux_map):
    given, _ = WRITERS[name]
    return [flux_map if a == "MAP" else a for a in given] + [place]


def _any_library(sources, library, *arguments, folder, **options):
    made = Path(folder) / library
    made.write_bytes(b"x" * 100_000)
    return made


def everything(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*"))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.long] * (name == "fmu")) for name in WRITERS],
)
def test_it_writes(name, tmp_path, flux_map):
    """So that the refusals below are of the disk's making."""
    done = command(*arguments(name, tmp_path / WRITERS[name][1], flux_map))
    assert done.code == 0, done.error
    assert everything(tmp_path)
    assert all(p.stat().st_size > 0 for p in tmp_path.rglob("*") if p.is_file())


@each_writer
def test_a_missing_folder_is_one_line_and_named(name, tmp_path, flux_map):
    if name in FOLDERS:  # these make their folder: a file stands in its place instead
        (tmp_path / "none").write_text("")
    assert "none" in refused(*arguments(name, tmp_path / "none" / WRITERS[name][1], flux_map))
    assert everything(tmp_path) == (["none"] if name in FOLDERS else [])


@each_writer
def test_a_folder_in_place_of_a_file_and_the_other_way_round(name, tmp_path, flux_map):
    place = tmp_path / WRITERS[name][1]
    place.write_text("mine") if name in FOLDERS else place.mkdir()
    assert place.name in refused(*arguments(name, place, flux_map))
    assert everything(tmp_path) == [place.name]
    assert not place.is_file() or place.read_text() == "mine"


@contextlib.contextmanager
def full_disk(folder):
    """A folder on a disk of 4 KiB; where none may be mounted, no file may grow past a few bytes."""
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=4k", "none", folder], capture_output=True
    )
    if done.returncode == 0:
        try:
            (folder / "taken").write_bytes(b"x" * 4096)
            yield ["taken"]
        finally:
            subprocess.run(["umount", "-l", folder], check=True)
        return
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, before[1]))
    try:
        yield []
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@each_writer
def test_a_full_disk_is_one_line_and_leaves_nothing(name, tmp_path, flux_map):
    folder = tmp_path / "disk"
    folder.mkdir()
    with full_disk(folder) as there:
        line = refused(*arguments(name, folder / WRITERS[name][1], flux_map))
        left = [p for p in everything(folder) if not (folder / p).is_dir()]
        assert left == there
    assert "No space left" in line or "File too large" in line


@pytest.mark.parametrize("name", [n for n in WRITERS if n not in FOLDERS])
def test_a_full_disk_keeps_the_file_that_was_there(name, tmp_path, flux_map):
    place = tmp_path / WRITERS[name][1]
    place.write_text("mine")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, before[1]))
    try:
        refused(*arguments(name, place, flux_map))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert place.read_text() == "mine"
    assert everything(tmp_path) == [place.name]


def process(*arguments, **options):
    line = [sys.executable, "-m", "reluctance", *map(str, arguments)]
    return subprocess.Popen(line, stderr=subprocess.PIPE, text=True, **options)


def obey_permissions() -> None:
    """As root nothing is forbidden: the process gives up the rights to pass permissions over."""
    for overrides in (1, 2):  # CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH
        ctypes.CDLL(None).prctl(24, overrides, 0, 0, 0)  # PR_CAPBSET_DROP


def test_no_right_to_write_is_one_line(tmp_path):
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o555)
    for parent in [tmp_path, *tmp_path.parents[:2]]:
        parent.chmod(0o755)
    for name in ("csv", "firmware"):
        given, file = WRITERS[name]
        done = process(
            *given, folder / file, cwd="/", stdout=subprocess.DEVNULL, preexec_fn=obey_permissions
        )
        line = done.communicate(timeout=100)[1]
        assert done.returncode == 2, line
        assert line.startswith("error: ") and "right" in line and line.count("\n") == 1
    assert everything(folder) == []


PRINTING = {
    "key figures": RUN,
    "json": (*RUN, "--json"),
    "limit": ("limit", RATED),
    "machines": ("machines",),
    "examples": ("examples",),
    "an example": ("examples", "paper_rated"),
    "schema": ("schema",),
    "help": ("--help",),
    "bare": (),
}


def without_notes(text):
    """Those of a result that stands on standard output as JSON."""
    lines = text.splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("note: "))


@pytest.mark.parametrize("name", PRINTING)
def test_a_closed_pipe_ends_a_command_without_a_word(name):
    """As of `| head -1`; with the exit code of SIGPIPE, as other commands have it."""
    reading, writing = os.pipe()
    os.close(reading)
    done = process(*PRINTING[name], stdout=writing)
    os.close(writing)
    assert without_notes(done.communicate(timeout=100)[1]) == ""
    assert done.returncode == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("name", PRINTING)
def test_a_full_disk_under_the_output_is_one_line(name):
    with open("/dev/full", "w") as full:
        done = process(*PRINTING[name], stdout=full)
        line = without_notes(done.communicate(timeout=100)[1])
    assert (done.returncode, line.count("\n")) == (2, 1), line
    assert "No space left" in line


def test_the_list_has_every_option_that_names_a_place():
    """A new writer must join the list: every path option of the program is used by it."""
    import typer.main

    from reluctance.cli import app

    used = set(LIKE)
    for given, _ in WRITERS.values():
        words = [str(word) for word in given]
        name = " ".join(words[: 2 if words[0] in GROUPS else 1])
        used |= {(name, word) for word in words if word.startswith("--")}
    found = set()

    def visit(group, *names):
        for name, child in getattr(group, "commands", {}).items():
            visit(child, *names, name)
        for p in group.params:
            if p.param_type_name == "option" and "Path" in str(p.type_descriptor.annotation):
                found.update((" ".join(names), option) for option in p.opts)

    visit(typer.main.get_command(app))
    assert {option for option in found if option[1] not in READ} <= used
    assert len(found) > 30
    assert set(LIKE.values()) <= set(WRITERS)
    assert paper.write is report.write
