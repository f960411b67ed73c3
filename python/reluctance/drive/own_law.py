"""Control laws of one's own, in Python: `law = "python:my_law.py:MyLaw"`, or given to `simulate`.

Such a law stands where the laws of the core stand: behind sensors, tracker, speed loop, sampled
comparators and dead-time compensation.
"""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ConfigDict

from reluctance import _core
from reluctance.drive.control import Control
from reluctance.drive.known import Known
from reluctance.drive.schema import did_you_mean
from reluctance.errors import ParameterError
from reluctance.files import is_file
from reluctance.units import si

PREFIX = "python:"


class Law:
    """A control law to subclass.

    A law that takes numbers takes them as keyword arguments of its constructor, in SI. In a drive
    file they stand in [control] with their unit: `gain_A = 2.0` is `gain=2.0`.

    Examples
    --------
    >>> import reluctance as rl
    >>> class FullVoltage(rl.Law):
    ...     def step(self, y, tau_ref):
    ...         return [
    ...             rl.Order.hold(rl.Leg.magnetize if y.angle(k) < 2 else rl.Leg.demagnetize)
    ...             for k in range(y.n_phases)
    ...         ]
    >>> drive = rl.load("examples/paper_rated.toml", ["reference.tau_Nm=20"])
    >>> rl.simulate(drive, until=0.001, law=FullVoltage()).kpis.i_peak > 0
    True
    """

    known: Known  # what a controller may know; set before the first sample

    def reset(self, known: Known) -> None:
        """Called before the first sample of a run: forget the last run, compute what is needed."""
        self.known = known

    def step(self, y: _core.Measurement, tau_ref: float) -> Sequence[_core.Order]:
        """One control period.

        Parameters
        ----------
        y : Measurement
            Currents `y.i` (n_phases,) [A], electrical angle `y.angle(k)` of phase k [rad], speed
            `y.omega_m` [rad/s], dc-link voltage `y.u_dc` [V].
        tau_ref : float
            Torque reference [N m].

        Returns
        -------
        list of Order, length n_phases
            What each phase does until the next sample.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method step(self, y, tau_ref)")


class OwnLaw(Control):
    """The [control] table of a law in Python: what every law has, and the law's own numbers."""

    model_config = ConfigDict(extra="allow")
    law: str  # python:FILE:CLASS, the file relative to the drive file

    def check(self, known: Known) -> None:
        self._instance()

    def controller(self, known: Known) -> _core.Controller:
        return controller_of(self._instance(), self, known)

    def _instance(self) -> Law:
        """A new law, with the numbers of the table."""
        kind = law_class(self.law)
        numbers = si(self.model_extra or {})
        wanted = inspect.signature(kind).parameters
        for name in numbers:
            if name not in wanted and not any(p.kind is p.VAR_KEYWORD for p in wanted.values()):
                raise ParameterError(
                    f"[control] {kind.__name__} takes no `{name}`{did_you_mean(name, wanted)}"
                )
        try:
            return kind(**numbers)
        except TypeError as fault:
            raise ParameterError(f"[control] law {kind.__name__}: {fault}") from fault


def controller_of(law: Law, control: Control, known: Known) -> _core.Controller:
    """A law in Python with all that stands around it, ready to be sampled."""
    if not isinstance(law, Law):
        raise ParameterError(f"law = {law!r}, need an object of a subclass of reluctance.Law")
    law.reset(known)

    def step(y: _core.Measurement, tau_ref: float) -> Sequence[_core.Order]:
        try:
            return law.step(y, tau_ref)
        except ParameterError:
            raise
        except Exception as fault:
            raise ParameterError(_told(law, fault)) from fault

    return _core.controller_of(control.setting(known), step)


def law_class(law: str) -> type[Law]:
    """The class that `python:FILE:CLASS` names.

    Raises
    ------
    ParameterError
        If the file or the class is not there, or the file fails.
    """
    file, _, name = law.removeprefix(PREFIX).rpartition(":")
    path = Path(file)
    if not file or not name.isidentifier():
        raise ParameterError(f'[control] law = {law!r}, need "python:FILE.py:CLASS"')
    if not is_file(path):
        raise ParameterError(f"[control] law = {law!r}: no such file {path}")
    spec = importlib.util.spec_from_file_location(f"reluctance_law_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ParameterError(f"[control] law = {law!r}: {path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as fault:
        raise ParameterError(f"{path} failed with {type(fault).__name__}: {fault}") from fault
    found: Any = getattr(module, name, None)
    if not (isinstance(found, type) and issubclass(found, Law)):
        laws = [n for n, v in vars(module).items() if isinstance(v, type) and issubclass(v, Law)]
        raise ParameterError(
            f"{path} has no subclass of reluctance.Law named {name}{did_you_mean(name, laws)}"
        )
    return found


def _told(law: Law, fault: Exception) -> str:
    """Where a law failed, on one line."""
    trace = fault.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    line = f" at {Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
    return f"{type(law).__name__}.step failed with {type(fault).__name__}: {fault}{line}"
