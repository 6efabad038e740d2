"""The target plane (B-plane) of an encounter, and the point where the incoming asymptote intersects it.

S is the direction of the incoming asymptote, ``T = S x N/|S x N|`` with a direction N ("north"), ``R = S x T``
(Kizner 1961). B points from the planet's centre to the asymptote, and ``|B|`` is the impact parameter. The
focusing by the planet does not enter: the errors of an orbit form an ellipse in this plane, unlike those of distances.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flybystab.errors import InvalidInput
from flybystab.typing import Array

#: North of every target plane unless another is given: +z of the frame, the Earth's equator in ICRF.
NORTH = (0.0, 0.0, 1.0)


def target_plane(
    states: Array, gm: float | Array, north: Sequence[float] | Array = NORTH
) -> tuple[Array, Array]:
    """Target-plane coordinates of the two-body hyperbolas through states relative to a planet.

    With ``h = r x v``, the eccentricity vector ``e = v x h/gm - r/|r|`` and ``v_inf``:
    ``S = [e + (v_inf/gm) h x e]/|e|^2`` and ``B = S x h/v_inf``; a plunge with h = 0 has B = 0.

    Parameters
    ----------
    states : ndarray, shape (n, 6)
        Position (m) and velocity (m/s), at any point of the encounter.
    gm : float or ndarray, shape (n,)
        Gravitational parameter of the planet, m3/s2.
    north : sequence of float
        The direction N in the frame of the states.

    Returns
    -------
    ndarray, shape (n, 2)
        ``B.T`` and ``B.R``, m; nan for a bound orbit, which has no asymptote, and where S points north.
    ndarray, shape (n,)
        ``v_inf``, m/s; nan for a bound orbit.
    """
    s = np.atleast_2d(np.asarray(states, dtype=float))
    r, v = s[:, :3], s[:, 3:]
    mass = np.broadcast_to(np.asarray(gm, dtype=float), (len(s),))
    distance = np.linalg.norm(r, axis=1)
    energy = np.sum(v * v, axis=1) - 2.0 * mass / distance
    speed = np.sqrt(np.where(energy > 0.0, energy, np.nan))
    h = np.cross(r, v)
    e = np.cross(v, h) / mass[:, None] - r / distance[:, None]
    asymptote = (e + (speed / mass)[:, None] * np.cross(h, e)) / np.sum(e * e, axis=1)[:, None]
    b = np.cross(asymptote, h) / speed[:, None]
    axis = np.asarray(north, dtype=float)
    t = np.cross(asymptote, axis)
    size = np.linalg.norm(t, axis=1)
    t /= np.where(size > 1e-12 * np.linalg.norm(axis), size, np.nan)[:, None]
    return np.stack([np.sum(b * t, axis=1), np.sum(b * np.cross(asymptote, t), axis=1)], axis=1), speed


def capture_radius(gm: float, distance: float | Array, v_inf: float | Array) -> Array:
    """Impact parameter (m) of a path with periapsis ``distance`` (m): ``d sqrt(1 + 2 gm/(d v_inf^2))``."""
    return distance * np.sqrt(1.0 + 2.0 * gm / (distance * np.square(v_inf)))


def checked(b: Array, v_inf: float, north: Sequence[float]) -> Array:
    """The coordinates `b`; raises InvalidInput for a bound orbit, or if `north` is along the asymptote."""
    if not v_inf > 0.0:
        raise InvalidInput("v_inf", v_inf, "a speed above zero: a bound orbit has no target plane")
    if not np.isfinite(b).all():
        raise InvalidInput("north", north, "a direction other than that of the asymptote")
    return b
