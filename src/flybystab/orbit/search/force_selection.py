"""Selection of the forces for an orbit and a time span: estimated displacement by each against the allowed error.

The estimate is that of :func:`flybystab.orbit.forces.shares`, ``3 int |a_i(t)| |t_end - t| dt``, along the two-body
orbit around the Sun with positions from the almanac. It takes some microseconds per asteroid.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.almanac import (
    BELT_GRID,
    FAST,
    N_BELT,
    N_FAST,
    N_SLOW,
    PIECES,
    SLOT,
    SLOW,
    Almanac,
    Places,
    find_places,
    has_belt,
)
from flybystab.orbit.ephemeris import BELT, SUN
from flybystab.orbit.kepler import two_body
from flybystab.orbit.search.acceleration import Field, heliocentric
from flybystab.typing import Array

N_SHARES = N_FAST + N_SLOW + N_BELT + 1
#: Forces with an estimate, in its order: slots of the three grids (None for empty ones), then 1PN.
NAMES = (
    *(f"{name} point mass" for name in (*FAST, *SLOW)),
    *[None] * (N_SLOW - len(SLOW)),
    *(f"{name} point mass" for name in BELT),
    "1PN",
)
_POINTS = 32
_SUN = int(SLOT[SUN])


@kernel
def shares_along(field: Field, t0: float, y: Array, t_end: float, places: Places, share: Array) -> None:
    """Set ``share`` (m) to the larger of itself and the displacement by each force from ``t0`` to ``t_end``.

    Parameters
    ----------
    field : Field
    t0, y : float, ndarray
        Start (s) and barycentric state (m, m/s).
    t_end : float
        End, s, before or after.
    places : Places
        Work space.
    share : ndarray, shape (N_SHARES,)
        In the order of ``NAMES``.
    """
    gm = field.gm[SUN]
    belt = has_belt(field.book)
    find_places(field.book, t0, belt, places)
    s = np.empty(6)
    heliocentric(y, places, s[:3], s[3:])
    total = np.zeros(N_SHARES)
    x = np.empty(3)
    dt = (t_end - t0) / _POINTS
    for n in range(_POINTS):
        t = t0 + (n + 0.5) * dt
        find_places(field.book, t, belt, places)
        there = two_body(gm, s, t - t0)
        v2 = 0.0
        r2 = 0.0
        for j in range(3):
            x[j] = there[j] + places.slow[j * N_SLOW + _SUN]
            r2 += there[j] ** 2
            v2 += there[3 + j] ** 2
        weight = 3.0 * abs(dt * (t_end - t))
        for i in range(N_FAST):
            total[i] += weight * field.gm_fast[i] / _square(places.fast, N_FAST, i, x)
        for i in range(N_SLOW):
            total[N_FAST + i] += weight * field.gm_slow[i] / _square(places.slow, N_SLOW, i, x)
        if belt:
            for i in range(N_BELT):
                total[N_FAST + N_SLOW + i] += weight * field.gm_belt[i] / _square(places.belt, N_BELT, i, x)
        r = np.sqrt(r2)
        total[N_SHARES - 1] += (
            weight * field.gm_pn / (C_LIGHT * C_LIGHT * r2) * (4.0 * field.gm_pn / r + 3.0 * v2)
        )
    for i in range(N_SHARES):
        share[i] = max(share[i], total[i])


@kernel
def _square(p: Array, slots: int, i: int, x: Array) -> float:
    return (p[i] - x[0]) ** 2 + (p[slots + i] - x[1]) ** 2 + (p[2 * slots + i] - x[2]) ** 2


@kernel
def reduced(field: Field, share: Array, least: float, always: Array) -> Field:
    """The field without forces whose ``share`` (m) is below ``least``; slots flagged in ``always`` are kept."""
    fast, slow, belt = field.gm_fast.copy(), field.gm_slow.copy(), field.gm_belt.copy()
    for i in range(N_FAST):
        if share[i] < least and not always[i]:
            fast[i] = 0.0
    for i in range(N_SLOW):
        if share[N_FAST + i] < least and not always[N_FAST + i]:
            slow[i] = 0.0
    any_belt = False
    for i in range(N_BELT):
        if share[N_FAST + N_SLOW + i] < least:
            belt[i] = 0.0
        else:
            any_belt = True
    when = field.book.when.copy()
    if not any_belt:
        when[BELT_GRID, PIECES] = 0.0
    book = field.book
    return Field(
        Almanac(when, book.fast, book.slow, book.belt, book.heavy),
        fast,
        slow,
        belt,
        field.inner_fast,
        field.inner_slow,
        field.inner_belt,
        field.zonal,
        field.gm_pn if share[N_SHARES - 1] >= least else 0.0,
        field.gm_heavy,
        field.inner_heavy,
        field.head,
        field.data,
        field.gm,
    )
