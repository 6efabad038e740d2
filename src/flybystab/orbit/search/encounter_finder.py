"""Search for the encounters of many asteroids.

Asteroids are massless and integrated independently (:mod:`flybystab.orbit.search.track`), in several threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from numbers import Real
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.errors import Impact, InvalidInput, NotConverged
from flybystab.orbit.ephemeris import BODIES, SUN, Ephemeris
from flybystab.orbit.epochs import later
from flybystab.orbit.nongravitational import parameters_of
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.orbit_arguments import as_ephemeris
from flybystab.orbit.planets import PLANETS, Planet, planet
from flybystab.orbit.predictability import deviations_of
from flybystab.orbit.search.encounter_table import EDGE, encounter_table, forces_used, in_span
from flybystab.orbit.search.entry import entry
from flybystab.orbit.search.force_selection import N_SHARES
from flybystab.orbit.search.minima import FOUND
from flybystab.orbit.search.neighbours import add_growth
from flybystab.orbit.search.search_setup import (
    SearchForces,
    SearchSpan,
    groups_by_window,
    initial_states,
    reach_of,
    search_forces,
    search_span,
    search_tolerance,
)
from flybystab.orbit.search.track import EXHAUSTED, INSIDE, MAX_STEPS, STALLED, Reach, search
from flybystab.progress import check_progress, progress_bar
from flybystab.result_table import ResultTable
from flybystab.typing import Array
from flybystab.units import checked_time, to_si

#: Default of the allowed displacement.
ERROR = 0.1 * u.km


@check_arguments
def find_encounters(
    objects: Any,
    start: Time | str,
    stop: Time | str,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    *,
    ephemeris: str | Ephemeris | None = None,
    error: Quantity = ERROR,
    tolerance: float | None = None,
    forces: tuple[str, ...] | None = None,
    growth: bool = False,
    workers: int | None = None,
    progress: bool | Callable[[int, int, int], None] | None = None,
    threads: int | None = None,
) -> ResultTable:
    """All closest approaches of asteroids to planets within a distance.

    Parameters
    ----------
    objects : Orbit, object with ``orbit`` and ``name``, or an iterable of either
        The asteroids; they do not attract each other.
    start, stop : Time or str
        Span of the search; text is read as TDB. An encounter within 1 s of an end counts at `start` and not at `stop`,
        so that each encounter is in exactly one of two adjacent spans.
    planets : sequence of str
        Planets and ``"moon"``. Impacts on the Sun are always included (``planet`` is ``"sun"``).
    within : Quantity
        Largest distance between the centres; one value or one per planet.
    ephemeris : str or Ephemeris, optional
        ``"de421"``, ``"de440"``; the best installed by default.
    error : Quantity
        Allowed displacement: point masses and 1PN are left out where their estimated displacement of the asteroid
        by the end of the span is below a tenth of this. J2 of Sun, Earth and `planets`, and the non-gravitational
        acceleration are always included.
    tolerance : float, optional
        Estimated error per step of the integration, in units of 1.5e11 m and 30 km/s; values below 1e-14, where
        rounding errors limit the accuracy, count as 1e-14. By default ``1e-12 error/km``, from 1e-14 to 1e-8: the
        error of nine of ten asteroids is then below `error` for a century.
    forces : tuple of str, optional
        Exactly these forces, names as in ``flybystab.orbit.forces.FORCES``, instead of choosing by `error`.
    growth : bool
        Add the columns ``displacement`` (km, one sigma of the orbit in the direction least known at closest
        approach), ``growth`` (over that at the epoch), ``model_error`` (km, by ephemeris, tolerance and forces left
        out) and ``predictability`` (:mod:`flybystab.orbit.predictability`). All forces are kept, so that the result
        does not depend on the span; about ten times the time.
    workers : int, optional
        Number of threads; one per processor by default.
    progress : bool or callable, optional
        Whether to show a bar (:mod:`flybystab.progress`), or a function that is called with the asteroids searched,
        all of them, and the encounters found so far.
    threads : int, optional
        Deprecated name of `workers`.

    Returns
    -------
    ResultTable
        One row per encounter, sorted by asteroid and time: ``asteroid``, ``planet``, ``time`` (TDB),
        ``distance`` (km), ``v_rel`` and ``v_inf`` (km/s; 0 for a bound encounter), ``b_t`` and ``b_r`` (km;
        target plane, north +z of ICRF, :mod:`flybystab.orbit.target_plane`; nan for a bound encounter), ``impact``,
        ``index`` (of the asteroid), ``position`` and ``velocity`` (ICRF, relative to the planet). On an impact, time
        and distance are those of the periapsis of the two-body orbit without a surface, position and velocity those at
        the entry into the atmosphere (the surface of a body without one), and the search ends for that asteroid. If
        there is an impact: ``entry_time`` (TDB, text; empty in other rows), ``entry_longitude`` (east) and
        ``entry_latitude`` (geodetic, deg; nan elsewhere than on the Earth). Metadata: ephemeris, forces and
        the largest estimated displacement by each (``share_km``, point masses and 1PN), those of the forces left out
        (``left_out_km``), frame, time scale, tolerance, and, for several asteroids, those that could not be
        integrated (``failed``: ``asteroid`` and ``why``).

    Raises
    ------
    OutOfSpan
        Where an epoch or the span lies outside the ephemeris.
    Impact
        A single asteroid hits a body between its epoch and `start`; of several it is listed in ``failed``.
    UnitMismatch, InvalidInput, UnknownName, NotConverged
    """
    rows = _objects(objects)
    workers = worker_count(workers, threads)
    start, stop = checked_time(start, "start"), checked_time(stop, "stop")
    _check_options(start, stop, forces, tolerance)
    check_progress(progress)
    found, distances = _planets_within(planets, within)
    accuracy = to_si(error, u.m, "error", low=0.0)
    eph = as_ephemeris(ephemeris)
    allowed = search_tolerance(accuracy, tolerance, growth)
    job = _prepared(
        rows, start, stop, found, distances, eph, accuracy, allowed, forces, growth, len(rows) == 1
    )
    raw = _without_early_impacts(job, _integrated(job, workers, progress))
    # An impact on the Sun ends an orbit and always has a row.
    requested = np.isin(raw["body"], [SUN, *(BODIES.index(b.name) for b in found)])
    meta = _metadata(job, raw[~requested])
    raw = raw[requested]
    contacts = _contacts(job, raw)
    out = encounter_table(rows, raw, contacts, job.span.middle, job.span.window, meta)
    if growth:
        beside = {i: deviations_of(rows[i][1], eph) for i in np.unique(out["index"]).tolist()}
        add_growth(
            out,
            contacts[:, 0],
            beside,
            job.forces.laws,
            job.span.window,
            lambda i: job.forces.of(i, job.shares[i]),
            allowed,
            workers,
        )
    return out


class _Search(NamedTuple):
    """A search: orbits (n), span, forces, distances, tolerance, and the output of the integration.

    Attributes
    ----------
    shares : ndarray, shape (n, N_SHARES)
        Estimated displacement by each force, m; written by the search.
    failed : dict of int to Exception
        Asteroids that could not be integrated, with the reason; written by the search.
    alone : bool
        The error of an asteroid is raised.
    """

    rows: list[tuple[str, Orbit]]
    span: SearchSpan
    forces: SearchForces
    epochs: Array
    states: Array
    reach: Reach
    tolerance: float
    shares: Array
    failed: dict[int, Exception]
    alone: bool

    def fail(self, i: int, error: Exception) -> None:
        """Record that asteroid `i` could not be integrated; raises the error if it is the only one."""
        if self.alone:
            raise error
        self.failed[i] = error


def _prepared(
    rows: list[tuple[str, Orbit]],
    start: Time,
    stop: Time,
    found: list[Planet],
    distances: Array,
    eph: Ephemeris,
    accuracy: float,
    tolerance: float,
    forces: tuple[str, ...] | None,
    growth: bool,
    alone: bool,
) -> _Search:
    """The search, before the integration; `alone` as of :class:`_Search`."""
    span, epochs = search_span(rows, start, stop, eph, growth)
    states = initial_states(rows, span.window, epochs)
    # A tenth: the displacements add up, and encounters amplify them.
    least = 0.1 * accuracy if forces is None and not growth else 0.0
    acting = search_forces(rows, found, forces, least, span.window, epochs, states)
    shares = np.zeros((len(rows), N_SHARES))
    reach = reach_of(found, distances)
    return _Search(rows, span, acting, epochs, states, reach, tolerance, shares, {}, alone)


class Approach(NamedTuple):
    """A closest approach: planet, time (TDB), distance (m) and hyperbolic excess speed (m/s; 0 for a bound one)."""

    planet: str
    time: Time
    distance: float
    v_inf: float


def approaches(
    orbit: Orbit, start: Time, stop: Time, planets: Sequence[str], within: float
) -> list[Approach]:
    """Closest approaches of one orbit to planets within a distance (m), in order of time, without a table.

    Those of :func:`find_encounters` with its defaults, in the calling thread, without impacts on the Sun.

    Raises
    ------
    OutOfSpan, Impact, NotConverged
    """
    (found,) = _approaches_each([orbit], start, stop, planets, within, alone=True)
    return [] if isinstance(found, Exception) else found


def approaches_each(
    orbits: Sequence[Orbit], start: Time, stop: Time, planets: Sequence[str], within: float
) -> list[list[Approach] | Exception]:
    """Results of :func:`approaches` for many orbits, to the last bit: each a list, or the error of the integration.

    Raises
    ------
    OutOfSpan
        For any of the orbits.
    """
    return _approaches_each(orbits, start, stop, planets, within, alone=False)


def _approaches_each(
    orbits: Sequence[Orbit], start: Time, stop: Time, planets: Sequence[str], within: float, *, alone: bool
) -> list[list[Approach] | Exception]:
    """As :func:`approaches_each`; an error of an integration is raised if `alone`."""
    rows = [(orbit.name or "0", orbit) for orbit in orbits]
    found, eph = [planet(n) for n in planets], as_ephemeris(None)
    accuracy = ERROR.to_value(u.m)
    given = found, np.full(len(found), within), eph, accuracy, search_tolerance(accuracy, None, False)
    wanted = [BODIES.index(b.name) for b in found]
    groups = groups_by_window(rows, start, stop, eph)
    jobs = [_prepared([rows[i] for i in group], start, stop, *given, None, False, alone) for group in groups]
    out: list[list[Approach] | Exception] = [[] for _ in rows]
    for group, job in zip(groups, jobs, strict=True):
        raw = _without_early_impacts(job, _integrated(job, 1, False))
        for r in raw[np.isin(raw["body"], wanted)]:
            here = out[group[int(r["asteroid"])]]
            if isinstance(here, list):
                here.append(
                    Approach(
                        BODIES[r["body"]],
                        later(job.span.middle, r["time"]),
                        float(r["distance"]),
                        float(np.sqrt(max(r["v_inf2"], 0.0))),
                    )
                )
        for i, error in job.failed.items():
            out[group[i]] = error
    return out


def _check_options(start: Time, stop: Time, forces: tuple[str, ...] | None, tolerance: float | None) -> None:
    """Check span, forces and tolerance.

    Raises
    ------
    InvalidInput
    """
    if forces is not None and (isinstance(forces, str) or not isinstance(forces, Iterable)):
        raise InvalidInput("forces", forces, "a sequence of names")
    if not start < stop:
        raise InvalidInput("stop", stop.iso, f"a time after start, {start.iso}")
    if tolerance is not None and not (isinstance(tolerance, Real) and 1e-16 <= tolerance <= 1e-4):
        raise InvalidInput("tolerance", tolerance, "a number in [1e-16, 1e-4]")


def _planets_within(planets: Sequence[str], within: Quantity) -> tuple[list[Planet], Array]:
    """The planets and the largest distance from each, m, checked.

    Raises
    ------
    InvalidInput, UnknownName, UnitMismatch
    """
    if not isinstance(planets, Iterable):
        raise InvalidInput("planets", planets, "a name or a sequence of names")
    names = [planets] if isinstance(planets, str) else list(planets)
    if not names:
        raise InvalidInput("planets", planets, "at least one")
    found = [planet(n) for n in names]
    reach = to_si(within, u.m, "within", shape=None, low=0.0, open_low=True)
    if reach.shape not in ((), (1,), (len(found),)):
        raise InvalidInput("within", within, "one distance, or one per planet")
    return found, np.broadcast_to(reach, (len(found),)).astype(float)


def _integrated(
    job: _Search, workers: int, progress: bool | Callable[[int, int, int], None] | None
) -> NDArray[Any]:
    """Rows of all encounters, sorted by asteroid and time."""
    total, own = len(job.rows), job.forces.own
    # Parts are small enough to balance the load of the threads and for Ctrl-C, which waits for the end of one, and
    # large enough for a small overhead of Python.
    size = max(1, min(64, -(-total // (4 * workers)))) if workers > 1 else 32
    cuts = sorted({*range(0, total, size), *own, *(i + 1 for i in own), total})
    tasks = [slice(i, j) for i, j in pairwise(cuts)]
    flat: list[NDArray[Any]] = []
    with progress_bar(not callable(progress) and progress, total, "orbits", "encounters") as tick:
        for task, parts in zip(tasks, in_order(lambda part: _part(job, part), tasks, workers), strict=True):
            flat += parts
            tick(task.stop)
            if callable(progress):
                progress(task.stop, total, sum(map(len, flat)))
    raw = np.concatenate(flat) if flat else np.empty(0, FOUND)
    return raw[np.lexsort((raw["time"], raw["asteroid"]))]


def _part(job: _Search, part: slice) -> list[NDArray[Any]]:
    """Rows of the encounters of a slice of the asteroids, which have the same field of forces."""
    forces, span = job.forces, job.span
    tables = (
        forces.own.get(part.start, forces.everything),
        forces.laws[part],
        job.epochs[part],
        job.states[part],
    )
    size = len(job.epochs[part])
    i, space, parts = 0, 64 * size + 256, []
    while i < size:
        out = np.empty(space, FOUND)
        i, n, status, reached = search(
            *tables,
            span.begin,
            span.end,
            job.reach,
            job.tolerance,
            forces.least,
            forces.always,
            job.shares[part],
            i,
            out,
        )
        if status in (INSIDE, STALLED, EXHAUSTED):
            name, orbit = job.rows[part][i]
            if status == INSIDE:
                job.fail(part.start + i, starts_inside(name, orbit.epoch, PLANETS[BODIES[int(reached)]]))
            else:
                what = "the step size collapsed" if status == STALLED else f"{MAX_STEPS:,} steps taken"
                when = later(span.middle, reached).iso
                job.fail(part.start + i, NotConverged(f"{name}: {what} at {when} TDB"))
            i += 1
        elif n == 0:
            space *= 4
        out["asteroid"][:n] += part.start
        parts.append(out[:n].copy())
    return parts


def _without_early_impacts(job: _Search, raw: NDArray[Any]) -> NDArray[Any]:
    """Rows within the span; an asteroid with an impact between its epoch and the span counts as failed."""
    t_start, t_stop = job.span.start, job.span.stop
    since = np.array([job.epochs[int(i)] for i in raw["asteroid"]])
    early = (raw["time"] < t_start - EDGE) & (since < t_start)
    late = (raw["time"] >= t_stop - EDGE) & (since > t_stop)
    for r in raw[(raw["impact"] != 0) & (early | late)]:
        i = int(r["asteroid"])
        job.fail(
            i,
            Impact(
                f"{job.rows[i][0]} meets {BODIES[r['body']]} at {later(job.span.middle, float(r['time'])).iso} TDB, "
                f"between its epoch and the span of the search"
            ),
        )
    return raw[in_span(raw, t_start, t_stop)]


def _metadata(job: _Search, elsewhere: NDArray[Any]) -> dict[str, Any]:
    """Metadata of the table; `elsewhere` are the impacts on bodies that were not requested."""
    kept, share, left_out = forces_used(job.forces.names, job.shares, job.forces.least)
    return {
        "ephemeris": job.span.window.name,
        "forces": list(kept),
        "share_km": share,
        "left_out_km": left_out,
        "impacts_elsewhere": [
            {
                "asteroid": job.rows[r["asteroid"]][0],
                "planet": BODIES[r["body"]],
                "time_jd_tdb": later(job.span.middle, r["time"]).jd,
            }
            for r in elsewhere
        ],
        "failed": [{"asteroid": job.rows[i][0], "why": str(job.failed[i])} for i in sorted(job.failed)],
        "frame": "ICRF",
        "time_scale": "TDB",
        "tolerance": job.tolerance,
    }


def _contacts(job: _Search, raw: NDArray[Any]) -> Array:
    """Time (s) and relative state of each row: closest approach, or entry of an impact."""
    contacts = np.column_stack([raw["time"], raw["state"]])
    for k in np.flatnonzero(raw["impact"] != 0):
        i, body = int(raw["asteroid"][k]), int(raw["body"][k])
        sign = 1.0 if raw["time"][k] >= job.epochs[i] else -1.0
        contacts[k, 0], contacts[k, 1:] = entry(
            job.forces.of(i, job.shares[i]),
            parameters_of(job.forces.laws[i]),
            job.span.window,
            body,
            raw[k],
            float(job.reach.floors[body]),
            sign,
        )
    return contacts


def starts_inside(name: str, epoch: Time, body: Planet) -> InvalidInput:
    """The error of an orbit whose state at the epoch is below the surface or atmosphere of a body."""
    what = f"{name or 'the orbit'} at {epoch.tdb.iso} TDB inside {body.name}"
    return InvalidInput(
        "orbit", what, f"a start more than {body.impact_distance / 1e3:.0f} km from its centre"
    )


def _objects(objects: Any) -> list[tuple[str, Orbit]]:
    """Names and orbits of one object or of many."""
    if isinstance(objects, str):
        raise InvalidInput("objects", objects, f"an orbit, as in fs.Asteroid.from_catalogue({objects!r})")
    single = isinstance(objects, Orbit) or hasattr(objects, "orbit")
    many = [objects] if single else objects
    try:
        many = list(many)
    except TypeError:
        raise InvalidInput("objects", objects, "an Orbit, an asteroid, or a list of them") from None
    out = []
    for i, item in enumerate(many):
        orbit = item if isinstance(item, Orbit) else getattr(item, "orbit", None)
        if not isinstance(orbit, Orbit):
            raise InvalidInput(
                f"objects[{i}]", item, "an Orbit, or an object with one as its attribute 'orbit'"
            )
        out.append((str(getattr(item, "name", "") or orbit.name or i), orbit))
    return out
