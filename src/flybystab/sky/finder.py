"""All encounters of many asteroids: one compiled integration per asteroid, with the search inside it.

DOP853 among prescribed bodies. Each asteroid has its own steps and only the forces that it needs, so that none
disturbs another, and threads share the work. After each step every planet asked for is checked for a minimum of
distance (:mod:`flybystab.sky.minima`). An impact, on whichever body, is reported and ends that track.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.constants import DAY, YEAR
from flybystab.core.jit import borrowed, kernel
from flybystab.errors import InvalidInput, NotConverged
from flybystab.sky.almanac import GRID, N_FAST, SLOT, gather
from flybystab.sky.b_plane import target_plane
from flybystab.sky.dop853 import step
from flybystab.sky.ephemeris import BODIES, Ephemeris, Window, body_state
from flybystab.sky.field import Field, borrowed_field, borrowed_places, empty_places, field, rate
from flybystab.sky.forces import FORCES
from flybystab.sky.minima import _FINE, BENDING, WIDTH, chord_distance, crash, look
from flybystab.sky.need import N_SHARES, NAMES, reduced, shares_along
from flybystab.sky.orbit import Orbit, _ephemeris, default_forces, later, seconds
from flybystab.sky.planets import PLANETS, planet
from flybystab.sky.predictability import neighbour
from flybystab.units import to_si

Array = NDArray[np.float64]

#: Longest step, s.
_LONGEST = 30.0 * DAY
_FULL, _STALLED = 1, 2
#: Tolerance over the error (m) that it leaves the median asteroid with after ten years; the error grows with the
#: square of time (``flybystab bench sky``).
_AT_10_YEARS, _TOLERANCES = 1e-12 / 100.0, (1e-15, 1e-8)


@kernel
def track_encounters(
    field: Field,
    law: Array,
    t0: float,
    y0: Array,
    t_quiet: float,
    t_end: float,
    limits: Array,
    floors: Array,
    tolerance: float,
    out: Array,
    n: int,
) -> tuple[int, int, float]:
    """Encounters of one asteroid from ``t0`` to ``t_end``, s, not counting those before ``t_quiet``.

    Parameters
    ----------
    field : Field
        Forces, without the non-gravitational one.
    law : ndarray, shape (8,)
        A1, A2, A3 (m/s2) and their law; zeros for none.
    t0, y0 : float, ndarray
        Start (s) and barycentric state (m, m/s). Time may run backward.
    limits, floors : ndarray, shape (10,)
        Of each body: largest distance of an encounter (zero: only impacts count), distance of impact, m.
    tolerance : float
        Error per step, in units of 1.5e11 m and 30 km/s.
    out : ndarray, shape (rows, 12)
        Result from row `n` on; see ``WIDTH``.

    Returns
    -------
    int
        Number of rows.
    int
        0 done; 1 `out` was too small; 2 the step size collapsed.
    float
        Time reached, s.
    """
    field = borrowed_field(field)
    stages, places_kept = np.empty((13, 6)), empty_places()
    spare_stages, spare_kept = np.empty((13, 6)), empty_places()
    k, places = borrowed(stages), borrowed_places(places_kept)
    spare, spare_places = borrowed(spare_stages), borrowed_places(spare_kept)
    y = y0.copy()
    new = np.empty(6)
    old, now = np.empty((10, 3)), np.empty((10, 3))
    work = np.empty(6)
    pair = np.empty((2, 10))
    sign = 1.0 if t_end >= t0 else -1.0
    h = sign * DAY
    t = t0
    rate(field, law, t, y, places, k[0])
    gather(places, now)
    while (t_end - t) * sign > 0.0:
        stop = t_quiet if (t_quiet - t) * sign > 0.0 else t_end
        last = abs(stop - t) <= abs(h)
        length = stop - t if last else h
        error = step(field, law, t, y, length, k, new, places) / tolerance
        if not error <= 1.0:
            factor = 0.9 * error**-0.125 if error < 1e30 else 0.1
            h = length * max(factor, 0.1)
            if abs(h) < 1e-3:
                return n, _STALLED, t
            continue
        t_new = stop if last else t + length
        old[:] = now
        gather(places, now)
        if (t - t_quiet) * sign >= 0.0:
            early, late = (0, 1) if sign > 0.0 else (1, 0)
            pair[early, 0] = t
            pair[late, 0] = t_new
            bend0 = 0.0
            bend1 = 0.0
            for j in range(6):
                pair[early, 1 + j] = y[j]
                pair[late, 1 + j] = new[j]
            for j in range(3):
                pair[early, 7 + j] = k[0, 3 + j]
                pair[late, 7 + j] = k[12, 3 + j]
                bend0 += k[0, 3 + j] ** 2
                bend1 += k[12, 3 + j] ** 2
            bend = 3.0 * np.sqrt(max(bend0, bend1))
            bulge = 0.125 * length * length
            for body in range(10):
                reach = max(limits[body], floors[body])
                if chord_distance(y, old[body], new, now[body]) > reach + bulge * (bend + BENDING[body]):
                    continue
                if n + _FINE > out.shape[0]:
                    return n, _FULL, t
                d1 = 0.0
                for j in range(3):
                    d1 += (new[j] - now[body, j]) ** 2
                if d1 < floors[body] ** 2:
                    body_state(field.head, field.data, field.gm, body, t, work)
                    for j in range(6):
                        out[n, 2 + j] = y[j] - work[j]
                    crash(out[n], body, field.gm[body], t, sign)
                    return n + 1, 0, t_new
                n, hit = look(
                    field,
                    law,
                    pair,
                    k[0] if sign > 0.0 else k[12],
                    body,
                    limits[body],
                    floors[body],
                    out,
                    n,
                    spare,
                    spare_places,
                )
                if hit == hit:
                    return n, 0, hit
        t = t_new
        y[:] = new
        k[0] = k[12]
        grow = 0.9 * error**-0.125 if error > 0.0 else 5.0
        if not last or grow < 1.0:
            h = length * min(max(grow, 0.2), 5.0)
        if abs(h) > _LONGEST:
            h = sign * _LONGEST
    return n, 0, t


@kernel
def search(
    everything: Field,
    laws: Array,
    epochs: Array,
    states: Array,
    t_start: float,
    t_stop: float,
    limits: Array,
    floors: Array,
    tolerances: Array,
    least: float,
    always: Array,
    shares: Array,
    first: int,
    out: Array,
) -> tuple[int, int, int, float]:
    """Encounters of asteroids ``first``, ``first + 1``, ... until all are done or ``out`` is full.

    ``least`` (m) is the share of a force below which it is left out, ``shares[n, 29]`` takes the estimates.
    Other arguments as in :func:`track_encounters`, one row per asteroid.

    Returns
    -------
    int
        The asteroid to go on with.
    int
        Number of rows.
    int
        0 done, 1 `out` was too small for the next asteroid, 2 its step size collapsed.
    float
        Where it did, s.
    """
    n = 0
    room = empty_places()
    for i in range(first, epochs.size):
        t0 = epochs[i]
        y = states[i]
        if t0 > t_start:
            shares_along(everything, t0, y, t_start, room, shares[i])
        if t0 < t_stop:
            shares_along(everything, t0, y, t_stop, room, shares[i])
        field = reduced(everything, shares[i], least, always)
        m = n
        for leg in range(2):
            if leg == 0 and t0 > t_start:
                quiet, end = min(t0, t_stop), t_start
            elif leg == 1 and t0 < t_stop:
                quiet, end = max(t0, t_start), t_stop
            else:
                continue
            m, status, t = track_encounters(
                field, laws[i], t0, y, quiet, end, limits, floors, tolerances[i], out, m
            )
            if status != 0:
                return i, n, status, t
        for row in range(n, m):
            out[row, 11] = i
        n = m
    return epochs.size, n, 0, 0.0


def find_encounters(
    objects: Any,
    start: Time,
    stop: Time,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    *,
    ephemeris: str | Ephemeris | None = None,
    error: Quantity = 0.1 * u.km,
    tolerance: float | None = None,
    forces: tuple[str, ...] | None = None,
    growth: bool = False,
    threads: int | None = None,
) -> QTable:
    """Every closest approach of every asteroid to every planet below a threshold.

    Parameters
    ----------
    objects : Orbit, object with ``orbit`` and ``name``, or an iterable of either
        The asteroids; they do not disturb each other.
    start, stop : Time
        Span of the search.
    planets : sequence of str
        Bodies to look for: planets and ``"moon"``.
    within : Quantity
        Largest distance between the centres; one value or one per planet.
    ephemeris : str or Ephemeris, optional
        ``"de421"``, ``"de440"``; the best installed by default.
    error : Quantity
        Displacement that counts: of the point masses and the Sun's 1PN an asteroid is given those that can move
        it by more than a tenth of this before the end of the span; J2 of Sun, Earth and `planets` and its own
        A1, A2, A3 always.
    tolerance : float, optional
        Error per step of the integration, in units of 1.5e11 m and 30 km/s; by default what keeps the median
        asteroid within `error` to the end of its span: ``1e-12 (error/0.1 km) (10 yr/span)^2``, from 1e-15 to 1e-8.
    forces : tuple of str, optional
        Exactly these forces, names as in ``flybystab.sky.forces.FORCES``, instead of choosing by `error`.
    growth : bool
        Follow a neighbour of each orbit as well, for the columns ``displacement`` (km, of the neighbour from
        the asteroid at closest approach), ``growth`` (over that at the epoch) and ``predictability``
        (:mod:`flybystab.sky.predictability`). Up to twice the time.
    threads : int, optional
        Number of threads; the processors by default.

    Returns
    -------
    QTable
        One row per encounter, sorted by asteroid and time: ``asteroid``, ``planet``, ``time`` (TDB),
        ``distance`` (km), ``v_rel`` and ``v_inf`` (km/s; 0 for a bound passage), ``b_t`` and ``b_r`` (km;
        target plane, north +z of ICRF, :mod:`flybystab.sky.b_plane`; nan for a bound passage), ``impact``,
        ``index`` (of the asteroid), ``position`` and ``velocity`` (ICRF, relative to the planet). On
        an impact, distance and time are those of the two-body orbit without a surface, position and velocity
        are from the step before, and the search ends for that asteroid. Metadata: ephemeris, forces, frame, time scale,
        tolerance.

    Raises
    ------
    OutOfSpan
        Where an epoch or the span lies outside the ephemeris.
    UnitMismatch, InvalidInput, UnknownName, NotConverged
    """
    rows = _objects(objects)
    for name, value in (("start", start), ("stop", stop)):
        if not isinstance(value, Time) or value.shape != ():
            raise InvalidInput(name, value, "one astropy Time")
    if not start < stop:
        raise InvalidInput("stop", stop.iso, f"a time after start, {start.iso}")
    names = [planets] if isinstance(planets, str) else list(planets)
    if not names:
        raise InvalidInput("planets", planets, "at least one")
    found = [planet(n) for n in names]
    for body in found:
        if body.name == "sun":
            raise InvalidInput("planets", body.name, f"one of {', '.join(BODIES[1:])}")
    reach = np.broadcast_to(
        to_si(within, u.m, "within", shape=None, low=0.0, open_low=True), (len(found),)
    ).astype(float)
    accuracy = to_si(error, u.m, "error", low=0.0)
    eph = _ephemeris(ephemeris)
    middle = later(start, 0.5 * seconds(stop, start))
    t_start, t_stop = seconds(start, middle), seconds(stop, middle)
    epochs = _epochs(rows, middle)
    beside = [neighbour(orbit, middle, eph) for _, orbit in rows] if growth else []
    every = [t_start, t_stop, *epochs, *(seconds(n.orbit.epoch, middle) for n in beside)]
    window = eph.window(middle, min(every), max(every))
    chosen = forces
    if chosen is None:
        used = {name for _, orbit in rows for name in default_forces(orbit, *(b.name for b in found))}
        chosen = tuple(name for name in FORCES if name in used)
    longest = np.maximum(np.abs(epochs - t_start), np.abs(epochs - t_stop))
    if tolerance is None:
        tolerances = np.clip(_AT_10_YEARS * accuracy * (10.0 * YEAR / longest) ** 2, *_TOLERANCES)
        if growth:  # the displacement of a neighbour may be metres
            tolerances = np.minimum(tolerances, 1e-14)
    else:
        tolerances = np.full(len(rows), float(tolerance))
    everything = field(window, [n for n in chosen if n != "non-gravitational"])
    limits = np.zeros(len(BODIES))
    limits[[BODIES.index(b.name) for b in found]] = reach
    floors = np.array([PLANETS[name].impact_distance for name in BODIES])
    always = np.zeros(12, dtype=bool)
    for name in ("sun", *(b.name for b in found)):
        b = BODIES.index(name)
        always[SLOT[b] + N_FAST * GRID[b]] = True
    laws = np.zeros((len(rows), 8))
    if "non-gravitational" in chosen:
        for i, (_, orbit) in enumerate(rows):
            if any(orbit.nongrav.a):
                laws[i] = *orbit.nongrav.a, *orbit.nongrav.constants
    states = _states(rows, window, epochs)
    shares = np.zeros((len(rows), N_SHARES))
    # A tenth: several shares add up, and passages on the way enlarge them.
    least = 0.1 * accuracy if forces is None else 0.0

    def run(part: slice) -> list[Array]:
        tables = everything, laws[part], epochs[part], states[part]
        steps = tolerances[part]
        size = len(tables[2])
        i, space, parts = 0, 64 * size + 256, []
        while i < size:
            out = np.empty((space, WIDTH))
            i, n, status, reached = search(
                *tables, t_start, t_stop, limits, floors, steps, least, always, shares[part], i, out
            )
            if status == _STALLED:
                name = rows[part][i][0]
                raise NotConverged(f"{name}: the step size collapsed at {later(middle, reached).iso} TDB")
            out[:n, 11] += part.start
            parts.append(out[:n].copy())
            space *= 1 if n else 4
        return parts

    workers = threads or os.cpu_count() or 1
    # Parts small enough that threads end together, large enough that Python does not count.
    size = max(1, min(64, -(-len(rows) // (4 * workers)))) if workers > 1 else max(len(rows), 1)
    tasks = [slice(i, min(i + size, len(rows))) for i in range(0, len(rows), size)]
    if workers > 1 and len(tasks) > 1:
        with ThreadPoolExecutor(workers) as pool:
            results = list(pool.map(run, tasks))
    else:
        results = [run(task) for task in tasks]
    flat = [part for parts in results for part in parts]
    raw = np.concatenate(flat) if flat else np.empty((0, WIDTH))
    raw = raw[np.lexsort((raw[:, 1], raw[:, 11]))]
    asked = np.isin(raw[:, 0], [BODIES.index(b.name) for b in found])
    elsewhere = [
        {"asteroid": rows[int(r[11])][0], "planet": BODIES[int(r[0])], "time_jd_tdb": later(middle, r[1]).jd}
        for r in raw[~asked]
    ]
    raw = raw[asked]
    kept, left_out = _forces_used(chosen, shares, least)
    meta = {
        "ephemeris": window.name,
        "forces": list(kept),
        "left_out_km": left_out,
        "impacts_elsewhere": elsewhere,
        "frame": "ICRF",
        "time_scale": "TDB",
        "tolerance": float(tolerances.min(initial=1.0)),
    }
    out = _table(rows, raw, middle, window, meta)
    if growth:
        from flybystab.sky.growth import add_growth

        def field_of(i: int) -> Field:
            return reduced(everything, shares[i], least, always)

        add_growth(out, beside, laws, window, field_of, tolerances, workers)
    return out


def _epochs(rows: list[tuple[str, Orbit]], origin: Time) -> Array:
    """Epochs, s (TDB) from `origin`; whole days first, so that no digit is lost."""
    zero = origin.tdb
    pairs = np.array([(t.jd1, t.jd2) for t in (orbit.epoch for _, orbit in rows)]).reshape(-1, 2)
    return ((pairs[:, 0] - zero.jd1) + (pairs[:, 1] - zero.jd2)) * DAY


def _states(rows: list[tuple[str, Orbit]], window: Window, epochs: Array) -> Array:
    """Barycentric states at the epochs, shape (n, 6), m and m/s."""
    out = np.empty((len(rows), 6))
    centres = np.array([orbit.centre for _, orbit in rows], dtype=object)
    for i, (_, orbit) in enumerate(rows):
        out[i, :3] = orbit.position.to_value(u.m)
        out[i, 3:] = orbit.velocity.to_value(u.m / u.s)
    for centre in set(centres) - {"ssb"}:
        where = centres == centre
        out[where] += window.states(BODIES.index(centre), epochs[where])
    return out


def _forces_used(
    chosen: tuple[str, ...], shares: Array, least: float
) -> tuple[tuple[str, ...], dict[str, float]]:
    """Forces that at least one asteroid was given, and of each other one its largest share, km."""
    largest = {name: float(v) for name, v in zip(NAMES, shares.max(axis=0, initial=0.0), strict=True) if name}
    out = {name for name, value in largest.items() if value < least and name in chosen and len(shares)}
    return tuple(n for n in chosen if n not in out), {n: largest[n] / 1e3 for n in chosen if n in out}


def _table(
    rows: list[tuple[str, Orbit]], raw: Array, origin: Time, window: Window, meta: dict[str, Any]
) -> QTable:
    index = raw[:, 11].astype(int)
    gm = window.gm[raw[:, 0].astype(int)]
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
    out["impact"] = raw[:, 10] > 0.0
    out["index"] = index
    out["position"] = (raw[:, 2:5] * u.m).to(u.km)
    out["velocity"] = (raw[:, 5:8] * u.m / u.s).to(u.km / u.s)
    out.meta = meta
    return out


def _objects(objects: Any) -> list[tuple[str, Orbit]]:
    """Names and orbits of one object or of many."""
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
