"""The embedded catalogue of near-Earth asteroids, and files of the same or other known forms."""

from __future__ import annotations

import csv
import gzip
import io
import zlib
from collections.abc import Sequence
from difflib import get_close_matches
from functools import lru_cache
from importlib import resources
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.catalogues.asteroid import CATALOGUE_DATE, Asteroid
from flybystab.catalogues.formats import from_mpc, from_neocc, from_sbdb, from_sbdb_answer, kind_of
from flybystab.catalogues.record import TEXTS, UNITS, key_of
from flybystab.errors import InvalidInput, UnknownName

__all__ = ["CATALOGUE_DATE", "TEXTS", "UNITS", "Asteroid", "catalogue", "catalogue_table", "find", "key_of"]


def find(asteroids: Sequence[Asteroid], name: str | int, where: str) -> Asteroid:
    """The asteroid with this name, or UnknownName with near matches."""
    index: dict[str, Asteroid] = {}
    for a in asteroids:
        for n in a.names:
            index.setdefault(key_of(n), a)
    wanted = key_of(name)
    if wanted in index:
        return index[wanted]
    near = get_close_matches(wanted, index, n=8, cutoff=0.6)
    near += [k for k in index if len(wanted) >= 3 and wanted in k]
    suggestions = list(dict.fromkeys(index[k].name for k in near))[:5]
    known = f"({where} has {len(asteroids)}"
    known += "; others are read from a file)" if where == "the embedded catalogue" else ")"
    raise UnknownName("asteroid", str(name), suggestions, known)


def _read(text: str, file: str) -> tuple[Asteroid, ...]:
    """Asteroids of a CSV text."""
    reader = csv.DictReader(io.StringIO(text, newline=""))
    columns = list(reader.fieldnames or [])
    kind = kind_of(columns)
    for c in columns if not kind else ():
        if c not in UNITS and c not in TEXTS:
            known = [*TEXTS, *UNITS]
            if ";" in c or "\t" in c:
                raise InvalidInput("columns", c, f"commas between the columns of {file}")
            raise UnknownName("column", c, get_close_matches(c, known, cutoff=0.6), f"(in {file})")
    if not kind and not {"name", "designation", "number"} & set(columns):
        raise InvalidInput("columns", columns, f"at least one of name, designation, number in {file}")
    out = []
    for line, row in enumerate(reader, start=2):
        if None in row or None in row.values():
            raise InvalidInput("row", f"line {line} of {file}", f"{len(columns)} cells, as in the header")
        stripped = {k: v.strip() for k, v in row.items()}
        if kind:
            stripped = (from_sbdb if kind == "sbdb" else from_mpc)(stripped, file)
        out.append(Asteroid(stripped, file=file))
    return tuple(out)


@lru_cache(maxsize=1)
def _embedded() -> tuple[Asteroid, ...]:
    text = resources.files("flybystab.data").joinpath("asteroids.csv").read_text(encoding="utf-8")
    return _read(text, f"embedded catalogue {CATALOGUE_DATE}")


def catalogue(path: str | Path | None = None) -> tuple[Asteroid, ...]:
    """All asteroids of the embedded catalogue, or of a file, in their order.

    A file has the catalogue's columns, or those of a JPL SBDB query or of an MPC table
    (:mod:`flybystab.catalogues.formats`), and may be gzipped; or it is one orbit with its
    covariance, of NEOCC (``.ke1``) or of the SBDB API (``.json``). It needs only
    the columns that are used: a name, ``epoch_jd_tdb, a_au, e, i_deg, node_deg, peri_deg, M_deg`` for orbits,
    ``semi_axis_{a,b,c}_m, density_kg_m3, spin_period_h`` for bodies.

    Raises
    ------
    InvalidInput
        The file cannot be read or a row has the wrong number of cells.
    UnknownName
        A column is not one of the catalogue's.
    """
    if path is None:
        return _embedded()
    try:
        raw = Path(path).read_bytes()
        text = (gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw).decode("utf-8-sig")
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise InvalidInput("catalogue file", path, f"a readable CSV file ({error})") from None
    one = {".ke1": from_neocc, ".json": from_sbdb_answer}.get(Path(path).suffix)
    if one is not None:
        row, covariance = one(text, Path(path).name)
        return (Asteroid(row, file=str(path), covariance=covariance),)
    return _read(text, str(path))


def catalogue_table(path: str | Path | None = None) -> QTable:
    """The catalogue as a table with units; nan where a number is not known.

    Returns
    -------
    QTable
        One row per asteroid and the columns of the file; ``meta`` says what it is.
    """
    asteroids = catalogue(path)
    table = QTable()
    for c in (*TEXTS, *UNITS):
        if c in UNITS:
            values = np.array([a._number(c) if a.row.get(c) else np.nan for a in asteroids])
            table[c] = values * UNITS[c] if UNITS[c] != u.dimensionless_unscaled else values
        else:
            table[c] = np.array([a.row.get(c, "") for a in asteroids], dtype=str)
    table.meta = {
        "title": "near-Earth asteroids: bodies and orbits",
        "file": asteroids[0].file if asteroids else str(path),
        "frame": "heliocentric, ecliptic J2000; poles ecliptic J2000",
        "time_scale": "TDB",
    }
    return table
