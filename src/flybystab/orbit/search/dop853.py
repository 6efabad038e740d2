"""Steps of DOP853 in a field (Dormand & Prince; Hairer, Norsett & Wanner 1993; coefficients of SciPy)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import DOP853

from flybystab.constants import DAY
from flybystab.core.numerics.jit import borrowed, kernel, pasted_kernel, summing_kernel
from flybystab.orbit.almanac import Places
from flybystab.orbit.search.acceleration import Field, empty_places, rate
from flybystab.typing import Array

# Rows of the tableau without their zeros (a third of it): stage s combines entries _FROM[s] to _FROM[s + 1].
_ROWS = [*(DOP853.A[s, :s] for s in range(12)), DOP853.B]
_STAGE = np.concatenate([np.flatnonzero(row) for row in _ROWS])
_WEIGHT = np.concatenate([row[row != 0.0] for row in _ROWS])
_FROM = np.concatenate([[0], np.cumsum([np.count_nonzero(row) for row in _ROWS])])
_C = np.concatenate([DOP853.C[:12], [1.0]])
_E3 = np.ascontiguousarray(DOP853.E3)
_E5 = np.ascontiguousarray(DOP853.E5)
#: Units of position (m) and velocity (m/s) in which the tolerance counts.
_LENGTH, _SPEED = 1.5e11, 3.0e4
#: Longest step, and the one below which it has collapsed, s.
LONGEST, SHORTEST = 30.0 * DAY, 1e-3


class Room(NamedTuple):
    """Where a step is worked out: rates ``k[13, 6]`` of its stages and places of the bodies."""

    k: Array
    places: Places


@kernel
def empty_room() -> Room:
    """Room for one integration."""
    return Room(np.empty((13, 6)), empty_places())


@kernel
def borrowed_room(room: Room) -> Room:
    """The same room without reference counts, for use inside a kernel that has it as an argument."""
    p = room.places
    return Room(
        borrowed(room.k), Places(borrowed(p.fast), borrowed(p.slow), borrowed(p.belt), borrowed(p.heavy))
    )


@summing_kernel
def step(
    field: Field, law: Array, t: float, y: Array, h: float, k: Array, new: Array, places: Places
) -> float:
    """One step from ``y[6]`` at ``t`` over ``h`` s with the rate there in ``k[0]``.

    Writes the new state, the rates ``k[13, 6]`` (the last is that of the new state) and the places at its end;
    returns the estimated error in units of 1.5e11 m and 30 km/s.
    """
    for s in range(1, 13):
        w0 = w1 = w2 = w3 = w4 = w5 = 0.0
        for m in range(_FROM[s], _FROM[s + 1]):
            a = _WEIGHT[m]
            i = _STAGE[m]
            w0 += a * k[i, 0]
            w1 += a * k[i, 1]
            w2 += a * k[i, 2]
            w3 += a * k[i, 3]
            w4 += a * k[i, 4]
            w5 += a * k[i, 5]
        new[0] = y[0] + h * w0
        new[1] = y[1] + h * w1
        new[2] = y[2] + h * w2
        new[3] = y[3] + h * w3
        new[4] = y[4] + h * w4
        new[5] = y[5] + h * w5
        rate(field, law, t + _C[s] * h, new, places, k[s])
    five = 0.0
    three = 0.0
    for j in range(6):
        e5 = 0.0
        e3 = 0.0
        for i in range(13):
            e5 += _E5[i] * k[i, j]
            e3 += _E3[i] * k[i, j]
        unit = _LENGTH if j < 3 else _SPEED
        five += (e5 / unit) ** 2
        three += (e3 / unit) ** 2
    if five == 0.0 and three == 0.0:
        return 0.0
    return abs(h) * five / np.sqrt((five + 0.01 * three) * 6.0)


@pasted_kernel
def advance(
    field: Field,
    law: Array,
    t: float,
    y: Array,
    h: float,
    stop: float,
    tolerance: float,
    k: Array,
    new: Array,
    places: Places,
) -> tuple[float, float]:
    """One step of at most ``|h|`` s toward ``stop``, shortened until its error is below ``tolerance``.

    Writes as :func:`step`.

    Returns
    -------
    float
        Time reached, s; exactly ``stop`` in the last step; nan where the step size collapsed.
    float
        Length of the next step, positive, s: from this one's error, or as it was where ``stop`` cut it short.
    """
    h = abs(h)
    sign = 1.0 if stop > t else -1.0
    while h > SHORTEST:
        last = abs(stop - t) <= h
        length = stop - t if last else sign * h
        error = step(field, law, t, y, length, k, new, places) / tolerance
        scale = 0.9 * error**-0.125 if error > 0.0 else 5.0
        if error <= 1.0:
            if not last or scale < 1.0:
                h = abs(length) * min(max(scale, 0.2), 5.0)
            return stop if last else t + length, min(h, LONGEST)
        h = abs(length) * (max(scale, 0.1) if error < 1e30 else 0.1)
    return np.nan, h
