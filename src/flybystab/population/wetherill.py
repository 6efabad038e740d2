"""Encounter rate of two orbits whose angles circulate (Opik 1951, Wetherill 1967, in the form of Kessler 1981).

If node, pericentre and mean anomaly of both orbits circulate uniformly and independently, the distance from the Sun and
the ecliptic latitude of each body are independent, with the densities

    p(r) dr    = r dr / [pi a sqrt((r - q)(Q - r))],
    p(s) ds    = ds / [pi sqrt(sin^2 i - s^2)],         s = sin(latitude),

and the spatial density of an asteroid is ``p(r) p(s)/(2 pi r^2)``. The rate of passages within the cross-section
``sigma`` of a planet is the mean over the planet's own position of

    spatial density of the asteroid x <U sigma(U)>,     sigma = pi b^2 (1 + 2 GM/(b U^2)),

``U`` the relative speed far from the planet and ``<>`` the mean over the four equally likely combinations of relative
directions (approaching or receding from the Sun, going north or south). The inverse square roots at the ends of the
common ranges of ``r`` and ``s`` are the weight of Gauss-Chebyshev quadrature.
"""

from __future__ import annotations

import numpy as np

from flybystab.core.numerics.jit import kernel
from flybystab.typing import Array

#: Nodes in distance and in latitude.
NODES_R = 48
NODES_S = 24


@kernel
def _directions(
    r: float, s: float, a: float, e: float, cos_i: float, gm: float
) -> tuple[float, float, float]:
    """Magnitudes of the radial, east and north components of the velocity at distance `r` and latitude sine `s`."""
    h2 = gm * a * (1.0 - e * e)
    across2 = h2 / (r * r)
    radial2 = gm * (2.0 / r - 1.0 / a) - across2
    east = np.sqrt(across2) * cos_i / np.sqrt(max(1e-300, 1.0 - s * s))
    north2 = across2 - east * east
    return np.sqrt(max(0.0, radial2)), east, np.sqrt(max(0.0, north2))


@kernel
def rate_at_speeds(
    a: float,
    e: float,
    sin_i: float,
    cos_i: float,
    planet_a: float,
    planet_e: float,
    planet_sin_i: float,
    gm_sun: float,
    speeds: Array,
    weights: Array,
) -> int:
    """Relative speeds of encounters and their weights; returns how many there are.

    Parameters
    ----------
    a, e, sin_i, cos_i
        Asteroid: semi-major axis (m), eccentricity below 1, inclination to the reference plane of the planet's.
    planet_a, planet_e, planet_sin_i
        Planet (m).
    gm_sun : float
        m3/s2.
    speeds, weights : ndarray (4 NODES_R NODES_S,)
        Written: ``U`` (m/s) and the contribution to the rate per ``sigma`` (1/(m2 s)): the rate is
        ``sum weights sigma(speeds)``.
    """
    low, high = a * (1.0 - e), a * (1.0 + e)
    planet_low, planet_high = planet_a * (1.0 - planet_e), planet_a * (1.0 + planet_e)
    r0, r1 = max(low, planet_low), min(high, planet_high)
    top = min(sin_i, planet_sin_i)
    if r0 > r1 or sin_i <= 0.0:
        return 0
    planet_cos_i = np.sqrt(1.0 - planet_sin_i * planet_sin_i)
    circular = planet_e == 0.0
    count = 0
    nodes_r = 1 if circular else NODES_R
    nodes_s = 1 if planet_sin_i == 0.0 else NODES_S
    for k in range(nodes_r):
        x = np.cos((k + 0.5) * np.pi / nodes_r)
        r = planet_a if circular else 0.5 * (r0 + r1) + 0.5 * (r1 - r0) * x
        # p'(r) dr = (p'(r) sqrt((r - r0)(r1 - r))) x Chebyshev weight
        if circular:
            planet_density = 1.0
        else:
            planet_density = (
                r / planet_a / nodes_r * np.sqrt((r - r0) * (r1 - r) / ((r - planet_low) * (planet_high - r)))
            )
        inside = (r - low) * (high - r)
        if inside <= 0.0:
            continue
        radial_density = r / (np.pi * a * np.sqrt(inside))
        for j in range(nodes_s):
            s = 0.0 if nodes_s == 1 else top * np.cos((j + 0.5) * np.pi / nodes_s)
            share = planet_density
            if nodes_s > 1:
                share *= np.sqrt((top * top - s * s) / (planet_sin_i * planet_sin_i - s * s)) / nodes_s
            latitude2 = sin_i * sin_i - s * s
            if latitude2 <= 0.0:
                continue
            density = radial_density / (np.pi * np.sqrt(latitude2)) / (2.0 * np.pi * r * r)
            radial, east, north = _directions(r, s, a, e, cos_i, gm_sun)
            p_radial, p_east, p_north = _directions(r, s, planet_a, planet_e, planet_cos_i, gm_sun)
            for sign_r in (-1.0, 1.0):
                for sign_n in (-1.0, 1.0):
                    u = np.sqrt(
                        (radial + sign_r * p_radial) ** 2
                        + (east - p_east) ** 2
                        + (north + sign_n * p_north) ** 2
                    )
                    if u == 0.0:  # the same orbit: no relative motion, no encounters
                        continue
                    speeds[count] = u
                    weights[count] = 0.25 * share * density * u
                    count += 1
    return count


@kernel
def speed_sums(elements: Array, planet: Array, gm_sun: float, sums: Array) -> None:
    """Sums ``sum weights U^k`` for k = -2 to 2, from which rates at any periapsis distance follow.

    The focused cross-section is ``sigma = pi q^2 + 2 pi q GM/U^2``, so that the rate within ``q`` and the mean of
    ``U^m`` over these encounters are linear combinations of the sums (:func:`rate_and_moments`).

    Parameters
    ----------
    elements : ndarray (n, 3)
        Semi-major axis (m), eccentricity, inclination (rad).
    planet : ndarray (3,)
        The same of the planet.
    gm_sun : float
        m3/s2.
    sums : ndarray (n, 5)
        Written, SI.
    """
    speeds, weights = np.empty(4 * NODES_R * NODES_S), np.empty(4 * NODES_R * NODES_S)
    for n in range(elements.shape[0]):
        a, e, i = elements[n, 0], elements[n, 1], elements[n, 2]
        m = rate_at_speeds(
            a, e, np.sin(i), np.cos(i), planet[0], planet[1], np.sin(planet[2]), gm_sun, speeds, weights
        )
        sums[n, :] = 0.0
        for k in range(m):
            u, w = speeds[k], weights[k]
            sums[n, 0] += w / (u * u)
            sums[n, 1] += w / u
            sums[n, 2] += w
            sums[n, 3] += w * u
            sums[n, 4] += w * u * u


def rate_and_moments(sums: Array, gm: float, periapsis: float) -> tuple[Array, Array, Array]:
    """Rate (1/s) within `periapsis` (m), and mean (m/s) and mean square of ``U`` over these encounters.

    ``rate <U^m> = pi q^2 sum w U^m + 2 pi q GM sum w U^(m - 2)``; the moments are nan where the rate is zero.
    """
    area, focus = np.pi * periapsis**2, 2.0 * np.pi * periapsis * gm
    rate, first, second = (area * sums[:, m + 2] + focus * sums[:, m] for m in range(3))
    with np.errstate(invalid="ignore"):
        return rate, first / rate, second / rate
