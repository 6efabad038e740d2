"""How hard a push a granular ellipsoid stands: the least energy and strain over all admissible directions.

A push is a rate of strain ``D = sum_a x_a E_a + (beta/3) 1`` held for a time ``t`` (theory, section 5), with
``E_a`` an orthonormal basis of the deviators and ``|x| = 1``: ``e t`` is then the strain. While it flows the
stress does the work ``sigma*:D = (k - beta) p + k c`` per volume and time with the pressure of equilibrium, and

    K(t) - K(0) = t P1 + t^2/2 P2 + t^3/6 P3 + ...
    P1 = V (s:D' - k (p + c)),    P2 = -Phi'' + V beta [(k - beta)(kappa - p) - k c],
    P3 = -Phi''' - V beta^2 [(k - beta)(p - 2 kappa) + k c].

Associative flow (``beta = k``, for a slope ``k(theta)`` the support function of the yield section) also admits the
apex of the yield surface, ``tr D > k |D'|``: that is ``|x| < 1`` at ``tr D = k``, the same formulas on the ball
instead of the sphere.

Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.ellipsoid.potential import index_symbols
from flybystab.core.ellipsoid.rigid_stress import rigid_stress
from flybystab.core.energy.potential import MASS, energy_along, energy_derivatives, path_frame
from flybystab.core.material.yield_surface import (
    SQRT6,
    is_circular,
    least_slope,
    normal,
    slope_over_sine,
)
from flybystab.core.numerics.jit import kernel

Array = NDArray[np.float64]

SQRT2 = np.sqrt(2.0)

#: Longest strain along which a barrier is looked for.
LONGEST = 3.0

#: Steps of strain in which its maximum is bracketed.
STEP = 0.2

#: Axis ratio at which the homogeneous model is left; a body that is beyond it may grow its square by the second.
EDGE = 6.0
BEYOND_EDGE = 1.002


class Pile(NamedTuple):
    """A granular ellipsoid in the units of this module; `s` is ``S`` with ``det S = 1``."""

    s: Array
    spin: Array
    momentum: Array
    stress: Array  # deviator in the basis of the directions, 5
    pressure: float
    one: Array
    two: Array
    three: Array
    code: int
    sin: float
    cohesion: float  # Y cos(phi)
    associative: bool
    beta: float  # not associative
    kappa: float


@kernel
def rate_of_strain(x: Array, trace: float, d: Array) -> None:
    """Write ``d[6]`` of a direction ``x[5]`` and a trace."""
    a = x[0] / SQRT2
    b = x[1] / SQRT6
    d[0] = a + b + trace / 3.0
    d[1] = -a + b + trace / 3.0
    d[2] = -2.0 * b + trace / 3.0
    d[3] = x[2] / SQRT2
    d[4] = x[3] / SQRT2
    d[5] = x[4] / SQRT2


@kernel
def direction(c: Array, x: Array) -> None:
    """Write the components ``x[5]`` of the deviator of ``c[6]``; the inverse of :func:`rate_of_strain`."""
    x[0] = (c[0] - c[1]) / SQRT2
    x[1] = (c[0] + c[1] - 2.0 * c[2]) / SQRT6
    x[2] = SQRT2 * c[3]
    x[3] = SQRT2 * c[4]
    x[4] = SQRT2 * c[5]


@kernel
def pile(
    s1: float,
    s2: float,
    s3: float,
    spin: Array,
    code: int,
    phi: float,
    cohesion: float,
    dilatancy: float,
    kappa: float,
) -> Pile:
    """Set the scene; `s_i` of any scale, `spin`, `cohesion`, `kappa` in the units of this module.

    `dilatancy` is ``beta / min k``; 1 or more means associative flow, whatever the yield surface.
    """
    s = np.empty(3)
    scale = np.cbrt(s1 * s2 * s3)
    s[0] = s1 / scale
    s[1] = s2 / scale
    s[2] = s3 / scale
    one = np.empty(3)
    two = np.empty((3, 3))
    three = np.empty((3, 3, 3))
    index_symbols(s[0], s[1], s[2], one, two, three)
    stress = np.empty(6)
    rigid_stress(s[0], s[1], s[2], 1.0, 1.0, spin, np.zeros(6), stress)
    deviator = np.empty(5)
    direction(stress, deviator)
    momentum = np.empty(3)
    trace = s[0] + s[1] + s[2]
    for i in range(3):
        momentum[i] = MASS / 5.0 * (trace - s[i]) * spin[i]
    sin = np.sin(phi)
    return Pile(
        s,
        spin.copy(),
        momentum,
        deviator,
        -(stress[0] + stress[1] + stress[2]) / 3.0,
        one,
        two,
        three,
        code,
        sin,
        cohesion * np.cos(phi),
        dilatancy >= 1.0,
        dilatancy * least_slope(code, sin),
        kappa,
    )


@kernel
def _unit_determinant(x: Array, r: float) -> float:
    d = np.empty(6)
    rate_of_strain(x, 0.0, d)
    det = (
        d[0] * (d[1] * d[2] - d[5] * d[5])
        - d[3] * (d[3] * d[2] - d[5] * d[4])
        + d[4] * (d[3] * d[5] - d[1] * d[4])
    )
    return det / (r * r * r)


@kernel
def slope_of_flow(b: Pile, x: Array) -> tuple[float, float]:
    """``k`` over ``sin phi`` of the dissipation in the direction `x`, and the dilatancy ``tr D`` at ``|D'| = 1``.

    Associative flow: the support function ``m(D') = max over theta of k(theta) shat(theta):D'`` of the yield
    section serves as both (maximum dissipation); otherwise ``k`` at the Lode angle of ``D'`` and a fixed ``beta``.
    """
    if is_circular(b.code):
        g = slope_over_sine(b.code, b.sin, 0.0)
        return g, (g * b.sin if b.associative else b.beta)
    r = np.sqrt(np.sum(x * x))
    det = _unit_determinant(x, r) if r > 0.0 else 0.0
    if not b.associative:
        return slope_over_sine(b.code, b.sin, det), b.beta
    _, _, g, _, _ = normal(b.code, b.sin, det)
    return g, g * b.sin


@kernel
def powers(b: Pile, x: Array) -> tuple[float, float, float]:
    """``P1, P2, P3`` of a direction ``x[5]``, ``|x| <= 1``."""
    g, beta = slope_of_flow(b, x)
    k = g * b.sin
    kc = g * b.cohesion
    d = np.empty(6)
    rate_of_strain(x, beta, d)
    _, f2, f3 = energy_derivatives(b.s[0], b.s[1], b.s[2], b.one, b.two, b.three, b.spin, d)
    p1 = MASS * (np.sum(b.stress * x) - k * b.pressure - kc)
    p2 = -f2 + MASS * beta * ((k - beta) * (b.kappa - b.pressure) - kc)
    p3 = -f3 - MASS * beta * beta * ((k - beta) * (b.pressure - 2.0 * b.kappa) + kc)
    return p1, p2, p3


@kernel
def second_order(p1: float, p2: float) -> tuple[float, float]:
    """Critical energy ``P1^2/(2 P2)`` and strain ``-P1/P2``; inf where ``P2 <= 0``."""
    if p1 >= 0.0:
        return 0.0, 0.0
    if p2 <= 0.0:
        return np.inf, np.inf
    return 0.5 * p1 * p1 / p2, -p1 / p2


@kernel
def third_order(p1: float, p2: float, p3: float) -> tuple[float, float]:
    """Critical energy and strain with ``P3``: first ``t > 0`` at which ``P1 + t P2 + t^2/2 P3 = 0``."""
    if p1 >= 0.0:
        return 0.0, 0.0
    root = p2 * p2 - 2.0 * p1 * p3
    if root < 0.0:
        return np.inf, np.inf
    # t = -2 P1/(P2 + sqrt(root)): the smaller positive root, without cancellation
    q = p2 + np.sqrt(root)
    if q <= 0.0:
        return np.inf, np.inf
    t = -2.0 * p1 / q
    return -t * (p1 + t * (p2 / 2.0 + t * p3 / 6.0)), t


@kernel
def _grown(beta: float, t: float) -> tuple[float, float]:
    """``int_0^t e^(beta t) dt`` and ``int_0^t t e^(beta t) dt``."""
    z = beta * t
    if z > 1e-2:
        grown = np.expm1(z) / beta
        return grown, (t * np.exp(z) - grown) / beta
    grown = t * (1.0 + z / 2.0 + z**2 / 6.0 + z**3 / 24.0 + z**4 / 120.0 + z**5 / 720.0)
    return grown, t * t * (0.5 + z / 3.0 + z**2 / 8.0 + z**3 / 30.0 + z**4 / 144.0 + z**5 / 840.0)


class Work(NamedTuple):
    """Work of the stress per volume and strain along a path: ``hard - soft t`` up to ``t = loose``, then `left`.

    With a plastic bulk modulus the pressure falls to that of the apex, ``p = -Y cot(phi)``, and no further.
    """

    beta: float
    hard: float
    soft: float
    loose: float
    left: float


@kernel
def _rate(w: Work, t: float) -> float:
    """Power of the stress at strain `t`, with the volume growing."""
    return MASS * np.exp(w.beta * t) * (w.hard - w.soft * t if t < w.loose else w.left)


@kernel
def _work(w: Work, t: float) -> float:
    """``int_0^t V sigma*:D dt``."""
    early = min(t, w.loose)
    grown, softened = _grown(w.beta, early)
    work = w.hard * grown - w.soft * softened
    if t > w.loose:
        work += w.left * (_grown(w.beta, t)[0] - grown)
    return MASS * work


@kernel
def _path(b: Pile, x: Array, rates: Array, frame: Array) -> Work:
    """Set the path of a direction, and the work of the stress along it."""
    g, beta = slope_of_flow(b, x)
    k = g * b.sin
    d = np.empty(6)
    rate_of_strain(x, beta, d)
    path_frame(b.s[0], b.s[1], b.s[2], d, rates, frame)
    kc = g * b.cohesion
    if b.associative:
        return Work(beta, kc, 0.0, np.inf, kc)
    soft = (k - beta) * b.kappa * beta
    if soft <= 0.0:
        return Work(beta, (k - beta) * b.pressure + kc, 0.0, np.inf, kc)
    return Work(
        beta, (k - beta) * b.pressure + kc, soft, (b.pressure + kc / k) / (b.kappa * beta), beta * kc / k
    )


@kernel
def loss_at(b: Pile, x: Array, t: float) -> float:
    """Energy lost at strain `t`: ``Phi(t) - Phi(0) + int V sigma*:D dt`` along ``F = exp(L t)``."""
    rates = np.empty(3)
    frame = np.empty((3, 3))
    work = _path(b, x, rates, frame)
    shape = np.empty(6)
    rate = np.empty(6)
    phi0, _, _ = energy_along(rates, frame, b.momentum, 0.0, shape, rate)
    phi, _, _ = energy_along(rates, frame, b.momentum, t, shape, rate)
    return phi - phi0 + _work(work, t)


@kernel
def barrier(b: Pile, x: Array, longest: float, enough: float) -> tuple[float, float]:
    """First maximum of ``Phi(t) - Phi(0) + int V sigma*:D dt`` along ``F = exp(L t)``, and the strain there.

    The path ends where the axis ratio passes :data:`EDGE` and the homogeneous model with it: the loss there counts
    as the maximum. Where the loss grows up to the strain `longest` without either: ``-Phi(0)`` at infinite strain
    if the flow dissipates nothing (associative, no cohesion), the energy that disperses the body; inf if it does.
    A loss above `enough` is returned as it is met: the barrier is at least that high.
    The maximum is the first zero of the exact slope, bracketed by steps of :data:`STEP`, and at the loss of
    pressure, and refined by the Illinois rule.
    """
    rates = np.empty(3)
    frame = np.empty((3, 3))
    work = _path(b, x, rates, frame)
    shape = np.empty(6)
    rate = np.empty(6)
    phi0, slope, ratio2 = energy_along(rates, frame, b.momentum, 0.0, shape, rate)
    edge = max(EDGE * EDGE, BEYOND_EDGE * ratio2)
    t0 = 0.0
    y0 = slope + _rate(work, 0.0)
    if y0 <= 0.0:
        return 0.0, 0.0
    t1 = 0.0
    y1 = y0
    phi = phi0
    ratio0 = ratio2
    while y1 > 0.0:
        t0 = t1
        y0 = y1
        t1 = t0 + STEP
        if t0 < work.loose < t1:
            t1 = work.loose
        if t0 >= longest:
            return (-phi0 if work.hard <= 0.0 and phi0 < 0.0 else np.inf), np.inf
        phi, slope, ratio2 = energy_along(rates, frame, b.momentum, t1, shape, rate)
        if ratio2 > edge:
            a = t0
            fa = np.log(ratio0 / edge)
            fb = np.log(ratio2 / edge)
            side = 0
            for _ in range(30):
                t = (a * fb - t1 * fa) / (fb - fa)
                phi, slope, ratio2 = energy_along(rates, frame, b.momentum, t, shape, rate)
                f = np.log(ratio2 / edge)
                if abs(f) < 1e-9:
                    break
                if f < 0.0:
                    a = t
                    fa = f
                    fb *= 0.5 if side < 0 else 1.0
                    side = -1
                else:
                    t1 = t
                    fb = f
                    fa *= 0.5 if side > 0 else 1.0
                    side = 1
            t1 = t
            if slope + _rate(work, t1) > 0.0:
                return phi - phi0 + _work(work, t1), t1
        ratio0 = ratio2
        y1 = slope + _rate(work, t1)
        if y1 > 0.0:
            lost = phi - phi0 + _work(work, t1)
            if lost > enough:
                return lost, t1
    t = t1
    side = 0
    for _ in range(40):
        t = (t0 * y1 - t1 * y0) / (y1 - y0)
        phi, slope, _ = energy_along(rates, frame, b.momentum, t, shape, rate)
        y = slope + _rate(work, t)
        # the error of the maximum is of second order
        if abs(y) <= 1e-8 * MASS or t1 - t0 < 1e-8:
            break
        if y > 0.0:
            t0 = t
            y0 = y
            y1 *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            t1 = t
            y1 = y
            y0 *= 0.5 if side < 0 else 1.0
            side = -1
    return phi - phi0 + _work(work, t), t
