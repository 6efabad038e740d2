"""Rates of the homogeneous ellipsoid in each regime (theory, sections 2 and 3), in the units of the body.

States and parameters are those of :mod:`flybystab.core.dynamics.state`; self-gravity is ``K_g = -2 (V0/V) A(S)``.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.dynamics.state import (
    BEYOND_FACE,
    DETERMINANT,
    FLOWING,
    FLUID,
    OTHER,
    PLACE,
    PRESSURE,
    RIGID,
    STRENGTH,
    TIDE,
    UNIT,
    VOLUME,
    W_A,
    W_B,
    W_FACE,
    W_K,
    W_L,
    W_N,
    W_R,
    W_S,
    W_SCRATCH,
    W_SINV,
    W_VECTORS,
    Buffers,
    Parameters,
    RigidShape,
    gradient,
    rigid_volume,
    rotated_to_body,
    set_gradient,
)
from flybystab.core.ellipsoid.rigid_stress import rigid_load
from flybystab.core.ellipsoid.self_gravity import gravity_tensor
from flybystab.core.ellipsoid.tide import TidePanels, tide_at
from flybystab.core.material.flow_rule import dilatancy, dilation, flow_stress, isotropic
from flybystab.core.material.parameters import FACE, SMOOTH, MaterialParameters
from flybystab.core.material.yield_surface import beyond_face, corner, slope_over_sine
from flybystab.core.numerics.jit import inlined, kernel
from flybystab.core.numerics.tensors import contract, determinant, deviator, inverse, multiply, pack, unpack
from flybystab.typing import Array


@kernel
def rigid_rate(t: float, y: Array, dy: Array, rigid: RigidShape, tide: TidePanels, work: Buffers) -> None:
    """Euler's equations with the tidal torque.

    ``Omegadot_ij = (K - Omega^2)_ij (S_j - S_i)/(S_i + S_j)`` along the body axes, the antisymmetric part
    of ``(Omegadot + Omega^2) S = K S - T``; the quaternion turns at ``qdot = q omega / 2``.
    """
    kt = work.c[TIDE]
    kb = work.c[OTHER]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    rotated_to_body(y, kt, work.m[W_N], kb)
    w0, w1, w2 = y[4], y[5], y[6]
    s1, s2, s3 = rigid.s1, rigid.s2, rigid.s3
    # omega_1 = Omega_32, omega_2 = Omega_13, omega_3 = Omega_21, (Omega^2)_ij = omega_i omega_j for i != j
    dy[4] = (kb[5] - w1 * w2) * (s2 - s3) / (s2 + s3)
    dy[5] = (kb[4] - w0 * w2) * (s3 - s1) / (s3 + s1)
    dy[6] = (kb[3] - w0 * w1) * (s1 - s2) / (s1 + s2)
    dy[0] = 0.5 * (-y[1] * w0 - y[2] * w1 - y[3] * w2)
    dy[1] = 0.5 * (y[0] * w0 + y[2] * w2 - y[3] * w1)
    dy[2] = 0.5 * (y[0] * w1 + y[3] * w0 - y[1] * w2)
    dy[3] = 0.5 * (y[0] * w2 + y[1] * w1 - y[2] * w0)


@kernel
def yield_excess(p: float, norm: float, det: float, volume: float, material: MaterialParameters) -> float:
    """``|s| - k (p + Y cot phi)`` for the stress ``T = 5 sigma/rho``: positive where it is not admissible."""
    g = slope_over_sine(material.surface, material.sin_phi, det)
    return norm - g * (p * material.sin_phi + material.cohesion * volume * material.cos_phi)


@kernel
def rigid_invariants(
    t: float, y: Array, rigid: RigidShape, tide: TidePanels, work: Buffers, stress: Array
) -> tuple[float, float, float]:
    """Pressure, deviator norm, unit determinant of the stress of a RIGID state; sets ``stress[6]``."""
    kt = work.c[TIDE]
    kb = work.c[OTHER]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    rotated_to_body(y, kt, work.m[W_N], kb)
    s = (rigid.s1, rigid.s2, rigid.s3)
    rigid_load(kb, y[4:7], s, (rigid.g1, rigid.g2, rigid.g3), stress)
    return deviator(stress, kt)


@kernel
def rigid_excess(
    t: float, y: Array, par: Parameters, tide: TidePanels, work: Buffers, stress: Array
) -> tuple[float, float, float, float]:
    """Yield excess, pressure, deviator norm, unit determinant of a RIGID state; sets ``stress[6]``."""
    p, norm, det = rigid_invariants(t, y, par.rigid, tide, work, stress)
    # The volume of a rigid body is constant.
    return yield_excess(p, norm, det, rigid_volume(par.rigid), par.material), p, norm, det


@kernel
def gravity_terms(t: float, y: Array, tide: TidePanels, work: Buffers) -> None:
    """Compute the terms of the rates that depend on ``t`` and ``S`` only.

    These are ``S``, ``S^-1``, ``K_g + K_t`` and the volume; writes the tide to ``work.c[TIDE]``.
    """
    unpack(y[0:6], work.m[W_S])
    det = inverse(y[0:6], work.m[W_SINV])
    work.s[VOLUME] = np.sqrt(det)
    k = work.m[W_K]
    gravity_tensor(y[0:6], work.m[W_SINV], det, work.m[W_SCRATCH, 0], work.m[W_VECTORS], k)
    kt = work.c[TIDE]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    # K_g = -2 (V0/V) A = -2 Gamma
    k[0, 0] = kt[0] - 2.0 * k[0, 0]
    k[1, 1] = kt[1] - 2.0 * k[1, 1]
    k[2, 2] = kt[2] - 2.0 * k[2, 2]
    k[0, 1] = k[1, 0] = kt[3] - 2.0 * k[0, 1]
    k[0, 2] = k[2, 0] = kt[4] - 2.0 * k[0, 2]
    k[1, 2] = k[2, 1] = kt[5] - 2.0 * k[1, 2]


@inlined
def _kinematics(y: Array, dy: Array, work: Buffers) -> None:
    """Write ``Sdot`` into ``dy[:6]``, and ``L`` and ``R = K - L^2`` into `work`."""
    big_l = work.m[W_L]
    gradient(y, big_l)
    r = work.m[W_R]
    multiply(big_l, big_l, r)
    for i in range(3):
        for j in range(3):
            r[i, j] = work.m[W_K, i, j] - r[i, j]
    s = work.m[W_S]
    a = work.m[W_A]
    multiply(big_l, s, a)
    # Sdot = L S + S L^T
    dy[0] = 2.0 * a[0, 0]
    dy[1] = 2.0 * a[1, 1]
    dy[2] = 2.0 * a[2, 2]
    dy[3] = a[0, 1] + a[1, 0]
    dy[4] = a[0, 2] + a[2, 0]
    dy[5] = a[1, 2] + a[2, 1]


@inlined
def _face_stress(
    numerator: float, denominator: float, e: float, cohesive: float, sin: float, det_d: float, work: Buffers
) -> tuple[float, float, float]:
    """Pressure, its denominator and the norm of ``N`` of a flow on a face of Mohr-Coulomb.

    ``N = N_e + w X``, where ``X`` is the difference of the stresses at the two corners and ``w`` follows from ``X:Ddot
    = 0``, by which ``D`` stays normal to the face. This eliminates ``F w`` (``F = P sin + c cos``) from the equation of
    the pressure. Subtracts the acceleration ``F w X S^-1`` from ``R``.
    """
    sinv, r, n, b = work.m[W_SINV], work.m[W_R], work.m[W_N], work.m[W_B]
    x, xs = work.m[W_FACE], work.m[W_A]
    p1, p2, _, _, _ = corner(sin, det_d, False)
    isotropic(p1, p2, work.c[UNIT], x)
    for i in range(3):
        for j in range(3):
            x[i, j] -= n[i, j]
    multiply(x, sinv, xs)
    across = contract(x, xs)
    nx_sinv = contract(x, b)
    along = xs[0, 0] + xs[1, 1] + xs[2, 2]
    pull = contract(x, r) - cohesive * nx_sinv
    bx = along - e * nx_sinv
    denominator -= bx * (along - sin * nx_sinv) / across
    numerator += bx * pull / across
    pressure = numerator / denominator
    factor = sin * pressure + cohesive
    multiplier = (pressure * (along - sin * nx_sinv) + pull) / across
    for i in range(3):
        for j in range(3):
            r[i, j] -= multiplier * xs[i, j]
    place = multiplier / factor if factor != 0.0 else np.inf
    work.s[PLACE] = place
    size = 0.0
    third = 0.0
    if factor != 0.0:
        unit = work.c[UNIT]
        for i in range(3):
            for j in range(3):
                x[i, j] = n[i, j] + place * x[i, j]
        pack(x, unit)
        _, size, third = deviator(unit, unit)
    work.s[DETERMINANT] = third
    return pressure, denominator, size


@inlined
def _flow_acceleration(d: Array, material: MaterialParameters, work: Buffers) -> float:
    """Add the acceleration ``-T S^-1`` of plastic flow to ``R``; returns the denominator of the pressure."""
    sinv, r, n, b = work.m[W_SINV], work.m[W_R], work.m[W_N], work.m[W_B]
    volume = work.s[VOLUME]
    trace_sinv = sinv[0, 0] + sinv[1, 1] + sinv[2, 2]
    trace_d = d[0] + d[1] + d[2]
    trace_r = r[0, 0] + r[1, 1] + r[2, 2]
    norm, g, support, det = flow_stress(d, material, work.c[UNIT], n)
    work.s[DETERMINANT] = det
    det_d = 0.0
    if material.part != SMOOTH:
        det_d = determinant(work.c[UNIT])
        work.s[BEYOND_FACE] = beyond_face(material.sin_phi, det_d)
    sin = material.sin_phi
    cohesive = material.cos_phi * material.cohesion * volume
    beta, dbeta = dilatancy(volume, material)
    e = beta * sin if material.normal else beta / g  # E = e N
    multiply(n, sinv, b)
    n_sinv = b[0, 0] + b[1, 1] + b[2, 2]
    nn_sinv = contract(n, b)
    n_r = contract(n, r)
    denominator = trace_sinv - (sin + e) * n_sinv + sin * e * nn_sinv
    fading = dilation(dbeta * volume * trace_d, norm, support, material)
    numerator = fading - trace_r + e * n_r + cohesive * (n_sinv - e * nn_sinv)
    if material.part == FACE:
        pressure, denominator, g = _face_stress(numerator, denominator, e, cohesive, sin, det_d, work)
    else:
        pressure = numerator / denominator
    factor = sin * pressure + cohesive
    for i in range(3):
        for j in range(3):
            r[i, j] += pressure * sinv[i, j] - factor * b[i, j]
    work.s[STRENGTH] = g * factor
    work.s[PRESSURE] = pressure
    return denominator


@inlined
def _viscous_acceleration(d: Array, viscosity: float, work: Buffers) -> None:
    """Add the acceleration ``-T S^-1`` of an incompressible fluid to ``R``."""
    sinv, r, n, b = work.m[W_SINV], work.m[W_R], work.m[W_N], work.m[W_B]
    mu = viscosity * work.s[VOLUME]
    unpack(d, n)
    for i in range(3):
        n[i, i] -= (d[0] + d[1] + d[2]) / 3.0
    multiply(n, sinv, b)
    trace_r = r[0, 0] + r[1, 1] + r[2, 2]
    pressure = (mu * (b[0, 0] + b[1, 1] + b[2, 2]) - trace_r) / (sinv[0, 0] + sinv[1, 1] + sinv[2, 2])
    for i in range(3):
        for j in range(3):
            r[i, j] += pressure * sinv[i, j] - mu * b[i, j]
    work.s[STRENGTH] = mu
    work.s[PRESSURE] = pressure


@kernel
def deformation_rate(regime: int, y: Array, dy: Array, material: MaterialParameters, work: Buffers) -> float:
    """Rate of the 15 numbers after `gravity_terms`; returns the denominator of the pressure (FLOWING), else 1.

    ``Ldot = R - T S^-1``, ``R = K - L^2``, ``T = -P 1 + (P sin + c cos) N``. Radial rule: ``N = Dhat k/sin`` and
    ``E = beta Dhat``; the true normal: ``N`` is the stress with the normal ``Dhat`` and ``E = f sin N`` (the gradient
    of the support, ``f`` the fade of `dilatancy`). The pressure that keeps ``tr D`` at its `dilation` is

        P = [fdot m - B:R + c cos B:(N S^-1)] / [B:((1 - sin N) S^-1)],    B = 1 - E.

    For the true normal with ``f = 1`` the denominator is a sum of squares, so that no jam occurs. On a face of
    Mohr-Coulomb the normal does not determine the stress between the two corners; the equation of motion does, with the
    condition that ``D`` stays normal to the face (two active planes, Koiter 1953), as long as the stress is between the
    corners.
    """
    _kinematics(y, dy, work)
    denominator = 1.0
    if regime == FLOWING:
        denominator = _flow_acceleration(y[6:12], material, work)
    elif regime == FLUID:
        _viscous_acceleration(y[6:12], material.viscosity, work)
    else:
        work.s[STRENGTH] = 0.0
        work.s[PRESSURE] = 0.0
    set_gradient(work.m[W_R], dy)
    return denominator


@kernel
def rate(
    regime: int, t: float, y: Array, dy: Array, par: Parameters, tide: TidePanels, work: Buffers
) -> float:
    """Rate of the state in any regime; returns the denominator of the pressure (FLOWING), else 1."""
    if regime == RIGID:
        rigid_rate(t, y, dy, par.rigid, tide, work)
        return 1.0
    gravity_terms(t, y, tide, work)
    return deformation_rate(regime, y, dy, par.material, work)
