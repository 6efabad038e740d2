"""Neighbour lists: pairs of grains that may touch, with the history of their contacts.

The list holds every pair closer than the sum of the radii plus a skin. It is rebuilt, from a hashed grid of cells, when
a grain has moved by a given fraction of the skin relative to a rigid rotation, which changes no distance, at the spin
of the pile when the list was built. The contact history is copied to the new list.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.grains.state import Grains
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

Index = NDArray[np.int64]

#: History of a contact: tangential spring (3), rolling spring (3), twist.
N_SPRING = 7
#: Skin, in mean radii.
SKIN = 0.15
#: Fraction of the skin that a grain may move before the list is rebuilt; a pair approaches by up to twice this.
MOVED = 0.45


class Pairs(NamedTuple):
    """Half neighbour list in compressed rows, and scratch to rebuild it.

    Attributes
    ----------
    first : ndarray (n + 1,)
        Index in `other` of the first neighbour ``j > i`` of grain ``i``.
    other : ndarray (capacity,)
        Neighbours.
    spring : ndarray (capacity, 7)
        History; zero for pairs apart.
    touching : ndarray (capacity,)
        True for a pair in contact at the last step.
    constant : ndarray (capacity, 2)
        Patch radius ``beta R`` and square root of the reduced mass.
    origin : ndarray (n, 3)
        Positions when the list was built.
    """

    first: Index
    other: Index
    spring: Array
    touching: NDArray[np.bool_]
    constant: Array
    origin: Array
    old_first: Index
    old_other: Index
    old_spring: Array
    old_touching: NDArray[np.bool_]
    cell: Index
    head: Index
    following: Index


def empty_pairs(n: int, per_grain: int = 40) -> Pairs:
    """An empty list for n grains, with room for `per_grain` pairs each."""
    room = max(1, per_grain * n)
    table = 1 << int(np.ceil(np.log2(max(2 * n, 16))))
    return Pairs(
        np.zeros(n + 1, np.int64),
        np.zeros(room, np.int64),
        np.zeros((room, N_SPRING)),
        np.zeros(room, np.bool_),
        np.zeros((room, 2)),
        np.zeros((n, 3)),
        np.zeros(n + 1, np.int64),
        np.zeros(room, np.int64),
        np.zeros((room, N_SPRING)),
        np.zeros(room, np.bool_),
        np.zeros((n, 3), np.int64),
        np.zeros(table, np.int64),
        np.zeros(n, np.int64),
    )


@kernel
def _slot(a: int, b: int, c: int, size: int) -> int:
    """Place of a cell in a table of `size`, a power of two."""
    return (a * 73856093 ^ b * 19349663 ^ c * 83492791) & (size - 1)


@kernel
def find_pairs(g: Grains, beta: float, skin: float, p: Pairs) -> bool:
    """Rebuild the list, with the history of pairs that were in it before; False if its capacity is exceeded."""
    n = g.radius.shape[0]
    last = p.first[n]
    p.old_first[:] = p.first
    p.old_other[:last] = p.other[:last]
    p.old_spring[:last] = p.spring[:last]
    p.old_touching[:last] = p.touching[:last]
    largest = 0.0
    for i in range(n):
        if g.mass[i] > 0.0:
            largest = max(largest, g.radius[i])
    width = 2.0 * largest + skin
    size = p.head.shape[0]
    p.head[:] = -1
    for i in range(n - 1, -1, -1):
        for k in range(3):
            p.origin[i, k] = g.x[i, k]
            p.cell[i, k] = int(np.floor(g.x[i, k] / width))
        if g.mass[i] > 0.0:
            s = _slot(p.cell[i, 0], p.cell[i, 1], p.cell[i, 2], size)
            p.following[i] = p.head[s]
            p.head[s] = i
    count = 0
    room = p.other.shape[0]
    for i in range(n):
        p.first[i] = count
        if g.mass[i] == 0.0:
            continue
        for da in range(-1, 2):
            for db in range(-1, 2):
                for dc in range(-1, 2):
                    a, b, c = p.cell[i, 0] + da, p.cell[i, 1] + db, p.cell[i, 2] + dc
                    j = p.head[_slot(a, b, c, size)]
                    while j >= 0:
                        # several cells may share a place in the table
                        if j > i and p.cell[j, 0] == a and p.cell[j, 1] == b and p.cell[j, 2] == c:
                            reach = g.radius[i] + g.radius[j] + skin
                            d0 = g.x[j, 0] - g.x[i, 0]
                            d1 = g.x[j, 1] - g.x[i, 1]
                            d2 = g.x[j, 2] - g.x[i, 2]
                            if d0 * d0 + d1 * d1 + d2 * d2 < reach * reach:
                                if count == room:
                                    return False
                                _add(g, beta, p, i, j, count)
                                count += 1
                        j = p.following[j]
    p.first[n] = count
    return True


@kernel
def _add(g: Grains, beta: float, p: Pairs, i: int, j: int, at: int) -> None:
    """Write a pair at the position `at` of the list, with its history if it has one."""
    p.other[at] = j
    p.constant[at, 0] = beta * g.radius[i] * g.radius[j] / (g.radius[i] + g.radius[j])
    p.constant[at, 1] = np.sqrt(g.mass[i] * g.mass[j] / (g.mass[i] + g.mass[j]))
    p.touching[at] = False
    for k in range(N_SPRING):
        p.spring[at, k] = 0.0
    for old in range(p.old_first[i], p.old_first[i + 1]):
        if p.old_other[old] == j:
            if p.old_touching[old]:
                p.touching[at] = True
                for k in range(N_SPRING):
                    p.spring[at, k] = p.old_spring[old, k]
            return
