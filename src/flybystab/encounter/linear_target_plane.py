"""A covariance mapped linearly to the target plane: its ellipse and its impact probability."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.table import Row
from astropy.units import Quantity
from scipy.integrate import quad
from scipy.stats import norm

from flybystab.orbit.planets import Planet
from flybystab.orbit.target_plane import capture_radius
from flybystab.tabular import Record
from flybystab.typing import Array


@dataclass(frozen=True, eq=False, repr=False)
class LinearPlane(Record):
    """The covariance of an orbit mapped linearly to the target plane.

    Attributes
    ----------
    centre : Quantity, shape (2,)
        ``(B.T, B.R)`` of the nominal orbit.
    covariance : Quantity, shape (2, 2)
        Of ``(B.T, B.R)``.
    distance_sigma, time_sigma : Quantity
        1-sigma of distance and time of closest approach, by the same map.
    impact_probability : float
        Probability inside the capture radius of the nominal ``v_inf``.
    nonlinearity : float
        Largest deviation of the middle of a pair of one-sigma points from the nominal, over the longer
        semi-axis of the ellipse: the map and the probability are valid if it is much less than one.
    """

    centre: Quantity
    covariance: Quantity
    distance_sigma: Quantity
    time_sigma: Quantity
    impact_probability: float
    nonlinearity: float


def ellipse(covariance: Quantity) -> tuple[Quantity, Quantity, Quantity]:
    """Semi-axes of the one-sigma ellipse, longer one first, and its direction from +T to +R, 0 to 180 deg."""
    matrix = covariance.to_value(u.km**2)
    if not np.isfinite(matrix).all():
        return np.nan * u.km, np.nan * u.km, np.nan * u.deg
    values, vectors = np.linalg.eigh(matrix)
    axes = np.sqrt(np.maximum(values, 0.0)) * u.km
    angle = np.arctan2(vectors[1, 1], vectors[0, 1]) % np.pi
    return axes[1], axes[0], np.rad2deg(angle) * u.deg


def disc_probability(centre: Array, covariance: Array, radius: float) -> float:
    """Probability of a normal distribution in the plane inside a disc around the origin.

    The integral is numerical along the shorter axis of the ellipse and in closed form along the other.

    Parameters
    ----------
    centre, covariance : ndarray, shapes (2,) and (2, 2)
        In the unit of `radius` and its square.
    """
    values, vectors = np.linalg.eigh(covariance)
    short, long = np.sqrt(np.maximum(values, (1e-12 * radius) ** 2))
    x0, y0 = vectors.T @ centre

    def slice_(x: float) -> float:
        half = np.sqrt(max(radius * radius - x * x, 0.0))
        inside = norm.sf((-half - y0) / long) - norm.sf((half - y0) / long)
        if y0 < 0.0:  # the tail on the side without cancellation
            inside = norm.cdf((half - y0) / long) - norm.cdf((-half - y0) / long)
        return float(norm.pdf((x - x0) / short) / short * inside)

    low, high = max(-radius, x0 - 12.0 * short), min(radius, x0 + 12.0 * short)
    if not low < high:
        return 0.0
    middle = [m for m in (x0,) if low < m < high]
    return float(quad(slice_, low, high, points=middle or None, limit=200, epsabs=0.0, epsrel=1e-8)[0])


def linear_plane(points: Array, nominal: Row, body: Planet) -> LinearPlane | None:
    """The linear map from pairs of rows: time, distance, B.T, B.R (SI) at plus and minus one sigma."""
    centre = np.array([nominal["b_t"].to_value(u.m), nominal["b_r"].to_value(u.m)])
    pairs = points[:, :4].reshape(-1, 2, 4)
    if not (np.isfinite(pairs).all() and np.isfinite(centre).all()):
        return None
    half = 0.5 * (pairs[:, 0] - pairs[:, 1])
    bent = 0.5 * (pairs[:, 0] + pairs[:, 1])[:, 2:] - centre
    matrix = half[:, 2:].T @ half[:, 2:]
    sigma = np.sqrt(np.sum(half**2, axis=0))
    disc = float(capture_radius(body.gm, body.impact_distance, nominal["v_inf"].to_value(u.m / u.s)))
    longest = float(np.sqrt(np.linalg.eigvalsh(matrix)[-1]))
    return LinearPlane(
        centre=(centre * u.m).to(u.km),
        covariance=(matrix * u.m**2).to(u.km**2),
        distance_sigma=(sigma[1] * u.m).to(u.km),
        time_sigma=sigma[0] * u.s,
        impact_probability=disc_probability(centre, matrix, disc),
        nonlinearity=float(np.abs(bent).max()) / longest if longest > 0.0 else 0.0,
    )
