"""Spin states and attitudes of free rigid bodies: initial conditions from catalogue values.

A free body keeps its angular momentum ``L`` and its energy ``E``; moments of inertia ``J1 <= J2 <= J3``
belong to the long, middle and short axis. With ``J = L^2/(2E)`` the motion of the angular velocity in the
body is (Landau & Lifshitz, Mechanics, section 37)

- short-axis mode, ``J2 < J < J3``: ``(A1 cn, A2 sn, A3 dn)(lambda t | k^2)``,
- long-axis mode, ``J1 < J < J2``: ``(A1 dn, A2 sn, A3 cn)(lambda t | k^2)``,

with period ``4 K(k)/lambda``. The axis of the mode precesses about ``L`` at the rate
``L (sum' J w^2)/(sum' J^2 w^2)``, the sums over the other two axes. Photometry of a tumbler gives both
periods (``P_psi`` and ``P_phi``); with the inertia ratios they fix ``L`` and ``E``.
"""

from __future__ import annotations

import numpy as np

from flybystab.constants import OBLIQUITY_J2000
from flybystab.errors import InvalidInput, UnknownName
from flybystab.typing import Array

MODES = ("SAM", "LAM")


def free_spin(moments: Array, momentum: float, j: float, phase: Array) -> tuple[Array, float]:
    """Angular velocity of a free body along its axes, and the period of that motion.

    Parameters
    ----------
    moments : ndarray (3,)
        ``J1 < J2 < J3``, in any unit.
    momentum : float
        ``L``, in the unit of `moments` per second.
    j : float
        ``L^2/(2E)``, between ``J1`` and ``J3``: short-axis mode above ``J2``, long-axis mode below.
    phase : ndarray (n,)
        Phase as a fraction of the period; at 0 the middle component is zero and increasing.

    Returns
    -------
    omega : ndarray (n, 3)
        rad/s.
    period : float
        s.
    """
    from scipy.special import ellipj, ellipk

    j1, j2, j3 = (float(x) for x in moments)
    a1 = momentum * np.sqrt((j3 - j) / (j * j1 * (j3 - j1)))
    a3 = momentum * np.sqrt((j - j1) / (j * j3 * (j3 - j1)))
    short = (j3 - j2) * (j - j1)
    long = (j2 - j1) * (j3 - j)
    if short >= long:
        a2 = momentum * np.sqrt((j3 - j) / (j * j2 * (j3 - j2)))
        m, scale = long / short, short
    else:
        a2 = momentum * np.sqrt((j - j1) / (j * j2 * (j2 - j1)))
        m, scale = short / long, long
    rate = momentum * np.sqrt(scale / (j * j1 * j2 * j3))
    quarter = float(ellipk(m))
    sn, cn, dn, _ = ellipj(4.0 * quarter * np.atleast_1d(phase), m)
    first, third = (cn, dn) if short >= long else (dn, cn)
    return np.stack([a1 * first, a2 * sn, a3 * third], axis=-1), 4.0 * quarter / float(rate)


def precession_period(moments: Array, momentum: float, j: float) -> float:
    """Mean period, s, of the axis of the mode about the angular momentum (arguments: `free_spin`)."""
    # The integrand is periodic and analytic: the mean over equal steps converges geometrically.
    omega, _ = free_spin(moments, momentum, j, np.arange(512) / 512)
    others = slice(0, 2) if j > moments[1] else slice(1, 3)
    jw = moments[others] * omega[:, others]
    rate = momentum * np.sum(jw * omega[:, others], axis=1) / np.sum(jw * jw, axis=1)
    return float(2.0 * np.pi / np.mean(rate))


def tumbling_state(
    moments: Array, precession: float, rotation: float, mode: str = "SAM"
) -> tuple[float, float]:
    """Angular momentum and ``J = L^2/(2E)`` of a tumbler from its two periods.

    Parameters
    ----------
    moments : ndarray (3,)
        ``J1 < J2 < J3``, in any unit.
    precession, rotation : float
        ``P_phi`` and ``P_psi``, s.
    mode : str
        "SAM" or "LAM".

    Returns
    -------
    momentum, j : float
        For :func:`free_spin`.

    Raises
    ------
    InvalidInput
        No free rotation with these moments of inertia has the two periods.
    """
    from scipy.optimize import brentq

    if mode not in MODES:
        raise UnknownName("tumbling mode", mode, list(MODES))
    j1, j2, j3 = (float(x) for x in moments)
    if not 0.0 < j1 < j2 < j3:
        raise InvalidInput(
            "moments",
            moments,
            "three different moments of inertia in ascending order: semi-axes a > b > c, without which the periods of "
            "a tumbler determine no spin state (a body that does not tumble: --period; Asteroid(body=...))",
        )
    low, high = (j2, j3) if mode == "SAM" else (j1, j2)
    edge = 1e-9 * (high - low)

    def excess(j: float) -> float:
        return free_spin(moments, 1.0, j, np.zeros(1))[1] / precession_period(moments, 1.0, j) - wanted

    wanted = rotation / precession
    ends = excess(low + edge), excess(high - edge)
    if ends[0] * ends[1] > 0.0:
        between = sorted(e + wanted for e in ends)
        raise InvalidInput(
            "rotation period / precession period",
            f"{wanted:.6g}",
            f"a ratio in ({between[0]:.4g}, {between[1]:.4g}): the range of a {mode} of this body",
        )
    j = brentq(excess, low + edge, high - edge, xtol=1e-15 * j3, rtol=1e-15)
    # Both periods go as 1/L.
    return free_spin(moments, 1.0, j, np.zeros(1))[1] / rotation, j


def ecliptic_direction(longitude: float, latitude: float) -> Array:
    """Unit vector, ICRF, of ecliptic coordinates (rad; ecliptic and equinox J2000)."""
    x = np.cos(latitude) * np.cos(longitude)
    y = np.cos(latitude) * np.sin(longitude)
    z = np.sin(latitude)
    c, s = np.cos(OBLIQUITY_J2000), np.sin(OBLIQUITY_J2000)
    return np.array([x, c * y - s * z, s * y + c * z])


def _basis(direction: Array) -> Array:
    """Rotations, shape (n, 3, 3), whose third column is the unit vector `direction`, shape (n, 3)."""
    helper = np.eye(3)[np.argmin(np.abs(direction), axis=1)]
    first = np.cross(helper, direction)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(direction, first), direction], axis=2)


def attitude_matrix(momentum: Array, pole: Array, angle: float) -> Array:
    """Rotation from body axes to the frame of `pole`; one row of :func:`attitude_matrices`."""
    return attitude_matrices(momentum, np.asarray(pole, dtype=float)[None], np.array([angle]))[0]


def attitude_matrices(momentum: Array, pole: Array, angle: Array) -> Array:
    """Rotations from body axes to the frame of `pole`.

    Parameters
    ----------
    momentum : ndarray (3,) or (n, 3)
        Angular momentum along the body's axes, any length; ``(0, 0, 1)`` for rotation about the short axis.
    pole : ndarray (3,) or (n, 3)
        Direction of the angular momentum in the outer frame, any length.
    angle : ndarray (n,)
        Rotation about the pole, rad; `momentum` and `pole` alone leave it free.

    Returns
    -------
    ndarray (n, 3, 3)
        ``Q`` with ``Q @ momentum`` along `pole`.
    """
    n = len(angle)
    inner, outer = (np.broadcast_to(np.asarray(v, dtype=float), (n, 3)) for v in (momentum, pole))
    turn = np.zeros((n, 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    bases = [_basis(v / np.linalg.norm(v, axis=1)[:, None]) for v in (outer, inner)]
    return np.asarray(bases[0] @ turn @ np.swapaxes(bases[1], 1, 2))


def isotropic_directions(uniform: Array) -> Array:
    """Unit vectors, shape (n, 3), isotropically distributed, from uniform numbers in [0, 1), shape (n, 2)."""
    z = 2.0 * uniform[:, 0] - 1.0
    rho = np.sqrt(1.0 - z * z)
    longitude = 2.0 * np.pi * uniform[:, 1]
    return np.stack([rho * np.cos(longitude), rho * np.sin(longitude), z], axis=1)


def isotropic_rotations(turn: Array, uniform: Array) -> Array:
    """Rotations, shape (n, 3, 3), uniform over SO(3): isotropic third columns, rotated about them by ``2 pi turn``."""
    frame = _basis(isotropic_directions(uniform))
    c, s = np.cos(2.0 * np.pi * turn)[:, None], np.sin(2.0 * np.pi * turn)[:, None]
    x, y = frame[:, :, 0], frame[:, :, 1]
    return np.stack([c * x + s * y, c * y - s * x, frame[:, :, 2]], axis=2)


def isotropic_direction(uniform: Array) -> Array:
    """Isotropically distributed unit vector from two uniform numbers in [0, 1)."""
    return isotropic_directions(np.asarray(uniform)[None])[0]
