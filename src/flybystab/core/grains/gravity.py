"""Self-gravity of grains: the direct sum."""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel, summing_kernel
from flybystab.typing import Array


@summing_kernel
def _row(
    i: int, px: Array, py: Array, pz: Array, m: Array, ax: Array, ay: Array, az: Array
) -> tuple[float, float, float]:
    """Acceleration of grain `i` by the grains after it; those of these by `i` are added to ``ax, ay, az``."""
    x, y, z, mi = px[i], py[i], pz[i], m[i]
    sx = sy = sz = 0.0
    for j in range(np.uint64(i + 1), np.uint64(px.shape[0])):
        dx, dy, dz = px[j] - x, py[j] - y, pz[j] - z
        r2 = dx * dx + dy * dy + dz * dz
        c = 1.0 / (r2 * np.sqrt(r2))
        cj, ci = c * m[j], c * mi
        sx += cj * dx
        sy += cj * dy
        sz += cj * dz
        ax[j] -= ci * dx
        ay[j] -= ci * dy
        az[j] -= ci * dz
    return sx, sy, sz


@kernel
def direct_sum(p: Array, mass: Array, out: Array) -> None:
    """Accelerations ``out[3, n]`` of point masses at ``p[3, n]``, G = 1; no two of them at the same point."""
    out[:] = 0.0
    for i in range(mass.shape[0]):
        x, y, z = _row(i, p[0], p[1], p[2], mass, out[0], out[1], out[2])
        out[0, i] += x
        out[1, i] += y
        out[2, i] += z


@kernel
def potential_energy(x: Array, mass: Array) -> float:
    """Energy of self-gravity of point masses at ``x[n, 3]``, G = 1; removed grains have zero mass."""
    total = 0.0
    n = mass.shape[0]
    for i in range(n):
        if mass[i] == 0.0:
            continue
        for j in range(i + 1, n):
            if mass[j] > 0.0:
                d0, d1, d2 = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
                total -= mass[i] * mass[j] / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    return total


@kernel
def potential_at(places: Array, x: Array, mass: Array) -> Array:
    """Potential at ``places[k, 3]`` of point masses at ``x[n, 3]``, G = 1; shape (k,)."""
    out = np.zeros(places.shape[0])
    for i in range(places.shape[0]):
        for j in range(x.shape[0]):
            d0, d1, d2 = x[j, 0] - places[i, 0], x[j, 1] - places[i, 1], x[j, 2] - places[i, 2]
            out[i] -= mass[j] / np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
    return out
