"""Control laws of one's own, in Python: `law = "python:my_law.py:MyLaw"`, or given to `simulate`.

Such a law stands where the laws of the core stand: behind sensors, tracker, speed loop, sampled
comparators and dead-time compensation.
"""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import ConfigDict

from reluctance import _core
from reluctance.base.errors import ParameterError
from reluctance.base.schema import did_you_mean
from reluctance.base.units import si_once
from reluctance.drive.laws.own_code import (
    CodeName,
    check_numbers,
    meant,
    module_of,
    of_the_user,
    own_code,
)
from reluctance.drive.tables.control import Control
from reluctance.drive.tables.known import Known


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
            Currents `y.i` (n_phases,) [A], where a reading below zero is zero; electrical angle
            `y.angle(k)` of phase k [rad], speed `y.omega_m` [rad/s], dc-link voltage `y.u_dc` [V].
        tau_ref : float
            Torque reference [N m].

        Returns
        -------
        list of Order, length n_phases
            What each phase does until the next sample.
        """
        raise NotImplementedError(f"{type(self).__name__} needs a method step(self, y, tau_ref)")


class OwnLaw(Control):
    """The [control] table of a law in Python: what every law has, and the law's own numbers. It is
    computed in double, whatever `precision` says."""

    model_config = ConfigDict(extra="allow")
    law: CodeName  # python:FILE:CLASS, the file relative to the drive file

    @property
    def uses_comparators(self) -> bool:
        return True  # what it orders is known when it runs

    def check(self, known: Known) -> None:
        self._instance()

    def core(self, known: Known) -> _core.Law:
        return core_of(self._instance(), known)

    def _instance(self) -> Law:
        """A new law, with the numbers of the table."""
        kind = law_class(self.law)
        check_numbers(self.model_extra or {}, texts=True)
        numbers = si_once({"T_s_us": self.T_s_us} | (self.model_extra or {}))
        del numbers["T_s"]
        wanted = inspect.signature(kind).parameters
        for key, name in zip(self.model_extra or {}, numbers, strict=True):
            if name in wanted or any(p.kind is p.VAR_KEYWORD for p in wanted.values()):
                continue
            hint = meant(key, name, wanted, "argument of its __init__")
            raise ParameterError(f"[control] {kind.__name__} takes no `{name}`{hint}")
        try:
            return kind(**numbers)
        except (Exception, SystemExit) as fault:
            raise ParameterError(f"[control] {kind.__name__}(...): {of_the_user(fault)}") from fault


def core_of(law: Law, known: Known) -> _core.Law:
    """A law in Python, as the core calls it.

    Raises
    ------
    ParameterError
        If it is no Law or its `reset` fails; later, on one line, if its `step` does.
    """
    if not isinstance(law, Law):
        raise ParameterError(f"law = {law!r}, need an object of a subclass of reluctance.Law")
    name = type(law).__name__
    try:
        law.reset(known)
    except (Exception, SystemExit) as fault:
        raise ParameterError(f"{name}.reset failed with {of_the_user(fault)}") from fault

    def step(y: _core.Measurement, tau_ref: float) -> Sequence[_core.Order]:
        try:
            return law.step(y, tau_ref)
        except (Exception, SystemExit) as fault:
            raise ParameterError(f"{name}.step failed with {of_the_user(fault)}") from fault

    step.__name__ = f"{name}.step{_place(law.step)}"  # as the core tells what it returned
    return _core.python_law(known.n_phases, step)


def _place(function: object) -> str:
    """Where a function begins, for a line of text; empty where that is not known."""
    code = getattr(function, "__code__", None)
    return f" at {Path(code.co_filename).name}:{code.co_firstlineno}" if code else ""


def law_class(law: str) -> type[Law]:
    """The class that `python:FILE:CLASS` names.

    Raises
    ------
    ParameterError
        If the file or the class is not there, or the file fails.
    """
    code = own_code(law)
    module = module_of(code)
    found: Any = getattr(module, code.name, None)
    if not (isinstance(found, type) and issubclass(found, Law)):
        known = [n for n, v in vars(module).items() if isinstance(v, type) and Law in v.__bases__]
        near = did_you_mean(code.name, known) if known else ""
        raise ParameterError(f"{code.file} has no subclass of reluctance.Law `{code.name}`{near}")
    return found
