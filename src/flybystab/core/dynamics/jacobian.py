"""Jacobian of plastic flow in closed form, for the implicit steps.

The motion is ``Ldot = R - T S^-1`` with ``R = K - L^2``, ``T = -P + F N + q X``, ``F = P sin(phi) + c cos(phi)``. Two
multipliers ``P, q`` keep ``B:Ldot`` at the rate of the fading dilation and, on a face of Mohr-Coulomb, ``X:Ldot`` at
zero (:func:`flybystab.core.dynamics.rates.deformation_rate`). The change ``dLdot`` along a change of the state
obeys the same small system once more:

    dLdot = M + dP (1 - sin N) S^-1 - dq X S^-1,    M = dR - T dS^-1 - (F dN + dC N + q dX) S^-1,
    B:dLdot = d(fading) - dB:Ldot,    X:dLdot = -dX:Ldot.

``N`` is an isotropic function of the direction ``u`` of ``D'``, ``a u + b (u^2 - 1/3)`` with ``a, b`` functions of
``det u``: their slopes, that of ``d beta/dV`` and that of the tide in time are the only difference quotients.
"""

from __future__ import annotations

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
    PLACE,
    PRESSURE,
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
from flybystab.core.material.parameters import COHESION, COS_PHI, FACE, NORMAL, PART, SIN_PHI
from flybystab.core.material.yield_surface import corner
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import contract, deviator, multiply, unpack
from flybystab.typing import Array

#: Step of the difference quotients in ``det u``, over its largest value.
_STEP = 1e-7
_LARGEST = 1.0 / (3.0 * np.sqrt(6.0))


@kernel
def _answer(
    j: int, fading: float, slip: float, system: tuple[float, float, float, float], work: Buffers, out: Array
) -> None:
    """Column `j` of ``out[15, 16]`` from ``M`` and the right sides of the two conditions; solves for ``dP, dq``.

    `system` holds ``B:(1 - sin N) S^-1``, ``B:X S^-1``, ``X:(1 - sin N) S^-1`` and ``X:X S^-1``; the last is zero where
    there is no face.
    """
    m, pull, across = work.m[J_CHANGE], work.m[J_SLIP], work.m[J_ACROSS]
    bv, bx, xv, xx = system
    r = fading - contract(work.m[W_B], m)
    dp = r / bv
    dq = 0.0
    if xx != 0.0:
        r2 = slip - contract(work.m[J_FACE], m)
        det = bx * xv - bv * xx
        dp = (bx * r2 - xx * r) / det
        dq = (bv * r2 - xv * r) / det
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


@kernel
def flow_jacobian(
    t: float,
    y: Array,
    f0: Array,
    dt: float,
    par: Array,
    tide: TidePanels,
    work: Buffers,
    jac: Array,
    scratch: Array,
) -> None:
    """Jacobian of plastic flow ``jac[15, 16]``, the last column of which is the derivative in time.

    To be called after ``rate(FLOWING, t, y, f0, ...)``, which leaves the field, the tide and the pressure in
    `work`. `dt` is
    the step of the difference quotient of the tide; ``scratch[15, 15]``.
    """
    s, sinv, big_l = work.m[W_S], work.m[W_SINV], work.m[W_L]
    n, b, rate = work.m[W_N], work.m[W_B], work.m[J_RATE]
    u, square = work.m[J_UNIT], work.m[J_SQUARE]
    ns, across, slip, ts = work.m[W_A], work.m[J_ACROSS], work.m[J_SLIP], work.m[J_STRESS]
    x, m, turn, product, dn = (
        work.m[J_FACE],
        work.m[J_CHANGE],
        work.m[J_TURN],
        work.m[J_PRODUCT],
        work.m[J_NORMAL],
    )
    volume, pressure, place = work.s[VOLUME], work.s[PRESSURE], work.s[PLACE]
    gradient(f0, rate)
    # the stress, and its slopes in det u
    unit = work.c[2]
    _, norm, det = deviator(y[6:12], unit)
    unpack(unit, u)
    isotropic(0.0, 1.0, unit, square)
    shift = -_STEP * _LARGEST if det > 0.0 else _STEP * _LARGEST
    a0, b0, support, _, _ = flow_coefficients(det, par)
    a1, b1, support1, _, _ = flow_coefficients(det + shift, par)
    da, db, dsupport = (a1 - a0) / shift, (b1 - b0) / shift, (support1 - support) / shift
    isotropic(a0, b0, unit, n)
    multiply(n, sinv, ns)
    sin = par[SIN_PHI]
    cohesive = par[COS_PHI] * par[COHESION] * volume
    factor = sin * pressure + cohesive
    face = int(par[PART]) == FACE
    xa = xb = dxa = dxb = share = 0.0
    if face:
        xa, xb, _, _, _ = corner(sin, det, False)
        dxa, dxb, _, _, _ = corner(sin, det + shift, False)
        dxa, dxb = (dxa - xa) / shift - da, (dxb - xb) / shift - db
        xa, xb = xa - a0, xb - b0
        isotropic(xa, xb, unit, x)
        multiply(x, sinv, across)
        share = factor * place if factor != 0.0 else 0.0
    # B = 1 - beta U
    true_normal = par[NORMAL] > 0.0
    beta, dbeta = dilatancy(volume, par)
    _, next_dbeta = dilatancy(volume * (1.0 + 1e-7), par)
    d2beta = (next_dbeta - dbeta) / (1e-7 * volume)
    weight = support * sin if true_normal else 1.0
    trace_d = y[6] + y[7] + y[8]
    u_rate = sin * contract(n, rate) if true_normal else contract(u, rate)
    for i in range(3):
        for k in range(3):
            b[i, k] = -beta * (sin * n[i, k] if true_normal else u[i, k])
            slip[i, k] = sinv[i, k] - sin * ns[i, k]
            ts[i, k] = factor * ns[i, k] - pressure * sinv[i, k]
            if face:
                ts[i, k] += share * across[i, k]
        b[i, i] += 1.0
    system = (contract(b, slip), 0.0, 0.0, 0.0)
    if face:
        system = (system[0], contract(b, across), contract(x, slip), contract(x, across))
    # S: M = -2 dGamma - dC N S^-1 + T S^-1 H S^-1
    gravity, one = scratch[0:6], scratch[6]
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
                    - cohesive * dvolume / volume * ns[i, k]
                )
        fading = (d2beta * volume + dbeta) * dvolume * trace_d * norm * weight + dbeta * dvolume * u_rate
        _answer(c, fading, 0.0, system, work, jac)
        for i in range(3):
            for k in range(3):
                turn[i, k] = 0.0
            turn[i, q] += big_l[i, p]
            turn[i, p] += off * big_l[i, q]
        _shape_rows(c, turn, jac)
    # D and w: M = -(G L + L G) - (F dN + q dX) S^-1
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
        along = 0.0
        if j < 12:
            dnorm = contract(u, turn)
            trace = turn[0, 0] + turn[1, 1] + turn[2, 2]
            # du, then u du
            for i in range(3):
                for k in range(3):
                    turn[i, k] = (turn[i, k] - dnorm * u[i, k] - (trace / 3.0 if i == k else 0.0)) / norm
            multiply(u, turn, product)
            ddet = contract(square, turn)
            for i in range(3):
                for k in range(3):
                    sides = product[i, k] + product[k, i]
                    dn[i, k] = ddet * (da * u[i, k] + db * square[i, k]) + a0 * turn[i, k] + b0 * sides
            dweight = dsupport * ddet * sin if true_normal else 0.0
            du_rate = sin * contract(dn, rate) if true_normal else contract(turn, rate)
            fading = (
                dbeta * volume * (trace * norm * weight + trace_d * (dnorm * weight + norm * dweight))
                + beta * du_rate
            )
            for i in range(3):
                for k in range(3):
                    dn[i, k] *= factor
            if face:
                for i in range(3):
                    for k in range(3):
                        sides = product[i, k] + product[k, i]
                        dx = ddet * (dxa * u[i, k] + dxb * square[i, k]) + xa * turn[i, k] + xb * sides
                        along -= dx * rate[i, k]
                        dn[i, k] += share * dx
            multiply(dn, sinv, product)
            for i in range(3):
                for k in range(3):
                    m[i, k] -= product[i, k]
        _answer(j, fading, along, system, work, jac)
    # t: M is the change of the tide
    before, after = work.c[0], work.c[1]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t + dt, after)
    for i in range(6):
        after[i] = (after[i] - before[i]) / dt
        jac[i, 15] = 0.0
    unpack(after, m)
    _answer(15, 0.0, 0.0, system, work, jac)
