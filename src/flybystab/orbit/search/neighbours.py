"""What the deviations of orbits become until their encounters: one integration for each direction of phase space."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray

from flybystab.constants import DAY, YEAR
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.threads import in_order
from flybystab.orbit.covariance import PUSHES
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.ephemeris import SUN, Window
from flybystab.orbit.forces import RADIATION_PRESSURE
from flybystab.orbit.kepler import two_body
from flybystab.orbit.orbit import seconds
from flybystab.orbit.planets import planet
from flybystab.orbit.predictability import Deviations, predictability, undisturbed_error
from flybystab.orbit.search.acceleration import Field, borrowed_field, first_rate
from flybystab.orbit.search.dop853 import Room, advance, borrowed_room, empty_room
from flybystab.typing import Array

#: Matrices that find the passages: differences (m), their tolerance, and the longest interval, s.
_STEP, _LOOSE, _INTERVAL = 1e4, 1e-10, 0.25 * YEAR
#: Differences (m) and tolerance of the growth since a passage.
_FINE_STEP, _FINE = 1e3, 1e-12
#: Factor beyond two-body motion by which errors grow in an interval with a passage.
AMPLIFIED = 2.0


@kernel
def carry(
    field: Field, law: Array, t0: float, y0: Array, times: Array, tolerance: float, room: Room, out: Array
) -> int:
    """Write barycentric states (m, m/s) at ``times`` (s), in order away from ``t0``, into ``out[n, 6]``.

    Steps as in :func:`flybystab.orbit.search.track.track_encounters`. Returns the number written.
    """
    field = borrowed_field(field)
    k, places = borrowed_room(room)
    y = y0.copy()
    new = np.empty(6)
    h = DAY
    t = t0
    first_rate(field, law, t, y, places, k[0])
    for n in range(times.size):
        while t != times[n]:
            t, h = advance(field, law, t, y, h, times[n], tolerance, k, new, places)
            if t != t:  # the step size collapsed
                return n
            y[:] = new
            k[0] = k[12]
        out[n] = y
    return times.size


@kernel
def transitions(
    field: Field,
    law: Array,
    times: Array,
    states: Array,
    steps: Array,
    tolerance: float,
    room: Room,
    out: Array,
) -> None:
    """State transition matrices of the intervals between ``times`` (s) into ``out[n - 1, 6, 6]``.

    ``states`` (m, m/s) is the orbit at the times, ``steps`` (n, 6) the differences; both sides of a matrix count in
    those of the beginning of its interval.
    """
    moved = np.empty((1, 6))
    end = np.empty(1)
    y = np.empty(6)
    for n in range(times.size - 1):
        end[0] = times[n + 1]
        for j in range(6):
            y[:] = states[n]
            y[j] += steps[n, j]
            if carry(field, law, times[n], y, end, tolerance, room, moved) == 1:
                for i in range(6):
                    out[n, i, j] = (moved[0, i] - states[n + 1, i]) / steps[n, i]


@kernel
def quiet_growth(state: Array, t: float) -> float:
    """Frobenius norm of the state transition matrix of two-body motion from a heliocentric state (m, m/s) over `t` s.

    Velocities count as m by the angular velocity v/r of the state.
    """
    speed = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2)
    per = speed / np.sqrt(state[0] ** 2 + state[1] ** 2 + state[2] ** 2)
    there = two_body(GM_SUN, state, t)
    total = 0.0
    moved = state.copy()
    for j in range(6):
        moved[j] = state[j] + (_STEP if j < 3 else _STEP * per)
        other = two_body(GM_SUN, moved, t)
        moved[j] = state[j]
        for i in range(6):
            total += ((other[i] - there[i]) / (_STEP if i < 3 else _STEP * per)) ** 2
    return np.sqrt(total)


@dataclass(frozen=True)
class Spread:
    """Errors of an orbit at times of encounters, each of shape (n,).

    Attributes
    ----------
    displacement : ndarray
        One sigma in the direction least known, m; inf where a displaced orbit could not be followed.
    growth : ndarray
        That over the displacement at the epoch of the covariance.
    model_error : ndarray
        Displacement by ephemeris, masses, tolerance and forces left out, m, grown past the passages on the way.
    passed : ndarray of bool
        Whether there is such a passage.
    """

    displacement: Array
    growth: Array
    model_error: Array
    passed: NDArray[np.bool_]


def spread(
    beside: Deviations, field: Field, law: Array, window: Window, times: Array, tolerance: float
) -> Spread:
    """Follow the sigma points of an orbit to `times` (s from the epoch of the window) with all forces of `field`.

    The displacement is the square root of the largest eigenvalue of the second moment of the points about the orbit: in
    the linear regime that of the covariance of the position. The error of the model before each
    passage on the way grows as the mean of displacements along the axes of phase space.

    Parameters
    ----------
    beside : Deviations
    field, law : Field, ndarray (10,)
        Forces, and :attr:`flybystab.orbit.forces.NonGravitational.row`.
    window : Window
    times : ndarray, shape (n,)
    tolerance : float
        Of a step.
    """
    start = seconds(beside.orbit.epoch, window.epoch)
    state = beside.orbit.barycentric(window)
    law = law.copy()
    if not law.any():  # no non-gravitational acceleration, but its parameters can have errors
        law[:] = beside.orbit.nongrav.row
    points = beside.states.reshape(-1, 6), beside.pushes.reshape(-1, len(PUSHES))

    def follow(deviation: Array, more: Array, at: Array) -> Array:
        out = np.full((at.size, 6), np.nan)
        its = law.copy()
        its[:3] += more[:3]
        its[8] += more[3]
        its[9] += RADIATION_PRESSURE * more[4]
        carry(field, its, start, state + deviation, at, tolerance, empty_room(), out)
        return out

    displacement = np.full(times.size, np.inf)
    model_error = np.full(times.size, np.inf)
    for side in (times >= start, times < start):
        rows = np.flatnonzero(side)
        if not rows.size:
            continue
        far = times[rows[np.argmax(np.abs(times[rows] - start))]]
        # Times that do not depend on the farthest one, so that neither does the error of the model.
        regular = start + np.sign(far - start) * np.arange(0.0, abs(far - start), _INTERVAL)
        grid = np.unique(np.concatenate([[start], regular, times[rows]]))
        grid = grid if far >= start else grid[::-1]
        at = np.searchsorted(np.abs(grid - start), np.abs(times[rows] - start))
        base = follow(np.zeros(6), np.zeros(len(PUSHES)), grid)
        gaps = np.array([follow(*point, grid[at])[:, :3] for point in zip(*points, strict=True)])
        displacement[rows] = _largest(gaps - base[at, :3])
        helio = base - window.states(SUN, grid)
        model_error[rows] = _grown_error(field, law, window, grid, base, helio, at)
    displacement *= beside.scale
    shift = beside.scale * float(_largest(points[0][:, None, :3])[0])
    passed = model_error > undisturbed_error(times - start)
    return Spread(displacement, displacement / max(shift, 1.0), model_error, passed)


def _largest(gaps: Array) -> Array:
    """Largest principal displacement, shape (n,), of pairs of points, shape (2 k, n, 3); inf where one was lost."""
    pairs = np.transpose(gaps, (1, 0, 2))
    out = np.full(len(pairs), np.inf)
    for k, points in enumerate(pairs):
        if np.isfinite(points).all():
            out[k] = np.linalg.norm(points, 2) / np.sqrt(2.0)
    return out


def _grown_error(
    field: Field,
    law: Array,
    window: Window,
    grid: Array,
    base: Array,
    helio: Array,
    at: NDArray[np.intp],
) -> Array:
    """Error of the force model, m, at ``grid[at]``: the largest of what it was before a passage, grown since.

    A passage is an interval of the grid whose state transition matrix is larger than that of two-body motion by a
    factor of :data:`AMPLIFIED`. `base` holds the barycentric states of the orbit, `helio` the heliocentric ones.
    """
    out = undisturbed_error(grid[at] - grid[0])
    per = np.linalg.norm(helio[:, 3:], axis=1) / np.linalg.norm(helio[:, :3], axis=1)
    units = np.concatenate([np.ones((len(per), 3)), np.repeat(per[:, None], 3, axis=1)], axis=1)
    change = np.full((grid.size - 1, 6, 6), np.nan)
    transitions(field, law, grid, base, _STEP * units, _LOOSE, empty_room(), change)
    for i, matrix in enumerate(change):
        quiet = quiet_growth(helio[i], grid[i + 1] - grid[i])
        if np.linalg.norm(matrix) < AMPLIFIED * quiet:
            continue
        # From just before the passage directly: the product of many matrices would multiply their errors.
        t, state = _before_passage(field, law, window, grid[i], grid[i + 1], base[i])
        sun = state - window.states(SUN, np.array([t]))[0]
        per_here = np.linalg.norm(sun[3:]) / np.linalg.norm(sun[:3])
        later = at > i
        gaps = np.full((7, int(later.sum()), 6), np.nan)
        steps = np.diag(_FINE_STEP * np.array([1.0, 1.0, 1.0, per_here, per_here, per_here]))
        for j, step in enumerate([np.zeros(6), *steps]):
            carry(field, law, t, state + step, grid[at[later]], _FINE, empty_room(), gaps[j])
        # In the mean over directions in phase space.
        growth = np.linalg.norm((gaps[1:] - gaps[0])[:, :, :3], axis=(0, 2)) / _FINE_STEP / np.sqrt(6.0)
        growth[~np.isfinite(growth)] = np.inf
        out[later] = np.maximum(out[later], undisturbed_error(t - grid[0]) * growth)
    return out


def _before_passage(
    field: Field, law: Array, window: Window, begin: float, end: float, state: Array
) -> tuple[float, Array]:
    """Time (s) and state in an interval with a passage, before it: where the pull of a planet is largest."""
    times = np.linspace(begin, end, 65)
    states = np.full((times.size, 6), np.nan)
    carry(field, law, begin, state, times, _LOOSE, empty_room(), states)
    pull = np.zeros(times.size)
    for body, gm in enumerate(window.gm):
        if body != SUN:
            away = states[:, :3] - window.states(body, times)[:, :3]
            pull = np.maximum(pull, gm / np.sum(away**2, axis=1))
    before = max(int(np.nanargmax(pull)) - 1, 0)
    return float(times[before]), states[before]


def add_growth(
    table: QTable,
    times: Array,
    beside: Mapping[int, Deviations],
    laws: Array,
    window: Window,
    field_of: Callable[[int], Field],
    tolerances: Array,
    threads: int,
) -> None:
    """Add to a table of encounters ``displacement``, ``model_error`` (km), ``growth`` and ``predictability``.

    Displacement: :class:`Spread`, at closest approach or, of an impact, at the entry. Growth: displacement over
    that at the epoch. Model error: what ephemeris, tolerance and forces left out make.

    Parameters
    ----------
    table : QTable
        From :func:`flybystab.find_encounters`.
    times : ndarray
        Of the rows: closest approach, or entry of an impact, s from the epoch of the window.
    beside : mapping
        Deviations by number of the asteroid, of each that the table has.
    laws : ndarray, shape (n, 10)
        Non-gravitational law of each asteroid, :attr:`flybystab.orbit.forces.NonGravitational.row`.
    window, tolerances
        Of the search.
    field_of : callable
        Number of an asteroid to the forces that it was given.
    """
    index = np.asarray(table["index"])
    out = np.full((3, len(table)), np.nan)

    def one(i: int) -> None:
        rows = np.flatnonzero(index == i)
        found = spread(beside[i], field_of(i), laws[i], window, times[rows], tolerances[i])
        out[:, rows] = found.displacement, found.growth, found.model_error

    for _ in in_order(one, np.unique(index).tolist(), threads):
        pass
    scale = np.array([planet(name).impact_distance for name in table["planet"]])
    size = np.maximum(table["distance"].to_value(u.m), np.where(table["impact"], scale, 0.0))
    table["displacement"] = (out[0] * u.m).to(u.km)
    table["growth"] = out[1]
    table["model_error"] = (out[2] * u.m).to(u.km)
    table["predictability"] = np.array(
        [
            str(predictability(d, x, m, known=beside[i].known))
            for d, x, m, i in zip(size, out[0], out[2], index.tolist(), strict=True)
        ],
        dtype="U12",
    )
    table.meta["neighbours"] = sorted({n.label for n in beside.values()})
