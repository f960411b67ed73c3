"""Control laws of one's own, in C++: compiled in one command, named in a drive file, exported."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from firmware_tools import needs_target

import reluctance as rl
from reluctance import _core
from reluctance.base.errors import Note
from reluctance.base.toolchain import compiler
from reluctance.drive.laws import build, compiled_law, own_code
from reluctance.drive.laws.build import build_law, local_headers
from reluctance.explore.comparison import compare
from reluctance.targets.export import firmware
from reluctance.targets.export.fmu import fmu
from reluctance.targets.export.parity import check_parity

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "own_law"


@pytest.fixture(scope="module")
def drive_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example, compiled by the documented command in a folder outside of the tree."""
    folder = tmp_path_factory.mktemp("own")
    for name in ("own_law.hpp", "own_law_cpp.toml"):
        (folder / name).write_text((EXAMPLE / name).read_text())
    command = [sys.executable, "-m", "reluctance", "law", "build", "own_law.hpp"]
    done = subprocess.run([*command, "DeadbeatPulse"], cwd=folder, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == 'own_law.so: law = "cpp:own_law.so:DeadbeatPulse"\n'
    return folder / "own_law_cpp.toml"


class DeadbeatPulse(rl.Law):
    """The same law in Python, its inverse by bisection."""

    def reset(self, known: rl.Known) -> None:
        self.known = known

    def at(self, i: float, theta: float) -> tuple[float, float]:
        """Flux linkage [Wb] and torque [N m]."""
        row = _core.magnetics(self.known.magnetics, np.array([i]), np.array([theta]))
        return float(np.ravel(row)[0]), float(np.ravel(row)[1])

    def step(self, y: rl.Measurement, tau_ref: float) -> Sequence[rl.Order]:
        k, orders = self.known, []
        for phase in range(y.n_phases):
            theta = (y.angle(phase) + k.N_r * y.omega_m * k.T_s) % (2 * np.pi)
            if not np.radians(5) <= theta < np.radians(135):
                orders.append(rl.Order.hold(rl.Leg.demagnetize))
                continue
            low, high = 0.0, k.i_max
            for _ in range(60):
                i = (low + high) / 2
                low, high = (i, high) if k.machine.tau(i, theta) < tau_ref else (low, i)
            psi, psi_ref = (
                self.at(y.i[phase], y.angle(phase))[0],
                self.at((low + high) / 2, theta)[0],
            )
            orders.append(rl.Order.pwm((psi_ref - psi) / (k.T_s * y.u_dc), k.T_s))
        return orders


def test_compiled_law_is_its_formula(drive_file: Path) -> None:
    """Equal orders to the same law in Python, at every sample."""
    drive = rl.load(drive_file, trust=True)
    own = rl.simulate(drive, until=0.005)
    python = rl.simulate(drive, until=0.005, law=DeadbeatPulse())
    assert own.kpis.tau_mean == pytest.approx(python.kpis.tau_mean, rel=1e-4)
    t = np.linspace(0, 0.005, 1001)
    for k in range(3):
        a, b = (np.interp(t, r.t, r.i[k]) for r in (own, python))
        assert np.abs(a - b).max() < 0.01 * own.i.max()


def test_compiled_law_runs_in_single_precision(drive_file: Path) -> None:
    double = rl.load(drive_file, trust=True)
    single = double.with_values({"control.precision": "float"})
    a, b = (rl.simulate(d, record=None).kpis for d in (double, single))
    assert a.tau_mean != b.tau_mean
    assert a.tau_mean == pytest.approx(b.tau_mean, rel=1e-3)


def test_another_machine_and_phase_count_need_no_other_build(drive_file: Path) -> None:
    drive = rl.load(drive_file, ["machine=generic_1hp_8_6", "reference.tau_Nm=2"], trust=True)
    assert rl.simulate(drive, until=0.01).i.shape[0] == 4


@needs_target
def test_target_gives_the_same_bits(drive_file: Path) -> None:
    assert check_parity(rl.load(drive_file, trust=True), steps=2000).exact


def test_firmware_holds_the_header_that_was_compiled(drive_file: Path, tmp_path: Path) -> None:
    made = firmware(rl.load(drive_file, trust=True), tmp_path / "package")
    assert made.law == "DeadbeatPulse<srm::LeHuy<float>, 3>"
    copy = made.folder / "include" / "own_law.hpp"
    assert copy.read_text() == (EXAMPLE / "own_law.hpp").read_text()
    assert '#include "own_law.hpp"' in (made.folder / "parameters.hpp").read_text()


def test_compiled_law_competes_with_the_numbers_of_its_drive_file(drive_file: Path) -> None:
    law = f"cpp:{drive_file.parent / 'own_law.so'}:DeadbeatPulse"
    drive = rl.load(drive_file, trust=True)
    (entry,) = compare(drive, [law], f_switch=5e3, octaves=(), processes=1).entries
    assert entry.met and set(entry.values) == {"T_s_us"}


def test_compiled_law_needs_trust(drive_file: Path) -> None:
    with pytest.raises(rl.ParameterError, match="--trust"):
        rl.load(drive_file)


@pytest.mark.parametrize(
    ("overrides", "text"),
    [
        (["control.theta_off_deg="], r"missing key `theta_off` in \[control\]"),
        (["control.i_max_A=500"], r"i_max_A = 500, need <= \[machine\] i_max_A = 150; lower"),
        (["control.theta_off_deg="], r"give `theta_off` in SI, or with a known unit as its suffix"),
        (["control.theta_off_grad=3"], "and `grad` is no known unit .*; give `theta_off`, in SI$"),
        (["control.theta_of_deg=3"], "has no field `theta_of`; did you mean `theta_off`"),
        (["control.theta_on_deg=early"], r"\[control\] theta_on_deg = 'early', need a number$"),
        (["control.theta_on_deg=nan"], r"\[control\] theta_on_deg = nan, need finite numbers$"),
        (["control.theta_on_deg=-inf"], r"\[control\] theta_on_deg = -inf, need finite numbers$"),
        (["control.theta_on_deg=true"], "theta_on_deg = true, need a number in deg$"),
        (["control.T_s_s=1e-5"], "`T_s_us` and `T_s_s` are one quantity; give one of them$"),
        (["control.theta_on_deg=0,5"], "need a number; write a decimal point, as in 0.5$"),
        (["control.theta_on_deg=[1, 2]"], r"\[control\] DeadbeatPulse with theta_.*: TypeError"),
        (["control.law=cpp:own_law.so:Deadbeat"], "holds the law DeadbeatPulse, not Deadbeat"),
        (["control.law=cpp:gone.so:DeadbeatPulse"], "no such file"),
        (["control.law=cpp:own_law.hpp:DeadbeatPulse"], "is not a compiled law"),
    ],
)
def test_a_wrong_drive_file_is_one_line(
    drive_file: Path, overrides: list[str], text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(drive_file.parent)
    with pytest.raises(rl.ParameterError, match=text) as fault:
        rl.load(drive_file, overrides, trust=True)
    assert "\n" not in str(fault.value)


def test_a_law_of_other_headers_is_refused(
    drive_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled_law, "core_fingerprint", lambda: "0")
    with pytest.raises(rl.ParameterError, match="built against another version"):
        rl.load(drive_file, trust=True)


def test_an_edited_header_beside_a_law_is_told(
    drive_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "law"
    shutil.copytree(drive_file.parent, folder)
    header = folder / "own_law.hpp"
    monkeypatch.setattr(own_code, "_loaded", {})
    rl.load(folder / drive_file.name, trust=True)  # as compiled: the suite fails on any note
    header.write_text(header.read_text() + "// edited\n")
    monkeypatch.setattr(own_code, "_loaded", {})
    remedy = "`reluctance law build own_law.hpp DeadbeatPulse` builds it again"
    with pytest.warns(Note, match=f"own_law.hpp has been edited since own_law.so .*{remedy}"):
        rl.load(folder / drive_file.name, trust=True)


@pytest.mark.parametrize("beside", [True, False])
def test_a_compiled_law_that_hides_a_module_of_python_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder, beside: bool
) -> None:
    """Python takes own_law.so for `import own_law`, before own_law.py."""
    monkeypatch.setattr(build, "_compile", lambda header, name, texts, out: out.write_text(""))
    (tmp_path / "own_law.hpp").write_text((EXAMPLE / "own_law.hpp").read_text())
    if beside:
        (tmp_path / "own_law.py").write_text("")
    build_law(tmp_path / "own_law.hpp", "DeadbeatPulse")
    assert [str(said.message).partition(" of")[0] for said in recwarn] == (
        ["`import own_law`"] if beside else []
    )


def test_the_compiler_may_be_a_command_with_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", "env 'g++'")
    assert compiler() == ["env", "g++"]
    monkeypatch.setenv("CXX", "no-such-compiler -O2")
    with pytest.raises(rl.ParameterError, match=r"no C\+\+ compiler; .* or set CXX"):
        compiler()


def test_a_header_that_does_not_compile_is_one_line(tmp_path: Path) -> None:
    """The first error with its line; nothing is left behind."""
    header = tmp_path / "wrong.hpp"
    header.write_text("#pragma once\ntemplate <srm::Machine M, int N>\nstruct Wrong { M machin }\n")
    with pytest.raises(rl.ParameterError, match=r"does not compile: wrong\.hpp:\d+: ") as fault:
        build_law(header, "Wrong")
    assert "\n" not in str(fault.value)
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.hpp"]


def test_a_law_whose_machine_is_not_its_first_field_is_told_so(tmp_path: Path) -> None:
    text = (EXAMPLE / "own_law.hpp").read_text()
    for first, later in (
        ("  M machine;\n  T i_max, T_s;\n", "  T i_max, T_s;\n  M machine;\n"),
        ("SRM_FIELDS(machine, i_max, T_s,", "SRM_FIELDS(i_max, T_s, machine,"),
    ):
        assert first in text
        text = text.replace(first, later)
    (tmp_path / "law.hpp").write_text(text)
    with pytest.raises(rl.ParameterError, match="machine has to be the first field of a law"):
        build_law(tmp_path / "law.hpp", "DeadbeatPulse")


def test_a_law_without_its_step_is_told_so(tmp_path: Path) -> None:
    text = (EXAMPLE / "own_law.hpp").read_text().replace(" step(State&", " stepp(State&")
    (tmp_path / "law.hpp").write_text(text)
    with pytest.raises(rl.ParameterError, match=r"a law needs State and Command<T, N> step\("):
        build_law(tmp_path / "law.hpp", "DeadbeatPulse")


@pytest.mark.parametrize(
    ("header", "name", "out", "text"),
    [
        ("gone.hpp", "Law", None, "no such file"),
        ("law.hpp", "Other", None, "has no `struct Other`"),
        ("law.hpp", "a::Law", None, "need the name of a struct"),
        ("law.hpp", "Law", "law.txt", "ending `.txt`"),
    ],
)
def test_wrong_arguments_of_a_build_are_one_line(
    tmp_path: Path, header: str, name: str, out: str | None, text: str
) -> None:
    (tmp_path / "law.hpp").write_text("struct Law {};")
    with pytest.raises(rl.ParameterError, match=text):
        build_law(tmp_path / header, name, out and tmp_path / out)


def test_letters_beyond_ascii_are_compiled_as_they_are(tmp_path: Path) -> None:
    """And quotes and lines as C++ quotes them; an escape of JSON would be another letter there."""
    text = build._source(
        tmp_path / "law.hpp", "Law", {"law.hpp": '// 90° is "\u03b8"\nstruct Law;\n'}
    )
    assert '"// 90° is \\"\u03b8\\"\\nstruct Law;\\n"' in text and "\\u" not in text


def test_headers_of_the_same_folder_belong_to_the_law(tmp_path: Path) -> None:
    (tmp_path / "a.hpp").write_text('#include "b.hpp"\n#include "srm/base/real.hpp"\n')
    (tmp_path / "b.hpp").write_text('#include "a.hpp"\n#include "gone.hpp"\n')
    assert set(local_headers(tmp_path / "a.hpp")) == {"a.hpp", "b.hpp"}


@pytest.mark.parametrize("name", ["../../victim.hpp", "/victim.hpp", "sub/../../victim.hpp"])
def test_a_header_from_outside_of_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    """An export would write it outside of its own folder, over whatever is there."""
    folder = tmp_path / "a" / "b"
    (folder / "sub").mkdir(parents=True)
    (folder / "law.hpp").write_text(f'#  include  "{name}"\nstruct Law {{}};')
    (tmp_path / "victim.hpp").write_text("")
    with pytest.raises(rl.ParameterError, match="outside of the folder of the law, need it there"):
        build_law(folder / "law.hpp", "Law")
    (folder / "law.hpp").write_text('#include "srm/../../victim.hpp"\nstruct Law {};')
    with pytest.raises(rl.ParameterError, match="outside of the folder of the law"):
        build_law(folder / "law.hpp", "Law")


def test_a_header_below_the_folder_includes_from_its_own_place(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "a.hpp").write_text('#include "sub/b.hpp"\n')
    (tmp_path / "sub" / "b.hpp").write_text('#include "../c.hpp"\n#include "d.hpp"\n')
    (tmp_path / "c.hpp").write_text("")
    (tmp_path / "sub" / "d.hpp").write_text("")
    assert set(local_headers(tmp_path / "a.hpp")) == {"a.hpp", "sub/b.hpp", "c.hpp", "sub/d.hpp"}


@pytest.mark.parametrize("export", [firmware, fmu])
@pytest.mark.parametrize("where", ["name", "include"])
def test_an_export_writes_no_header_outside_of_its_folder(
    drive_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    export: Callable[[rl.Drive, Path], object],
    where: str,
) -> None:
    """Even where the compiled file says so: whoever made it."""
    drive = rl.load(drive_file, trust=True)
    module = own_code.module_of(own_code.own_code(drive.control.law))
    texts = dict(module.HEADERS)
    if where == "name":
        texts["../../../victim.hpp"] = "over"
    else:
        texts["own_law.hpp"] += '\n#include "srm/../../victim.hpp"\n'
    monkeypatch.setattr(module, "HEADERS", texts)
    (tmp_path / "out" / "deep").mkdir(parents=True)
    with pytest.raises(rl.ParameterError, match="outside of the folder of the law"):
        export(drive, tmp_path / "out" / "deep" / "made.fmu")
    assert [p.name for p in tmp_path.rglob("*")] == ["out", "deep"]
