"""Which law fits an STM32G474, at which control period, and how smooth its torque is there.

    python bench/g474.py > bench/g474.csv

The drive is examples/deadbeat_g474.toml, with each law's own keys from its example. The worst step
of 20 000 is counted on the emulated Cortex-M4F, at the most cycles per instruction that the verdict
of `export firmware --mcu` takes; so the answer is that verdict's.
"""

import csv
import sys
from pathlib import Path

import reluctance as rl
from reluctance.base.files import scratch
from reluctance.targets.export import firmware
from reluctance.targets.export.cost import cost
from reluctance.targets.export.package_text import gates_of
from reluctance.targets.export.recording import STEPS, record
from reluctance.targets.export.verdict import LOAD, mcu, verdict

EXAMPLES = Path(__file__).parents[1] / "examples"
LAWS = {  # example that has the law's keys; comparators, where it orders any; periods [us]
    "deadbeat": ("deadbeat", "analog", (30, 40, 50, 60, 80)),
    "pwm_current": ("pwm_current", "analog", (30, 40, 50)),
    "edge_mpc": ("edge_mpc_mcu", "analog", (80, 100, 120)),
    "finite_set_mpc": ("finite_set_mpc", "analog", (50, 60, 80)),
    "paper_mpc": ("paper_rated", "analog", (80,)),
    "paper_mpc, two-level": ("paper_rated", "two_level", (80,)),
    "paper_mpc, sampled": ("paper_rated", "sampled", (80,)),
}


def row(name: str, example: str, comparators: str, T_s_us: float) -> dict[str, object]:
    """One law at one control period."""
    base = rl.load(EXAMPLES / "deadbeat_g474.toml")
    own = rl.load(EXAMPLES / f"{example}.toml").tables()["control"]
    drive = base.with_values({"control.law": own["law"]}).with_values(
        {f"control.{key}": value for key, value in own.items() if key != "law"}
        | {"control.T_s_us": T_s_us, "sensing.comparators": comparators}
    )
    part = mcu("stm32g474")
    with scratch() as place:
        folder = firmware(drive, place / "package").folder
        spent = cost(drive, part.core, record(drive, steps=STEPS), folder)
    answers = verdict(drive, part, spent, gates_of(drive))
    missing = [reason.partition(":")[0] for yes, reason in answers if not yes]
    kpis = rl.simulate(drive, record=None).kpis
    return {
        "case": f"{name} {T_s_us:g} us",
        "instructions_max": spent.instructions_max,
        "step_us": f"{spent.instructions_max * part.cpi[1] / part.clock_MHz:.1f}",
        "allowed_us": f"{LOAD * T_s_us:g}",
        "fits": "yes" if not missing else "no: " + ", ".join(missing),
        "tau_mean_Nm": f"{kpis.tau_mean:.3f}",
        "torque_error_rms": f"{kpis.torque_error_rms:.5f}",
        "torque_ripple_pp": f"{kpis.torque_ripple_pp:.5f}",
        "f_switch_Hz": f"{kpis.f_switch:.0f}",
    }


def main() -> None:
    writer = None
    for name, (example, comparators, periods) in LAWS.items():
        for T_s_us in periods:
            found = row(name, example, comparators, T_s_us)
            if writer is None:
                writer = csv.DictWriter(sys.stdout, found, lineterminator="\n")
                writer.writeheader()
            writer.writerow(found)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
