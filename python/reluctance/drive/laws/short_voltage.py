"""From which speed on a guide is short of voltage: it takes all of it for much of the period."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from reluctance.drive.laws.flux_guide import FULL_VOLTAGE, nearest_level, voltage
from reluctance.drive.tables.known import Known

if TYPE_CHECKING:
    from reluctance.machine.optimum import Table

SHORT = 0.3  # of the period at full voltage: more is short [1]
NEVER = 1e30


def short_from(tables: Sequence[Table], known: Known) -> float:
    """Speed over dc-link voltage above which the voltage is short [rad/(s V)]; NEVER up to the
    highest speed of the guide.

    Between its speeds, and below the lowest, the share of the period is taken to be linear in the
    speed.
    """
    speeds, shares = [0.0], [0.0]
    for table in tables:
        u = voltage(known.at(table.omega_m), table, nearest_level(table, known.tau_working))
        speeds.append(abs(table.omega_m))
        shares.append(float(np.mean(np.abs(u) >= FULL_VOLTAGE * table.u_dc)))
        if shares[-1] > SHORT:
            return float(np.interp(SHORT, shares[-2:], speeds[-2:])) / known.u_dc
    return NEVER
