"""Closest approaches within one step of a search: exclusion by a lower bound, sampling, refinement.

The distance from the chord between the ends of a step, less the largest deviation of an accelerated path from it
(``h^2 |a| / 8``), is a lower bound. Other steps are sampled on the quintic Hermite interpolant; a change of sign of
``r.v`` is refined with steps of the integrator and positions from the ephemeris.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.rkn12 import N_STAGES
from flybystab.orbit.almanac import Places
from flybystab.orbit.closest_approach import STATE, TIME, between
from flybystab.orbit.ephemeris import BODIES, body_state
from flybystab.orbit.kepler import time_at_distance
from flybystab.orbit.nongravitational import NonGravitationalParameters
from flybystab.orbit.planets import PLANETS
from flybystab.orbit.search.acceleration import Field
from flybystab.orbit.search.steps import step
from flybystab.typing import Array

#: An encounter: place of the body in ``BODIES``; time of the minimum (s), state relative to the body (m, m/s) and
#: distance (m) then; square of the hyperbolic excess speed (m2/s2; negative for a bound encounter); whether it is an
#: impact; number of the asteroid. The state of an impact is that at the last step outside the body; its time and
#: distance are those of the periapsis of the two-body orbit through that state. (np.record: fields are attributes in
#: uncompiled kernels, too.)
FOUND = np.dtype(
    (
        np.record,
        [
            ("body", "i8"),
            ("time", "f8"),
            ("state", "f8", 6),
            ("distance", "f8"),
            ("v_inf2", "f8"),
            ("impact", "i8"),
            ("asteroid", "i8"),
        ],
    )
)
#: Intervals in which ``r.v`` is sampled: usual, and for slow relative motion, where it can change sign twice.
_CUTS, FINE = 8, 64
#: Precision of the sampled time of a minimum, and of the refined one, s.
_SAMPLED, _REFINED = 1e-3, 1e-5
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
#: Upper bound of the distance of each of ``BODIES`` from the Sun, m, for an eccentricity of 0.3; inf for the Sun.
FARTHEST = np.array([1.3 * PLANETS[name].orbit_radius if name != "sun" else np.inf for name in BODIES])


@kernel
def chord_distance(a: Array, old: Array, b: Array, new: Array, body: int) -> float:
    """Distance (m) of a body from the chord of the path relative to it in a step from ``a[:3]`` to ``b[:3]``.

    ``old[body]`` and ``new[body]`` are its positions at the ends of the step, m.
    """
    rr = 0.0
    rd = 0.0
    dd = 0.0
    for j in range(3):
        r = a[j] - old[body, j]
        d = b[j] - new[body, j] - r
        rr += r * r
        rd += r * d
        dd += d * d
    s = min(max(-rd / dd, 0.0), 1.0) if dd > 0.0 else 0.0
    return np.sqrt(max(rr + s * (2.0 * rd + s * dd), 0.0))


@kernel
def relative_state(field: Field, pair: Array, body: int, t: float, out: Array, work: Array) -> float:
    """Write the state (m, m/s) relative to a body at ``t`` on the quintic into ``out[6]``; returns ``r.v`` (m2/s).

    ``pair[2, LOG_WIDTH]`` are the ends of the step in order of time, as rows of a log.
    """
    between(pair, 0, t, out)
    body_state(field.head, field.data, field.gm, body, t, work)
    for j in range(6):
        out[j] -= work[j]
    return out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@kernel
def end_state(field: Field, pair: Array, end: int, body: int, out: Array, work: Array) -> float:
    """As `relative_state` at an end of the step, without interpolation."""
    body_state(field.head, field.data, field.gm, body, pair[end, TIME], work)
    for j in range(6):
        out[j] = pair[end, STATE.start + j] - work[j]
    return out[0] * out[3] + out[1] * out[4] + out[2] * out[5]


@kernel
def cuts(field: Field, pair: Array, body: int) -> int:
    """Number of sampling intervals: `FINE` if ``|r.a|`` can exceed ``v^2``, so that ``r.v`` can change sign twice."""
    a, b, work = np.empty(6), np.empty(6), np.empty(6)
    end_state(field, pair, 0, body, a, work)
    end_state(field, pair, 1, body, b, work)
    h = pair[1, TIME] - pair[0, TIME]
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
    field: Field,
    law: NonGravitationalParameters,
    t0: float,
    y0: Array,
    k: Array,
    body: int,
    t: float,
    out: Array,
    places: Places,
) -> float:
    """Time of ``r.v = 0`` near ``t`` on the path through ``y0`` at ``t0``; writes the relative state into ``out``.

    ``k[0]`` holds the rate at ``t0``; the other rows are overwritten. Newton's method.
    """
    y = np.empty(6)
    p = np.empty((3, 6))
    for _ in range(12):
        step(field, law, t0, y0, t - t0, k, y, places)
        # Positions, and the planet's acceleration by a central difference over two minutes: in a slow encounter
        # the tide of the Sun is comparable with the attraction by the planet.
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
            slope += out[j] * (k[N_STAGES, 3 + j] - (p[2, 3 + j] - p[0, 3 + j]) / 120.0)
        slope += v2
        if not slope > 1e-3 * v2:
            return t
        dt = -rv / slope
        if abs(dt) < _REFINED:
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
def _distance(s: Array) -> float:
    return np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)


@kernel
def write_impact(row: Any, body: int, gm: float, t: float, s: Array, sign: float) -> None:
    """Fill a row of FOUND for an impact from the relative state ``s[6]`` at ``t`` (s), outside the planet.

    `sign` is the direction of the integration in time.
    """
    q, ahead, energy = two_body(gm, s)
    inbound = sign * (s[0] * s[3] + s[1] * s[4] + s[2] * s[5])
    row.body = body
    row.time = t + sign * (ahead if inbound < 0.0 and ahead == ahead else 0.0)
    row.state[:] = s
    row.distance = min(q, _distance(s))
    row.v_inf2 = energy
    row.impact = 1


@kernel
def _write_minimum(row: Any, body: int, gm: float, t: float, s: Array) -> None:
    """Fill a row of FOUND for a closest approach at ``t`` (s) with the relative state ``s[6]``."""
    d = _distance(s)
    row.body = body
    row.time = t
    row.state[:] = s
    row.distance = d
    row.v_inf2 = s[3] ** 2 + s[4] ** 2 + s[5] ** 2 - 2.0 * gm / d
    row.impact = 0


@kernel
def _minimum_between(
    field: Field, pair: Array, body: int, a: float, b: float, ga: float, gb: float, s: Array, work: Array
) -> float:
    """Time of ``r.v = 0`` on the quintic between `a` and `b` (s) with ``r.v`` = `ga`, `gb`; relative state in ``s``.

    Illinois variant of the false position.
    """
    for _ in range(60):
        t = (a * gb - b * ga) / (gb - ga)
        if not (a < t < b or b < t < a):
            t = 0.5 * (a + b)
        g = relative_state(field, pair, body, t, s, work)
        moved = abs(t - b)
        if (g < 0.0) == (gb < 0.0):
            ga *= 0.5
        else:
            a, ga = b, gb
        b, gb = t, g
        if moved < _SAMPLED or g == 0.0:
            break
    return b


@kernel
def minima_in_step(
    field: Field,
    law: NonGravitationalParameters,
    pair: Array,
    first: Array,
    body: int,
    within: float,
    floor: float,
    out: NDArray[Any],
    n: int,
    k: Array,
    places: Places,
) -> tuple[int, float]:
    """Minima of the distance from a body inside one step: rows in ``out`` from ``n``.

    A minimum at an end of a step belongs to the step before it, so that it is found only once.

    Parameters
    ----------
    field, law : Field, NonGravitationalParameters
    pair : ndarray, shape (2, LOG_WIDTH)
        Ends of the step in order of time, as rows of a log.
    first : ndarray, shape (6,)
        Rate at the earlier end.
    body : int
        Place in ``BODIES``.
    within, floor : float
        Largest distance of a minimum, and distance of an impact, m.
    out : ndarray of FOUND
        Result.
    n : int
        First row to write.
    k, places : ndarray, Places
        Work space of the refinement.

    Returns
    -------
    int
        Row after the last one written.
    float
        Time of an impact (s), else nan.
    """
    s, work = np.empty(6), np.empty(6)
    gm = field.gm[body]
    start = pair[0, TIME]
    m = cuts(field, pair, body)
    h = (pair[1, TIME] - start) / m
    after = end_state(field, pair, 0, body, s, work)
    for i in range(m):
        ta = start + i * h
        before = after
        if i < m - 1:
            tb = start + (i + 1) * h
            after = relative_state(field, pair, body, tb, s, work)
        else:
            tb = pair[1, TIME]
            after = end_state(field, pair, 1, body, s, work)
        if not (before < 0.0 and after >= 0.0):
            continue
        t = _minimum_between(field, pair, body, ta, tb, before, after, s, work)
        if _distance(s) > max(within, floor) * 1.001 + 1e7:
            continue
        k[0] = first
        t = refine(field, law, start, pair[0, STATE], k, body, t, s, places)
        d = _distance(s)
        if d < floor:  # entry and exit within one step
            end_state(field, pair, 0, body, s, work)
            write_impact(out[n], body, gm, start, s, 1.0)
            return n + 1, out[n].time
        if d <= within:
            _write_minimum(out[n], body, gm, t, s)
            n += 1
    return n, np.nan
