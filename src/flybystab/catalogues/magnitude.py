"""Diameter, absolute magnitude and geometric albedo: ``D = 1329 km/sqrt(p_V) 10^(-H/5)`` (Pravec & Harris 2007)."""

from __future__ import annotations

from typing import Any

import numpy as np

#: Diameter of a body of ``H = 0`` and albedo 1, m.
ZERO = 1.329e6


def diameter_of(magnitude: Any, albedo: Any) -> Any:
    """Diameter, m, of an absolute magnitude and a geometric albedo; numbers or arrays."""
    return ZERO / np.sqrt(albedo) * 10.0 ** (-magnitude / 5.0)


def magnitude_of(diameter: Any, albedo: Any) -> Any:
    """Absolute magnitude of a diameter (m) and a geometric albedo; numbers or arrays."""
    return 5.0 * np.log10(ZERO / (diameter * np.sqrt(albedo)))
