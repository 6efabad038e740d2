"""Least critical energy and strain at second order, certified as global minima.

On a circular cone ``P1`` is linear and ``P2`` quadratic in the direction ``x``
(:mod:`flybystab.core.energy.perturbation`). The
least ``P1^2/(2 P2)`` is the root ``E`` of ``min_x (P1^2 - 2 E P2) = 0`` and the least ``-P1/P2`` the root ``t`` of
``min_x (-P1 - t P2) = 0``. Each inner minimum is a trust-region problem, whose global solution is known up to
one scalar root (Moré & Sorensen 1983): nothing is searched, so that no direction can be missed.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.energy.perturbation import Ellipsoid, rate_of_strain, slope_of_flow
from flybystab.core.energy.potential import MASS, energy_derivatives
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def trust_region(a: Array, b: Array, ball: bool, x: Array) -> float:
    """Global minimum of ``x.a x + b.x`` on the unit sphere, or in the unit ball; writes ``x[n]``.

    ``(a + mu 1) x = -b/2`` with ``a + mu 1`` positive semidefinite is necessary and sufficient (Moré & Sorensen
    1983). In the hard case (``b`` normal to the lowest eigenvector) the missing length goes along that vector.
    """
    n = b.size
    values, vectors = np.linalg.eigh(a)
    g = np.empty(n)
    size = 0.0
    for i in range(n):
        g[i] = -0.5 * np.sum(vectors[:, i] * b)
        size = max(size, abs(g[i]), abs(values[i]))
    mu = -1.0
    if ball and values[0] > 0.0:
        inside = 0.0
        for i in range(n):
            inside += (g[i] / values[i]) ** 2
        if inside <= 1.0:
            mu = 0.0
    y = np.zeros(n)
    if mu == 0.0:
        for i in range(n):
            y[i] = g[i] / values[i]
    else:
        # the lowest eigenvalue may be repeated: b is negligible along all of its vectors in the hard case
        tiny = 1e-13 * size
        others = 0.0
        low = 0.0
        for i in range(n):
            gap = values[i] - values[0]
            if gap > 1e-12 * size:
                others += (g[i] / gap) ** 2
            else:
                low += g[i] * g[i]
        if np.sqrt(low) <= tiny and others <= 1.0:
            for i in range(n):
                gap = values[i] - values[0]
                y[i] = g[i] / gap if gap > 1e-12 * size else 0.0
            y[0] = np.sqrt(max(0.0, 1.0 - np.sum(y * y)))
        else:
            # |x(nu)| = 1 with nu = mu + lowest eigenvalue; 1/|x| - 1 is nearly linear in nu
            left = np.sqrt(low)
            right = np.sqrt(np.sum(g * g))
            nu = left if left > 0.0 else 1e-8 * right
            for _ in range(100):
                q = 0.0
                dq = 0.0
                for i in range(n):
                    h = values[i] - values[0] + nu
                    q += (g[i] / h) ** 2
                    dq -= 2.0 * g[i] * g[i] / (h * h * h)
                if q > 1.0:
                    left = nu
                else:
                    right = nu
                root = np.sqrt(q)
                new = nu + 2.0 * q * (1.0 - root) / dq
                if not (left <= new <= right):
                    new = 0.5 * (left + right)
                if abs(new - nu) <= 1e-15 * abs(nu) or abs(root - 1.0) < 1e-15:
                    nu = new
                    break
                nu = new
            for i in range(n):
                y[i] = g[i] / (values[i] - values[0] + nu)
            y /= np.sqrt(np.sum(y * y))
    value = 0.0
    for i in range(n):
        x[i] = np.sum(vectors[i, :] * y)
        value += y[i] * (values[i] * y[i] - 2.0 * g[i])
    return value


@kernel
def curvature_form(b: Ellipsoid, f: Array) -> None:
    """Write the form ``f[6, 6]`` with ``Phi'' = X.f X`` for ``X = (x, tr D)``, by polarisation."""
    d = np.empty(6)
    x = np.zeros(6)
    for i in range(6):
        for j in range(i, 6):
            x[:] = 0.0
            x[i] += 1.0
            if j != i:
                x[j] += 1.0
            rate_of_strain(x[:5], x[5], d)
            _, f2, _ = energy_derivatives(b.s[0], b.s[1], b.s[2], b.one, b.two, b.three, b.spin, d)
            f[i, j] = f2
    for i in range(6):
        for j in range(i + 1, 6):
            f[i, j] = 0.5 * (f[i, j] - f[i, i] - f[j, j])
            f[j, i] = f[i, j]


@kernel
def least_second_order(b: Ellipsoid, x_energy: Array, x_strain: Array) -> tuple[float, float, float]:
    """Least critical energy and least critical strain at second order on a circular cone, and greatest ``P2``.

    Writes the directions that give them. Dinkelbach's iteration ``E <- P1^2/(2 P2)`` at the minimiser of
    ``P1^2 - 2 E P2`` falls monotonically and superlinearly to the global least value.
    """
    f = np.empty((6, 6))
    curvature_form(b, f)
    g, beta = slope_of_flow(b, x_energy)
    k = g * b.sin
    kc = g * b.cohesion
    load = k * b.pressure + kc
    stress_term = MASS * beta * ((k - beta) * (b.kappa - b.pressure) - kc)
    ball = b.associative and k > 0.0
    a = f[:5, :5].copy()
    lin = 2.0 * beta * f[:5, 5]
    con = beta * beta * f[5, 5] - stress_term
    x = np.empty(5)
    most = -(trust_region(a, lin, ball, x) + con)
    x_energy[:] = x
    x_strain[:] = x
    if most <= 0.0:
        return np.inf, np.inf, most
    p1 = MASS * (np.sum(b.stress * x) - load)
    if p1 >= 0.0:
        return 0.0, 0.0, most
    best = 0.5 * p1 * p1 / most
    m2 = MASS * MASS
    aa = np.empty((5, 5))
    bb = np.empty(5)
    for _ in range(60):
        for i in range(5):
            bb[i] = -2.0 * m2 * load * b.stress[i] + 2.0 * best * lin[i]
            for j in range(5):
                aa[i, j] = m2 * b.stress[i] * b.stress[j] + 2.0 * best * a[i, j]
        trust_region(aa, bb, ball, x)
        p1 = MASS * (np.sum(b.stress * x) - load)
        p2 = -(np.sum(x * (a @ x)) + np.sum(lin * x) + con)
        if p2 <= 0.0:
            break
        new = 0.5 * p1 * p1 / p2
        if new < best:
            x_energy[:] = x
        if new >= best * (1.0 - 1e-14):
            best = min(best, new)
            break
        best = new
    p1 = MASS * (np.sum(b.stress * x_strain) - load)
    strain = -p1 / most
    for _ in range(60):
        for i in range(5):
            bb[i] = -MASS * b.stress[i] + strain * lin[i]
            for j in range(5):
                aa[i, j] = strain * a[i, j]
        trust_region(aa, bb, ball, x)
        p1 = MASS * (np.sum(b.stress * x) - load)
        p2 = -(np.sum(x * (a @ x)) + np.sum(lin * x) + con)
        if p2 <= 0.0:
            break
        new = -p1 / p2
        if new < strain:
            x_strain[:] = x
        if new >= strain * (1.0 - 1e-14):
            strain = min(strain, new)
            break
        strain = new
    return best, strain, most
