"""The figure of a dump: currents, leg states, dc link and speed over time, the trigger marked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from reluctance.base.figures import save_figure
from reluctance.base.phases import LETTERS, phase_name
from reluctance.base.picture import Picture
from reluctance.base.units import from_si
from reluctance.targets.export.replay_dump import Replayed


def dump_figure(replayed: Replayed, name: str) -> Figure:
    """Draws all samples of a dump; time 0 is the trigger, or else the last sample."""
    dump = replayed.dump
    rows = np.concatenate([s.records for s in dump.segments])
    number = np.concatenate([s.first + np.arange(len(s.records)) for s in dump.segments])
    zero = number[-1] if dump.trigger is None else dump.trigger
    t = (number.astype(float) - zero) * dump.T_s * 1e3
    figure = Picture(11, 9)
    currents, legs, link, speed = figure.subplots(4, 1, sharex=True)
    for k in range(dump.n_phases):
        label = phase_name(k)
        currents.plot(t, rows["i"][:, k], lw=0.9, label=label)
        ordered = rows["order"]["leg"][:, k, 0] + 3 * (dump.n_phases - 1 - k) + 1
        legs.step(t, ordered, where="post", lw=0.8, label=label)
    currents.set_ylabel("current (A)")
    currents.legend(loc="lower left", bbox_to_anchor=(0, 1), fontsize=8, ncols=dump.n_phases)
    names = ("off", "freewheel", "on")
    heights = [3 * (dump.n_phases - 1 - k) + s for k in range(dump.n_phases) for s in range(3)]
    legs.set_yticks(
        heights,
        [f"{LETTERS[k]} {state}" for k in range(dump.n_phases) for state in names],
        fontsize=7,
    )
    legs.set_ylabel("first leg state ordered")
    link.plot(t, rows["u_dc"], lw=0.9)
    link.set_ylabel("dc link (V)")
    speed.plot(t, from_si(rows["omega_m"].astype(float), "rpm"), lw=0.9)
    speed.set(ylabel="measured speed (rpm)", xlabel="time from the trigger (ms)")
    if dump.trigger is not None:
        for ax in (currents, legs, link, speed):
            ax.axvline(0.0, color="tab:red", lw=1.0, ls="--")
        currents.annotate(
            replayed.cause, (0.0, 1.0), xycoords=("data", "axes fraction"), color="tab:red",
            fontsize=8, ha="right", va="bottom",
        )  # fmt: skip
    figure.suptitle(name)
    return figure


def save_dump_plot(replayed: Replayed, name: str, path: Path) -> None:
    """Writes the figure; the ending chooses png, svg, pdf or html."""
    save_figure(dump_figure(replayed, name), path, title=name)
