"""The steps of the package's README on the emulated board, command by command as printed there.

`python tests/support/emulated_board.py` writes bench/emulated_board.csv. It takes some two CPU
minutes.
"""

import csv
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from firmware_tools import ROOT

import reluctance as rl
from reluctance import _core
from reluctance.targets.commission import Wires, read_wires
from reluctance.targets.commission.wiring import Wiring, read_wiring

COUNTS = 4096  # of the encoder
NOISE_LSB = 8  # rms
# What differs from examples/deadbeat_g474.toml: 0.5 % of noise on the dc voltage, and offsets.
MACHINES = {
    "paper_6_4": {"i_offset_A": "[1.5, -1.0, 0.4]"},
    "generic_1hp_8_6": {"i_offset_A": "[0.06, -0.04, 0.02, 0.05]", "i_range_A": 8.0, "tau_Nm": 2.0},
}


@dataclass(frozen=True)
class Walked:
    """What the commissioned board makes of its machine."""

    machine: str
    noise_LSB: float
    R_error_pct: float
    zero_error_counts: float
    torque_error_pct: float  # of the imported machine file, rms over angle and current
    spin_rpm: float
    speed_limit_rpm: float
    trips: int  # causes that stop the drive, of four
    stuck_angle_us: float


def drive_file(machine: str, folder: Path) -> Path:
    """The drive: a machine with sensors as they are."""
    text = (ROOT / "examples" / "deadbeat_g474.toml").read_text()
    text = text.replace('"paper_6_4"', f'"{machine}"').replace(
        "i_noise_LSB = 2", f"i_noise_LSB = {NOISE_LSB}\nu_dc_noise_V = 1.2"
    )
    text = text.replace("[sensing]", f"[sensing]\ni_offset_A = {MACHINES[machine]['i_offset_A']}")
    for key in ("i_range_A", "tau_Nm"):
        if key in MACHINES[machine]:
            text = re.sub(rf"^{key} = .*$", f"{key} = {MACHINES[machine][key]}", text, flags=re.M)
    path = folder / "drive.toml"
    path.write_text(text)
    return path


def blocks(readme: str, language: str) -> list[str]:
    """The code blocks of a language in section 10."""
    section = readme.split("### 10. On the emulated board")[1].split("\n## ")[0]
    return re.findall(rf"```{language}\n(.*?)```", section, re.S)


def commands(readme: str) -> list[str]:
    """The commands of section 10, one each; that of the alignment twice, where the legs may be in
    another order."""
    lines = blocks(readme, "sh")[0].replace("\\\n", " ").splitlines()
    board = lines[0].removeprefix("BOARD=").strip('"')
    found = [line.replace("$BOARD", board) for line in lines[1:]]
    again = next(n for n, line in enumerate(found) if "alignment" in line)
    return [*found[: again + 1], *found[again:]]


def walk(machine: str, folder: Path) -> tuple[Walked, dict[str, str]]:
    """Every command of the README in its order; what they printed, by their last occurrence."""
    drive = rl.load(drive_file(machine, folder))
    package = folder / "package"
    said = {}
    run(f"reluctance export firmware drive.toml --out {package.name}", folder)
    readme = (package / "README.md").read_text()
    (folder / "wires.toml").write_text(blocks(readme, "toml")[0])
    for line in commands(readme):
        for name in ("DRIVE.toml", "wires.toml"):
            line = line.replace(name, str(folder / name.lower()))
        step = line.split()[3] if line.startswith("reluctance emulate") else line.split()[1]
        said[step] = run(line, package)
    wires = read_wires(folder / "wires.toml").checked(drive.machine.n_phases)
    limit = float(re.search(r"below ([\d.]+) rpm, positive", readme)[1])
    mean = float(re.search(r"mean ([\d.]+)", said["resistance"])[1])
    walked = Walked(
        machine=machine,
        noise_LSB=NOISE_LSB,
        R_error_pct=round(100 * (mean / drive.machine.R - 1), 3),
        zero_error_counts=round(zero_error(drive, wires, read_wiring(package)), 4),
        torque_error_pct=round(torque_error(drive, package / "motor.toml"), 3),
        spin_rpm=float(re.search(r"(-?\d+) rpm at the end", said["spin"])[1]),
        speed_limit_rpm=limit,
        trips=said["trip"].count("stays, clears"),
        stuck_angle_us=float(re.search(r"angle.*after (\d+) us", said["trip"])[1]),
    )
    return walked, said


def zero_error(drive: rl.Drive, wires: Wires, wiring: Wiring) -> float:
    """By how many counts the corrected angle is off, once the phases are in their order."""
    n = drive.machine.n_phases
    place = [wires.phase[leg] for leg in wiring.leg]
    way = wires.direction * wiring.direction
    assert place == [(place[0] + way * k) % n for k in range(n)]
    assert [wires.sensor[c] for c in wiring.channel] == place
    assert all(wires.sign[c] * s == 1 for c, s in zip(wiring.channel, wiring.sign, strict=True))
    off = wiring.direction * np.radians(wires.zero_deg) - wiring.zero
    off += way * 2 * np.pi * place[0] / n
    return float(
        abs((off + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi * drive.machine.N_r / COUNTS)
    )


def torque_error(drive: rl.Drive, machine: Path) -> float:
    """Rms over angle and current of the torque of a machine file, less the true one, in per cent
    of the rms torque."""
    found = drive.with_values({"machine": str(machine)}).machine
    i, theta_e = np.meshgrid(
        np.linspace(0.02, 1, 40) * drive.machine.i_max_A, np.linspace(0, np.pi, 121)
    )
    ours, true = (
        _core.magnetics(m.magnetics, i.ravel(), theta_e.ravel())[:, 2]
        for m in (found, drive.machine)
    )
    return float(100 * np.sqrt(np.mean((ours - true) ** 2) / np.mean(true**2)))


def run(line: str, folder: Path) -> str:
    """What a line of a shell prints, with this installation's `reluctance`."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["sh", "-c", line],
        cwd=folder,
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, f"{line}: {done.stderr}{done.stdout}"
    return done.stdout


def main() -> None:
    rows = []
    for machine in MACHINES:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(asdict(walk(machine, Path(folder))[0]))
    with (ROOT / "bench" / "emulated_board.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    main()
