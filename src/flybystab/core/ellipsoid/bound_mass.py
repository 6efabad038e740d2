"""Axes, spin and gravitationally bound mass of a body after an encounter (theory, section 7)."""

from __future__ import annotations

import numpy as np

from flybystab.constants import G
from flybystab.core.ellipsoid.potential import gravity_coefficients, potential_coefficient
from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.tensors import eigensystem, inverse, multiply, pack
from flybystab.typing import Array

# Gauss-Legendre in the cosine of the polar angle, trapezoid in longitude.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(128)
_LONGITUDES = 256

# The same for the iterated bound fraction, on half of the sphere.
_HALF_NODES, _HALF_WEIGHTS = (x[24:].copy() for x in np.polynomial.legendre.leggauss(48))
_HALF_LONGITUDES = 48
_COSINES = np.cos((np.arange(_HALF_LONGITUDES) + 0.5) * 2.0 * np.pi / _HALF_LONGITUDES)
_SINES = np.sin((np.arange(_HALF_LONGITUDES) + 0.5) * 2.0 * np.pi / _HALF_LONGITUDES)

#: The iteration ends when a pass removes less than this fraction of the mass, or after this number of passes.
CONVERGED = 1e-7
PASSES = 500
#: A bound fraction below this value counts as zero.
NOTHING = 1e-3


@kernel
def principal_axes(shape: Array, axes: Array, vectors: Array) -> None:
    """Semi-axes ``axes[3]``, longest first, and their directions (columns of ``vectors[3, 3]``) of ``S[3, 3]``."""
    c = np.empty(6)
    v = np.empty((3, 3))
    pack(shape, c)
    eigensystem(c, axes, v)
    for a in range(3):
        most = a
        for b in range(a + 1, 3):
            if axes[b] > axes[most]:
                most = b
        axes[a], axes[most] = axes[most], axes[a]
        for i in range(3):
            v[i, a], v[i, most] = v[i, most], v[i, a]
        axes[a] = np.sqrt(axes[a])
    vectors[:] = v


@kernel
def spin_vector(gradient: Array, w: Array) -> None:
    """Axial vector ``w[3]`` of the antisymmetric part of a velocity gradient."""
    w[0] = 0.5 * (gradient[2, 1] - gradient[1, 2])
    w[1] = 0.5 * (gradient[0, 2] - gradient[2, 0])
    w[2] = 0.5 * (gradient[1, 0] - gradient[0, 1])


@kernel
def momentum(shape: Array, gradient: Array, h: Array) -> float:
    """Write the angular momentum ``h[3]`` per ``m/5``; returns ``2 E/H`` of the rigid rotation with this ``H``."""
    flow = np.empty((3, 3))
    multiply(gradient, shape, flow)
    spin_vector(flow, h)
    for i in range(3):
        h[i] *= 2.0
    c = np.empty(6)
    pack(shape, c)
    trace = c[0] + c[1] + c[2]
    for i in range(6):
        c[i] = trace - c[i] if i < 3 else -c[i]
    inverse(c, flow)
    energy = 0.0
    square = 0.0
    for i in range(3):
        square += h[i] * h[i]
        for j in range(3):
            energy += h[i] * flow[i, j] * h[j]
    return energy / np.sqrt(square) if square > 0.0 else 0.0


@kernel
def angle_between(a: Array, b: Array) -> float:
    """Angle between two vectors, rad; nan if one vanishes."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    if (a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0) or (b[0] == 0.0 and b[1] == 0.0 and b[2] == 0.0):
        return np.nan
    return np.arctan2(np.sqrt(x * x + y * y + z * z), dot)


@kernel
def one_pass_share(shape: Array, gradient: Array, rho: float) -> float:
    """Upper bound of the bound fraction of the mass: bound in the potential of the whole ellipsoid, velocity ``L x``.

    See :func:`flybystab.flybys.verdict.bound_fraction_upper`.

    Parameters
    ----------
    shape, gradient : ndarray (3, 3)
        ``S = 5 I/m`` (m2) and ``L`` (1/s) in a common non-rotating frame.
    rho : float
        kg/m3.
    """
    axes = np.empty(3)
    vectors = np.empty((3, 3))
    principal_axes(shape, axes, vectors)
    potential = np.pi * G * rho
    s1, s2, s3 = axes[0] ** 2, axes[1] ** 2, axes[2] ** 2
    coefficients = gravity_coefficients(s1, s2, s3)
    bound = potential * potential_coefficient(s1, s2, s3)
    # L F with F = (axes) diag(a): (L F)^T (L F) does not depend on the orthogonal factor on the left
    flow = np.empty((3, 3))
    multiply(gradient, vectors, flow)
    form = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += flow[k, i] * flow[k, j]
            form[i, j] = 0.5 * total * axes[i] * axes[j]
        form[i, i] += potential * coefficients[i] * axes[i] ** 2
    c = np.empty(6)
    pack(form, c)
    values = np.empty(3)
    eigensystem(c, values, vectors)
    # polar axis: the eigenvector of the largest eigenvalue of the energy form
    for i in range(2):
        if values[i] > values[2]:
            values[i], values[2] = values[2], values[i]
    if values[2] < bound:
        return 1.0
    share = 0.0
    for a in range(_NODES.size):
        mu2 = _NODES[a] ** 2
        ring = 0.0
        for b in range(_LONGITUDES):
            cosine2 = np.cos((b + 0.5) * np.pi / _LONGITUDES) ** 2
            across = values[0] * cosine2 + values[1] * (1.0 - cosine2)
            reach2 = bound / (values[2] * mu2 + (1.0 - mu2) * across)
            ring += min(1.0, reach2 * np.sqrt(reach2))
        share += 0.5 * _WEIGHTS[a] * ring / _LONGITUDES
    return share


@kernel
def _kinetic_form(gradient: Array, f: Array, out: Array) -> None:
    """Write the form ``out[3, 3]`` of the kinetic energy per unit mass of the velocity ``L x`` at ``x = F z``."""
    flow = np.empty((3, 3))
    multiply(gradient, f, flow)
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.5 * (flow[0, i] * flow[0, j] + flow[1, i] * flow[1, j] + flow[2, i] * flow[2, j])


@kernel
def _escape_basis(form: Array, basis: Array) -> None:
    """Write the eigenvectors of an energy form as columns, that of the largest eigenvalue last."""
    c = np.empty(6)
    values = np.empty(3)
    pack(form, c)
    eigensystem(c, values, basis)
    top = np.argmax(values)
    for i in range(3):
        basis[i, 2], basis[i, top] = basis[i, top], basis[i, 2]


@kernel
def _remainder_energy(
    to_space: Array, moments: Array, density: float, volume: float, kinetic: Array, form: Array
) -> float:
    """Write the quadratic form of the energy per unit mass in the field of a remainder; returns the depth of its well.

    The remainder is replaced by the homogeneous ellipsoid with its mass and its second moments. A point ``z`` of the
    unit ball is bound where ``z.form z < depth`` (m2/s2).

    Parameters
    ----------
    to_space : ndarray, shape (3, 3)
        Unit ball -> body, m.
    moments : ndarray, shape (3, 3)
        ``5 <z z^T>`` of the remainder in the unit ball.
    density, volume : float
        ``pi G rho`` times the remaining fraction of the mass (s^-2), product of the semi-axes of the whole body (m3).
    kinetic : ndarray, shape (3, 3)
        Form of the kinetic energy.
    """
    half, v = np.empty((3, 3)), np.empty((3, 3))
    c, values = np.empty(6), np.empty(3)
    for i in range(3):
        for j in range(3):
            half[i, j] = (
                to_space[i, 0] * moments[0, j]
                + to_space[i, 1] * moments[1, j]
                + to_space[i, 2] * moments[2, j]
            )
    for i in range(3):
        for j in range(3):
            form[i, j] = (
                half[i, 0] * to_space[j, 0] + half[i, 1] * to_space[j, 1] + half[i, 2] * to_space[j, 2]
            )
    pack(form, c)
    eigensystem(c, values, v)
    coefficients = gravity_coefficients(values[0], values[1], values[2])
    potential = density / (np.sqrt(values[0] * values[1] * values[2]) / volume)
    for i in range(3):
        for j in range(3):
            half[i, j] = v[0, i] * to_space[0, j] + v[1, i] * to_space[1, j] + v[2, i] * to_space[2, j]
    for i in range(3):
        for j in range(3):
            form[i, j] = kinetic[i, j]
            for k in range(3):
                form[i, j] += potential * coefficients[k] * half[k, i] * half[k, j]
    return potential * potential_coefficient(values[0], values[1], values[2])


@kernel
def _bound_part(form: Array, depth: float, moments: Array) -> float:
    """Fraction of the unit ball in which ``z.form z`` is below `depth`; writes ``5 <z z^T>`` of that part.

    The moments are not normalised where the fraction is below `NOTHING`.
    """
    n = np.empty(3)
    mass = 0.0
    moments[:] = 0.0
    for a in range(_HALF_NODES.size):
        n[2] = _HALF_NODES[a]
        across = np.sqrt(1.0 - n[2] * n[2])
        weight = _HALF_WEIGHTS[a] / _HALF_LONGITUDES
        for b in range(_HALF_LONGITUDES):
            n[0] = across * _COSINES[b]
            n[1] = across * _SINES[b]
            q = form[0, 0] * n[0] * n[0] + form[1, 1] * n[1] * n[1] + form[2, 2] * n[2] * n[2]
            q += 2.0 * (form[0, 1] * n[0] * n[1] + form[0, 2] * n[0] * n[2] + form[1, 2] * n[1] * n[2])
            r2 = min(1.0, depth / q)
            r3 = weight * r2 * np.sqrt(r2)
            mass += r3
            r5 = 3.0 * r2 * r3
            for i in range(3):
                for j in range(i, 3):
                    moments[i, j] += r5 * n[i] * n[j]
    if mass < NOTHING:
        return mass
    for i in range(3):
        for j in range(i, 3):
            moments[i, j] /= mass
            moments[j, i] = moments[i, j]
    return mass


@kernel
def bound_share(shape: Array, gradient: Array, rho: float) -> float:
    """Fraction of the mass that stays bound, for a homogeneous ellipsoid with velocity ``L x``.

    The part that is unbound in the potential of the whole ellipsoid is removed, the potential of the remainder is
    computed, and so on until no more mass is unbound. In each pass the remainder is the part of the ellipsoid in which
    a quadratic form is below a constant; its potential is approximated by that of the homogeneous ellipsoid with its
    mass and its second moments. Arguments as in `one_pass_share`, which is the first pass.
    """
    first = one_pass_share(shape, gradient, rho)
    if first >= 1.0:
        return first
    scale = np.pi * G
    axes = np.empty(3)
    v, f, kinetic = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    principal_axes(shape, axes, v)
    coefficients = gravity_coefficients(axes[0] ** 2, axes[1] ** 2, axes[2] ** 2)
    for i in range(3):
        for j in range(3):
            f[i, j] = v[i, j] * axes[j]
    _kinetic_form(gradient, f, kinetic)
    form = kinetic.copy()
    for i in range(3):
        form[i, i] += scale * rho * coefficients[i] * axes[i] ** 2
    basis = np.empty((3, 3))
    _escape_basis(form, basis)
    to_space, half = np.empty((3, 3)), np.empty((3, 3))
    multiply(f, basis, to_space)
    multiply(kinetic, basis, half)
    for i in range(3):
        for j in range(3):
            kinetic[i, j] = basis[0, i] * half[0, j] + basis[1, i] * half[1, j] + basis[2, i] * half[2, j]
    volume = axes[0] * axes[1] * axes[2]
    moments = np.eye(3)
    share = 1.0
    for _ in range(PASSES):
        depth = _remainder_energy(to_space, moments, scale * rho * share, volume, kinetic, form)
        mass = _bound_part(form, depth, moments)
        if mass < NOTHING:
            return 0.0
        change = share - mass
        share = mass
        if change < CONVERGED:
            break
    return min(first, share)
