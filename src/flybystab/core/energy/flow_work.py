"""Power of the stress of a flow along a path of constant strain direction, with the reaction pressure of the flow.

While a granular body flows with the unit rate of strain ``u`` its stress is ``T = -P 1 + (P sin + C) N`` (``T = 5
sigma V/(V0 rho0)``, ``C = 5 Y cos(phi) V/V0``, ``N`` the unit yield section at ``u``) and its dilation is ``tr D = e
N:u``. The pressure is the reaction to this constraint on ``tr D`` (theory, section 3). With ``R = K_g - Omega^2`` and
``B = 1 - e N``, to first order in ``D``,

    P = [-B:R + C B:(N S^-1)] / [B:((1 - sin N) S^-1)],    power = (M/5) [(sin - e) (N:u) P + C N:u].

The terms of second order add ``|D'|^2 [B:L^2 + d(tr D)/dt]/[...]`` to ``P``, the last only where the dilation fades.
They are negligible for small perturbations, but not along a path whose kinetic energy is large.

In associative flow ``e = sin`` and the power does not depend on the pressure. The dilation ends at ``V/V0`` = 1.5, with
the same fade as in the dynamics. Alternatively, a plastic bulk modulus ``kappa`` gives the pressure
``p = p_eq - kappa ln(V/V0)``. The pressure is never below that of the apex, ``-Y cot(phi)``, at which contact is lost.

Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.energy.potential import MASS, PrincipalAxes, velocity_gradient
from flybystab.core.material.flow_rule import fade_share
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import multiply
from flybystab.typing import Array

#: ``V/V0`` at which dilation ends, as in :func:`flybystab.core.dynamics.run.integrate`, and where its fade begins.
LARGEST_VOLUME = 1.5
FADE_BEGINS = LARGEST_VOLUME - 0.1 * (LARGEST_VOLUME - 1.0)

# Partial fractions of 1/((1 - x)^2 (1 + 2x) (b + d x)); its integral is the strain of the fade up to x = (V/V0 - b)/d
_D = LARGEST_VOLUME - FADE_BEGINS
_SQUARE = 1.0 / (3.0 * LARGEST_VOLUME)
_PLUS = 4.0 / 9.0 / (FADE_BEGINS - 0.5 * _D)
_LINEAR = _D**3 / (LARGEST_VOLUME**2 * (_D - 2.0 * FADE_BEGINS))
_MINUS = 0.5 * _PLUS + _LINEAR / _D

#: Nodes and weights of Gauss' rule of three points on [0, 1].
_NODES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
_R = np.sqrt(15.0)
_COLLOCATION = np.array(
    [
        [5.0 / 36.0, 2.0 / 9.0 - _R / 15.0, 5.0 / 36.0 - _R / 30.0],
        [5.0 / 36.0 + _R / 24.0, 2.0 / 9.0, 5.0 / 36.0 - _R / 24.0],
        [5.0 / 36.0 + _R / 30.0, 2.0 / 9.0 + _R / 15.0, 5.0 / 36.0],
    ]
)


class Flow(NamedTuple):
    """A direction of flow: the quantities on which the power of the stress along its path depends."""

    section: Array  # N[3, 3]
    support: float  # N:u
    size: float  # |D'| per unit strain; below 1 at the apex of the yield surface
    trace: float  # tr D per unit strain before the fade
    share: float  # e before the fade
    sin: float
    cohesion: float  # Y cos(phi)
    kappa: float  # 0: reaction pressure
    pressure: float  # of the equilibrium


@kernel
def volume_at(trace: float, t: float) -> float:
    """``V/V0`` at strain `t` in closed form: ``dV/dt = trace f(V) V`` with ``f`` = `fade_share`."""
    if trace <= 0.0:
        return 1.0
    begin = np.log(FADE_BEGINS)
    if trace * t <= begin:
        return np.exp(trace * t)
    time = (trace * t - begin) / _D
    low, high = 0.0, 1.0
    x = min(0.5, time * FADE_BEGINS)
    for _ in range(100):
        rest = 1.0 - x
        f = _SQUARE * x / rest - _MINUS * np.log(rest) + 0.5 * _PLUS * np.log1p(2.0 * x)
        f += _LINEAR / _D * np.log1p(_D * x / FADE_BEGINS) - time
        if f > 0.0:
            high = x
        else:
            low = x
        new = x - f * rest * rest * (1.0 + 2.0 * x) * (FADE_BEGINS + _D * x)
        if not (low < new < high):
            new = 0.5 * (low + high)
        if abs(new - x) <= 1e-15:
            break
        x = new
    return FADE_BEGINS + _D * x


@kernel
def growth_at(trace: float, volume: float) -> float:
    """``d ln V/dt`` at ``V/V0``."""
    share, _ = fade_share(volume, LARGEST_VOLUME)
    return trace * share


@kernel
def depends_on_pressure(flow: Flow, volume: float) -> bool:
    """True if the power at ``V/V0`` depends on the pressure."""
    return flow.sin > 0.0 and (flow.share < flow.sin or volume > FADE_BEGINS)


@kernel
def power(
    flow: Flow, volume: float, gradient: Array, axes: PrincipalAxes, tide: Array
) -> tuple[float, float]:
    """Power of the stress at ``V/V0`` per unit rate of strain, and the coefficient of the square of that rate in it.

    ``gradient[3, 3]`` is the traceless part of ``L``, ``tide[6]`` a tidal tensor in the frame of the path. They and the
    body `axes` are used only where the power depends on the pressure.
    """
    cohesive = 5.0 * flow.cohesion * volume
    m = flow.support
    if not depends_on_pressure(flow, volume):
        return MASS / 5.0 * m * cohesive, 0.0
    fade, slope = fade_share(volume, LARGEST_VOLUME)
    if fade >= flow.size and flow.share >= flow.sin:  # apex
        return MASS / 5.0 * m * cohesive * fade, 0.0
    e = flow.share * fade / flow.size
    apex = -cohesive / flow.sin
    scale = MASS / 5.0 * flow.size * m
    if flow.kappa > 0.0:
        p = 5.0 * volume * (flow.pressure - flow.kappa * np.log(volume))
        return scale * ((flow.sin - e) * max(p, apex) + cohesive), 0.0
    one, two, load = _reaction(flow, e, axes)
    for k in range(6):
        i = k if k < 3 else (0 if k < 5 else 1)
        j = k if k < 3 else (k - 2 if k < 5 else 2)
        b = (1.0 if i == j else 0.0) - e * flow.section[i, j]
        load += (1.0 if k < 3 else 2.0) * b * tide[k]
    denominator = one - flow.sin * two
    if denominator <= 0.0:
        return np.inf, 0.0
    p = (cohesive * two - load) / denominator
    growth = flow.trace * fade
    second = flow.trace * slope * volume * growth
    for i in range(3):
        for j in range(3):
            b = (1.0 if i == j else 0.0) - e * flow.section[i, j]
            square = 2.0 / 3.0 * growth * gradient[i, j] + (growth * growth / 9.0 if i == j else 0.0)
            for k in range(3):
                square += gradient[i, k] * gradient[k, j]
            second += b * square
    slack = flow.sin - e
    return scale * (slack * max(p, apex) + cohesive), scale * slack * second / denominator


@kernel
def _reaction(flow: Flow, e: float, axes: PrincipalAxes) -> tuple[float, float, float]:
    """``B:S^-1``, ``B:(N S^-1)`` and ``B:R``."""
    n = flow.section
    w = axes.spin
    load = 2.0 * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    one = 0.0
    two = 0.0
    for k in range(3):
        v = axes.vectors[:, k]
        first = 0.0
        second = 0.0
        for i in range(3):
            nv = n[i, 0] * v[0] + n[i, 1] * v[1] + n[i, 2] * v[2]
            first += v[i] * nv
            second += nv * nv
            load += e * w[i] * n[i, k] * w[k]
        load -= 4.0 / 3.0 * axes.rd[k] * (1.0 - e * first)
        one += (1.0 - e * first) / axes.squares[k]
        two += (first - e * second) / axes.squares[k]
    return one, two, load


@kernel
def gauss(i: int) -> tuple[float, float]:
    """Node and weight of Gauss' rule of three points on [0, 1]."""
    return _NODES[i], _WEIGHTS[i]


@kernel
def gauss_up_to(i: int, values: Array) -> float:
    """Integral up to the node `i` of the parabola through ``values[3]`` at the nodes."""
    return _COLLOCATION[i, 0] * values[0] + _COLLOCATION[i, 1] * values[1] + _COLLOCATION[i, 2] * values[2]


@kernel
def _deformation_coefficients(
    section: Array, e: float, s: Array, l: Array, l2: Array, b: Array, values: Array, turned: Array
) -> None:
    """Write ``B = 1 - e N`` and the first two derivatives of ``B:S^-1`` and ``B:(N S^-1)`` after their values.

    ``l`` and ``l2`` are ``L`` and ``L^2``: ``(S^-1)' = -2 S^-1 L``. ``values[3]`` and ``turned[3]`` are the results.
    """
    bn = np.empty((3, 3))
    multiply(section, section, bn)
    values[:] = 0.0
    turned[:] = 0.0
    for i in range(3):
        for j in range(3):
            b[i, j] = (1.0 if i == j else 0.0) - e * section[i, j]
            bn[i, j] = section[i, j] - e * bn[i, j]
    for i in range(3):
        values[0] += b[i, i] / s[i]
        turned[0] += bn[i, i] / s[i]
        for j in range(3):
            values[1] -= 2.0 * b[i, j] * l[i, j] / s[i]
            turned[1] -= 2.0 * bn[i, j] * l[i, j] / s[i]
            values[2] += 4.0 * b[i, j] * l2[i, j] / s[i]
            turned[2] += 4.0 * bn[i, j] * l2[i, j] / s[i]


@kernel
def _gravity_load(b: Array, one: Array, two: Array, three: Array, p: Array, q: Array, load: Array) -> None:
    """Write ``B:K_g`` and its first two derivatives into ``load[3]``; ``p, q`` are those of ``S``.

    With ``N_u = (S + u)^-1`` and ``Gamma = int N_u du/Delta`` the derivatives of ``K_g = -2 Gamma`` follow from
    ``N_u' = -N_u S' N_u`` and those of ``1/Delta`` (see :mod:`flybystab.core.energy.potential`).
    """
    r0 = r1 = r2 = 0.0
    for i in range(3):
        r0 -= 2.0 * b[i, i] * one[i]
        for j in range(3):
            first = -two[i, j] * p[i, j]
            second = -two[i, j] * q[i, j]
            for k in range(3):
                second += three[i, j, k] * (2.0 * p[i, k] * p[k, j] + p[k, k] * p[i, j])
            if i == j:
                for k in range(3):
                    first -= 0.5 * two[i, k] * p[k, k]
                    second -= 0.5 * two[i, k] * q[k, k]
                    for n in range(3):
                        second += three[i, k, n] * (0.5 * p[k, n] * p[n, k] + 0.25 * p[k, k] * p[n, n])
            r1 -= 2.0 * b[i, j] * first
            r2 -= 2.0 * b[i, j] * second
    load[0], load[1], load[2] = r0, r1, r2


@kernel
def _add_rotation_load(b: Array, s: Array, p: Array, q: Array, spin: Array, load: Array) -> None:
    """Add ``-B:Omega^2`` and its first two derivatives at fixed angular momentum to ``load[3]``.

    ``omega = J^-1 H``: ``omega' = -J^-1 J' omega``, ``omega'' = J^-1 (2 J' J^-1 J' - J'') omega``.
    """
    tp = p[0, 0] + p[1, 1] + p[2, 2]
    tq = q[0, 0] + q[1, 1] + q[2, 2]
    ts = s[0] + s[1] + s[2]
    w1 = np.empty(3)
    w2 = np.empty(3)
    for i in range(3):
        w1[i] = tp * spin[i]
        w2[i] = tq * spin[i]
        for j in range(3):
            w1[i] -= p[i, j] * spin[j]
            w2[i] -= q[i, j] * spin[j]
        w1[i] = -w1[i] / (ts - s[i])
    for i in range(3):
        g = tp * w1[i]
        for j in range(3):
            g -= p[i, j] * w1[j]
        w2[i] = -(w2[i] + 2.0 * g) / (ts - s[i])
    trace = b[0, 0] + b[1, 1] + b[2, 2]
    for i in range(3):
        for j in range(3):
            form = (trace if i == j else 0.0) - b[i, j]
            load[0] += form * spin[i] * spin[j]
            load[1] += 2.0 * form * spin[i] * w1[j]
            load[2] += 2.0 * form * (w1[i] * w1[j] + spin[i] * w2[j])


@kernel
def power_derivatives(
    flow: Flow, s: Array, one: Array, two: Array, three: Array, spin: Array, d: Array
) -> tuple[float, float, float]:
    """Power of the stress and its first two derivatives at the start of the path with rate of strain ``d[6]``.

    ``s[3]`` with ``s1 s2 s3 = 1`` and its index symbols. The derivatives of the reaction pressure follow from those of
    its equation, numerator and denominator of :func:`power`, with ``S' = 2 L S``. The power is infinite in a jam, where
    the denominator is not positive.
    """
    tr = flow.trace
    cohesive = 5.0 * flow.cohesion
    c = MASS / 5.0 * flow.support
    if flow.sin <= 0.0 or flow.share >= flow.sin:
        return c * cohesive, c * cohesive * tr, c * cohesive * tr * tr
    e = flow.share
    slack = flow.sin - e
    if flow.kappa > 0.0:
        w0 = c * (slack * 5.0 * flow.pressure + cohesive)
        fall = c * slack * 5.0 * flow.kappa * tr
        return w0, w0 * tr - fall, w0 * tr * tr - 2.0 * fall * tr
    l, l2 = np.empty((3, 3)), np.empty((3, 3))
    p, q = np.empty((3, 3)), np.empty((3, 3))
    velocity_gradient(s[0], s[1], s[2], d, l)
    multiply(l, l, l2)
    for i in range(3):
        for j in range(3):
            p[i, j] = 2.0 * l[i, j] * s[j]
            q[i, j] = 4.0 * l2[i, j] * s[j]
    b = np.empty((3, 3))
    a, n, r = np.empty(3), np.empty(3), np.empty(3)  # B:S^-1, B:(N S^-1), B:R; with derivatives
    _deformation_coefficients(flow.section, e, s, l, l2, b, a, n)
    _gravity_load(b, one, two, three, p, q, r)
    _add_rotation_load(b, s, p, q, spin, r)
    den0 = a[0] - flow.sin * n[0]
    den1 = a[1] - flow.sin * n[1]
    den2 = a[2] - flow.sin * n[2]
    if den0 <= 0.0:
        return np.inf, 0.0, 0.0
    p0 = (cohesive * n[0] - r[0]) / den0
    if p0 <= -cohesive / flow.sin:  # contact is lost
        w0 = c * cohesive * e / flow.sin
        return w0, w0 * tr, w0 * tr * tr
    p1 = (cohesive * (tr * n[0] + n[1]) - r[1] - p0 * den1) / den0
    p2 = (cohesive * (tr * tr * n[0] + 2.0 * tr * n[1] + n[2]) - r[2] - 2.0 * p1 * den1 - p0 * den2) / den0
    return (
        c * (slack * p0 + cohesive),
        c * (slack * p1 + cohesive * tr),
        c * (slack * p2 + cohesive * tr * tr),
    )
