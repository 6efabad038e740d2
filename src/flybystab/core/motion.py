"""Equations of motion of the homogeneous ellipsoid in each regime (theory, sections 2 and 3).

Kernels work in the units of the body: length ``a0 = (a1 a2 a3)^(1/3)``, time ``1/sqrt(pi G rho0)`` at the
initial density, stress in the form ``T = 5 sigma/rho``. Then ``det S = (V/V0)^2`` and self-gravity is
``K_g = -2 (V0/V) A(S)``. Two states:

RIGID, 7 numbers: unit quaternion (body axes -> fixed frame, scalar first), ``omega`` along the body axes.
Every other regime, 15 numbers, fixed frame: ``S`` (6 components), ``D = sym L`` (6), ``w``: ``W x = w x x``.

The parameters of a run are one flat array, see ``SIN_PHI`` and the constants below it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.core.ellipsoid import gravity_coefficients
from flybystab.core.jit import code, kernel
from flybystab.core.rheology import beyond_face, corner, normal, slope_over_sine
from flybystab.core.statics import rigid_load
from flybystab.core.tensors import determinant, deviator, eigensystem, inverse, multiply, pack, unpack
from flybystab.core.tide import COMPONENTS, TidePanels, tide_at

Array = NDArray[np.float64]

RIGID = code(0)
FLOWING = code(1)
DISPERSED = code(2)
FLUID = code(3)

# Numbers in a state.
N_RIGID = code(7)
N_FULL = code(15)

# Slots of the parameter array.
SURFACE = 0  # code of the yield surface
SIN_PHI = 1
COS_PHI = 2
BETA = 3  # dilatancy beta (not beta over k); 1 where NORMAL is on
COHESION = 4  # 5 Y/rho0 in units of a0^2 pi G rho0
VISCOSITY = 5  # 5 (2 mu)/rho0 in units of a0^2 sqrt(pi G rho0), FLUID only
EXPANSION = 6  # V/V0 at which dilation has ended
S1 = 7  # squared semi-axes of the rigid body, and its gravity K_g,i
S2 = 8
S3 = 9
G1 = 10
G2 = 11
G3 = 12
NORMAL = 13  # 1: associative flow on a slope k(theta), the true normal; 0: D along the stress deviator
PART = 14  # which part of the yield section the stress is on, see the codes below
BESIDE = 15  # angle past the normal of a Mohr-Coulomb face, rad, up to which a corner keeps the stress
N_PARAMETERS = 16

# Where the stress is on the hexagon of Mohr-Coulomb in associative flow; SMOOTH on any other section.
SMOOTH = code(0)
EXTENSION_CORNER = code(1)
COMPRESSION_CORNER = code(2)
FACE = code(3)

# Matrices of `Buffers.m` that `field` fills and the rates read.
W_SINV = 0
W_K = 1  # K_g + K_t
W_L = 2
W_R = 3  # K_g + K_t - L^2
W_S = 4
W_N = 5  # FLOWING: stress deviator over p sin(phi) + c cos(phi)
W_A = 6
W_B = 7
W_VECTORS = 8
# row 0: eigenvalues; row 1: V/V0, k P + kc, P; row 2: determinant of the unit stress deviator, place between the
# corners of a face (0: extension, 1: compression), angle of D past the normal of the face
W_SCRATCH = 9
W_FACE = 10  # step from the extension to the compression corner
N_WORK = 11


class Buffers(NamedTuple):
    """Scratch of the rates: matrices ``m[N_WORK, 3, 3]`` and components ``c[3, 6]``."""

    m: Array
    c: Array


@kernel
def rotation_matrix(q: Array, m: Array) -> None:
    """Rotation matrix ``m[3, 3]`` (body -> fixed) of a quaternion that need not be normalised."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    s = 2.0 / (w * w + x * x + y * y + z * z)
    m[0, 0] = 1.0 - s * (y * y + z * z)
    m[1, 1] = 1.0 - s * (x * x + z * z)
    m[2, 2] = 1.0 - s * (x * x + y * y)
    m[0, 1] = s * (x * y - w * z)
    m[1, 0] = s * (x * y + w * z)
    m[0, 2] = s * (x * z + w * y)
    m[2, 0] = s * (x * z - w * y)
    m[1, 2] = s * (y * z - w * x)
    m[2, 1] = s * (y * z + w * x)


@kernel
def rotated_to_body(q: Array, k: Array, m: Array, out: Array) -> None:
    """Components ``out[6]`` along the body axes of a fixed-frame tensor ``k[6]``; `m` is scratch (3, 3)."""
    rotation_matrix(q, m)
    for a in range(3):
        # row a of m^T K
        u0 = m[0, a] * k[0] + m[1, a] * k[3] + m[2, a] * k[4]
        u1 = m[0, a] * k[3] + m[1, a] * k[1] + m[2, a] * k[5]
        u2 = m[0, a] * k[4] + m[1, a] * k[5] + m[2, a] * k[2]
        out[a] = u0 * m[0, a] + u1 * m[1, a] + u2 * m[2, a]
        if a == 0:
            out[3] = u0 * m[0, 1] + u1 * m[1, 1] + u2 * m[2, 1]
            out[4] = u0 * m[0, 2] + u1 * m[1, 2] + u2 * m[2, 2]
        elif a == 1:
            out[5] = u0 * m[0, 2] + u1 * m[1, 2] + u2 * m[2, 2]


@kernel
def rigid_rate(t: float, y: Array, dy: Array, par: Array, tide: TidePanels, work: Buffers) -> None:
    """Euler's equations with the tidal torque.

    ``Omegadot_ij = (K - Omega^2)_ij (S_j - S_i)/(S_i + S_j)`` along the body axes, the antisymmetric part
    of ``(Omegadot + Omega^2) S = K S - T``; the quaternion turns at ``qdot = q omega / 2``.
    """
    kt = work.c[0]
    kb = work.c[1]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    rotated_to_body(y, kt, work.m[W_N], kb)
    w0, w1, w2 = y[4], y[5], y[6]
    s1, s2, s3 = par[S1], par[S2], par[S3]
    # omega_1 = Omega_32, omega_2 = Omega_13, omega_3 = Omega_21, (Omega^2)_ij = omega_i omega_j for i != j
    dy[4] = (kb[5] - w1 * w2) * (s2 - s3) / (s2 + s3)
    dy[5] = (kb[4] - w0 * w2) * (s3 - s1) / (s3 + s1)
    dy[6] = (kb[3] - w0 * w1) * (s1 - s2) / (s1 + s2)
    dy[0] = 0.5 * (-y[1] * w0 - y[2] * w1 - y[3] * w2)
    dy[1] = 0.5 * (y[0] * w0 + y[2] * w2 - y[3] * w1)
    dy[2] = 0.5 * (y[0] * w1 + y[3] * w0 - y[1] * w2)
    dy[3] = 0.5 * (y[0] * w2 + y[1] * w1 - y[2] * w0)


@kernel
def to_fixed_frame(y: Array, par: Array, m: Array, shape: Array, spin: Array) -> None:
    """Write ``S`` (``shape[6]``) and ``w`` (``spin[3]``) of a RIGID state; ``m[3, 3]`` gets the rotation."""
    rotation_matrix(y, m)
    s1, s2, s3 = par[S1], par[S2], par[S3]
    for c, (i, j) in enumerate(COMPONENTS):
        shape[c] = s1 * m[i, 0] * m[j, 0] + s2 * m[i, 1] * m[j, 1] + s3 * m[i, 2] * m[j, 2]
    for i in range(3):
        spin[i] = m[i, 0] * y[4] + m[i, 1] * y[5] + m[i, 2] * y[6]


@kernel
def yield_excess(p: float, norm: float, det: float, volume: float, par: Array) -> float:
    """``|s| - k (p + Y cot phi)`` in the form of ``T``: positive where the rigid stress is not admissible."""
    g = slope_over_sine(int(par[SURFACE]), par[SIN_PHI], det)
    return norm - g * (p * par[SIN_PHI] + par[COHESION] * volume * par[COS_PHI])


@kernel
def rigid_excess(
    t: float, y: Array, par: Array, tide: TidePanels, work: Buffers, stress: Array
) -> tuple[float, float, float, float]:
    """Yield excess, pressure, deviator norm, unit determinant of a RIGID state; sets ``stress[6]``."""
    kt = work.c[0]
    kb = work.c[1]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    rotated_to_body(y, kt, work.m[W_N], kb)
    s = (par[S1], par[S2], par[S3])
    rigid_load(kb, y[4:7], s, (par[G1], par[G2], par[G3]), stress)
    p, norm, det = deviator(stress, kt)
    # The rigid body keeps the volume sqrt(s1 s2 s3) that it has.
    volume = np.sqrt(par[S1] * par[S2] * par[S3])
    return yield_excess(p, norm, det, volume, par), p, norm, det


@kernel
def set_rigid_shape(s1: float, s2: float, s3: float, par: Array) -> None:
    """Store the squared semi-axes of the rigid body and its self-gravity ``K_g,i = -2 (V0/V) A_i``."""
    a1, a2, a3 = gravity_coefficients(s1, s2, s3)
    c = -2.0 / np.sqrt(s1 * s2 * s3)
    par[S1], par[S2], par[S3] = s1, s2, s3
    par[G1], par[G2], par[G3] = c * a1, c * a2, c * a3


@kernel
def field(t: float, y: Array, tide: TidePanels, work: Buffers) -> None:
    """Fill what depends on ``t`` and ``S`` only: ``S``, ``S^-1``, ``K_g + K_t``, volume."""
    scratch = work.m[W_SCRATCH]
    values = scratch[0]
    vectors = work.m[W_VECTORS]
    unpack(y[0:6], work.m[W_S])
    det = inverse(y[0:6], work.m[W_SINV])
    volume = np.sqrt(det)
    scratch[1, 0] = volume
    eigensystem(y[0:6], values, vectors)
    a1, a2, a3 = gravity_coefficients(values[0], values[1], values[2])
    c = -2.0 / volume
    k = work.m[W_K]
    for i in range(3):
        for j in range(i, 3):
            k[i, j] = k[j, i] = c * (
                a1 * vectors[i, 0] * vectors[j, 0]
                + a2 * vectors[i, 1] * vectors[j, 1]
                + a3 * vectors[i, 2] * vectors[j, 2]
            )
    kt = work.c[0]
    tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, kt)
    k[0, 0] += kt[0]
    k[1, 1] += kt[1]
    k[2, 2] += kt[2]
    k[0, 1] += kt[3]
    k[1, 0] += kt[3]
    k[0, 2] += kt[4]
    k[2, 0] += kt[4]
    k[1, 2] += kt[5]
    k[2, 1] += kt[5]


@kernel
def gradient(y: Array, out: Array) -> None:
    """Velocity gradient ``L = D + W`` of a 15-number state."""
    unpack(y[6:12], out)
    out[0, 1] -= y[14]
    out[1, 0] += y[14]
    out[0, 2] += y[13]
    out[2, 0] -= y[13]
    out[1, 2] -= y[12]
    out[2, 1] += y[12]


@kernel
def set_gradient(m: Array, y: Array) -> None:
    """Store ``D`` and ``w`` of a velocity gradient ``m[3, 3]`` in a 15-number state, or of its rate."""
    pack(m, y[6:12])
    y[12] = 0.5 * (m[2, 1] - m[1, 2])
    y[13] = 0.5 * (m[0, 2] - m[2, 0])
    y[14] = 0.5 * (m[1, 0] - m[0, 1])


@kernel
def dilatancy(volume: float, par: Array) -> tuple[float, float]:
    """``beta`` and ``d beta/dV`` at ``V/V0``: constant, then faded to zero where the material is loosest.

    Where NORMAL is on, the share of the dilation ``m(D')`` of the normal.

    The fade is a cubic over the last tenth of the allowed expansion: a critical state reached smoothly.
    """
    beta = par[BETA]
    end = par[EXPANSION]
    begin = end - 0.1 * (end - 1.0)
    if beta == 0.0 or volume <= begin:
        return beta, 0.0
    if volume >= end:
        return 0.0, 0.0
    x = (volume - begin) / (end - begin)
    return beta * (1.0 - x * x * (3.0 - 2.0 * x)), -beta * 6.0 * x * (1.0 - x) / (end - begin)


@kernel
def flow_stress(d: Array, par: Array, unit: Array, n: Array) -> tuple[float, float, float, float]:
    """Stress deviator ``n[3, 3]`` over ``p sin(phi) + c cos(phi)`` of a flow with rate of strain ``d[6]``.

    Returns ``|D'|``, the norm of `n`, the support ``n:Dhat`` and the determinant of the unit stress deviator; sets
    ``unit[6]`` to ``Dhat``.
    """
    _, norm, det = deviator(d, unit)
    unpack(unit, n)
    surface = int(par[SURFACE])
    if par[NORMAL] == 0.0 or norm == 0.0:
        g = slope_over_sine(surface, par[SIN_PHI], det)
        for i in range(3):
            for j in range(3):
                n[i, j] *= g
        return norm, g, g, det
    part = int(par[PART])
    if part == SMOOTH:
        a, b, support, g, det = normal(surface, par[SIN_PHI], det)
    else:
        a, b, support, g, det = corner(par[SIN_PHI], det, part != COMPRESSION_CORNER)
    isotropic(a, b, unit, n)
    return norm, g, support, det


@kernel
def isotropic(a: float, b: float, u: Array, n: Array) -> None:
    """Write the deviator ``n[3, 3] = a u + b (u^2 - 1/3)`` of a unit deviator ``u[6]``."""
    u0, u1, u2, u3, u4, u5 = u[0], u[1], u[2], u[3], u[4], u[5]
    n[0, 0] = a * u0 + b * (u0 * u0 + u3 * u3 + u4 * u4 - 1.0 / 3.0)
    n[1, 1] = a * u1 + b * (u3 * u3 + u1 * u1 + u5 * u5 - 1.0 / 3.0)
    n[2, 2] = a * u2 + b * (u4 * u4 + u5 * u5 + u2 * u2 - 1.0 / 3.0)
    n[0, 1] = n[1, 0] = a * u3 + b * (u0 * u3 + u3 * u1 + u4 * u5)
    n[0, 2] = n[2, 0] = a * u4 + b * (u0 * u4 + u3 * u5 + u4 * u2)
    n[1, 2] = n[2, 1] = a * u5 + b * (u3 * u4 + u1 * u5 + u5 * u2)


@kernel
def _contract(a: Array, b: Array) -> float:
    """``A:B`` of two (3, 3) arrays."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += a[i, j] * b[i, j]
    return total


@kernel
def dilation(beta: float, norm: float, support: float, par: Array) -> float:
    """``tr D`` of the flow rule: ``beta |D'|``, or the share `beta` of ``m(D')`` where NORMAL is on."""
    return beta * norm * (support * par[SIN_PHI] if par[NORMAL] > 0.0 else 1.0)


@kernel
def deformation_rate(regime: int, y: Array, dy: Array, par: Array, work: Buffers) -> float:
    """Rate of the 15 numbers, given `field`; returns the denominator of the pressure (FLOWING), else 1.

    ``Ldot = R - T S^-1``, ``R = K - L^2``, ``T = -P 1 + (P sin + c cos) N``. Radial rule: ``N = Dhat k/sin`` and
    ``E = beta Dhat``; the true normal: ``N`` is the stress with the normal ``Dhat`` and ``E = f sin N`` (the gradient
    of the support, ``f`` the fade of `dilatancy`). The pressure that keeps ``tr D`` at its `dilation` is

        P = [fdot m - B:R + c cos B:(N S^-1)] / [B:((1 - sin N) S^-1)],    B = 1 - E.

    For the true normal with ``f = 1`` the denominator is a sum of squares: no jam. On a face of Mohr-Coulomb, where
    the normal leaves the stress between two corners undetermined, the motion determines it: `D` stays normal to
    the face (two of the planes of Koiter 1953 are active), as long as the stress is between the corners.
    """
    d = y[6:12]
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
    sinv = work.m[W_SINV]
    volume = work.m[W_SCRATCH, 1, 0]
    trace_sinv = sinv[0, 0] + sinv[1, 1] + sinv[2, 2]
    trace_d = d[0] + d[1] + d[2]
    trace_r = r[0, 0] + r[1, 1] + r[2, 2]
    n = work.m[W_N]
    b = work.m[W_B]
    denominator = 1.0
    pressure = 0.0
    strength = 0.0  # k P + k c: norm of the deviatoric stress
    if regime == FLOWING:
        norm, g, support, det = flow_stress(d, par, work.c[2], n)
        work.m[W_SCRATCH, 2, 0] = det
        part = int(par[PART])
        det_d = 0.0
        if part != SMOOTH:
            det_d = determinant(work.c[2])
            work.m[W_SCRATCH, 2, 2] = beyond_face(par[SIN_PHI], det_d)
        sin = par[SIN_PHI]
        cohesive = par[COS_PHI] * par[COHESION] * volume
        beta, dbeta = dilatancy(volume, par)
        e = beta * sin if par[NORMAL] > 0.0 else beta / g  # E = e N
        multiply(n, sinv, b)
        n_sinv = b[0, 0] + b[1, 1] + b[2, 2]
        nn_sinv = _contract(n, b)
        n_r = _contract(n, r)
        denominator = trace_sinv - (sin + e) * n_sinv + sin * e * nn_sinv
        fading = dilation(dbeta * volume * trace_d, norm, support, par)
        numerator = fading - trace_r + e * n_r + cohesive * (n_sinv - e * nn_sinv)
        if part == FACE:
            # N = N_e + w X with the step X between the corners and w such that D stays normal to the face:
            # X:Ddot = 0, which eliminates F w (F = P sin + c cos) from the equation of the pressure.
            x, xs = work.m[W_FACE], work.m[W_A]
            p1, p2, _, _, _ = corner(sin, det_d, False)
            isotropic(p1, p2, work.c[2], x)
            for i in range(3):
                for j in range(3):
                    x[i, j] -= n[i, j]
            multiply(x, sinv, xs)
            across = _contract(x, xs)
            nx_sinv = _contract(x, b)
            along = xs[0, 0] + xs[1, 1] + xs[2, 2]
            pull = _contract(x, r) - cohesive * nx_sinv
            bx = along - e * nx_sinv
            denominator -= bx * (along - sin * nx_sinv) / across
            numerator += bx * pull / across
            pressure = numerator / denominator
            factor = sin * pressure + cohesive
            share = (pressure * (along - sin * nx_sinv) + pull) / across
            for i in range(3):
                for j in range(3):
                    r[i, j] -= share * xs[i, j]
            place = share / factor if factor != 0.0 else np.inf
            work.m[W_SCRATCH, 2, 1] = place
            size = 0.0
            third = 0.0
            if factor != 0.0:
                unit = work.c[2]
                for i in range(3):
                    for j in range(3):
                        x[i, j] = n[i, j] + place * x[i, j]
                pack(x, unit)
                _, size, third = deviator(unit, unit)
            g = size
            work.m[W_SCRATCH, 2, 0] = third
        else:
            pressure = numerator / denominator
            factor = sin * pressure + cohesive
        strength = g * factor
        for i in range(3):
            for j in range(3):
                r[i, j] += pressure * sinv[i, j] - factor * b[i, j]
    elif regime == FLUID:
        mu = par[VISCOSITY] * volume
        unpack(d, n)
        for i in range(3):
            n[i, i] -= trace_d / 3.0
        multiply(n, sinv, b)
        pressure = (mu * (b[0, 0] + b[1, 1] + b[2, 2]) - trace_r) / trace_sinv
        strength = mu
        for i in range(3):
            for j in range(3):
                r[i, j] += pressure * sinv[i, j] - mu * b[i, j]
    set_gradient(r, dy)
    work.m[W_SCRATCH, 1, 1] = strength
    work.m[W_SCRATCH, 1, 2] = pressure
    return denominator


@kernel
def rate(regime: int, t: float, y: Array, dy: Array, par: Array, tide: TidePanels, work: Buffers) -> float:
    """Rate of the state in any regime; returns the denominator of the pressure where there is one."""
    if regime == RIGID:
        rigid_rate(t, y, dy, par, tide, work)
        return 1.0
    field(t, y, tide, work)
    return deformation_rate(regime, y, dy, par, work)


@kernel
def angular_momentum(y: Array, work: Buffers, h: Array) -> None:
    """Angular momentum ``H = axial(L S - S L^T)`` about the centre, per ``m/5``, of a 15-number state."""
    big_l = work.m[W_L]
    gradient(y, big_l)
    unpack(y[0:6], work.m[W_S])
    multiply(big_l, work.m[W_S], work.m[W_A])
    a = work.m[W_A]
    # H = int rho x x (L x) = axial vector of (L I) - (L I)^T
    h[0] = a[2, 1] - a[1, 2]
    h[1] = a[0, 2] - a[2, 0]
    h[2] = a[1, 0] - a[0, 1]
