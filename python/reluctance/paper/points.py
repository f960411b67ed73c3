"""The paper's two operating points and the runs made at each."""

from dataclasses import dataclass

import reluctance.paper.printed as printed
from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.key_figures import Kpis
from reluctance.base.resources import resources
from reluctance.drive.drive import Drive
from reluctance.drive.load import load
from reluctance.drive.run.result import Result
from reluctance.drive.run.simulate import simulate
from reluctance.machine import optimum
from reluctance.machine.machine_file import MachineFile

PUMP_UNTIL = (
    2.4  # the slowest mode of the speed loop is gone: 3.2 s gives the same speed ripple [s]
)
PUMP_RECORD = 5e-5  # [s]


@dataclass(frozen=True)
class Point:
    """An operating point of section 4."""

    label: str
    drive_file: str  # in examples/
    tau_ref: float  # [N m]
    speed_rpm: float
    response: float  # torque response time that the paper gives [s]

    def drive(self, *overrides: str) -> Drive:
        """The drive on a shaft held at the point's speed, with `section.key=value` replaced."""
        return load(resources("examples") / self.drive_file, list(overrides))


RATED = Point("rated torque", "paper_rated.toml", printed.TAU_RATED, printed.RPM_RATED, 0.35e-3)
HALF = Point("half torque", "paper_half.toml", printed.TAU_HALF, printed.RPM_HALF, 0.28e-3)


@dataclass(frozen=True)
class Runs:
    """What was simulated at one point, and the physical limit there."""

    point: Point
    locked: Result  # torque control, speed held
    pump: Result  # from standstill, speed loop closed, pump on the shaft
    free: Kpis  # torque control with the pump on the shaft: where it comes to rest
    best: optimum.Profile  # least copper for no ripple, speed held


def run_point(point: Point) -> Runs:
    """The runs of one operating point."""
    drive = point.drive()
    pump = load(
        resources("examples") / "paper_pump.toml", [f"reference.speed_rpm={point.speed_rpm}"]
    )
    free = point.drive("load.kind=pump", f"load.k_pump_Nms2={printed.K_PUMP}")
    return Runs(
        point=point,
        locked=simulate(drive),
        pump=simulate(pump, until=PUMP_UNTIL, record=PUMP_RECORD),
        free=simulate(free, until=1.0, record=None).kpis,
        best=optimum.best_profile(drive.at(drive.omega_nominal), point.tau_ref),
    )


def le_huy(machine: MachineFile) -> _core.LeHuy:
    """The paper's machine model, whose A, B and L_sat the printed equations need too."""
    model = machine.magnetics
    if not isinstance(model, _core.LeHuy):
        raise ParameterError(f"{machine.name}: need the analytic model `lehuy`, as in the paper")
    return model
