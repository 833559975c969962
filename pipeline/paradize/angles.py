"""Angles without libm, whose last bits differ between machines."""

from __future__ import annotations

PI = 3.141592653589793


def sine_cosine(degrees: float) -> tuple[float, float]:
    """Returns (sin, cos) of an angle in degrees, within 2e-16. Taylor series on +-45 degrees; no libm."""
    quarter = round(degrees / 90.0)
    x = (degrees - 90.0 * quarter) * (PI / 180.0)
    square = x * x
    sine = cosine = 0.0
    for k in range(17, 0, -2):
        sine = 1.0 - square / ((k + 1) * (k + 2)) * sine
        cosine = 1.0 - square / (k * (k + 1)) * cosine
    sine *= x
    return ((sine, cosine), (cosine, -sine), (-sine, -cosine), (-cosine, sine))[quarter % 4]
