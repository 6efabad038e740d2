"""JPL Small-Body Database: tables of the query tool and API (CSV and JSON).

Columns: https://ssd-api.jpl.nasa.gov/doc/sbdb_query.html. Elements are heliocentric, J2000 ecliptic, TDB. Any set of
columns that defines an orbit and names the object can be read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import date
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import is_comet, name_columns, names_of
from flybystab.catalogues.readers import FRAME, Contents, header_of, reader, rows_of
from flybystab.catalogues.readers.arcs import arc_columns
from flybystab.catalogues.readers.conversion import MJD, axis_of, number, perihelion_row, since_perihelion
from flybystab.catalogues.readers.covariances import (
    covariance_of,
    printed_covariance,
    printed_sigmas,
    sigmas_of,
)
from flybystab.catalogues.readers.nongravitational import nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.orbit.covariance import DIGITS

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance

_ELEMENTS = {
    "a": "a_au",
    "e": "e",
    "i": "i_deg",
    "om": "node_deg",
    "w": "peri_deg",
    "ma": "M_deg",
}
_COMETARY = ("q", "e", "i", "om", "w", "tp")
_SIGMAS = {f"sigma_{c}": f"sigma_{mine}" for c, mine in _ELEMENTS.items()}
_PARAMETERS = ("A1", "A2", "A3", "DT", "AMRAT")
_SBDB = {
    "class": "orbit_class",
    "H": "H_mag",
    "epoch": "epoch_jd_tdb",
    "rot_per": "spin_period_h",
    "orbit_id": "orbit_solution",
    "condition_code": "condition_code",
    **_ELEMENTS,
    **_SIGMAS,
}
_NAMES = {"a": "a", "e": "e", "i": "i", "om": "node", "w": "peri", "ma": "M", "q": "q", "tp": "tp"}
#: Columns in capitals that are not parameters of the force model.
_OTHER = frozenset({"H", "G", "M1", "M2", "K1", "K2", "PC", "GM", "BV", "UB", "IR", "UV"})
#: Texts that denote missing values, in lower case, as written by pandas and other programs.
_NOTHING = frozenset({"null", "none", "nan", "n/a", "--"})
#: Columns that identify a table of JPL.
_JPL = frozenset(
    {"om", "w", "ma", "tp", "pdes", "full_name", "spkid", "epoch_mjd", "epoch_cal", "moid", "per_y"}
)
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
#: Classes of comets in the SBDB.
_COMETS = frozenset({"COM", "CTc", "ETc", "HTC", "HYP", "JFC", "JFc", "PAR"})


def comet_orbit(orbit_class: str, key: str) -> bool:
    """Whether an object is a comet by its class or designation, so that A1, A2, A3 follow the law of comets."""
    return orbit_class in _COMETS or is_comet(key)


def from_sbdb(row: Mapping[str, str], file: str) -> dict[str, str]:
    """Convert a row of a query (column names of the API) to a catalogue row.

    Raises
    ------
    InvalidInput
        The row has parameters that are not modelled, or an element is not a number.
    """
    row = completed(row, file)
    check_frame(row.get("equinox"), file)
    out = {mine: row[theirs] for theirs, mine in _SBDB.items() if row.get(theirs) and theirs not in _ELEMENTS}
    _check(row, file)
    full = row.get("full_name", "").strip()
    key = row.get("pdes", "").strip() or _key_of(full, row.get("spkid", "") or row.get("id", ""))
    comet = comet_orbit(row.get("class", ""), key) or row.get("prefix", "").strip() in (
        "C",
        "P",
        "D",
        "X",
        "I",
    )
    out |= _elements(row, file)
    law = "comet" if comet else "asteroid"  # a query does not list the constants of the law
    out |= nongravitational_columns({c: row[c] for c in _PARAMETERS if row.get(c)}, comet, file, law=law)
    out |= _names(row, full, key)
    out |= arc_columns(row.get("first_obs"), row.get("last_obs"))
    out["pha"] = {"True": "Y", "False": "N"}.get(row.get("pha", ""), row.get("pha", ""))
    taxonomy = row.get("spec_B") or row.get("spec_T")
    if taxonomy:
        out["taxonomic_class"] = taxonomy
    if row.get("diameter"):
        out["diameter_m"] = thousandfold(row["diameter"], "diameter", file)
        if row.get("diameter_sigma"):
            out["diameter_sigma_m"] = thousandfold(row["diameter_sigma"], "diameter_sigma", file)
    out["condition_code"] = out.get("condition_code", "") if out.get("condition_code", "").isdigit() else ""
    return out | {"frame": FRAME, "orbit_source": f"JPL SBDB ({file})"}


def _names(row: Mapping[str, str], full: str, key: str) -> dict[str, str]:
    if comet_orbit(row.get("class", ""), key) and (full or is_comet(key)):
        return name_columns(full or key)  # the name alone is ambiguous: many comets are called SOHO or LINEAR
    designation = full.partition("(")[2].rstrip(") ") if "(" in full else ""
    known = names_of(key)
    out = {"number": key if key.isdigit() else ""}
    out["designation"] = designation or (known[1] if key.isdigit() else key)
    out["name"] = row.get("name", "").strip() or known[0] or out["designation"] or key
    return out


def _check(row: Mapping[str, str], file: str) -> None:
    """Raise InvalidInput for parameters that are not modelled: capitalised columns without another known meaning."""
    given = {c.removesuffix("_sigma").removesuffix("_kind") for c in row if row[c] and c not in _OTHER}
    check_parameters("JPL", sorted(c for c in given if looks_like_parameter(c) and c not in _OTHER), file)


def _key_of(full: str, spkid: str) -> str:
    """Number or designation from the full name, or from the identifier of a numbered asteroid (20000000 + n)."""
    if full:
        bare = full.strip("() ")
        first = bare.split()[0].strip("()") if bare else ""
        return first if first.isdigit() and not re.match(r"\d{4} ([A-Z]{2}|P-L|T-)", bare) else bare
    text = spkid.lstrip("abcdefghijklmnopqrstuvwxyz")  # the column id is a0000433
    n = int(text) if text.isdigit() else 0
    if text != spkid:
        return str(n) if n else spkid
    return str(n - 20000000 if n > 20000000 else n - 2000000) if n > 2000000 else spkid


def _significant(text: str) -> int:
    """Significant digits of a printed number."""
    digits = text.lower().partition("e")[0].replace(".", "").replace("-", "").lstrip("+0")
    return max(len(digits), 1)


def _calendar(text: str, name: str, file: str) -> str:
    """Julian date of ``20220809.0`` or ``2022-Aug-09.0``, with the same number of decimals."""
    plain = text.strip()
    for month, word in enumerate(_MONTHS, start=1):
        plain = plain.replace(f"-{word}-", f"-{month:02d}-")
    whole, _, fraction = plain.replace("-", "").partition(".")
    try:
        day = date(int(whole[:-4]), int(whole[-4:-2]), int(whole[-2:])).toordinal() + 1721424
    except ValueError:
        raise InvalidInput(name, text, f"a date as 20220809.0 in {file}") from None
    half = float(f"0.{fraction or 0}") + 0.5
    return f"{day + half:.{max(len(fraction), 1)}f}"


def completed(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row with epoch, e, and a or q, derived from other JPL columns if necessary, with as many digits as these.

    Raises
    ------
    InvalidInput
        A date or a number cannot be read.
    """
    out = dict(row)

    def given(*names: str) -> bool:
        return all(out.get(c) for c in names)

    def put(name: str, value: float, *sources: str) -> None:
        digits = min(_significant(out[c]) for c in sources)
        out[name] = f"{value:.{max(digits, 1)}g}"

    def values(*names: str) -> list[float]:
        return [number(out[c], c, file) for c in names]

    if given("epoch", "epoch_mjd") and abs(values("epoch")[0] - MJD - values("epoch_mjd")[0]) > 1e-6:
        raise InvalidInput(
            "epoch_mjd", out["epoch_mjd"], f"the same time as epoch = {out['epoch']} in {file}"
        )
    if not given("epoch") and given("epoch_mjd"):
        fraction = out["epoch_mjd"].partition(".")[2]
        out["epoch"] = f"{values('epoch_mjd')[0] + MJD:.{max(len(fraction), 1)}f}"
    for name in ("epoch", "tp"):
        if not given(name) and given(f"{name}_cal"):
            out[name] = _calendar(out[f"{name}_cal"], f"{name}_cal", file)
    if given("e", "ad") and not (given("a") or given("q")):
        ad, e = values("ad", "e")
        put("a", ad / (1.0 + e), "ad")
    if not given("e"):
        for inner, outer in (("q", "ad"), ("q", "a"), ("a", "ad")):
            if given(inner, outer):
                x, y = values(inner, outer)
                e = {"q,ad": (y - x) / (y + x), "q,a": 1.0 - x / y, "a,ad": y / x - 1.0}[f"{inner},{outer}"]
                put("e", e, inner, outer)
                break
    if not (given("a") or given("q")):
        motion = values("n")[0] if given("n") else 360.0 / values("per")[0] if given("per") else 0.0
        motion = motion or (360.0 / (values("per_y")[0] * 365.25) if given("per_y") else 0.0)
        if motion:
            source = next(c for c in ("n", "per", "per_y") if given(c))
            put("a", axis_of(motion), source)
    return out


def _keplerian(row: Mapping[str, str]) -> bool:
    return bool(row.get("a") and row.get("ma"))


def _elements(row: Mapping[str, str], file: str) -> dict[str, str]:
    """Epoch and elements of a completed row."""
    epoch = number(row.get("epoch", ""), "epoch", file)
    if _keplerian(row):
        for c in _ELEMENTS:
            number(row.get(c, ""), c, file)
        return {mine: row[c] for c, mine in _ELEMENTS.items()} | {"epoch_jd_tdb": row["epoch"]}
    e = number(row.get("e", ""), "e", file)
    q = number(row.get("q") or row.get("a", ""), "q or a", file) * (1.0 if row.get("q") else 1.0 - e)
    if row.get("tp"):
        since = epoch - number(row["tp"], "tp", file)
    elif e != 1.0:
        since = since_perihelion(number(row.get("ma", ""), "tp or ma", file), q / (1.0 - e))
    else:
        raise InvalidInput("tp", row.get("tp"), f"the time of perihelion of a parabola in {file}")
    angles = [number(row.get(c, ""), c, file) for c in ("i", "om", "w")]
    return perihelion_row(epoch, (q, e, *angles), since)


def _covariance(row: Mapping[str, str], file: str) -> Covariance | None:
    """Covariance from values without columns in a catalogue: 1-sigmas of q, tp, A1, A2, A3, DT, and printed digits.

    Rounding errors of the printed digits (four by default in the query tool) are added in quadrature to the 1-sigmas.
    """
    pushes = [c for c in _PARAMETERS if row.get(c) and row.get(f"{c}_sigma")]
    keplerian = _keplerian(row)
    hyperbolic = keplerian and number(row["e"], "e", file) > 1.0
    columns = tuple(_ELEMENTS) if keplerian else _COMETARY
    if not all(row.get(c) for c in columns):
        return None
    jd = number(row["epoch"], "epoch", file)
    texts = [row[c] for c in columns]
    names = [_NAMES[c] for c in columns]
    given = [row.get(f"sigma_{c}", "") for c in columns]
    known = all(given) and sigmas_of(given, columns, file) is not None
    source = f"JPL SBDB ({file})"
    digits = printed_covariance(jd, names, texts, jd, source)
    if not known and not pushes:  # ellipses: estimated in flybystab.catalogues.orbit_errors from U and digits
        return None if keplerian and not hyperbolic else digits
    if keplerian and not pushes and digits is None:
        return None
    values = [number(t, c, file) - (jd if c == "tp" else 0.0) for c, t in zip(columns, texts, strict=True)]
    sigma = np.array([number(s, "sigma", file) if s else 0.0 for s in given])
    if digits is not None or not known:
        sigma = np.hypot(sigma, printed_sigmas(names, texts))
    values += [number(row[c], c, file) for c in pushes]
    sigma = np.array([*sigma, *(number(row[f"{c}_sigma"], f"{c}_sigma", file) for c in pushes)])
    if np.any(sigma < 0.0):
        raise InvalidInput("1-sigmas", sigma.tolist(), f"values of zero or more in {file}")
    what = "1-sigmas" if digits is None else "printed digits and 1-sigmas"
    label = f"{what} without correlations, {source}"
    found = covariance_of(jd, [*names, *pushes], values, np.diag(sigma**2), label, file, correlated=False)
    if not known:  # 1-sigmas of A1, A2, A3 alone do not constrain the elements
        return replace(found, caveat=DIGITS)
    return found if digits is None else replace(found, caveat="by the digits and 1-sigmas of its elements")


def check_frame(equinox: object, file: str) -> None:
    """Raise InvalidInput for elements that do not refer to J2000."""
    if equinox not in (None, "", "J2000"):
        raise InvalidInput("equinox", equinox, f"J2000 in {file}")


def thousandfold(text: str, name: str, file: str) -> str:
    """A printed number multiplied by 1000: km in m, g/cm3 in kg/m3."""
    return f"{1000.0 * number(text, name, file):.10g}"


def _missing(columns: set[str]) -> list[str]:
    """Missing columns without which the rows of a query do not define an orbit and the name of its object."""
    pair = len({"a", "q", "ad"} & columns) >= 2
    out = [c for c in ("e", "i", "om", "w") if c not in columns and not (c == "e" and pair)]
    for either in (
        ("epoch", "epoch_mjd", "epoch_cal"),
        ("a", "q", "ad", "n", "per", "per_y"),
        ("ma", "tp", "tp_cal"),
        ("full_name", "pdes", "spkid", "name", "id"),
    ):
        if not {*either} & columns:
            out.append(" or ".join(either))
    return out


def _is_query(text: str) -> bool:
    columns = set(header_of(text))
    return len(columns & _JPL) >= 2 and "a_au" not in columns and "FORMAT" not in columns


def _entries(rows: list[dict[str, str]], columns: set[str], file: str) -> list[Entry]:
    missing = _missing(columns)
    if missing:
        raise InvalidInput(
            "columns", "a JPL query without " + ", ".join(missing), f"columns that define an orbit in {file}"
        )
    rows = [{c: "" if v.lower() in _NOTHING else v for c, v in row.items()} for row in rows]
    whole = [completed(row, file) for row in rows]
    return [(from_sbdb(row, file), _covariance(row, file)) for row in whole]


@reader(
    "SBDB query (CSV)",
    _is_query,
    Contents(
        "a or q, M or Tp; epoch in JD or MJD",
        "1-sigmas, else printed digits and U",
        "A1, A2, A3, DT with 1-sigmas",
        "H, diameter, rotation period, taxonomic class",
    ),
)
def read_query(text: str, file: str) -> list[Entry]:
    """Rows of a query saved as CSV.

    Raises
    ------
    InvalidInput
        Columns that define an orbit are missing, or a value cannot be read.
    """
    return _entries(rows_of(text, file), set(header_of(text)), file)


def _is_query_json(text: str) -> bool:
    return text.lstrip().startswith("{") and '"fields"' in text and '"data"' in text


@reader(
    "SBDB query (JSON)",
    _is_query_json,
    Contents(
        "a or q, M or Tp; epoch in JD or MJD",
        "1-sigmas, else printed digits and U",
        "A1, A2, A3, DT with 1-sigmas",
        "H, diameter, rotation period, taxonomic class",
    ),
)
def read_query_json(text: str, file: str) -> list[Entry]:
    """Rows of an answer of the query API.

    Raises
    ------
    InvalidInput
    """
    answer = parse_json(text, "catalogue file", file)
    try:
        fields = [str(f) for f in answer["fields"]]
        rows = [
            {f: "" if v is None else str(v) for f, v in zip(fields, row, strict=True)}
            for row in answer["data"]
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidInput("orbit file", file, f"an answer of the SBDB query API ({error})") from None
    return _entries(rows, set(fields), file)
