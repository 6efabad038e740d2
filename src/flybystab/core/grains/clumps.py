"""Clumps of grains in contact or close to it: their bound neighbours, shape and spin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.grains.gravity import potential_at
from flybystab.core.grains.state import Grains
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Grains closer than this times the sum of their radii belong to one clump.
LINK = 1.15


@kernel
def friends_of_friends(g: Grains, link: float, label: NDArray[np.int64]) -> int:
    """Write the number ``label[n]`` of each grain's clump, in the order of their first grains; -1 for lost ones.

    Returns the number of clumps.
    """
    n = g.mass.shape[0]
    label[:] = -1
    stack = np.empty(n, np.int64)
    count = 0
    for start in range(n):
        if label[start] >= 0 or g.mass[start] == 0.0:
            continue
        label[start] = count
        stack[0] = start
        top = 1
        while top > 0:
            top -= 1
            i = stack[top]
            for j in range(n):
                if label[j] < 0 and g.mass[j] > 0.0:
                    reach = link * (g.radius[i] + g.radius[j])
                    d0, d1, d2 = g.x[j, 0] - g.x[i, 0], g.x[j, 1] - g.x[i, 1], g.x[j, 2] - g.x[i, 2]
                    if d0 * d0 + d1 * d1 + d2 * d2 < reach * reach:
                        label[j] = count
                        stack[top] = j
                        top += 1
        count += 1
    return count


def bound_clumps(g: Grains, label: NDArray[np.int64], largest: int) -> NDArray[np.bool_]:
    """True for each clump bound to the largest one, and for that itself; shape (clumps,).

    A clump (or a single grain) is bound if the two-body energy of its centre of mass relative to all bound clumps is
    negative, with the potential of their grains. The test is repeated until no clump is added. The rotation of a clump
    is not included: in a test grain by grain, part of a spinning clump that escapes would count as bound.
    """
    held = label >= 0
    count = int(label.max()) + 1
    mass = np.bincount(label[held], weights=g.mass[held], minlength=count)
    weights = g.mass[held, None]
    x, v = np.zeros((count, 3)), np.zeros((count, 3))
    np.add.at(x, label[held], weights * g.x[held])
    np.add.at(v, label[held], weights * g.v[held])
    x, v = x / mass[:, None], v / mass[:, None]
    bound = np.zeros(count, np.bool_)
    bound[largest] = True
    while True:
        inside = np.zeros(len(label), np.bool_)
        inside[held] = bound[label[held]]
        total = mass[bound].sum()
        velocity = mass[bound] @ v[bound] / total
        rest = np.flatnonzero(~bound)
        potential = potential_at(x[rest], g.x[inside], g.mass[inside])
        energy = 0.5 * ((v[rest] - velocity) ** 2).sum(axis=1) + potential * (1.0 + mass[rest] / total)
        joins = rest[energy < 0.0]
        if len(joins) == 0:
            return bound
        bound[joins] = True


def moments(g: Grains, member: NDArray[np.bool_]) -> tuple[float, Array, Array, Array, Array]:
    """Mass, centre, velocity, inertia tensor and angular momentum of some grains about their centre.

    Inertia and angular momentum include those of each grain about its own centre.
    """
    m, x, v, w, r = g.mass[member], g.x[member], g.v[member], g.w[member], g.radius[member]
    total = float(m.sum())
    centre, velocity = m @ x / total, m @ v / total
    x, v = x - centre, v - velocity
    own = 0.4 * m * r**2
    inertia = (m @ (x**2).sum(axis=1) + own.sum()) * np.eye(3) - (m[:, None] * x).T @ x
    momentum = m @ np.cross(x, v) + own @ w
    return total, centre, velocity, inertia, momentum


def semi_axes(mass: float, inertia: Array) -> tuple[Array, Array]:
    """Semi-axes of the homogeneous ellipsoid with an inertia tensor, longest first, and its axes as columns."""
    values, vectors = np.linalg.eigh(inertia)  # the longest axis has the least moment of inertia
    a2 = 2.5 / mass * (values.sum() - 2.0 * values)
    if np.linalg.det(vectors) < 0.0:
        vectors[:, 2] *= -1.0
    return np.sqrt(np.maximum(a2, 0.0)), vectors


def spin_of(inertia: Array, momentum: Array) -> Array:
    """Angular velocity of the rigid body with an inertia tensor and an angular momentum."""
    return np.asarray(np.linalg.solve(inertia, momentum), dtype=float)
