"""What the firmware tests share: which tools they need, and drives short enough to replay often."""

import atexit
import ctypes
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from coupled import BAND, SENSED, WORKING, machine_file, unlike
from needs import needs

import reluctance as rl
from reluctance import _core
from reluctance.base import toolchain
from reluctance.targets.export import firmware
from reluctance.targets.export.on_desk import FLAGS, SOURCES
from reluctance.targets.export.target import PHASE

ROOT = Path(__file__).parents[2]
TOOLS = ("arm-none-eabi-g++", "qemu-system-arm", "make")

needs_target = needs(*TOOLS)

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
    "deadbeat_braking": ("deadbeat", ["reference.tau_Nm=-20"]),
    "sharing_braking": ("sharing_cubic", ["reference.tau_Nm=-20"]),
    "sharing_fast": ("sharing_cubic", ["load.speed_rpm=3000"]),
    "deadbeat_fast": ("deadbeat", ["load.speed_rpm=3000"]),
    "ditc_fast": ("ditc", ["load.speed_rpm=3000"]),
    "angles_braking": (
        "hysteresis_200A",
        ["control.i_ref_A=", "reference.kind=torque", "reference.tau_Nm=-20"],
    ),
    "angles_table": ("angle_table", []),
    "deadbeat_diagnosis": ("deadbeat", ["protection.diagnosis=true"]),
    "deadbeat_flux_angle": (
        "deadbeat",
        ["protection.diagnosis=true", "protection.flux_angle=true"],
    ),
    "deadbeat_flux_angle_pairs": (
        "deadbeat",
        [*WORKING, "protection.diagnosis=true", "protection.flux_angle=true"],
    ),
    "deadbeat_dead_time": ("deadbeat", ["converter.dead_time_us=1"]),
    "edge_mpc_learning": ("edge_mpc_learning", []),
    "edge_mpc_learning_map": (
        "edge_mpc_learning",
        [
            *("machine=npf_vector_6_4", "converter.u_dc_V=560", "load.speed_rpm=1000"),
            *("reference.tau_Nm=10", "sensing.i_range_A=50"),
        ],
    ),
    "deadbeat_learning": ("deadbeat_learning", []),
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
    # On the machine of `coupled` with unlike neighbours, two or three phases of which conduct.
    "deadbeat_pairs": ("deadbeat", WORKING),
    "edge_mpc_pairs": ("edge_mpc_mcu", [*WORKING, *SENSED]),
    "finite_set_pairs": ("finite_set_mpc", WORKING),
    "paper_mpc_pairs": ("paper_rated", [*WORKING, *BAND]),
    "deadbeat_learning_pairs": ("deadbeat_learning", [*WORKING, *SENSED]),
    "edge_mpc_learning_pairs": ("edge_mpc_learning", [*WORKING, *SENSED]),
}

VARIANTS = {  # of laws that other drives have too: among the proofs
    *("edge_mpc_speeds", "edge_mpc_8_6", "edge_mpc_learning_map"),
    *(
        "deadbeat_flux_angle",
        "deadbeat_flux_angle_pairs",
        "deadbeat_braking",
        "deadbeat_fast",
        "deadbeat_dead_time",
        "ditc_fast",
        "angles_braking",
    ),
    *("sharing_braking", "sharing_fast", "sharing_sampled", "sun_cloud_no_sensor"),
    *("edge_mpc_pairs", "finite_set_pairs", "paper_mpc_pairs"),
    *("edge_mpc_learning_pairs", "deadbeat_learning_pairs"),
}
each_drive = pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.long) if n in VARIANTS else n for n in DRIVES]
)


def drive(name):
    file, overrides = DRIVES[name]
    if overrides[: len(WORKING)] == WORKING:
        overrides = [f"machine={coupled_machine()}", *overrides]
    return rl.load(ROOT / "examples" / f"{file}.toml", overrides)


@cache
def coupled_machine():
    """The file of a machine whose phases have unlike neighbours, for as long as the tests run."""
    folder = TemporaryDirectory()
    atexit.register(folder.cleanup)
    return machine_file(Path(folder.name), unlike())


class Fault(ctypes.Structure):
    """reluctance_fault."""

    _fields_ = (
        ("status", ctypes.c_int32),
        ("phase", ctypes.c_int32),
        ("value", ctypes.c_float),
        ("limit", ctypes.c_float),
        ("age", ctypes.c_uint32),
    )


class Native:
    """An exported package as a shared library on the desk: the protection with the law, in float.

    `controller` stands where the drive's own does; `status` is what each sample returned. `spoil`,
    if given, changes the measurement (a structured array) of a sample before the step.
    """

    def __init__(self, given, folder, spoil=None):
        package = firmware(given, folder / "package").folder
        library = folder / "controller.so"
        toolchain.build(SOURCES, library, FLAGS, folder=package, what="the package")
        N = given.machine.n_phases
        self.library = ctypes.CDLL(str(library))
        self.library.reluctance_torque_reference.restype = ctypes.c_float
        self.library.reluctance_parameter_get.restype = ctypes.c_float
        self.library.reluctance_parameter_set.argtypes = [
            *(ctypes.c_void_p, ctypes.c_int32, ctypes.c_float)
        ]
        self.library.reluctance_step.argtypes = [
            *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_float, ctypes.c_void_p)
        ]
        self.state = np.zeros(1024, np.uint32)
        self.command = np.zeros(1, np.dtype([("phase", PHASE, (N,))]))
        self.sample = np.zeros(
            1, [("i", "<f4", (N,)), *((n, "<f4") for n in ("theta_e", "omega_m", "u_dc", "i_dc"))]
        )
        request = ("enable", "clear", "tripped", "sequence")
        self.request = np.zeros(1, [*((n, "<u4") for n in request), ("reference", "<f4")])
        outputs = ("mode", "gate_enable", "precharged", "chopper")
        self.outputs = np.zeros(1, [(n, "<i4") for n in outputs])
        self.library.reluctance_get_fault.restype = Fault
        self.controller = _core.controller_from(N, self.step)
        self.again(spoil)

    def again(self, spoil=None):
        """From the state after reset, as compiled."""
        self.library.reluctance_init(ctypes.c_void_p(self.state.ctypes.data))
        self.spoil, self.status = spoil, []
        return self

    def step(self, y, reference):
        self.sample[0] = (y.i, _core.wrap_float(y.theta_e), y.omega_m, y.u_dc, y.i_source)
        if self.spoil is not None:
            self.spoil(self.sample[0], len(self.status))
        self.status.append(
            self.library.reluctance_step(
                self.state.ctypes.data,
                self.sample.ctypes.data,
                reference,
                self.command.ctypes.data,
            )
        )
        tau_ref = self.library.reluctance_torque_reference(ctypes.c_void_p(self.state.ctypes.data))
        return [*self.row().astype(float).tolist(), tau_ref]

    def row(self):
        """The orders of the last call, with the columns of _core.step but its last."""
        names = [name for name in PHASE.names if name != "padding"]
        orders = self.command["phase"][0]
        return np.concatenate([np.atleast_1d(o[n]).astype("<f4") for o in orders for n in names])

    def run(self, sample, request):
        """One call of reluctance_run: readings and request to the outputs."""
        self.sample[0] = sample
        self.request[0] = request
        self.library.reluctance_run(
            *(
                ctypes.c_void_p(a.ctypes.data)
                for a in (self.state, self.sample, self.request, self.command, self.outputs)
            )
        )
        return self.outputs[0]

    def set(self, name, value):
        """One call of reluctance_parameter_set: its answer."""
        number = self.library.reluctance_parameter_find(name.encode())
        return self.library.reluctance_parameter_set(self.state.ctypes.data, number, value)

    def get(self, name):
        number = self.library.reluctance_parameter_find(name.encode())
        state = ctypes.c_void_p(self.state.ctypes.data)
        return self.library.reluctance_parameter_get(state, number)

    def fault(self):
        return self.library.reluctance_get_fault(ctypes.c_void_p(self.state.ctypes.data))

    @property
    def trip(self):
        """Number of the first sample that was not ok, and its status; None where all were."""
        bad = np.flatnonzero(self.status)
        return (int(bad[0]), self.status[bad[0]]) if len(bad) else None
