"""Bound mass fraction in the potential of what stays bound."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from flybystab.constants import G
from flybystab.core.ellipsoid.bound_mass import principal_axes
from flybystab.core.ellipsoid.potential import gravity_coefficients, potential_coefficient
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Points at which the ellipsoid is sampled.
POINTS = 4096


def self_consistent_bound_fraction(
    shape: Array, velocity_gradient: Array, density: float, *, points: int = POINTS
) -> float:
    """Mass fraction bound to what stays, for a homogeneous ellipsoid with velocity ``L x``.

    Material unbound in the potential of the whole is removed, the potential recomputed without it, and so on until
    nothing more leaves. The potential of the whole is exact; that of the removed material is a sum over the
    quasi-random points that sample it, softened at the radius of their share of the volume.

    Parameters
    ----------
    shape, velocity_gradient : ndarray (3, 3)
        ``S = 5 I/m`` (m2) and ``L`` (1/s), in one frame that does not rotate.
    density : float
        kg/m3.
    points : int
        Number of points, a power of two.

    Returns
    -------
    float
        Never above :func:`flybystab.flybys.verdict.bound_fraction`, but for the sampling error of about 1/points^(2/3).
    """
    axes, vectors = np.empty(3), np.empty((3, 3))
    principal_axes(np.array(shape, dtype=float), axes, vectors)
    x = _unit_ball(points) * axes
    speed2 = np.sum((x @ vectors.T @ np.asarray(velocity_gradient, dtype=float).T) ** 2, axis=1)
    scale = np.pi * G * density
    a = np.array(gravity_coefficients(*axes**2))
    depth = scale * (potential_coefficient(*axes**2) - x**2 @ a)
    mass = density * 4.0 / 3.0 * np.pi * float(np.prod(axes)) / points
    softening = float(np.cbrt(np.prod(axes) / points))
    stays = _remaining(x, depth, 0.5 * speed2, G * mass, softening)
    return float(np.mean(stays))


def _unit_ball(points: int) -> Array:
    """Points that fill the unit ball evenly, shape (n, 3), symmetric about its centre."""
    cube = qmc.Sobol(3, scramble=False).random_base2(points.bit_length() - 2)
    r, z, phi = np.cbrt(cube[:, 0]), 2.0 * cube[:, 1] - 1.0, 2.0 * np.pi * cube[:, 2]
    across = np.sqrt(1.0 - z * z)
    half = r[:, None] * np.stack([across * np.cos(phi), across * np.sin(phi), z], axis=1)
    return np.concatenate([half, -half])


@kernel
def _remaining(x: Array, depth: Array, kinetic: Array, gm: float, softening: float) -> NDArray[np.bool_]:
    """Which points stay bound; `depth` is minus the potential of all of them, and is lowered in place."""
    n = x.shape[0]
    stays = np.ones(n, dtype=np.bool_)
    leaving = np.empty(n, dtype=np.int64)
    while True:
        count = 0
        for i in range(n):
            if stays[i] and kinetic[i] >= depth[i]:
                leaving[count] = i
                count += 1
        if count == 0:
            return stays
        for k in range(count):
            stays[leaving[k]] = False
        for i in range(n):
            if not stays[i]:
                continue
            for k in range(count):
                j = leaving[k]
                d2 = (x[i, 0] - x[j, 0]) ** 2 + (x[i, 1] - x[j, 1]) ** 2 + (x[i, 2] - x[j, 2]) ** 2
                depth[i] -= gm / np.sqrt(d2 + softening * softening)
