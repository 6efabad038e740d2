"""Self-gravity of many grains by a tree (Barnes & Hut 1986) with quadrupoles.

The grains of a node are halved along its longest extent until a leaf has at most :data:`LEAF`. The tree is traversed
once for each leaf: a node of size ``b`` (largest distance of a grain from its centre of mass) acts as a multipole if
``b < theta (d - b_leaf)``, ``d`` the distance of the centres of mass; otherwise its children, or the grains of a leaf,
are used. The first neglected term is the octupole, so that the error scales about as ``theta^4``. The sum violates
Newton's third law; the resulting net force and torque are removed by a small change of the accelerations (otherwise a
pile slowly spins up).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flybystab.core.numerics.jit import kernel, summing_kernel
from flybystab.typing import Array

Index = NDArray[np.int64]

#: Most grains of a leaf.
LEAF = 24
#: Columns of a node: mass, centre of mass (3), size, quadrupole xx, yy, zz, xy, xz, yz (traceless).
N_NODE = 11


def opening(error: float) -> float:
    """Opening angle of the tree for an error: rms over the grains, relative to the rms acceleration.

    The measured errors of piles of 1,000 to 20,000 grains, whole or drawn into a string, lie below it for errors of
    1e-5 to 1e-2 (``pytest tests/core/grains/test_tree.py``).
    """
    return min(0.85, 0.5 * float(error / 1.5e-3) ** 0.25)


@kernel
def _select(key: Array, index: Index, low: int, high: int, k: int) -> None:
    """Partition ``index[low:high]`` so that the keys before place `k` are not larger than those after it."""
    high -= 1
    while low < high:
        pivot = key[index[(low + high) // 2]]
        i, j = low, high
        while i <= j:
            while key[index[i]] < pivot:
                i += 1
            while key[index[j]] > pivot:
                j -= 1
            if i <= j:
                index[i], index[j] = index[j], index[i]
                i += 1
                j -= 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            return


@kernel
def _build(p: Array, mass: Array, index: Index, span: Index, child: Index, node: Array, s: Array) -> int:
    """Sort the grains `index` into a tree; returns the number of nodes.

    Parameters
    ----------
    p, mass : ndarray (3, n), (n,)
    index : ndarray (m,)
        Grains with mass; permuted.
    span : ndarray (nodes, 2)
        Written: first and last place of a node's grains in `index`.
    child : ndarray (nodes,)
        Written: the first of two children, which follow each other; -1 for a leaf.
    node : ndarray (nodes, 11)
        Written: see :data:`N_NODE`.
    s : ndarray (4, m)
        Written: places and masses in the order of `index`.
    """
    m = index.shape[0]
    span[0, 0], span[0, 1] = 0, m
    count, at = 1, 0
    while at < count:
        first, last = span[at, 0], span[at, 1]
        child[at] = -1
        if last - first > LEAF:
            widest, axis = -1.0, 0
            for k in range(3):
                low = high = p[k, index[first]]
                for i in range(first + 1, last):
                    x = p[k, index[i]]
                    low, high = min(low, x), max(high, x)
                if high - low > widest:
                    widest, axis = high - low, k
            middle = (first + last) // 2
            _select(p[axis], index, first, last, middle)
            child[at] = count
            span[count, 0], span[count, 1] = first, middle
            span[count + 1, 0], span[count + 1, 1] = middle, last
            count += 2
        at += 1
    for i in range(m):
        for k in range(3):
            s[k, i] = p[k, index[i]]
        s[3, i] = mass[index[i]]
    for at in range(count):
        _moments(s, span[at, 0], span[at, 1], node[at])
    return count


@kernel
def _moments(s: Array, first: int, last: int, out: Array) -> None:
    """Write mass, centre, size and quadrupole of the grains `first` to ``last - 1``."""
    total = x = y = z = 0.0
    for i in range(first, last):
        m = s[3, i]
        total += m
        x += m * s[0, i]
        y += m * s[1, i]
        z += m * s[2, i]
    x /= total
    y /= total
    z /= total
    size = xx = yy = zz = xy = xz = yz = 0.0
    for i in range(first, last):
        m, a, b, c = s[3, i], s[0, i] - x, s[1, i] - y, s[2, i] - z
        r2 = a * a + b * b + c * c
        size = max(size, r2)
        xx += m * (3.0 * a * a - r2)
        yy += m * (3.0 * b * b - r2)
        zz += m * (3.0 * c * c - r2)
        xy += 3.0 * m * a * b
        xz += 3.0 * m * a * c
        yz += 3.0 * m * b * c
    out[0], out[1], out[2], out[3], out[4] = total, x, y, z, np.sqrt(size)
    out[5], out[6], out[7], out[8], out[9], out[10] = xx, yy, zz, xy, xz, yz


@summing_kernel
def _pull_of_grains(x: float, y: float, z: float, q: Array, count: int) -> tuple[float, float, float]:
    """Acceleration at a point by the grains ``q[:4, :count]``; a grain at that point is left out."""
    ax = ay = az = 0.0
    qx, qy, qz, qm = q[0], q[1], q[2], q[3]
    for j in range(np.uint64(count)):
        dx, dy, dz = qx[j] - x, qy[j] - y, qz[j] - z
        r2 = dx * dx + dy * dy + dz * dz
        near = 1.0 if r2 == 0.0 else 0.0
        r2 += near
        c = (1.0 - near) * qm[j] / (r2 * np.sqrt(r2))
        ax += c * dx
        ay += c * dy
        az += c * dz
    return ax, ay, az


@summing_kernel
def _pull_of_nodes(x: float, y: float, z: float, q: Array, count: int) -> tuple[float, float, float]:
    """Acceleration at a point by the multipoles ``q[:10, :count]``: mass, centre, quadrupole."""
    ax = ay = az = 0.0
    qm, qx, qy, qz = q[0], q[1], q[2], q[3]
    q0, q1, q2, q3, q4, q5 = q[4], q[5], q[6], q[7], q[8], q[9]
    for j in range(np.uint64(count)):
        dx, dy, dz = x - qx[j], y - qy[j], z - qz[j]
        i2 = 1.0 / (dx * dx + dy * dy + dz * dz)
        i3 = i2 * np.sqrt(i2)
        i5 = i3 * i2
        vx = q0[j] * dx + q3[j] * dy + q4[j] * dz
        vy = q3[j] * dx + q1[j] * dy + q5[j] * dz
        vz = q4[j] * dx + q5[j] * dy + q2[j] * dz
        c = qm[j] * i3 + 2.5 * (dx * vx + dy * vy + dz * vz) * i5 * i2
        ax += vx * i5 - c * dx
        ay += vy * i5 - c * dy
        az += vz * i5 - c * dz
    return ax, ay, az


@kernel
def _balance(p: Array, mass: Array, out: Array) -> None:
    """Change the accelerations `out` so that the net force and torque vanish.

    The change is ``w (f + c x r)`` with ``w = 1/(1 + (r/s)^4)``, ``s`` the mean distance from the centre of mass, so
    that it is small compared with the acceleration itself, also far away. With ``r`` from the centre of the masses
    weighted by ``w``, force and torque are decoupled.
    """
    n = mass.shape[0]
    total = 0.0
    c, f, centre, middle = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    weight = np.zeros(n)
    for i in range(n):
        total += mass[i]
        for k in range(3):
            middle[k] += mass[i] * p[k, i]
    size = 0.0
    for i in range(n):
        if mass[i] > 0.0:
            for k in range(3):
                weight[i] += (p[k, i] - middle[k] / total) ** 2
            size += mass[i] * np.sqrt(weight[i]) / total
    total = 0.0
    for i in range(n):
        weight[i] = 1.0 / (1.0 + weight[i] ** 2 / size**4)
        total += mass[i] * weight[i]
        for k in range(3):
            centre[k] += mass[i] * weight[i] * p[k, i]
            f[k] += mass[i] * out[k, i]
    for k in range(3):
        centre[k] /= total
        f[k] /= total
    a, b = np.zeros((3, 3)), np.zeros(3)
    for i in range(n):
        m, x, y, z = mass[i], p[0, i] - centre[0], p[1, i] - centre[1], p[2, i] - centre[2]
        b[0] += m * (y * out[2, i] - z * out[1, i])
        b[1] += m * (z * out[0, i] - x * out[2, i])
        b[2] += m * (x * out[1, i] - y * out[0, i])
        m *= weight[i]
        a[0, 0] += m * (y * y + z * z)
        a[1, 1] += m * (x * x + z * z)
        a[2, 2] += m * (x * x + y * y)
        a[0, 1] -= m * x * y
        a[0, 2] -= m * x * z
        a[1, 2] -= m * y * z
    a[1, 0], a[2, 0], a[2, 1] = a[0, 1], a[0, 2], a[1, 2]
    det = (
        a[0, 0] * (a[1, 1] * a[2, 2] - a[1, 2] * a[1, 2])
        - a[0, 1] * (a[0, 1] * a[2, 2] - a[1, 2] * a[0, 2])
        + a[0, 2] * (a[0, 1] * a[1, 2] - a[1, 1] * a[0, 2])
    )
    # grains in a line have no inertia about it, and no torque
    if det > 1e-12 * a[0, 0] * a[1, 1] * a[2, 2]:
        for k in range(3):  # Cramer's rule
            i, j = (k + 1) % 3, (k + 2) % 3
            c[k] = (
                b[k] * (a[i, i] * a[j, j] - a[i, j] * a[i, j])
                - b[i] * (a[k, i] * a[j, j] - a[k, j] * a[i, j])
                + b[j] * (a[k, i] * a[i, j] - a[k, j] * a[i, i])
            ) / det
    for i in range(n):
        if mass[i] == 0.0:
            continue
        x, y, z, w = p[0, i] - centre[0], p[1, i] - centre[1], p[2, i] - centre[2], weight[i]
        out[0, i] -= w * (f[0] + c[1] * z - c[2] * y)
        out[1, i] -= w * (f[1] + c[2] * x - c[0] * z)
        out[2, i] -= w * (f[2] + c[0] * y - c[1] * x)


@kernel
def tree_sum(p: Array, mass: Array, theta: float, out: Array) -> None:
    """Accelerations ``out[3, n]`` of point masses at ``p[3, n]``, G = 1, by a tree with the opening angle `theta`.

    Those without mass neither attract nor are attracted.
    """
    n = mass.shape[0]
    out[:] = 0.0
    m = 0
    index = np.empty(n, np.int64)
    for i in range(n):
        if mass[i] > 0.0:
            index[m] = i
            m += 1
    if m < 2:
        return
    index = index[:m]
    room = 8 * (m // LEAF + 1)
    span, child, node = np.empty((room, 2), np.int64), np.empty(room, np.int64), np.empty((room, N_NODE))
    s = np.empty((4, m))
    count = _build(p, mass, index, span, child, node, s)
    near, far, stack = np.empty((4, m)), np.empty((10, count)), np.empty(count, np.int64)
    for leaf in range(count):
        if child[leaf] >= 0:
            continue
        own = node[leaf]
        grains = nodes = 0
        stack[0] = 0
        top = 1
        while top > 0:
            top -= 1
            at = stack[top]
            a = node[at]
            d = np.sqrt((a[1] - own[1]) ** 2 + (a[2] - own[2]) ** 2 + (a[3] - own[3]) ** 2)
            if a[4] < theta * (d - own[4]):
                for k in range(4):
                    far[k, nodes] = a[k]
                for k in range(6):
                    far[4 + k, nodes] = a[5 + k]
                nodes += 1
            elif child[at] >= 0:
                stack[top], stack[top + 1] = child[at], child[at] + 1
                top += 2
            else:
                for j in range(span[at, 0], span[at, 1]):
                    for k in range(4):
                        near[k, grains] = s[k, j]
                    grains += 1
        for i in range(span[leaf, 0], span[leaf, 1]):
            x, y, z = s[0, i], s[1, i], s[2, i]
            ax, ay, az = _pull_of_grains(x, y, z, near, grains)
            bx, by, bz = _pull_of_nodes(x, y, z, far, nodes)
            out[0, index[i]] = ax + bx
            out[1, index[i]] = ay + by
            out[2, index[i]] = az + bz
    _balance(p, mass, out)
