"""Tune a drive: values for which a key figure is best while others keep their bounds."""

from reluctance.tuning.angles import TunedAngles, tune_angles
from reluctance.tuning.trials import Trial
from reluctance.tuning.tune import Tuned, tune

__all__ = ["Trial", "Tuned", "TunedAngles", "tune", "tune_angles"]
