"""Jacobian of plastic flow in closed form, for the implicit steps.

The motion is ``Ldot = R - T S^-1`` with ``R = K - L^2``, ``T = -P + F N + q X``, ``F = P sin(phi) + c cos(phi)``. The
multipliers ``P, q`` follow from two conditions: ``B:Ldot`` is the rate of the fading dilation and, on a face of
Mohr-Coulomb, ``X:Ldot = 0`` (:func:`flybystab.core.dynamics.rates.deformation_rate`). For a change of the state, the
change ``dLdot`` obeys the linearised system with the same coefficients:

    dLdot = M + dP (1 - sin N) S^-1 - dq X S^-1,    M = dR - T dS^-1 - (F dN + dC N + q dX) S^-1,
    B:dLdot = d(fading) - dB:Ldot,    X:dLdot = -dX:Ldot.

``N`` is an isotropic function of the direction ``u`` of ``D'``, ``a u + b (u^2 - 1/3)`` with ``a, b`` functions of
``det u``. Difference quotients are used only for the derivatives of ``a`` and ``b``, of ``d beta/dV`` and of the tide.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.dynamics.state import (
    J_ACROSS,
    J_CHANGE,
    J_FACE,
    J_NORMAL,
    J_PRODUCT,
    J_RATE,
    J_SLIP,
    J_SQUARE,
    J_STRESS,
    J_TURN,
    J_UNIT,
    OTHER,
    PLACE,
    PRESSURE,
    TIDE,
    UNIT,
    VOLUME,
    W_A,
    W_B,
    W_L,
    W_N,
    W_S,
    W_SINV,
    Buffers,
    gradient,
)
from flybystab.core.ellipsoid.self_gravity import gravity_derivative
from flybystab.core.ellipsoid.tide import COMPONENTS, TidePanels, tide_at
from flybystab.core.material.flow_rule import dilatancy, flow_coefficients, isotropic
from flybystab.core.material.parameters import FACE, MaterialParameters
from flybystab.core.material.yield_surface import corner
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.tensors import contract, deviator, multiply, unpack
from flybystab.typing import Array

#: Step of the difference quotients in ``det u``, over the largest value of ``det u`` (`_LARGEST`).
_STEP = 1e-7
_LARGEST = 1.0 / (3.0 * np.sqrt(6.0))


class _Stress(NamedTuple):
    """Stress of the flow at the state of the Jacobian, and its derivatives by ``det u``."""

    norm: float  # |D'|
    trace_d: float
    factor: float  # F
    cohesive: float  # c cos(phi)
    a: float  # of N = a u + b (u^2 - 1/3); da, db by det u
    b: float
    da: float
    db: float
    xa: float  # of X in the same form
    xb: float
    dxa: float
    dxb: float
    multiplier: float  # q
    beta: float
    dbeta: float
    d2beta: float
    weight: float  # dilation over beta |D'|
    dsupport: float
    u_rate: float  # gradient of the support along the rate of D


class _Conditions(NamedTuple):
    """Coefficients of the conditions on ``dP, dq``; ``xx`` is zero unless the stress is on a face."""

    bv: float  # B:(1 - sin N) S^-1
    bx: float  # B:X S^-1
    xv: float  # X:(1 - sin N) S^-1
    xx: float  # X:X S^-1


@kernel
def _solve_column(j: int, fading: float, slip: float, system: _Conditions, work: Buffers, out: Array) -> None:
    """Write column `j` of ``out[15, 16]`` from ``M`` and the right-hand sides of the two conditions on ``dP, dq``."""
    m, pull, across = work.m[J_CHANGE], work.m[J_SLIP], work.m[J_ACROSS]
    r = fading - contract(work.m[W_B], m)
    dp = r / system.bv
    dq = 0.0
    if system.xx != 0.0:
        r2 = slip - contract(work.m[J_FACE], m)
        det = system.bx * system.xv - system.bv * system.xx
        dp = (system.bx * r2 - system.xx * r) / det
        dq = (system.bv * r2 - system.xv * r) / det
    for i in range(3):
        for k in range(3):
            m[i, k] += dp * pull[i, k] - dq * across[i, k]
    for c in range(6):
        i, k = COMPONENTS[c]
        out[6 + c, j] = 0.5 * (m[i, k] + m[k, i])
    out[12, j] = 0.5 * (m[2, 1] - m[1, 2])
    out[13, j] = 0.5 * (m[0, 2] - m[2, 0])
    out[14, j] = 0.5 * (m[1, 0] - m[0, 1])


@kernel
def _shape_rows(j: int, a: Array, out: Array) -> None:
    """Components of ``a + a^T`` in the rows of ``Sdot``."""
    for c in range(6):
        i, k = COMPONENTS[c]
        out[c, j] = a[i, k] + a[k, i]


@inlined
def _stress(y: Array, f0: Array, material: MaterialParameters, work: Buffers) -> _Stress:
    """Stress of the flow ``y[15]`` with the rate ``f0[15]``; fills `work` with ``u``, ``N``, ``X``, ``N S^-1``..."""
    sinv, n, rate = work.m[W_SINV], work.m[W_N], work.m[J_RATE]
    u, x = work.m[J_UNIT], work.m[J_FACE]
    volume = work.s[VOLUME]
    gradient(f0, rate)
    unit = work.c[UNIT]
    _, norm, det = deviator(y[6:12], unit)
    unpack(unit, u)
    isotropic(0.0, 1.0, unit, work.m[J_SQUARE])
    shift = -_STEP * _LARGEST if det > 0.0 else _STEP * _LARGEST
    a0, b0, support, _, _ = flow_coefficients(det, material)
    a1, b1, support1, _, _ = flow_coefficients(det + shift, material)
    da, db, dsupport = (a1 - a0) / shift, (b1 - b0) / shift, (support1 - support) / shift
    isotropic(a0, b0, unit, n)
    multiply(n, sinv, work.m[W_A])
    sin = material.sin_phi
    cohesive = material.cos_phi * material.cohesion * volume
    factor = sin * work.s[PRESSURE] + cohesive
    xa = xb = dxa = dxb = multiplier = 0.0
    if material.part == FACE:
        xa, xb, _, _, _ = corner(sin, det, False)
        dxa, dxb, _, _, _ = corner(sin, det + shift, False)
        dxa, dxb = (dxa - xa) / shift - da, (dxb - xb) / shift - db
        xa, xb = xa - a0, xb - b0
        isotropic(xa, xb, unit, x)
        multiply(x, sinv, work.m[J_ACROSS])
        multiplier = factor * work.s[PLACE] if factor != 0.0 else 0.0
    beta, dbeta = dilatancy(volume, material)
    _, next_dbeta = dilatancy(volume * (1.0 + 1e-7), material)
    d2beta = (next_dbeta - dbeta) / (1e-7 * volume)
    weight = support * sin if material.normal else 1.0
    u_rate = sin * contract(n, rate) if material.normal else contract(u, rate)
    return _Stress(
        norm, y[6] + y[7] + y[8], factor, cohesive, a0, b0, da, db, xa, xb, dxa, dxb, multiplier,
        beta, dbeta, d2beta, weight, dsupport, u_rate,
    )  # fmt: skip


@inlined
def _conditions(f: _Stress, material: MaterialParameters, work: Buffers) -> _Conditions:
    """Coefficients of ``dP, dq``; fills `work` with ``B = 1 - beta U``, ``(1 - sin N) S^-1`` and ``T S^-1``."""
    sinv, n, b, u = work.m[W_SINV], work.m[W_N], work.m[W_B], work.m[J_UNIT]
    x, across, slip, ns, ts = work.m[J_FACE], work.m[J_ACROSS], work.m[J_SLIP], work.m[W_A], work.m[J_STRESS]
    sin, pressure = material.sin_phi, work.s[PRESSURE]
    face = material.part == FACE
    for i in range(3):
        for k in range(3):
            b[i, k] = -f.beta * (sin * n[i, k] if material.normal else u[i, k])
            slip[i, k] = sinv[i, k] - sin * ns[i, k]
            ts[i, k] = f.factor * ns[i, k] - pressure * sinv[i, k]
            if face:
                ts[i, k] += f.multiplier * across[i, k]
        b[i, i] += 1.0
    if not face:
        return _Conditions(contract(b, slip), 0.0, 0.0, 0.0)
    return _Conditions(contract(b, slip), contract(b, across), contract(x, slip), contract(x, across))


@inlined
def _shape_columns(
    y: Array, f: _Stress, system: _Conditions, work: Buffers, jac: Array, gravity: Array
) -> None:
    """Columns of ``S``: ``M = -2 dGamma - dC N S^-1 + T S^-1 H S^-1``; ``gravity[6, 15]`` is scratch."""
    sinv, big_l, ns, ts = work.m[W_SINV], work.m[W_L], work.m[W_A], work.m[J_STRESS]
    m, turn = work.m[J_CHANGE], work.m[J_TURN]
    volume = work.s[VOLUME]
    gravity_derivative(y[0:6], sinv, volume * volume, gravity)
    for c in range(6):
        p, q = COMPONENTS[c]
        off = 1.0 if c > 2 else 0.0
        dvolume = volume * (0.5 + 0.5 * off) * sinv[p, q]
        unpack(gravity[c], m)
        for i in range(3):
            for k in range(3):
                m[i, k] = (
                    ts[i, p] * sinv[q, k]
                    + off * ts[i, q] * sinv[p, k]
                    - 2.0 * m[i, k]
                    - f.cohesive * dvolume / volume * ns[i, k]
                )
        fading = (f.d2beta * volume + f.dbeta) * dvolume * f.trace_d * f.norm * f.weight
        fading += f.dbeta * dvolume * f.u_rate
        _solve_column(c, fading, 0.0, system, work, jac)
        for i in range(3):
            for k in range(3):
                turn[i, k] = 0.0
            turn[i, q] += big_l[i, p]
            turn[i, p] += off * big_l[i, q]
        _shape_rows(c, turn, jac)


@inlined
def _strain_terms(
    f: _Stress,
    material: MaterialParameters,
    volume: float,
    u: Array,
    square: Array,
    rate: Array,
    turn: Array,
    product: Array,
    dn: Array,
) -> tuple[float, float]:
    """Write ``F dN + q dX`` into ``dn[3, 3]`` for a change `turn` of ``D``, which is replaced by that of ``u``.

    `u`, `square` and `rate` are ``u``, ``u^2 - 1/3`` and the rate of the velocity gradient; `product` is scratch.
    Returns the right-hand sides of the two conditions.
    """
    x_rate = 0.0
    dnorm = contract(u, turn)
    trace = turn[0, 0] + turn[1, 1] + turn[2, 2]
    # du, then u du
    for i in range(3):
        for k in range(3):
            turn[i, k] = (turn[i, k] - dnorm * u[i, k] - (trace / 3.0 if i == k else 0.0)) / f.norm
    multiply(u, turn, product)
    ddet = contract(square, turn)
    for i in range(3):
        for k in range(3):
            sides = product[i, k] + product[k, i]
            dn[i, k] = ddet * (f.da * u[i, k] + f.db * square[i, k]) + f.a * turn[i, k] + f.b * sides
    dweight = f.dsupport * ddet * material.sin_phi if material.normal else 0.0
    du_rate = material.sin_phi * contract(dn, rate) if material.normal else contract(turn, rate)
    fading = (
        f.dbeta * volume * (trace * f.norm * f.weight + f.trace_d * (dnorm * f.weight + f.norm * dweight))
        + f.beta * du_rate
    )
    for i in range(3):
        for k in range(3):
            dn[i, k] *= f.factor
    if material.part == FACE:
        for i in range(3):
            for k in range(3):
                sides = product[i, k] + product[k, i]
                dx = ddet * (f.dxa * u[i, k] + f.dxb * square[i, k]) + f.xa * turn[i, k] + f.xb * sides
                x_rate -= dx * rate[i, k]
                dn[i, k] += f.multiplier * dx
    return fading, x_rate


@inlined
def _gradient_columns(
    f: _Stress, material: MaterialParameters, system: _Conditions, work: Buffers, jac: Array, one: Array
) -> None:
    """Columns of ``D`` and ``w``: ``M = -(G L + L G) - (F dN + q dX) S^-1``; ``one[15]`` is scratch."""
    s, sinv, big_l, u, square = work.m[W_S], work.m[W_SINV], work.m[W_L], work.m[J_UNIT], work.m[J_SQUARE]
    m, turn, product = work.m[J_CHANGE], work.m[J_TURN], work.m[J_PRODUCT]
    dn, rate, volume = work.m[J_NORMAL], work.m[J_RATE], work.s[VOLUME]
    for i in range(15):
        one[i] = 0.0
    for j in range(6, 15):
        one[j] = 1.0
        gradient(one, turn)
        one[j] = 0.0
        multiply(turn, s, product)
        _shape_rows(j, product, jac)
        multiply(turn, big_l, m)
        multiply(big_l, turn, product)
        for i in range(3):
            for k in range(3):
                m[i, k] = -m[i, k] - product[i, k]
        fading = 0.0
        x_rate = 0.0
        if j < 12:
            fading, x_rate = _strain_terms(f, material, volume, u, square, rate, turn, product, dn)
            multiply(dn, sinv, product)
            for i in range(3):
                for k in range(3):
                    m[i, k] -= product[i, k]
        _solve_column(j, fading, x_rate, system, work, jac)


@kernel
def flow_jacobian(
    t: float,
    y: Array,
    f0: Array,
    dt: float,
    material: MaterialParameters,
    tide: TidePanels,
    work: Buffers,
    jac: Array,
    scratch: Array,
) -> None:
    """Jacobian of plastic flow ``jac[15, 16]``, the last column of which is the derivative in time.

    `work` must hold the gravity terms, the tide and the pressure of the preceding ``rate(FLOWING, t, y, f0, ...)``.
    `dt` is the step of the difference quotient of the tide; ``scratch[15, 15]`` is overwritten.
    """
    stress = _stress(y, f0, material, work)
    system = _conditions(stress, material, work)
    _shape_columns(y, stress, system, work, jac, scratch[0:6])
    _gradient_columns(stress, material, system, work, jac, scratch[6])
    # t: M is the change of the tide
    before, after = work.c[TIDE], work.c[OTHER]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t + dt, after)
    for i in range(6):
        after[i] = (after[i] - before[i]) / dt
        jac[i, 15] = 0.0
    unpack(after, work.m[J_CHANGE])
    _solve_column(15, 0.0, 0.0, system, work, jac)
