"""The embedded catalogue of near-Earth asteroids, and files in its format or any other known format."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches
from functools import lru_cache
from importlib import resources
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.body.body import Material
from flybystab.catalogues.asteroid import CATALOGUE_DATE, Asteroid
from flybystab.catalogues.designations import name_columns, unpacked
from flybystab.catalogues.objects import asteroids_of
from flybystab.catalogues.readers import FRAME, READERS, text_of
from flybystab.catalogues.readers.native import read_native
from flybystab.catalogues.record import TEXTS, UNITS, key_of
from flybystab.errors import UnknownName

__all__ = ["CATALOGUE_DATE", "TEXTS", "UNITS", "Asteroid", "catalogue", "catalogue_table", "find", "key_of"]


def find(asteroids: Sequence[Asteroid], name: str | int, where: str) -> Asteroid:
    """The asteroid with this name; raises UnknownName with near matches if there is none."""
    index: dict[str, Asteroid] = {}
    for a in asteroids:
        for n in a.names:
            index.setdefault(key_of(n), a)
    wanted = key_of(name)
    for other in (
        (wanted, *(key_of(n) for n in _other_names(str(name)))) if wanted not in index else (wanted,)
    ):
        if other in index:
            return index[other]
    near = get_close_matches(wanted, index, n=8, cutoff=0.6)
    near += [k for k in index if len(wanted) >= 3 and wanted in k]
    suggestions = list(dict.fromkeys(index[k].name for k in near))[:5]
    known = f"({where} has {len(asteroids)}"
    known += "; others are read from a file)" if where == "the embedded catalogue" else ")"
    plain = unpacked(str(name).strip())
    shown = f"{name} ({plain})" if plain != str(name).strip() else str(name)
    raise UnknownName("asteroid", shown, suggestions, known)


def _other_names(text: str) -> list[str]:
    """Names in a text such as ``Bennu (101955)``, and the number in a JPL identifier (20101955, a0101955)."""
    parts = name_columns(text)
    found = [parts[c] for c in ("number", "designation", "name") if parts.get(c)]
    if after := re.fullmatch(r"(.*\S)\s*\((\d+)\)", text.strip()):
        found += [after[2]]
    if identifier := re.fullmatch(r"20?(\d{6})|a(\d{7})", text.strip()):
        found += [str(int(identifier[1] or identifier[2]))]
    return found


def _read(text: str, file: str, name: str) -> tuple[Asteroid, ...]:
    """Asteroids of a text, read by the reader of its format."""
    found = READERS.of(text)
    material = Material()  # one for all rows: checking it takes longer than reading a row
    if found is None:
        return tuple(Asteroid(row, material, file) for row, _ in read_native(text, file))
    source = {"frame": FRAME, "orbit_source": f"{found.name} ({name})"}
    return tuple(
        Asteroid(source | row, material, file, covariance) for row, covariance in found.read(text, name)
    )


@lru_cache(maxsize=1)
def _embedded() -> tuple[Asteroid, ...]:
    text = resources.files("flybystab.data").joinpath("asteroids.csv").read_text(encoding="utf-8")
    file = f"embedded catalogue {CATALOGUE_DATE}"
    return tuple(Asteroid(row, file=file) for row, _ in read_native(text, file))


def catalogue(path: object = None) -> tuple[Asteroid, ...]:
    """All asteroids of the embedded catalogue or of a file, in the order of its rows.

    The format of a file is recognised from its content (:mod:`flybystab.catalogues.readers`): the columns of the
    embedded catalogue, or a format of an agency or program (``docs/inputs.md``). Files may be gzipped. Objects of
    astroquery and sbpy are accepted as well (:mod:`flybystab.catalogues.objects`).

    In the format of the embedded catalogue only the columns in use are required: a name,
    ``epoch_jd_tdb, a_au, e, i_deg, node_deg, peri_deg, M_deg`` for orbits,
    ``semi_axis_{a,b,c}_m, density_kg_m3, spin_period_h`` for bodies.

    Raises
    ------
    InvalidInput
        The file cannot be read, or a row has the wrong number of cells.
    UnknownName
        A column has an unknown name.
    """
    if path is None:
        return _embedded()
    if not isinstance(path, str | Path):
        return asteroids_of(path)
    return _read(text_of(path), str(path), Path(path).name)


def catalogue_table(path: str | Path | None = None) -> QTable:
    """The catalogue as a table with units; unknown numbers are nan.

    Returns
    -------
    QTable
        One row per asteroid and one column per property; provenance in ``meta``.
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
