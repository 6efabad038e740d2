"""Integration of one asteroid after the other with DOP853, and the search for encounters within each step.

Each asteroid has its own step size and those forces that are relevant to it. After each step the distances from the
requested planets are checked for minima (:mod:`flybystab.orbit.search.minima`). An impact on any body is reported and
ends the integration of that asteroid.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import DAY
from flybystab.core.numerics.jit import code, kernel
from flybystab.orbit.almanac import gather
from flybystab.orbit.ephemeris import N_BODIES, body_state
from flybystab.orbit.search.acceleration import Field, borrowed_field, empty_places, first_rate
from flybystab.orbit.search.dop853 import Room, advance, borrowed_room, empty_room
from flybystab.orbit.search.force_selection import reduced, shares_along
from flybystab.orbit.search.minima import BENDING, FINE, chord_distance, crash, look
from flybystab.typing import Array

#: Status of a search: `out` too small, step size collapsed, start inside a body or its atmosphere, too many steps.
FULL, STALLED, INSIDE, EXHAUSTED = 1, 2, 3, 4
#: Most steps from the epoch to the end of the span; an asteroid of the inner main belt takes about 60 a year.
MAX_STEPS = 1_000_000
# Typed: numba compiles a kernel anew for each literal argument.
_NO_ROWS = code(0)


@kernel
def track_encounters(
    field: Field,
    law: Array,
    t0: float,
    y0: Array,
    t_quiet: float,
    t_end: float,
    limits: Array,
    floors: Array,
    tolerance: float,
    room: Room,
    spare_room: Room,
    out: Array,
    n: int,
) -> tuple[int, int, float]:
    """Encounters of one asteroid from ``t0`` to ``t_end``, s; only impacts before ``t_quiet``.

    Parameters
    ----------
    field : Field
        Forces, without the non-gravitational one.
    law : ndarray, shape (10,)
        :attr:`flybystab.orbit.forces.NonGravitational.row`; zeros for none.
    t0, y0 : float, ndarray
        Start (s) and barycentric state (m, m/s). Time may run backward.
    limits, floors : ndarray, shape (bodies,)
        Of each body: largest distance of an encounter (zero: only impacts count), distance of impact, m.
    tolerance : float
        Error per step, in units of 1.5e11 m and 30 km/s.
    room, spare_room : Room
        For the integration and for the refinement of minima.
    out : ndarray, shape (rows, 12)
        Result from row `n` on; see ``WIDTH``.

    Returns
    -------
    int
        Number of rows.
    int
        0 done; 1 `out` was too small; 2 the step size collapsed; 3 the start is inside a body; 4 `MAX_STEPS`.
    float
        Time reached, s; for 3 the number of the body.
    """
    field = borrowed_field(field)
    k, places = borrowed_room(room)
    spare, spare_places = borrowed_room(spare_room)
    y = y0.copy()
    new = np.empty(6)
    old, now = np.empty((N_BODIES, 3)), np.empty((N_BODIES, 3))
    work = np.empty(6)
    pair = np.empty((2, 10))
    sign = 1.0 if t_end >= t0 else -1.0
    h = DAY
    t = t0
    first_rate(field, law, t, y, places, k[0])
    gather(places, now)
    for body in range(N_BODIES):
        if (y[0] - now[body, 0]) ** 2 + (y[1] - now[body, 1]) ** 2 + (y[2] - now[body, 2]) ** 2 < floors[
            body
        ] ** 2:
            return n, INSIDE, float(body)
    count = 0
    while (t_end - t) * sign > 0.0:
        count += 1
        if count > MAX_STEPS:
            return n, EXHAUSTED, t
        stop = t_quiet if (t_quiet - t) * sign > 0.0 else t_end
        t_new, h = advance(field, law, t, y, h, stop, tolerance, k, new, places)
        if t_new != t_new:
            return n, STALLED, t
        old[:] = now
        gather(places, now)
        counts = (t - t_quiet) * sign >= 0.0
        early, late = (0, 1) if sign > 0.0 else (1, 0)
        pair[early, 0] = t
        pair[late, 0] = t_new
        bend0 = 0.0
        bend1 = 0.0
        for j in range(6):
            pair[early, 1 + j] = y[j]
            pair[late, 1 + j] = new[j]
        for j in range(3):
            pair[early, 7 + j] = k[0, 3 + j]
            pair[late, 7 + j] = k[12, 3 + j]
            bend0 += k[0, 3 + j] ** 2
            bend1 += k[12, 3 + j] ** 2
        bend = 3.0 * np.sqrt(max(bend0, bend1))
        bulge = 0.125 * (t_new - t) ** 2
        for body in range(N_BODIES):
            limit = limits[body] if counts else 0.0
            reach = max(limit, floors[body])
            if chord_distance(y, old[body], new, now[body]) > reach + bulge * (bend + BENDING[body]):
                continue
            if n + FINE > out.shape[0]:
                return n, FULL, t
            d1 = 0.0
            for j in range(3):
                d1 += (new[j] - now[body, j]) ** 2
            if d1 < floors[body] ** 2:
                body_state(field.head, field.data, field.gm, body, t, work)
                for j in range(6):
                    out[n, 2 + j] = y[j] - work[j]
                crash(out[n], body, field.gm[body], t, sign)
                return n + 1, 0, t_new
            n, hit = look(
                field,
                law,
                pair,
                k[0] if sign > 0.0 else k[12],
                body,
                limit,
                floors[body],
                out,
                n,
                spare,
                spare_places,
            )
            if hit == hit:
                return n, 0, hit
        t = t_new
        y[:] = new
        k[0] = k[12]
    return n, 0, t


@kernel
def search(
    everything: Field,
    laws: Array,
    epochs: Array,
    states: Array,
    t_start: float,
    t_stop: float,
    limits: Array,
    floors: Array,
    tolerances: Array,
    least: float,
    always: Array,
    shares: Array,
    first: int,
    out: Array,
) -> tuple[int, int, int, float]:
    """Encounters of asteroids ``first``, ``first + 1``, ... until all are done or ``out`` is full.

    Forces with an estimated displacement below ``least`` (m) are left out; the estimates are written to ``shares``.
    Other arguments as in :func:`track_encounters`, one row per asteroid.

    Returns
    -------
    int
        The asteroid to go on with.
    int
        Number of rows.
    int
        0 done, 1 `out` was too small for the next asteroid, 2 its step size collapsed, 3 it starts inside a body.
    float
        Time at which it did, s; for 3 the number of the body.
    """
    n = _NO_ROWS
    room, spare_room, places = empty_room(), empty_room(), empty_places()
    for i in range(first, epochs.size):
        t0 = epochs[i]
        y = states[i]
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
                field, laws[i], t0, y, quiet, end, limits, floors, tolerances[i], room, spare_room, out, m
            )
            if status != 0:
                return i, n, status, t
        for row in range(n, m):
            out[row, 11] = i
        n = m
    return epochs.size, n, 0, 0.0
