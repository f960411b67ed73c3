"""What the tuned constants of the laws decide: each is made 20 % smaller and 25 % greater.

The exported controller of a drive is compiled with the changed constant and drives the paper's
machine. `python tests/support/tuned_constants.py` writes docs/control/tuned_constants.csv, a row a
constant, law and point, and tuned_constants_worst.csv beside it, a row a constant; it takes some
ten CPU minutes.
"""

import csv
import re
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from false_alarms import closed, run_with
from firmware_tools import ROOT
from numpy.typing import NDArray

import reluctance as rl
from reluctance.targets.export import firmware

TABLE = ROOT / "docs" / "control" / "tuned_constants.csv"
WORST = TABLE.with_name("tuned_constants_worst.csv")
PLACES = ("control/law", "control/part", "control/frame/stroke_fit.hpp")
LINE = re.compile(r"static constexpr T (\w+ = T\([^;]*);")
ONE = re.compile(r"(\w+) = T\((-?[\d.e+-]+)\)")
LIMITS = {"beyond_limit", "unbounded"}  # greater than any cost: no value is tuned
FACTORS = (0.8, 1.25)
GUIDE = "control.guide_speed_rpm=[1500, 3000]"
# A drive for each law, and the keys of its points: rated, twice the speed, steps of the reference.
DRIVES = {
    "edge_mpc": ("edge_mpc_mcu", [GUIDE]),
    "edge_mpc, learning": ("edge_mpc_learning", []),
    "finite_set_mpc": ("finite_set_mpc", [GUIDE]),
    "deadbeat": ("deadbeat", []),
    "ditc": ("ditc", []),
    "torque_sharing": ("sharing_cubic", []),
    "paper_mpc": ("paper_rated", [GUIDE]),
}
AT, TORQUES = (0.0503, 0.0603, 0.0703), (10.0, 41.339, -20.0, 20.0)  # of the steps [s], [N m]
POINTS: dict[str, dict[str, Any]] = {
    "1500 rpm, 41.339 N m": {},
    "3000 rpm, 20.669 N m": {
        "load.speed_rpm": 3000,
        "reference.tau_Nm": 20.669,
    },
    "1500 rpm, steps": {
        "reference.tau_Nm": None,
        "reference.t_s": [0.0, *np.repeat(AT, 2).tolist()],
        "reference.values": [*np.repeat(TORQUES[:-1], 2).tolist(), TORQUES[-1]],
    },
}


def reference(keys: dict[str, Any], t: NDArray[np.float64]) -> NDArray[np.float64]:
    if "reference.t_s" in keys:
        return np.asarray(TORQUES)[np.searchsorted(AT, t, side="right")]
    return np.full(len(t), keys.get("reference.tau_Nm", 41.339))


@dataclass(frozen=True)
class Constant:
    header: str  # below include/srm
    name: str
    value: str

    @property
    def text(self) -> str:
        return f"{self.name} = T({self.value})"


def constants() -> list[Constant]:
    """Every number that a law, its parts or the fit of a stroke has by itself."""
    found = []
    for place in PLACES:
        path = ROOT / "include" / "srm" / place
        for header in sorted(path.glob("*.hpp")) if path.is_dir() else [path]:
            inner = header.relative_to(ROOT / "include" / "srm").as_posix()
            for line in LINE.findall(header.read_text()):
                numbers = [one for one in ONE.findall(line) if one[0] not in LIMITS]
                found += [Constant(inner, name, value) for name, value in numbers]
    return found


def changed(package: Path, constant: Constant, factor: float) -> None:
    """The package with another value of a constant."""
    header = package / "include" / "srm" / constant.header
    text = header.read_text()
    assert text.count(constant.text) == 1, constant
    header.write_text(text.replace(constant.text, f"{constant.text} * T({factor})"))


def figures(law: str, constant: Constant | None, factor: float) -> dict[str, tuple[float, float]]:
    """Rms error and mean error of the torque at the law's points, of the greatest reference [%]."""
    drive, found = drive_of(law), {}
    with tempfile.TemporaryDirectory() as folder:
        change = partial(changed, constant=constant, factor=factor) if constant else unchanged
        library = closed(drive, Path(folder), change, ("-DLAW_ALONE",))
        for point, keys in POINTS.items():
            if "learning" in law and keys:
                continue
            run = run_with(library, drive.with_values(keys))
            seen = run.t > (0.05 if "steps" in point else run.t[-1] / 2)
            asked = reference(keys, run.t[seen])
            error = 100 * (run.tau[seen] - asked) / asked.max()
            found[point] = float(np.sqrt(np.mean(error**2))), float(np.mean(error))
    return found


def unchanged(package: Path) -> None:
    pass


def of_law(constant: Constant, law: str, headers: set[str]) -> bool:
    learns = law.endswith("learning")
    return constant.header in headers and learns == constant.header.endswith("stroke_fit.hpp")


def headers_of(law: str) -> set[str]:
    """Of the law's package, below include/srm."""
    with tempfile.TemporaryDirectory() as folder:
        package = firmware(drive_of(law), Path(folder) / "package").folder
        place = package / "include" / "srm"
        return {path.relative_to(place).as_posix() for path in place.rglob("*.hpp")}


def drive_of(law: str) -> rl.Drive:
    example, keys = DRIVES[law]
    return rl.load(ROOT / "examples" / f"{example}.toml", [*keys, "protection.speed_max_rpm=4500"])


def rows() -> Iterator[dict[str, object]]:
    asked: list[tuple[str, Constant | None, float]] = [(law, None, 1.0) for law in DRIVES]
    for law in DRIVES:
        known = headers_of(law)
        asked += [
            (law, constant, factor)
            for constant in constants()
            if of_law(constant, law, known)
            for factor in FACTORS
        ]
    with ProcessPoolExecutor() as pool:
        found = dict(zip(asked, pool.map(figures, *zip(*asked, strict=True)), strict=True))
    for law, constant, factor in asked:
        if constant is None or factor != FACTORS[0]:
            continue
        for point, nominal in found[law, None, 1.0].items():
            less, more = (found[law, constant, f][point] for f in FACTORS)
            yield {
                "header": constant.header,
                "constant": constant.name,
                "value": constant.value,
                "law": law,
                "point": point,
                **{
                    f"{name}_pct": f"{value:.4f}"
                    for which, pair in (("", nominal), ("less_", less), ("more_", more))
                    for name, value in zip((f"{which}rms", f"{which}mean"), pair, strict=True)
                },
            }


def worst(table: list[dict[str, Any]]) -> Iterator[dict[str, object]]:
    """The greatest change of each constant, over laws, points and both directions."""
    for constant in constants():
        own = [
            row
            for row in table
            if (row["header"], row["constant"]) == (constant.header, constant.name)
        ]
        ratios, means = [], []
        for row in own:
            for way in ("less", "more"):
                ratios.append(float(row[f"{way}_rms_pct"]) / float(row["rms_pct"]) - 1)
                means.append(float(row[f"{way}_mean_pct"]) - float(row["mean_pct"]))
        yield {
            "constant": f"{Path(constant.header).stem}: {constant.name}",
            "value": constant.value,
            "least_change_of_rms_pct": f"{100 * min(ratios):.1f}",
            "greatest_change_of_rms_pct": f"{100 * max(ratios):.1f}",
            "greatest_change_of_mean_pct": f"{max(map(abs, means)):.2f}",
        }


def write(path: Path, table: list[dict[str, Any]]) -> None:
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, table[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)


def main() -> None:
    table = list(rows())
    write(TABLE, table)
    write(WORST, list(worst(table)))


if __name__ == "__main__":
    main()
