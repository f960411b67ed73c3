"""Cost of a run on a photovoltaic array over that of the same run on a stiff dc link, in
instructions.

    python bench/pv_cost.py > bench/pv_cost.csv

The stiff link has the mean voltage of the array's, so that both runs switch alike. Each run is a
process under `valgrind --tool=callgrind` with PYTHONHASHSEED=0 and the cache warm, and is done for
two lengths: `whole` counts all of the longer process, imports included; `per_s` is the difference
over the difference of the lengths: what a simulated second costs once the drive is set up. Counts
do not depend on how busy the machine is. About two minutes a process, four processes a case.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import reluctance as rl

EXAMPLES = Path(__file__).parents[1] / "examples"
SHORT, LONG = 0.05, 0.25  # [s]
ARRAY = [
    *("source.kind=pv", "source.module=Canadian_Solar_Inc__CS6X_300M", "source.n_series=7"),
    *("source.n_parallel=6", "source.C_uF=2200", "source.t_s=[0]"),
    *("source.poa_global_Wpm2=[1015]", "source.temp_cell_degC=[32]"),
]
CASES: dict[str, tuple[str, list[str]]] = {"torque sharing, held speed": ("sharing_cubic.toml", [])}


def run(name: str, overrides: list[str], until: float) -> rl.Result:
    """A run without waveforms."""
    return rl.simulate(rl.load(EXAMPLES / name, overrides), until=until, record=None)


def instructions(name: str, overrides: list[str], until: float) -> int:
    """Of a process that does one run."""
    child = [sys.executable, __file__, name, f"{until}", *overrides]
    tool = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null"]
    environment = os.environ | {"PYTHONHASHSEED": "0"}
    done = subprocess.run([*tool, *child], env=environment, capture_output=True, text=True)
    found = re.search(r"refs:\s+([\d,]+)", done.stderr)
    if done.returncode or not found:
        raise SystemExit(done.stderr)
    return int(found[1].replace(",", ""))


def main() -> None:
    print("case,source,u_dc_mean_V,whole_M,per_s_M,whole_ratio,per_s_ratio")
    for case, (name, overrides) in CASES.items():
        found = run(name, overrides + ARRAY, LONG).kpis
        voltage = (found.u_dc_min + found.u_dc_max) / 2
        first: tuple[float, float] | None = None
        for source, more in (("stiff", [f"converter.u_dc_V={voltage:.2f}"]), ("pv", ARRAY)):
            run(name, overrides + more, SHORT)  # what is cached is there
            short, whole = (instructions(name, overrides + more, t) for t in (SHORT, LONG))
            per_s = (whole - short) / (LONG - SHORT)
            first = first or (whole, per_s)
            print(
                f'"{case}",{source},{voltage:.2f},{whole / 1e6:.1f},{per_s / 1e6:.1f},'
                f"{whole / first[0]:.3f},{per_s / first[1]:.3f}",
                flush=True,
            )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        run(sys.argv[1], sys.argv[3:], float(sys.argv[2]))
    else:
        main()
