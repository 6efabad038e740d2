"""Acceleration of an asteroid with the positions of the bodies from an almanac, for the search for encounters.

The forces are those of :mod:`flybystab.orbit.forces`, from the same table, arranged so that the compiler vectorises
the sums over bodies.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from flybystab.constants import C_LIGHT
from flybystab.core.numerics.jit import borrowed, kernel, pasted_kernel
from flybystab.orbit import forces as table
from flybystab.orbit.almanac import (
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
    Almanac,
    Places,
    almanac,
    find_heavy,
    find_places,
)
from flybystab.orbit.ephemeris import BODIES, SUN, Window
from flybystab.orbit.forces import core, fade, model, push, zonal_factors
from flybystab.orbit.relativity import of_source
from flybystab.typing import Array

_SUN = int(SLOT[SUN])


class Field(NamedTuple):
    """The chosen forces.

    Attributes
    ----------
    book : Almanac
    gm_fast, gm_slow, gm_belt : ndarray
        GM (m3/s2) in use per slot; zero: left out.
    inner_fast, inner_slow : ndarray
        Square of the radius of the smooth core per slot, m2; ``nothing`` is zeros, for the asteroids.
    flat : ndarray, shape (n, 12)
        Bodies with zonal harmonics: grid (0 fast, 1 slow), slot, ``J2 GM a^2`` (m5/s2), pole at t = 0, rate of the
        pole (1/s), ``J3 GM a^3``, ``J4 GM a^4``, square of the radius of the core (m2).
    gm_pn : float
        GM of the Sun with 1PN, else zero.
    heavy : ndarray, shape (2, N_HEAVY)
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
    nothing: Array
    flat: Array
    gm_pn: float
    heavy: Array
    head: Array
    data: Array
    gm: Array


def field(window: Window, forces: Iterable[str]) -> Field:
    """The named forces (``FORCES``, without non-gravitational) in a window.

    Raises
    ------
    UnknownName
    """
    flat_model = model(window, forces)
    used = flat_model[table._USED : table._DATA]
    inner = flat_model[table._INNER : table._FLAT] ** 2
    grids = [np.zeros(N_FAST), np.zeros(N_SLOW)]
    inners = [np.zeros(N_FAST), np.zeros(N_SLOW)]
    for b in range(len(BODIES)):
        grids[GRID[b]][SLOT[b]] = used[b]
        inners[GRID[b]][SLOT[b]] = inner[b]
    belt = used[len(BODIES) :]
    rows = []
    for b in range(len(BODIES)):
        at = table._FLAT + table.FLAT_WIDTH * b
        numbers = flat_model[at : at + table.FLAT_WIDTH]
        if numbers[[0, 7, 8]].any():
            rows.append([float(GRID[b]), float(SLOT[b]), *numbers, inner[b]])
    return Field(
        almanac(window, bool(belt.any())),
        grids[0],
        grids[1],
        belt.copy(),
        inners[0],
        inners[1],
        np.zeros(N_BELT),
        np.array(rows).reshape(-1, 3 + table.FLAT_WIDTH),
        float(window.gm[SUN]) if flat_model[2] != 0.0 else 0.0,
        np.array([used[: len(BODIES)], inner])[:, [BODIES.index(name) for name in HEAVY]],
        window.head,
        window.data,
        window.gm,
    )


@kernel
def empty_places() -> Places:
    """Uninitialised positions of all bodies."""
    return Places(np.zeros(C_FAST), np.zeros(C_SLOW), np.zeros(C_BELT), np.zeros(C_HEAVY))


@kernel
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
        borrowed(f.nothing),
        borrowed(f.flat),
        f.gm_pn,
        borrowed(f.heavy),
        borrowed(f.head),
        borrowed(f.data),
        borrowed(f.gm),
    )


@pasted_kernel
def _pull(
    p: Array, slots: int, gm: Array, inner: Array, x: float, y: float, z: float
) -> tuple[float, float, float, float, int]:
    """Newtonian acceleration by the bodies of one grid (m/s2), potential (m2/s2), number of bodies around the asteroid.

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


@kernel
def _push(law: Array, y: Array, places: Places, out: Array) -> None:
    """Add the non-gravitational acceleration (m/s2) to ``out[3:6]``."""
    r = np.empty(3)
    w = np.empty(3)
    for j in range(3):
        r[j] = y[j] - places.slow[j * N_SLOW + _SUN]
        w[j] = y[3 + j] - places.fast[3 * N_FAST + j]
    push(law, r, w, out[3:])


@pasted_kernel
def rate(field: Field, law: Array, t: float, y: Array, places: Places, out: Array) -> None:
    """Write velocity and acceleration at ``t`` (s), ``y[6]`` into ``out[6]``, and positions of bodies into ``places``.

    ``law`` is :attr:`flybystab.orbit.forces.NonGravitational.row`; zeros without non-gravitational acceleration.
    """
    belt = field.book.when[2, 2] > 0.0
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
        bx, by, bz, _, _ = _pull(places.belt, N_BELT, field.gm_belt, field.nothing, px, py, pz)
        ax += bx
        ay += by
        az += bz
    for i in range(field.flat.shape[0]):
        row = field.flat[i]
        p, slots = (fast, N_FAST) if row[0] == 0.0 else (slow, N_SLOW)
        s = int(row[1])
        dx = px - p[s]
        dy = py - p[slots + s]
        dz = pz - p[slots + slots + s]
        r2 = dx * dx + dy * dy + dz * dz
        d = np.sqrt(r2)
        polar_x, polar_y, polar_z = row[3] + t * row[6], row[4] + t * row[7], row[5] + t * row[8]
        z = (dx * polar_x + dy * polar_y + dz * polar_z) / d
        w = 1.0 if r2 > row[11] else fade(r2 / row[11])
        a, b = zonal_factors(w * row[2], w * row[9], w * row[10], d, z)
        ax += a * dx + b * polar_x
        ay += a * dy + b * polar_y
        az += a * dz + b * polar_z
    if field.gm_pn != 0.0:
        find_heavy(field.book, t, places)
        q = places.heavy
        ex, ey, ez = of_source(
            field.gm_pn,
            px - slow[_SUN],
            py - slow[N_SLOW + _SUN],
            pz - slow[2 * N_SLOW + _SUN],
            fast[3 * N_FAST],
            fast[3 * N_FAST + 1],
            fast[3 * N_FAST + 2],
            q[10 * N_HEAVY],
            q[10 * N_HEAVY + 1],
            q[10 * N_HEAVY + 2],
            q[10 * N_HEAVY + 3],
            vx,
            vy,
            vz,
        )
        for i in range(N_HEAVY):
            dx, dy, dz = px - q[i], py - q[N_HEAVY + i], pz - q[2 * N_HEAVY + i]
            bx, by, bz = of_source(
                0.0 if dx * dx + dy * dy + dz * dz < field.heavy[1, i] else field.heavy[0, i],
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
        a = vx * vx + vy * vy + vz * vz - 4.0 * potential
        b = -4.0 * (gx * vx + gy * vy + gz * vz)
        ax += (a * gx + b * vx + ex) / (C_LIGHT * C_LIGHT)
        ay += (a * gy + b * vy + ey) / (C_LIGHT * C_LIGHT)
        az += (a * gz + b * vz + ez) / (C_LIGHT * C_LIGHT)
    out[0], out[1], out[2], out[3], out[4], out[5] = vx, vy, vz, ax, ay, az
    if n + m > 0:
        _pull_inside(fast, N_FAST, field.gm_fast, field.inner_fast, y, out)
        _pull_inside(slow, N_SLOW, field.gm_slow, field.inner_slow, y, out)
    if law[0] != 0.0 or law[1] != 0.0 or law[2] != 0.0 or law[9] != 0.0:
        _push(law, y, places, out)


@kernel
def first_rate(field: Field, law: Array, t: float, y: Array, places: Places, out: Array) -> None:
    """`rate` as a kernel of its own, for the start of an integration: it is compiled once instead of once a caller."""
    rate(field, law, t, y, places, out)


__all__ = ["Field", "borrowed_field", "empty_places", "field", "first_rate", "rate"]
