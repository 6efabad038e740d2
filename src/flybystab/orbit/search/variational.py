"""State transition matrices by the variational equations, integrated with the orbit.

Small deviations d = (dr, dv) of an orbit and dp of its non-gravitational parameters obey

    dr' = dv,   dv' = (da/dr) dr + (da/dv) dv + (da/dp) dp

along the orbit (e.g. Montenbruck & Gill 2000, section 7.2). They are integrated by the stages of RKN12(10) that the
orbit itself has taken, so that the result is the derivative of the integrated orbit. The gradients are those of
:mod:`flybystab.orbit.gradients` and :mod:`flybystab.orbit.nongravitational`; those below 1e-9 of that of the attracting
body are left out.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import DAY
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.core.numerics.rkn12 import FROM, IN_POSITION, IN_VELOCITY, N_STAGES, NODE, STAGE, stage_state
from flybystab.orbit.almanac import N_BELT, N_FAST, N_SLOW, Places, find_places, has_belt
from flybystab.orbit.ephemeris import SUN
from flybystab.orbit.gradients import (
    add_attraction_gradient,
    add_oblateness_gradient,
    add_relativity_gradient,
)
from flybystab.orbit.nongravitational import (
    BY_DT,
    N_PARAMETERS,
    NonGravitationalParameters,
    acts,
    add_nongravitational,
    add_nongravitational_gradient,
    nongravitational_by_parameters,
)
from flybystab.orbit.search.acceleration import (
    Field,
    empty_places,
    heliocentric,
)
from flybystab.orbit.search.steps import Room, advance, begin
from flybystab.typing import Array

#: Gradients below this fraction of that of the attracting body are left out.
_NEGLIGIBLE = 1e-9


@kernel
def gradient(
    field: Field,
    law: NonGravitationalParameters,
    t: float,
    y: Array,
    by_parameters: bool,
    by_delay: bool,
    places: Places,
    a: Array,
    by_law: Array,
) -> None:
    """Derivatives of the acceleration at ``t`` (s), ``y[6]`` (m, m/s).

    By position and velocity (1/s2, 1/s) into ``a[3, 6]``; with `by_parameters` by A1, A2, A3, DT and AMRAT (SI) into
    ``by_law[N_PARAMETERS, 3]``, by DT only with `by_delay`. ``places`` is work space.
    """
    field, places = borrowed(field), borrowed(places)
    y, a, by_law = borrowed(y), borrowed(a), borrowed(by_law)
    belt = has_belt(field.book)
    find_places(field.book, t, belt, places)
    a[:] = 0.0
    add_attraction_gradient(places.fast, N_FAST, field.gm_fast, field.inner_fast, y, a)
    add_attraction_gradient(places.slow, N_SLOW, field.gm_slow, field.inner_slow, y, a)
    if belt:
        add_attraction_gradient(places.belt, N_BELT, field.gm_belt, field.inner_belt, y, a)
    r = np.empty(3)
    v = np.empty(3)
    for i in range(field.zonal.shape[0]):
        body = field.zonal[i]
        s = body.slot
        for j in range(3):
            r[j] = y[j] - (places.fast[j * N_FAST + s] if body.grid == 0 else places.slow[j * N_SLOW + s])
        gm = field.gm_fast[s] if body.grid == 0 else field.gm_slow[s]
        if abs(body.j2) > _NEGLIGIBLE * gm * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]):
            v[0], v[1], v[2] = (
                body.pole_x + t * body.rate_x,
                body.pole_y + t * body.rate_y,
                body.pole_z + t * body.rate_z,
            )
            add_oblateness_gradient(body.j2, body.j3, body.j4, v, body.inner2, r, a)
    heliocentric(y, places, r, v)
    if field.gm_pn != 0.0:
        add_relativity_gradient(field.gm_pn, r, v, a)
    if acts(law):
        here = np.zeros(3)
        add_nongravitational(law, r, v, here)
        size = np.sqrt(here[0] * here[0] + here[1] * here[1] + here[2] * here[2])
        if size * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) > _NEGLIGIBLE * field.gm[SUN]:
            add_nongravitational_gradient(law, r, v, a)
    if by_parameters:
        nongravitational_by_parameters(law, r, v, by_delay, by_law)


@kernel
def vary(
    field: Field,
    law: NonGravitationalParameters,
    t: float,
    y: Array,
    h: float,
    k: Array,
    by_parameters: bool,
    by_delay: bool,
    more: Array,
    columns: Array,
    rates: Array,
    now: Array,
    places: Places,
) -> None:
    """Integrate deviations over a step that the orbit has taken.

    Parameters
    ----------
    t, y, h : float, ndarray, float
        Beginning of the step (s; m, m/s), and its length.
    k : ndarray, shape (18, 6)
        Rates of the orbit at the stages of the step.
    by_parameters, by_delay : bool
        True if non-gravitational parameters deviate, and if DT is among them.
    more : ndarray, shape (5, m)
        Deviations of A1, A2, A3, DT, AMRAT that go with each column.
    columns : ndarray, shape (6, m)
        The deviations, one a column (m, m/s); replaced by those at the end of the step.
    rates, now, places : ndarray (17, 3, m), ndarray (6, m), Places
        Work space; `rates` are second derivatives of the deviations of position.
    """
    k, more, columns, rates, now = (
        borrowed(k),
        borrowed(more),
        borrowed(columns),
        borrowed(rates),
        borrowed(now),
    )
    a = np.empty((3, 6))
    by_law = np.zeros((N_PARAMETERS, 3))
    state = np.empty(6)
    count = columns.shape[1]
    half = 3 * count
    flat, before = now.reshape(2 * half), columns.reshape(2 * half)
    all_rates = rates.reshape((N_STAGES, half))
    for s in range(N_STAGES + 1):
        for j in range(half):
            flat[j] = before[j] + NODE[s] * h * before[half + j]
            flat[half + j] = before[half + j]
        for m in range(FROM[s], FROM[s + 1]):
            in_position, in_velocity = h * h * IN_POSITION[m], h * IN_VELOCITY[m]
            its = all_rates[STAGE[m]]
            for j in range(half):
                flat[j] += in_position * its[j]
                flat[half + j] += in_velocity * its[j]
        if s == N_STAGES:
            before[:] = flat
            return
        stage_state(s, y, h, k, state)
        gradient(field, law, t + NODE[s] * h, state, by_parameters, by_delay, places, a, by_law)
        out = rates[s]
        out[:] = 0.0
        for j in range(3):
            for m in range(6):
                for c in range(count):
                    out[j, c] += a[j, m] * now[m, c]
            if by_parameters:
                for m in range(N_PARAMETERS):
                    for c in range(count):
                        out[j, c] += by_law[m, j] * more[m, c]


@kernel
def carry_with_deviations(
    field: Field,
    law: NonGravitationalParameters,
    t0: float,
    y0: Array,
    times: Array,
    tolerance: float,
    room: Room,
    more: Array,
    states: Array,
    changes: Array,
) -> int:
    """States at ``times`` and the state transition matrices between successive times.

    Parameters
    ----------
    field, law, t0, y0, tolerance, room
        As of :func:`flybystab.orbit.search.neighbours.carry`.
    times : ndarray, shape (n,)
        In order away from ``t0``, s.
    more : ndarray, shape (q, 5)
        Unit deviations of A1, A2, A3, DT, AMRAT, one a row.
    states : ndarray, shape (n, 6)
        Result: barycentric states, m and m/s.
    changes : ndarray, shape (n, 6, 6 + q)
        Result: state transition matrix from the time before (the first: from ``t0``), then a column for each row of
        ``more``, SI.

    Returns
    -------
    int
        Number of times reached.
    """
    field, room = borrowed(field), borrowed(room)
    k = room.k
    spare = empty_places()
    q = more.shape[0]
    unit = np.zeros((6, 6 + q))
    by = np.zeros((N_PARAMETERS, 6 + q))
    for j in range(6):
        unit[j, j] = 1.0
    for c in range(q):
        by[:, 6 + c] = more[c]
    by_parameters = q > 0
    by_delay = by_parameters and np.abs(more[:, BY_DT]).max() > 0.0
    columns, now = np.empty((6, 6 + q)), np.empty((6, 6 + q))
    rates = np.empty((N_STAGES, 3, 6 + q))
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    begin(field, law, t, y, room)
    for n in range(times.size):
        columns[:] = unit
        while t != times[n]:
            t_new, h = advance(field, law, t, y, h, times[n], tolerance, room, new)
            if t_new != t_new:  # the step size collapsed
                return n
            vary(field, law, t, y, t_new - t, k, by_parameters, by_delay, by, columns, rates, now, spare)
            t = t_new
            y[:] = new
            k[0] = k[N_STAGES]
        states[n] = y
        changes[n] = columns
    return times.size
