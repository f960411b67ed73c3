"""Where the rotor is by the flux linkages, over a run (control/frame/flux_angle.hpp)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from reluctance import _core
from reluctance.base.arrays import FloatArray
from reluctance.base.units import from_si
from reluctance.drive.run.columns import Rows


@dataclass(frozen=True)
class Estimate:
    """Each of shape (n,), at the instants of the waveforms; NaN while nothing is estimated."""

    theta_e: FloatArray  # angle of the rotor, electrical, in [0, 2 pi) [rad]
    omega_m: FloatArray  # its speed, mechanical [rad/s]
    tau_load: FloatArray  # [N m]
    psi_scale: FloatArray  # flux linkage over that of the map [1]
    R_scale: FloatArray  # resistance over that of the drive file [1]
    zero: FloatArray  # by which the sensor shows more than the rotor's angle, electrical [rad]
    deviation: FloatArray  # standard deviation of theta_e [rad]
    error: FloatArray  # of theta_e [rad]

    def kept(self, rows: NDArray[np.bool_]) -> Self:
        """Some of the instants."""
        return replace(self, **{f.name: getattr(self, f.name)[rows] for f in fields(self)})

    def columns(self) -> dict[str, FloatArray]:
        """The waveforms under their border names."""
        return {
            "theta_e_hat_rad": self.theta_e,
            "speed_hat_rpm": from_si(self.omega_m, "rpm"),
            "tau_load_hat_Nm": self.tau_load,
            "psi_scale_hat": self.psi_scale,
            "R_scale_hat": self.R_scale,
            "zero_hat_deg": np.degrees(self.zero),
        }

    def figures(self) -> dict[str, Any] | None:
        """Errors of the second half of what is known, and the rest at the end, for `run --json`;
        None where nothing is known."""
        known = np.flatnonzero(np.isfinite(self.theta_e))
        if known.size == 0:
            return None
        error = np.degrees(self.error[known[known.size // 2 :]])
        last = known[-1]
        return {
            "error_rms_deg": float(np.sqrt(np.mean(error**2))),
            "error_max_deg": float(np.abs(error).max()),
            "deviation_deg": float(np.degrees(self.deviation[last])),
            "zero_deg": float(np.degrees(self.zero[last])),
            "psi_scale": float(self.psi_scale[last]),
            "R_scale": float(self.R_scale[last]),
        }

    def text(self) -> str:
        """In one line."""
        f = self.figures()
        if f is None:
            return "the rotor was not followed: the state run was not reached"
        return (
            f"wrong by {f['error_rms_deg']:.2g} deg electrical rms, "
            f"{f['error_max_deg']:.2g} at most; zero of the sensor {f['zero_deg']:+.1f} deg, "
            f"flux linkage {f['psi_scale']:.3f} and R {f['R_scale']:.3f} of what the control "
            "believes"
        )


def estimate(rows: Rows, N_r: int, T_s: float) -> Estimate:
    """From rows of waveforms. Between samples the rotor turns on at the speed that is estimated."""
    names = _core.flux_estimate_columns
    unknown = rows["psi_scale_hat"] == 0
    known = {name: np.where(unknown, np.nan, rows[name]) for name in names}
    t, theta = rows["t"], known["theta_hat"]
    since = t - T_s * np.floor(t / T_s + 1e-6)
    theta = theta + N_r * known["omega_hat"] * since
    return Estimate(
        theta_e=theta % (2 * np.pi),
        omega_m=known["omega_hat"],
        tau_load=known["tau_load_hat"],
        psi_scale=known["psi_scale_hat"],
        R_scale=known["R_scale_hat"],
        zero=known["zero_hat"],
        deviation=known["theta_deviation"],
        error=(theta - N_r * rows["theta_m"] + np.pi) % (2 * np.pi) - np.pi,
    )
