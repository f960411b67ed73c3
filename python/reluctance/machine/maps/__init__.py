"""Flux maps: read, judge, repair, fit and plot flux tables, and make machines of them."""

from reluctance.machine.maps.check import MapReport, check_map
from reluctance.machine.maps.fit import LeHuyFit, TwoTermFit, fit_lehuy, fit_two_term
from reluctance.machine.maps.identify import Identified, identify
from reluctance.machine.maps.importers import read_map, write_map
from reluctance.machine.maps.plot import (
    plot_coenergy,
    plot_inductance,
    plot_magnetisation,
    plot_torque,
)
from reluctance.machine.maps.pulses import Pulse, Recording, read_pulses
from reluctance.machine.maps.repair import Repair, repair_map
from reluctance.machine.maps.surface import Surface, fit_surface, surface
from reluctance.machine.maps.table import FluxTable, fold

__all__ = [
    "FluxTable",
    "Identified",
    "LeHuyFit",
    "MapReport",
    "Pulse",
    "Recording",
    "Repair",
    "Surface",
    "TwoTermFit",
    "check_map",
    "fit_lehuy",
    "fit_surface",
    "fit_two_term",
    "fold",
    "identify",
    "plot_coenergy",
    "plot_inductance",
    "plot_magnetisation",
    "plot_torque",
    "read_map",
    "read_pulses",
    "repair_map",
    "surface",
    "write_map",
]
