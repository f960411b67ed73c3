"""Copper at 20 degC, IEC 60028."""

COPPER_RESISTIVITY = 1.7241e-8  # [ohm m]
COPPER_COEFFICIENT = 0.00393  # of the resistance, per kelvin [1/K]
