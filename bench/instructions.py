"""Instructions of the closed loop per simulated second, counted by callgrind.

    python bench/instructions.py > bench/instructions.csv

A drive is run to two ends; the difference is free of set-up. Counts do not depend on the load of
the machine that runs this, only on the compiler: g++ 12 -O3 for x86-64, with the loop as the C
interface has it. Needs valgrind.
"""

import re
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.targets.export.blob import blob

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
FLAGS = "-O3 -fno-math-errno -fno-trapping-math".split()
KINDS = {
    "LAWS": "Angles,TorqueSharing,PaperMpc,EdgeMpc",
    "MACHINES": "LeHuy,FluxMap",
    "PHASES": "3",
    "PRECISIONS": "double",
}
EARLY, LATE = (0.04, 0.08), (0.5, 0.54)  # ends [s]; late: once a shaft has come up to speed
HYSTERESIS = [
    "load.speed_rpm=1500",
    "control.regulate=current",
    "control.i_ref_A=60",
    "control.i_band_A=1",
    "simulation.dt_max_us=20",
]


@dataclass(frozen=True)
class Case:
    """A drive and how it is run. record: None, or 0.0 for every point."""

    example: str
    changes: list[str] = field(default_factory=list)
    ends: tuple[float, float] = EARLY
    record: float | None = None
    as_map: bool = False  # the machine as a flux map

    def drive(self, place: Path) -> rl.Drive:
        drive = rl.load(EXAMPLES / f"{self.example}.toml", self.changes)
        return drive.with_values({"machine": mapped(drive, place)}) if self.as_map else drive


CASES = {
    "rated point": Case("paper_rated"),
    "half load": Case("paper_half"),
    "turning shaft (pump)": Case("paper_pump", ends=LATE),
    "photovoltaic link": Case("sun_cloud", ends=LATE),
    "edge_mpc at 2 us": Case("edge_mpc_fpga"),
    "edge_mpc at 20 us": Case("edge_mpc_mcu"),
    "hysteresis at 100 us": Case("single_pulse", HYSTERESIS),
    "hysteresis at 20 us": Case("single_pulse", [*HYSTERESIS, "control.T_s_us=20"]),
    "hysteresis_200A (500 rpm)": Case("hysteresis_200A"),
    "single pulse at 3000 rpm": Case("single_pulse", ["simulation.dt_max_us=20"]),
    "rated point on a flux map": Case("paper_rated", as_map=True),
    "hysteresis on a flux map": Case(
        "single_pulse", [*HYSTERESIS, "control.T_s_us=20"], as_map=True
    ),
    "rated point with every point recorded": Case("paper_rated", record=0.0),
}


def mapped(drive: rl.Drive, place: Path) -> str:
    """The drive's machine as a flux map of 31 currents and 61 angles: its machine file."""
    i = np.linspace(0.0, 2 * drive.machine.i_max_A, 31)
    theta_e = np.linspace(0.0, np.pi, 61)
    grid_i, grid_theta = (x.ravel() for x in np.meshgrid(i, theta_e))
    psi = _core.magnetics(drive.machine.magnetics, grid_i, grid_theta)[:, 0]
    rows = [
        f"{a!r},{b!r},{c!r}"
        for a, b, c in zip(
            *map(np.ndarray.tolist, (grid_i, np.degrees(grid_theta), psi)), strict=True
        )
    ]
    (place / "machine.csv").write_text("\n".join(["i_A,theta_e_deg,psi_Wb", *rows]) + "\n")
    text = (ROOT / "machines" / "paper_6_4.toml").read_text()
    kept = text[: text.index('model = "lehuy"')]
    file = place / "machine.toml"
    file.write_text(f'{kept}model = "map"\nmap = "machine.csv"\n')
    return str(file)


def compiled(place: Path) -> Path:
    """The program that runs a blob to an end."""
    program = place / "instructions"
    sources = ["bench/instructions.cpp", "web/reluctance.cpp"]
    kinds = [f"-DSRM_{name}={value}" for name, value in KINDS.items()]
    flags = [*FLAGS, *kinds, "-Iinclude"]
    return build(sources, program, flags, folder=ROOT, what="the bench", link=())


def counted(program: Path, blob_file: Path, end: float) -> int:
    """Instructions of a run to an end."""
    out = blob_file.with_suffix(".out")
    command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}"]
    found = subprocess.run(
        [*command, program, blob_file, repr(end)], check=True, capture_output=True, text=True
    )
    match = re.search(r"refs:\s+([\d,]+)", found.stderr)
    assert match, found.stderr
    return int(match[1].replace(",", ""))


def main() -> None:
    print("case,M_instructions_per_s")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        program = compiled(place)
        for case, how in CASES.items():
            file = place / "drive.blob"
            file.write_bytes(blob(how.drive(place), record=how.record))
            first, second = (counted(program, file, end) for end in how.ends)
            found = (second - first) / (how.ends[1] - how.ends[0]) / 1e6
            print(f"{case},{found:.0f}", flush=True)


if __name__ == "__main__":
    main()
