"""Search for the encounters of many asteroids.

Asteroids are massless and integrated independently (:mod:`flybystab.orbit.search.track`), in several threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from numbers import Real
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.constants import DAY, YEAR
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.errors import Impact, InvalidInput, NotConverged
from flybystab.orbit.almanac import GRID, N_FAST, N_SLOW, SLOT
from flybystab.orbit.barycentre import barycentre_in
from flybystab.orbit.ephemeris import BELT, BODIES, N_BODIES, SUN, Ephemeris, Window
from flybystab.orbit.forces import FORCES, LAW_SIZE
from flybystab.orbit.observatories import geographic
from flybystab.orbit.orbit import (
    TWIN_DISTANCE,
    TWIN_SPEED,
    Orbit,
    _ephemeris,
    default_forces,
    later,
    seconds,
)
from flybystab.orbit.planets import PLANETS, Planet, planet
from flybystab.orbit.predictability import deviation_epoch, deviations_of
from flybystab.orbit.search.acceleration import Field, field
from flybystab.orbit.search.entry import entry
from flybystab.orbit.search.force_selection import N_SHARES, NAMES, reduced
from flybystab.orbit.search.minima import WIDTH
from flybystab.orbit.search.neighbours import add_growth
from flybystab.orbit.search.track import EXHAUSTED, INSIDE, MAX_STEPS, STALLED, search
from flybystab.orbit.target_plane import target_plane
from flybystab.progress import check_progress, progress_bar
from flybystab.typing import Array
from flybystab.units import checked_time, to_si

_SPEED = u.m / u.s

#: A passage this close to an end of the span counts at `start` and not at `stop`, s. It exceeds the error of the time,
#: so that exactly one of two adjacent spans contains the passage.
_EDGE = 1.0
#: Margin of the integration beyond the span, so that a minimum at its end is bracketed, s.
_MARGIN = 60.0
#: Tolerance over the error (m) of the median asteroid after ten years; the error grows with the square of time
#: (``flybystab bench sky``).
_AT_10_YEARS, _TOLERANCES = 1e-12 / 100.0, (1e-15, 1e-8)


@lru_cache(maxsize=4)
def _window(eph: Ephemeris, day: float, fraction: float, start: float, stop: float) -> Window:
    """The ephemeris around a search; kept, with its almanac, for the next asteroid of the same epoch."""
    return eph.window(Time(day, fraction, format="jd", scale="tdb"), start, stop)


def find_encounters(
    objects: Any,
    start: Time | str,
    stop: Time | str,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    *,
    ephemeris: str | Ephemeris | None = None,
    error: Quantity = 0.1 * u.km,
    tolerance: float | None = None,
    forces: tuple[str, ...] | None = None,
    growth: bool = False,
    workers: int | None = None,
    progress: bool | Callable[[int, int, int], None] | None = None,
    threads: int | None = None,
) -> QTable:
    """All closest approaches of asteroids to planets within a distance.

    Parameters
    ----------
    objects : Orbit, object with ``orbit`` and ``name``, or an iterable of either
        The asteroids; they do not disturb each other.
    start, stop : Time or str
        Span of the search; text is read as TDB. A passage within 1 s of an end counts at `start` and not at `stop`, so
        that spans side by side have each passage once.
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
        Error per step of the integration, in units of 1.5e11 m and 30 km/s. By default
        ``1e-12 (error/0.1 km) (10 yr/span)^2``, from 1e-15 to 1e-8: the error of the median asteroid is then below
        `error` at the end of the span.
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
    QTable
        One row per encounter, sorted by asteroid and time: ``asteroid``, ``planet``, ``time`` (TDB),
        ``distance`` (km), ``v_rel`` and ``v_inf`` (km/s; 0 for a bound passage), ``b_t`` and ``b_r`` (km;
        target plane, north +z of ICRF, :mod:`flybystab.orbit.target_plane`; nan for a bound passage), ``impact``,
        ``index`` (of the asteroid), ``position`` and ``velocity`` (ICRF, relative to the planet). On an impact, time
        and distance are those of the periapsis of the two-body orbit without a surface, position and velocity those at
        the entry into the atmosphere (the surface of a body without one), and the search ends for that asteroid. If
        there is an impact: ``entry_time`` (TDB, text; empty in other rows), ``entry_longitude`` (east) and
        ``entry_latitude`` (geodetic, deg; nan elsewhere than on the Earth). Metadata: ephemeris, forces and
        the largest estimated share of each (``share_km``, point masses and 1PN), shares of the forces left out
        (``left_out_km``), frame, time scale, tolerance, and, of several asteroids, those that could not be
        followed (``failed``: ``asteroid`` and ``why``).

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
    if forces is not None and (isinstance(forces, str) or not isinstance(forces, Iterable)):
        raise InvalidInput("forces", forces, "a sequence of names")
    start, stop = checked_time(start, "start"), checked_time(stop, "stop")
    if not start < stop:
        raise InvalidInput("stop", stop.iso, f"a time after start, {start.iso}")
    if not isinstance(planets, Iterable):
        raise InvalidInput("planets", planets, "a name or a sequence of names")
    names = [planets] if isinstance(planets, str) else list(planets)
    if not names:
        raise InvalidInput("planets", planets, "at least one")
    found = [planet(n) for n in names]
    reach = to_si(within, u.m, "within", shape=None, low=0.0, open_low=True)
    if reach.shape not in ((), (1,), (len(found),)):
        raise InvalidInput("within", within, "one distance, or one per planet")
    reach = np.broadcast_to(reach, (len(found),)).astype(float)
    if tolerance is not None and not (isinstance(tolerance, Real) and 1e-16 <= tolerance <= 1e-4):
        raise InvalidInput("tolerance", tolerance, "a number in [1e-16, 1e-4]")
    accuracy = to_si(error, u.m, "error", low=0.0)
    eph = _ephemeris(ephemeris)
    middle = later(start, 0.5 * seconds(stop, start))
    t_start, t_stop = seconds(start, middle), seconds(stop, middle)
    epochs = _epochs(rows, middle)
    known = [seconds(deviation_epoch(orbit), middle) for _, orbit in rows] if growth else []
    first, last = ((jd - middle.tdb.jd1 - middle.tdb.jd2) * DAY for jd in (eph.start_jd, eph.stop_jd))
    begin, end = t_start - _MARGIN, t_stop + _MARGIN
    if first <= t_start and t_stop <= last:
        begin, end = max(begin, first + 1e-3), min(end, last - 1e-3)
    every = [begin, end, *epochs, *known]
    window = _window(eph, middle.tdb.jd1, middle.tdb.jd2, min(every), max(every))
    chosen = forces
    if chosen is None:
        kinds = {orbit.nongrav.active: orbit for _, orbit in rows}
        used = {name for orbit in kinds.values() for name in default_forces(orbit, *(b.name for b in found))}
        chosen = tuple(name for name in FORCES if name in used)
    longest = np.maximum(np.abs(epochs - t_start), np.abs(epochs - t_stop))
    if tolerance is None:
        tolerances = np.clip(_AT_10_YEARS * accuracy * (10.0 * YEAR / longest) ** 2, *_TOLERANCES)
        if growth:  # passages amplify errors: those of the tolerance, too
            tolerances = np.minimum(tolerances, 1e-14)
    else:
        tolerances = np.full(len(rows), float(tolerance))
    everything = field(window, [n for n in chosen if n != "non-gravitational"])
    limits = np.zeros(len(BODIES))
    limits[[BODIES.index(b.name) for b in found]] = reach
    limits[SUN] = 0.0  # a perihelion is no encounter
    floors = np.array([PLANETS[name].impact_distance for name in BODIES])
    always = np.zeros(N_FAST + N_SLOW, dtype=bool)
    for name in ("sun", *(b.name for b in found)):
        b = BODIES.index(name)
        always[SLOT[b] + N_FAST * GRID[b]] = True
    laws = np.zeros((len(rows), LAW_SIZE))
    if "non-gravitational" in chosen:
        for i, (_, orbit) in enumerate(rows):
            if orbit.nongrav.active:
                laws[i] = orbit.nongrav.row
    states = _states(rows, window, epochs)
    # A massive asteroid does not attract itself.
    twins = {} if forces is not None else _twins(window, epochs, states)
    own = {
        i: field(window, [n for n in chosen if n not in ("non-gravitational", f"{name} point mass")])
        for i, name in twins.items()
    }
    shares = np.zeros((len(rows), N_SHARES))
    # A tenth: several shares add up, and passages on the way enlarge them.
    least = 0.1 * accuracy if forces is None and not growth else 0.0

    failed: dict[int, dict[str, str]] = {}

    def run(part: slice) -> list[Array]:
        tables = own.get(part.start, everything), laws[part], epochs[part], states[part]
        steps = tolerances[part]
        size = len(tables[2])
        i, space, parts = 0, 64 * size + 256, []
        while i < size:
            out = np.empty((space, WIDTH))
            i, n, status, reached = search(
                *tables, begin, end, limits, floors, steps, least, always, shares[part], i, out
            )
            if status in (INSIDE, STALLED, EXHAUSTED):
                name, orbit = rows[part][i]
                why = (
                    starts_inside(name, orbit.epoch, PLANETS[BODIES[int(reached)]])
                    if status == INSIDE
                    else NotConverged(
                        f"{name}: "
                        + ("the step size collapsed" if status == STALLED else f"{MAX_STEPS:,} steps taken")
                        + f" at {later(middle, reached).iso} TDB"
                    )
                )
                if len(rows) == 1:
                    raise why
                failed[part.start + i] = {"asteroid": name, "why": str(why)}
                i += 1
            elif n == 0:
                space *= 4
            out[:n, 11] += part.start
            parts.append(out[:n].copy())
        return parts

    # Parts small enough for an even load of the threads, large enough for a small overhead of Python.
    size = max(1, min(64, -(-len(rows) // (4 * workers)))) if workers > 1 else max(len(rows), 1)
    cuts = sorted({*range(0, len(rows), size), *twins, *(i + 1 for i in twins), len(rows)})
    tasks = [slice(i, j) for i, j in pairwise(cuts)]
    flat: list[Array] = []
    check_progress(progress)
    with progress_bar(not callable(progress) and progress, len(rows), "orbits", "encounters") as tick:
        for task, parts in zip(tasks, in_order(run, tasks, workers), strict=True):
            flat += parts
            tick(task.stop)
            if callable(progress):
                progress(task.stop, len(rows), sum(map(len, flat)))
    raw = np.concatenate(flat) if flat else np.empty((0, WIDTH))
    raw = raw[np.lexsort((raw[:, 1], raw[:, 11]))]
    # An impact between the epoch of an orbit and the span ends the search of that asteroid.
    since = np.array([epochs[int(i)] for i in raw[:, 11]])
    early = (raw[:, 1] < t_start - _EDGE) & (since < t_start)
    late = (raw[:, 1] >= t_stop - _EDGE) & (since > t_stop)
    for r in raw[(raw[:, 10] > 0.0) & (early | late)]:
        i = int(r[11])
        hit = Impact(
            f"{rows[i][0]} meets {BODIES[int(r[0])]} at {later(middle, float(r[1])).iso} TDB, between its epoch "
            f"and the span of the search"
        )
        if len(rows) == 1:
            raise hit
        failed[i] = {"asteroid": rows[i][0], "why": str(hit)}
    raw = raw[_in_span(raw, t_start, t_stop)]
    # A fall into the Sun ends an orbit for good and is always a row.
    asked = np.isin(raw[:, 0], [SUN, *(BODIES.index(b.name) for b in found)])
    elsewhere = [
        {"asteroid": rows[int(r[11])][0], "planet": BODIES[int(r[0])], "time_jd_tdb": later(middle, r[1]).jd}
        for r in raw[~asked]
    ]
    raw = raw[asked]
    kept, share, left_out = _forces_used(chosen, shares, least)
    meta = {
        "ephemeris": window.name,
        "forces": list(kept),
        "share_km": share,
        "left_out_km": left_out,
        "impacts_elsewhere": elsewhere,
        "failed": [failed[i] for i in sorted(failed)],
        "frame": "ICRF",
        "time_scale": "TDB",
        "tolerance": float(tolerances.min(initial=1.0)),
    }

    def field_of(i: int) -> Field:
        return reduced(own.get(i, everything), shares[i], least, always)

    contacts = raw[:, 1:8].copy()
    for k in np.flatnonzero(raw[:, 10] > 0.0):
        i, hit_body = int(raw[k, 11]), int(raw[k, 0])
        sign = 1.0 if raw[k, 1] >= epochs[i] else -1.0
        contacts[k, 0], contacts[k, 1:] = entry(
            field_of(i), laws[i], window, hit_body, raw[k], float(floors[hit_body]), sign
        )
    out = _table(rows, raw, contacts, middle, window, meta)
    if growth:
        beside = {i: deviations_of(rows[i][1], eph) for i in np.unique(out["index"]).tolist()}
        add_growth(out, contacts[:, 0], beside, laws, window, field_of, tolerances, workers)
    return out


def _in_span(raw: Array, t_start: float, t_stop: float) -> NDArray[np.bool_]:
    """Rows of a sorted result inside the span, each passage once where the epoch of an orbit lies at it."""
    keep = (raw[:, 1] >= t_start - _EDGE) & (raw[:, 1] < t_stop - _EDGE)
    same = (np.diff(raw[:, 1]) < _EDGE) & (np.diff(raw[:, 11]) == 0.0) & (np.diff(raw[:, 0]) == 0.0)
    keep[1:] &= ~same
    return keep


def starts_inside(name: str, epoch: Time, body: Planet) -> InvalidInput:
    """The error of an orbit whose state at the epoch is below the surface or atmosphere of a body."""
    what = f"{name or 'the orbit'} at {epoch.tdb.iso} TDB inside {body.name}"
    return InvalidInput(
        "orbit", what, f"a start more than {body.impact_distance / 1e3:.0f} km from its centre"
    )


def _epochs(rows: list[tuple[str, Orbit]], origin: Time) -> Array:
    """Epochs, s (TDB) from `origin`; whole days first, so that no digit is lost."""
    zero = origin.tdb
    # Asteroids of a catalogue share few epochs, and reading a Time is slow.
    epochs = {id(orbit.epoch): orbit.epoch for _, orbit in rows}
    known = {key: (t.jd1, t.jd2) for key, t in epochs.items()}
    pairs = np.array([known[id(orbit.epoch)] for _, orbit in rows]).reshape(-1, 2)
    return ((pairs[:, 0] - zero.jd1) + (pairs[:, 1] - zero.jd2)) * DAY


def _states(rows: list[tuple[str, Orbit]], window: Window, epochs: Array) -> Array:
    """Barycentric states at the epochs, shape (n, 6), m and m/s."""
    out = np.empty((len(rows), 6))
    centres = np.array([orbit.centre for _, orbit in rows], dtype=object)
    for i, (_, orbit) in enumerate(rows):
        out[i, :3] = orbit.position.to_value(u.m)
        out[i, 3:] = orbit.velocity.to_value(_SPEED)
    barycentric = centres == "ssb"
    if barycentric.any():
        out[barycentric] += barycentre_in(window, epochs[barycentric])
    for centre in set(centres) - {"ssb"}:
        where = centres == centre
        out[where] += window.states(BODIES.index(centre), epochs[where])
    return out


def _twins(window: Window, epochs: Array, states: Array) -> dict[int, str]:
    """Numbers and names of the orbits that are those of massive asteroids."""
    out = {}
    for k, name in enumerate(BELT, N_BODIES):
        away = states - window.states(k, epochs)
        near = (np.linalg.norm(away[:, :3], axis=1) < TWIN_DISTANCE) & (
            np.linalg.norm(away[:, 3:], axis=1) < TWIN_SPEED
        )
        out.update(dict.fromkeys(np.flatnonzero(near).tolist(), name))
    return out


def _forces_used(
    chosen: tuple[str, ...], shares: Array, least: float
) -> tuple[tuple[str, ...], dict[str, float], dict[str, float]]:
    """Forces used for at least one asteroid, their largest displacements (km) where known, and those of the others."""
    largest = {name: float(v) for name, v in zip(NAMES, shares.max(axis=0, initial=0.0), strict=True) if name}
    out = {name for name, value in largest.items() if value < least and name in chosen and len(shares)}
    kept = tuple(n for n in chosen if n not in out)
    share, left_out = ({n: largest[n] / 1e3 for n in some if n in largest} for some in (kept, sorted(out)))
    return kept, share, left_out


def _table(
    rows: list[tuple[str, Orbit]],
    raw: Array,
    contacts: Array,
    origin: Time,
    window: Window,
    meta: dict[str, Any],
) -> QTable:
    """The result; `contacts` holds times (s) and relative states: closest approaches, or entries of impacts."""
    index = raw[:, 11].astype(int)
    gm = window.gm[raw[:, 0].astype(int)]
    hits = raw[:, 10] > 0.0
    speed2 = raw[:, 9] + 2.0 * gm / raw[:, 8]
    b, _ = target_plane(raw[:, 2:8], gm)
    out = QTable()
    out["asteroid"] = np.array([rows[i][0] for i in index], dtype=str)
    out["planet"] = np.array([BODIES[int(b)] for b in raw[:, 0]], dtype=str)
    zero = origin.tdb
    out["time"] = Time(np.full(len(raw), zero.jd1), zero.jd2 + raw[:, 1] / DAY, format="jd", scale="tdb")
    out["distance"] = (raw[:, 8] * u.m).to(u.km)
    out["v_rel"] = (np.sqrt(np.maximum(speed2, 0.0)) * u.m / u.s).to(u.km / u.s)
    out["v_inf"] = (np.sqrt(np.maximum(raw[:, 9], 0.0)) * u.m / u.s).to(u.km / u.s)
    out["b_t"], out["b_r"] = (b[:, 0] * u.m).to(u.km), (b[:, 1] * u.m).to(u.km)
    out["impact"] = hits
    out["index"] = index
    out["position"] = (contacts[:, 1:4] * u.m).to(u.km)
    out["velocity"] = (contacts[:, 4:] * u.m / u.s).to(u.km / u.s)
    if hits.any():
        at_earth = hits & (out["planet"] == "earth")
        places = np.full((len(raw), 2), np.nan)
        when = Time(zero.jd1, zero.jd2 + contacts[:, 0] / DAY, format="jd", scale="tdb")
        if at_earth.any():
            places[at_earth] = geographic(contacts[at_earth, 1:4], when[at_earth])
        out["entry_time"] = np.where(hits, when.isot, "")
        out["entry_longitude"], out["entry_latitude"] = places[:, 0] * u.deg, places[:, 1] * u.deg
    out.meta = meta
    return out


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
