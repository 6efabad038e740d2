"""Virtual impactors: search for possible impacts along the line of variations.

Orbits at equal distances along the direction of largest uncertainty (Milani et al. 2005) are integrated over a span.
Encounters of consecutive orbits at nearly the same time are grouped, and each minimum of the distance along the line is
refined. Around it the target-plane coordinates b are linear in the standard normal variables z of the
covariance, ``b = b0 + M (z - z0)``, so that b is normal with mean ``b0 - M z0`` and covariance ``M M^T``. The impact
probability is that of the disc of impact parameters that lead to an impact. Probabilities far below the reciprocal of
the number of orbits can be found.
"""

from __future__ import annotations

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity

from flybystab.arguments import check_arguments
from flybystab.encounter.line_of_variations import TOGETHER, LineOfVariations
from flybystab.encounter.linear_target_plane import disc_probability
from flybystab.errors import InvalidInput
from flybystab.orbit.ephemeris import Ephemeris
from flybystab.orbit.epochs import later, seconds
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.planets import Planet, planet
from flybystab.orbit.target_plane import capture_radius
from flybystab.progress import Progressing, progress_bar
from flybystab.result_table import ResultTable
from flybystab.typing import Array, Document
from flybystab.units import checked_time, to_si, whole

#: Number of orbits of a refinement, and largest number of refinements.
_GRID, _ROUNDS = 9, 14
#: Displacement on the target plane of the differences for M, over the radius of the disc.
_STEP = 0.2


@check_arguments
def virtual_impactors(
    orbit: object,
    start: Time | str,
    stop: Time | str,
    planet: str | Planet = "earth",
    *,
    n: int = 1001,
    sigmas: float = 5.0,
    within: Quantity = 0.1 * u.au,
    least: float = 1e-12,
    ephemeris: str | Ephemeris | None = None,
    workers: int | None = None,
    progress: Progressing = None,
) -> ResultTable:
    """Possible impacts of an uncertain orbit, by a search along its line of variations.

    Parameters
    ----------
    orbit : Orbit
        Or an object with an attribute ``orbit``; with a covariance.
    start, stop : Time or str
        Span of the search; text is read as TDB.
    planet : str or Planet
    n : int
        Number of orbits on the line.
    sigmas : float
        Half length of the line, in standard deviations.
    within : Quantity
        Largest distance of an encounter that is considered.
    least : float
        Smallest impact probability that is listed.
    ephemeris, workers
        As of :func:`flybystab.find_encounters`.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    ResultTable
        A row for each possible impact, in order of time: ``time`` (TDB) and ``distance`` (km; two-body, without a
        surface) of the closest orbit on the line, ``sigma`` (its position on the line), ``stretching`` (km of the
        target plane for one sigma along the line), ``width`` (km, standard deviation across it), ``probability``,
        ``v_inf`` (km/s).
        Impacts on a part of the line shorter than the spacing of the orbits can be missed.

    Raises
    ------
    InvalidInput
        No covariance, or the line leaves the conics.
    OutOfSpan, UnitMismatch, UnknownName
    """
    path = getattr(orbit, "orbit", orbit)
    if not isinstance(path, Orbit):
        raise InvalidInput("orbit", orbit, "an Orbit, or an object with one as its attribute 'orbit'")
    start, stop = checked_time(start, "start"), checked_time(stop, "stop")
    body, count = _body(planet), whole(n, "n", 3)
    reach = to_si(within, u.m, "within", low=0.0, open_low=True)
    if not 0.0 < float(sigmas) <= 10.0:
        raise InvalidInput(
            "sigmas",
            sigmas,
            "the half length of the line of variations: above 0, at most 10 standard deviations",
        )
    line = LineOfVariations(path, body, start, stop, float(sigmas), ephemeris, workers)
    way = line.way
    grid = np.linspace(-float(sigmas), float(sigmas), count)
    table = line.encounters(grid[:, None] * way, start, stop, reach)
    rows, minima = [], _minima(table, count)
    with progress_bar(progress, len(minima), "candidates", "virtual impactors") as tick:
        for i, (k, time) in enumerate(minima):
            found = _impact(line, way, float(grid[k]), float(grid[1] - grid[0]), time, reach)
            if found is not None:
                rows.append(found)
            tick(i + 1)
    rows = sorted(
        (r for r in _distinct(rows) if r["probability"] >= least), key=lambda r: float(r["time"].tdb.jd)
    )
    out = ResultTable()
    out["time"] = Time([r["time"].tdb.jd for r in rows], format="jd", scale="tdb")
    for name, unit in (("distance", u.km), ("sigma", None), ("stretching", u.km), ("width", u.km)):
        values = np.array([r[name] for r in rows], dtype=float)
        out[name] = values if unit is None else (values * u.m).to(unit)
    out["probability"] = np.array([r["probability"] for r in rows], dtype=float)
    out["v_inf"] = (np.array([r["v_inf"] for r in rows], dtype=float) * u.m / u.s).to(u.km / u.s)
    out.meta = {
        "planet": body.name,
        "orbits": count,
        "sigmas": float(sigmas),
        "source": line.covariance.source,
    }
    return out


def _minima(table: ResultTable, count: int) -> list[tuple[int, Time]]:
    """Orbits (number, time) at a local minimum of distance among the encounters of a group.

    Minima from which the distance rises so slowly that it cannot reach zero between two orbits are left out.
    """
    if not len(table):
        return []
    zero = table["time"][0]
    t = (table["time"] - zero).to_value(u.s)
    d, index = table["distance"].to_value(u.m), np.asarray(table["index"])
    rows_of = [np.flatnonzero(index == k) for k in range(count)]
    found = []
    for row in range(len(table)):
        beside = []
        for k in (index[row] - 1, index[row] + 1):
            rows = rows_of[k] if 0 <= k < count else np.zeros(0, dtype=int)
            near = rows[np.abs(t[rows] - t[row]) < TOGETHER]
            if near.size:
                beside.append(float(d[near[np.argmin(np.abs(t[near] - t[row]))]]))
        if beside and (d[row] > min(beside) or d[row] > 1e9 + 2.0 * max(abs(x - d[row]) for x in beside)):
            continue
        found.append((int(index[row]), later(zero, float(t[row]))))
    return found


def _impact(
    line: LineOfVariations, way: Array, sigma: float, spacing: float, time: Time, reach: float
) -> Document | None:
    """The possible impact around a minimum of distance along the line; None if an orbit has no encounter there."""
    half = spacing
    best = np.full(5, np.nan)
    for _ in range(_ROUNDS):
        some = sigma + half * np.linspace(-1.0, 1.0, _GRID)
        found = line.near(some[:, None] * way, time, reach)
        if not np.isfinite(found[:, 1]).any():
            return None
        k = int(np.nanargmin(found[:, 1]))
        sigma, best = float(some[k]), found[k]
        beside = found[max(k - 1, 0) : k + 2, 1]
        if np.isfinite(beside).all() and np.ptp(beside) < 1e-3 * line.body.radius:
            break
        half *= 2.0 / (_GRID - 1)
    if not np.isfinite(best).all():
        return None
    disc = float(capture_radius(line.body.gm, line.body.impact_distance, best[4]))
    z0 = sigma * way
    size = len(z0)
    h = np.full(size, 1e-5)
    for _ in range(2):  # steps that displace the encounter by a part of the disc
        steps = np.diag(h)
        found = line.near(np.concatenate([z0 + steps, z0 - steps]), time, reach)[:, 2:4]
        if not np.isfinite(found).all():
            return None
        matrix = ((found[:size] - found[size:]) / (2.0 * h[:, None])).T
        h = np.clip(_STEP * disc / np.maximum(np.linalg.norm(matrix, axis=0), 1e-30), 1e-9, 0.3)
    along = matrix @ way
    covariance = matrix @ matrix.T
    stretch = float(np.linalg.norm(along))
    return {
        "time": later(time, float(best[0])),
        "distance": float(best[1]),
        "sigma": sigma,
        "stretching": stretch,
        "width": _width(matrix, along),
        "v_inf": float(best[4]),
        "probability": disc_probability(best[2:4] - matrix @ z0, covariance, disc),
    }


def _width(matrix: Array, along: Array) -> float:
    """1-sigma of the target plane normal to the direction of the line, from the linear map (2, n).

    A norm, since rounding can make the quadratic form of the covariance of a narrow ellipse negative.
    """
    across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
    return float(np.linalg.norm(across @ matrix))


def _distinct(rows: list[Document]) -> list[Document]:
    """The rows without repetitions: minima that were refined to the same orbit."""
    out: list[Document] = []
    for r in rows:
        same = (
            abs(seconds(r["time"], o["time"])) < 600.0 and abs(r["sigma"] - o["sigma"]) < 1e-3 for o in out
        )
        if not any(same):
            out.append(r)
    return out


def _body(name: str | Planet) -> Planet:
    return planet(name)
