"""Laws that may learn the machine they drive: `learn = true` in their [control] table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from reluctance import _core
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.known import Known

STEPS_OF_NOTHING = 1  # a current of as many steps of the converter is none
NOISE_OF_NOTHING = 4  # times the rms noise
LEAST_PART = 1e-4  # of the current limit, is none in any case
LEAST_FLUX = 0.05  # of the flux linkage at the current limit: a smaller stroke says too little


class Learns(Control):
    """A law with orders of timers, which can tell the volt-seconds of each stroke."""

    learn: bool = False  # resistance and flux map, while it drives

    @property
    def learns(self) -> bool:
        return self.learn

    @model_validator(mode="after")
    def _learns_from_its_own_orders(self) -> Self:
        if self.learn and self.current_limit_A is not None:
            raise ValueError(
                f"learn = true with current_limit_A = {self.current_limit_A:g}, which changes the "
                "orders that are learned from, need one of them"
            )
        return self

    def alone(self, known: Known) -> Known:
        """What the law itself is built from: one that learns computes with phases alone."""
        return replace(known, pairs=None) if self.learn else known

    def that_learns(
        self,
        known: Known,
        make: Callable[..., _core.Law],
        law: dict[str, Any],
        w_sw_powers: tuple[float, float] = (0.0, 0.0),
    ) -> _core.Law:
        """The law around which it learns, and the pairs of phases that it takes into account."""
        torque, voltage = w_sw_powers
        return make(
            *self.built_for(known),
            fit=self.fit(known),
            pairs=None if known.pairs is None else known.pairs.core,
            w_sw_torque=torque,
            w_sw_voltage=voltage,
            **law,
        )

    def fit(self, known: Known) -> _core.StrokeFit:
        """What tells resistance and flux map from the strokes."""
        most = _core.magnetics(known.magnetics, np.array([known.i_max]), np.array([np.pi]))[0, 0]
        inductance = _core.magnetics(known.magnetics, np.zeros(1), np.zeros(1))[0, 3]
        return _core.StrokeFit(
            drops=_core.Drops(t_dead=known.t_dead, v_switch=known.v_switch, v_diode=known.v_diode),
            edges=known.edges,
            L_u=float(inductance),
            i_least=max(
                STEPS_OF_NOTHING * known.i_step + NOISE_OF_NOTHING * known.i_noise,
                LEAST_PART * known.i_max,
            ),
            i_missing=known.i_step / 2,
            psi_least=LEAST_FLUX * float(most),
            T_s=known.T_s,
            delay=known.delay,
        )
