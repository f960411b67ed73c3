"""What a weather file contradicts itself in, or the sun: each doubt with its number.

Kinds of checks as in pvanalytics: closure of the components and physical limits of QCRad (Long and
Shi 2008), the offset of the time stamps, and days that were filled with zeros. Tests of the offset
are sharp, since both sides of noon weigh: measured on two TMY3 files, it is found within 2 min.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reluctance.base.arrays import FloatArray
from reluctance.pumping.site import Site, Sun, extra_radiation
from reluctance.pumping.weather import Weather

MOST_SAMPLES = 4_000  # every n-th of more
LIT = 50.0  # less is not compared [W/m^2], as in QCRad
HIGH = np.cos(np.radians(75.0))  # heights of QCRad's closure: within 8 % above, 15 % below
OFFSETS_MIN = np.arange(-150.0, 151.0, 15.0)  # UTC for a summer time is off by two hours
OFF_MIN = (
    12.0  # an offset of this much is told: a fifth of an hour moves 1 % of a fixed array's day
)
BEYOND = 0.05  # of the samples may miss the closure, and
CLOSED = 0.03  # of the mean light may be left open at the offset of a file that is consistent
FEWEST_CLEAR = 3  # days, to tell an offset from a cloud of each afternoon
IMPOSSIBLE = 0.002  # of them the physical limits, before it is told
DARK_DAY = 0.02  # of the light above the atmosphere: a day of rain has 0.05
FEW_DAYS, DIM = 5, 0.35  # days, and the part of the light above that the best of them has


def doubts(weather: Weather, site: Site, *, components: bool) -> tuple[str, ...]:
    """What to tell of the samples of a file. `components`: dni and dhi are the file's own."""
    n = -(-len(weather.t) // MOST_SAMPLES)
    sun = Sun(weather.sun.zenith_deg[::n], weather.sun.azimuth_deg[::n])
    ghi, dni, dhi = (x[::n] for x in (weather.ghi, weather.dni, weather.dhi))
    off = _offset_by_closure(sun, ghi, dni, dhi, site) if components else 0.0
    by = "the closure of ghi, dni and dhi"
    if abs(off) < OFF_MIN and abs(clear := _offset_of_clear_days(weather, site)) >= OFF_MIN:
        off, by = clear, "east and west of its clear days"
    return (
        *_of_the_offset(off, by),
        *(_of_the_closure(sun, ghi, dni, dhi, site, off) if components else ()),
        *_of_the_limits(weather, ("ghi", "dni", "dhi") if components else ("ghi",)),
        *_of_dark_days(weather, site),
        *_of_dim_light(weather, site),
    )


def _of_the_offset(off: float, by: str) -> Iterator[str]:
    if abs(off) >= OFF_MIN:
        yield (
            f"the light is {off:+.0f} min off the sun, by {by}: check what the time stamps name "
            "(for a CSV file [weather] stamp) and [site] timezone"
        )


def _of_the_closure(
    sun: Sun,
    ghi: FloatArray,
    dni: FloatArray,
    dhi: FloatArray,
    site: Site,
    off: float,
) -> Iterator[str]:
    height = sun.height_before(off, site.latitude_deg)
    total = dni * height + dhi
    lit = (total > LIT) & (ghi > LIT) & (height > 0)
    if not lit.any():
        return
    allowed = np.where(height > HIGH, 0.08, 0.15)
    wrong = float((np.abs(ghi / np.maximum(total, LIT) - 1) > allowed)[lit].mean())
    if wrong > BEYOND:
        over = ghi[lit].sum() / total[lit].sum() - 1
        yield (
            f"ghi contradicts dni cos(zenith) + dhi in {wrong:.0%} of the sunlit samples (over the "
            f"file ghi is {over:+.1%}): check which columns they are"
        )


def _of_the_limits(weather: Weather, given: tuple[str, ...]) -> Iterator[str]:
    """QCRad's physically possible limits, of the columns that the file gives."""
    E, height = extra_radiation(weather.t), weather.sun.height
    limits = {
        "ghi": (weather.ghi, 1.5 * E * height**1.2 + 100),
        "dni": (weather.dni, E),
        "dhi": (weather.dhi, 0.95 * E * height**0.2 + 50),
    }
    for name in given:
        values, most = limits[name]
        beyond = values > most
        if beyond.sum() > IMPOSSIBLE * max((height > 0).sum(), 1):
            worst = int(np.argmax(values - most))
            yield (
                f"{name} is above what is physically possible in {beyond.sum()} samples: "
                f"{values[worst]:.0f} W/m2 at {weather.stamps[worst]}, where at most "
                f"{most[worst]:.0f} can be; check the columns, the unit and the time stamps"
            )


def _of_dark_days(weather: Weather, site: Site) -> Iterator[str]:
    day, sums = _by_day(weather, site)
    if weather.step > 3600:
        return
    above = sums(extra_radiation(weather.t) * weather.sun.height) * weather.step / 3600
    dark = (sums(weather.ghi) * weather.step / 3600 < DARK_DAY * above) & (above > 500)
    if dark.any():
        first = weather.stamps[int(np.argmax(dark[day]))]
        yield (
            f"{dark.sum()} of {len(dark)} days are dark, less than {DARK_DAY:.0%} of the light "
            f"above the atmosphere (first {first:%Y-%m-%d}): were gaps filled with zeros?"
        )


def _of_dim_light(weather: Weather, site: Site) -> Iterator[str]:
    """Where no day of some comes near a clear one, as where the light is in a smaller unit."""
    _, sums = _by_day(weather, site)
    above = sums(extra_radiation(weather.t) * weather.sun.height)
    whole = above * weather.step / 3600 > 500
    if whole.sum() < FEW_DAYS:
        return
    best = float((sums(weather.ghi)[whole] / above[whole]).max())
    if best < DIM:
        yield (
            f"on the brightest of {whole.sum()} days {best:.0%} of the light above the atmosphere "
            "reach the ground, on a clear day half to three quarters do: if it was not overcast "
            "throughout, check the unit of ghi (1 J/cm2 in an hour is 2.778 W/m2)"
        )


def _offset_by_closure(
    sun: Sun, ghi: FloatArray, dni: FloatArray, dhi: FloatArray, site: Site
) -> float:
    """The offset of the stamps at which ghi = dni cos(zenith) + dhi holds best [min]."""
    misses = np.full(len(OFFSETS_MIN), np.nan)
    low = np.cos(np.radians(85.0))  # below it the mean of an hour is not that of its middle
    for k, off in enumerate(OFFSETS_MIN):
        height = sun.height_before(off, site.latitude_deg)
        used = (ghi > LIT) & (height > low)
        if used.any() and dni[used].any():
            misses[k] = np.mean((ghi - dni * height - dhi)[used] ** 2)
    bright = np.mean(ghi[ghi > LIT]) if (ghi > LIT).any() else np.inf
    if not misses.min() < (CLOSED * bright) ** 2:  # true of NaN, too: other columns contradict
        return 0.0
    k = int(np.clip(np.argmin(misses), 1, len(misses) - 2))
    a, b, c = misses[k - 1 : k + 2]
    return float(OFFSETS_MIN[k] + 15 * 0.5 * (a - c) / max(a - 2 * b + c, 1e-12))


def _offset_of_clear_days(weather: Weather, site: Site) -> float:
    """How much later the middle of the light of clear days is than that of the sun [min]."""
    day, sums = _by_day(weather, site)
    clock = (weather.t.tz_convert("UTC") - pd.Timestamp(0, tz="UTC")).total_seconds() / 3600
    clock = np.asarray((clock + site.longitude_deg / 15) % 24)
    # Haurwitz's clear sky, of the zenith angle alone: the same east and west
    height = weather.sun.height
    clear = 1098 * height * np.exp(-0.057 / np.maximum(height, 1e-3))
    ghi = np.maximum(weather.ghi, 0.0)
    G, C = np.maximum(sums(ghi), 1e-9), np.maximum(sums(clear), 1e-9)
    off = sums(ghi * clock) / G - sums(clear * clock) / C
    # The same shape of the day, moved to its own middle: the offset must not hide a clear day
    wide = np.sqrt(np.maximum(sums(ghi * clock**2) / G - (sums(ghi * clock) / G) ** 2, 0))
    width = np.sqrt(np.maximum(sums(clear * clock**2) / C - (sums(clear * clock) / C) ** 2, 1e-9))
    is_clear = (np.abs(G / C - 1) < 0.15) & (np.abs(wide / width - 1) < 0.03)
    whole = np.bincount(day) * weather.step >= 23 * 3600
    chosen = off[is_clear & whole]
    return float(60 * np.median(chosen)) if len(chosen) >= FEWEST_CLEAR else 0.0


def _by_day(
    weather: Weather, site: Site
) -> tuple[NDArray[np.int64], Callable[[FloatArray], FloatArray]]:
    """Number of the solar day of each sample, and a sum over each of them."""
    utc = (weather.t.tz_convert("UTC") - pd.Timestamp(0, tz="UTC")).total_seconds()
    whole = np.floor(np.asarray(utc) / 86400 + site.longitude_deg / 360).astype(np.int64)
    day = whole - whole.min()
    return day, lambda values: np.asarray(np.bincount(day, values))
