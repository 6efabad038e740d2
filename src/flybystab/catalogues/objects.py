"""Asteroids from objects of astroquery and sbpy; neither package is required.

- ``astroquery.jplsbdb.SBDB.query(..., full_precision=True, covariance="mat", phys=True)``: a mapping;
- ``astroquery.jplhorizons.Horizons(..., location="@10").elements()``: a table;
- ``astroquery.mpc.MPC.query_object(...)``: a list of mappings;
- tables with the columns of a JPL query; ``sbpy.data.Orbit``, with ``sbpy.data.Phys`` for the body.

Mappings and lists are passed to the readers of the JSON files with the same content.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from astropy.units import Quantity

from flybystab.catalogues.readers import FRAME, READERS
from flybystab.catalogues.readers.element_table import entries_of
from flybystab.errors import InvalidInput
from flybystab.typing import Document

if TYPE_CHECKING:
    from astropy.table import Table

    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.catalogues.readers import Entry

_FILE = "object"


def asteroids_of(orbit: object, phys: object = None) -> tuple[Asteroid, ...]:
    """Asteroids of an object of astroquery or sbpy.

    Parameters
    ----------
    orbit : mapping, list of mappings, Table or sbpy.data.Orbit
        As listed in :mod:`flybystab.catalogues.objects`.
    phys : sbpy.data.Phys, Table or mapping, optional
        Physical parameters with units: H, diameter, density, rot_per, extent, pole; one row, or one for each orbit.

    Raises
    ------
    InvalidInput
        The object has another type, or its content is invalid.
    """
    from flybystab.catalogues.asteroid import Asteroid

    found = [
        Asteroid(
            {"frame": FRAME, "orbit_source": f"object ({_FILE})"} | row, file=_FILE, covariance=covariance
        )
        for row, covariance in _entries(orbit)
    ]
    if phys is None:
        return tuple(found)
    bodies = _physical_rows(phys)
    if len(bodies) not in (1, len(found)):
        raise InvalidInput("phys", len(bodies), f"one row, or one for each of {len(found)} orbits")
    bodies = bodies * len(found) if len(bodies) == 1 else bodies
    return tuple(replace(a, row=dict(a.row) | body) for a, body in zip(found, bodies, strict=True))


def _entries(given: object) -> list[Entry]:
    from astropy.table import Table

    table = getattr(given, "table", given)
    if isinstance(table, Table):
        if {"om", "w"} <= set(table.colnames):
            return _read(_csv(table))
        return entries_of(table, _FILE)
    if isinstance(given, Mapping):
        return _read(json.dumps(_answer(dict(given)) if "orbit" in given else given, default=_plain))
    if (
        isinstance(given, Sequence)
        and not isinstance(given, str)
        and all(isinstance(x, Mapping) for x in given)
    ):
        return _read(json.dumps([*given], default=_plain))
    raise InvalidInput("catalogue", given, "a path, or an object of astroquery or sbpy with elements")


def _read(text: str) -> list[Entry]:
    found = READERS.of(text)
    if found is None:
        raise InvalidInput(
            "catalogue", text[:60], "an object with elements: SBDB, MPC or Horizons of astroquery"
        )
    return found.read(text, _FILE)


def _csv(table: Table) -> str:
    import csv
    import io

    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(table.colnames)
    for row in table:
        cells = (getattr(row[c], "value", row[c]) for c in table.colnames)
        writer.writerow(["" if str(x) in ("--", "nan", "None") else str(x) for x in cells])
    return out.getvalue()


def _plain(value: object) -> object:
    """Value of a Quantity, array or numpy scalar as a number or list for JSON."""
    if isinstance(value, Quantity):
        value = value.value
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _items(values: Mapping[str, object]) -> list[Document]:
    """Values with their ``_sig`` and ``_ref`` as a list of items as in answers of JPL's API."""
    out = []
    for name, value in values.items():
        if name.endswith(("_sig", "_ref", "_note", "_kind")) or value is None:
            continue
        item = {"name": name, "value": _printed(value), "ref": values.get(f"{name}_ref")}
        sigma = values.get(f"{name}_sig")
        item["sigma"] = None if sigma is None or str(sigma) == "None" else _printed(sigma)
        out.append(item)
    return out


def _printed(value: object) -> str:
    plain = _plain(value) if hasattr(value, "to_value") or hasattr(value, "tolist") else value
    return repr(plain) if isinstance(plain, float) else str(plain)


def _answer(given: Document) -> Document:
    """The mapping made by astroquery converted back to the answer of the SBDB API."""
    orbit = dict(given["orbit"])
    if isinstance(orbit.get("elements"), list):
        return dict(given)
    orbit["elements"] = _items(orbit.get("elements") or {})
    orbit["model_pars"] = _items(orbit.get("model_pars") or {})
    orbit["epoch"] = _printed(orbit.get("epoch"))
    covariance = orbit.get("covariance")
    if covariance:
        covariance = dict(covariance)
        covariance["epoch"] = _printed(covariance["epoch"])
        elements = covariance.get("elements")
        if isinstance(elements, Mapping):
            covariance["elements"] = _items(elements)
        orbit["covariance"] = covariance
    return dict(given) | {"orbit": orbit, "phys_par": _items(given.get("phys_par") or {})}


#: Units of the physical parameters of the SBDB, and their names in sbpy.
_PHYSICAL = {"H": "mag", "diameter": "km", "rot_per": "h", "density": "g/cm3", "extent": "", "pole": ""}
_SBPY = {"absmag": "H", "d": "diameter", "D": "diameter", "diam": "diameter", "period": "rot_per"}


def _physical_rows(phys: object) -> list[dict[str, str]]:
    """Physical columns of each row of a table or mapping.

    Raises
    ------
    InvalidInput
        A value has no unit.
    """
    from astropy.table import Table

    from flybystab.catalogues.readers.sbdb_answer import physical

    table = getattr(phys, "table", phys)
    if not isinstance(table, Mapping | Table):
        raise InvalidInput("phys", phys, "a mapping or a table of physical parameters, or sbpy.data.Phys")
    rows = [table] if isinstance(table, Mapping) else [{c: row[c] for c in table.colnames} for row in table]
    out = []
    for row in rows:
        items = []
        for name, value in row.items():
            sbdb = _SBPY.get(name, name)
            if sbdb not in _PHYSICAL or str(value) in ("--", "nan", "None"):
                continue
            unit = _PHYSICAL[sbdb]
            if unit and not hasattr(value, "to_value"):
                raise InvalidInput(name, value, f"a quantity in {unit}")
            number = repr(float(value.to_value(unit))) if unit else str(value)
            items.append({"name": sbdb, "value": number, "ref": "object of sbpy"})
        out.append(physical(items, _FILE))
    return out
