"""First post-Newtonian (1PN) acceleration: Einstein-Infeld-Hoffmann (Moyer 2003, eq. 4-26; beta = gamma = 1).

Sources are the Sun, Venus, Earth, Jupiter and Saturn; terms common to all bodies are factored out. With the Newtonian
field g and potential U, and the barycentric velocity v,

``c^2 a = (v^2 - 4 U) g - 4 (g.v) v + sum_j {GM/r^3 [(U_j - 2 u^2 + 4 u.v + 1.5 (r.u/r)^2 + 0.5 r.a_j) r
- 4 (r.v) u - 3 (r.u) (v - u)] + 3.5 GM a_j/r}``,

r is relative to source j, which has velocity u, acceleration a_j and the potential U_j of the other bodies. For one
source at rest this is the Schwarzschild term in harmonic coordinates. With the Sun as the only
source it would not be more accurate than that, since the terms of the planets and of the Sun's motion cancel in part.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.orbit.ephemeris import BODIES, N_BODIES
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: Sources; the other bodies displace an asteroid by a metre in four years (median of 19).
IS_SOURCE = np.array([PLANETS[name].relativity for name in BODIES])


@kernel
def among(places: Array, gm: Array, body: int, out: Array) -> float:
    """Write the acceleration (m/s2) of a body by the others into ``out[3]``; their potential there (m2/s2)."""
    potential = 0.0
    out[:] = 0.0
    for i in range(N_BODIES):
        if i == body:
            continue
        r2 = 0.0
        for j in range(3):
            r2 += (places[i, j] - places[body, j]) ** 2
        d = np.sqrt(r2)
        potential += gm[i] / d
        for j in range(3):
            out[j] += gm[i] / (r2 * d) * (places[i, j] - places[body, j])
    return potential


@inlined
def of_source(
    gm: float,
    inverse: float,
    x: float,
    y: float,
    z: float,
    ux: float,
    uy: float,
    uz: float,
    ax: float,
    ay: float,
    az: float,
    potential: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """Terms of one source in ``c^2`` times the 1PN acceleration (the braces in the formula of the module), m3/s4.

    Parameters
    ----------
    gm : float
        Of the source, m3/s2.
    inverse : float
        Of the distance, 1/m.
    x, y, z : float
        From the source, m.
    ux, uy, uz, ax, ay, az, potential : float
        Barycentric velocity (m/s) and acceleration (m/s2) of the source, potential of the others there (m2/s2).
    vx, vy, vz : float
        Barycentric velocity, m/s.
    """
    i2 = inverse * inverse
    near = gm * inverse
    c = near * i2
    ru = x * ux + y * uy + z * uz
    rv = x * vx + y * vy + z * vz
    s = c * (
        potential
        - 2.0 * (ux * ux + uy * uy + uz * uz)
        + 4.0 * (ux * vx + uy * vy + uz * vz)
        + 1.5 * (ru * ru) * i2
        + 0.5 * (x * ax + y * ay + z * az)
    )
    b = c * (3.0 * ru - 4.0 * rv)
    d = -3.0 * c * ru
    e = 3.5 * near
    return (
        s * x + b * ux + d * vx + e * ax,
        s * y + b * uy + d * vy + e * ay,
        s * z + b * uz + d * vz + e * az,
    )


@kernel
def one_pn(
    gm: Array,
    used: Array,
    inner: Array,
    places: Array,
    rates: Array,
    g: Array,
    potential: float,
    x: Array,
    v: Array,
    out: Array,
) -> None:
    """Add the 1PN acceleration (m/s2) at ``x`` (m), ``v`` (m/s) to ``out[3]``.

    Parameters
    ----------
    gm, used : ndarray, shape (bodies,)
        GM (m3/s2) of ``BODIES`` where they act on each other, and on the asteroid (zero: left out).
    inner : ndarray, shape (bodies,)
        Radius below which a source is left out, m.
    places, rates : ndarray, shape (bodies, 3)
        Of the bodies, m and m/s; velocities of the sources.
    g, potential : ndarray, float
        Newton's field (m/s2) and potential (m2/s2) at ``x``.
    """
    a = np.empty(3)
    total = np.zeros(3)
    for i in range(N_BODIES):
        if not IS_SOURCE[i] or used[i] == 0.0:
            continue
        dx, dy, dz = x[0] - places[i, 0], x[1] - places[i, 1], x[2] - places[i, 2]
        r2 = dx * dx + dy * dy + dz * dz
        if r2 < inner[i] ** 2:
            continue
        u = among(places, gm, i, a)
        bx, by, bz = of_source(
            used[i],
            1.0 / np.sqrt(r2),
            dx,
            dy,
            dz,
            rates[i, 0],
            rates[i, 1],
            rates[i, 2],
            a[0],
            a[1],
            a[2],
            u,
            v[0],
            v[1],
            v[2],
        )
        total[0] += bx
        total[1] += by
        total[2] += bz
    c = v[0] ** 2 + v[1] ** 2 + v[2] ** 2 - 4.0 * potential
    d = -4.0 * (g[0] * v[0] + g[1] * v[1] + g[2] * v[2])
    for j in range(3):
        out[j] += (c * g[j] + d * v[j] + total[j]) / (C_LIGHT * C_LIGHT)
