"""Copper, IEC 60028: its resistivity at 20 degC and how that grows with temperature."""

COPPER_RESISTIVITY = 1.7241e-8  # at 20 degC [ohm m]
COPPER_COEFFICIENT = 0.00393  # growth per kelvin, in parts of the resistivity at 20 degC [1/K]


def resistance_ratio(temp_degC: float, known_at_degC: float = 20.0) -> float:
    """A winding's resistance at one temperature over that at another."""
    return _over_20(temp_degC) / _over_20(known_at_degC)


def _over_20(temp_degC: float) -> float:
    """Resistivity over that at 20 degC; zero at -234.5 degC."""
    return 1 + COPPER_COEFFICIENT * (temp_degC - 20.0)
