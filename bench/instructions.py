"""Instructions of the closed loop per simulated second, counted by callgrind.

    python bench/instructions.py > bench/instructions.csv

A drive is run to two ends; the difference is free of set-up. Counts do not depend on the load of
the machine that runs this, only on the compiler: g++ 12 -O3 for x86-64, with the loop as the C
interface has it. Needs valgrind.

A machine whose phases couple is compared with the same machine uncoupled: by a controller that does
not know the pairs (blind), which is the same one, and by one that does (aware). There the steps of
integration are counted, too.
"""

import re
import subprocess
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

import reluctance as rl
from reluctance import _core
from reluctance.base.toolchain import build
from reluctance.drive.run.plant import closed_loop
from reluctance.targets.export.blob import blob

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
FLAGS = "-O3 -fno-math-errno -fno-trapping-math".split()
KINDS = {
    "LAWS": "Angles,TorqueSharing,Deadbeat,PaperMpc,EdgeMpc,"
    "DeadbeatOfPairs,PaperMpcOfPairs,EdgeMpcOfPairs",
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
PAIRS = [
    "machine=onelab_6_4_pairs",
    "converter.u_dc_V=285",
    "reference.tau_Nm=4.44",
    "control.tau_max_Nm=4.44",
]
COUPLED = {
    "6/4: example coupled_phases": Case("coupled_phases"),
    "6/4: edge_mpc at 2 us": Case("edge_mpc_fpga", PAIRS),
    "6/4: paper_mpc": Case("paper_rated", [*PAIRS, "control.i_band_A=0.12"]),
    "6/4: deadbeat": Case("deadbeat", PAIRS),
}
KNOWS = {
    "uncoupled": ["machine.pair_factor=0"],
    "blind": ["control.pair_torque=false"],
    "aware": [],
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


def steps(drive: rl.Drive, end: float) -> int:
    """Integration steps of a run to an end."""
    loop, t = closed_loop(drive, drive.controller(), -1.0), 0.0
    while t < end:
        t = loop.advance(end)
        loop.take_periods()
    return loop.steps


def main() -> None:
    print("case,pairs,M_instructions_per_s,of_uncoupled,k_steps_per_s")
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        program = compiled(place)

        def found(how: Case) -> float:
            file = place / "drive.blob"
            file.write_bytes(blob(how.drive(place), record=how.record))
            first, second = (counted(program, file, end) for end in how.ends)
            return (second - first) / (how.ends[1] - how.ends[0]) / 1e6

        for case, how in CASES.items():
            print(f"{case},,{found(how):.0f},,", flush=True)
        for case, how in COUPLED.items():
            uncoupled = None
            for pairs, changes in KNOWS.items():
                case_of = replace(how, changes=[*how.changes, *changes])
                count = found(case_of)
                uncoupled = uncoupled or count
                taken = [steps(case_of.drive(place), end) for end in how.ends]
                per_ms = (taken[1] - taken[0]) / (how.ends[1] - how.ends[0]) / 1e3
                row = f"{count:.0f},{count / uncoupled:.2f},{per_ms:.0f}"
                print(f"{case},{pairs},{row}", flush=True)


if __name__ == "__main__":
    main()
