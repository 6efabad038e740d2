"""Critical energy of a perturbation of a granular ellipsoid, along one direction of strain.

A perturbation is a rate of strain ``D = sum_a x_a E_a + (beta/3) 1`` held for a time ``t`` (theory, section 5), with
``E_a`` an orthonormal basis of the deviators and ``|x| = 1``: ``e t`` is then the strain. Its kinetic energy is

    K(t) - K(0) = t P1 + t^2/2 P2 + t^3/6 P3 + ...,    P_n = -(d/dt)^n Phi - (d/dt)^(n-1) (V sigma*:D)   at t = 0

with the power of the stress ``V sigma*:D`` of :mod:`flybystab.core.energy.flow_work`, that is with the reaction
pressure of the flow, not that of the equilibrium. At the start ``-Phi' = V sigma_eq:D``.

Associative flow (``beta = k``, for a slope ``k(theta)`` the support function of the yield section) also admits the
apex of the yield surface, ``tr D > k |D'|``: that is ``|x| < 1`` at ``tr D = k``, the same formulas on the ball
instead of the sphere.

A constant ``D`` is a constraint: the least barrier over these paths is an upper bound of the least over all paths.

Units as in :mod:`flybystab.core.energy.potential`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.ellipsoid.potential import index_symbols
from flybystab.core.ellipsoid.rigid_stress import overload, rigid_stress
from flybystab.core.energy.flow_work import (
    FADE_BEGINS,
    Flow,
    depends_on_pressure,
    gauss,
    gauss_up_to,
    growth_at,
    power,
    power_derivatives,
    volume_at,
)
from flybystab.core.energy.potential import (
    MASS,
    PrincipalAxes,
    energy_along,
    energy_derivatives,
    path_frame,
    principal_axes,
    velocity_gradient,
)
from flybystab.core.material.flow_rule import isotropic
from flybystab.core.material.yield_surface import (
    SQRT6,
    is_circular,
    least_slope,
    normal,
    slope_over_sine,
)
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

SQRT2 = np.sqrt(2.0)

#: Tidal tensor of a free body.
NO_TIDE = np.zeros(6)

#: Largest strain up to which a barrier is searched.
LONGEST = 3.0

#: Steps of strain in which its maximum is bracketed.
STEP = 0.2

#: Largest axis ratio of the homogeneous model; the square of one that is larger at the start may grow by this factor.
LARGEST_AXIS_RATIO = 6.0
LARGER_AXIS_RATIO2 = 1.002


class Ellipsoid(NamedTuple):
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
    kappa: float  # plastic bulk modulus; 0: the pressure is the reaction to the flow rule


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
def ellipsoid(
    s1: float,
    s2: float,
    s3: float,
    spin: Array,
    code: int,
    phi: float,
    cohesion: float,
    dilatancy: float,
    kappa: float,
) -> Ellipsoid:
    """The ellipsoid with its equilibrium stress; `s_i` of any scale, other quantities in the units of this module.

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
    return Ellipsoid(
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
def slope_of_flow(b: Ellipsoid, x: Array) -> tuple[float, float]:
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
def flow_along(b: Ellipsoid, x: Array) -> Flow:
    """Quantities on which the power of the stress depends in a direction ``x[5]``, ``|x| <= 1``."""
    r = np.sqrt(np.sum(x * x))
    det = _unit_determinant(x, r) if r > 0.0 else 0.0
    size, trace = slope_of_flow(b, x)
    first, second = size, 0.0
    share = b.sin
    if not b.associative:
        share = b.beta / size
    elif not is_circular(b.code):
        first, second, _, _, _ = normal(b.code, b.sin, det)
    d = np.empty(6)
    rate_of_strain(x, 0.0, d)
    if r > 0.0:
        d /= r
    section = np.empty((3, 3))
    kappa = 0.0 if b.associative else b.kappa
    isotropic(first, second, d, section)
    return Flow(
        section, size, r if b.associative else 1.0, trace, share, b.sin, b.cohesion, kappa, b.pressure
    )


@kernel
def powers(b: Ellipsoid, x: Array) -> tuple[float, float, float]:
    """``P1, P2, P3`` of a direction ``x[5]``, ``|x| <= 1``; minus infinity, 0, 0 in a jam."""
    flow = flow_along(b, x)
    d = np.empty(6)
    rate_of_strain(x, flow.trace, d)
    _, f2, f3 = energy_derivatives(b.s[0], b.s[1], b.s[2], b.one, b.two, b.three, b.spin, d)
    w0, w1, w2 = power_derivatives(flow, b.s, b.one, b.two, b.three, b.spin, d)
    if not w0 < np.inf:
        return -np.inf, 0.0, 0.0
    return MASS * (np.sum(b.stress * x) - b.pressure * flow.trace) - w0, -f2 - w1, -f3 - w2


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


class Path(NamedTuple):
    """A path of constant direction: flow, deformation, and the body at the last instant that was evaluated."""

    flow: Flow
    gradient: Array  # the traceless part of L
    rates: Array
    frame: Array
    axes: PrincipalAxes


@kernel
def path_along(b: Ellipsoid, x: Array) -> Path:
    """Path of a direction ``x[5]``."""
    flow = flow_along(b, x)
    d = np.empty(6)
    rate_of_strain(x, 0.0, d)
    rates = np.empty(3)
    frame = np.empty((3, 3))
    path_frame(b.s[0], b.s[1], b.s[2], d, rates, frame)
    gradient = np.empty((3, 3))
    velocity_gradient(b.s[0], b.s[1], b.s[2], d, gradient)
    return Path(flow, gradient, rates, frame, principal_axes())


@kernel
def state_at(b: Ellipsoid, path: Path, t: float) -> tuple[float, float, float]:
    """``Phi``, the loss of kinetic energy per strain in slow flow, and the squared axis ratio at strain `t`."""
    volume = volume_at(path.flow.trace, t)
    growth = growth_at(path.flow.trace, volume)
    phi, slope, ratio2 = energy_along(path.rates, path.frame, b.momentum, t, volume, growth, path.axes)
    return phi, slope + power(path.flow, volume, path.gradient, path.axes, NO_TIDE)[0], ratio2


@kernel
def mobility(path: Path, t: float, volume: float, growth: float) -> float:
    """``tr(L S L^T) M/5``: twice the kinetic energy at unit rate of strain."""
    total = 0.0
    for k in range(3):
        f = path.frame[:, k]
        rate = path.rates[k] + growth / 3.0
        total += rate * rate * np.exp(2.0 * path.rates[k] * t) * (f[0] * f[0] + f[1] * f[1] + f[2] * f[2])
    return MASS / 5.0 * np.cbrt(volume * volume) * total


@kernel
def _work(b: Ellipsoid, path: Path, start: float, end: float, inertia: float) -> tuple[float, float]:
    """Work of the stress between two strains, by Gauss' rule between the kinks of its power.

    Along the path the kinetic energy obeys ``dK/dt = -y - w K`` with the loss ``y`` of slow flow and the contribution
    ``w`` of inertia to the pressure. The energy at the start with which a strain is reached at rest is therefore
    ``int y exp(int w dt) dt``. `inertia` is ``int w dt`` up to `start`; negative: ``w`` is neglected. Its value at the
    end is also returned.
    """
    flow = path.flow
    trace = flow.trace
    fading = np.log(FADE_BEGINS) / trace if trace > 0.0 else np.inf
    loose = np.inf  # strain at which the pressure of a softening material is zero
    if flow.kappa > 0.0 and trace > 0.0 and flow.sin > 0.0:
        loose = (flow.pressure + flow.cohesion / flow.sin) / (flow.kappa * trace)
    work = 0.0
    added = np.zeros(3)
    lost = np.zeros(3)
    for piece in range(3):
        a = start if piece == 0 else max(start, min(fading, loose) if piece == 1 else max(fading, loose))
        z = (
            min(end, min(fading, loose))
            if piece == 0
            else (min(end, max(fading, loose)) if piece == 1 else end)
        )
        if z <= a:
            continue
        h = z - a
        reacts = False
        for i in range(3):
            node, weight = gauss(i)
            t = a + node * h
            volume = volume_at(trace, t)
            growth = growth_at(trace, volume)
            slope = 0.0
            if depends_on_pressure(flow, volume):
                _, slope, _ = energy_along(path.rates, path.frame, b.momentum, t, volume, growth, path.axes)
                reacts = True
            rate, square = power(flow, volume, path.gradient, path.axes, NO_TIDE)
            work += weight * h * rate
            lost[i] = slope + rate
            added[i] = 2.0 * square / mobility(path, t, volume, growth) if square != 0.0 else 0.0
        if reacts and inertia >= 0.0:
            for i in range(3):
                _, weight = gauss(i)
                work += weight * h * lost[i] * np.expm1(inertia + h * gauss_up_to(i, added))
            inertia = max(0.0, inertia + h * (gauss(0)[1] * (added[0] + added[2]) + gauss(1)[1] * added[1]))
    return work, inertia


@kernel
def loss_at(b: Ellipsoid, x: Array, t: float, slow: bool) -> float:
    """Energy needed to reach strain `t`; `slow`: ``Phi(t) - Phi(0) + int V sigma*:D dt`` without inertia."""
    path = path_along(b, x)
    phi0, _, _ = state_at(b, path, 0.0)
    phi, _, _ = state_at(b, path, t)
    pieces = max(1, int(np.ceil(abs(t) / STEP)))
    total = 0.0
    inertia = -1.0 if slow else 0.0
    for i in range(pieces):
        start, end = abs(t) * i / pieces, abs(t) * (i + 1) / pieces
        if t > 0.0:
            work, inertia = _work(b, path, start, end, inertia)
            total += work
        else:
            total -= _work(b, path, -end, -start, inertia)[0]
    return phi - phi0 + total


@kernel
def loss_rate(b: Ellipsoid, x: Array, t: float) -> float:
    """Loss of kinetic energy per strain in slow flow at strain `t`."""
    return state_at(b, path_along(b, x), t)[1]


@kernel
def _strain_at_ratio(
    b: Ellipsoid, path: Path, a: float, z: float, ratio2_a: float, ratio2_z: float, limit2: float
) -> float:
    """Strain between `a` and `z` at which the squared axis ratio is `limit2` (Illinois rule)."""
    fa, fz = np.log(ratio2_a / limit2), np.log(ratio2_z / limit2)
    side = 0
    t = z
    for _ in range(30):
        t = (a * fz - z * fa) / (fz - fa)
        _, _, ratio2 = state_at(b, path, t)
        f = np.log(ratio2 / limit2)
        if abs(f) < 1e-9:
            break
        if f < 0.0:
            a = t
            fa = f
            fz *= 0.5 if side < 0 else 1.0
            side = -1
        else:
            z = t
            fz = f
            fa *= 0.5 if side > 0 else 1.0
            side = 1
    return t


@kernel
def _strain_at_maximum(
    b: Ellipsoid, path: Path, a: float, z: float, rate_a: float, rate_z: float
) -> tuple[float, float]:
    """Zero of the loss rate of slow flow between the strains `a` and `z` (Illinois rule), and ``Phi`` there."""
    side = 0
    t = z
    phi = 0.0
    for _ in range(40):
        t = (a * rate_z - z * rate_a) / (rate_z - rate_a)
        phi, y, _ = state_at(b, path, t)
        # the error of the maximum is of second order
        if abs(y) <= 1e-8 * MASS or z - a < 1e-8:
            break
        if y > 0.0:
            a = t
            rate_a = y
            rate_z *= 0.5 if side > 0 else 1.0
            side = 1
        else:
            z = t
            rate_z = y
            rate_a *= 0.5 if side < 0 else 1.0
            side = -1
    return t, phi


@kernel
def overload_at(b: Ellipsoid, path: Path, t: float) -> float:
    """Overload of the body at rest, with its angular momentum, at strain `t` of a path."""
    state_at(b, path, t)
    volume = volume_at(path.flow.trace, t)
    spin = np.empty(3)
    for k in range(3):
        spin[k] = np.sum(path.axes.vectors[:, k] * path.axes.spin)
    q = path.axes.squares
    stress = np.empty(6)
    rigid_stress(q[0], q[1], q[2], 1.0 / volume, 1.0 / volume, spin, np.zeros(6), stress)
    phi = np.arcsin(b.sin)
    return overload(b.code, phi, b.cohesion / np.cos(phi), stress)


@kernel
def _flows_on(b: Ellipsoid, path: Path, t0: float, t1: float, y0: float, y1: float) -> bool:
    """True if slow flow continues without supply of energy between two strains with the loss rates `y0` and `y1`.

    With a plastic bulk modulus, for which the pressure at rest is that of the flow, this is always so.
    """
    if path.flow.kappa > 0.0:
        return True
    tolerance = 1e-9 * max(abs(b.pressure), b.cohesion)
    if y1 <= 0.0:
        return overload_at(b, path, t1) > tolerance
    end = t0 + (t1 - t0) * y0 / (y0 - y1)
    return overload_at(b, path, 0.5 * (t0 + end)) > tolerance or overload_at(b, path, end) > tolerance


@kernel
def barrier(b: Ellipsoid, x: Array, longest: float, enough: float) -> tuple[float, float]:
    """Energy and strain of the barrier along ``F = exp(L t)``: beyond it slow flow continues without supply of energy.

    Apart from the inertia of the flow (see `_work`) the barrier is a maximum of the loss ``Phi(t) - Phi(0) + int V
    sigma*:D dt``, located as a zero of its exact derivative in steps of :data:`STEP`. Beyond it a flow of constant
    direction gains energy. A slow flow, however, turns to the deviator of the stress and stops where the body at rest
    is not overloaded. In associative flow it is always overloaded there; otherwise the pressure of the flow may be
    lower than at rest. Therefore a maximum, or a gain from the start, counts only if the body at rest is overloaded at
    some strain before the loss rises again; else the path is followed further, and the highest maximum counts.

    The path ends where the axis ratio exceeds :data:`LARGEST_AXIS_RATIO`, the limit of the homogeneous model: the loss
    there counts as a maximum. The energy is infinite if the loss grows up to the strain `longest` without either. A
    loss above `enough` is returned as soon as it is found, as a lower bound of the barrier.
    """
    path = path_along(b, x)
    phi0, y1, ratio0 = state_at(b, path, 0.0)
    if y1 <= 0.0 and _flows_on(b, path, 0.0, 0.0, y1, y1):
        return 0.0, 0.0
    limit2 = max(LARGEST_AXIS_RATIO * LARGEST_AXIS_RATIO, LARGER_AXIS_RATIO2 * ratio0)
    top = strain = 0.0  # highest maximum so far
    t1 = 0.0
    work = inertia = 0.0  # up to t1; the exponent of `_work` there
    while True:
        t0, y0 = t1, y1
        before, held = work, inertia
        if not y0 < np.inf or (t0 >= longest and y0 > 0.0):
            return np.inf, np.inf
        if t0 >= longest:
            return top, strain
        t1 = t0 + STEP
        phi, y1, ratio2 = state_at(b, path, t1)
        at_edge = ratio2 > limit2
        if at_edge:
            t1 = _strain_at_ratio(b, path, t0, t1, ratio0, ratio2, limit2)
            phi, y1, ratio2 = state_at(b, path, t1)
        ratio0 = ratio2
        work, inertia = _work(b, path, t0, t1, held)
        work += before
        if y0 > 0.0 and y1 <= 0.0:
            t, phi = _strain_at_maximum(b, path, t0, t1, y0, y1)
            lost = phi - phi0 + before + _work(b, path, t0, t, held)[0]
            if lost > top:
                top, strain = lost, t
        if (y0 <= 0.0 or y1 <= 0.0) and _flows_on(b, path, t0, t1, y0, y1):
            return top, strain
        if y1 > 0.0:
            lost = phi - phi0 + work
            if lost > enough or (at_edge and lost > top):
                return lost, t1
        if at_edge:
            return top, strain
