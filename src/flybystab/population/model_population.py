"""Populations of orbits: the known asteroids, a debiased model as a table, or a law in TOML.

Three kinds of files are read:

- a table with a header that names the columns, CSV or ECSV: semi-major axis, eccentricity, inclination, and optionally
  absolute magnitude and the number of asteroids that a row represents (:data:`NAMES` lists the accepted names);
- the realisation of Granvik et al. (2018, Icarus 312, 181), ``Granvik+_2018_Icarus.dat``: seven columns without a
  header, a (au), e, i, node, argument of perihelion, mean anomaly (deg), H;
- any other table without a header, such as samples of NEOMOD (Nesvorny et al. 2023, AJ 166, 55), with the order of its
  columns given by the caller: it is never guessed.

A law in TOML gives a distribution of each element::

    count = 100000                 # orbits drawn
    asteroids = 936                # asteroids that they represent; `count` by default
    a = { kind = "uniform", low = 0.8, high = 3.0 }          # au
    e = { kind = "uniform", low = 0.1, high = 0.8 }
    i = { kind = "normal", mean = 10.0, sd = 8.0, low = 0.0, high = 90.0 }     # deg
    H = { slope = 0.35, low = 14.0, high = 17.75 }           # log10 N(< H) grows by `slope` per magnitude
    perihelion = [0.0, 1.3]        # optional limits of q, au
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from io import StringIO
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.arguments import check_arguments
from flybystab.errors import InvalidInput, UnknownName
from flybystab.files import csv_rows, parse_toml, read_text
from flybystab.screening.distributions import Distribution, distribution_of
from flybystab.typing import Array, Document
from flybystab.units import whole

#: Accepted names of each column, in lower case.
NAMES = {
    "a": ("a", "a_au", "semimajor_axis", "semi_major_axis"),
    "e": ("e", "ecc", "eccentricity"),
    "i": ("i", "i_deg", "inc", "incl", "inclination"),
    "H": ("h", "h_mag", "absolute_magnitude", "absmag"),
    "weight": ("weight",),
}
#: Columns of the realisation of Granvik et al. (2018).
GRANVIK = ("a", "e", "i", "node", "argument_of_perihelion", "mean_anomaly", "H")
#: Absolute magnitude of a diameter of 1 km at an albedo of 0.14.
KILOMETRE = 17.75
#: Largest number of draws per requested orbit in the rejection sampling of a law.
_TRIES = 1000


@check_arguments
def read_population(path: str | Path, *, columns: Sequence[str] | None = None, seed: int = 0) -> QTable:
    """Orbits of a population from a file.

    Parameters
    ----------
    path : str or Path
        A table (``.csv``, ``.ecsv``, ``.dat``, ``.txt``, each also gzipped) or a law (``.toml``).
    columns : sequence of str, optional
        Order of the columns of a table without a header: ``a``, ``e``, ``i`` and optionally ``H`` and ``weight``; other
        names are skipped.
    seed : int
        Random seed of the orbits drawn from a law.

    Returns
    -------
    QTable
        ``a`` (au), ``e``, ``i`` (deg), and ``H`` and ``weight`` where the file has them; ``meta["source"]``.

    Raises
    ------
    InvalidInput, UnknownName
        The file cannot be read, columns are missing or unnamed, or a value is not a number.
    """
    text = read_text(path, "population file")
    if str(path).endswith(".toml"):
        table = _drawn(parse_toml(text, "population file", path), whole(seed, "seed", 0))
    elif (names := _header(text, path)) is not None:
        table = _named(text, path, names)
    else:
        table = _unnamed(text, path, columns)
    table.meta["source"] = str(path)
    return table


@check_arguments
def known_population(limit: float = KILOMETRE) -> QTable:
    """Orbits of the known near-Earth asteroids brighter than an absolute magnitude (MPC, February 2026).

    Parameters
    ----------
    limit : float
        Largest ``H``, at most 20 (about 350 m at an albedo of 0.14). By default 17.75 (1 km), to which the known
        asteroids are nearly complete.

    Returns
    -------
    QTable
        ``designation`` (number, or principal designation), ``a`` (au), ``e``, ``i`` (deg), ``H``.

    Raises
    ------
    InvalidInput
    """
    faintest = 20.0
    if isinstance(limit, bool) or not isinstance(limit, int | float | np.number) or not limit <= faintest:
        raise InvalidInput("limit", limit, f"an absolute magnitude of at most {faintest:g}")
    text = resources.files("flybystab.data").joinpath("orbits.csv").read_text(encoding="utf-8")
    rows = [line.split(",") for line in text.splitlines()[1:]]
    rows = [row for row in rows if float(row[4]) < limit]
    if not rows:
        raise InvalidInput("limit", limit, "a magnitude fainter than that of the largest asteroid, 9.2")
    names, *columns = zip(*rows, strict=True)
    a, e, i, h = (np.array(column, dtype=float) for column in columns)
    table = QTable({"designation": list(names), "a": a * u.au, "e": e, "i": i * u.deg, "H": h})
    table.meta["source"] = f"known near-Earth asteroids of H < {limit:g} (MPC, February 2026)"
    return table


def is_population(path: str | Path) -> bool:
    """True for a law or a table of orbits without identities, False for a catalogue of asteroids."""
    if str(path).endswith(".toml"):
        return True
    text = read_text(path, "population file")
    names = _header(text, path)
    if names is None:
        line = next(line for line in text.splitlines() if line.strip() and not line.startswith("#"))
        return len(line.replace(",", " ").split()) == len(GRANVIK)
    known = [name.lower() for name in names]
    return all(any(name in NAMES[key] for name in known) for key in ("a", "e", "i")) and not (
        {"pdes", "full_name", "name", "spkid", "designation"} & set(known)
    )


def _header(text: str, path: str | Path) -> list[str] | None:
    """Names of the columns in the first line that is not a comment; None for a line of numbers."""
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    if not first:
        raise InvalidInput("population file", path, "at least one row")
    names = first.replace(",", " ").split()
    try:
        [float(name) for name in names]
    except ValueError:
        return names
    return None


def _named(text: str, path: str | Path, names: Sequence[str]) -> QTable:
    if text.startswith("# %ECSV"):
        table = QTable.read(text.splitlines(), format="ascii.ecsv")
        columns = {name: table[name] for name in table.colnames}
    else:
        body = "\n".join(line for line in text.splitlines() if line.strip() and not line.startswith("#"))
        rows = (
            list(csv_rows(body, "population file", path))[1:]
            if "," in body.partition("\n")[0]
            else [line.split() for line in body.splitlines()[1:]]
        )
        if uneven := [row for row in rows if len(row) != len(names)]:
            raise InvalidInput("population file", path, f"{len(names)} cells in every row, not {uneven[0]}")
        columns = {name: [row[k] for row in rows] for k, name in enumerate(names)}
    out = QTable()
    for key, unit in (("a", u.au), ("e", None), ("i", u.deg), ("H", None), ("weight", None)):
        found = [name for name in columns if name.lower() in NAMES[key]]
        if len(found) > 1:
            raise InvalidInput("population file", path, f"one column {key}, not {', '.join(found)}")
        if not found:
            if key in ("a", "e", "i"):
                raise InvalidInput(
                    "population file",
                    path,
                    f"a column {key} (one of {', '.join(NAMES[key])}) among {list(columns)}",
                )
            continue
        values = columns[found[0]]
        if getattr(values, "unit", None) not in (None, u.dimensionless_unscaled) and unit is not None:
            out[key] = values.to(unit)
            continue
        out[key] = _numbers(values, key, path) * (1 if unit is None else unit)
    return out


def _numbers(values: Iterable[str | float | None], key: str, path: str | Path) -> Array:
    try:
        return np.array([float(v) if v not in ("", None) else np.nan for v in values])
    except (TypeError, ValueError) as error:
        raise InvalidInput("population file", path, f"numbers in column {key} ({error})") from None


def _unnamed(text: str, path: str | Path, columns: Sequence[str] | None) -> QTable:
    try:
        values = np.loadtxt(StringIO(text.replace(",", " ")), ndmin=2)
    except ValueError as error:
        raise InvalidInput("population file", path, f"a table of numbers ({error})") from None
    if columns is None:
        if values.shape[1] != len(GRANVIK):
            raise InvalidInput(
                "population file",
                path,
                f"a header, the {len(GRANVIK)} columns of Granvik et al. (2018), or columns= (--columns H,a,e,i) with "
                f"the names of its {values.shape[1]} columns",
            )
        columns = GRANVIK
    if len(columns) != values.shape[1]:
        raise InvalidInput("columns", ",".join(columns), f"{values.shape[1]} names, as the file has columns")
    if missing := [name for name in ("a", "e", "i") if list(columns).count(name) != 1]:
        raise InvalidInput("columns", ",".join(columns), f"one column {missing[0]}")
    out = QTable()
    for key, unit in (("a", u.au), ("e", None), ("i", u.deg), ("H", None), ("weight", None)):
        if key in columns:
            out[key] = values[:, list(columns).index(key)] * (1 if unit is None else unit)
    return out


def _drawn(law: Document, seed: int) -> QTable:
    """Orbits drawn from a law."""
    known = ("count", "asteroids", "a", "e", "i", "H", "perihelion")
    for key in law:
        if key not in known:
            raise UnknownName("population key", key, [], f"(known: {', '.join(known)})")
    count = whole(law.get("count", 10_000), "count", 1)
    asteroids = law.get("asteroids", count)
    if isinstance(asteroids, bool) or not isinstance(asteroids, int | float) or not asteroids > 0:
        raise InvalidInput("asteroids", asteroids, "a positive number")
    for key in ("a", "e", "i"):
        if key not in law:
            raise InvalidInput(
                key, "(missing)", 'a distribution such as { kind = "uniform", low = 1, high = 2 }'
            )
    elements = [distribution_of(key, law[key]) for key in ("a", "e", "i")]
    low, high = _perihelion(law.get("perihelion", [0.0, np.inf]))
    rng = np.random.default_rng(seed)
    kept, tried = np.empty((0, 3)), 0
    while len(kept) < count:
        if tried > _TRIES * count:
            raise InvalidInput("perihelion", [low, high], "limits that the distributions of a and e reach")
        drawn = np.column_stack([_quantile(d, rng.random(count)) for d in elements])
        q = drawn[:, 0] * (1.0 - drawn[:, 1])
        kept = np.concatenate([kept, drawn[(q >= low) & (q <= high)]])
        tried += count
    kept = kept[:count]
    table = QTable({"a": kept[:, 0] * u.au, "e": kept[:, 1], "i": kept[:, 2] * u.deg})
    if "H" in law:
        table["H"] = _magnitudes(law["H"], rng.random(count))
    table["weight"] = np.full(count, float(asteroids) / count)
    return table


def _quantile(distribution: Distribution, x: Array) -> Array:
    if distribution.kind in ("catalogue", "lightcurves"):
        raise InvalidInput("kind", distribution.kind, "a distribution with parameters")
    return distribution.quantile(x)


def _perihelion(limits: Iterable[float]) -> tuple[float, float]:
    try:
        low, high = (float(x) for x in limits)
    except (TypeError, ValueError):
        raise InvalidInput("perihelion", limits, "two limits in au") from None
    if not 0.0 <= low < high:
        raise InvalidInput("perihelion", limits, "two limits in au, the smaller one first")
    return low, high


def _magnitudes(law: object, x: Array) -> Array:
    """Absolute magnitudes with ``N(< H) ~ 10^(slope H)`` between two limits, or of a distribution with a kind."""
    if not isinstance(law, Mapping) or "slope" not in law:
        return _quantile(distribution_of("H", law), x)
    try:
        slope, low, high = (float(law[key]) for key in ("slope", "low", "high"))
    except (KeyError, TypeError, ValueError):
        raise InvalidInput("H", dict(law), "slope, low and high, numbers") from None
    if not (slope > 0.0 and low < high):
        raise InvalidInput("H", dict(law), "a positive slope, and low below high")
    first, last = 1.0, 10.0 ** (slope * (high - low))
    return low + np.log10(first + x * (last - first)) / slope
