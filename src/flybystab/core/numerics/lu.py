"""LU factors of small matrices in place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def factorise(a: Array, n: int, pivots: NDArray[np.int64]) -> bool:
    """LU factors of ``a[n, n]`` in place with partial pivoting; False if singular."""
    for c in range(n):
        p = c
        big = abs(a[c, c])
        for i in range(c + 1, n):
            if abs(a[i, c]) > big:
                big = abs(a[i, c])
                p = i
        pivots[c] = p
        if not big > 0.0:
            return False
        if p != c:
            for j in range(n):
                a[c, j], a[p, j] = a[p, j], a[c, j]
        inv = 1.0 / a[c, c]
        for i in range(c + 1, n):
            m = a[i, c] * inv
            a[i, c] = m
            if m != 0.0:
                for j in range(c + 1, n):
                    a[i, j] -= m * a[c, j]
    return True


@kernel
def solve(a: Array, n: int, pivots: NDArray[np.int64], b: Array) -> None:
    """Solve ``a x = b`` in place from `factorise`."""
    for c in range(n):
        p = pivots[c]
        if p != c:
            b[c], b[p] = b[p], b[c]
    for i in range(1, n):
        total = b[i]
        for j in range(i):
            total -= a[i, j] * b[j]
        b[i] = total
    for i in range(n - 1, -1, -1):
        total = b[i]
        for j in range(i + 1, n):
            total -= a[i, j] * b[j]
        b[i] = total / a[i, i]
