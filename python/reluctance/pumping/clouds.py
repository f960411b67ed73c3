"""Clouds from a seed: a telegraph of clear and covered sky, and minutes within an hour's mean."""

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from reluctance.base.arrays import FloatArray
from reluctance.base.schema import Section
from reluctance.pumping.weather import Weather

CYCLE_MIN = 14.0  # a clear and a covered spell within an hour, together
HAZE = 1.2  # direct light of an hour may exceed the clear-sky model's by this


class Clouds(Section):
    """[weather.clouds]: over a clear sky, the light falls to `cover` while a cloud passes."""

    seed: int = Field(1, ge=0)
    clear_min: float = Field(8.0, gt=0)  # mean length of a clear spell
    cloud_min: float = Field(6.0, gt=0)  # and of a covered one
    cover: float = Field(0.3, ge=0, lt=1)  # part of the global light that a cloud leaves


def covered(clear: Weather, clouds: Clouds) -> Weather:
    """A clear sky with clouds: global light times k; direct light fades, diffuse is the rest."""
    minutes = clear.step / 60
    n = len(clear.t)
    is_clear = _telegraph(
        np.full(n, minutes / clouds.clear_min), np.full(n, minutes / clouds.cloud_min), clouds.seed
    )
    k = np.where(is_clear, 1.0, clouds.cover)
    k = np.convolve(k, [0.5, 0.5], "same")  # the edge of a cloud
    fade = (k - clouds.cover) / (1 - clouds.cover)
    fade = np.maximum(fade, 0.0)  # the first sample has half a neighbour
    height = (clear.ghi - clear.dhi) / np.maximum(clear.dni, 1e-6)
    ghi, dni = clear.ghi * k, clear.dni * fade
    return replace(clear, ghi=ghi, dni=dni, dhi=ghi - dni * np.maximum(height, 0.0))


def minutes_within(hours: Weather, clear: Weather, seed: int) -> Weather:
    """Minutes whose means over each interval are the given global light.

    Direct light is on or off: on for the part of the hour that its mean is of a clear sky's, in
    spells from a seed. While it is on the diffuse light is a clear sky's; clouds have the rest.
    What direct light would exceed a clear sky's goes to the diffuse.

    Parameters
    ----------
    hours : Weather
        Means to keep.
    clear : Weather
        A clear sky by the minute over the same time.
    """
    count, height = len(clear.t) // len(hours.t), clear.sun.height

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(values.reshape(-1, count).mean(axis=1))

    def spread(values: NDArray[Any]) -> NDArray[Any]:
        return np.repeat(values, count)

    beam_clear = clear.dni * height
    beam = np.maximum(hours.ghi - hours.dhi, 0.0)
    part = np.clip(beam / np.maximum(mean(beam_clear), 1e-6), 0.02, 0.98)
    spell = clear.step / 60 / CYCLE_MIN
    on = _telegraph(spread(spell / part), spread(spell / (1 - part)), seed).astype(float)
    never = spread(mean(on * beam_clear) == 0)
    on = np.where(never | spread(part >= 0.98), 1.0, on)
    scale = beam / np.maximum(mean(on * beam_clear), 1e-6)
    dni = clear.dni * on * spread(np.minimum(scale, HAZE))
    rest = np.maximum(np.maximum(hours.ghi, 0.0) - mean(dni * height), 0.0)
    dhi = _diffuse(rest, on, clear, count)
    return replace(
        clear,
        ghi=dhi + dni * height,
        dni=dni,
        dhi=dhi,
        temp_air=_between(hours.temp_air, count),
        wind_speed=_between(hours.wind_speed, count),
        where=f"{hours.where}, minutes generated",
        doubts=hours.doubts,
    )


def _diffuse(mean: FloatArray, on: FloatArray, clear: Weather, count: int) -> FloatArray:
    """Diffuse light of each minute, with these means over the hours."""

    def part(values: FloatArray) -> FloatArray:
        return np.asarray(values.reshape(-1, count).mean(axis=1))

    under_sun, under_cloud = part(on * clear.dhi), part((1 - on) * clear.ghi)
    left = (mean - under_sun) / np.maximum(under_cloud, 1e-9)
    shape = np.where(np.repeat(part(clear.dhi) > 1, count), clear.dhi, 1.0)
    even = np.repeat(mean / part(shape), count) * shape
    parted = on * clear.dhi + (1 - on) * clear.ghi * np.repeat(left, count)
    return np.where(np.repeat((left > 0) & (left < 1), count), parted, even)


def minutes_of(t: pd.DatetimeIndex, step: float) -> pd.DatetimeIndex:
    """Middles of the minutes in intervals with these middles."""
    count = round(step / 60)
    first = t[0] - pd.Timedelta(seconds=step / 2 - 30)
    return pd.date_range(first, periods=len(t) * count, freq="1min")


def _telegraph(p_leave_clear: FloatArray, p_leave_cloud: FloatArray, seed: int) -> FloatArray:
    """True where the sky is clear; a Markov chain that starts clear."""
    draws = np.random.default_rng(seed).random(len(p_leave_clear))
    leave_clear, leave_cloud = (draws < p_leave_clear).tolist(), (draws < p_leave_cloud).tolist()
    state, states = True, []
    for from_clear, from_cloud in zip(leave_clear, leave_cloud, strict=True):
        state = state != (from_clear if state else from_cloud)
        states.append(state)
    return np.array(states)


def _between(values: FloatArray, count: int) -> FloatArray:
    """Minutes on straight lines between the middles of the hours."""
    n = len(values)
    return np.interp((np.arange(n * count) + 0.5) / count - 0.5, np.arange(n), values)
