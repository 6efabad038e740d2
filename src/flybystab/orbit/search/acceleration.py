"""Acceleration of an asteroid with the positions of the bodies from an almanac, for the search for encounters.

The forces are those of :mod:`flybystab.orbit.forces`, from the same table, arranged so that the compiler vectorises
the sums over bodies.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import borrowed, inlined, kernel, pasted_kernel
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
        gm_heavy=used[heavy],
        inner_heavy=inner2[heavy],
        head=window.head,
        data=window.data,
        gm=window.gm,
    )


@kernel
def empty_places() -> Places:
    """Uninitialised positions of all bodies."""
    return Places(np.zeros(C_FAST), np.zeros(C_SLOW), np.zeros(C_BELT), np.zeros(C_HEAVY))


@inlined
def borrowed_places(p: Places) -> Places:
    """The same arrays without reference counts, for use inside a kernel that has them as an argument."""
    return Places(borrowed(p.fast), borrowed(p.slow), borrowed(p.belt), borrowed(p.heavy))


@inlined
def borrowed_field(f: Field) -> Field:
    """The field without reference counts, for use inside a kernel that has it as an argument."""
    b = f.book
    return Field(
        Almanac(borrowed(b.when), borrowed(b.fast), borrowed(b.slow), borrowed(b.belt), borrowed(b.heavy)),
        borrowed(f.gm_fast),
        borrowed(f.gm_slow),
        borrowed(f.gm_belt),
        borrowed(f.inner_fast),
        borrowed(f.inner_slow),
        borrowed(f.inner_belt),
        borrowed(f.zonal),
        f.gm_pn,
        borrowed(f.gm_heavy),
        borrowed(f.inner_heavy),
        borrowed(f.head),
        borrowed(f.data),
        borrowed(f.gm),
    )


@pasted_kernel
def _pull(
    p: Array, slots: int, gm: Array, inner: Array, x: float, y: float, z: float
) -> tuple[float, float, float, float, int]:
    """Newtonian acceleration by the bodies of one grid (m/s2), potential (m2/s2), number of bodies left out.

    Bodies with the asteroid inside their smooth core are left out of both sums.
    """
    ax = 0.0
    ay = 0.0
    az = 0.0
    potential = 0.0
    inside = 0
    for i in range(slots):
        dx = p[i] - x
        dy = p[slots + i] - y
        dz = p[slots + slots + i] - z
        r2 = dx * dx + dy * dy + dz * dz
        near = r2 < inner[i]
        inside += near
        c = (0.0 if near else gm[i]) / (r2 * np.sqrt(r2))
        ax += c * dx
        ay += c * dy
        az += c * dz
        potential += c * r2
    return ax, ay, az, potential, inside


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


@pasted_kernel
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


@pasted_kernel
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
        d = np.sqrt(r2)
        px, py, pz = (
            body.pole_x + t * body.rate_x,
            body.pole_y + t * body.rate_y,
            body.pole_z + t * body.rate_z,
        )
        sine = (dx * px + dy * py + dz * pz) / d
        w = 1.0 if r2 > body.inner2 else fade(r2 / body.inner2)
        radial, along = zonal_factors(w * body.j2, w * body.j3, w * body.j4, d, sine)
        ax += radial * dx + along * px
        ay += radial * dy + along * py
        az += radial * dz + along * pz
    return ax, ay, az


@pasted_kernel
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
    ex, ey, ez = of_source(
        field.gm_pn,
        px - slow[_SUN],
        py - slow[N_SLOW + _SUN],
        pz - slow[2 * N_SLOW + _SUN],
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
    for i in range(N_HEAVY):
        dx, dy, dz = px - q[i], py - q[N_HEAVY + i], pz - q[2 * N_HEAVY + i]
        bx, by, bz = of_source(
            0.0 if dx * dx + dy * dy + dz * dz < field.inner_heavy[i] else field.gm_heavy[i],
            dx,
            dy,
            dz,
            q[3 * N_HEAVY + i],
            q[4 * N_HEAVY + i],
            q[5 * N_HEAVY + i],
            q[6 * N_HEAVY + i],
            q[7 * N_HEAVY + i],
            q[8 * N_HEAVY + i],
            q[9 * N_HEAVY + i],
            vx,
            vy,
            vz,
        )
        ex += bx
        ey += by
        ez += bz
    return ex, ey, ez


@pasted_kernel
def rate(
    field: Field, law: NonGravitationalParameters, t: float, y: Array, places: Places, out: Array
) -> None:
    """Write velocity and acceleration at ``t`` (s), ``y[6]`` into ``out[6]``, and positions of bodies into ``places``.

    ``law`` is :data:`flybystab.orbit.nongravitational.NONE` without non-gravitational acceleration.
    """
    belt = has_belt(field.book)
    find_places(field.book, t, belt, places)
    fast, slow = places.fast, places.slow
    px, py, pz, vx, vy, vz = y[0], y[1], y[2], y[3], y[4], y[5]
    ax, ay, az, potential, n = _pull(fast, N_FAST, field.gm_fast, field.inner_fast, px, py, pz)
    bx, by, bz, other, m = _pull(slow, N_SLOW, field.gm_slow, field.inner_slow, px, py, pz)
    ax += bx
    ay += by
    az += bz
    potential += other
    gx, gy, gz = ax, ay, az
    if belt:
        bx, by, bz, _, _ = _pull(places.belt, N_BELT, field.gm_belt, field.inner_belt, px, py, pz)
        ax += bx
        ay += by
        az += bz
    ax, ay, az = _oblate_pull(field, t, places, px, py, pz, ax, ay, az)
    if field.gm_pn != 0.0:
        find_heavy(field.book, t, places)
        ex, ey, ez = _relativistic_sources(field, places, px, py, pz, vx, vy, vz)
        a = vx * vx + vy * vy + vz * vz - 4.0 * potential
        b = -4.0 * (gx * vx + gy * vy + gz * vz)
        ax += (a * gx + b * vx + ex) / (C_LIGHT * C_LIGHT)
        ay += (a * gy + b * vy + ey) / (C_LIGHT * C_LIGHT)
        az += (a * gz + b * vz + ez) / (C_LIGHT * C_LIGHT)
    out[0], out[1], out[2], out[3], out[4], out[5] = vx, vy, vz, ax, ay, az
    if n + m > 0:
        _pull_inside(fast, N_FAST, field.gm_fast, field.inner_fast, y, out)
        _pull_inside(slow, N_SLOW, field.gm_slow, field.inner_slow, y, out)
    if acts(law):
        _add_nongravitational(law, y, places, out)


@kernel
def first_rate(
    field: Field, law: NonGravitationalParameters, t: float, y: Array, places: Places, out: Array
) -> None:
    """`rate` as a separate kernel, for the start of an integration: compiled once instead of inlined in each caller."""
    rate(field, law, t, y, places, out)


__all__ = ["ZONAL", "Field", "borrowed_field", "empty_places", "field", "first_rate", "heliocentric", "rate"]
