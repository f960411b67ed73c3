"""What the firmware tests share: which tools they need, and drives short enough to replay often."""

import os
import shutil
from pathlib import Path

import pytest

import reluctance as rl

ROOT = Path(__file__).parents[1]
TOOLS = ("arm-none-eabi-g++", "qemu-system-arm", "make")
CI = os.environ.get("CI") == "true"

# Where the tools are missing a developer's run leaves these tests out; the check of a change fails.
needs_target = pytest.mark.skipif(
    not CI and any(shutil.which(tool) is None for tool in TOOLS),
    reason=f"needs {', '.join(TOOLS)}",
)

# Name, drive file, overrides: what the budget and the parity tests run.
DRIVES = {
    "angles": ("hysteresis_200A", []),
    "sharing": ("sharing_cubic", []),
    "ditc": ("ditc", []),
    "paper_mpc": ("paper_rated", []),
    "paper_mpc_map": ("map_mpc", []),
    "paper_mpc_speed_loop": ("paper_pump", []),
    "finite_set_1": ("finite_set_mpc", []),
    "finite_set_2": ("finite_set_mpc", ["control.horizon=2"]),
    "edge_mpc": ("edge_mpc_fpga", []),
    "edge_mpc_late": ("edge_mpc_mcu", []),
    "edge_mpc_speeds": ("edge_mpc_fpga", ["control.guide_speed_rpm=[1000.0, 1250.0, 1750.0]"]),
    "edge_mpc_8_6": (
        "edge_mpc_mcu",
        [
            "machine=generic_1hp_8_6",
            "reference.tau_Nm=2",
            "control.tau_max_Nm=2.2",
            "sensing.i_range_A=10",
        ],
    ),
    "deadbeat": ("deadbeat", []),
    "deadbeat_dead_time": ("deadbeat", ["converter.dead_time_us=1"]),
    "sharing_sampled": ("sharing_cubic", ["sensing.comparators=sampled"]),
    "pwm_current": ("pwm_current", []),
    "sun_cloud": (
        "sun_cloud",
        [
            *("load.speed_rpm=1300", "pv_control.wake_s=0", "source.t_s=[0, 0.1, 0.3]"),
            *("pv_control.interval_ms=20",),
        ],
    ),
    "sun_cloud_no_sensor": (
        "sun_cloud",
        [
            *("load.speed_rpm=1300", "pv_control.wake_s=0", "source.t_s=[0, 0.1, 0.3]"),
            *("pv_control.interval_ms=20", "pv_control.actuator=speed"),
            *("pv_control.current=legs", "sensing.comparators=sampled"),
            *("sensing.delay_samples=1", "pv_control.tracking=incremental_conductance"),
        ],
    ),
    "five_phases": ("five_phases_losses", []),
}


def drive(name):
    file, overrides = DRIVES[name]
    return rl.load(ROOT / "examples" / f"{file}.toml", overrides)
