"""Steps of RKN12(10) (:mod:`flybystab.core.numerics.rkn12`) in the field of the planets, and their control."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.constants import DAY
from flybystab.core.numerics.jit import borrowed, inlined, kernel
from flybystab.core.numerics.rkn12 import ERROR_ORDER, N_STAGES, NODE, stage_state, step_error
from flybystab.orbit.almanac import N_SLOW, SLOT, Places
from flybystab.orbit.ephemeris import SUN
from flybystab.orbit.nongravitational import NonGravitationalParameters
from flybystab.orbit.search.acceleration import (
    Field,
    empty_places,
    find_all_places,
    rate,
    rate_among,
)
from flybystab.typing import Array

#: Units of position (m) and velocity (m/s) of the tolerance.
_LENGTH, _SPEED = 1.5e11, 3.0e4
#: Longest step, and the step below which the step size counts as collapsed, s.
LONGEST, SHORTEST = 100.0 * DAY, 1e-5
#: Of the step size that would meet the tolerance, this fraction is used; limits of its change.
_SAFETY, _LEAST, _MOST = 0.86, 0.1, 5.0
_SUN = int(SLOT[SUN])
_POWER = -1.0 / ERROR_ORDER
#: In place of an estimated error of zero, over the tolerance.
_TINY = 1e-30


class Room(NamedTuple):
    """Buffers of an integration.

    Attributes
    ----------
    k : ndarray, shape (18, 6)
        Velocity (m/s) and acceleration (m/s2) at the stages of a step, and at its end.
    last : ndarray, shape (1,)
        Mean of the step lengths that meet the tolerance, over ``r^(3/2)``, s/m^(3/2); 0 before the first step.
    places : Places
        Positions of the bodies.
    """

    k: Array
    last: Array
    places: Places


@kernel
def empty_room() -> Room:
    """Buffers for one integration."""
    return Room(np.empty((N_STAGES + 1, 6)), np.zeros(1), empty_places())


@kernel
def begin(field: Field, law: NonGravitationalParameters, t: float, y: Array, room: Room) -> None:
    """Start an integration at the state ``y[6]``: rates ``room.k[0]`` and places there, and no mean step length.

    A kernel of its own: `rate` is compiled once instead of in each integration.
    """
    room.last[0] = 0.0
    rate(field, law, t, y, room.places, room.k[0])


@kernel
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

    Writes the new state, the rates ``k[18, 6]`` (the last is that of the new state) and the places at its end;
    returns the estimated error in units of 1.5e11 m and 30 km/s.
    """
    field, places = borrowed(field), borrowed(places)
    y, k, new = borrowed(y), borrowed(k), borrowed(new)
    for s in range(1, N_STAGES + 1):
        stage_state(s, y, h, k, new)
        if NODE[s] != NODE[s - 1]:  # the last three stages are at the end
            find_all_places(field, t + NODE[s] * h, places)
        rate_among(field, law, t + NODE[s] * h, new, places, k[s])
    return step_error(h, k, _LENGTH, _SPEED)


@inlined
def _middles(y: Array, new: Array, room: Room, length: float, ahead: float) -> tuple[float, float]:
    """Distances from the Sun to the power 3/2 in the middle of the last step and of the next, of `ahead` s."""
    k, sun = room.k, room.places.slow
    here = 0.0
    there = 0.0
    for j in range(3):
        x = sun[j * N_SLOW + _SUN]
        bend = k[0, 3 + j] + k[N_STAGES, 3 + j]
        here += (0.5 * (y[j] + new[j]) - 0.0625 * length * length * bend - x) ** 2
        there += (new[j] + 0.5 * ahead * new[3 + j] + 0.125 * ahead * ahead * k[N_STAGES, 3 + j] - x) ** 2
    return here**0.75, there**0.75


@inlined
def advance(
    field: Field,
    law: NonGravitationalParameters,
    t: float,
    y: Array,
    h: float,
    stop: float,
    tolerance: float,
    room: Room,
    new: Array,
) -> tuple[float, float]:
    """One step of at most ``|h|`` s toward ``stop``, shortened until its error is below ``tolerance``.

    The error of a step determines the length at which it would meet the tolerance. In units of ``r^(3/2)``, with the
    distance from the Sun in the middle of a step, this length changes little along an eccentric orbit. The next step
    has this length in the same units, or the geometric mean of it and its earlier means, whichever is smaller: the
    estimated error sometimes nearly vanishes. With r predicted for the middle of the next step, few steps are rejected
    on the way to perihelion.

    Writes as :func:`step`.

    Returns
    -------
    float
        Time reached, s; exactly ``stop`` in the last step; nan where the step size collapsed.
    float
        Length of the next step, positive, s: `h` itself if ``stop`` shortened the step.
    """
    h = abs(h)
    sign = 1.0 if stop > t else -1.0
    while h > SHORTEST:
        to_stop = abs(stop - t) <= h
        length = stop - t if to_stop else sign * h
        error = step(field, law, t, y, length, room.k, new, room.places) / tolerance
        if not error <= 1.0:
            h = abs(length) * (max(_SAFETY * error**_POWER, _LEAST) if error < np.inf else _LEAST)
            continue
        scale = _SAFETY * max(error, _TINY) ** _POWER
        if not to_stop or scale < 1.0:
            ahead = sign * min(abs(length) * min(max(scale, _LEAST), _MOST), LONGEST)
            here, there = _middles(y, new, room, length, ahead)
            now = scale * abs(length) / here
            mean = np.sqrt(now * room.last[0]) if room.last[0] > 0.0 else now
            room.last[0] = mean
            h = min(max(min(now, mean) * there, _LEAST * abs(length)), _MOST * abs(length))
        return stop if to_stop else t + length, min(h, LONGEST)
    return np.nan, h
