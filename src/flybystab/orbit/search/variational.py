"""State transition matrices by the variational equations, integrated with the orbit.

Small deviations d = (dr, dv) of an orbit and dp of its non-gravitational parameters obey

    dr' = dv,   dv' = (da/dr) dr + (da/dv) dv + (da/dp) dp

along the orbit (e.g. Montenbruck & Gill 2000, section 7.2). They are integrated by the stages of DOP853 that the orbit
itself has taken, so that the result is the derivative of the integrated orbit. Gradients:

- point masses: ``GM (3 r r^T/r^5 - 1/r^3)``;
- zonal harmonics: central differences of their acceleration as a function of the position relative to the body;
- relativity: Schwarzschild's term of the Sun; the other terms of 1PN are smaller by four orders of magnitude;
- non-gravitational law: central differences by position and velocity; exact by A1, A2, A3 and AMRAT.

Gradients below 1e-9 of that of the attracting body are left out.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import C_LIGHT, DAY
from flybystab.core.numerics.dop853 import FROM, N_STAGES, NODE, STAGE, WEIGHT, stage_state_6
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.almanac import N_BELT, N_FAST, N_SLOW, SLOT, Places, find_places
from flybystab.orbit.covariance import PUSHES
from flybystab.orbit.ephemeris import SUN
from flybystab.orbit.forces import RADIATION_PRESSURE, fade, push, zonal_factors
from flybystab.orbit.search.acceleration import Field, borrowed_field, empty_places, rate
from flybystab.orbit.search.dop853 import Room, advance, borrowed_room
from flybystab.typing import Array

_SUN = int(SLOT[SUN])
#: Gradients below this share of that of the attracting body are left out.
_NEGLIGIBLE = 1e-9
#: Steps of the differences, in units of the distance and of the speed; of DT, s.
_RELATIVE, _DELAY = 1e-4, 0.1 * DAY
_N_PUSHES = len(PUSHES)


@kernel
def _add_tide(p: Array, slots: int, gm: Array, inner: Array, y: Array, a: Array) -> None:
    """Add the gradient of the attraction by the bodies of one grid (1/s2) to ``a[3, 6]``.

    Inside its smooth core a body counts as if the asteroid were on the surface of the core.
    """
    x, y_, z = y[0], y[1], y[2]
    sxx = sxy = sxz = syy = syz = szz = trace = 0.0
    for i in range(slots):
        dx, dy, dz = p[i] - x, p[slots + i] - y_, p[2 * slots + i] - z
        r2 = max(dx * dx + dy * dy + dz * dz, inner[i])
        c = gm[i] / (r2 * np.sqrt(r2))
        b = 3.0 * c / r2
        trace += c
        sxx += b * dx * dx
        sxy += b * dx * dy
        sxz += b * dx * dz
        syy += b * dy * dy
        syz += b * dy * dz
        szz += b * dz * dz
    a[0, 0] += sxx - trace
    a[1, 1] += syy - trace
    a[2, 2] += szz - trace
    a[0, 1] += sxy
    a[1, 0] += sxy
    a[0, 2] += sxz
    a[2, 0] += sxz
    a[1, 2] += syz
    a[2, 1] += syz


@kernel
def _add_zonal_gradient(row: Array, t: float, d: Array, a: Array) -> None:
    """Add the gradient of the acceleration by J2, J3, J4 (1/s2) at ``d`` (m) from a body to ``a[3, 6]``.

    ``row`` is a row of ``Field.flat``.
    """
    pole = np.empty(3)
    x = np.empty(3)
    ends = np.empty((2, 3))
    r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    w = fade(r * r / row[11])
    if w == 0.0:
        return
    for j in range(3):
        pole[j] = row[3 + j] + t * row[6 + j]
    h = _RELATIVE * r
    for m in range(3):
        for side in range(2):
            x[:] = d
            x[m] += h if side == 0 else -h
            b = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
            s = (x[0] * pole[0] + x[1] * pole[1] + x[2] * pole[2]) / b
            radial, along = zonal_factors(w * row[2], w * row[9], w * row[10], b, s)
            for j in range(3):
                ends[side, j] = radial * x[j] + along * pole[j]
        for j in range(3):
            a[j, m] += 0.5 * (ends[0, j] - ends[1, j]) / h


@kernel
def _add_relativity_gradient(gm: float, r: Array, v: Array, a: Array) -> None:
    """Add the gradient of ``GM/(c^2 r^3) [(4 GM/r - v^2) r + 4 (r.v) v]`` by position and velocity to ``a[3, 6]``."""
    r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    v2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    rv = r[0] * v[0] + r[1] * v[1] + r[2] * v[2]
    d = np.sqrt(r2)
    k = gm / (C_LIGHT * C_LIGHT * r2 * d)
    b = 4.0 * gm / d - v2
    for j in range(3):
        whole = b * r[j] + 4.0 * rv * v[j]
        a[j, j] += k * b
        a[j, 3 + j] += 4.0 * k * rv
        for m in range(3):
            a[j, m] += k * (-3.0 * r[m] / r2 * whole - 4.0 * gm * r[m] / (r2 * d) * r[j] + 4.0 * v[m] * v[j])
            a[j, 3 + m] += k * (4.0 * r[m] * v[j] - 2.0 * v[m] * r[j])


@kernel
def _add_push_gradient(law: Array, r: Array, v: Array, a: Array) -> None:
    """Add the gradient of the non-gravitational acceleration by position and velocity to ``a[3, 6]``."""
    x, w = r.copy(), v.copy()
    ends = np.empty((2, 3))
    sizes = np.empty(2)
    sizes[0] = _RELATIVE * np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    sizes[1] = _RELATIVE * np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    for m in range(6):
        h = sizes[m // 3]
        moved, at = (x, r) if m < 3 else (w, v)
        for side in range(2):
            moved[m % 3] = at[m % 3] + (h if side == 0 else -h)
            ends[side] = 0.0
            push(law, x, w, ends[side])
        moved[m % 3] = at[m % 3]
        for j in range(3):
            a[j, m] += 0.5 * (ends[0, j] - ends[1, j]) / h


@kernel
def _push_by_parameters(law: Array, r: Array, v: Array, delayed: bool, out: Array) -> None:
    """Write the derivatives of the acceleration by A1, A2, A3, DT (if ``delayed``) and AMRAT into ``out[5, 3]``."""
    its = law.copy()
    out[:] = 0.0
    its[9] = 0.0
    for m in range(3):
        its[:3] = 0.0
        its[m] = 1.0
        push(its, r, v, out[m])
    its[:3] = 0.0
    its[9] = RADIATION_PRESSURE
    push(its, r, v, out[4])
    if delayed:
        before = np.zeros(3)
        its[:] = law
        its[8] += _DELAY
        push(its, r, v, out[3])
        its[8] -= 2.0 * _DELAY
        push(its, r, v, before)
        for j in range(3):
            out[3, j] = 0.5 * (out[3, j] - before[j]) / _DELAY


@kernel
def gradient(
    field: Field,
    law: Array,
    t: float,
    y: Array,
    pushed: bool,
    delayed: bool,
    places: Places,
    a: Array,
    by_law: Array,
) -> None:
    """Derivatives of the acceleration at ``t`` (s), ``y[6]`` (m, m/s).

    By position and velocity (1/s2, 1/s) into ``a[3, 6]``; by A1, A2, A3, DT and AMRAT (SI) into ``by_law[5, 3]``, where
    ``pushed``, by DT only where ``delayed``. ``places`` is work space.
    """
    belt = field.book.when[2, 2] > 0.0
    find_places(field.book, t, belt, places)
    a[:] = 0.0
    _add_tide(places.fast, N_FAST, field.gm_fast, field.inner_fast, y, a)
    _add_tide(places.slow, N_SLOW, field.gm_slow, field.inner_slow, y, a)
    if belt:
        _add_tide(places.belt, N_BELT, field.gm_belt, field.nothing, y, a)
    r = np.empty(3)
    v = np.empty(3)
    for i in range(field.flat.shape[0]):
        row = field.flat[i]
        s = int(row[1])
        for j in range(3):
            r[j] = y[j] - (places.fast[j * N_FAST + s] if row[0] == 0.0 else places.slow[j * N_SLOW + s])
        gm = field.gm_fast[s] if row[0] == 0.0 else field.gm_slow[s]
        if abs(row[2]) > _NEGLIGIBLE * gm * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]):
            _add_zonal_gradient(row, t, r, a)
    for j in range(3):
        r[j] = y[j] - places.slow[j * N_SLOW + _SUN]
        v[j] = y[3 + j] - places.fast[3 * N_FAST + j]
    if field.gm_pn != 0.0:
        _add_relativity_gradient(field.gm_pn, r, v, a)
    if law[0] != 0.0 or law[1] != 0.0 or law[2] != 0.0 or law[9] != 0.0:
        here = np.zeros(3)
        push(law, r, v, here)
        size = np.sqrt(here[0] * here[0] + here[1] * here[1] + here[2] * here[2])
        if size * (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]) > _NEGLIGIBLE * field.gm[SUN]:
            _add_push_gradient(law, r, v, a)
    if pushed:
        _push_by_parameters(law, r, v, delayed, by_law)


@kernel
def vary(
    field: Field,
    law: Array,
    t: float,
    y: Array,
    h: float,
    k: Array,
    pushed: bool,
    delayed: bool,
    more: Array,
    columns: Array,
    rates: Array,
    now: Array,
    places: Places,
) -> None:
    """Carry deviations over a step that the orbit has taken.

    Parameters
    ----------
    t, y, h : float, ndarray, float
        Beginning of the step (s; m, m/s), and its length.
    k : ndarray, shape (13, 6)
        Rates of the orbit at the stages of the step.
    pushed, delayed : bool
        Whether non-gravitational parameters deviate, and whether DT is among them.
    more : ndarray, shape (5, m)
        Deviations of A1, A2, A3, DT, AMRAT that go with each column.
    columns : ndarray, shape (6, m)
        The deviations, one a column (m, m/s); replaced by those at the end of the step.
    rates, now, places : ndarray (12, 6, m), ndarray (6, m), Places
        Work space.
    """
    a = np.empty((3, 6))
    by_law = np.zeros((_N_PUSHES, 3))
    state = np.empty(6)
    count = columns.shape[1]
    flat, before = now.reshape(6 * count), columns.reshape(6 * count)
    all_rates = rates.reshape((N_STAGES, 6 * count))
    for s in range(N_STAGES + 1):
        flat[:] = before
        for m in range(FROM[s], FROM[s + 1]):
            w = h * WEIGHT[m]
            its = all_rates[STAGE[m]]
            for j in range(6 * count):
                flat[j] += w * its[j]
        if s == N_STAGES:
            before[:] = flat
            return
        stage_state_6(s, y, h, k, state)
        gradient(field, law, t + NODE[s] * h, state, pushed, delayed, places, a, by_law)
        out = rates[s]
        out[:3] = now[3:]
        out[3:] = 0.0
        for j in range(3):
            for m in range(6):
                for c in range(count):
                    out[3 + j, c] += a[j, m] * now[m, c]
            if pushed:
                for m in range(_N_PUSHES):
                    for c in range(count):
                        out[3 + j, c] += by_law[m, j] * more[m, c]


@kernel
def carry_with_deviations(
    field: Field,
    law: Array,
    t0: float,
    y0: Array,
    times: Array,
    tolerance: float,
    room: Room,
    more: Array,
    states: Array,
    changes: Array,
) -> int:
    """States at ``times`` and what unit deviations at each time have become at the next.

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
    field = borrowed_field(field)
    k, places = borrowed_room(room)
    spare = empty_places()
    q = more.shape[0]
    unit = np.zeros((6, 6 + q))
    by = np.zeros((_N_PUSHES, 6 + q))
    for j in range(6):
        unit[j, j] = 1.0
    for c in range(q):
        by[:, 6 + c] = more[c]
    pushed = q > 0
    delayed = pushed and np.abs(more[:, 3]).max() > 0.0
    columns, now = np.empty((6, 6 + q)), np.empty((6, 6 + q))
    rates = np.empty((N_STAGES, 6, 6 + q))
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    rate(field, law, t, y, places, k[0])
    for n in range(times.size):
        columns[:] = unit
        while t != times[n]:
            t_new, h = advance(field, law, t, y, h, times[n], tolerance, k, new, places)
            if t_new != t_new:  # the step size collapsed
                return n
            vary(field, law, t, y, t_new - t, k, pushed, delayed, by, columns, rates, now, spare)
            t = t_new
            y[:] = new
            k[0] = k[12]
        states[n] = y
        changes[n] = columns
    return times.size
