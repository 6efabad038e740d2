"""Acceleration of an asteroid with the positions of the bodies from an almanac, for the search for encounters.

The forces are those of :mod:`flybystab.orbit.forces`, from the same table, with sums over four
bodies at a time (:mod:`flybystab.core.numerics.lanes`).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.lanes import (
    N_LANES,
    any_less,
    inverse_root,
    inverse_root_24,
    lanes_at,
    spread,
    total,
    zero_where_less,
)
from flybystab.orbit.almanac import (
    AT_SUN,
    C_BELT,
    C_FAST,
    C_HEAVY,
    C_SLOW,
    GRID,
    HEAVY,
    N_BELT,
    N_FAST,
    N_HEAVY,
    N_SLOW,
    SLOT,
    SUN_VELOCITY,
    Almanac,
    Places,
    almanac,
    find_heavy,
    find_places,
    has_belt,
)
from flybystab.orbit.ephemeris import BODIES, N_BODIES, SUN, Window
from flybystab.orbit.forces import core, fade, force_model, zonal_factors
from flybystab.orbit.nongravitational import NonGravitationalParameters, acts, add_nongravitational
from flybystab.orbit.relativity import of_source
from flybystab.typing import Array

_SUN = int(SLOT[SUN])
#: Acceleration by zonal harmonics that is left out, m/s2: a displacement of 9 m in a century if its direction is fixed.
_NEGLIGIBLE = 2e-18

_PER_C2 = 1.0 / (C_LIGHT * C_LIGHT)

#: Zonal harmonics of a body: grid (0 fast, 1 slow) and slot of its position, ``J2 GM a^2`` (m5/s2) and so on, pole at
#: t = 0 and its rate (1/s), square of the radius of the smooth core (m2).
ZONAL = np.dtype(
    (
        np.record,
        [
            ("grid", "i8"),
            ("slot", "i8"),
            ("j2", "f8"),
            ("j3", "f8"),
            ("j4", "f8"),
            ("pole_x", "f8"),
            ("pole_y", "f8"),
            ("pole_z", "f8"),
            ("rate_x", "f8"),
            ("rate_y", "f8"),
            ("rate_z", "f8"),
            ("inner2", "f8"),
        ],
    )
)


class Field(NamedTuple):
    """The chosen forces.

    Attributes
    ----------
    book : Almanac
    gm_fast, gm_slow, gm_belt : ndarray
        GM (m3/s2) in use per slot; zero: left out.
    inner_fast, inner_slow, inner_belt : ndarray
        Square of the radius of the smooth core per slot, m2; zero for asteroids.
    zonal : ndarray of ZONAL
        Bodies with zonal harmonics.
    gm_pn : float
        GM of the Sun with 1PN, else zero.
    gm_heavy, inner_heavy : ndarray, shape (N_HEAVY,)
        GM in use of ``HEAVY``, and the square of the radius (m2) inside of which each is left out of relativity.
    head, data, gm : ndarray
        The ephemeris itself, for positions without interpolation error.
    """

    book: Almanac
    gm_fast: Array
    gm_slow: Array
    gm_belt: Array
    inner_fast: Array
    inner_slow: Array
    inner_belt: Array
    zonal: NDArray[Any]
    gm_pn: float
    gm_heavy: Array
    inner_heavy: Array
    head: Array
    data: Array
    gm: Array


def field(window: Window, forces: Iterable[str]) -> Field:
    """The named forces (``FORCES``, without non-gravitational) in a window.

    Raises
    ------
    UnknownName
    """
    its = force_model(window, forces)
    used, inner2 = its.used[:N_BODIES], its.inner[:N_BODIES] ** 2
    grids = [np.zeros(N_FAST), np.zeros(N_SLOW)]
    inners = [np.zeros(N_FAST), np.zeros(N_SLOW)]
    for b in range(N_BODIES):
        grids[GRID[b]][SLOT[b]] = used[b]
        inners[GRID[b]][SLOT[b]] = inner2[b]
    belt = its.used[N_BODIES:]
    zonal = [
        (GRID[b], SLOT[b], *its.harmonics[b], *its.poles[b], inner2[b])
        for b in np.flatnonzero(its.harmonics.any(axis=1))
    ]
    heavy = [BODIES.index(name) for name in HEAVY]
    gm_heavy, inner_heavy = np.zeros(N_HEAVY), np.zeros(N_HEAVY)
    gm_heavy[: len(heavy)], inner_heavy[: len(heavy)] = used[heavy], inner2[heavy]
    return Field(
        book=almanac(window, bool(belt.any())),
        gm_fast=grids[0],
        gm_slow=grids[1],
        gm_belt=belt.copy(),
        inner_fast=inners[0],
        inner_slow=inners[1],
        inner_belt=np.zeros(N_BELT),
        zonal=np.array(zonal, dtype=ZONAL),
        gm_pn=float(window.gm[SUN]) if its.relativity else 0.0,
        gm_heavy=gm_heavy,
        inner_heavy=inner_heavy,
        head=window.head,
        data=window.data,
        gm=window.gm,
    )


@kernel
def empty_places() -> Places:
    """Uninitialised positions of all bodies."""
    return Places(np.zeros(C_FAST), np.zeros(C_SLOW), np.zeros(C_BELT), np.zeros(C_HEAVY))


@inlined
def _pull(
    p: Array, slots: int, gm: Array, inner: Array, x: float, y: float, z: float
) -> tuple[Any, Any, Any, Any, bool]:
    """Newtonian acceleration by the bodies of one grid (m/s2), potential (m2/s2), whether bodies were left out.

    Sums over every fourth slot. Bodies with the asteroid inside their smooth core are left out.
    """
    ax, ay, az, potential = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    inside = False
    for i in range(0, slots, N_LANES):
        dx = lanes_at(p, i) - x
        dy = lanes_at(p, slots + i) - y
        dz = lanes_at(p, slots + slots + i) - z
        r2 = dx * dx + dy * dy + dz * dz
        core2 = lanes_at(inner, i)
        inside |= any_less(r2, core2)
        inverse = inverse_root(r2)
        u = zero_where_less(lanes_at(gm, i), r2, core2) * inverse
        c = u * (inverse * inverse)
        ax += c * dx
        ay += c * dy
        az += c * dz
        potential += u
    return ax, ay, az, potential, inside


@inlined
def _pull_of_asteroids(p: Array, gm: Array, x: float, y: float, z: float) -> tuple[Any, Any, Any]:
    """Newtonian acceleration by the massive asteroids (m/s2) to 24 bits, which is 1e-16 of that by the Sun."""
    ax, ay, az = spread(0.0), spread(0.0), spread(0.0)
    for i in range(0, N_BELT, N_LANES):
        dx = lanes_at(p, i) - x
        dy = lanes_at(p, N_BELT + i) - y
        dz = lanes_at(p, 2 * N_BELT + i) - z
        inverse = inverse_root_24(dx * dx + dy * dy + dz * dz)
        c = (lanes_at(gm, i) * inverse) * (inverse * inverse)
        ax += c * dx
        ay += c * dy
        az += c * dz
    return ax, ay, az


@kernel
def _pull_inside(p: Array, slots: int, gm: Array, inner: Array, x: Array, out: Array) -> None:
    """Add to ``out[3:6]`` the acceleration by those bodies of a grid whose smooth core contains the asteroid."""
    for i in range(slots):
        dx, dy, dz = p[i] - x[0], p[slots + i] - x[1], p[2 * slots + i] - x[2]
        r2 = dx * dx + dy * dy + dz * dz
        if r2 < inner[i]:
            c = gm[i] * core(r2 / inner[i]) / inner[i] ** 1.5
            out[3] += c * dx
            out[4] += c * dy
            out[5] += c * dz


@inlined
def heliocentric(y: Array, places: Places, r: Array, v: Array) -> None:
    """Write position ``r[3]`` (m) and velocity ``v[3]`` (m/s) relative to the Sun."""
    for j in range(3):
        r[j] = y[j] - places.slow[j * N_SLOW + _SUN]
        v[j] = y[3 + j] - places.fast[SUN_VELOCITY + j]


@kernel
def _add_nongravitational(law: NonGravitationalParameters, y: Array, places: Places, out: Array) -> None:
    """Add the non-gravitational acceleration (m/s2) to ``out[3:6]``."""
    r = np.empty(3)
    v = np.empty(3)
    heliocentric(y, places, r, v)
    add_nongravitational(law, r, v, out[3:])


@inlined
def _oblate_pull(
    field: Field, t: float, places: Places, x: float, y: float, z: float, ax: float, ay: float, az: float
) -> tuple[float, float, float]:
    """Add the acceleration (m/s2) by zonal harmonics at ``x, y, z`` (m) to ``ax, ay, az``."""
    for i in range(field.zonal.shape[0]):
        body = field.zonal[i]
        p, slots = (places.fast, N_FAST) if body.grid == 0 else (places.slow, N_SLOW)
        s = body.slot
        dx = x - p[s]
        dy = y - p[slots + s]
        dz = z - p[slots + slots + s]
        r2 = dx * dx + dy * dy + dz * dz
        if 3.0 * abs(body.j2) < _NEGLIGIBLE * r2 * r2:
            continue
        inverse = 1.0 / np.sqrt(r2)
        px, py, pz = (
            body.pole_x + t * body.rate_x,
            body.pole_y + t * body.rate_y,
            body.pole_z + t * body.rate_z,
        )
        sine = (dx * px + dy * py + dz * pz) * inverse
        w = 1.0 if r2 > body.inner2 else fade(r2 / body.inner2)
        radial, along = zonal_factors(w * body.j2, w * body.j3, w * body.j4, inverse, sine)
        ax += radial * dx + along * px
        ay += radial * dy + along * py
        az += radial * dz + along * pz
    return ax, ay, az


@inlined
def _relativistic_sources(
    field: Field,
    places: Places,
    px: float,
    py: float,
    pz: float,
    vx: float,
    vy: float,
    vz: float,
) -> tuple[float, float, float]:
    """Sum of the terms of the sources in ``c^2`` times the 1PN acceleration, m3/s4; the Sun first.

    ``places.heavy`` must have been computed for this time.
    """
    fast, slow, q = places.fast, places.slow, places.heavy
    dx, dy, dz = px - slow[_SUN], py - slow[N_SLOW + _SUN], pz - slow[2 * N_SLOW + _SUN]
    ex, ey, ez = of_source(
        field.gm_pn,
        1.0 / np.sqrt(dx * dx + dy * dy + dz * dz),
        dx,
        dy,
        dz,
        fast[SUN_VELOCITY],
        fast[SUN_VELOCITY + 1],
        fast[SUN_VELOCITY + 2],
        q[AT_SUN],
        q[AT_SUN + 1],
        q[AT_SUN + 2],
        q[AT_SUN + 3],
        vx,
        vy,
        vz,
    )
    for i in range(0, N_HEAVY, N_LANES):
        x = px - lanes_at(q, i)
        y = py - lanes_at(q, N_HEAVY + i)
        z = pz - lanes_at(q, 2 * N_HEAVY + i)
        r2 = x * x + y * y + z * z
        bx, by, bz = of_source(
            zero_where_less(lanes_at(field.gm_heavy, i), r2, lanes_at(field.inner_heavy, i)),
            inverse_root(r2),
            x,
            y,
            z,
            lanes_at(q, 3 * N_HEAVY + i),
            lanes_at(q, 4 * N_HEAVY + i),
            lanes_at(q, 5 * N_HEAVY + i),
            lanes_at(q, 6 * N_HEAVY + i),
            lanes_at(q, 7 * N_HEAVY + i),
            lanes_at(q, 8 * N_HEAVY + i),
            lanes_at(q, 9 * N_HEAVY + i),
            vx,
            vy,
            vz,
        )
        ex += total(bx)
        ey += total(by)
        ez += total(bz)
    return ex, ey, ez


@inlined
def find_all_places(field: Field, t: float, places: Places) -> None:
    """Write the positions of all bodies at ``t`` (s) and, with 1PN, the quantities of its sources into ``places``."""
    find_places(field.book, t, has_belt(field.book), places)
    if field.gm_pn != 0.0:
        find_heavy(field.book, t, places)


@inlined
def rate_among(
    field: Field, law: NonGravitationalParameters, t: float, y: Array, places: Places, out: Array
) -> None:
    """As `rate`, with the positions in ``places`` computed before."""
    fast, slow = places.fast, places.slow
    px, py, pz, vx, vy, vz = y[0], y[1], y[2], y[3], y[4], y[5]
    nx, ny, nz, near, inside = _pull(fast, N_FAST, field.gm_fast, field.inner_fast, px, py, pz)
    mx, my, mz, far, inside_slow = _pull(slow, N_SLOW, field.gm_slow, field.inner_slow, px, py, pz)
    potential = total(near + far)
    gx, gy, gz = total(nx + mx), total(ny + my), total(nz + mz)
    ax, ay, az = gx, gy, gz
    if has_belt(field.book):
        bx, by, bz = _pull_of_asteroids(places.belt, field.gm_belt, px, py, pz)
        ax += total(bx)
        ay += total(by)
        az += total(bz)
    ax, ay, az = _oblate_pull(field, t, places, px, py, pz, ax, ay, az)
    if field.gm_pn != 0.0:
        ex, ey, ez = _relativistic_sources(field, places, px, py, pz, vx, vy, vz)
        a = vx * vx + vy * vy + vz * vz - 4.0 * potential
        b = -4.0 * (gx * vx + gy * vy + gz * vz)
        ax += (a * gx + b * vx + ex) * _PER_C2
        ay += (a * gy + b * vy + ey) * _PER_C2
        az += (a * gz + b * vz + ez) * _PER_C2
    out[0], out[1], out[2], out[3], out[4], out[5] = vx, vy, vz, ax, ay, az
    if inside or inside_slow:
        _pull_inside(fast, N_FAST, field.gm_fast, field.inner_fast, y, out)
        _pull_inside(slow, N_SLOW, field.gm_slow, field.inner_slow, y, out)
    if acts(law):
        _add_nongravitational(law, y, places, out)


@inlined
def rate(
    field: Field, law: NonGravitationalParameters, t: float, y: Array, places: Places, out: Array
) -> None:
    """Write velocity and acceleration at ``t`` (s), ``y[6]`` into ``out[6]``, and positions of bodies into ``places``.

    ``law`` is :data:`flybystab.orbit.nongravitational.NONE` without non-gravitational acceleration.
    """
    find_all_places(field, t, places)
    rate_among(field, law, t, y, places, out)


__all__ = [
    "ZONAL",
    "Field",
    "empty_places",
    "field",
    "find_all_places",
    "heliocentric",
    "rate",
    "rate_among",
]
