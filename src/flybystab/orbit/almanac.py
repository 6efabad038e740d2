"""Positions of the bodies as polynomials on uniform grids, at a tenth of the cost of the ephemeris.

A JPL ephemeris has different intervals for each body, while a search needs all bodies at once, hundreds of times per
revolution. The almanac has three grids by speed: Earth, Moon, Mercury and Venus on intervals of 4 d (degree 12),
Sun, Mars, the giant planets and Pluto on 16 d (degree 7), the massive asteroids on 32 d (degree 4). A fourth has
velocities, accelerations and potentials of the heaviest bodies for 1PN, to a relative error of 1e-3. Intervals do
not cross interval boundaries of the JPL files, where derivatives jump. Positions agree with the ephemeris to 0.1 m,
those of asteroids to the error of their table. Barycentric ICRF, m, s.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from astropy.time import Time
from numpy.polynomial import chebyshev

from flybystab.constants import AU, DAY
from flybystab.core.numerics.jit import inlined
from flybystab.core.numerics.lanes import N_LANES, lanes_at, put_lanes
from flybystab.orbit.ephemeris import (
    BELT,
    BODIES,
    EARTH,
    MOON,
    N_BODIES,
    SUN,
    Ephemeris,
    Window,
    from_j2000,
)
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: Bodies of the two planetary grids, in the order of their slots.
FAST = tuple(name for name in BODIES if 0.0 < PLANETS[name].orbit_radius < 1.2 * AU)
SLOW = tuple(name for name in BODIES if name not in FAST)
#: Slots of the grids, padded to multiples of four for vector instructions.
N_FAST, N_SLOW, N_BELT = (-(-len(names) // N_LANES) * N_LANES for names in (FAST, SLOW, BELT))
#: Grid (0 fast, 1 slow) and slot of each of ``BODIES``.
GRID = np.array([0 if name in FAST else 1 for name in BODIES])
SLOT = np.array([(FAST if name in FAST else SLOW).index(name) for name in BODIES])
#: Planets that are sources of 1PN terms (:mod:`flybystab.orbit.relativity`).
HEAVY = tuple(name for name in BODIES if PLANETS[name].relativity and name != "sun")
N_HEAVY = -(-len(HEAVY) // N_LANES) * N_LANES
#: Columns of the grids; those of ``HEAVY`` end with acceleration and potential of the Sun.
C_FAST, C_SLOW, C_BELT, C_HEAVY = 3 * N_FAST + 4, 3 * N_SLOW, 3 * N_BELT, 10 * N_HEAVY + 4
#: Columns of the Sun's velocity in the fast grid, and of its acceleration and potential in the heavy one.
SUN_VELOCITY, AT_SUN = 3 * N_FAST, 10 * N_HEAVY
# Rows and columns of Almanac.when.
_FAST, _SLOW, BELT_GRID, _HEAVY = range(4)
_START, _PER_SECOND, PIECES = range(3)
_NOWHERE = 1e15
#: The polynomials are computed in blocks of this length (s) from the start of the file, a multiple of all intervals.
#: The last blocks are cached, so that windows that overlap share them: those of all grids over 130 years take 33 MB.
_BLOCK = 1024.0 * DAY
_BLOCKS = 192


class Almanac(NamedTuple):
    """Polynomials in ``x = -1...1`` on each interval; the columns of a grid are x of all slots, then y, then z.

    Attributes
    ----------
    when : ndarray, shape (4, 3)
        Per grid: start (s), pieces per second, number of pieces.
    fast : ndarray, shape (pieces, 13, columns)
        Positions (m) of ``FAST``; then the Sun's velocity (m/s) and an unused column.
    slow : ndarray, shape (pieces, 8, columns)
        Positions (m) of ``SLOW``; unused slots are far away.
    belt : ndarray, shape (pieces, 5, columns)
        Positions (m) of the massive asteroids; empty without them.
    heavy : ndarray, shape (pieces, 5, columns)
        Positions (m), velocities (m/s), accelerations (m/s2) of ``HEAVY`` by all other bodies, and the potential
        (m2/s2) of those; then acceleration and potential at the Sun.
    """

    when: Array
    fast: Array
    slow: Array
    belt: Array
    heavy: Array


class Places(NamedTuple):
    """Positions of the bodies at one time: columns as in :class:`Almanac`."""

    fast: Array
    slow: Array
    belt: Array
    heavy: Array


class _Grid(NamedTuple):
    """A grid: row of the ephemeris with its origin, interval (s), degree, bodies, slots, columns."""

    row: int
    length: float
    degree: int
    names: tuple[str, ...]
    slots: int
    columns: int


_GRIDS = (
    _Grid(MOON, 4.0 * DAY, 12, FAST, N_FAST, C_FAST),
    _Grid(SUN, 16.0 * DAY, 7, SLOW, N_SLOW, C_SLOW),
    _Grid(SUN, 32.0 * DAY, 4, BELT, N_BELT, C_BELT),
    _Grid(SUN, 16.0 * DAY, 4, HEAVY, N_HEAVY, C_HEAVY),
)


@lru_cache(maxsize=4)
def almanac(window: Window, belt: bool) -> Almanac:
    """The almanac of a window, with or without the massive asteroids; the last results are cached."""
    grids = [_of_window(window, number, belt or number != BELT_GRID) for number in range(len(_GRIDS))]
    return Almanac(np.array([g[0] for g in grids]), *(g[1] for g in grids))


def _of_window(window: Window, number: int, used: bool) -> tuple[tuple[float, float, float], Array]:
    """Start (s), pieces per second and number of pieces of a grid, and its polynomials (none if not `used`)."""
    grid = _GRIDS[number]
    origin = window.source.origin(grid.row) + from_j2000(window.epoch)
    first = int(np.floor((window.start - origin) / grid.length))
    last = max(int(np.ceil((window.stop - origin) / grid.length)), first + 1)
    start = origin + first * grid.length
    if not used:
        return (start, 1.0 / grid.length, 0.0), np.zeros((0, grid.degree + 1, grid.columns))
    size = round(_BLOCK / grid.length)
    parts = [
        _block(window.source, number, b)[max(first - b * size, 0) : last - b * size]
        for b in range(first // size, (last - 1) // size + 1)
    ]
    return (start, 1.0 / grid.length, float(last - first)), np.concatenate(parts)


@lru_cache(maxsize=_BLOCKS)
def _block(source: Ephemeris, number: int, block: int) -> Array:
    """The polynomials of one grid in one block of time."""
    grid = _GRIDS[number]
    begin = source.origin(grid.row) + block * _BLOCK
    # Times from the start of the block: the polynomials do not depend on the epoch of a window.
    window = source.records(Time(2451545.0, begin / DAY, format="jd", scale="tdb"), 0.0, _BLOCK)
    degree, names, slots = grid.degree, grid.names, grid.slots
    count = round(_BLOCK / grid.length)
    nodes = -np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    times = (grid.length * (np.arange(count)[:, None] + 0.5 * (1.0 + nodes))).ravel()
    order = (*BODIES, *BELT)
    rows = {SUN, *(order.index(name) for name in names)} | ({EARTH, MOON} if "earth" in names else set())
    if names == HEAVY:
        rows = set(range(len(BODIES)))
    head = window.head[sorted(rows)]
    # Times beyond the ends of the ephemeris are never requested: there the pieces are sampled at the ends.
    times = np.clip(times, head[:, 3].max(), (head[:, 3] + head[:, 2] * head[:, 4]).min())
    sample = np.full((times.size, grid.columns), _NOWHERE)
    if names == HEAVY:
        _write_heavy(window, times, sample)
    else:
        for slot, name in enumerate(names):
            sample[:, slot : 3 * slots : slots] = window.states(order.index(name), times)[:, :3]
    if names == FAST:
        sample[:, SUN_VELOCITY : SUN_VELOCITY + 3] = window.states(SUN, times)[:, 3:]
    by_chebyshev = np.linalg.inv(chebyshev.chebvander(nodes, degree)) @ sample.reshape(count, degree + 1, -1)
    powers = np.zeros((degree + 1, degree + 1))
    for n in range(degree + 1):
        powers[: n + 1, n] = chebyshev.cheb2poly(np.eye(degree + 1)[n, : n + 1])
    return np.ascontiguousarray(powers @ by_chebyshev)


def _write_heavy(window: Window, times: Array, out: Array) -> None:
    """Write the columns of ``Almanac.heavy`` at ``times``, shape (n,), into ``out``, a row per time."""
    states = np.array([window.states(b, times) for b in range(len(BODIES))])
    for slot, name in enumerate((*HEAVY, "sun")):
        body = BODIES.index(name)
        others = np.arange(len(BODIES)) != body
        away = states[others, :, :3] - states[body, :, :3]
        r = np.linalg.norm(away, axis=2)
        gm = window.gm[others, None]
        pull, potential = np.sum((gm / r**3)[:, :, None] * away, axis=0), np.sum(gm / r, axis=0)
        if name == "sun":
            out[:, AT_SUN : AT_SUN + 3], out[:, AT_SUN + 3] = pull, potential
            continue
        for block, values in enumerate((states[body, :, :3], states[body, :, 3:], pull)):
            out[:, 3 * N_HEAVY * block + slot : 3 * N_HEAVY * (block + 1) : N_HEAVY] = values
        out[:, 9 * N_HEAVY + slot] = potential


@inlined
def _piece(when: Array, t: float) -> tuple[int, float]:
    """Number of the piece at `t` and the argument -1...1 in it."""
    s = (t - when[_START]) * when[_PER_SECOND]
    i = int(min(max(s, 0.0), when[PIECES] - 1.0))
    return i, 2.0 * (s - i) - 1.0


@inlined
def has_belt(book: Almanac) -> bool:
    """True if the massive asteroids are in the almanac."""
    return book.when[BELT_GRID, PIECES] > 0.0


@inlined
def _cubic(pieces: Array, k: int, step: int, x: float, x2: float) -> Any:
    """Four columns of a polynomial of degree 3, the coefficients of which are at ``k``, ``k + step``, ..."""
    low = lanes_at(pieces, k) + lanes_at(pieces, k + step) * x
    high = lanes_at(pieces, k + 2 * step) + lanes_at(pieces, k + 3 * step) * x
    return low + high * x2


@inlined
def _find_quartic(when: Array, pieces: Array, t: float, p: Array, columns: int) -> None:
    """Write the columns of a grid of degree 4 at `t`."""
    i, x = _piece(when, t)
    x2 = x * x
    x4 = x2 * x2
    for j in range(0, columns, N_LANES):
        k = 5 * columns * i + j
        value = _cubic(pieces, k, columns, x, x2) + lanes_at(pieces, k + 4 * columns) * x4
        put_lanes(p, j, value)


@inlined
def find_places(book: Almanac, t: float, belt: bool, out: Places) -> None:
    """Write the positions of all bodies at ``t`` (s) into ``out``."""
    # Estrin's scheme: its products are independent.
    i, x = _piece(book.when[_FAST], t)
    x2 = x * x
    x4 = x2 * x2
    x8 = x4 * x4
    for j in range(0, C_FAST, N_LANES):
        k = 13 * C_FAST * i + j
        low = _cubic(book.fast, k, C_FAST, x, x2)
        middle = _cubic(book.fast, k + 4 * C_FAST, C_FAST, x, x2)
        high = _cubic(book.fast, k + 8 * C_FAST, C_FAST, x, x2)
        value = low + middle * x4 + (high + lanes_at(book.fast, k + 12 * C_FAST) * x4) * x8
        put_lanes(out.fast, j, value)
    i, x = _piece(book.when[_SLOW], t)
    x2 = x * x
    x4 = x2 * x2
    for j in range(0, C_SLOW, N_LANES):
        k = 8 * C_SLOW * i + j
        low = _cubic(book.slow, k, C_SLOW, x, x2)
        high = _cubic(book.slow, k + 4 * C_SLOW, C_SLOW, x, x2)
        put_lanes(out.slow, j, low + high * x4)
    if belt:
        _find_quartic(book.when[BELT_GRID], book.belt, t, out.belt, C_BELT)


@inlined
def find_heavy(book: Almanac, t: float, out: Places) -> None:
    """Write the quantities of the heavy bodies for 1PN at ``t`` (s) into ``out``."""
    _find_quartic(book.when[_HEAVY], book.heavy, t, out.heavy, C_HEAVY)


@inlined
def gather(places: Places, out: Array) -> None:
    """Write the places of ``BODIES`` into ``out[bodies, 3]``, m."""
    for b in range(N_BODIES):
        s = SLOT[b]
        if GRID[b] == 0:
            out[b, 0], out[b, 1], out[b, 2] = (
                places.fast[s],
                places.fast[N_FAST + s],
                places.fast[2 * N_FAST + s],
            )
        else:
            out[b, 0], out[b, 1], out[b, 2] = (
                places.slow[s],
                places.slow[N_SLOW + s],
                places.slow[2 * N_SLOW + s],
            )
