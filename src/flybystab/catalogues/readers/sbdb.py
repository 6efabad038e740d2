"""JPL Small-Body Database: query tables (CSV, JSON) and single answers (JSON)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from flybystab.catalogues.designations import names_of
from flybystab.catalogues.readers import FRAME, header_of, reader, rows_of
from flybystab.catalogues.readers.parameters import NOT_MODELLED, check_parameters
from flybystab.errors import InvalidInput
from flybystab.files import parse_json

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance

#: Mean motion at 1 au, deg/d (Gauss's constant).
_GAUSS = 0.98560766860142
_SBDB = {
    "class": "orbit_class",
    "H": "H_mag",
    "epoch": "epoch_jd_tdb",
    "a": "a_au",
    "e": "e",
    "i": "i_deg",
    "om": "node_deg",
    "w": "peri_deg",
    "ma": "M_deg",
    "sigma_a": "sigma_a_au",
    "sigma_e": "sigma_e",
    "sigma_i": "sigma_i_deg",
    "sigma_om": "sigma_node_deg",
    "sigma_w": "sigma_peri_deg",
    "sigma_ma": "sigma_M_deg",
    "A1": "A1_au_d2",
    "A2": "A2_au_d2",
    "A3": "A3_au_d2",
    "rot_per": "spin_period_h",
    "orbit_id": "orbit_solution",
    "condition_code": "condition_code",
}


def from_sbdb(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row of a JPL Small-Body Database query (column names of its API) as a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in _SBDB.items() if row.get(theirs)}
    check_parameters("JPL", (c for c in NOT_MODELLED["JPL"] if row.get(c)), file)
    full = row.get("full_name", "").strip()
    key = row.get("pdes", "").strip() or _key_of(full, row.get("spkid", ""))
    out |= _elements(row, file)
    if any(row.get(c) for c in ("A1", "A2", "A3")):
        out["nongrav_law"] = "comet" if _is_comet(row.get("class", ""), key) else "asteroid"
    designation = full.partition("(")[2].rstrip(") ") if "(" in full else ""
    known = names_of(key)
    out["number"] = key if key.isdigit() else ""
    out["designation"] = designation or (known[1] if key.isdigit() else key)
    out["name"] = row.get("name", "").strip() or known[0] or out["designation"] or key
    out["pha"] = {"True": "Y", "False": "N"}.get(row.get("pha", ""), row.get("pha", ""))
    taxonomy = row.get("spec_B") or row.get("spec_T")
    if taxonomy:
        out["taxonomic_class"] = taxonomy
    if row.get("diameter"):
        out["diameter_m"] = _thousandfold(row["diameter"], "diameter", file)
        if row.get("diameter_sigma"):
            out["diameter_sigma_m"] = _thousandfold(row["diameter_sigma"], "diameter_sigma", file)
    out["condition_code"] = out.get("condition_code", "") if out.get("condition_code", "").isdigit() else ""
    return out | {"frame": FRAME, "orbit_source": f"JPL SBDB ({file})"}


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
        record: dict[str, Any] = parse_json(text, "orbit file", file)
        orbit, thing = record["orbit"], record["object"]
        elements = {item["name"]: item for item in orbit["elements"]}
        pushes = {p["name"]: p for p in orbit.get("model_pars") or [] if p["name"] in ("A1", "A2", "A3")}
        row = {mine: str(elements[c]["value"]) for c, mine in _SBDB.items() if c in elements}
        row |= {
            _SBDB["sigma_" + c]: str(elements[c]["sigma"])
            for c in ("a", "e", "i", "om", "w", "ma")
            if elements[c].get("sigma")
        }
        row |= {f"{name}_au_d2": str(p["value"]) for name, p in pushes.items()}
        row["epoch_jd_tdb"] = str(orbit["epoch"])
        full = str(thing["fullname"])
        key = str(thing["des"])
    except (KeyError, TypeError) as error:
        raise InvalidInput(
            "orbit file", file, f"an answer of the SBDB API with full precision ({error})"
        ) from None
    check_parameters("JPL", (p["name"] for p in orbit.get("model_pars") or []), file)
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
            row["diameter_m"] = _thousandfold(str(item["value"]), "diameter", file)
    solution = str(orbit.get("orbit_id", ""))
    row |= {"frame": FRAME, "orbit_solution": f"JPL {solution}", "orbit_source": f"JPL SBDB ({file})"}
    row["condition_code"] = str(orbit.get("condition_code") or "")
    if pushes:
        row["nongrav_law"] = _law_of(orbit, _is_comet(row["orbit_class"], key), file)
    return row, _sbdb_covariance(orbit, pushes, f"JPL SBDB, solution {solution} ({file})", file)


def _key_of(full: str, spkid: str) -> str:
    """Number or designation from the full name, else from the identifier of a numbered asteroid (20000000 + n)."""
    if full:
        first = full.split()[0].strip("()")
        return first if first.isdigit() and not re.match(r"\d{4} [A-Z]{2}", full) else full.strip("() ")
    n = int(spkid) if spkid.isdigit() else 0
    return str(n - 20000000 if n > 20000000 else n - 2000000) if n > 2000000 else spkid


def _elements(row: Mapping[str, str], file: str) -> dict[str, str]:
    """Epoch (JD, TDB), a and M of a row, from whichever columns define them.

    Raises
    ------
    InvalidInput
        The orbit is a parabola, or a number cannot be read.
    """
    out = {}
    try:
        if not row.get("epoch"):
            out["epoch_jd_tdb"] = repr(float(row["epoch_mjd"]) + 2400000.5)
        epoch = float(row.get("epoch") or out["epoch_jd_tdb"])
        e = float(row["e"])
        if not row.get("a") and e != 1.0:
            out["a_au"] = repr(float(row["q"]) / (1.0 - e))
        if not row.get("ma") and e != 1.0:
            a = abs(float(row.get("a") or out["a_au"]))
            out["M_deg"] = repr(_GAUSS * a**-1.5 * (epoch - float(row["tp"])))
    except (KeyError, ValueError, ZeroDivisionError) as error:
        raise InvalidInput("elements", dict(row), f"numbers in {file} ({error})") from None
    if e == 1.0:
        raise InvalidInput("e", 1, f"an ellipse or a hyperbola: a parabola has no a and M (in {file})")
    return out


#: Classes of comets in the SBDB.
_COMETS = frozenset({"COM", "CTc", "ETc", "HTC", "HYP", "JFC", "JFc", "PAR"})
#: Constants of the laws of distance, as JPL lists them.
_LAWS = {
    "asteroid": {"ALN": 1.0, "NK": 0.0, "NM": 2.0, "R0": 1.0},
    "comet": {"ALN": 0.1112620426, "NK": 4.6142, "NM": 2.15, "NN": 5.093, "R0": 2.808},
}


def _is_comet(orbit_class: str, key: str) -> bool:
    return orbit_class in _COMETS or bool(re.match(r"(\d+[PCD](-|/|$)|[PCD]/)", key.strip()))


def _law_of(orbit: Mapping[str, Any], comet: bool, file: str) -> str:
    """Law of distance of A1, A2, A3: that of the constants listed, or of Marsden et al. (1973) for a comet."""
    constants = {c for law in _LAWS.values() for c in law}
    given = {p["name"]: float(p["value"]) for p in orbit.get("model_pars") or [] if p["name"] in constants}
    if not given and comet:
        return "comet"
    for name, law in _LAWS.items():
        if given and all(given.get(c) == x for c, x in law.items()):
            return name
    raise InvalidInput(
        "A1, A2, A3",
        f"with the law {given or 'not given'} in {file}",
        "the constants of an acceleration that falls as 1/r2, or of the water law of comets",
    )


def _sbdb_covariance(
    orbit: Mapping[str, Any], pushes: Mapping[str, Any], source: str, file: str
) -> Covariance | None:
    import astropy.units as u
    import numpy as np
    from astropy.time import Time

    from flybystab.orbit.covariance import Covariance

    found = orbit.get("covariance")
    if not found:
        return None
    unit = {"e": u.dimensionless_unscaled, "q": u.au, "tp": u.d} | dict.fromkeys(("node", "peri", "i"), u.deg)
    unit |= dict.fromkeys(("A1", "A2", "A3"), u.au / u.d**2)
    try:
        names = [_SBDB_NAMES.get(str(n), str(n)) for n in found["labels"]]
        epoch = float(found["epoch"])
        # JPL repeats the elements only where the epoch of the covariance is not that of the orbit.
        own = orbit["elements"] if epoch == float(orbit["epoch"]) else None
        if own is None and "elements" not in found:
            raise KeyError("elements at the epoch of the covariance")
        mean = {_SBDB_NAMES.get(e["name"], e["name"]): str(e["value"]) for e in found.get("elements", own)}
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
    return Covariance.in_units(Time(epoch, format="jd", scale="tdb"), names, values, matrix, units, source)


def _thousandfold(text: str, name: str, file: str) -> str:
    try:
        return f"{1000.0 * float(text):.10g}"
    except ValueError:
        raise InvalidInput(name, text, f"a number in {file}") from None


def _defines_orbit(columns: set[str]) -> bool:
    """Whether columns of a query define an orbit and name its object."""
    return (
        {"e", "i", "om", "w"} <= columns
        and bool({"epoch", "epoch_mjd"} & columns)
        and ("a" in columns or "q" in columns)
        and ("ma" in columns or "tp" in columns)
        and bool({"pdes", "full_name", "spkid"} & columns)
    )


@reader("SBDB query (CSV)", lambda text: _defines_orbit(set(header_of(text))))
def read_query(text: str, file: str) -> list[Entry]:
    """Rows of a query saved as CSV."""
    return [(from_sbdb(row, file), None) for row in rows_of(text, file)]


def _is_query(text: str) -> bool:
    return text.lstrip().startswith("{") and '"fields"' in text and '"data"' in text


@reader("SBDB query (JSON)", _is_query)
def read_query_json(text: str, file: str) -> list[Entry]:
    """Rows of an answer of the query API.

    Raises
    ------
    InvalidInput
    """
    try:
        answer = parse_json(text, "catalogue file", file)
        fields = [str(f) for f in answer["fields"]]
        rows = [
            {f: "" if v is None else str(v) for f, v in zip(fields, row, strict=True)}
            for row in answer["data"]
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise InvalidInput("orbit file", file, f"an answer of the SBDB query API ({error})") from None
    if not _defines_orbit(set(fields)):
        raise InvalidInput(
            "fields", ", ".join(fields), "epoch, e, i, om, w, a or q, ma or tp, and a name (pdes, full_name)"
        )
    return [(from_sbdb(row, file), None) for row in rows]


@reader("SBDB answer", lambda text: text.lstrip().startswith("{") and not _is_query(text))
def read_answer(text: str, file: str) -> list[Entry]:
    """The orbit of an answer for one object."""
    return [from_sbdb_answer(text, file)]
