"""Steps of DOP853 (:mod:`flybystab.core.numerics.dop853`) in the field of the planets."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.constants import DAY
from flybystab.core.numerics.dop853 import N_STAGES, NODE, error_norm, error_sums, stage_state_6
from flybystab.core.numerics.jit import borrowed, kernel, pasted_kernel, summing_kernel
from flybystab.orbit.almanac import Places
from flybystab.orbit.nongravitational import NonGravitationalParameters
from flybystab.orbit.search.acceleration import Field, empty_places, rate
from flybystab.typing import Array

#: Units of position (m) and velocity (m/s) of the tolerance.
_UNITS = np.array([1.5e11, 1.5e11, 1.5e11, 3.0e4, 3.0e4, 3.0e4])
#: Longest step, and the step below which the step size counts as collapsed, s.
LONGEST, SHORTEST = 30.0 * DAY, 1e-3


class Room(NamedTuple):
    """Buffers of a step: rates ``k[13, 6]`` of its stages and positions of the bodies."""

    k: Array
    places: Places


@kernel
def empty_room() -> Room:
    """Buffers for one integration."""
    return Room(np.empty((N_STAGES + 1, 6)), empty_places())


@kernel
def borrowed_room(room: Room) -> Room:
    """The same buffers without reference counts, for use inside a kernel that has it as an argument."""
    p = room.places
    return Room(
        borrowed(room.k), Places(borrowed(p.fast), borrowed(p.slow), borrowed(p.belt), borrowed(p.heavy))
    )


@summing_kernel
def step(
    field: Field,
    law: NonGravitationalParameters,
    t: float,
    y: Array,
    h: float,
    k: Array,
    new: Array,
    places: Places,
) -> float:
    """One step from ``y[6]`` at ``t`` over ``h`` s with the rate there in ``k[0]``.

    Writes the new state, the rates ``k[13, 6]`` (the last is that of the new state) and the places at its end;
    returns the estimated error in units of 1.5e11 m and 30 km/s.
    """
    for s in range(1, N_STAGES + 1):
        stage_state_6(s, y, h, k, new)
        rate(field, law, t + NODE[s] * h, new, places, k[s])
    five, three = error_sums(6, k, _UNITS)
    return error_norm(five, three, 6, h)


@pasted_kernel
def advance(
    field: Field,
    law: NonGravitationalParameters,
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
        Length of the next step, positive, s: from the error of this one, or `h` itself if ``stop`` shortened the step.
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
