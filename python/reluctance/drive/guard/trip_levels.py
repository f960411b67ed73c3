"""The trip levels of a drive: as its [protection] table gives them, or by default."""

from __future__ import annotations

import numpy as np

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.units import from_si, to_si
from reluctance.drive.all_tables import OVER_VOLTAGE
from reluctance.drive.drive import Drive
from reluctance.machine.coupling import Coupling

OVER_CURRENT = 1.2  # of i_max_A
ZERO_CURRENT = 0.02  # of i_max_A: a current sensor's offset
ABOVE_NOISE = 1.1  # of the greatest error of a reading: no current reads less
NOISE_PEAK = 6.0  # of its rms value, as simulated (sim/noise.hpp)
VOLTAGE_MARGIN = 0.2  # of u_dc: devices, dead time, sensor of the dc link
MODEL_ERROR = 0.25  # of the flux linkage, from one machine of a series to another
FALSE_ALARM = 1e-15  # of a healthy sensor that shows the same code so often, per sample
LEAST_NOISE_LSB = 0.7  # below, equal readings prove nothing
UNDER_VOLTAGE = 0.25  # of u_dc_V
ABOVE_COLD = 1.05  # of the open-circuit voltage on a cold morning, where no rating is given
OVER_SPEED = 1.3  # of the speed that the drive works at
ENCODER_STEPS = 1.5  # one by which the angle is late, half a one of margin
SMALLEST_SLACK_DEG = 0.1  # electrical; for an ideal sensor
ACCELERATION_MARGIN = 1.25  # a shaft that gives way, an inertia that is not well known
MOST_SLACK_DEG = 170.0  # electrical; beyond, an angle looks like one the other way round
MUTUAL = 0.01  # of the greatest flux linkage: what the other phases may add to one
NOISE_AHEAD = 2.0  # n samples of noise of the dc link add up to sqrt(n) <= 2 + n/8 of one
TRIAL = 1 / 3  # of i_max_A: of a phase alone before the law runs, and at most as much again
PATIENCE = 0.2  # a fault is named after so long, whatever explains it [s]


def protection(drive: Drive) -> _core.Protection:
    """The protection of a drive, with levels as given or by default.

    Raises
    ------
    ParameterError
        If the sensors cannot show a level, or a level would trip in normal work.
    """
    table = drive.protection
    i_max, u_dc = drive.machine.i_max_A, drive.converter.u_dc_V
    i_trip = _given(table.i_trip_A, OVER_CURRENT * i_max)
    if i_trip <= i_max:
        raise ParameterError(
            f"[protection] i_trip_A = {i_trip:g}, need more than [machine] i_max_A = {i_max:g}, "
            "which the control may ask for; for less current lower i_max_A as well"
        )
    if drive.sensing.adc_bits > 0 and drive.sensing.i_range_A <= i_trip:
        raise ParameterError(
            f"[protection] i_trip_A = {i_trip:g}, need < [sensing] i_range_A = "
            f"{drive.sensing.i_range_A:g}, or over-current is never seen"
        )
    lowest, highest = _voltages(drive)
    u_dc_min = _given(table.u_dc_min_V, lowest)
    u_dc_max = _given(table.u_dc_max_V, highest)
    if drive.source.kind == "pv" and u_dc_max <= drive.source.cold_voltage:
        raise ParameterError(
            f"[protection] u_dc_max_V = {u_dc_max:g}, need more than the "
            f"{drive.source.cold_voltage:.4g} V of a cold bright morning, or it trips before work"
        )
    if not u_dc_min < u_dc < u_dc_max:
        raise ParameterError(
            f"[protection] u_dc_min_V = {u_dc_min:g}, u_dc_max_V = {u_dc_max:g}, need [converter] "
            f"u_dc_V = {u_dc:g} between them"
        )
    omega_max = _given(table.speed_max_rpm, from_si(OVER_SPEED * drive.omega_nominal, "rpm"))
    omega_max = to_si(omega_max, "rpm")
    if omega_max <= drive.omega_nominal:
        raise ParameterError(
            f"[protection] speed_max_rpm = {from_si(omega_max, 'rpm'):g}, need more than the "
            f"{from_si(drive.omega_nominal, 'rpm'):g} rpm that the drive works at; "
            f"{'set' if table.speed_max_rpm is None else 'raise'} it"
        )
    step = angle_step(drive)
    slack = _given(table.angle_slack_deg, _slack(drive, step))
    if slack <= step:
        raise ParameterError(
            f"[protection] angle_slack_deg = {slack:g}, need more than the angle sensor's step of "
            f"{step:g} deg electrical"
        )
    if slack > MOST_SLACK_DEG:
        raise ParameterError(
            f"[protection] angle_slack_deg = {slack:g}, need at most {MOST_SLACK_DEG:g}: with more "
            "no angle is ever wrong"
        )
    if drive.converter.t_dead > VOLTAGE_MARGIN * drive.control.T_s:
        raise ParameterError(
            f"[converter] dead_time_us = {drive.converter.dead_time_us:g}, need at most "
            f"{VOLTAGE_MARGIN:g} of [control] T_s_us = {drive.control.T_s_us:g} for firmware: the "
            "protection would find a healthy current sensor dead; take a longer control period"
        )
    i_error = current_error(drive)
    if table.i_zero_A is None and ABOVE_NOISE * i_error >= TRIAL * i_max:
        sensing = drive.sensing
        raise ParameterError(
            f"[sensing] i_range_A = {sensing.i_range_A:g}: a reading may be wrong by "
            f"{i_error:.3g} A, need less than {TRIAL / ABOVE_NOISE:.0%} of [machine] i_max_A = "
            f"{i_max:g}; check its unit, or the noise and offset of [sensing]"
        )
    i_zero = _given(table.i_zero_A, max(ZERO_CURRENT * i_max, ABOVE_NOISE * i_error))
    if i_zero < i_error:
        raise ParameterError(
            f"[protection] i_zero_A = {i_zero:g}, need at least the {i_error:.3g} A by which a "
            "reading of [sensing] may be wrong"
        )
    if i_zero >= TRIAL * i_max:
        raise ParameterError(
            f"[protection] i_zero_A = {i_zero:g}, need less than {TRIAL * i_max:.3g}, a third of "
            f"[machine] i_max_A = {i_max:g}: up to this reading a phase counts as one without "
            "current"
        )
    return _core.Protection(
        flux=_core.FluxBounds(
            R=drive.known().R,
            T_s=drive.control.T_s,
            i_error=i_error,
            model_error=_model_error(drive, step),
            u_margin=VOLTAGE_MARGIN,
        ),
        levels=_core.TripLevels(
            i_trip=i_trip,
            u_dc_min=u_dc_min,
            u_dc_max=u_dc_max,
            omega_max=omega_max,
            angle_slack=float(np.radians(slack)),
        ),
        advance=_advance(drive, float(np.radians(slack)), omega_max),
        i_zero=i_zero,
        delay=drive.sensing.delay_samples,
        frozen=_frozen(drive),
    )


def diagnosis(drive: Drive) -> _core.Diagnosis | None:
    """What tells the faults of a drive apart, where its [protection] asks for it."""
    table, sensing, machine = drive.protection, drive.sensing, drive.known().machine
    if not table.diagnosis:
        return None
    guard = protection(drive)
    u_noise = NOISE_PEAK * sensing.u_dc_noise_V
    patience = int(np.ceil(PATIENCE / drive.control.T_s))
    names = "map_error", "R_error", "u_error", "phase_error"
    parts = {name: table.si[name] for name in names}

    def aligned(i: float) -> float:
        return float(_core.magnetics(machine.magnetics, np.array([i]), np.array([np.pi]))[0, 0])

    i_trial = TRIAL * machine.i_max_A
    reads_zero = aligned(guard.i_zero + guard.flux.i_error)
    coupling = machine.coupling if machine.coupled else None
    if coupling is None:
        mutual = MUTUAL * aligned(machine.i_max_A)
    else:
        mutual = (1 + parts["map_error"]) * _mutual(coupling, machine.i_max_A)
    psi_error = mutual + u_noise * NOISE_AHEAD * drive.control.T_s
    return _core.Diagnosis(
        flux=_core.WindingFlux(
            drops=_core.Drops(
                t_dead=drive.converter.t_dead,
                v_switch=drive.converter.v_switch_V,
                v_diode=drive.converter.v_diode_V,
            ),
            R_error=parts["R_error"],
            u_error=parts["u_error"] + u_noise / (4 * NOISE_AHEAD * drive.converter.u_dc_V),
            i_gain=_gain_error(drive),
            map_error=parts["map_error"],
            psi_error=psi_error,
            psi_zero=(1 + parts["map_error"]) * reads_zero + psi_error,
            psi_max=(1 + parts["map_error"]) * aligned(machine.i_max_A) + psi_error,
        ),
        trial=_core.PhaseTrial(
            i=i_trial,
            psi=(1 + parts["map_error"]) * aligned(i_trial) + psi_error,
            psi_sample=_trial_step(drive, i_trial),
        ),
        likeness=_core.Likeness(
            spread=parts["phase_error"] + _steepest(drive) * _angle_error(drive, angle_step(drive)),
            i_gain=_gain_error(drive),
            i_noise=NOISE_PEAK * sensing.i_noise,
            i_offset=guard.flux.i_error - NOISE_PEAK * sensing.i_noise,
            u_noise=u_noise * drive.control.T_s,
            psi_error=psi_error,
            R_error=parts["R_error"],
            u_error=parts["u_error"],
            map_error=parts["map_error"],
            recent=patience,
        ),
        theta_error=_angle_error(drive, angle_step(drive)) + table.si["zero_error"],
        i_max=machine.i_max_A,
        patience=patience,
    )


def flux_angle(drive: Drive) -> _core.FluxAngle | None:
    """What follows the rotor by the flux linkages, where [protection] asks for it."""
    names = diagnosis(drive)
    if names is None or not drive.protection.flux_angle:
        return None
    guard = protection(drive)
    machine = drive.machine
    theta_error = names.theta_error - float(np.radians(angle_step(drive) / 2))
    fastest = drive.omega_nominal or guard.levels.omega_max
    psi_error = names.flux.psi_error
    if drive.pairs_known:  # which are as wrong as the map
        coupling = drive.known().machine.coupling
        assert coupling is not None
        psi_error -= _mutual(coupling, drive.known().machine.i_max_A)
    return _core.FluxAngle(
        T_s=drive.control.T_s,
        acceleration=machine.N_r / drive.J,
        theta_step=float(np.radians(max(angle_step(drive), SMALLEST_SLACK_DEG))),
        theta_error=theta_error,
        zero_drift=theta_error * np.sqrt(machine.N_r * fastest / (2 * np.pi)),
        tau_drift=machine.greatest_torque,
        omega_error=machine.N_r * guard.levels.omega_max,
        map_error=names.flux.map_error,
        R_error=names.flux.R_error,
        psi_error=psi_error,
        i_noise=float(np.hypot(drive.sensing.i_noise, drive.sensing.i_step / np.sqrt(12))),
        i_zero=guard.i_zero,
        alike=names.patience,
    )


def _mutual(coupling: Coupling, i_max: float) -> float:
    """What the other phases add at most to the flux linkage of one, and to that of one without
    current, from which its flux linkage is counted [Wb]."""
    i = np.linspace(0.0, i_max, 13)
    theta_e = np.radians(np.arange(0.0, 360.0, 5.0))
    own, other, at = (x.ravel() for x in np.meshgrid(i, i, theta_e, indexing="ij"))
    added = np.zeros((2, coupling.n_phases, theta_e.size))
    for pair in coupling.pairs:
        for phase, beside in ((pair.first, pair.second), (pair.second, pair.first)):
            currents = np.zeros((at.size, coupling.n_phases))
            currents[:, phase], currents[:, beside] = own, other
            psi = np.abs(coupling.psi(currents, at)[:, phase])
            psi = psi.reshape(i.size, i.size, theta_e.size)
            added[0, phase] += psi.max((0, 1))
            added[1, phase] += psi[0].max(0)
    return float(added.max((1, 2)).sum())


def _trial_step(drive: Drive, i_trial: float) -> float:
    """Flux linkage of a sample from which no current rises by more than i_trial until an order to
    end it acts [Wb]."""
    i = np.linspace(0.0, 2 * i_trial, 41)
    theta_e = np.linspace(0.0, np.pi, 37)
    at = np.meshgrid(i, theta_e, indexing="ij")
    psi = _core.magnetics(drive.known().machine.magnetics, at[0].ravel(), at[1].ravel())[:, 0]
    least = np.diff(psi.reshape(at[0].shape), axis=0).min() / i[1]  # incremental inductance [H]
    known = 1 - drive.protection.map_error_pct / 100
    return float(known * i_trial * least / (1 + drive.sensing.delay_samples))


def current_error(drive: Drive) -> float:
    """The greatest error of a current reading, its gain aside: noise, offset, one step [A]."""
    sensing = drive.sensing
    offset = max((abs(i) for i in sensing.i_offset_A), default=0.0)
    return NOISE_PEAK * sensing.i_noise + sensing.i_step + offset


def angle_step(drive: Drive) -> float:
    """One step of the angle sensor [deg electrical]; 0 of an ideal one."""
    if drive.sensing.encoder_counts > 0:
        return 360 * drive.machine.N_r / drive.sensing.encoder_counts
    return 180 / drive.machine.n_phases if drive.sensing.hall else 0.0


def _slack(drive: Drive, step: float) -> float:
    """Default of angle_slack_deg: steps of the sensor, and the correction that Hall edges and index
    make after the start."""
    sensing = drive.sensing
    slack = max(ENCODER_STEPS * step, SMALLEST_SLACK_DEG)
    if sensing.encoder_index:
        slack += 90 / drive.machine.n_phases + abs(sensing.hall_error_deg)
    return min(slack, MOST_SLACK_DEG)


def _advance(drive: Drive, slack: float, omega_max: float) -> _core.Advance:
    """How angles are held against each other (control/guard/advance.hpp). slack: of two [rad]."""
    if not drive.sensing.counted_angle:
        return _core.Advance(bend=0.0, block=0)
    T_s = drive.control.T_s
    a = ACCELERATION_MARGIN * drive.machine.N_r * _acceleration(drive, omega_max)
    block = max(round(np.sqrt(2 * slack / a) / (_core.Advance.parts * T_s)), 1)
    return _core.Advance(bend=min(a * (_core.Advance.parts * block * T_s) ** 2, np.pi), block=block)


def _acceleration(drive: Drive, omega_max: float) -> float:
    """Greatest acceleration, that of a machine which brakes together with its load, or of the
    course of a held speed [rad/s^2]. The speed may be any up to over-speed; a fan or a pump takes
    no more there than what drives it."""
    load = drive.load
    times, speeds = (np.array(part) for part in load.omega)
    held = np.abs(np.diff(speeds) / np.diff(times)).max(initial=0.0)
    steady = max(abs(tau) for tau in load.tau_0[1])
    driven = drive.machine.greatest_torque + steady
    passive = driven if load.pump is not None else min(load.k * omega_max**2, driven)
    return max((driven + passive) / drive.J, float(held))


def _model_error(drive: Drive, step: float) -> float:
    """How wrong the flux linkage at a reading may be: the model, the gain of the sensor, and half a
    step of the angle where the inductance changes most."""
    return MODEL_ERROR + _gain_error(drive) + _steepest(drive) * _angle_error(drive, step)


def _steepest(drive: Drive) -> float:
    """The greatest change of the inductance with the angle, over itself [1/rad]."""
    theta_e = np.linspace(0.0, np.pi, 181)
    i = np.full_like(theta_e, ZERO_CURRENT * drive.machine.i_max_A)
    psi = _core.magnetics(drive.machine.magnetics, i, theta_e)[:, 0]
    return float(np.max(np.abs(np.gradient(psi, theta_e)) / psi))


def _gain_error(drive: Drive) -> float:
    """Of the current readings [1]."""
    return max((abs(g - 1) for g in drive.sensing.i_gain), default=0.0)


def _angle_error(drive: Drive, step: float) -> float:
    """How wrong the angle may be, electrical [rad]. step: of its sensor [deg]."""
    wrong = float(np.radians(step / 2 + abs(drive.sensing.hall_error_deg)))
    return wrong + np.pi / 2 / drive.machine.n_phases * drive.sensing.encoder_index


def _frozen(drive: Drive) -> int:
    """Equal readings in a row that noise leaves to a healthy sensor less often than FALSE_ALARM."""
    noise = drive.sensing.i_noise_LSB
    if noise < LEAST_NOISE_LSB:
        return 0
    equal = 1 / (2 * np.sqrt(np.pi) * noise)  # of two Gaussian codes next to each other
    return int(np.ceil(np.log(FALSE_ALARM) / np.log(equal)))


def _voltages(drive: Drive) -> tuple[float, float]:
    """Default limits of the dc-link voltage [V]. An array gives nothing at night, and its
    open-circuit voltage on a cold morning."""
    if drive.source.kind != "pv":
        return UNDER_VOLTAGE * drive.converter.u_dc_V, OVER_VOLTAGE * drive.converter.u_dc_V
    margin = ABOVE_COLD * drive.source.cold_voltage
    return 0.0, drive.converter.u_rating_V or margin


def _given(value: float | None, default: float) -> float:
    return default if value is None else value
