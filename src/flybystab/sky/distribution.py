"""An uncertain orbit at an encounter: distances, target-plane points and impacts of its clones.

Two routes that share nothing but the integrator: clones, which need no assumption beyond the normal law at the
epoch and carry a sampling error; and the linear map of the covariance to the target plane, where the law stays
normal as long as the map is linear, which is measured.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import binomtest, norm

from flybystab.errors import InvalidInput, NoEncounter
from flybystab.sky.b_plane import capture_radius
from flybystab.sky.encounter import far_enough
from flybystab.sky.ephemeris import Ephemeris
from flybystab.sky.finder import find_encounters
from flybystab.sky.orbit import Orbit, later
from flybystab.sky.planets import Planet, planet
from flybystab.units import to_si

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LinearPlane:
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
        Share of the normal law inside the capture radius of the nominal ``v_inf``.
    nonlinearity : float
        Largest deviation of the middle of a pair of one-sigma points from the nominal, over the longer
        semi-axis of the ellipse: the map, and the probability, hold while it is far below one.
    """

    centre: Quantity
    covariance: Quantity
    distance_sigma: Quantity
    time_sigma: Quantity
    impact_probability: float
    nonlinearity: float


@dataclass(frozen=True, eq=False)
class EncounterDistribution:
    """Clones of an orbit at one encounter.

    Attributes
    ----------
    planet : Planet
    time : Time
        Closest approach of the nominal orbit, TDB.
    nominal : QTable Row
        The row of :func:`flybystab.find_encounters` for the nominal orbit.
    clones : tuple of Orbit, length n
    found : ndarray of bool, shape (n,)
        Clones that have a closest approach near this time; the others passed at another time or not at all,
        and their rows below are nan.
    time_offset : Quantity, shape (n,)
        Closest approach after that of the nominal orbit.
    distance, v_inf : Quantity, shape (n,)
        Distance between the centres (impacts: of the two-body orbit without a surface), speed far away.
    b : Quantity, shape (n, 2)
        ``(B.T, B.R)``, :mod:`flybystab.sky.b_plane`.
    impact : ndarray of bool, shape (n,)
        Surface or atmosphere reached.
    linear : LinearPlane or None
        The linear map; None where a point at one sigma has no passage, or a bound one.
    source : str
        The covariance.
    correlated : bool
        Whether the covariance had correlations.
    """

    planet: Planet
    time: Time
    nominal: Any = field(repr=False)
    clones: tuple[Orbit, ...] = field(repr=False)
    found: NDArray[np.bool_] = field(repr=False)
    time_offset: Quantity = field(repr=False)
    distance: Quantity = field(repr=False)
    v_inf: Quantity = field(repr=False)
    b: Quantity = field(repr=False)
    impact: NDArray[np.bool_] = field(repr=False)
    linear: LinearPlane | None
    source: str
    correlated: bool

    def __len__(self) -> int:
        return len(self.clones)

    @property
    def impact_probability(self) -> float:
        """Share of the clones that reach atmosphere or surface."""
        return float(np.mean(self.impact))

    def impact_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Clopper-Pearson interval of the impact probability: the error of sampling alone."""
        test = binomtest(int(self.impact.sum()), len(self))
        interval = test.proportion_ci(confidence_level=level, method="exact")
        return float(interval.low), float(interval.high)

    @property
    def distance_sigma(self) -> Quantity:
        """Standard deviation of the distance over the clones that were found."""
        return np.std(self.distance[self.found], ddof=1)

    @property
    def time_sigma(self) -> Quantity:
        """Standard deviation of the time of closest approach over the clones that were found."""
        return np.std(self.time_offset[self.found], ddof=1)

    def distance_interval(self, level: float = 0.9973) -> Quantity:
        """Quantiles of the distance that leave out ``(1 - level)/2`` on either side, shape (2,)."""
        return np.quantile(self.distance[self.found], [0.5 - 0.5 * level, 0.5 + 0.5 * level])

    @property
    def b_covariance(self) -> Quantity:
        """Sample covariance of ``(B.T, B.R)``, shape (2, 2), over the unbound clones."""
        points = self.b.to_value(u.km)
        return np.cov(points[np.isfinite(points).all(axis=1)].T) * u.km**2


def ellipse(covariance: Quantity) -> tuple[Quantity, Quantity, Quantity]:
    """Semi-axes of the one-sigma ellipse, longer one first, and its direction from +T to +R, 0 to 180 deg."""
    values, vectors = np.linalg.eigh(covariance.to_value(u.km**2))
    axes = np.sqrt(np.maximum(values, 0.0)) * u.km
    angle = np.arctan2(vectors[1, 1], vectors[0, 1]) % np.pi
    return axes[1], axes[0], np.rad2deg(angle) * u.deg


def disc_probability(centre: Array, covariance: Array, radius: float) -> float:
    """Share of a normal law in the plane inside a disc around the origin.

    Along the shorter axis of the ellipse the integral is done numerically, along the other in closed form.

    Parameters
    ----------
    centre, covariance : ndarray, shapes (2,) and (2, 2)
        Any unit, the same as that of `radius`.
    """
    values, vectors = np.linalg.eigh(covariance)
    short, long = np.sqrt(np.maximum(values, (1e-12 * radius) ** 2))
    x0, y0 = vectors.T @ centre

    def slice_(x: float) -> float:
        half = np.sqrt(max(radius * radius - x * x, 0.0))
        inside = norm.sf((-half - y0) / long) - norm.sf((half - y0) / long)
        if y0 < 0.0:  # the tail on the side where no digit is lost
            inside = norm.cdf((half - y0) / long) - norm.cdf((-half - y0) / long)
        return float(norm.pdf((x - x0) / short) / short * inside)

    low, high = max(-radius, x0 - 12.0 * short), min(radius, x0 + 12.0 * short)
    if not low < high:
        return 0.0
    middle = [m for m in (x0,) if low < m < high]
    return float(quad(slice_, low, high, points=middle or None, limit=200, epsabs=0.0, epsrel=1e-8)[0])


def encounter_distribution(
    orbit: Any,
    planet: str | Planet,
    time: Time,
    *,
    n: int = 1000,
    seed: int = 0,
    search: Quantity = 10 * u.d,
    within: Quantity | None = None,
    ephemeris: str | Ephemeris | None = None,
    tolerance: float = 1e-12,
    threads: int | None = None,
) -> EncounterDistribution:
    """Clones of an orbit through one encounter.

    Parameters
    ----------
    orbit : Orbit
        Or anything with an attribute ``orbit``; it must have a covariance.
    planet : str or Planet
        The body encountered.
    time : Time
        Near closest approach; the nominal orbit's minimum of distance nearest to it counts.
    n, seed : int
        Number of clones and seed: see :meth:`flybystab.Orbit.clones`.
    search : Quantity
        How far from the time of the nominal passage those of the clones may be.
    within : Quantity, optional
        Largest distance that counts as a passage; by default 20 Hill radii, at most 1 au.
    ephemeris, tolerance, threads
        As in :func:`flybystab.find_encounters`.

    Raises
    ------
    NoEncounter
        The nominal orbit has no passage there.
    OutOfSpan
        The ephemeris covers the passage or the epoch of the covariance not at all.
    InvalidInput, UnitMismatch, UnknownName
    """
    path = getattr(orbit, "orbit", orbit)
    if not isinstance(path, Orbit):
        raise InvalidInput("orbit", orbit, "an Orbit, or an object with one as its attribute 'orbit'")
    if not isinstance(time, Time) or time.shape != ():
        raise InvalidInput("time", time, "one astropy Time")
    body = _planet(planet)
    reach = to_si(search, u.s, "search", low=0.0, open_low=True)
    largest = far_enough(body) if within is None else to_si(within, u.m, "within", low=0.0, open_low=True)
    clones = path.clones(n, seed, ephemeris)
    pairs = path.sigma_points(ephemeris)
    covariance = path.covariance
    assert covariance is not None

    def passages(orbits: list[Orbit], near: Time) -> tuple[QTable, Array]:
        """Passages of the orbits and, for each orbit, its row (-1: none)."""
        table = find_encounters(
            orbits,
            later(near, -reach),
            later(near, reach),
            [body.name],
            largest * u.m,
            ephemeris=ephemeris,
            tolerance=tolerance,
            threads=threads,
        )
        rows = np.full(len(orbits), -1)
        if len(table):
            gap = np.abs((table["time"] - near).to_value(u.s))
            # An impact ends a track: it comes before any other minimum.
            order = np.lexsort((gap, ~table["impact"]))[::-1]
            rows[table["index"][order]] = order
        return table, rows

    table, rows = passages([path], time.tdb)
    if rows[0] < 0:
        raise NoEncounter(
            f"{path.name or 'the orbit'} has no minimum of distance to {body.name} within "
            f"{(search).to(u.d):g} of {time.tdb.iso} TDB and {(largest * u.m).to(u.au):.4g}"
        )
    nominal = table[int(rows[0])]
    middle = nominal["time"]
    points = [o for pair in pairs for o in pair]
    table, rows = passages([*clones, *points], middle)
    offset = (table["time"] - middle).to_value(u.s) if len(table) else np.zeros(0)
    columns = np.full((len(rows), 6), np.nan)
    have = rows >= 0
    if len(table):
        every = np.column_stack(
            [
                offset,
                *(table[c].to_value(u.m) for c in ("distance", "b_t", "b_r")),
                table["v_inf"].to_value(u.m / u.s),
                table["impact"],
            ]
        )
        columns[have] = every[rows[have]]
    first = columns[: len(clones)]
    return EncounterDistribution(
        planet=body,
        time=middle,
        nominal=nominal,
        clones=clones,
        found=have[: len(clones)],
        time_offset=first[:, 0] * u.s,
        distance=(first[:, 1] * u.m).to(u.km),
        v_inf=(first[:, 4] * u.m / u.s).to(u.km / u.s),
        b=(first[:, 2:4] * u.m).to(u.km),
        impact=first[:, 5] > 0.0,
        linear=_linear(columns[len(clones) :], nominal, body),
        source=covariance.source,
        correlated=covariance.correlated,
    )


def _planet(name: str | Planet) -> Planet:
    return planet(name)


def _linear(points: Array, nominal: Any, body: Planet) -> LinearPlane | None:
    """The linear map from pairs of rows: time, distance, B.T, B.R (SI) at plus and minus one sigma."""
    centre = np.array([nominal["b_t"].to_value(u.m), nominal["b_r"].to_value(u.m)])
    pairs = points[:, :4].reshape(-1, 2, 4)
    if not (np.isfinite(pairs).all() and np.isfinite(centre).all()):
        return None
    half = 0.5 * (pairs[:, 0] - pairs[:, 1])
    bent = 0.5 * (pairs[:, 0] + pairs[:, 1])[:, 2:] - centre
    matrix = half[:, 2:].T @ half[:, 2:]
    sigma = np.sqrt(np.sum(half**2, axis=0))
    disc = capture_radius(body.gm, body.impact_distance, nominal["v_inf"].to_value(u.m / u.s))
    longest = float(np.sqrt(np.linalg.eigvalsh(matrix)[-1]))
    return LinearPlane(
        centre=(centre * u.m).to(u.km),
        covariance=(matrix * u.m**2).to(u.km**2),
        distance_sigma=(sigma[1] * u.m).to(u.km),
        time_sigma=sigma[0] * u.s,
        impact_probability=disc_probability(centre, matrix, disc),
        nonlinearity=float(np.abs(bent).max()) / longest if longest > 0.0 else 0.0,
    )
