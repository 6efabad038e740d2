"""Arguments that several constructors of encounters share, checked and converted to SI."""

from __future__ import annotations

from collections.abc import Sequence

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.errors import InvalidInput
from flybystab.typing import Array
from flybystab.units import to_si


def checked_start(distance: Quantity | None) -> float | None:
    """Distance at which the encounter starts (m); None where it follows from the path.

    Raises
    ------
    UnitMismatch, InvalidInput
    """
    return None if distance is None else to_si(distance, u.m, "start_distance", low=0.0)


def unit_vector(pole: Sequence[float]) -> Array:
    """Unit vector along the pole of a planet, shape (3,).

    Raises
    ------
    InvalidInput
        `pole` is not three finite numbers, or all are zero.
    """
    try:
        axis = np.asarray(pole, dtype=float)
        norm = float(np.linalg.norm(axis))
    except (TypeError, ValueError):
        norm = 0.0
    if not (np.isfinite(norm) and norm > 0.0 and axis.shape == (3,)):
        raise InvalidInput("pole", pole, "a direction: three finite numbers, not all zero")
    return axis / norm
