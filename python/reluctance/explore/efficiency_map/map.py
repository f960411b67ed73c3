"""Key figures of a control law over speed and torque, from switched runs on a locked shaft.

Figures stand over the torque that a run achieved, not the one it was asked for. Losses are
interpolated as loss over torque, which is nearly straight in speed and torque: linear interpolation
of the power itself is ten times worse (`reluctance.pumping.loss_map`).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from reluctance.base.arrays import FloatArray
from reluctance.base.errors import Note, ParameterError
from reluctance.base.units import from_si, to_si
from reluctance.drive.drive import Drive, check_drive
from reluctance.explore.efficiency_map.locked import at, length, rising
from reluctance.explore.sweeps.sweep import swept

LOSSES = {  # the latter two where the drive has their data
    "p_cu_W": "copper",
    "p_dev_W": "device conduction",
    "p_sw_W": "switching",
    "p_fe_W": "iron",
}
FIGURES = ("torque_ripple_pp", "torque_ripple_rms", "i_rms_A", "i_peak_A", "f_switch_Hz")
HELD = 0.97  # of the torque asked for: from here on the drive holds it
SPEEDS, TORQUES = 10, 8  # of a map where none are given
SLOWEST, LEAST = 0.1, 0.05  # first speed and torque of those, over the greatest
SYMMETRY = (
    "a drive that turns backwards has by symmetry the map of positive speeds with the other sign "
    "of torque: positive where it motors, negative where it brakes (--torque)"
)


@dataclass(frozen=True)
class EfficiencyMap:
    """Losses and other figures of a drive on a grid; axes rise in magnitude."""

    drive: Drive
    u_dc: float  # [V]
    omega: FloatArray  # (n_w,) [rad/s]
    tau: FloatArray  # (n_t,) electromagnetic torque, achieved; all negative when braking [N m]
    tau_max: FloatArray  # (n_w,) the greatest that is held, or the end of the map [N m]
    loss_per_torque: FloatArray  # (n_w, n_t) all losses [W/(N m)]
    kinds_per_torque: dict[str, FloatArray]  # (n_w, n_t) each of LOSSES that is counted
    figures: dict[str, FloatArray]  # (n_w, n_t) FIGURES
    ran: int  # runs made now

    def loss(self, omega: ArrayLike, tau: ArrayLike, kind: str | None = None) -> FloatArray:
        """Loss, or that of a kind, at speeds [rad/s] and torques [N m], broadcast [W]. Outside the
        grid, the loss over torque is that of its edge."""
        table = self.loss_per_torque if kind is None else self.kinds_per_torque[kind]
        sizes = np.abs(np.asarray(tau, float))
        return np.asarray(sizes * self._between(table, omega, tau))

    def p_in(self, omega: ArrayLike, tau: ArrayLike) -> FloatArray:
        """Power from the dc link [W]; negative where it flows back."""
        p_mech = np.asarray(tau, float) * np.asarray(omega, float)
        return np.asarray(p_mech + self.loss(omega, tau))

    def efficiency(self, omega: ArrayLike, tau: ArrayLike) -> FloatArray:
        """p_mech/p_in when motoring, p_in/p_mech when braking [1]; NaN where both sides feed the
        losses."""
        p_mech, p_in = np.asarray(tau) * np.asarray(omega), self.p_in(omega, tau)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(p_mech > 0, p_mech / p_in, p_in / p_mech)
        return np.asarray(np.where(p_mech * p_in > 0, found, np.nan))

    def figure(self, name: str, omega: ArrayLike, tau: ArrayLike) -> FloatArray:
        """One of FIGURES at speeds [rad/s] and torques [N m], broadcast."""
        return self._between(self.figures[name], omega, tau)

    def holds(self, omega: ArrayLike, tau: ArrayLike) -> NDArray[np.bool_]:
        """Whether the drive holds these torques [N m], within the speeds of the map [rad/s]."""
        omega, tau = np.broadcast_arrays(np.asarray(omega, float), np.asarray(tau, float))
        most = np.abs(np.interp(omega, self.omega, self.tau_max))
        inside = (omega >= 0) & (omega <= self.omega[-1] * (1 + 1e-9))
        same = (tau == 0) | (np.sign(tau) == np.sign(self.tau[0]))
        return np.asarray(inside & same & (np.abs(tau) <= most * (1 + 1e-9)))

    def columns(self) -> dict[str, FloatArray]:
        """The grid as columns under border names; NaN beyond what the drive holds."""
        omega, tau = (a.ravel() for a in np.meshgrid(self.omega, self.tau, indexing="ij"))
        held = self.holds(omega, tau)
        table = {
            "speed_rpm": from_si(omega, "rpm"),
            "tau_Nm": tau,
            "efficiency": self.efficiency(omega, tau),
            "p_in_W": self.p_in(omega, tau),
            "loss_W": self.loss(omega, tau),
            **{kind: self.loss(omega, tau, kind) for kind in self.kinds_per_torque},
            **{name: values.ravel() for name, values in self.figures.items()},
        }
        axes = ("speed_rpm", "tau_Nm")
        return {k: v if k in axes else np.where(held, v, np.nan) for k, v in table.items()}

    def best(self) -> tuple[float, float, float] | None:
        """The greatest efficiency on the grid, and its speed [rad/s] and torque [N m]; None where
        both sides feed the losses at each point."""
        table = self.columns()
        if np.isnan(table["efficiency"]).all():
            return None
        n = int(np.nanargmax(table["efficiency"]))
        speed = to_si(float(table["speed_rpm"][n]), "rpm")
        return float(table["efficiency"][n]), speed, float(table["tau_Nm"][n])

    def _between(self, table: FloatArray, omega: ArrayLike, tau: ArrayLike) -> FloatArray:
        from scipy.interpolate import RegularGridInterpolator

        axes = (self.omega, np.abs(self.tau))
        point = [
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(np.broadcast_arrays(omega, np.abs(tau)), axes, strict=True)
        ]
        found = RegularGridInterpolator(axes, table)(np.stack(point, -1))
        return np.asarray(found).reshape(np.shape(point[0]))


def efficiency(
    drive: Drive,
    *,
    omega: Sequence[float] | FloatArray | None = None,
    tau: Sequence[float] | FloatArray | None = None,
    u_dc: float | None = None,
    out: str | Path | None = None,
    jobs: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> EfficiencyMap:
    """The map of a drive's control law, from a switched run at each speed and torque.

    Parameters
    ----------
    drive : Drive
        Its load and reference are replaced by a locked shaft and a torque.
    omega : array_like, optional
        Speeds, > 0 [rad/s]; by default ten up to twice the speed that the drive works at.
    tau : array_like, optional
        Torques, of one sign [N m]; by default eight up to the greatest that the control may ask
        for. Negative: the map of braking.
    u_dc : float, optional
        Dc-link voltage, stiff [V]; by default the drive's.
    out, jobs, progress : as for `sweep`.

    Raises
    ------
    ParameterError
        If the control law takes no torque reference, an axis cannot be meant, or the drive holds
        no point of the grid.

    Examples
    --------
    >>> import reluctance as rl
    >>> from reluctance.explore.efficiency_map import efficiency
    >>> drive = rl.load("examples/sharing_cubic.toml")
    >>> found = efficiency(drive, omega=[100, 150], tau=[20, 40])
    >>> bool(0.4 < found.efficiency(120, 30) < 0.9)
    True
    """
    check_drive(drive, "efficiency")
    if not drive.control.follows_torque:
        raise ParameterError(
            "[control] fixes its current and cannot follow a torque; take another law, or leave "
            "i_ref_A out"
        )
    speeds = _usual_speeds(drive) if omega is None else _axis("speeds", omega, "rpm")
    torques = (
        np.linspace(LEAST, 1, TORQUES) * drive.tau_max
        if tau is None
        else _axis("torques", tau, "Nm")
    )
    u = drive.converter.u_dc_V if u_dc is None else float(u_dc)
    # The tables of a law reach to the drive's own greatest torque, or to the torque of the point
    # where that is more: what a point gives does not depend on the others of the grid.
    reach = [max(drive.tau_max, abs(float(x))) for x in torques]
    base = at(drive, u_dc=u, omega=float(speeds[0]), tau=float(torques[0]), tau_max=reach[0])
    columns: dict[str, list[float]] = {
        "load.speed_rpm": [from_si(float(w), "rpm") for w in speeds for _ in torques],
        "reference.tau_Nm": [float(x) for _ in speeds for x in torques],
        "simulation.until_s": [length(drive, float(w)) for w in speeds for _ in torques],
        "control.tau_max_Nm": [most for _ in speeds for most in reach],
    }
    shape = (len(speeds), len(torques), 1)
    found = swept(base, columns, shape, out=out, jobs=jobs, progress=progress)
    if found.failed:  # tables that do not reach the top may reach this torque
        own = {**columns, "control.tau_max_Nm": [abs(x) for x in columns["reference.tau_Nm"]]}
        kept = [n for n, why in enumerate(found.why) if why]
        rest = {name: [values[n] for n in kept] for name, values in own.items()}
        again = swept(base, rest, (), out=out, jobs=jobs, progress=None)
        for name, values in again.figures.items():
            found.figures[name][kept] = values
        found = replace(found, why=again.why, ran=found.ran + again.ran)
    figures = {name: values.reshape(shape[:2]) for name, values in found.figures.items()}
    if np.isnan(figures["tau_mean_Nm"]).all():
        raise ParameterError(f"the drive runs at no point of the map: {found.reason()}")
    return _over_achieved(drive, u, speeds, torques, figures, found.ran)


def _check_holds(made: EfficiencyMap) -> None:
    """Raises ParameterError where no torque of the map is held at any of its speeds."""
    omega, tau = np.meshgrid(made.omega, made.tau, indexing="ij")
    if not made.holds(omega, tau).any():
        w = int(np.argmax(np.abs(made.tau_max)))
        raise ParameterError(
            f"the drive holds no point of the map: of at least {abs(made.tau[0]):g} N m asked for, "
            f"it gives at most {abs(made.tau_max[w]):.3g}, at "
            f"{from_si(float(made.omega[w]), 'rpm'):.5g} rpm; ask for less torque (--torque), "
            "lower speeds (--speed) or a higher voltage (--u-dc)"
        )


def _usual_speeds(drive: Drive) -> FloatArray:
    """Up to twice the speed that a drive works at [rad/s]; a Note where it turns backwards."""
    rpm = from_si(drive.omega_asked, "rpm")
    if rpm == 0:
        raise ParameterError(
            "the drive stands still, where no electrical period ends; give the speeds of the map "
            "(--speed), all > 0"
        )
    if rpm < 0:
        warnings.warn(f"the drive works at {rpm:.5g} rpm; {SYMMETRY}", Note, stacklevel=3)
    return np.linspace(SLOWEST, 1, SPEEDS) * 2 * drive.omega_nominal


def _axis(name: str, values: Sequence[float] | FloatArray, unit: str) -> FloatArray:
    axis = np.asarray(values, dtype=np.float64)
    axis = axis[np.argsort(np.abs(axis), kind="stable")] if axis.ndim == 1 else axis
    sizes = np.abs(axis)
    speeds = unit == "rpm"
    one_sign = axis.size and (np.all(axis > 0) or (not speeds and np.all(axis < 0)))
    if axis.ndim != 1 or axis.size < 2 or not one_sign or np.any(np.diff(sizes) <= 0):
        given = [f"{from_si(float(x), unit):g}" for x in axis.ravel()]
        shown = ", ".join(given if len(given) < 9 else [*given[:4], "...", *given[-2:]])
        needed = "all > 0" if speeds else "of one sign and none of them 0"
        why = ""
        if speeds and np.any(axis < 0):
            why = f"; {SYMMETRY}"
        elif speeds and 0 in axis:
            why = " (at standstill no electrical period ends)"
        raise ParameterError(
            f"{name} {shown or 'none'} {'rpm' if speeds else 'N m'}, need at least two different "
            f"ones, {needed}{why}"
        )
    return axis


def _over_achieved(
    drive: Drive,
    u_dc: float,
    omega: FloatArray,
    tau: FloatArray,
    figures: dict[str, FloatArray],
    ran: int,
) -> EfficiencyMap:
    """The figures over the torque achieved instead of the one asked for."""
    asked, sign = np.abs(tau), np.sign(tau[0])
    achieved = np.maximum(sign * figures["tau_mean_Nm"], 1e-9)
    counted = [kind for kind in LOSSES if not np.isnan(figures[kind]).all()]
    # Not p_in - p_mech: in that is what the field energy rose by while the figures were taken, up
    # to 1 % of the losses at low speed.
    kinds = {kind: figures[kind] / achieved for kind in counted}
    tables = {
        "loss": np.sum([*kinds.values()], axis=0),
        **kinds,
        **{name: figures[name] for name in FIGURES},
    }
    over = {name: np.full((len(omega), len(tau)), np.nan) for name in tables}
    tau_max = np.zeros(len(omega))
    for w in range(len(omega)):
        there = np.flatnonzero(~np.isnan(figures["tau_mean_Nm"][w]))
        if not there.size:
            continue
        x = achieved[w, there]
        kept = there[rising(asked[there], x)]
        most = float(x.max())
        tau_max[w] = sign * (asked[there[-1]] if most > HELD * asked[there[-1]] else most)
        for name, table in tables.items():
            good = kept[~np.isnan(table[w, kept])]
            if good.size:
                over[name][w] = np.interp(asked, achieved[w, good], table[w, good])
    loss, kind_tables = over.pop("loss"), {kind: over.pop(kind) for kind in counted}
    made = EfficiencyMap(drive, u_dc, omega, tau, tau_max, loss, kind_tables, over, ran)
    _check_holds(made)
    return made
