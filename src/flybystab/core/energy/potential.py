"""The energy ``Phi`` of a deforming ellipsoid and its derivatives along a strain.

From the Tisserand mean-axis frame (relative angular momentum zero, ``L I`` symmetric) the kinetic energy of
deformation obeys ``Kdot = -V sigma:D - Phidot`` with

    Phi(S; H) = -(3/5) G m^2 R_F(a1^2, a2^2, a3^2) + H.J^-1.H/2

at fixed angular momentum ``H`` (theory, section 5). A rate of strain ``D`` in the principal axes of ``S`` takes
``L_ij = D_ij 2 S_i/(S_i + S_j)``. With constant ``L`` the product ``L S`` stays symmetric along
``F = exp(L t)`` (``L S(t) = e^(Lt) (L S_0) e^(Lt)^T``), so that one ``L`` serves the whole path and

    S(t) = e^(2Lt) S_0,    S^(n) = (2L)^n S_0,    det S(t) = det S_0 e^(2 t tr D).

Units of this module: mean radius ``(a1 a2 a3)^(1/3)``, density and ``pi G rho`` of the undeformed body are one:
mass ``M = 4 pi/3``, ``G = 1/pi``, energies in ``pi G rho^2 a^5``, stresses in ``pi G rho^2 a^2``, ``H`` in
``rho a^5 sqrt(pi G rho)``. The components of ``H`` are constant: a perturbation is fast compared with the precession
that it causes (for steady spin the first two derivatives do not depend on this).

The six components of ``D`` are ``xx, yy, zz, xy, xz, yz``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flybystab.core.ellipsoid.potential import carlson_fd
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import eigensystem, multiply, unpack
from flybystab.typing import Array

#: Mass, and volume before the strain, in the units of this module.
MASS = 4.0 * np.pi / 3.0

#: ``(3/10) G m^2``: the self-gravity energy is ``-GRAVITY int du/Delta = -2 GRAVITY R_F``.
GRAVITY = 8.0 * np.pi / 15.0


class PrincipalAxes(NamedTuple):
    """The body at one instant of a path, and scratch space: written by :func:`energy_along`."""

    squares: Array  # squared semi-axes, 3
    vectors: Array  # principal axes as columns, 3 x 3
    rd: Array  # R_D with the axis k last: A_k = (2/3) a1 a2 a3 rd[k]
    spin: Array  # angular velocity, 3
    shape: Array  # S, 6
    rate: Array  # dS/dt, 6


@kernel
def principal_axes() -> PrincipalAxes:
    """Empty :class:`PrincipalAxes`."""
    return PrincipalAxes(np.empty(3), np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(6), np.empty(6))


@kernel
def velocity_gradient(s1: float, s2: float, s3: float, d: Array, out: Array) -> None:
    """Write ``L = D + W`` of a rate of strain ``d[6]``, ``W_ij = D_ij (S_i - S_j)/(S_i + S_j)``."""
    unpack(d, out)
    out[0, 1] *= 2.0 * s1 / (s1 + s2)
    out[1, 0] *= 2.0 * s2 / (s1 + s2)
    out[0, 2] *= 2.0 * s1 / (s1 + s3)
    out[2, 0] *= 2.0 * s3 / (s1 + s3)
    out[1, 2] *= 2.0 * s2 / (s2 + s3)
    out[2, 1] *= 2.0 * s3 / (s2 + s3)


@kernel
def _shape_derivatives(s: Array, d: Array, p: Array, q: Array, r: Array) -> None:
    """Write the first three derivatives of ``S`` along ``F = exp(L t)``: ``2 L S``, ``4 L^2 S``, ``8 L^3 S``."""
    l = np.empty((3, 3))
    velocity_gradient(s[0], s[1], s[2], d, l)
    for i in range(3):
        for j in range(3):
            p[i, j] = 2.0 * l[i, j] * s[j]
    multiply(l, p, q)
    multiply(l, q, r)
    for i in range(3):
        for j in range(3):
            q[i, j] *= 2.0
            r[i, j] *= 4.0


@kernel
def _gravity_derivatives(
    one: Array, two: Array, three: Array, p: Array, q: Array, r: Array
) -> tuple[float, float, float]:
    """First three derivatives of ``sqrt(det S) int du/Delta`` at fixed ``det S``, from those of ``S``: ``p, q, r``.

    With ``N = (S + u)^-1``, ``x = ln det(S + u)`` has ``x' = N:S'``, ``x'' = N:S'' - NS':NS'``,
    ``x''' = N:S''' - 3 NS':NS'' + 2 tr (NS')^3``; the integrals over ``u`` are index symbols.
    """
    e1 = 0.0
    e2 = 0.0
    e3 = 0.0
    for i in range(3):
        e1 -= 0.5 * one[i] * p[i, i]
        e2 -= 0.5 * one[i] * q[i, i]
        e3 -= 0.5 * one[i] * r[i, i]
        for j in range(3):
            e2 += two[i, j] * (0.25 * p[i, i] * p[j, j] + 0.5 * p[i, j] * p[i, j])
            e3 += two[i, j] * (1.5 * p[i, j] * q[i, j] + 0.75 * p[i, i] * q[j, j])
            for k in range(3):
                e3 -= three[i, j, k] * (
                    p[i, j] * p[j, k] * p[k, i]
                    + 0.75 * p[k, k] * p[i, j] * p[i, j]
                    + 0.125 * p[i, i] * p[j, j] * p[k, k]
                )
    return e1, e2, e3


@kernel
def _times_inertia(p: Array, trace: float, spin: Array, out: Array) -> None:
    """Write ``J' omega``, ``J' = (m/5)(tr S' 1 - S')``, for a derivative ``p[3, 3]`` of ``S`` with this trace."""
    c = MASS / 5.0
    for i in range(3):
        out[i] = c * trace * spin[i]
        for j in range(3):
            out[i] -= c * p[i, j] * spin[j]


@kernel
def _rotation_derivatives(s: Array, p: Array, q: Array, r: Array, spin: Array) -> tuple[float, float, float]:
    """First three derivatives of ``H.Q.H/2``, ``Q = J^-1``, at fixed ``H``: ``Q' = -Q J' Q``."""
    c = MASS / 5.0
    tp = p[0, 0] + p[1, 1] + p[2, 2]
    ts = s[0] + s[1] + s[2]
    w1, w2, w3 = np.empty(3), np.empty(3), np.empty(3)
    _times_inertia(p, tp, spin, w1)
    _times_inertia(q, q[0, 0] + q[1, 1] + q[2, 2], spin, w2)
    _times_inertia(r, r[0, 0] + r[1, 1] + r[2, 2], spin, w3)
    f1 = 0.0
    f2 = 0.0
    f3 = 0.0
    for i in range(3):
        g = w1[i] / (c * (ts - s[i]))
        f1 -= 0.5 * spin[i] * w1[i]
        f2 += w1[i] * g - 0.5 * spin[i] * w2[i]
        f3 += 3.0 * g * w2[i] - 0.5 * spin[i] * w3[i]
        j1 = tp * g
        for j in range(3):
            j1 -= p[i, j] * w1[j] / (c * (ts - s[j]))
        f3 -= 3.0 * g * c * j1
    return f1, f2, f3


@kernel
def energy_derivatives(
    s1: float, s2: float, s3: float, one: Array, two: Array, three: Array, spin: Array, d: Array
) -> tuple[float, float, float]:
    """First three derivatives of ``Phi`` in ``t`` along ``F = exp(L t)`` for a rate of strain ``d[6]``.

    ``one, two, three`` are the :func:`~flybystab.core.ellipsoid.potential.index_symbols` of ``s_i`` (with
    ``s1 s2 s3 = 1``), ``spin[3]`` is ``J^-1 H`` before the strain.
    """
    s = np.empty(3)
    s[0] = s1
    s[1] = s2
    s[2] = s3
    p, q, r = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    _shape_derivatives(s, d, p, q, r)
    e1, e2, e3 = _gravity_derivatives(one, two, three, p, q, r)
    f1, f2, f3 = _rotation_derivatives(s, p, q, r, spin)
    scale = -GRAVITY / np.sqrt(s1 * s2 * s3)
    return scale * e1 + f1, scale * e2 + f2, scale * e3 + f3


@kernel
def energy(shape: Array, momentum: Array) -> float:
    """``Phi`` of a shape ``S[6]`` (any orientation) with angular momentum ``momentum[3]``."""
    values = np.empty(3)
    vectors = np.empty((3, 3))
    eigensystem(shape, values, vectors)
    rf, _, _, _ = carlson_fd(values[0], values[1], values[2])
    trace = values[0] + values[1] + values[2]
    spin = 0.0
    for k in range(3):
        h = vectors[0, k] * momentum[0] + vectors[1, k] * momentum[1] + vectors[2, k] * momentum[2]
        spin += h * h / (trace - values[k])
    return -2.0 * GRAVITY * rf + 2.5 / MASS * spin


@kernel
def path_frame(s1: float, s2: float, s3: float, d: Array, rates: Array, frame: Array) -> None:
    """Write ``rates[3]`` and ``frame[3, 3]`` with ``S(t) = frame diag(e^(2 rates t)) frame^T``.

    ``L = S_0^(1/2) B S_0^(-1/2)`` with symmetric ``B_ij = D_ij 2 sqrt(S_i S_j)/(S_i + S_j)``; `rates` are its
    eigenvalues and ``frame = S_0^(1/2) Q``.
    """
    b = np.empty(6)
    b[0] = d[0]
    b[1] = d[1]
    b[2] = d[2]
    b[3] = d[3] * 2.0 * np.sqrt(s1 * s2) / (s1 + s2)
    b[4] = d[4] * 2.0 * np.sqrt(s1 * s3) / (s1 + s3)
    b[5] = d[5] * 2.0 * np.sqrt(s2 * s3) / (s2 + s3)
    eigensystem(b, rates, frame)
    for j in range(3):
        frame[0, j] *= np.sqrt(s1)
        frame[1, j] *= np.sqrt(s2)
        frame[2, j] *= np.sqrt(s3)


@kernel
def _shape_along(
    rates: Array, frame: Array, t: float, volume: float, growth: float, shape: Array, rate: Array
) -> None:
    """Write ``S`` and ``dS/dt`` (six components each) at `t`; arguments as of :func:`energy_along`."""
    swollen = np.cbrt(volume * volume)
    for i in range(6):
        shape[i] = 0.0
        rate[i] = 0.0
    for k in range(3):
        g = swollen * np.exp(2.0 * rates[k] * t)
        h = 2.0 * (rates[k] + growth / 3.0) * g
        x = frame[0, k]
        y = frame[1, k]
        z = frame[2, k]
        shape[0] += g * x * x
        shape[1] += g * y * y
        shape[2] += g * z * z
        shape[3] += g * x * y
        shape[4] += g * x * z
        shape[5] += g * y * z
        rate[0] += h * x * x
        rate[1] += h * y * y
        rate[2] += h * z * z
        rate[3] += h * x * y
        rate[4] += h * x * z
        rate[5] += h * y * z


@kernel
def energy_along(
    rates: Array, frame: Array, momentum: Array, t: float, volume: float, growth: float, axes: PrincipalAxes
) -> tuple[float, float, float]:
    """``Phi``, ``dPhi/dt`` and the squared axis ratio at time `t` on a path of :func:`path_frame`; writes `axes`.

    In addition to that path the body expands isotropically, to `volume` times its volume at time `t`, at the rate
    ``d ln V/dt`` = `growth`.
    """
    shape, rate = axes.shape, axes.rate
    _shape_along(rates, frame, t, volume, growth, shape, rate)
    values, vectors = axes.squares, axes.vectors
    eigensystem(shape, values, vectors)
    rf, d1, d2, d3 = carlson_fd(values[0], values[1], values[2])
    trace = values[0] + values[1] + values[2]
    turning = rate[0] + rate[1] + rate[2]
    phi = -2.0 * GRAVITY * rf
    phi_t = 0.0
    w = axes.spin
    w[:] = 0.0
    for k in range(3):
        x = vectors[0, k]
        y = vectors[1, k]
        z = vectors[2, k]
        grown = (
            rate[0] * x * x
            + rate[1] * y * y
            + rate[2] * z * z
            + 2.0 * (rate[3] * x * y + rate[4] * x * z + rate[5] * y * z)
        )
        # dR_F/dx = -R_D(y, z, x)/6
        rd = d1 if k == 0 else (d2 if k == 1 else d3)
        axes.rd[k] = rd
        phi_t += GRAVITY / 3.0 * rd * grown
        h = x * momentum[0] + y * momentum[1] + z * momentum[2]
        u = 5.0 / MASS * h / (trace - values[k])
        phi += 0.5 * h * u
        w[0] += u * x
        w[1] += u * y
        w[2] += u * z
    # -w.J'w/2 with J' = (m/5)(tr S' 1 - S')
    c = MASS / 10.0
    phi_t -= c * turning * (w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    phi_t += c * (rate[0] * w[0] * w[0] + rate[1] * w[1] * w[1] + rate[2] * w[2] * w[2])
    phi_t += 2.0 * c * (rate[3] * w[0] * w[1] + rate[4] * w[0] * w[2] + rate[5] * w[1] * w[2])
    return phi, phi_t, np.max(values) / np.min(values)
