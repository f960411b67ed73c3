"""Keys that name files: resolved, written and hashed by one mark on the key."""

import random
import re
import shutil
from pathlib import Path

import pytest
from command import refused

import reluctance as rl
from reluctance.base.schema import Section, file_keys
from reluctance.explore.sweeps.fingerprint import fingerprint
from reluctance.plant.hydraulics import pump

EXAMPLES, MACHINES = (Path(__file__).parents[2] / x for x in ("examples", "machines"))
SYSTEM = (EXAMPLES / "paper_pump.toml").read_text()
CURVE = ["Q_m3ph,H_m,eta", "0,40,0", "20,36,0.55", "40,28,0.68", "60,16,0.6"]
PUMP = '[pump]\nn_ref_rpm = 1500\ncurve_csv = "curve.csv"\n'


def pumped(folder: Path, name: str) -> rl.Drive:
    """A drive on the pump of that name, or of a file from the folder of the drive file."""
    values = ("kind=pump", f"pump={name}", "D_mm=80", "H_static_m=12", "k_pump_Nms2=")
    (folder / "drive.toml").write_text(SYSTEM)
    return rl.load(folder / "drive.toml", [f"load.{value}" for value in values])


def test_an_edit_of_a_pump_curve_changes_the_fingerprint(tmp_path: Path) -> None:
    """The store of sweeps would else return the key figures of the old curve."""
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    (tmp_path / "pump.toml").write_text(PUMP)
    (tmp_path / "curve.csv").write_text("\n".join(CURVE))
    drive = pumped(tmp_path, str(tmp_path / "pump.toml"))
    before = fingerprint(drive, 0.1)
    row = random.Random(seed).randrange(2, 5)
    flow, head, eta = CURVE[row].split(",")
    changed = [*CURVE[:row], f"{flow},{float(head) - 1},{eta}", *CURVE[row + 1 :]]
    (tmp_path / "curve.csv").write_text("\n".join(changed))
    assert fingerprint(drive, 0.1) != before
    (tmp_path / "curve.csv").write_text("\n".join(CURVE))
    assert fingerprint(drive, 0.1) == before


def test_a_pump_of_the_library_is_part_of_the_fingerprint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = tmp_path / "pumps"
    shutil.copytree(pump.library(), library)
    monkeypatch.setattr(pump, "library", lambda: library)
    name = sorted(library.glob("*.toml"))[0].stem
    drive = pumped(tmp_path, name)
    before = fingerprint(drive, 0.1)
    (library / f"{name}.toml").write_text((library / f"{name}.toml").read_text() + "\n# new\n")
    assert fingerprint(drive, 0.1) != before


def test_a_table_within_a_table_keeps_its_files(tmp_path: Path) -> None:
    (tmp_path / "curve.csv").write_text("\n".join(CURVE))
    text = SYSTEM.replace("[load]", '[load]\npump = { n_ref_rpm = 1500, curve_csv = "curve.csv" }')
    (tmp_path / "drive.toml").write_text(text)
    drive = rl.load(
        tmp_path / "drive.toml", ["load.D_mm=80", "load.H_static_m=12", "load.k_pump_Nms2="]
    )
    assert drive.load.files == [tmp_path / "curve.csv"]
    moved = tmp_path / "moved"
    moved.mkdir()
    drive.save(moved / "again.toml")
    assert rl.load(moved / "again.toml").load.files == [tmp_path / "curve.csv"]


def test_no_text_key_that_holds_a_path_is_without_its_mark() -> None:
    """Keys of all tables whose comment or name speaks of a file."""

    def below(section: type[Section]) -> list[type[Section]]:
        return [section, *(inner for s in section.__subclasses__() for inner in below(s))]

    for name in rl.__all__:  # loads every table of the package
        getattr(rl, name)
    marked = {(s.__name__, key) for s in below(Section) for key in file_keys(s)}
    for section, key in (
        *(("MapMachine", "map"), ("MapMachine", "torque_map"), ("Angles", "angle_table")),
        *(("MapMachine", "pairs"), ("MapMachine", "force_map")),
        *(("Load", "pump"), ("Pump", "curve_csv"), ("OwnLaw", "law"), ("CompiledLaw", "law")),
    ):
        assert (section, key) in marked


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("R_ohm = -1.0", "[machine] R_ohm = -1.0, need >= 0"),
        ("R_ohn = 1.0", "unknown key `R_ohn` in [machine]; did you mean `R_ohm`?"),
        ("n_phases = 4", "[machine] n_phases = 4, but 6/4 poles make 3 phases"),
        ('model = "lehui"', "[machine] model = 'lehui' is unknown; did you mean `lehuy`?"),
        ("", "missing key `R_ohm` in [machine]"),
    ],
)
def test_a_fault_of_a_machine_file_names_that_file(line: str, told: str, tmp_path: Path) -> None:
    """Also of one that is given in Python; a fault of `--set` is none of the file."""
    key = line.split(" ")[0].replace("ohn", "ohm") or "R_ohm"
    good = (MACHINES / "paper_6_4.toml").read_text()
    motor = tmp_path / "motor.toml"
    motor.write_text(re.sub(rf"(?m)^{key} = .*$", line, good))
    (tmp_path / "drive.toml").write_text(
        (EXAMPLES / "paper_rated.toml").read_text().replace('"paper_6_4"', '"motor.toml"')
    )
    assert f"{motor}: {told}" in refused("run", tmp_path / "drive.toml")
    drive = rl.load(EXAMPLES / "paper_rated.toml")
    with pytest.raises(rl.ParameterError, match=re.escape(f"{motor}: {told}")):
        drive.with_values({"machine": str(motor)})
    motor.write_text(good)
    if line:
        name, value = line.split(" = ")
        line = refused("run", tmp_path / "drive.toml", "--set", f"machine.{name}={value}")
        assert told in line and str(motor) not in line
