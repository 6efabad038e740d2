"""An uncertain orbit at an encounter: distances, target-plane points and impacts of its clones.

Two methods are used that have only the integrator in common. Clones assume no more than a normal distribution at the
epoch and have a sampling error. The linear map of the covariance to the target plane is valid where the map is linear;
its nonlinearity is measured.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import astropy.units as u
import numpy as np
from astropy.table import QTable, Row
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray
from scipy.stats import binomtest

from flybystab.arguments import check_arguments, finite
from flybystab.core.numerics.threads import worker_count
from flybystab.encounter.linear_target_plane import LinearPlane, linear_plane
from flybystab.encounter.reach import far_enough
from flybystab.errors import InvalidInput, NoEncounter
from flybystab.orbit.ephemeris import Ephemeris
from flybystab.orbit.epochs import later
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet, planet
from flybystab.orbit.search.encounter_finder import find_encounters
from flybystab.progress import Progressing
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import brief, checked_time, to_si


@dataclass(frozen=True, eq=False)
class EncounterDistribution(Tabular):
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
        Clones that have a closest approach near this time. The values below are nan for the others, whose
        encounter is at another time or absent.
    time_offset : Quantity, shape (n,)
        Time of closest approach less that of the nominal orbit.
    distance, v_inf : Quantity, shape (n,)
        Distance between the centres (impacts: of the two-body orbit without a surface), hyperbolic excess speed.
    b : Quantity, shape (n, 2)
        ``(B.T, B.R)``, :mod:`flybystab.orbit.target_plane`.
    position, velocity : Quantity, shape (n, 3)
        ICRF, relative to the planet, at closest approach (impacts: at the last step outside).
    impact : ndarray of bool, shape (n,)
        Surface or atmosphere reached.
    linear : LinearPlane or None
        The linear map; None where an orbit displaced by one sigma has no encounter, or is bound to the planet.
    source : str
        Source of the covariance.
    correlated : bool
        Whether the covariance had correlations.
    """

    planet: Planet
    time: Time
    nominal: Row = field(repr=False)
    clones: tuple[Orbit, ...] = field(repr=False)
    found: NDArray[np.bool_] = field(repr=False)
    time_offset: Quantity = field(repr=False)
    distance: Quantity = field(repr=False)
    v_inf: Quantity = field(repr=False)
    b: Quantity = field(repr=False)
    position: Quantity = field(repr=False)
    velocity: Quantity = field(repr=False)
    impact: NDArray[np.bool_] = field(repr=False)
    linear: LinearPlane | None
    source: str
    correlated: bool

    _left_out: ClassVar[tuple[str, ...]] = ("nominal", "clones")

    def __len__(self) -> int:
        return len(self.clones)

    @property
    def impact_probability(self) -> float:
        """Fraction of the clones that reach the atmosphere or the surface."""
        return float(np.mean(self.impact))

    @check_arguments
    def impact_interval(self, level: float = 0.95) -> tuple[float, float]:
        """Clopper-Pearson interval of the impact probability, from sampling alone."""
        test = binomtest(int(self.impact.sum()), len(self))
        interval = test.proportion_ci(confidence_level=finite(level, "level", 0.0, 1.0), method="exact")
        return float(interval.low), float(interval.high)

    @property
    def distance_sigma(self) -> Quantity:
        """Standard deviation of the distance over the clones that were found."""
        return np.std(self.distance[self.found], ddof=1)

    @property
    def time_sigma(self) -> Quantity:
        """Standard deviation of the time of closest approach over the clones that were found."""
        return np.std(self.time_offset[self.found], ddof=1)

    @check_arguments
    def distance_interval(self, level: float = 0.9973) -> Quantity:
        """Quantiles of the distance that leave out ``(1 - level)/2`` on either side, shape (2,)."""
        level = finite(level, "level", 0.0, 1.0)
        return np.quantile(self.distance[self.found], [0.5 - 0.5 * level, 0.5 + 0.5 * level])

    @property
    def b_covariance(self) -> Quantity:
        """Sample covariance of ``(B.T, B.R)``, shape (2, 2), over the unbound clones."""
        points = self.b.to_value(u.km)
        points = points[np.isfinite(points).all(axis=1)]
        return (np.cov(points.T) if len(points) > 1 else np.full((2, 2), np.nan)) * u.km**2

    def __repr__(self) -> str:
        near = int(self.found.sum())
        sigma = f", {brief(np.median(self.distance[self.found]), u.km)}" if near else ""
        sigma += f" +- {brief(self.distance_sigma, u.km)}" if near > 1 else ""
        return (
            f"<EncounterDistribution {self.planet.name}, {self.time.tdb.iso[:10]}: {len(self)} clones{sigma}, "
            f"impact probability {self.impact_probability:.3g}>"
        )


@check_arguments
def encounter_distribution(
    orbit: object,
    planet: str | Planet,
    time: Time | str,
    *,
    n: int = 1000,
    seed: int = 0,
    search: Quantity = 10 * u.d,
    within: Quantity | None = None,
    ephemeris: str | Ephemeris | None = None,
    tolerance: float = 1e-12,
    workers: int | None = None,
    threads: int | None = None,
    progress: Progressing = None,
) -> EncounterDistribution:
    """Clones of an orbit through one encounter.

    Parameters
    ----------
    orbit : Orbit
        An orbit with a covariance, or an object with one as its attribute ``orbit``.
    planet : str or Planet
        The body encountered.
    time : Time or str
        Near closest approach (text: TDB); the nominal orbit's minimum of distance nearest to it counts.
    n, seed : int
        Number of clones and seed: see :meth:`flybystab.Orbit.clones`.
    search : Quantity
        Largest time between the closest approaches of a clone and of the nominal orbit.
    within : Quantity, optional
        Largest distance that counts as an encounter; by default 20 Hill radii, at most 1 au.
    ephemeris, tolerance, workers
        As in :func:`flybystab.find_encounters`.
    threads : int, optional
        Deprecated name of `workers`.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Raises
    ------
    NoEncounter
        The nominal orbit has no encounter there.
    OutOfSpan
        The ephemeris does not cover the encounter or the epoch of the covariance.
    InvalidInput, UnitMismatch, UnknownName
    """
    path = _path(orbit)
    workers = worker_count(workers, threads)
    time = checked_time(time, "time")
    body = _planet(planet)
    reach = to_si(search, u.s, "search", low=0.0, open_low=True)
    largest = far_enough(body) if within is None else to_si(within, u.m, "within", low=0.0, open_low=True)
    table = find_encounters(
        path,
        later(time, -reach),
        later(time, reach),
        [body.name],
        largest * u.m,
        ephemeris=ephemeris,
        tolerance=tolerance,
        workers=workers,
    )
    table = table[table["planet"] == body.name]
    if not len(table):
        raise NoEncounter(
            f"{path.name or 'the orbit'} has no minimum of distance to {body.name} within "
            f"{search.to(u.d):g} of {time.tdb.iso} TDB and {(largest * u.m).to(u.au):.4g}"
        )
    row = int(np.argmin(np.abs((table["time"] - time).to_value(u.s))))
    return distributions(
        path,
        table[row : row + 1],
        n=n,
        seed=seed,
        search=search,
        within=largest * u.m,
        ephemeris=ephemeris,
        tolerance=tolerance,
        workers=workers,
        progress=progress,
    )[0]


def distributions(
    orbit: object,
    table: QTable,
    *,
    n: int = 1000,
    seed: int = 0,
    search: Quantity = 10 * u.d,
    within: Quantity | None = None,
    ephemeris: str | Ephemeris | None = None,
    tolerance: float = 1e-12,
    workers: int | None = None,
    progress: Progressing = None,
) -> list[EncounterDistribution]:
    """Clones of an orbit through several encounters, in one integration.

    Parameters
    ----------
    orbit, n, seed, search, within, ephemeris, tolerance, workers, progress
        As in :func:`encounter_distribution`.
    table : QTable
        The encounters of the nominal orbit, from :func:`flybystab.find_encounters`.

    Returns
    -------
    list of EncounterDistribution
        One for each row. A clone that hits a planet is missing in the later encounters.
    """
    path = _path(orbit)
    reach = to_si(search, u.s, "search", low=0.0, open_low=True)
    if not len(table):
        return []
    clones = path.clones(n, seed, ephemeris)
    points = [o for pair in path.sigma_points(ephemeris) for o in pair]
    bodies = list(dict.fromkeys(np.asarray(table["planet"]).tolist()))
    far = [far_enough(planet(b)) or 1.0 if within is None else within.to_value(u.m) for b in bodies]
    found = find_encounters(
        [*clones, *points],
        later(table["time"].min(), -reach),
        later(table["time"].max(), reach),
        bodies,
        far * u.m,
        ephemeris=ephemeris,
        tolerance=tolerance,
        workers=workers,
        progress=_pairs(progress),
    )
    return [_distribution(path, row, clones, len(points), found, reach) for row in table]


def _pairs(progress: Progressing) -> bool | Callable[[int, int, int], None] | None:
    """`progress` for :func:`find_encounters`, which also counts the encounters."""
    return (lambda done, total, _: progress(done, total)) if callable(progress) else progress


def clone_encounters(
    clones: Sequence[Orbit],
    planet: str | Planet,
    time: Time,
    *,
    search: Quantity,
    within: Quantity,
    ephemeris: str | Ephemeris | None = None,
    tolerance: float = 1e-12,
    workers: int | None = None,
) -> tuple[Array, Array, Array]:
    """The encounters of some clones that correspond to that of the nominal orbit at `time`.

    Other arguments as for :func:`encounter_distribution`, which calls this function. The result for a clone does not
    depend on the other clones.

    Returns
    -------
    time_offset, distance, v_inf : ndarray (n,)
        s, m, m/s; nan for a clone without an encounter there.
    """
    body = _planet(planet)
    reach = to_si(search, u.s, "search", low=0.0, open_low=True)
    start, stop = later(time, -reach), later(time, reach)
    found = find_encounters(
        list(clones),
        start,
        stop,
        [body.name],
        within,
        ephemeris=ephemeris,
        tolerance=tolerance,
        workers=workers,
    )
    columns = _belonging(found, body, time, len(clones), reach)
    return columns[:, 0], columns[:, 1], columns[:, 4]


def _distribution(
    orbit: Orbit, nominal: Row, clones: tuple[Orbit, ...], points: int, found: QTable, reach: float
) -> EncounterDistribution:
    """The encounters that correspond to one of the nominal orbit; `found` has the clones, then the sigma points."""
    covariance = orbit.covariance
    assert covariance is not None
    body = planet(str(nominal["planet"]))
    columns = _belonging(found, body, nominal["time"], len(clones) + points, reach)
    first = columns[: len(clones)]
    return EncounterDistribution(
        planet=body,
        time=nominal["time"],
        nominal=nominal,
        clones=clones,
        found=np.isfinite(first[:, 0]),
        time_offset=first[:, 0] * u.s,
        distance=(first[:, 1] * u.m).to(u.km),
        v_inf=(first[:, 4] * u.m / u.s).to(u.km / u.s),
        b=(first[:, 2:4] * u.m).to(u.km),
        position=(first[:, 6:9] * u.m).to(u.km),
        velocity=(first[:, 9:12] * u.m / u.s).to(u.km / u.s),
        impact=first[:, 5] > 0.0,
        linear=linear_plane(columns[len(clones) :], nominal, body),
        source=covariance.source,
        correlated=covariance.correlated,
    )


def _belonging(found: QTable, body: Planet, time: Time, n: int, reach: float) -> Array:
    """Encounters of `n` orbits that correspond to the one at `time`, SI; nan without one.

    Columns: time offset, distance, b_t, b_r, v_inf, impact, position and velocity.
    """
    columns = np.full((n, 12), np.nan)
    if len(found):
        offset = (found["time"] - time).to_value(u.s)
        here = np.flatnonzero((found["planet"] == body.name) & (np.abs(offset) <= reach))
        # Later assignments prevail: an impact before any other minimum, then the minimum nearest in time.
        order = here[np.lexsort((np.abs(offset[here]), ~found["impact"][here]))[::-1]]
        every = [offset, *(found[c].to_value(u.m) for c in ("distance", "b_t", "b_r"))]
        every += [found["v_inf"].to_value(u.m / u.s), found["impact"]]
        every += [*found["position"].to_value(u.m).T, *found["velocity"].to_value(u.m / u.s).T]
        columns[found["index"][order]] = np.column_stack(every)[order]
    return columns


def _path(orbit: object) -> Orbit:
    path = getattr(orbit, "orbit", orbit)
    if not isinstance(path, Orbit):
        raise InvalidInput("orbit", orbit, "an Orbit, or an object with one as its attribute 'orbit'")
    if path.covariance is None:
        raise InvalidInput("covariance", None, "an orbit with one: clones are drawn from it")
    return path


def _planet(name: str | Planet) -> Planet:
    return planet(name)
