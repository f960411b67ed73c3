"""Tune a drive: values for which a key figure is best while others keep their bounds."""

from reluctance.explore.tuning.angles import TunedAngles, tune_angles
from reluctance.explore.tuning.trials import Trial
from reluctance.explore.tuning.tune import Tuned, tune

__all__ = ["Trial", "Tuned", "TunedAngles", "tune", "tune_angles"]
