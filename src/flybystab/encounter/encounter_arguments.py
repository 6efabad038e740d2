"""Arguments that several constructors of encounters share, checked and converted to SI."""

from __future__ import annotations

from collections.abc import Sequence

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.encounter.reach import usual_start
from flybystab.errors import InvalidInput
from flybystab.orbit.planets import Planet
from flybystab.typing import Array
from flybystab.units import to_si


def checked_start(distance: Quantity | None) -> float | None:
    """Distance at which the encounter starts (m); None where it follows from the path.

    Raises
    ------
    UnitMismatch, InvalidInput
    """
    return None if distance is None else to_si(distance, u.m, "start_distance", low=0.0)


def start_beyond(start: float | None, body: Planet, q: float) -> float:
    """Distance at which an encounter with closest distance `q` starts (m): the given one, or the usual one for None.

    Raises
    ------
    InvalidInput
        The given distance does not exceed `q`.
    """
    if start is None:
        return usual_start(body, q)
    if start <= q:
        raise InvalidInput("start_distance", start * u.m, f"more than the closest approach, {q:.6g} m")
    return start


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
