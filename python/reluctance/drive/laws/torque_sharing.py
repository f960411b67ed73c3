"""The [control] table of torque sharing with hysteresis current control."""

from __future__ import annotations

from typing import ClassVar, Literal

from pydantic import Field

from reluctance import _core
from reluctance.drive.laws.shared_torque import SharedTorque, sharing_angles
from reluctance.drive.tables.known import Known
from reluctance.drive.tables.variants import CURRENT_BAND, Look, Place, Variant


def _variant(shape: str, what: str, when: str, *, place: Place | None = sharing_angles) -> Variant:
    return Variant(
        name=f"sharing_{shape}",
        keys=(("sharing", shape),),
        free=CURRENT_BAND,
        place=place,
        what=what,
        when=when,
        needs="one current comparator per phase",
    )


class TorqueSharing(SharedTorque):
    """Each phase's share of the torque as a current reference, held in a band."""

    look: ClassVar[Look] = Look("sharing", "#56B4E9", "--")
    title: ClassVar[str] = "torque sharing"
    variants: ClassVar[tuple[Variant, ...]] = (
        _variant(
            "linear",
            "Torque passed from phase to phase along a straight line, as current in a band.",
            "A first sharing function; its corners ask for steps of current.",
        ),
        _variant(
            "cubic",
            "Torque passed along a cubic, as current in a band.",
            "The usual choice: small ripple below base speed from a table of currents.",
        ),
        _variant(
            "sinusoidal",
            "Torque passed along a cosine, as current in a band.",
            "As cubic; hardly different.",
        ),
        _variant(
            "exponential",
            "Torque passed along an exponential, as current in a band.",
            "Where the outgoing phase must be demagnetised quickly.",
        ),
        _variant(
            "optimal",
            "Torque passed as in the reference profile without ripple, as current in a band.",
            "Where the drive works near one point, for which the profile is made.",
            place=None,
        ),
    )
    law: Literal["torque_sharing"] = "torque_sharing"
    i_band_A: float | None = Field(None, gt=0)  # half width; by default 2 % of i_max_A
    chop: Literal["soft", "hard"] = "soft"  # above the band, motoring: freewheel or demagnetize

    @property
    def current_band(self) -> float | None:
        return self.i_band_A

    @property
    def uses_comparators(self) -> bool:
        return True

    def used(self, known: Known) -> dict[str, float]:
        return super().used(known) | {"i_band_A": self.band(known)}

    def core(self, known: Known) -> _core.Law:
        i_max = known.i_max
        make = self.maker(known, _core.torque_sharing, _core.coupled_torque_sharing)
        return make(
            sharing=self.shares(known),
            **self.hand_over(known, "i"),
            R=known.R,
            i_max=i_max,
            i_band=self.band(known),
            T_s=self.T_s,
            delay=known.delay,
            chop=_core.Leg.freewheel if self.chop == "soft" else _core.Leg.demagnetize,
        )
