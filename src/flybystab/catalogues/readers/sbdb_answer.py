"""Answers of the JPL SBDB API for one object (JSON)."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flybystab.catalogues.readers.common import FRAME, julian_date, metres
from flybystab.catalogues.readers.registry import Entry, register
from flybystab.catalogues.readers.sbdb_query import COLUMNS
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.orbit.covariance import Covariance


@register("JPL SBDB answer (JSON)", "JPL SBDB", lambda text: text.lstrip()[:1] == "{")
def read(text: str, file: str) -> Iterator[Entry]:
    """The object of an answer."""
    yield from_sbdb_answer(text, Path(file).name)


_SBDB_PHYS = {"H": "H_mag", "rot_per": "spin_period_h"}
_SBDB_NAMES = {"om": "node", "w": "peri"}


def from_sbdb_answer(text: str, file: str) -> tuple[dict[str, str], Covariance | None]:
    """One object's answer of the JPL SBDB API (JSON, with ``cov=mat`` for the covariance).

    Returns
    -------
    dict
        A catalogue row: elements of the answer at their epoch.
    Covariance or None
        At the epoch of its own, around the elements that the answer gives for that epoch; au, days, degrees.

    Raises
    ------
    InvalidInput
    """
    try:
        record: dict[str, Any] = json.loads(text)
        orbit, thing = record["orbit"], record["object"]
        elements = {item["name"]: item for item in orbit["elements"]}
        pushes = {p["name"]: p for p in orbit.get("model_pars") or [] if p["name"] in ("A1", "A2", "A3")}
        row = {mine: str(elements[c]["value"]) for c, mine in COLUMNS.items() if c in elements}
        row |= {
            COLUMNS["sigma_" + c]: str(elements[c]["sigma"])
            for c in ("a", "e", "i", "om", "w", "ma")
            if elements[c].get("sigma")
        }
        row |= {f"{name}_au_d2": str(p["value"]) for name, p in pushes.items()}
        row["epoch_jd_tdb"] = str(orbit["epoch"])
        full = str(thing["fullname"])
        key = str(thing["des"])
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise InvalidInput(
            "orbit file", file, f"an answer of the SBDB API with full precision ({error})"
        ) from None
    _inverse_square(orbit, pushes, file)
    designation = full.partition("(")[2].rstrip(") ")
    row["number"] = key if key.isdigit() else ""
    row["designation"] = designation or ("" if key.isdigit() else key)
    name = full.partition("(")[0].strip()
    row["name"] = name.removeprefix(key).strip() if key.isdigit() else row["designation"]
    row["name"] = row["name"] or row["designation"] or key
    row["orbit_class"] = (thing.get("orbit_class") or {}).get("code", "")
    row["pha"] = {True: "Y", False: "N"}.get(thing.get("pha"), "")
    for item in record.get("phys_par") or []:
        if item["name"] in _SBDB_PHYS and item.get("value"):
            row[_SBDB_PHYS[item["name"]]] = str(item["value"])
        elif item["name"] == "diameter" and item.get("value"):
            row["diameter_m"] = metres(str(item["value"]), "diameter", file)
    solution = str(orbit.get("orbit_id", ""))
    row |= {"frame": FRAME, "orbit_solution": f"JPL {solution}", "orbit_source": f"JPL SBDB ({file})"}
    row["condition_code"] = str(orbit.get("condition_code") or "")
    return row, _sbdb_covariance(orbit, pushes, f"JPL SBDB, solution {solution} ({file})", file)


def _inverse_square(orbit: Mapping[str, Any], pushes: Mapping[str, Any], file: str) -> None:
    """Refuse A1, A2, A3 of another law than an asteroid's: a catalogue row has no column for it."""
    wanted = {"ALN": 1.0, "NK": 0.0, "NM": 2.0, "R0": 1.0}
    given = {p["name"]: float(p["value"]) for p in orbit.get("model_pars") or [] if p["name"] in wanted}
    if pushes and given != wanted:
        raise InvalidInput(
            "A1, A2, A3",
            f"with the law {given or 'of a comet'} in {file}",
            "an acceleration that falls as 1/r2 (a comet: fs.Orbit.from_elements(..., law='comet'))",
        )


def _sbdb_covariance(
    orbit: Mapping[str, Any], pushes: Mapping[str, Any], source: str, file: str
) -> Covariance | None:
    import astropy.units as u
    import numpy as np

    from flybystab.orbit.covariance import Covariance

    found = orbit.get("covariance")
    if not found:
        return None
    unit = {"e": u.dimensionless_unscaled, "q": u.au, "tp": u.d} | dict.fromkeys(("node", "peri", "i"), u.deg)
    unit |= dict.fromkeys(("A1", "A2", "A3"), u.au / u.d**2)
    try:
        names = [_SBDB_NAMES.get(str(n), str(n)) for n in found["labels"]]
        epoch = float(found["epoch"])
        mean = {_SBDB_NAMES.get(e["name"], e["name"]): str(e["value"]) for e in found["elements"]}
        mean |= {name: str(p["value"]) for name, p in pushes.items()}
        # Digits of the time of perihelion are lost neither as a Julian date nor as a difference.
        whole, _, rest = mean["tp"].partition(".")
        values = [float(mean[n]) if n != "tp" else (float(whole) - epoch) + float("0." + rest) for n in names]
        matrix = np.array([[float(c) for c in line] for line in found["data"]])
        units = [unit[n] for n in names]
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput(
            "covariance", file, f"labels out of e, q, tp, node, peri, i, A1, A2, A3 ({error})"
        ) from None
    return Covariance.in_units(julian_date(epoch), names, values, matrix, units, source)
