"""Question: how much does hourly weather overstate the water, and do generated minutes mend it?

    python studies/sun_averaging.py [--csv FILE]

The clear day of `examples/sun_day.toml` with clouds of three kinds, 24 seeds each. The truth is the
water from its minutes; against it stand the water from its hourly means, and from minutes that
`[weather] generate_minutes` would generate from those means, with other seeds. The last row is the
year of `examples/sun_year.toml`, whose minutes nobody knows: its truth is the generated ones.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from reluctance.pumping import load_system, pump
from reluctance.pumping.site import Sun
from reluctance.pumping.weather import COLUMNS, Weather
from reluctance.pumping.weather_file import read_weather, with_minutes
from reluctance.pumping.write import write_text_whole

ROOT = Path(__file__).parents[1]
SEEDS = range(1, 25)
OTHER = 100  # added to a seed for the minutes that are generated
CLOUDS = {  # minutes clear, minutes covered, light left
    "short": (8.0, 6.0, 0.3),
    "long": (20.0, 15.0, 0.3),
    "dense": (4.0, 8.0, 0.2),
}
HEADING = (
    "clouds,clear_min,cloud_min,cover,hourly_pct,hourly_std_pct,generated_pct,generated_std_pct"
)


def hourly(minutes: Weather) -> Weather:
    """Means over whole hours."""
    sun = Sun(minutes.sun.zenith_deg[30::60], minutes.sun.azimuth_deg[30::60])
    means = {name: getattr(minutes, name).reshape(-1, 60).mean(axis=1) for name in COLUMNS}
    return replace(minutes, t=minutes.t[30::60], step=3600.0, sun=sun, **means)


def errors(clear_min: float, cloud_min: float, cover: float) -> np.ndarray:
    """Of hourly means and of generated minutes, for each seed [%]."""
    day = load_system(ROOT / "examples" / "sun_day.toml")
    found = []
    for seed in SEEDS:
        clouds = {"seed": seed, "clear_min": clear_min, "cloud_min": cloud_min, "cover": cover}
        system = day.with_values({"weather.clouds": clouds})
        minutes = read_weather(system.weather, system.site, system.folder)
        hours = hourly(minutes)
        generated = with_minutes(hours, system.weather, system.site, seed=OTHER + seed)
        water = [pump(system, weather=w).water for w in (minutes, hours, generated)]
        found.append([100 * (w / water[0] - 1) for w in water[1:]])
    return np.array(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--csv", type=Path, default=ROOT / "docs/pumping/averaging.csv")
    options = parser.parse_args()
    lines = [HEADING]
    for name, clouds in CLOUDS.items():
        found = errors(*clouds)
        numbers = np.stack([found.mean(axis=0), found.std(axis=0)], axis=1).ravel()
        lines.append(",".join([name, *map(str, clouds), *(f"{x:.2f}" for x in numbers)]))
    year = load_system(ROOT / "examples" / "sun_year.toml")
    pumped = pump(year.with_values({"weather.generate_minutes": True}))
    assert pumped.water_from_means is not None  # minutes were generated
    over = 100 * (pumped.water_from_means / pumped.water - 1)
    lines.append(f"year,,,,{over:.2f},,0,")
    options.csv.parent.mkdir(parents=True, exist_ok=True)
    write_text_whole(options.csv, "\n".join(lines) + "\n")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
