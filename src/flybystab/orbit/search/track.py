"""Integration of asteroids, one at a time, with RKN12(10), and the search for encounters within each step.

Each asteroid has its own step size and its own selection of forces. After each step the distances from the
requested planets are checked for minima (:mod:`flybystab.orbit.search.minima`). An impact on any body is reported and
ends the integration of that asteroid.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import DAY
from flybystab.core.numerics.jit import borrowed, code, inlined, kernel
from flybystab.core.numerics.rkn12 import N_STAGES
from flybystab.orbit.almanac import gather
from flybystab.orbit.closest_approach import ACCELERATION, LOG_WIDTH, STATE, TIME
from flybystab.orbit.ephemeris import N_BODIES, SUN, body_state
from flybystab.orbit.nongravitational import NonGravitationalParameters, parameters_of
from flybystab.orbit.search.acceleration import Field, empty_places
from flybystab.orbit.search.force_selection import reduced, shares_along
from flybystab.orbit.search.minima import (
    BENDING,
    FARTHEST,
    FINE,
    chord_distance,
    minima_in_step,
    write_impact,
)
from flybystab.orbit.search.steps import Room, advance, begin, empty_room
from flybystab.typing import Array

#: Status of a search: `out` too small, step size collapsed, start inside a body or its atmosphere, `MAX_STEPS` taken.
FULL, STALLED, INSIDE, EXHAUSTED = 1, 2, 3, 4
#: Largest number of steps from the epoch to the end of the span; a near-Earth asteroid takes about 17 a year.
MAX_STEPS = 1_000_000
# Typed: numba compiles a kernel anew for each literal argument.
_NO_ROWS = code(0)


class Reach(NamedTuple):
    """Limits of encounters and impacts for each body.

    Attributes
    ----------
    limits : ndarray, shape (bodies,)
        Largest distance of an encounter (zero: impacts only), m.
    floors : ndarray, shape (bodies,)
        Distance of an impact, m.
    """

    limits: Array
    floors: Array


@kernel
def _is_inside(y: Array, places: Array, body: int, floor: float) -> bool:
    """True if the distance of ``y[:3]`` from ``places[body]`` is below `floor`, m."""
    total = 0.0
    for j in range(3):
        total += (y[j] - places[body, j]) ** 2
    return total < floor**2


@inlined
def _write_ends(t: float, y: Array, t_new: float, new: Array, k: Array, pair: Array) -> float:
    """Write the ends of a step in order of time into ``pair[2, LOG_WIDTH]``.

    Returns three times the larger acceleration at the ends (m/s2), since it may be larger between them.
    """
    early, late = (0, 1) if t_new >= t else (1, 0)
    pair[early, TIME] = t
    pair[late, TIME] = t_new
    bend0 = 0.0
    bend1 = 0.0
    for j in range(6):
        pair[early, STATE.start + j] = y[j]
        pair[late, STATE.start + j] = new[j]
    for j in range(3):
        pair[early, ACCELERATION + j] = k[0, 3 + j]
        pair[late, ACCELERATION + j] = k[N_STAGES, 3 + j]
        bend0 += k[0, 3 + j] ** 2
        bend1 += k[N_STAGES, 3 + j] ** 2
    return 3.0 * np.sqrt(max(bend0, bend1))


@kernel
def track_encounters(
    field: Field,
    law: NonGravitationalParameters,
    t0: float,
    y0: Array,
    t_quiet: float,
    t_end: float,
    reach: Reach,
    tolerance: float,
    room: Room,
    spare_room: Room,
    out: NDArray[Any],
    n: int,
) -> tuple[int, int, float]:
    """Encounters of one asteroid from ``t0`` to ``t_end``, s; only impacts before ``t_quiet``.

    Parameters
    ----------
    field : Field
        Forces, without the non-gravitational one.
    law : NonGravitationalParameters
        :data:`flybystab.orbit.nongravitational.NONE` for none.
    t0, y0 : float, ndarray
        Start (s) and barycentric state (m, m/s). Time may run backward.
    reach : Reach
    tolerance : float
        Error per step, in units of 1.5e11 m and 30 km/s.
    room, spare_room : Room
        For the integration and for the refinement of minima.
    out : ndarray of FOUND
        Result from row `n` on.

    Returns
    -------
    int
        Number of rows.
    int
        0 or one of `FULL`, `STALLED`, `INSIDE`, `EXHAUSTED`.
    float
        Time reached, s; for `INSIDE` the number of the body.
    """
    field, room, spare = borrowed(field), borrowed(room), borrowed(spare_room)
    k, places = room.k, room.places
    limits, floors = reach
    y = y0.copy()
    new = np.empty(6)
    old, now = np.empty((N_BODIES, 3)), np.empty((N_BODIES, 3))
    away, work = np.empty(6), np.empty(6)
    pair = np.empty((2, LOG_WIDTH))
    sign = 1.0 if t_end >= t0 else -1.0
    h = DAY
    t = t0
    begin(field, law, t, y, room)
    gather(places, now)
    for body in range(N_BODIES):
        if _is_inside(y, now, body, floors[body]):
            return n, INSIDE, float(body)
    count = 0
    while (t_end - t) * sign > 0.0:
        count += 1
        if count > MAX_STEPS:
            return n, EXHAUSTED, t
        stop = t_quiet if (t_quiet - t) * sign > 0.0 else t_end
        t_new, h = advance(field, law, t, y, h, stop, tolerance, room, new)
        if t_new != t_new:
            return n, STALLED, t
        old[:] = now
        gather(places, now)
        counts = (t - t_quiet) * sign >= 0.0
        bend = _write_ends(t, y, t_new, new, k, pair)
        bulge = 0.125 * (t_new - t) ** 2
        from_sun = chord_distance(y, old, new, now, SUN) - bulge * (bend + BENDING[SUN])
        for body in range(N_BODIES):
            limit = limits[body] if counts else 0.0
            largest = max(limit, floors[body])
            if from_sun > FARTHEST[body] + largest:
                continue
            if chord_distance(y, old, new, now, body) > largest + bulge * (bend + BENDING[body]):
                continue
            if n + FINE > out.shape[0]:
                return n, FULL, t
            if _is_inside(new, now, body, floors[body]):
                body_state(field.head, field.data, field.gm, body, t, work)
                for j in range(6):
                    away[j] = y[j] - work[j]
                write_impact(out[n], body, field.gm[body], t, away, sign)
                return n + 1, 0, t_new
            earlier = k[0] if sign > 0.0 else k[N_STAGES]
            n, hit = minima_in_step(
                field, law, pair, earlier, body, limit, floors[body], out, n, spare.k, spare.places
            )
            if hit == hit:
                return n, 0, hit
        t = t_new
        y[:] = new
        k[0] = k[N_STAGES]
    return n, 0, t


@kernel
def search(
    everything: Field,
    laws: Array,
    epochs: Array,
    states: Array,
    t_start: float,
    t_stop: float,
    reach: Reach,
    tolerance: float,
    least: float,
    always: Array,
    shares: Array,
    first: int,
    out: NDArray[Any],
) -> tuple[int, int, int, float]:
    """Encounters of asteroids ``first``, ``first + 1``, ... until all are done or ``out`` is full.

    Forces with an estimated displacement below ``least`` (m) are left out; the estimates are written to ``shares``.
    Other arguments as in :func:`track_encounters`, one row per asteroid; ``laws`` has rows of
    :class:`flybystab.orbit.nongravitational.NonGravitationalParameters`.

    Returns
    -------
    int
        The asteroid with which to continue.
    int
        Number of rows.
    int
        0 if all are done, else the status of :func:`track_encounters` for the asteroid with which to continue.
    float
        Time at which it occurred, s; for `INSIDE` the number of the body.
    """
    n = _NO_ROWS
    room, spare_room, places = empty_room(), empty_room(), empty_places()
    for i in range(first, epochs.size):
        t0 = epochs[i]
        y = states[i]
        law = parameters_of(laws[i])
        if t0 > t_start:
            shares_along(everything, t0, y, t_start, places, shares[i])
        if t0 < t_stop:
            shares_along(everything, t0, y, t_stop, places, shares[i])
        field = reduced(everything, shares[i], least, always)
        m = n
        for leg in range(2):
            if leg == 0 and t0 > t_start:
                quiet, end = min(t0, t_stop), t_start
            elif leg == 1 and t0 < t_stop:
                quiet, end = max(t0, t_start), t_stop
            else:
                continue
            m, status, t = track_encounters(
                field, law, t0, y, quiet, end, reach, tolerance, room, spare_room, out, m
            )
            if status != 0:
                return i, n, status, t
        for row in range(n, m):
            out[row].asteroid = i
        n = m
    return epochs.size, n, 0, 0.0
