"""Closest approaches within one step of a search: exclusion by a lower bound, sampling, refinement.

The distance from the chord between the ends of a step, less the largest deviation of an accelerated path from it
(``h^2 |a| / 8``), is a lower bound. Other steps are sampled on the quintic Hermite interpolant; a change of sign of
``r.v`` is refined with steps of the integrator and positions from the ephemeris.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel
from flybystab.orbit.almanac import Places
from flybystab.orbit.closest_approach import between
from flybystab.orbit.ephemeris import BODIES, body_state
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.search.acceleration import Field
from flybystab.orbit.search.dop853 import step
from flybystab.typing import Array

#: Columns of a raw result: body, time (s), state relative to the body (6; m, m/s), distance (m), v_inf^2
#: (m2/s2), impact (0, 1), asteroid.
WIDTH = 12
#: Intervals in which ``r.v`` is sampled: usual, and for slow relative motion, where it can change sign twice.
_CUTS, FINE = 8, 64
#: Upper bound of the acceleration of each of ``BODIES``, m/s2: GM_sun over the square of the perihelion distance for
#: an eccentricity of 0.3, and for the Moon the Earth's pull (0.0029); the Sun's is below 1e-5.
BENDING = np.array(
    [
        PLANETS["sun"].gm / (0.7 * PLANETS[name].orbit_radius) ** 2 + (0.003 if name == "moon" else 0.0)
        if name != "sun"
        else 1e-5
        for name in BODIES
    ]
)


@kernel
def chord_distance(a: Array, pa: Array, b: Array, pb: Array) -> float:
    """Distance (m) of the origin from the chord of the relative path between two ends of a step."""
    rr = 0.0
    rd = 0.0
    dd = 0.0
    for j in range(3):
        r = a[j] - pa[j]
        d = b[j] - pb[j] - r
        rr += r * r
        rd += r * d
        dd += d * d
    s = min(max(-rd / dd, 0.0), 1.0) if dd > 0.0 else 0.0
    return np.sqrt(max(rr + s * (2.0 * rd + s * dd), 0.0))


@kernel
def relative_state(field: Field, pair: Array, body: int, t: float, out: Array, work: Array) -> float:
    """Write the state (m, m/s) relative to a body at ``t`` on the quintic into ``out[6]``; ``r.v`` (m2/s)."""
    between(pair, 0, t, out)
    body_state(field.head, field.data, field.gm, body, t, work)
    for j in range(6):
        out[j] -= work[j]
    return out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@kernel
def end_state(field: Field, pair: Array, end: int, body: int, out: Array, work: Array) -> float:
    """The same at an end of the step, without interpolation."""
    body_state(field.head, field.data, field.gm, body, pair[end, 0], work)
    for j in range(6):
        out[j] = pair[end, 1 + j] - work[j]
    return out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@kernel
def cuts(field: Field, pair: Array, body: int) -> int:
    """Number of sampling intervals: `FINE` where ``|r.a|`` can exceed ``v^2`` and ``r.v`` can change sign twice."""
    a, b, work = np.empty(6), np.empty(6), np.empty(6)
    end_state(field, pair, 0, body, a, work)
    end_state(field, pair, 1, body, b, work)
    h = pair[1, 0] - pair[0, 0]
    ra = rb = va = vb = bend = 0.0
    for j in range(3):
        ra += a[j] ** 2
        rb += b[j] ** 2
        va += a[3 + j] ** 2
        vb += b[3 + j] ** 2
        bend += (b[3 + j] - a[3 + j]) ** 2
    pull = max(np.sqrt(bend) / h, field.gm[body] / max(min(ra, rb), 1.0))
    return FINE if min(va, vb) < 4.0 * np.sqrt(max(ra, rb)) * pull else _CUTS


@kernel
def refine(
    field: Field, law: Array, t0: float, y0: Array, k: Array, body: int, t: float, out: Array, places: Places
) -> float:
    """Time of ``r.v = 0`` near ``t`` on the path through ``y0`` at ``t0``; relative state in ``out``.

    ``k[0]`` holds the rate at ``t0``; the other rows are overwritten.
    """
    y = np.empty(6)
    p = np.empty((3, 6))
    for _ in range(12):
        step(field, law, t0, y0, t - t0, k, y, places)
        # Positions, and the planet's acceleration by a central difference over two minutes: in a slow passage
        # the Sun's tide matters as much as the planet's attraction.
        for i in range(3):
            body_state(field.head, field.data, field.gm, body, t + 60.0 * (i - 1), p[i])
        rv = 0.0
        slope = 0.0
        v2 = 0.0
        for j in range(3):
            out[j] = y[j] - p[1, j]
            out[3 + j] = y[3 + j] - p[1, 3 + j]
            rv += out[j] * out[3 + j]
            v2 += out[3 + j] ** 2
            slope += out[j] * (k[12, 3 + j] - (p[2, 3 + j] - p[0, 3 + j]) / 120.0)
        slope += v2
        if not slope > 1e-3 * v2:
            return t
        dt = -rv / slope
        if abs(dt) < 1e-5:
            # Linear in the remaining time: shift along the relative velocity.
            for j in range(3):
                out[j] += dt * out[3 + j]
            return t + dt
        t += dt
    return t


@kernel
def two_body(gm: float, s: Array) -> tuple[float, float, float]:
    """Periapsis distance (m), time to it (s) and v_inf^2 (m2/s2) of an inbound relative state ``s[6]``."""
    r = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    v2 = s[3] ** 2 + s[4] ** 2 + s[5] ** 2
    h2 = (
        (s[1] * s[5] - s[2] * s[4]) ** 2 + (s[2] * s[3] - s[0] * s[5]) ** 2 + (s[0] * s[4] - s[1] * s[3]) ** 2
    )
    energy = v2 - 2.0 * gm / r
    q = max(h2 / (gm + np.sqrt(max(gm * gm + h2 * energy, 0.0))), 1.0)
    return q, time_at_distance(gm, q, q * energy / gm, r), energy


@kernel
def crash(row: Array, body: int, gm: float, t: float, sign: float) -> None:
    """Fill a row for an impact from the relative state in ``row[2:8]`` at ``t`` (s), outside the planet."""
    r = np.sqrt(row[2] ** 2 + row[3] ** 2 + row[4] ** 2)
    q, ahead, energy = two_body(gm, row[2:8])
    inbound = sign * (row[2] * row[5] + row[3] * row[6] + row[4] * row[7])
    row[0] = body
    row[1] = t + sign * (ahead if inbound < 0.0 and ahead == ahead else 0.0)
    row[8] = min(q, r)
    row[9] = energy
    row[10] = 1.0


@kernel
def look(
    field: Field,
    law: Array,
    pair: Array,
    first: Array,
    body: int,
    within: float,
    floor: float,
    out: Array,
    n: int,
    k: Array,
    places: Places,
) -> tuple[int, float]:
    """Minima of distance inside one step: rows in ``out`` from ``n``; new count and time of an impact or nan.

    ``pair`` holds the ends of the step in order of time, ``first`` the rate at the earlier end. An end that is
    a minimum itself counts with the step before it, so that steps side by side find it once.
    """
    s, work = np.empty(6), np.empty(6)
    m = cuts(field, pair, body)
    h = (pair[1, 0] - pair[0, 0]) / m
    fa = end_state(field, pair, 0, body, s, work)
    for i in range(m):
        ta = pair[0, 0] + i * h
        if i < m - 1:
            tb = pair[0, 0] + (i + 1) * h
            fb = relative_state(field, pair, body, tb, s, work)
        else:
            tb = pair[1, 0]
            fb = end_state(field, pair, 1, body, s, work)
        start = fa
        fa = fb
        if not (start < 0.0 and fb >= 0.0):
            continue
        a, b, ga, gb = ta, tb, start, fb
        for _ in range(60):  # Illinois false position
            tm = (a * gb - b * ga) / (gb - ga)
            if not (a < tm < b or b < tm < a):
                tm = 0.5 * (a + b)
            gmid = relative_state(field, pair, body, tm, s, work)
            moved = abs(tm - b)
            if (gmid < 0.0) == (gb < 0.0):
                ga *= 0.5
            else:
                a, ga = b, gb
            b, gb = tm, gmid
            if moved < 1e-3 or gmid == 0.0:
                break
        d = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
        if d > max(within, floor) * 1.001 + 1e7:
            continue
        row = out[n]
        k[0] = first
        t = refine(field, law, pair[0, 0], pair[0, 1:7], k, body, b, row[2:8], places)
        d = np.sqrt(row[2] ** 2 + row[3] ** 2 + row[4] ** 2)
        if d < floor:  # entry and exit within one step
            end_state(field, pair, 0, body, row[2:8], work)
            crash(row, body, field.gm[body], pair[0, 0], 1.0)
            return n + 1, row[1]
        if d > within:
            continue
        row[0] = body
        row[10] = 0.0
        row[1] = t
        row[8] = d
        row[9] = row[5] ** 2 + row[6] ** 2 + row[7] ** 2 - 2.0 * field.gm[body] / d
        n += 1
    return n, np.nan
