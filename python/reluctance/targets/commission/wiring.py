"""What the emulated board's software corrects of its wiring: the file emulated/wiring.h of a
package, and how the findings of commissioning change it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from reluctance.base.errors import ParameterError
from reluctance.base.files import write_whole

HEADER = Path("emulated") / "wiring.h"
INTEGER = r"-?[0-9]+"
ROW = rf"\{{{INTEGER}(?:, *{INTEGER})*\}}"
REAL = r"-?[0-9][0-9.e+-]*F?"


@dataclass(frozen=True)
class Wiring:
    """Corrections of readings and orders. Of phase 0, 1, 2, ...:

    Attributes
    ----------
    leg : tuple of int
        Its leg.
    channel, sign : tuple of int
        The channel that shows its current, and the sign there.
    direction : int
        Of the encoder.
    zero : float
        Electrical angle = direction * counted angle - zero [rad].
    """

    leg: tuple[int, ...]
    channel: tuple[int, ...]
    sign: tuple[int, ...]
    direction: int = 1
    zero: float = 0.0

    @property
    def straight(self) -> bool:
        """It corrects nothing."""
        places = tuple(range(len(self.leg)))
        signs = {self.direction, *self.sign}
        return self.leg == self.channel == places and signs == {1} and self.zero == 0

    def lines(self) -> list[str]:
        """As wiring.h defines it."""
        rows = {"LEG": self.leg, "CHANNEL": self.channel, "SIGN": self.sign}
        return [
            *(
                f"#define WIRING_{name} {{{', '.join(map(str, row))}}}"
                for name, row in rows.items()
            ),
            f"#define WIRING_DIRECTION {self.direction}",
            f"#define WIRING_ZERO_RAD {np.float32(self.zero)!s}F",
        ]

    def with_sensors(self, sensor: Sequence[int], sign: Sequence[int]) -> Wiring:
        """After `wiring`: every phase reads the sensor of its leg."""
        return replace(
            self,
            channel=tuple(self.channel[k] for k in sensor),
            sign=tuple(self.sign[k] * s for k, s in zip(sensor, sign, strict=True)),
        )

    def with_angle(self, direction: int, zero_deg: float, place: Sequence[int]) -> Wiring:
        """After `alignment`: the direction and the zero; or, where the phases were not in order,
        their order, after which the alignment has to be found again."""
        if direction == 0:
            order = [list(place).index(k) for k in range(len(place))]
            leg, channel, sign = (
                tuple(row[k] for k in order) for row in (self.leg, self.channel, self.sign)
            )
            return replace(self, leg=leg, channel=channel, sign=sign)
        zero = direction * (self.zero + float(np.radians(zero_deg)))
        return replace(self, direction=direction * self.direction, zero=zero % (2 * np.pi))


def read_wiring(package: Path) -> Wiring:
    """The wiring of a package.

    Raises
    ------
    ParameterError
        If a line of it is not as the export wrote it.
    """
    text = (package / HEADER).read_text("utf-8")

    def value(name: str, form: str, example: str) -> str:
        found = re.search(rf"^#define WIRING_{name} (.+?) *$", text, re.MULTILINE)
        if found is None or not re.fullmatch(form, found[1]):
            was = "no such line" if found is None else f"`{found[1]}`"
            raise ParameterError(
                f"{package / HEADER}: WIRING_{name} is {was}, need a line as "
                f"`#define WIRING_{name} {example}`"
            )
        return found[1]

    leg, channel, sign = (
        tuple(map(int, re.findall(INTEGER, value(name, ROW, "{0, 1, 2}"))))
        for name in ("LEG", "CHANNEL", "SIGN")
    )
    direction = int(value("DIRECTION", INTEGER, "1"))
    zero = float(value("ZERO_RAD", REAL, "0.0F").rstrip("F"))
    places = list(range(len(leg)))
    if not (sorted(leg) == sorted(channel) == places and len(sign) == len(leg)):
        rows = f"legs {leg}, channels {channel}, signs {sign}"
        raise ParameterError(f"{package / HEADER}: {rows}, need each phase once")
    if not {direction, *sign} <= {1, -1}:
        raise ParameterError(
            f"{package / HEADER}: direction {direction}, signs {sign}: need 1 or -1"
        )
    return Wiring(leg, channel, sign, direction, zero)


def write_wiring(package: Path, wiring: Wiring) -> None:
    """Puts a wiring into a package."""
    path = package / HEADER
    text = path.read_text("utf-8")
    for line in wiring.lines():
        name = line.split()[1]
        text = re.sub(rf"^#define {name} .+$", line, text, flags=re.MULTILINE)
    write_whole(path, lambda to: to.write_text(text, "utf-8"))
