"""A synchronous reluctance motor of 6.7 kW under current vector control, by motulator.

Its nearest machine to ours: reluctance torque, constant inductances. Speed held at 1500 rpm, rated
torque, one sample every 125 us, switching instants of a triangular carrier located.
"""

import json
import math
import time

from motulator.drive import model
from motulator.drive.control.sm import CurrentReferenceCfg, CurrentVectorControl
from motulator.drive.utils import SynchronousMachinePars

VERSION = "0.5.0"
END = 0.2  # [s]
T_S = 125e-6  # [s]
SPEED = 1500 * math.pi / 30  # [rad/s]
TORQUE = 20.0  # [N m]


def cpu_of() -> tuple[float, float]:
    """Processor time per simulated time, and the mean torque over the second half."""
    par = SynchronousMachinePars(n_p=2, R_s=0.54, L_d=41.5e-3, L_q=6.2e-3, psi_f=0)
    machine = model.SynchronousMachine(par)
    shaft = model.ExternalRotorSpeed(w_M=lambda t: SPEED + 0 * t)
    drive = model.Drive(model.VoltageSourceConverter(u_dc=540), machine, shaft)
    drive.pwm = model.CarrierComparison()
    limits = CurrentReferenceCfg(par, max_i_s=30, min_psi_s=0.1, nom_w_m=2 * math.pi * 105.8)
    law = CurrentVectorControl(par, limits, T_s=T_S, sensorless=False)
    law.ref.tau_M = lambda t: TORQUE
    run = model.Simulation(drive, law)
    start = time.process_time()
    run.simulate(t_stop=END)
    spent = time.process_time() - start
    t, tau = drive.mechanics.data.t, drive.machine.data.tau_M
    late = t > END / 2
    return spent / END, float((tau[late][1:] * (t[late][1:] - t[late][:-1])).sum() / (END / 2))


def main() -> None:
    found = [cpu_of() for _ in range(3)]
    job = (
        "a synchronous reluctance motor with constant inductances, current vector control every "
        f"125 us, switching instants located; mean torque {found[0][1]:.2f} N m"
    )
    cpu = min(cpu for cpu, _ in found)
    print(json.dumps({"peer": f"motulator {VERSION}", "cpu_s_per_s": cpu, "job": job}))


if __name__ == "__main__":
    main()
