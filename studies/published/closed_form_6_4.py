"""The 6/4 machine in closed form of three published cases, as a machine file and its flux map.

    psi(theta, i) = L_u i + psi_m g(theta) (1 - exp(-k i)),    k = (L_a - L_u)/psi_m
    g = s^2/(s^2 + (1 - s)^2),    s = (1 - cos theta)/2,    theta electrical, 0 unaligned

Source: github.com/demidofa/SRM_PINN @ f4dd7deb, scripts/srm_model.py (no licence: numbers and
formula only). The source says that the machine is illustrative.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from reluctance.drive.drive import Drive, drive_from
from reluctance.machine.library import machine_table
from reluctance.machine.maps import FluxTable, write_map

OUT = Path(__file__).parents[2] / "out" / "published"
L_U, L_A, PSI_M, R = 0.012, 0.120, 1.1, 0.6  # [H, H, Wb, ohm]
U_DC, J, N_R = 540.0, 0.02, 4  # [V, kg m^2]
K = (L_A - L_U) / PSI_M  # [1/A]
I_TOP = 30.0  # of the map [A]


def g(theta_e: np.ndarray) -> np.ndarray:
    """Shape of the inductance: 0 unaligned, 1 aligned."""
    s = (1 - np.cos(theta_e)) / 2
    return np.asarray(s**2 / (s**2 + (1 - s) ** 2))


def flux(theta_e: np.ndarray, i: np.ndarray) -> np.ndarray:
    """Flux linkage [Wb]."""
    return np.asarray(L_U * i + PSI_M * g(theta_e) * (1 - np.exp(-K * i)))


def torque(theta_e: np.ndarray, i: np.ndarray) -> np.ndarray:
    """dW'/dtheta at constant current, mechanical [N m]: N_r psi_m g' (i - (1 - exp(-k i))/k)."""
    s = (1 - np.cos(theta_e)) / 2
    slope = s * (1 - s) / (s**2 + (1 - s) ** 2) ** 2 * np.sin(theta_e)
    return np.asarray(N_R * PSI_M * slope * (i - (1 - np.exp(-K * i)) / K))


def machine_file(folder: Path, *, B_Nms: float = 0.0, N_r: int = N_R) -> Path:
    """Writes machine file and map; 121 angles and 61 currents. The source's 8/6 machine has the
    same flux linkage over the electrical angle."""
    name = f"closed_form_{N_r + 2}_{N_r}"
    i = np.linspace(0, I_TOP, 61)
    theta_e = np.linspace(0, np.pi, 121)
    table = FluxTable(N_r, i, theta_e, flux(theta_e[None, :], i[:, None]))
    write_map(table, folder / f"{name}.csv")
    path = folder / f"{name}.toml"
    path.write_text(
        f"""[machine]
name = "{N_r + 2}/{N_r} in closed form"
source = "github.com/demidofa/SRM_PINN @ f4dd7deb"
licence = "none: numbers only"
N_s = {N_r + 2}
N_r = {N_r}
n_phases = {N_r // 2 + 1}
R_ohm = {R}
i_max_A = {I_TOP}
J_kgm2 = {J}
B_Nms = {B_Nms}
model = "map"
map = "{name}.csv"
angle_kind = "electrical"
""",
        encoding="utf-8",
    )
    return path


def drive(*, B_Nms: float = 0.0, N_r: int = N_R, **tables: dict[str, Any]) -> Drive:
    """A drive with this machine on 540 V. The map is read later, so it stays in out/."""
    OUT.mkdir(parents=True, exist_ok=True)
    machine = machine_table(str(machine_file(OUT, B_Nms=B_Nms, N_r=N_r)), OUT)
    data = {"machine": machine, "converter": {"u_dc_V": U_DC}, **tables}
    return drive_from(data, name=f"closed form {N_r + 2}/{N_r}")
