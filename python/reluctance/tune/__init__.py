"""Tune a drive: values for which a key figure is best while others keep their bounds."""

from reluctance.tune.angles import TunedAngles, tune_angles
from reluctance.tune.trials import Trial
from reluctance.tune.tune import Tuned, tune
from reluctance.tune.write import write_drive

__all__ = ["Trial", "Tuned", "TunedAngles", "tune", "tune_angles", "write_drive"]
