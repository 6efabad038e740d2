"""Encounters along trajectories in files: SPK kernels of small bodies, and orbit ephemeris messages (CCSDS OEM).

A trajectory relative to the Sun or to the barycentre of the solar system is combined with the planet of an ephemeris of
this package: small-body kernels of Horizons contain only the body.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from astropy.time import Time
from scipy.optimize import minimize_scalar

from flybystab.constants import DAY
from flybystab.encounter.from_trajectory import _track
from flybystab.encounter.reach import usual_start
from flybystab.errors import InvalidInput, MissingExtra, NoEncounter, OutOfSpan
from flybystab.files import read_bytes
from flybystab.orbit.barycentre import barycentre_in
from flybystab.orbit.ephemeris import BODIES, Ephemeris
from flybystab.orbit.orbit_arguments import as_ephemeris
from flybystab.orbit.planets import Planet
from flybystab.typing import Array

#: NAIF identifiers of the supported centres, and their names in this package.
_CENTRES = {0: "ssb", 10: "sun", 199: "mercury", 299: "venus", 399: "earth", 301: "moon"}
#: Error of the spline between samples, m, and the largest number of samples.
_SPLINE_ERROR, _LARGEST = 1.0, 20001
_COARSE = 4001


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of a trajectory relative to a planet.

    Attributes
    ----------
    epoch : Time
        TDB.
    t, states : ndarray, shapes (n,) and (n, 6)
        s from the epoch; m and m/s, ICRF axes.
    error : float
        Estimated error of the interpolation near closest approach, m.
    ephemeris : str
        Ephemeris of the planet; empty if the trajectory is relative to it.
    """

    epoch: Time
    t: Array
    states: Array
    error: float
    ephemeris: str = ""


@contextmanager
def _kernel(path: Path) -> Iterator[ModuleType]:
    try:
        import spiceypy
    except ImportError:
        raise MissingExtra("spiceypy", "spk", "an SPK kernel") from None
    from spiceypy.utils.exceptions import SpiceyError

    if read_bytes(path, "SPK file", kind="SPK kernel")[:7] not in (b"DAF/SPK", b"NAIF/DA"):
        raise InvalidInput("SPK file", path, "a binary SPK kernel")
    try:
        spiceypy.furnsh(str(path))
        yield spiceypy
    except SpiceyError as error:
        raise InvalidInput("SPK file", path, f"a readable SPK kernel ({_first_line(error)})") from None
    finally:
        spiceypy.unload(str(path))


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip(" =")]
    return lines[1] if len(lines) > 1 else str(error)


def _target(spice: ModuleType, path: Path, target: int | str | None) -> int:
    """Identifier of a body of the kernel, by its identifier or number; None for the only small body."""
    known = [int(x) for x in spice.spkobj(str(path))]
    small = [x for x in known if x > 1_000_000]
    if target is None:
        if len(small) != 1:
            raise InvalidInput("target", target, f"one of {small or known} in {path.name}")
        return small[0]
    text = str(target).strip()
    if not re.fullmatch(r"-?\d+", text):
        raise InvalidInput("target", target, f"a number, or an identifier of NAIF out of {known}")
    n = int(text)
    found = [x for x in (n, 20_000_000 + n, 2_000_000 + n) if x in known]
    if not found:
        raise InvalidInput("target", target, f"one of {known} in {path.name}")
    return found[0]


def spk_samples(
    path: str | Path,
    target: int | str | None,
    planet: Planet,
    time: Time,
    search: float,
    start: float | None,
    ephemeris: str | Ephemeris | None,
) -> Samples:
    """Samples of a kernel around its closest approach to a planet nearest to `time`.

    Their spacing keeps the error of the interpolation below 1 m. Parameters as checked by :meth:`Encounter.from_spk`,
    SI.

    Raises
    ------
    InvalidInput, MissingExtra, NoEncounter, OutOfSpan
    """
    file = Path(path)
    zero = time.tdb
    et = float(((zero.jd1 - 2451545.0) + zero.jd2) * DAY)  # ephemeris time is TDB
    with _kernel(file) as spice:
        body = _target(spice, file, target)
        spans = _spans(spice, file, body, et)
        inside = [s for s in spans if s[0] <= 0.0 <= s[1]]
        if not inside:
            days = [
                Time(zero.jd1, zero.jd2 + x / DAY, format="jd", scale="tdb").iso[:10] for x in np.ravel(spans)
            ]
            raise OutOfSpan(file.name, f"{zero.iso} TDB", days[0], days[-1], "")
        low, high = max(inside[0][0], -search), min(inside[0][1], search)
        centre = _centre(spice, file, body, et)
        origin, name = _origin(centre, planet, zero, low, high, ephemeris)

        def states(t: Array) -> Array:
            found = [spice.spkgeo(body, et + float(x), "J2000", centre)[0] for x in t]
            return np.array(found).reshape(-1, 6) * 1e3 - origin(t)

        return _dense(states, zero, low, high, planet, start, name)


def _spans(spice: ModuleType, path: Path, body: int, et: float) -> list[tuple[float, float]]:
    """Spans of a body, s from `et`, a second inside their ends."""
    cover = spice.spkcov(str(path), body)
    count = int(spice.wncard(cover))
    found = (spice.wnfetd(cover, k) for k in range(count))
    return [(float(a) - et + 1.0, float(b) - et - 1.0) for a, b in found]


def _centre(spice: ModuleType, path: Path, body: int, et: float) -> int:
    """Centre of the segment of a body at a time."""
    _, descriptor, _ = spice.spksfs(body, et, 80)
    integers = spice.dafus(descriptor, 2, 6)[1]
    centre = int(integers[1])
    if centre not in _CENTRES:
        raise InvalidInput("centre of the trajectory", centre, f"one of {sorted(_CENTRES)} in {path.name}")
    return centre


def _origin(
    centre: int | str, planet: Planet, zero: Time, low: float, high: float, ephemeris: str | Ephemeris | None
) -> tuple[Callable[[Array], Array], str]:
    """State of a planet relative to the centre of a trajectory, at s from `zero`; name of its ephemeris."""
    where = _CENTRES[centre] if isinstance(centre, int) else centre
    if where == planet.name:
        return lambda t: np.zeros((len(t), 6)), ""
    if planet.name not in BODIES or planet.name == "sun":
        raise InvalidInput("planet", planet.name, f"one of {', '.join(BODIES[1:])}")
    window = as_ephemeris(ephemeris).window(zero, low, high)

    def origin(t: Array) -> Array:
        there = window.states(BODIES.index(planet.name), t)
        centre = barycentre_in(window, t) if where == "ssb" else window.states(BODIES.index(where), t)
        return there - centre

    return origin, window.name


def _dense(
    states: Callable[[Array], Array],
    zero: Time,
    low: float,
    high: float,
    planet: Planet,
    start: float | None,
    name: str,
) -> Samples:
    """Samples around the minimum of distance nearest to t = 0, doubled until the interpolation error is small."""
    t = np.linspace(low, high, _COARSE)
    distance = np.linalg.norm(states(t)[:, :3], axis=1)
    minima = 1 + np.flatnonzero((distance[1:-1] <= distance[:-2]) & (distance[1:-1] < distance[2:]))
    if not len(minima):
        raise NoEncounter(
            f"the trajectory has no minimum of distance from {planet.name} in the span searched"
        )
    k = int(minima[np.argmin(np.abs(t[minima]))])
    best = minimize_scalar(
        lambda x: float(np.linalg.norm(states(np.array([x]))[0, :3])),
        bounds=(t[k - 1], t[k + 1]),
        method="bounded",
        options={"xatol": 1e-6},
    )
    middle = float(best.x)
    state = states(np.array([middle]))[0]
    q, speed = float(np.linalg.norm(state[:3])), float(np.linalg.norm(state[3:]))
    reach = 1.3 * (usual_start(planet, q) if start is None else start)
    before = np.flatnonzero((distance[:k] > reach) | (np.diff(distance[: k + 1]) > 0.0))
    after = k + np.flatnonzero((distance[k + 1 :] > reach) | (np.diff(distance[k:]) < 0.0))
    ends = (t[before[-1]] if len(before) else low, t[min(after[0] + 1, _COARSE - 1)] if len(after) else high)
    scale = q / speed
    s = [float(np.arcsinh((x - middle) / scale)) for x in ends]
    n, error = 65, np.inf
    while True:
        grid = middle + scale * np.sinh(np.linspace(s[0], s[1], n))
        found = states(grid)
        track, shift = _track(planet, grid, found)
        between = middle + scale * np.sinh(np.linspace(s[0], s[1], 2 * n - 1)[1::2])
        error = float(np.abs(track.states(between - shift)[:, :3] - states(between)[:, :3]).max())
        if error < _SPLINE_ERROR or 2 * n - 1 > _LARGEST:
            return Samples(zero, grid, found, error, name)
        n = 2 * n - 1


_OEM_CENTRES = {
    "SUN": "sun",
    "SOLAR SYSTEM BARYCENTER": "ssb",
    "SSB": "ssb",
    "EARTH": "earth",
    "MOON": "moon",
}
_OEM_SCALES = {"TDB": "tdb", "TT": "tt", "UTC": "utc", "TAI": "tai"}


def oem_samples(path: str | Path, planet: Planet, ephemeris: str | Ephemeris | None) -> Samples:
    """Samples of an orbit ephemeris message relative to a planet.

    Keywords: CCSDS 502.0-B-3, section 5 (key-value notation). Accelerations and covariances of the message
    are not used. All segments must have the same centre, frame and time system.

    Raises
    ------
    InvalidInput
        Another frame, centre or time system, or a broken message.
    """
    raw = read_bytes(path, "OEM file")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput("OEM file", path, f"text ({error})") from None
    if not re.match(r"\s*CCSDS_OEM_VERS\s*=", text):
        raise InvalidInput(
            "OEM file", path, "an orbit ephemeris message in key-value notation (CCSDS_OEM_VERS)"
        )
    meta, rows = _oem_rows(text, path)
    centre = _OEM_CENTRES.get(meta.get("CENTER_NAME", "").upper(), meta.get("CENTER_NAME", "").lower())
    if centre not in (*BODIES, "ssb"):
        raise InvalidInput("CENTER_NAME", meta.get("CENTER_NAME"), f"SUN, SSB or a planet in {path}")
    if meta.get("REF_FRAME", "").upper() not in ("ICRF", "EME2000", "J2000", "GCRF"):
        raise InvalidInput("REF_FRAME", meta.get("REF_FRAME"), f"ICRF or EME2000 in {path}")
    scale = _OEM_SCALES.get(meta.get("TIME_SYSTEM", "").upper())
    if scale is None:
        raise InvalidInput(
            "TIME_SYSTEM", meta.get("TIME_SYSTEM"), f"one of {', '.join(_OEM_SCALES)} in {path}"
        )
    try:
        times = Time([row[0] for row in rows], scale=scale).tdb
    except ValueError as error:
        raise InvalidInput("epoch", rows[0][0], f"an epoch of CCSDS in {path} ({error})") from None
    zero = times[0]
    t = np.asarray((times - zero).to_value("s"), dtype=float)
    t, first = np.unique(t, return_index=True)
    found = np.array([row[1] for row in rows])[first] * 1e3
    if len(t) < 3:
        raise InvalidInput("OEM file", path, "three samples or more")
    origin, name = _origin(centre, planet, zero, float(t[0]), float(t[-1]), ephemeris)
    states = found - origin(t)
    return Samples(zero, t, states, _halving_error(planet, t, states), name)


def _oem_rows(text: str, path: str | Path) -> tuple[dict[str, str], list[tuple[str, list[float]]]]:
    """Metadata that all segments share, and their rows: epoch, state in km and km/s."""
    meta: dict[str, str] = {}
    rows: list[tuple[str, list[float]]] = []
    skipped = False
    for line in text.splitlines():
        words = line.split()
        if not words or words[0] == "COMMENT":
            continue
        if words[0] in ("COVARIANCE_START", "COVARIANCE_STOP"):
            skipped = words[0].endswith("START")
        elif skipped:
            continue
        elif "=" in line:
            key, _, value = (x.strip() for x in line.partition("="))
            if (
                key in ("CENTER_NAME", "REF_FRAME", "TIME_SYSTEM", "OBJECT_ID")
                and meta.setdefault(key, value) != value
            ):
                raise InvalidInput(key, value, f"the same in all segments of {path}")
        elif re.match(r"\d{4}-", words[0]):
            try:
                rows.append((words[0].rstrip("Z"), [float(x) for x in words[1:7]]))
            except ValueError:
                raise InvalidInput("row", line, f"an epoch and numbers in {path}") from None
            if len(words) not in (7, 10):
                raise InvalidInput("row", line, f"an epoch, a state, and at most an acceleration in {path}")
    if len(rows) < 3:
        raise InvalidInput("OEM file", path, "three samples or more")
    return meta, rows


def _halving_error(planet: Planet, t: Array, states: Array) -> float:
    """Error of the closest distance, m: its change without every second sample; nan if it cannot be computed."""
    try:
        (full, _), (half, _) = _track(planet, t, states), _track(planet, t[::2], states[::2])
    except (NoEncounter, ValueError):
        return np.nan
    places = [np.linalg.norm(track.states(np.zeros(1))[0, :3]) for track in (full, half)]
    return abs(float(places[0] - places[1]))
