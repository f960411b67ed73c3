"""Are the numbers of a flux table in the units that its columns name?"""

import numpy as np

from reluctance.machine.maps.table import Array, FluxTable

TORQUE_RMS = 0.05  # error of torque that still belongs to the co-energy: see check.py
TURNS = 0.02  # how near the ratio of torque and co-energy comes to a whole number
# Ends of a map that a machine may have: what lies outside is a slip of units. The library has 5
# to 450 A, 0.16 to 2.3 Wb, 1 to 160 mH; 3 V at 500 Hz make 3 mWb, 10 kV at 100 Hz make 50 Wb.
CURRENTS = (1e-3, 1e4)  # [A]
FLUXES = (1e-4, 50.0)  # [Wb]
INDUCTANCES = (1e-6, 10.0)  # largest flux linkage over largest current [H]
USUAL_L, USUAL_I = 0.013, 47.0  # geometric middles of the library [H], [A]
USUAL_PSI = USUAL_L * USUAL_I  # [Wb]
FAR = 30.0  # a suspect whose machine is so much farther from USUAL_L than another's is not named


def unit_error(table: FluxTable, tau_W: Array) -> str | None:
    """Flux linkage and torque that belong together but for a whole factor: a power of ten is a unit
    error, any other a number of turns or paths."""
    if table.tau is None:
        return None
    factor = float(np.sum(table.tau * tau_W) / np.sum(tau_W**2))
    left = float(np.sqrt(np.mean((table.tau - factor * tau_W) ** 2) / np.mean(table.tau**2)))
    if factor <= 0 or left > TORQUE_RMS:
        return None
    ratio = max(factor, 1 / factor)
    ten = 10 ** round(np.log10(ratio))
    if ten > 1 and abs(ratio / ten - 1) < TURNS:
        size = "large" if factor > 1 else "small"
        return (
            f"torque is {ten:g} times too {size} for current and flux linkage: a unit error; "
            f"{suspects(table, ten, too_large=factor > 1)}"
        )
    whole = round(ratio)
    if whole < 2 or abs(ratio / whole - 1) > TURNS:
        return None
    if factor < 1:
        return (
            f"flux linkage times current is {whole} times what the torque belongs to; if the flux "
            f"linkage is of {whole} times the turns, pass --turns_factor {1 / whole:.6g}"
        )
    return (
        f"flux linkage times current is 1/{whole} of what the torque belongs to; if the flux "
        f"linkage is of one of {whole} coils in series, pass --turns_factor {whole}; if the "
        f"current is of one of {whole} parallel paths, multiply the column of currents"
    )


def suspects(table: FluxTable, ten: float, *, too_large: bool) -> str:
    """Each of the three columns alone may have the wrong unit: those that would leave a machine as
    there are, the likeliest first. The energy is the same with each, so the map cannot tell."""
    assert table.tau is not None
    largest = float(table.i[-1]), float(table.psi.max()), float(np.abs(table.tau).max())
    up = ten if too_large else 1 / ten
    found = []
    for name, unit, scales in (
        ("currents", "A", (up, 1.0, 1.0)),
        ("flux linkage", "Wb", (1.0, up, 1.0)),
        ("torque", "N m", (1.0, 1.0, 1 / up)),
    ):
        i, psi, tau = (value * scale for value, scale in zip(largest, scales, strict=True))
        if implausible(i, psi) is None:
            scale = max(scales) if max(scales) > 1 else min(scales)
            how = f"{scale:g} times" if scale > 1 else f"1/{1 / scale:g} of"
            text = f"the {name} are" if name == "currents" else f"the {name} is"
            milli = f", as in m{unit.replace(' ', '')}" if scale == 1e-3 else ""
            text += f" {how} what the column says{milli} (then {i:.3g} A, {psi:.3g} Wb, "
            found.append((abs(np.log(psi / i / USUAL_L)), f"{text}{tau:.3g} N m)"))
    if not found:
        return "check the units of all three columns: none alone leaves a plausible machine"
    near = [text for away, text in sorted(found) if away < min(found)[0] + np.log(FAR)]
    return f"correct the unit in the column's name: {'; or '.join(near)}"


def unit_question(table: FluxTable, tau_max: float) -> str | None:
    """A question where currents 1000 times smaller, or larger, would leave a more usual machine:
    nearer to the middle of the library in current and inductance, on logarithmic scales. The flux
    linkage alone fits both, as those of machines with few and with many turns."""
    i, psi = float(table.i[-1]), float(np.abs(table.psi).max())
    for unit, factor in (("mA", 1e-3), ("kA", 1e3)):
        if implausible(factor * i, psi) is None and _unusual(factor * i, psi) < _unusual(i, psi):
            remedy = f"name the column i_{unit}, or multiply it"
            if table.tau is not None:
                remedy = f"name the columns i_{unit} and tau_{unit[0]}Nm, or multiply them"
            return (
                f"a machine of {_size(i, psi, tau_max)}; are the currents in {unit}? Then it has "
                f"{_size(factor * i, psi, factor * tau_max)}: {remedy} by {factor:g}"
            )
    return None if table.tau is not None else question_of_flux(i, psi, tau_max)


def question_of_flux(i: float, psi: float, tau_max: float) -> str | None:
    """As `unit_question`, of flux linkages without a torque that would confirm them. Small and
    large machines differ by a factor of some hundred, so the other one has to be far more usual."""
    for unit, factor in (("Wb", 1e3), ("mWb", 1e-3)):
        other = factor * psi
        nearer = _unusual_flux(i, psi) - _unusual_flux(i, other)
        if implausible(i, other) is None and nearer > np.log(FAR):
            return (
                f"a machine of {_size(i, psi, tau_max)}; are the flux linkages in {unit}? Then it "
                f"has {_size(i, other, factor * tau_max)}: multiply the column psi by {factor:g}, "
                "or correct the unit in its name"
            )
    return None


def _unusual_flux(i: float, psi: float) -> float:
    """How far a machine's flux linkage and inductance are from the middle of the library."""
    return float(np.hypot(np.log(psi / USUAL_PSI), np.log(psi / i / USUAL_L)))


def _unusual(i: float, psi: float) -> float:
    """How far a machine's largest current and inductance are from the middle of the library."""
    return float(np.hypot(np.log(i / USUAL_I), np.log(psi / i / USUAL_L)))


def _size(i: float, psi: float, tau: float) -> str:
    return f"{i:.4g} A, {tau:.3g} N m and {psi / i:.2g} H"


def implausible(i: float, psi: float) -> str | None:
    """Why no machine has this current [A] and flux linkage [Wb] at the end of its map; None where
    one may have."""
    for what, value, unit, (least, most) in (
        ("largest current", i, "A", CURRENTS),
        ("largest flux linkage", psi, "Wb", FLUXES),
        ("largest flux linkage over largest current", psi / i, "H", INDUCTANCES),
    ):
        if not least <= value <= most:
            return f"{what} {value:.3g} {unit}, need {least:g} to {most:g} as in any machine"
    return None
