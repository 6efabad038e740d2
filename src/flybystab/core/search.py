"""Least critical energy and strain over all directions by descent from many starts.

For what :mod:`flybystab.core.certified` cannot do in closed form: third order, barrier, and any order on a yield
surface that is not circular.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.energy import MASS
from flybystab.core.jit import kernel
from flybystab.core.push import LONGEST, SQRT2, Pile, barrier, powers, second_order, third_order
from flybystab.core.rheology import MOHR_COULOMB

Array = NDArray[np.float64]

#: Sweeps over the coordinates after which a descent ends where it is.
MOST_SWEEPS = 60


@kernel
def level(b: Pile, x: Array, order: int, enough: float) -> tuple[float, float]:
    """Critical energy and strain of one direction at an order: 2, 3, or 0 for the barrier (known up to `enough`).

    Order 1 is ``-P1/V`` (twice): its least value is the distance of the stress from the yield surface.
    """
    if order == 0:
        return barrier(b, x, LONGEST, enough)
    p1, p2, p3 = powers(b, x)
    if order == 1:
        return -p1 / MASS, -p1 / MASS
    if order == 2:
        return second_order(p1, p2)
    return third_order(p1, p2, p3)


@kernel
def _clip(x: Array, ball: bool) -> None:
    r = np.sqrt(np.sum(x * x))
    if not ball or r > 1.0:
        x /= r


@kernel
def descent(b: Pile, x: Array, order: int, by_strain: bool, step: float, smallest: float) -> float:
    """Minimise the critical energy (or strain) over directions by pattern search from ``x[5]``, which it moves."""
    which = 1 if by_strain else 0
    ball = b.associative and b.sin > 0.0
    edged = b.associative and b.code == MOHR_COULOMB
    limit = np.inf
    best = level(b, x, order, limit)[which]
    trial = np.empty(5)
    last = np.zeros(5)
    for _ in range(MOST_SWEEPS):
        if step <= smallest or best <= 0.0:
            break
        before = best
        # the strain at a barrier does not bound the energy
        limit = np.inf if by_strain else best
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
        if edged and best >= before:  # on an edge of the yield surface no coordinate may lead down
            for i in range(5):
                for j in range(i + 1, 5):
                    for sign in range(4):
                        trial[:] = x
                        trial[i] += (step if sign < 2 else -step) / SQRT2
                        trial[j] += (step if sign % 2 else -step) / SQRT2
                        _clip(trial, ball)
                        value = level(b, trial, order, limit)[which]
                        if value < best:
                            best = value
                            x[:] = trial
        if best < before:  # go on in the direction that the sweep has found
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
def starts(n_angles: int, ball: bool) -> Array:
    """Directions that cover the deviators: circles through the diagonal ones and each shear; and inside the ball."""
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
    b: Pile, order: int, by_strain: bool, seeds: Array, n_angles: int, tries: int, smallest: float, x: Array
) -> tuple[float, float]:
    """Least critical energy (or strain) at an order, with its strain (or energy); writes the direction ``x[5]``.

    The best `tries` of the `seeds` and of a lattice of directions each start a descent.
    """
    which = 1 if by_strain else 0
    ball = b.associative and b.sin > 0.0
    lattice = starts(n_angles, ball)
    n = seeds.shape[0] + lattice.shape[0]
    values = np.empty(n)
    enough = np.inf
    for i in range(n):
        y = seeds[i] if i < seeds.shape[0] else lattice[i - seeds.shape[0]]
        values[i] = level(b, y, order, enough)[which]
        if not by_strain:
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
        value = descent(b, trial, order, by_strain, 0.2, smallest)
        if value < best:
            best = value
            x[:] = trial
    if best == np.inf:
        return np.inf, np.inf
    return best, level(b, x, order, np.inf)[1 - which]
