"""Diameter from absolute magnitude and geometric albedo: ``D = 1329 km/sqrt(p_V) 10^(-H/5)`` (Pravec & Harris 2007)."""

from __future__ import annotations

import numpy as np

from flybystab.typing import Array

#: Diameter of a body of ``H = 0`` and albedo 1, m.
ZERO = 1.329e6


def diameter_of(magnitude: float | Array, albedo: float | Array) -> Array:
    """Diameters (m) from absolute magnitudes and geometric albedos, which are broadcast."""
    return np.asarray(ZERO / np.sqrt(albedo) * 10.0 ** (-magnitude / 5.0))


def magnitude_of(diameter: float | Array, albedo: float | Array) -> Array:
    """Absolute magnitudes from diameters (m) and geometric albedos, which are broadcast."""
    return np.asarray(5.0 * np.log10(ZERO / (diameter * np.sqrt(albedo))))
