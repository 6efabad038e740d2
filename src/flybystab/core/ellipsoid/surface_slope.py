"""Slope of the surface of an ellipsoid under gravity, spin and tide.

At a point ``x`` of the surface, in the body frame, the effective gravity on loose material is

    g = (K - Omega^2 - Omegadot) x,    K = -2 pi G rho A + K_t

(self-gravity, tide, centrifugal and Euler acceleration); its slope is the angle between the outward normal and
``-g``. On an ellipsoid ``g`` is linear in ``x``: no field has to be integrated.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array


@kernel
def angular_acceleration(s: Array, omega: Array, tide: Array, out: Array) -> None:
    """Write ``omegadot[3]`` (rad/s2) of a rigid ellipsoid in the principal frame.

    Euler: ``J_i omegadot_i = torque_i - (omega x J omega)_i`` with ``J_1 = (m/5)(S_2 + S_3)`` and the tidal torque
    ``torque_1 = (m/5) K_23 (S_2 - S_3)``, and cyclic. `s` are squared semi-axes (m2), `tide` six components (s^-2).
    """
    out[0] = (s[1] - s[2]) * (tide[5] - omega[1] * omega[2]) / (s[1] + s[2])
    out[1] = (s[2] - s[0]) * (tide[4] - omega[2] * omega[0]) / (s[2] + s[0])
    out[2] = (s[0] - s[1]) * (tide[3] - omega[0] * omega[1]) / (s[0] + s[1])


@kernel
def effective_field(s: Array, pi_g_rho: float, omega: Array, tide: Array, out: Array) -> None:
    """Write the matrix ``out[3, 3]`` (s^-2) with ``g = out x``: ``K - Omega^2 - Omegadot``."""
    a1, a2, a3 = gravity_coefficients(s[0], s[1], s[2])
    w2 = omega[0] * omega[0] + omega[1] * omega[1] + omega[2] * omega[2]
    for i in range(3):
        for j in range(3):
            out[i, j] = -omega[i] * omega[j]
        out[i, i] += w2 + tide[i]
    out[0, 0] -= 2.0 * pi_g_rho * a1
    out[1, 1] -= 2.0 * pi_g_rho * a2
    out[2, 2] -= 2.0 * pi_g_rho * a3
    r = np.empty(3)
    angular_acceleration(s, omega, tide, r)
    # -Omegadot x = -omegadot cross x
    out[0, 1] += tide[3] + r[2]
    out[1, 0] += tide[3] - r[2]
    out[0, 2] += tide[4] - r[1]
    out[2, 0] += tide[4] + r[1]
    out[1, 2] += tide[5] + r[0]
    out[2, 1] += tide[5] - r[0]


@kernel
def slopes(s: Array, field: Array, points: Array, out: Array) -> None:
    """Write the slope ``out[n]`` (rad) at surface ``points[n, 3]`` (m) of the ellipsoid, in ``[0, pi]``.

    Above ``pi/2`` the effective gravity points outwards. The normal is along ``x_i/S_i``; ``atan2`` keeps small slopes
    exact.
    """
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        u = -(field[0, 0] * x + field[0, 1] * y + field[0, 2] * z)
        v = -(field[1, 0] * x + field[1, 1] * y + field[1, 2] * z)
        w = -(field[2, 0] * x + field[2, 1] * y + field[2, 2] * z)
        a = x / s[0]
        b = y / s[1]
        c = z / s[2]
        cx = b * w - c * v
        cy = c * u - a * w
        cz = a * v - b * u
        out[i] = np.arctan2(np.sqrt(cx * cx + cy * cy + cz * cz), a * u + b * v + c * w)


@kernel
def slopes_through(
    s: Array, pi_g_rho: float, omega: Array, tide: Array, points: Array, least: Array, greatest: Array
) -> None:
    """Write the least and greatest slope (rad) at every point over instants ``omega[m, 3]``, ``tide[m, 6]``."""
    field = np.empty((3, 3))
    now = np.empty(points.shape[0])
    least[:] = np.inf
    greatest[:] = -np.inf
    for k in range(omega.shape[0]):
        effective_field(s, pi_g_rho, omega[k], tide[k], field)
        slopes(s, field, points, now)
        for i in range(points.shape[0]):
            least[i] = min(least[i], now[i])
            greatest[i] = max(greatest[i], now[i])
