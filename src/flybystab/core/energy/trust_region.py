"""Least critical energy and strain at second order, certified as global minima.

On a circular cone ``P1`` is linear and ``P2`` quadratic in the direction ``x``
(:mod:`flybystab.core.energy.perturbation`). The least ``P1^2/(2 P2)`` is the root ``E`` of
``min_x (P1^2 - 2 E P2) = 0`` and the least ``-P1/P2`` the root ``t`` of ``min_x (-P1 - t P2) = 0``. Each inner minimum
is a trust-region problem, whose global solution is known up to one scalar root (Moré & Sorensen 1983). No search over
directions is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.energy.perturbation import Ellipsoid, rate_of_strain, slope_of_flow
from flybystab.core.energy.potential import MASS, energy_derivatives
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def _inside_ball(values: Array, g: Array, y: Array) -> bool:
    """True if the free minimum ``g/values`` lies in the unit ball; writes it into ``y[n]``."""
    if values[0] <= 0.0:
        return False
    inside = 0.0
    for i in range(g.size):
        y[i] = g[i] / values[i]
        inside += y[i] ** 2
    return inside <= 1.0


@kernel
def _secular_root(values: Array, g: Array, low: float, y: Array) -> None:
    """Write ``y[n] = g/(values - values[0] + nu)`` of unit length.

    `low` is the square of the part of ``g`` along the lowest eigenvectors, which brackets ``nu`` from below. ``1/|y| -
    1`` is nearly linear in ``nu``: Newton's method on it, within the bracket.
    """
    n = g.size
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


@kernel
def _on_sphere(values: Array, g: Array, size: float, y: Array) -> None:
    """Write the minimum ``y[n]`` on the unit sphere in the basis of the eigenvectors.

    Values are compared with zero relative to `size`. The lowest eigenvalue may be repeated: in the hard case ``g`` is
    negligible along all of its eigenvectors.
    """
    n = g.size
    others = 0.0
    low = 0.0
    for i in range(n):
        gap = values[i] - values[0]
        if gap > 1e-12 * size:
            others += (g[i] / gap) ** 2
        else:
            low += g[i] * g[i]
    if np.sqrt(low) > 1e-13 * size or others > 1.0:
        _secular_root(values, g, low, y)
        return
    for i in range(n):
        gap = values[i] - values[0]
        y[i] = g[i] / gap if gap > 1e-12 * size else 0.0
    y[0] = np.sqrt(max(0.0, 1.0 - np.sum(y * y)))


@kernel
def trust_region(a: Array, b: Array, ball: bool, x: Array) -> float:
    """Global minimum of ``x.a x + b.x`` on the unit sphere, or in the unit ball; writes ``x[n]``.

    ``(a + mu 1) x = -b/2`` with ``a + mu 1`` positive semidefinite is necessary and sufficient (Moré & Sorensen
    1983). In the hard case (``b`` normal to the lowest eigenvector) a component along that vector makes ``|x| = 1``.
    """
    n = b.size
    values, vectors = np.linalg.eigh(a)
    g = np.empty(n)
    size = 0.0
    for i in range(n):
        g[i] = -0.5 * np.sum(vectors[:, i] * b)
        size = max(size, abs(g[i]), abs(values[i]))
    y = np.zeros(n)
    if not (ball and _inside_ball(values, g, y)):
        _on_sphere(values, g, size, y)
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


class SecondOrder(NamedTuple):
    """``P1 = MASS (stress.x - load)`` and ``P2 = -(x.curvature x + slope.x + constant)`` on a circular cone."""

    stress: Array
    load: float
    curvature: Array
    slope: Array
    constant: float
    ball: bool  # whether directions fill the unit ball


@kernel
def _second_order_form(b: Ellipsoid, x: Array) -> SecondOrder:
    """The two forms; they do not depend on the direction ``x[5]``, on a circular cone."""
    f = np.empty((6, 6))
    curvature_form(b, f)
    g, beta = slope_of_flow(b, x)
    k = g * b.sin
    kc = g * b.cohesion
    stress_term = MASS * beta * ((k - beta) * (b.kappa - b.pressure) - kc)
    return SecondOrder(
        b.stress,
        k * b.pressure + kc,
        f[:5, :5].copy(),
        2.0 * beta * f[:5, 5],
        beta * beta * f[5, 5] - stress_term,
        b.associative and k > 0.0,
    )


@kernel
def _powers(form: SecondOrder, x: Array) -> tuple[float, float]:
    """``P1`` and ``P2`` of a direction."""
    p1 = MASS * (np.sum(form.stress * x) - form.load)
    return p1, -(np.sum(x * (form.curvature @ x)) + np.sum(form.slope * x) + form.constant)


@kernel
def _least_energy(form: SecondOrder, best: float, x_least: Array) -> float:
    """Least ``P1^2/(2 P2)``, starting from the value `best`; writes the direction if a lower one is found."""
    m2 = MASS * MASS
    a, b, x = np.empty((5, 5)), np.empty(5), np.empty(5)
    for _ in range(60):
        for i in range(5):
            b[i] = -2.0 * m2 * form.load * form.stress[i] + 2.0 * best * form.slope[i]
            for j in range(5):
                a[i, j] = m2 * form.stress[i] * form.stress[j] + 2.0 * best * form.curvature[i, j]
        trust_region(a, b, form.ball, x)
        p1, p2 = _powers(form, x)
        if p2 <= 0.0:
            break
        new = 0.5 * p1 * p1 / p2
        if new < best:
            x_least[:] = x
        if new >= best * (1.0 - 1e-14):
            return min(best, new)
        best = new
    return best


@kernel
def _least_strain(form: SecondOrder, best: float, x_least: Array) -> float:
    """Least ``-P1/P2``, starting from the value `best`; writes the direction if a lower one is found."""
    a, b, x = np.empty((5, 5)), np.empty(5), np.empty(5)
    for _ in range(60):
        for i in range(5):
            b[i] = -MASS * form.stress[i] + best * form.slope[i]
            for j in range(5):
                a[i, j] = best * form.curvature[i, j]
        trust_region(a, b, form.ball, x)
        p1, p2 = _powers(form, x)
        if p2 <= 0.0:
            break
        new = -p1 / p2
        if new < best:
            x_least[:] = x
        if new >= best * (1.0 - 1e-14):
            return min(best, new)
        best = new
    return best


@kernel
def least_second_order(b: Ellipsoid, x_energy: Array, x_strain: Array) -> tuple[float, float, float]:
    """Least critical energy and least critical strain at second order on a circular cone, and greatest ``P2``.

    Writes the directions that give them. Dinkelbach's iteration ``E <- P1^2/(2 P2)`` at the minimiser of
    ``P1^2 - 2 E P2`` converges monotonically and superlinearly to the global minimum.
    """
    form = _second_order_form(b, x_energy)
    x = np.empty(5)
    most = -(trust_region(form.curvature, form.slope, form.ball, x) + form.constant)
    x_energy[:] = x
    x_strain[:] = x
    if most <= 0.0:
        return np.inf, np.inf, most
    p1 = MASS * (np.sum(b.stress * x) - form.load)
    if p1 >= 0.0:
        return 0.0, 0.0, most
    energy = _least_energy(form, 0.5 * p1 * p1 / most, x_energy)
    return energy, _least_strain(form, -p1 / most, x_strain), most
