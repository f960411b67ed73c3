"""Flux maps: read, judge, repair, fit and plot flux tables, and make machines of them."""

from reluctance.maps.check import MapReport, check_map
from reluctance.maps.fit import LeHuyFit, TwoTermFit, fit_lehuy, fit_two_term
from reluctance.maps.identify import Identified, identify
from reluctance.maps.importers import read_map, write_map
from reluctance.maps.plot import (
    plot_coenergy,
    plot_inductance,
    plot_magnetisation,
    plot_torque,
)
from reluctance.maps.pulses import Pulse, Recording, read_pulses
from reluctance.maps.repair import Repair, repair_map
from reluctance.maps.surface import Surface, fit_surface, surface
from reluctance.maps.table import FluxTable, fold

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
