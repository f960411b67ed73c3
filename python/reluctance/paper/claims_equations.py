"""Claims that need no simulation: Table 1, the machine model, eqs. 2.1 to 3.1 as printed."""

import numpy as np
from numpy.typing import NDArray

import reluctance.paper.printed as printed
import reluctance.paper.pump as pump
from reluctance import _core
from reluctance.base.key_figures import Kpis
from reluctance.base.units import from_si
from reluctance.drive.drive import Drive
from reluctance.machine import optimum
from reluctance.machine.machine_file import MachineFile
from reluctance.paper.claim import Claim, verdict
from reluctance.paper.points import HALF, RATED, Point, le_huy
from reluctance.paper.study import Study

PSI_M_DEFAULT = 0.486  # of the generic machine with the same L_d, L_q and I_m [Wb]
I_SAMPLE = 50.0  # a current of ordinary operation, for the equations that are compared [A]
TO_RPM = from_si(1.0, "rpm")  # [rpm s/rad]


def equation_claims(found: Study) -> list[Claim]:
    """The rows, in the order of the paper."""
    drive = found.rated.locked.drive
    free = ((RATED, found.rated.free), (HALF, found.half.free))
    return [
        table_1(),
        *(pump_equilibrium(point, kpis) for point, kpis in free),
        *circuit_equation(drive),
        speed_equation(),
        position_function(drive.machine),
        torque_bracket(drive.machine),
        flux_curves(drive.machine),
        *maximum_point(drive, found.rated.best),
        *state_space(drive),
    ]


def magnetics(machine: MachineFile, i: float, theta: float) -> NDArray[np.float64]:
    """psi, W_c, tau, L_inc, psi_theta at the paper's angle from alignment, approaching it [rad]."""
    theta_e = np.array([np.pi - machine.N_r * theta])
    row: NDArray[np.float64] = _core.magnetics(machine.magnetics, np.array([i]), theta_e)[0]
    return row


def table_1() -> Claim:
    """Power, speed and torque."""
    tau = printed.POWER / printed.SPEED
    p = printed.TAU_RATED * printed.SPEED
    return Claim(
        claim="Table 1: 6 kW at 1500 rpm is a rated torque of 41.339 N m",
        paper_says=printed.TAU_RATED,
        model_gives=tau,
        unit="N m",
        physical_limit=None,
        verdict=verdict(abs(tau / printed.TAU_RATED - 1) < 0.01),
        why=f"P/omega = {tau:.2f} N m; 41.339 N m at 1500 rpm is {p / 1e3:.2f} kW. "
        "The table also prints the unit as N.",
    )


def pump_equilibrium(point: Point, free: Kpis) -> Claim:
    """Speed at which the pump takes the torque."""
    omega_m = pump.equilibrium_speed(point.tau_ref, k_pump=printed.K_PUMP, B=printed.FRICTION)
    rpm = omega_m * TO_RPM
    cause = (
        "eq. 2.3 takes 37.01 N m of pump and 3.14 N m of friction at 1500 rpm"
        if point is RATED
        else f"1500/sqrt(2) is {1500 / np.sqrt(2):.1f}: the friction was left out"
    )
    return Claim(
        claim=f"Section 4: with {point.tau_ref} N m the pump turns at {point.speed_rpm:g} rpm",
        paper_says=point.speed_rpm,
        model_gives=rpm,
        unit="rpm",
        physical_limit=None,
        verdict=verdict(abs(rpm - point.speed_rpm) < 0.5),
        why=f"k omega^2 + f omega = T gives {rpm:.1f} rpm; {cause}. The simulated drive with this "
        f"torque as its reference comes to rest at {free.speed_mean * TO_RPM:.1f} rpm, its mean "
        f"torque being {free.tau_mean:.2f} N m.",
    )


def circuit_equation(drive: Drive) -> list[Claim]:
    """Eq. 2.1 and the current row of eq. 2.4, at mid-position and 50 A."""
    machine, omega_m, u = drive.machine, drive.omega_nominal, drive.converter.u_dc_V
    _, _, _, L_inc, psi_theta = magnetics(machine, I_SAMPLE, np.pi / 8)
    emf = omega_m * psi_theta
    slope = (u - machine.R * I_SAMPLE - emf) / L_inc
    where = f"at 22.5 deg, {I_SAMPLE:g} A, 1500 rpm"
    return [
        Claim(
            claim=f"Eq. 2.1: the motional voltage is omega dphi/di ({where})",
            paper_says=omega_m * L_inc,
            model_gives=emf,
            unit="V",
            physical_limit=None,
            verdict="not confirmed",
            why="The derivative must be to the angle: omega dphi/dtheta. As printed the term is "
            "an inductance times a speed, not a voltage.",
        ),
        Claim(
            claim=f"Eq. 2.4: di/dt = (1/(dphi/di)) v - R i - omega dphi/dtheta ({where}, {u:g} V)",
            paper_says=u / L_inc - machine.R * I_SAMPLE - emf,
            model_gives=slope,
            unit="A/s",
            physical_limit=None,
            verdict="not confirmed",
            why="1/(dphi/di) must multiply all three terms; brackets are missing, and the units "
            "disagree.",
        ),
    ]


def speed_equation() -> Claim:
    """The speed row of eq. 2.4."""
    as_printed = printed.TAU_RATED / printed.J / printed.FRICTION * TO_RPM
    mended = pump.equilibrium_speed(printed.TAU_RATED, k_pump=printed.K_PUMP, B=printed.FRICTION)
    return Claim(
        claim="Eq. 2.4: domega/dt = T_e/J - f omega (its resting speed at 41.339 N m)",
        paper_says=as_printed,
        model_gives=mended * TO_RPM,
        unit="rpm",
        physical_limit=None,
        verdict="not confirmed",
        why="1/J multiplies the torque alone and the pump torque of eq. 2.2 is absent; "
        "(T_e - f omega - k omega^2)/J is meant.",
    )


def position_function(machine: MachineFile) -> Claim:
    """f at the unaligned position."""
    psi_u, psi_a = (magnetics(machine, I_SAMPLE, theta)[0] for theta in (np.pi / 4, 0.0))
    f = (psi_u - le_huy(machine).L_u * I_SAMPLE) / (psi_a - le_huy(machine).L_u * I_SAMPLE)
    return Claim(
        claim="Section 3: the position function f as printed, at the unaligned position (45 deg)",
        paper_says=printed.position(np.pi / 4),
        model_gives=float(f),
        unit="1",
        physical_limit=0.0,
        verdict=verdict(printed.position(np.pi / 4) == 0),
        why="f must fall from 1 (aligned) to 0 (unaligned). With -48 theta^2/pi^2 for the printed "
        "+48 it is the only cubic that does so with no slope at either end.",
    )


def torque_bracket(machine: MachineFile) -> Claim:
    """Torque at alignment."""
    m = le_huy(machine)
    as_printed = printed.torque(I_SAMPLE, 0.0, L_sat=m.L_sat, A=m.A, B=m.B)
    return Claim(
        claim=f"Section 3: the torque equation as printed, at alignment with {I_SAMPLE:g} A",
        paper_says=as_printed,
        model_gives=float(magnetics(machine, I_SAMPLE, 0.0)[2]),
        unit="N m",
        physical_limit=0.0,
        verdict=verdict(abs(as_printed) < 1e-6),
        why="By symmetry an aligned rotor gives no torque. f' must multiply the whole bracket, "
        "not its last term; i_p and i_q are one current, the phase's.",
    )


def flux_curves(machine: MachineFile) -> Claim:
    """Linear unaligned, saturating aligned."""
    flux = [magnetics(machine, i, np.pi / 4)[0] for i in (10.0, printed.I_M)]
    bend = flux[1] / flux[0] / (printed.I_M / 10.0)
    L = [magnetics(machine, i, 0.0)[3] * 1e3 for i in (0.0, printed.I_M)]
    return Claim(
        claim="Section 3: flux is linear in current unaligned and non-linear aligned (unaligned "
        "flux at 450 A over 45 times that at 10 A)",
        paper_says="linear",
        model_gives=float(bend),
        unit="1",
        physical_limit=1.0,
        verdict=verdict(abs(bend - 1) < 1e-9 and L[0] > 2 * L[1]),
        why=f"True of the mended model: unaligned 1 exactly; aligned the incremental inductance "
        f"falls from {L[0]:.2f} to {L[1]:.2f} mH. With f as printed it fails: f(45 deg) = 6.",
    )


def maximum_point(drive: Drive, best: optimum.Profile) -> list[Claim]:
    """I_m, theta_m, psi_m."""
    machine = drive.machine
    other = machine.model_copy(update={"psi_m_Wb": PSI_M_DEFAULT})
    point = other.at(u_dc=drive.converter.u_dc_V, omega_m=drive.omega_nominal)
    relaxed = optimum.best_profile(point, RATED.tau_ref)
    psi_15 = float(magnetics(other, printed.I_M, printed.THETA_M)[0])
    return [
        Claim(
            claim="Section 3: the flux at the maximum point, 450 A, is 0.468 Wb",
            paper_says=printed.PSI_M,
            model_gives=PSI_M_DEFAULT,
            unit="Wb",
            physical_limit=None,
            verdict="not confirmed",
            why="L_d, L_q and I_m are those of the generic 60 kW machine, whose value is 0.486: "
            "two digits changed places. We keep the printed value; the other lowers the least rms "
            f"current at the rated point from {best.i_rms:.1f} to {relaxed.i_rms:.1f} A.",
        ),
        Claim(
            claim="Section 3: the maximum point lies at theta_m = 15 deg (flux there at 450 A)",
            paper_says=printed.PSI_M,
            model_gives=psi_15,
            unit="Wb",
            physical_limit=None,
            verdict=verdict(abs(psi_15 / printed.PSI_M - 1) < 0.01),
            why=f"psi_m belongs to alignment, 0 deg. At 15 deg the generic machine has "
            f"{psi_15:.3f} Wb, neither 0.468 nor 0.486.",
        ),
    ]


def state_space(drive: Drive) -> list[Claim]:
    """Eq. 3.1 with the printed A, B, C."""
    machine, omega_m = drive.machine, drive.omega_nominal
    _, _, _, a, b = magnetics(machine, printed.I_M, printed.THETA_M)
    A, B, C = printed.matrices(float(a), float(b), omega_m)
    greatest = float(np.abs(printed.markov(A, B, C, 7)).max())
    F, Phi = printed.prediction(A, B, C, N_p=printed.N_P, N_c=printed.N_C)
    x = np.ones(F.shape[1])
    moves = printed.increments(F, Phi, x, reference=printed.TAU_RATED, r_w=printed.R_W)
    speed_pole = pump.pole(omega_m, k_pump=printed.K_PUMP, B=printed.FRICTION, J=printed.J)
    T_s = drive.control.T_s
    return [
        Claim(
            claim="Eq. 3.1: with the printed A, B, C the predictive controller acts on the torque "
            "(greatest |C A^k B|, k = 0..6)",
            paper_says="acts",
            model_gives=greatest,
            unit="N m/A",
            physical_limit=None,
            verdict=verdict(greatest > 0),
            why="C A^k B = 0 for every k and any a, b: no input reaches the output. So Phi = 0 and "
            f"Delta u = {float(np.abs(moves).max()):g}: the printed controller never moves. Ours "
            "has the torque as output equation and is linearised anew at each sample.",
        ),
        Claim(
            claim="Eq. 3.1: the printed pair (A, B) is controllable (rank of six states)",
            paper_says=6.0,
            model_gives=float(printed.controllability_rank(A, B)),
            unit="1",
            physical_limit=6.0,
            verdict=verdict(printed.controllability_rank(A, B) == 6),
            why="Only the three currents answer to u; nothing leads from them to speed or torque. "
            "That the paper needs controllability is our reading; it is not stated.",
        ),
        Claim(
            claim="Eq. 3.1, A row 6: the torque is a state with the pole T_emax",
            paper_says=printed.TAU_RATED,
            model_gives="no state",
            unit="per sample",
            physical_limit=None,
            verdict="not confirmed",
            why="Torque follows from currents and angle at once. As printed it would grow by 41.3 "
            "in each sample; stable is below 1.",
        ),
        Claim(
            claim="Eq. 3.1, A row 4: the speed pole at 1500 rpm is +(k omega^2 + f)/J",
            paper_says=float(A[3, 3]),
            model_gives=speed_pole,
            unit="1/s",
            physical_limit=None,
            verdict=verdict(A[3, 3] < 0),
            why="The load slows the shaft: -(2 k omega + f)/J. As printed the speed runs away.",
        ),
        Claim(
            claim="Eq. 3.1: x(k+1) = A x(k) + B u(k) with the entry -R/a",
            paper_says=float(A[0, 0]),
            model_gives=float(np.exp(-machine.R * T_s / a)),
            unit="per sample",
            physical_limit=None,
            verdict="not confirmed",
            why=f"These are continuous-time entries and no sample time is given. Held over T_s = "
            f"{T_s * 1e6:g} us (ours) a current keeps exp(-R T_s/a) of itself, a = {a * 1e3:.2f} "
            "mH. And 1/a is the gain of a voltage, while u is a current reference.",
        ),
    ]
