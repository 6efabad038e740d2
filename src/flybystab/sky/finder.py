"""All encounters of many asteroids: one compiled integration per asteroid, with the search inside it.

DOP853 (Dormand & Prince; Hairer, Norsett & Wanner 1993, coefficients as published by scipy) among prescribed
bodies. Each asteroid has its own steps, so that none disturbs another, and threads share the work. After each
step every planet asked for is checked for a minimum of distance on the quintic through the ends of the step;
a minimum below the threshold is refined on the integrator's own trajectory until ``r.v = 0``. An impact is
reported and ends that track.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray
from scipy.integrate import DOP853

from flybystab.constants import DAY
from flybystab.core.jit import kernel
from flybystab.errors import InvalidInput, NotConverged
from flybystab.sky.approach import _measure, relative
from flybystab.sky.b_plane import target_plane
from flybystab.sky.ephemeris import BODIES, Ephemeris, Window, body_states
from flybystab.sky.forces import _GM, FORCES, acceleration_among, bodies, model, push
from flybystab.sky.kepler import time_at_distance
from flybystab.sky.orbit import Orbit, _ephemeris, default_forces, later, seconds
from flybystab.sky.planets import planet
from flybystab.sky.predictability import neighbour
from flybystab.units import to_si

Array = NDArray[np.float64]

_A = np.ascontiguousarray(DOP853.A[:12, :12])
_B = np.ascontiguousarray(DOP853.B)
_C = np.ascontiguousarray(DOP853.C[:12])
_E3 = np.ascontiguousarray(DOP853.E3)
_E5 = np.ascontiguousarray(DOP853.E5)

#: Columns of a raw result: body, time (s), state relative to the body (6; m, m/s), distance (m), v_inf^2
#: (m2/s2), impact (0, 1).
WIDTH = 11
#: Longest step, s, and the unit of position (m) and velocity (m/s) in which the tolerance counts.
_LONGEST, _LENGTH, _SPEED = 10.0 * DAY, 1.5e11, 3.0e4
_CUTS = 8


@kernel
def _rate(model: Array, law: Array, t: float, y: Array, places: Array, rate: Array, out: Array) -> None:
    """Write velocity and acceleration at ``t``, ``y[6]`` into ``out[6]``; bodies into ``places[10, 3]``."""
    bodies(model, t, places, rate)
    acceleration_among(model, places, rate, y[:3], y[3:], out[3:])
    out[0], out[1], out[2] = y[3], y[4], y[5]
    if law[0] != 0.0 or law[1] != 0.0 or law[2] != 0.0:
        push(law, y[:3] - places[0], y[3:] - rate, out[3:])


@kernel
def _step(
    model: Array, law: Array, t: float, y: Array, h: float, k: Array, new: Array, places: Array, rate: Array
) -> float:
    """One step of DOP853 from ``y`` with ``k[0]`` set; writes ``new`` and ``k``; the estimated error."""
    w = np.empty(6)
    for s in range(1, 12):
        for j in range(6):
            acc = 0.0
            for i in range(s):
                acc += _A[s, i] * k[i, j]
            w[j] = y[j] + h * acc
        _rate(model, law, t + _C[s] * h, w, places, rate, k[s])
    for j in range(6):
        acc = 0.0
        for i in range(12):
            acc += _B[i] * k[i, j]
        new[j] = y[j] + h * acc
    _rate(model, law, t + h, new, places, rate, k[12])
    five = 0.0
    three = 0.0
    for j in range(6):
        e5 = 0.0
        e3 = 0.0
        for i in range(13):
            e5 += _E5[i] * k[i, j]
            e3 += _E3[i] * k[i, j]
        unit = _LENGTH if j < 3 else _SPEED
        five += (e5 / unit) ** 2
        three += (e3 / unit) ** 2
    if five == 0.0 and three == 0.0:
        return 0.0
    return abs(h) * five / np.sqrt((five + 0.01 * three) * 6.0)


@kernel
def _refine(
    model: Array, law: Array, gm: Array, t0: float, y0: Array, k0: Array, body: int, t: float, out: Array
) -> float:
    """Time of ``r.v = 0`` near ``t`` on the path through ``y0`` at ``t0``; relative state in ``out``."""
    k = np.empty((13, 6))
    k[0] = k0
    y = np.empty(6)
    places = np.empty((10, 3))
    rate = np.zeros(3)
    head = model[20:70].reshape((10, 5))
    data = model[140:]
    for _ in range(12):
        _step(model, law, t0, y0, t - t0, k, y, places, rate)
        # Places, and the planet's acceleration by a central difference over two minutes: a slow passage is
        # steered by the Sun as much as by the planet.
        place = body_states(head, data, gm, body, np.array([t, t - 60.0, t + 60.0]))
        rv = 0.0
        slope = 0.0
        v2 = 0.0
        for j in range(3):
            out[j] = y[j] - place[0, j]
            out[3 + j] = y[3 + j] - place[0, 3 + j]
            rv += out[j] * out[3 + j]
            v2 += out[3 + j] ** 2
            slope += out[j] * (k[12, 3 + j] - (place[2, 3 + j] - place[1, 3 + j]) / 120.0)
        slope += v2
        if not slope > 1e-3 * v2:
            return t
        dt = -rv / slope
        if abs(dt) < 1e-5:
            # What is left is linear: shift along the relative velocity.
            for j in range(3):
                out[j] += dt * out[3 + j]
            return t + dt
        t += dt
    return t


@kernel
def _two_body(gm: float, s: Array) -> tuple[float, float, float]:
    """Periapsis distance (m), time to it (s) and v_inf^2 (m2/s2) of an inbound relative state ``s[6]``."""
    r = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
    v2 = s[3] ** 2 + s[4] ** 2 + s[5] ** 2
    h2 = (
        (s[1] * s[5] - s[2] * s[4]) ** 2 + (s[2] * s[3] - s[0] * s[5]) ** 2 + (s[0] * s[4] - s[1] * s[3]) ** 2
    )
    energy = v2 - 2.0 * gm / r
    q = max(h2 / (gm + np.sqrt(max(gm * gm + h2 * energy, 0.0))), 1.0)
    return q, time_at_distance(gm, q, q * energy / gm, r), energy


@kernel
def _crash(row: Array, body: int, gm: float, t: float, sign: float) -> None:
    """Fill a row for an impact from the relative state in ``row[2:8]`` at ``t`` (s), outside the planet."""
    r = np.sqrt(row[2] ** 2 + row[3] ** 2 + row[4] ** 2)
    q, ahead, energy = _two_body(gm, row[2:8])
    inbound = sign * (row[2] * row[5] + row[3] * row[6] + row[4] * row[7])
    row[0] = body
    row[1] = t + sign * (ahead if inbound < 0.0 and ahead == ahead else 0.0)
    row[8] = min(q, r)
    row[9] = energy
    row[10] = 1.0


@kernel
def _look(
    model: Array,
    law: Array,
    gm: Array,
    pair: Array,
    first: Array,
    body: int,
    within: float,
    floor: float,
    out: Array,
    n: int,
) -> tuple[int, float]:
    """Minima of distance inside one step: rows in ``out`` from ``n``; new count and time of an impact or nan.

    ``pair`` holds the ends of the step in order of time, ``first`` the rate at the earlier end.
    """
    head = model[20:70].reshape((10, 5))
    data = model[140:]
    s = np.empty(6)
    h = (pair[1, 0] - pair[0, 0]) / _CUTS
    relative(pair, 0, head, data, gm, body, pair[0, 0], s)
    fa = _measure(s, -1.0)
    for i in range(_CUTS):
        ta = pair[0, 0] + i * h
        tb = pair[0, 0] + (i + 1) * h if i < _CUTS - 1 else pair[1, 0]
        relative(pair, 0, head, data, gm, body, tb, s)
        fb = _measure(s, -1.0)
        start = fa
        fa = fb
        if not (start < 0.0 and fb >= 0.0):
            continue
        a, b, ga, gb = ta, tb, start, fb
        for _ in range(60):
            tm = (a * gb - b * ga) / (gb - ga)
            if not (a < tm < b or b < tm < a):
                tm = 0.5 * (a + b)
            relative(pair, 0, head, data, gm, body, tm, s)
            gmid = _measure(s, -1.0)
            moved = abs(tm - b)
            if (gmid < 0.0) == (gb < 0.0):
                ga *= 0.5
            else:
                a, ga = b, gb
            b, gb = tm, gmid
            if moved < 1e-3 or gmid == 0.0:
                break
        d = np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
        if d > within * 1.001 + 1e7:
            continue
        row = out[n]
        t = _refine(model, law, gm, pair[0, 0], pair[0, 1:7], first, body, b, row[2:8])
        d = np.sqrt(row[2] ** 2 + row[3] ** 2 + row[4] ** 2)
        if d < floor:  # in and out again within one step
            relative(pair, 0, head, data, gm, body, pair[0, 0], row[2:8])
            _crash(row, body, gm[body], pair[0, 0], 1.0)
            return n + 1, row[1]
        if d > within:
            continue
        row[0] = body
        row[10] = 0.0
        row[1] = t
        row[8] = d
        row[9] = row[5] ** 2 + row[6] ** 2 + row[7] ** 2 - 2.0 * gm[body] / d
        n += 1
    return n, np.nan


@kernel
def track_encounters(
    model: Array,
    law: Array,
    t0: float,
    y0: Array,
    t_quiet: float,
    t_end: float,
    targets: Array,
    within: Array,
    floors: Array,
    tolerance: float,
    out: Array,
) -> tuple[int, float]:
    """Encounters of one asteroid from ``t0`` to ``t_end``, s, not counting those before ``t_quiet``.

    Parameters
    ----------
    model : ndarray
        From :func:`flybystab.sky.forces.model`, without non-gravitational force.
    law : ndarray, shape (8,)
        A1, A2, A3 (m/s2) and their law; zeros for none.
    t0, y0 : float, ndarray
        Start (s) and barycentric state (m, m/s). Time may run backward.
    targets, within, floors : ndarray
        Bodies, their thresholds and the distances of impact, m.
    tolerance : float
        Error per step, in units of 1.5e11 m and 30 km/s.
    out : ndarray, shape (rows, 11)
        Result; see ``WIDTH``.

    Returns
    -------
    int
        Number of rows; -1 if `out` was too small, -2 if the step size collapsed.
    float
        Time reached, s.
    """
    gm = model[_GM : _GM + 10]
    k = np.empty((13, 6))
    y = y0.copy()
    new = np.empty(6)
    places = np.empty((10, 3))
    old_places = np.empty((10, 3))
    rate = np.zeros(3)
    pair = np.empty((2, 10))
    sign = 1.0 if t_end >= t0 else -1.0
    h = sign * DAY
    t = t0
    n = 0
    _rate(model, law, t, y, places, rate, k[0])
    while (t_end - t) * sign > 0.0:
        old_places[:] = places
        stop = t_quiet if (t_quiet - t) * sign > 0.0 else t_end
        last = abs(stop - t) <= abs(h)
        length = stop - t if last else h
        error = _step(model, law, t, y, length, k, new, places, rate) / tolerance
        if not error <= 1.0:
            factor = 0.9 * error**-0.125 if error < 1e30 else 0.1
            h = length * max(factor, 0.1)
            places[:] = old_places
            if abs(h) < 1e-3:
                return -2, t
            continue
        t_new = stop if last else t + length
        if (t - t_quiet) * sign >= 0.0:
            early, late = (0, 1) if sign > 0.0 else (1, 0)
            pair[early, 0] = t
            pair[late, 0] = t_new
            for j in range(6):
                pair[early, 1 + j] = y[j]
                pair[late, 1 + j] = new[j]
            for j in range(3):
                pair[early, 7 + j] = k[0, 3 + j]
                pair[late, 7 + j] = k[12, 3 + j]
            speed = max(
                np.sqrt(y[3] ** 2 + y[4] ** 2 + y[5] ** 2), np.sqrt(new[3] ** 2 + new[4] ** 2 + new[5] ** 2)
            )
            for m in range(targets.size):
                body = targets[m]
                d0 = 0.0
                d1 = 0.0
                for j in range(3):
                    d0 += (y[j] - old_places[body, j]) ** 2
                    d1 += (new[j] - places[body, j]) ** 2
                if np.sqrt(d0) + np.sqrt(d1) > 2.0 * within[m] + abs(length) * (1.1 * speed + 6.0e4):
                    continue
                if n + _CUTS > out.shape[0]:
                    return -1, t
                if d1 < floors[m] ** 2:
                    place = body_states(model[20:70].reshape((10, 5)), model[140:], gm, body, np.array([t]))
                    for j in range(6):
                        out[n, 2 + j] = y[j] - place[0, j]
                    _crash(out[n], body, gm[body], t, sign)
                    return n + 1, t_new
                n, crash = _look(
                    model,
                    law,
                    gm,
                    pair,
                    k[0] if sign > 0.0 else k[12],
                    body,
                    within[m],
                    floors[m],
                    out,
                    n,
                )
                if crash == crash:
                    return n, crash
        t = t_new
        y[:] = new
        k[0] = k[12]
        grow = 0.9 * error**-0.125 if error > 0.0 else 5.0
        if not last or grow < 1.0:
            h = length * min(max(grow, 0.2), 5.0)
        if abs(h) > _LONGEST:
            h = sign * _LONGEST
    return n, t


def find_encounters(
    objects: Any,
    start: Time,
    stop: Time,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    *,
    ephemeris: str | Ephemeris | None = None,
    tolerance: float = 1e-12,
    forces: tuple[str, ...] | None = None,
    threads: int | None = None,
    growth: bool = False,
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
    tolerance : float
        Error per step of the integration, in units of 1.5e11 m and 30 km/s.
    forces : tuple of str, optional
        Names of ``flybystab.sky.forces.FORCES``; by default all point masses, Sun 1PN, J2 of the Earth and of
        `planets`, and A1, A2, A3 of orbits that have them.
    threads : int, optional
        Number of threads; the processors by default.
    growth : bool
        Follow a neighbour of each orbit as well, for the columns ``displacement`` (km, of the neighbour from
        the asteroid at closest approach), ``growth`` (over that at the epoch) and ``predictability``
        (:mod:`flybystab.sky.predictability`). Up to twice the time.

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
    eph = _ephemeris(ephemeris)
    middle = later(start, 0.5 * seconds(stop, start))
    t_start, t_stop = seconds(start, middle), seconds(stop, middle)
    epochs = [seconds(orbit.epoch, middle) for _, orbit in rows]
    beside = [neighbour(orbit, middle, eph) for _, orbit in rows] if growth else []
    every = [t_start, t_stop, *epochs, *(seconds(n.orbit.epoch, middle) for n in beside)]
    window = eph.window(middle, min(every), max(every))
    chosen = forces
    if chosen is None:
        used = {name for _, orbit in rows for name in default_forces(orbit, *(b.name for b in found))}
        chosen = tuple(name for name in FORCES if name in used)
    table = model(window, [n for n in chosen if n != "non-gravitational"])
    targets = np.array([BODIES.index(b.name) for b in found])
    floors = np.array([b.impact_distance for b in found])

    def law_of(orbit: Orbit) -> Array:
        law = np.zeros(8)
        if any(orbit.nongrav.a) and (forces is None or "non-gravitational" in forces):
            law[:] = *orbit.nongrav.a, *orbit.nongrav.constants
        return law

    def one(item: tuple[int, tuple[str, Orbit]]) -> tuple[int, Array]:
        i, (name, orbit) = item
        law = law_of(orbit)
        state = orbit.barycentric(window)
        parts = []
        legs = []
        if epochs[i] > t_start:
            legs.append((min(epochs[i], t_stop), t_start))
        if epochs[i] < t_stop:
            legs.append((max(epochs[i], t_start), t_stop))
        for quiet, end in legs:
            space = 256
            while True:
                out = np.empty((space, WIDTH))
                n, reached = track_encounters(
                    table, law, epochs[i], state, quiet, end, targets, reach, floors, tolerance, out
                )
                if n != -1:
                    break
                space *= 4
            if n < 0:
                raise NotConverged(f"{name}: the step size collapsed at {later(middle, reached).iso} TDB")
            parts.append(out[:n])
        raw = np.concatenate(parts) if parts else np.empty((0, WIDTH))
        return i, raw[np.argsort(raw[:, 1])]

    workers = threads or os.cpu_count() or 1
    if workers > 1 and len(rows) > 1:
        with ThreadPoolExecutor(workers) as pool:
            results = list(pool.map(one, enumerate(rows)))
    else:
        results = [one(item) for item in enumerate(rows)]
    out = _table(rows, results, middle, window, chosen, tolerance)
    if growth:
        from flybystab.sky.growth import add_growth

        add_growth(out, beside, [law_of(orbit) for _, orbit in rows], window, table, tolerance, workers)
    return out


def _table(
    rows: list[tuple[str, Orbit]],
    results: Iterable[tuple[int, Array]],
    origin: Time,
    window: Window,
    forces: tuple[str, ...],
    tolerance: float,
) -> QTable:
    kept = [(i, raw) for i, raw in results if len(raw)]
    index = np.concatenate([np.full(len(raw), i) for i, raw in kept]) if kept else np.zeros(0, dtype=int)
    raw = np.concatenate([raw for _, raw in kept]) if kept else np.zeros((0, WIDTH))
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
    out.meta = {
        "ephemeris": window.name,
        "forces": list(forces),
        "frame": "ICRF",
        "time_scale": "TDB",
        "tolerance": tolerance,
    }
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
