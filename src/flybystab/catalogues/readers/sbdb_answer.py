"""Answers of the JPL Small-Body Database for one object (JSON), with covariance and physical parameters.

Fields: https://ssd-api.jpl.nasa.gov/doc/sbdb.html (``full-prec=1``, ``cov=mat``, ``phys-par=1``). Covariances are those
of e, q, tp, node, peri, i and estimated parameters, in au, days and degrees, at an epoch of their own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import FRAME, Contents, reader
from flybystab.catalogues.readers.arcs import arc_columns
from flybystab.catalogues.readers.conversion import (
    COLUMN_OF,
    KEPLERIAN,
    equatorial_to_ecliptic,
    julian,
    number,
    perihelion_row,
)
from flybystab.catalogues.readers.covariances import covariance_of, printed_covariance, sigmas_of
from flybystab.catalogues.readers.nongravitational import COLUMN_OF_PARAMETER, nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters
from flybystab.catalogues.readers.sbdb import check_frame, comet_orbit, thousandfold
from flybystab.constants import G
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance

_COLUMNS = dict(zip(("a", "e", "i", "om", "w", "ma"), COLUMN_OF.values(), strict=True))
_LABELS = {"om": "node", "w": "peri"}
#: Units of the physical parameters of the SBDB.
_UNITS = {
    "diameter": "km", "extent": "km", "rot_per": "h", "density": "g/cm^3", "GM": "km^3/s^2", "pole": "deg",
}  # fmt: skip


def from_sbdb_answer(text: str, file: str) -> tuple[dict[str, str], Covariance | None]:
    """The orbit in an answer.

    Returns
    -------
    dict
        Catalogue row with the elements at their epoch.
    Covariance or None
        Covariance at its own epoch, about the elements given for that epoch.

    Raises
    ------
    InvalidInput
    """
    try:
        record: Document = parse_json(text, "orbit file", file)
        orbit, thing = record["orbit"], record["object"]
        elements = {item["name"]: item for item in orbit["elements"]}
        model = {p["name"]: p for p in orbit.get("model_pars") or [] if p["value"] is not None}
        full, key = str(thing["fullname"]), str(thing["des"])
        orbit_class = (thing.get("orbit_class") or {}).get("code", "")
        row = _elements(orbit, elements, file)
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput(
            "orbit file", file, f"an answer of the SBDB API with full precision ({error})"
        ) from None
    check_parameters("JPL", model, file)
    check_frame(orbit.get("equinox"), file)
    comet = comet_orbit(orbit_class, key)
    row |= name_columns(full) if comet else _names(full, key)
    row["orbit_class"] = orbit_class
    row["pha"] = {True: "Y", False: "N"}.get(thing.get("pha"), "")
    row |= physical(record.get("phys_par") or [], file)
    solution = str(orbit.get("orbit_id", ""))
    row |= {"frame": FRAME, "orbit_solution": f"JPL {solution}", "orbit_source": f"JPL SBDB ({file})"}
    row |= arc_columns(orbit.get("first_obs"), orbit.get("last_obs"))
    row["condition_code"] = str(orbit.get("condition_code") or "")
    pushes = {name: p for name, p in model.items() if name in COLUMN_OF_PARAMETER}
    row |= nongravitational_columns({name: p["value"] for name, p in model.items()}, comet, file)
    covariance = _covariance(orbit, pushes, f"JPL SBDB, solution {solution} ({file})", file)
    return row, _with_digits(row, covariance)


def _with_digits(row: Mapping[str, str], covariance: Covariance | None) -> Covariance | None:
    """The covariance from printed digits if it exceeds the given one, as in answers without ``full-prec=1``."""
    if not all(row.get(c) for c in _COLUMNS.values()):
        return covariance
    texts = [row[c] for c in _COLUMNS.values()]
    digits = printed_covariance(float(row["epoch_jd_tdb"]), KEPLERIAN, texts, 0.0, row["orbit_source"])
    if digits is None or covariance is None:
        return covariance
    states, _ = covariance.deviations(covariance.values + covariance.factor.T)
    if np.linalg.norm(states[:, :3]) > np.linalg.norm(digits.sigma[:3]):
        return covariance
    return replace(digits, caveat="by the digits of its elements, which exceed the published errors")


def _names(full: str, key: str) -> dict[str, str]:
    designation = full.partition("(")[2].rstrip(") ")
    out = {"number": key if key.isdigit() else ""}
    out["designation"] = designation or ("" if key.isdigit() else key)
    name = full.partition("(")[0].strip()
    out["name"] = name.removeprefix(key).strip() if key.isdigit() else out["designation"]
    out["name"] = out["name"] or out["designation"] or key
    return out


def _elements(orbit: Document, elements: Document, file: str) -> dict[str, str]:
    """Columns of the elements: a and M, or q and tp if these are missing (parabolas)."""
    epoch = str(orbit["epoch"])
    if all((elements.get(c) or {}).get("value") not in (None, "") for c in ("a", "ma")):
        for c in _COLUMNS:
            number(elements[c]["value"], c, file)
        row = {mine: str(elements[c]["value"]) for c, mine in _COLUMNS.items()} | {"epoch_jd_tdb": epoch}
        row |= {
            f"sigma_{mine}": str(elements[c]["sigma"])
            for c, mine in _COLUMNS.items()
            if elements[c].get("sigma")
        }
        return row
    values = [number(elements[c]["value"], c, file) for c in ("q", "e", "i", "om", "w")]
    jd = number(epoch, "epoch", file)
    return perihelion_row(jd, values, jd - number(elements["tp"]["value"], "tp", file))


def physical(items: Sequence[Document], file: str) -> dict[str, str]:
    """Catalogue columns for a list of physical parameters, each with its source.

    Raises
    ------
    InvalidInput
        A value is not a number, or has a unit other than that of the SBDB.
    """
    given = {str(p.get("name")): p for p in items if p.get("value") not in (None, "")}
    for name, unit in _UNITS.items():
        stated = (given.get(name) or {}).get("units")
        if stated not in (None, "", unit):
            raise InvalidInput(f"unit of {name}", stated, f"{unit} in {file}")

    def source(name: str) -> str:
        return f"JPL SBDB: {str(given[name].get('ref') or 'no reference').strip()}"

    out = {}
    if "H" in given:
        out["H_mag"] = str(given["H"]["value"])
    if "rot_per" in given:
        out |= {"spin_period_h": str(given["rot_per"]["value"]), "spin_source": source("rot_per")}
        if given["rot_per"].get("sigma"):
            out["spin_period_sigma_h"] = str(given["rot_per"]["sigma"])
    if "diameter" in given:
        out["diameter_m"] = thousandfold(str(given["diameter"]["value"]), "diameter", file)
        out["diameter_source"] = source("diameter")
        if given["diameter"].get("sigma"):
            out["diameter_sigma_m"] = thousandfold(str(given["diameter"]["sigma"]), "diameter", file)
    if "density" in given:
        out["density_kg_m3"] = thousandfold(str(given["density"]["value"]), "density", file)
        out["density_source"] = source("density")
        if given["density"].get("sigma"):
            out["density_sigma_kg_m3"] = thousandfold(str(given["density"]["sigma"]), "density", file)
    extent = [float(x) for x in re.findall(r"\d*\.?\d+", str((given.get("extent") or {}).get("value", "")))]
    if len(extent) == 3:
        axes = sorted(extent, reverse=True)
        out |= {f"semi_axis_{c}_m": f"{500.0 * x:.10g}" for c, x in zip("abc", axes, strict=True)}
        out["semi_axes_source"] = source("extent")
    size = "extent" if len(extent) == 3 else "diameter" if "diameter" in given else ""
    if "GM" in given and "density" not in given and size:
        cubed = np.prod(extent) if size == "extent" else number(given["diameter"]["value"], size, file) ** 3
        # GM in km3/s2 and lengths in km: the factors 1e9 cancel.
        density = number(given["GM"]["value"], "GM", file) / G / (np.pi / 6.0 * float(cubed))
        out |= {"density_kg_m3": f"{density:.6g}", "density_source": f"{source('GM')}, with {size}"}
    pole = re.fullmatch(
        r"([-+.\d]+)\s*/\s*([-+.\d]+)", str((given.get("pole") or {}).get("value", "")).strip()
    )
    if pole:  # right ascension and declination
        longitude, latitude = equatorial_to_ecliptic(float(pole[1]), float(pole[2]))
        out |= {"pole_ecl_lon_deg": f"{longitude:.6g}", "pole_ecl_lat_deg": f"{latitude:.6g}"}
        out["pole_source"] = source("pole")
    return out


def _covariance(orbit: Document, pushes: Document, source: str, file: str) -> Covariance | None:
    found = orbit.get("covariance")
    if not found:
        return _uncorrelated(orbit, pushes, source, file)
    try:
        names = [_LABELS.get(str(n), str(n)) for n in found["labels"]]
        epoch = float(found["epoch"])
        # JPL repeats the elements only where the epoch of the covariance is not that of the orbit.
        own = orbit["elements"] if epoch == float(orbit["epoch"]) else None
        if own is None and "elements" not in found:
            raise KeyError("elements at the epoch of the covariance")
        mean = {_LABELS.get(e["name"], e["name"]): str(e["value"]) for e in found.get("elements", own)}
        mean |= {name: str(p["value"]) for name, p in pushes.items()}
        # Subtracting whole days first preserves all printed digits of the time of perihelion.
        whole, fraction = julian(mean["tp"])
        values = [(whole - epoch) + fraction if n == "tp" else float(mean[n]) for n in names]
        if not all(isinstance(line, list | tuple | np.ndarray) for line in found["data"]):
            raise InvalidInput("covariance", "a vector", f"a matrix (cov=mat in the query) in {file}")
        matrix = np.array([[float(c) for c in line] for line in found["data"]])
        return covariance_of(epoch, names, values, matrix, source, file)
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(
            "covariance", file, f"labels among e, q, tp, node, peri, i, A1, A2, A3, DT, AMRAT ({error})"
        ) from None


def _uncorrelated(orbit: Document, pushes: Document, source: str, file: str) -> Covariance | None:
    """Covariance from 1-sigmas of elements and parameters; None if not given, or if all have catalogue columns."""
    elements = {item["name"]: item for item in orbit["elements"]}
    with_errors = [n for n, p in pushes.items() if p.get("sigma")]
    use = tuple(_COLUMNS)
    keplerian = all((elements.get(c) or {}).get("value") not in (None, "") for c in use)
    if not keplerian:
        use = ("q", "e", "i", "om", "w", "tp")
    if (keplerian and not with_errors) or not all((elements.get(c) or {}).get("sigma") for c in use):
        return None
    jd = number(orbit["epoch"], "epoch", file)
    labels = {"om": "node", "w": "peri", "ma": "M"}
    values = [number(elements[c]["value"], c, file) - (jd if c == "tp" else 0.0) for c in use]
    values += [number(pushes[n]["value"], n, file) for n in with_errors]
    if sigmas_of([elements[c]["sigma"] for c in use], use, file) is None:
        return None
    texts = [elements[c]["sigma"] for c in use] + [pushes[n]["sigma"] for n in with_errors]
    sigma = sigmas_of(texts, [*use, *with_errors], file)
    assert sigma is not None
    names = [*(labels.get(c, c) for c in use), *with_errors]
    label = f"1-sigmas without correlations, {source}"
    return covariance_of(jd, names, values, np.diag(np.square(sigma)), label, file, correlated=False)


def _is_answer(text: str) -> bool:
    return text.lstrip().startswith("{") and '"orbit"' in text and '"object"' in text and '"fullname"' in text


@reader(
    "SBDB answer",
    _is_answer,
    Contents(
        "a and M, or q and Tp",
        "full matrix, at the epoch of the orbit or its own; else 1-sigmas",
        "A1, A2, A3, their law, DT, AMRAT",
        "H, diameter, extent, density (or GM), pole, rotation period",
    ),
)
def read_answer(text: str, file: str) -> list[Entry]:
    """The orbit in an answer for one object."""
    return [from_sbdb_answer(text, file)]
