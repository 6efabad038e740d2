"""Least critical energy and strain over all directions by descent from many starts.

For the cases without a closed form (:mod:`flybystab.core.energy.trust_region`): third order, barrier, and any order on
a yield surface that is not circular.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.energy.perturbation import (
    LONGEST,
    SQRT2,
    Ellipsoid,
    barrier,
    direction,
    powers,
    rate_of_strain,
    second_order,
    third_order,
)
from flybystab.core.energy.potential import MASS
from flybystab.core.material.yield_surface import is_hexagon
from flybystab.core.numerics.jit import code, kernel
from flybystab.core.numerics.tensors import eigensystem
from flybystab.typing import Array

# Flags are numpy's (:func:`flybystab.core.numerics.jit.code`): one compilation serves all orders.

#: Order of the critical energy or strain to be minimised (:func:`level`): barrier, ``-P1/V``, second and third order.
BARRIER, YIELD, SECOND, THIRD = (code(i) for i in range(4))
ENERGY, STRAIN = code(0), code(1)

#: Angles of a lattice of starting points, and number of starting points from which a descent begins.
COARSE, MEDIUM, DENSE = code(6), code(12), code(24)
THREE, FOUR = code(3), code(4)

#: The minimum is not refined by `polish`.
ROUGH: bool = np.bool_(False)  # type: ignore[assignment]

#: Largest number of sweeps over the coordinates in a descent.
MOST_SWEEPS = 60

#: Largest number of moves of one simplex.
MOST_TURNS = 200


@kernel
def level(b: Ellipsoid, x: Array, order: int, enough: float) -> tuple[float, float]:
    """Critical energy and strain of one direction at an order: 2, 3, or 0 for the barrier (known up to `enough`).

    Order 1 is ``-P1/V`` (twice): its least value is the distance of the stress from the yield surface.
    """
    if order == BARRIER:
        return barrier(b, x, LONGEST, enough)
    p1, p2, p3 = powers(b, x)
    if order == YIELD:
        return -p1 / MASS, -p1 / MASS
    if order == SECOND:
        return second_order(p1, p2)
    return third_order(p1, p2, p3)


@kernel
def _clip(x: Array, ball: bool) -> None:
    r = np.sqrt(np.sum(x * x))
    if not ball or r > 1.0:
        x /= r


@kernel
def descent(b: Ellipsoid, x: Array, order: int, which: int, step: float, smallest: float) -> float:
    """Minimise the critical energy (or strain) over directions by pattern search from ``x[5]``, which it moves."""
    ball = b.associative and b.sin > 0.0
    limit = np.inf
    best = level(b, x, order, limit)[which]
    trial = np.empty(5)
    last = np.zeros(5)
    for _ in range(MOST_SWEEPS):
        if step <= smallest or best <= 0.0:
            break
        before = best
        # A bound on the strain at the barrier is no bound on the energy.
        limit = np.inf if which == STRAIN else best
        start = x.copy()
        for i in range(5):
            for sign in (1.0, -1.0):
                trial[:] = x
                trial[i] += sign * step
                _clip(trial, ball)
                value = level(b, trial, order, limit)[which]
                if value < best:
                    best = value
                    x[:] = trial
                    break
        if best < before:  # pattern move: continue along the displacement of the sweep
            last[:] = x - start
            for _ in range(4):
                trial[:] = x + last
                _clip(trial, ball)
                value = level(b, trial, order, limit)[which]
                if value >= best:
                    break
                best = value
                x[:] = trial
                last *= 2.0
        if before - best <= 1e-4 * abs(best):
            step *= 0.4
    return best


@kernel
def _on_face(b: Ellipsoid, turn: Array, axes: Array, x: Array) -> None:
    """Write the unit normal ``x[5]`` to the Mohr-Coulomb face whose principal axes are `axes` turned by ``turn[3]``.

    ``f = (sigma_1 - sigma_3) + (sigma_1 + sigma_3) sin(phi)``. The columns of `axes` go from least to greatest.
    """
    q = np.sqrt(1.0 + np.sum(turn[:3] * turn[:3]))
    w, u, v, r = 1.0 / q, turn[0] / q, turn[1] / q, turn[2] / q
    rotation = np.array(
        [
            [1.0 - 2.0 * (v * v + r * r), 2.0 * (u * v - w * r), 2.0 * (u * r + w * v)],
            [2.0 * (u * v + w * r), 1.0 - 2.0 * (u * u + r * r), 2.0 * (v * r - w * u)],
            [2.0 * (u * r - w * v), 2.0 * (v * r + w * u), 1.0 - 2.0 * (u * u + v * v)],
        ]
    )
    turned = rotation @ axes
    most, least_ = 1.0 + b.sin, -(1.0 - b.sin)
    d = np.empty(6)
    for i in range(3):
        d[i] = most * turned[i, 2] ** 2 + least_ * turned[i, 0] ** 2
    d[3] = most * turned[0, 2] * turned[1, 2] + least_ * turned[0, 0] * turned[1, 0]
    d[4] = most * turned[0, 2] * turned[2, 2] + least_ * turned[0, 0] * turned[2, 0]
    d[5] = most * turned[1, 2] * turned[2, 2] + least_ * turned[1, 0] * turned[2, 0]
    direction(d, x)
    x /= np.sqrt(np.sum(x * x))


@kernel
def _principal(x: Array, axes: Array) -> None:
    """Write the principal axes of a direction as columns, from least to greatest rate of strain."""
    d = np.empty(6)
    rate_of_strain(x, 0.0, d)
    values = np.empty(3)
    vectors = np.empty((3, 3))
    eigensystem(d, values, vectors)
    rank = np.argsort(values)
    for j in range(3):
        axes[:, j] = vectors[:, rank[j]]


class Simplex(NamedTuple):
    """Corners ``[n + 1, n]`` of a simplex, the values there, and the objective.

    Three coordinates are rotations of the principal `axes` of the normal to a Mohr-Coulomb face (:func:`_on_face`);
    five are the direction itself.
    """

    corners: Array
    values: Array
    axes: Array
    order: int
    which: int


@kernel
def _corner(b: Ellipsoid, v: Array, s: Simplex, y: Array) -> float:
    """Value at the point ``v`` of a simplex, projected into the ball; writes its direction ``y[5]``."""
    if v.size == 3:
        _on_face(b, v, s.axes, y)
    else:
        _clip(v, b.associative and b.sin > 0.0)
        y[:] = v
    return level(b, y, s.order, np.inf)[s.which]


@kernel
def _set_up(b: Ellipsoid, s: Simplex, size: float, best: float, on_face: bool, y: Array) -> None:
    """Set up a simplex of a size about the direction ``y[5]``, which has the value `best`; ``y`` is overwritten."""
    s.corners[:] = 0.0
    if on_face:
        _principal(y, s.axes)
    else:
        s.corners[:] = y
    s.values[0] = best
    for i in range(s.corners.shape[1]):
        s.corners[i + 1, i] += size if s.corners[i + 1, i] <= 0.0 else -size
        s.values[i + 1] = _corner(b, s.corners[i + 1], s, y)


@kernel
def _contract(b: Ellipsoid, s: Simplex, low: int, y: Array) -> None:
    """Halve the distances of all corners from the lowest."""
    for i in range(s.values.size):
        if i != low:
            s.corners[i] = 0.5 * (s.corners[i] + s.corners[low])
            s.values[i] = _corner(b, s.corners[i], s, y)


@kernel
def _turn(b: Ellipsoid, s: Simplex, centre: Array, trial: Array, other: Array, y: Array) -> bool:
    """One step of Nelder & Mead (1965): reflection, expansion, contraction; False once the simplex has converged.

    `centre`, `trial`, `other` and ``y[5]`` are scratch.
    """
    n = centre.size
    rank = np.argsort(s.values)
    low, high, second = rank[0], rank[n], rank[n - 1]
    if s.values[high] - s.values[low] <= 1e-9 * s.values[low]:
        return False
    for i in range(n):
        centre[i] = (np.sum(s.corners[:, i]) - s.corners[high, i]) / n
    trial[:] = 2.0 * centre - s.corners[high]
    value = _corner(b, trial, s, y)
    if value < s.values[low]:
        other[:] = 3.0 * centre - 2.0 * s.corners[high]
        farther = _corner(b, other, s, y)
        if farther < value:
            value = farther
            trial[:] = other
    elif value >= s.values[second]:
        inside = 0.5 if value < s.values[high] else -0.5
        other[:] = centre + inside * (centre - s.corners[high])
        nearer = _corner(b, other, s, y)
        if nearer >= min(value, s.values[high]):
            _contract(b, s, low, y)
            return True
        value = nearer
        trial[:] = other
    s.corners[high] = trial
    s.values[high] = value
    return True


@kernel
def polish(
    b: Ellipsoid, x: Array, order: int, which: int, size: float, smallest: float, on_face: bool
) -> float:
    """Minimise the critical energy (or strain) from ``x[5]``, which is overwritten, by simplices (Nelder & Mead 1965).

    A simplex can follow narrow, curved valleys that are not along a coordinate, where a pattern search stops. It is
    restarted with a smaller size until a round no longer lowers the value. With `on_face` the search is restricted to
    the normals of the Mohr-Coulomb faces: there the dissipation of associative flow, the maximum of two linear
    functions of the largest and the least principal rate, has a kink, at which minima lie.
    """
    n = 3 if on_face else 5
    s = Simplex(np.empty((n + 1, n)), np.empty(n + 1), np.empty((3, 3)), order, which)
    centre, trial, other = np.empty(n), np.empty(n), np.empty(n)
    y = x.copy()
    if on_face:
        _principal(x, s.axes)
        _on_face(b, np.zeros(3), s.axes, y)
    best = level(b, y, order, np.inf)[which]
    while size > smallest and 0.0 < best < np.inf:
        before = best
        _set_up(b, s, size, best, on_face, y)
        for _ in range(MOST_TURNS):
            if not _turn(b, s, centre, trial, other, y):
                break
        best = _corner(b, s.corners[np.argmin(s.values)], s, y)
        if before - best <= 1e-6 * before:
            size *= 0.1
    x[:] = y
    return best


@kernel
def starts(n_angles: int, ball: bool) -> Array:
    """Starting directions: circles through the diagonal deviators and each shear; with `ball` also points inside it."""
    out = np.zeros((n_angles * 7 + 7, 5))
    n = 0
    for i in range(n_angles):
        chi = 2.0 * np.pi * i / n_angles
        out[n, 0] = np.cos(chi)
        out[n, 1] = np.sin(chi)
        n += 1
        for shear in range(2, 5):
            for sign in (1.0, -1.0):
                out[n, 0] = np.cos(chi) / SQRT2
                out[n, 1] = np.sin(chi) / SQRT2
                out[n, shear] = sign / SQRT2
                n += 1
    for shear in range(2, 5):
        for sign in (1.0, -1.0):
            out[n, shear] = sign
            n += 1
    if ball:
        n += 1  # the centre: pure dilation
    return out[:n]


@kernel
def least(
    b: Ellipsoid,
    order: int,
    which: int,
    seeds: Array,
    n_angles: int,
    tries: int,
    smallest: float,
    fine: bool,
    x: Array,
) -> tuple[float, float]:
    """Least critical energy (or strain) at an order, with its strain (or energy); writes the direction ``x[5]``.

    A descent starts from each of the best `tries` points of the `seeds` and of a lattice of directions; with `fine` the
    best result is refined by `polish`.
    """
    ball = b.associative and b.sin > 0.0
    edged = ball and is_hexagon(b.code)
    lattice = starts(n_angles, ball)
    n = seeds.shape[0] + lattice.shape[0]
    values = np.empty(n)
    enough = np.inf
    for i in range(n):
        y = seeds[i] if i < seeds.shape[0] else lattice[i - seeds.shape[0]]
        values[i] = level(b, y, order, enough)[which]
        if which == ENERGY:
            enough = min(enough, 2.0 * values[i])
    best = np.inf
    rank = np.argsort(values)
    x[:] = lattice[0]
    trial = np.empty(5)
    for r in range(min(tries, n)):
        i = rank[r]
        if not values[i] < np.inf:
            break
        trial[:] = seeds[i] if i < seeds.shape[0] else lattice[i - seeds.shape[0]]
        value = descent(b, trial, order, which, 0.2, smallest)
        if value < best:
            best = value
            x[:] = trial
    if best == np.inf:
        return np.inf, np.inf
    for face in range(2):
        if fine if face == 0 else edged:
            trial[:] = x
            value = polish(b, trial, order, which, 0.1, 3e-4, face == 1)
            if value < best:
                best = value
                x[:] = trial
    return best, level(b, x, order, np.inf)[1 - which]
