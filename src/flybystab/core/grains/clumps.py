"""Clumps of grains: which touch or nearly so, what is bound to them, their shape and spin."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.grains.state import Grains
from flybystab.core.numerics.jit import kernel

Array = NDArray[np.float64]

#: Grains nearer than this many sums of their radii belong to one clump.
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


@kernel
def bound_to(g: Grains, member: NDArray[np.bool_]) -> None:
    """Add to `member` the grains that are bound to it, until there are no more.

    A grain is bound if its energy in the frame of the members' centre of mass, with the potential of the members, is
    negative; members that are not bound any more do not leave.
    """
    n = g.mass.shape[0]
    while True:
        total = 0.0
        c = np.zeros(3)
        v = np.zeros(3)
        for i in range(n):
            if member[i]:
                total += g.mass[i]
                for k in range(3):
                    c[k] += g.mass[i] * g.x[i, k]
                    v[k] += g.mass[i] * g.v[i, k]
        if total == 0.0:
            return
        for k in range(3):
            v[k] /= total
        fresh = np.zeros(n, np.bool_)
        grown = False
        for i in range(n):
            if member[i] or g.mass[i] == 0.0:
                continue
            e = 0.5 * ((g.v[i, 0] - v[0]) ** 2 + (g.v[i, 1] - v[1]) ** 2 + (g.v[i, 2] - v[2]) ** 2)
            for j in range(n):
                if member[j]:
                    d0, d1, d2 = g.x[j, 0] - g.x[i, 0], g.x[j, 1] - g.x[i, 1], g.x[j, 2] - g.x[i, 2]
                    e -= g.mass[j] / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
            if e < 0.0:
                fresh[i] = True
                grown = True
        if not grown:
            return
        for i in range(n):
            if fresh[i]:
                member[i] = True


def moments(g: Grains, member: NDArray[np.bool_]) -> tuple[float, Array, Array, Array, Array]:
    """Mass, centre, velocity, inertia tensor and angular momentum of some grains about their centre.

    Inertia and angular momentum contain the grains' own.
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
    return np.linalg.solve(inertia, momentum)
