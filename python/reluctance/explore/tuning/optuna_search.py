"""The search by Optuna's sampler, with its store: for many values, choices, or long budgets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from reluctance.base.errors import ParameterError
from reluctance.explore.tuning.trials import Trials

SEED = 0
AT_ONCE = 4  # trials between two looks at their results


def search(trials: Trials, store: str | Path | None = None) -> None:
    """Spends the budget of the trials on the tree-structured Parzen estimator.

    Parameters
    ----------
    store : of the study; another call goes on with what it has learnt.

    Raises
    ------
    ParameterError
        If optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise ParameterError(
            "the search by Optuna needs it; `pip install 'reluctance[tune]'`, or leave it out"
        ) from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    storage: Any = None
    if store is not None:
        storage = optuna.storages.RDBStorage(f"sqlite:///{Path(store).absolute()}")
    study: Any = optuna.create_study(
        study_name=f"{trials.drive.name}: {trials.goal}",
        storage=storage,
        load_if_exists=True,
        sampler=optuna.samplers.TPESampler(seed=SEED, multivariate=False),
    )
    try:
        _ask(study, trials)
    finally:
        if storage is not None:
            storage.remove_session()
            storage.engine.dispose()


def _ask(study: Any, trials: Trials) -> None:
    """Asks for points and tells what they are worth, until the runs are spent."""
    import optuna

    while trials.left > 0:
        asked = [study.ask() for _ in range(min(AT_ONCE, trials.left))]
        places = [_values(trials, one) for one in asked]
        before = trials.left
        for one, found in zip(asked, trials.run(places), strict=False):
            if found.why or found.worth != found.worth:
                study.tell(one, state=optuna.trial.TrialState.FAIL)
            else:
                miss, worth = found.rank
                study.tell(one, worth + miss * (abs(worth) + 1.0) * 10)
        if trials.left == before:  # nothing but what was known: the ranges hold no more
            return


def _values(trials: Trials, one: Any) -> dict[str, Any]:
    unit, choices = [], {}
    for name, values in trials.vary.items():
        if name in trials.ranges:
            unit.append(one.suggest_float(name, 0.0, 1.0))
        else:
            choices[name] = values[one.suggest_categorical(name, list(range(len(values))))]
    return trials.at(unit, choices)
