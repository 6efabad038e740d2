"""Tables of orbits from elsewhere, read as catalogue rows: JPL SBDB queries and answers, MPC, NEOCC.

Only the columns that are understood are used. A size, shape or spin that such a table does not give is drawn
(:mod:`flybystab.screening.priors`), or taken from the embedded catalogue by `with_physical_data`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from typing import TYPE_CHECKING, Any

from flybystab.catalogues.designations import names_of
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.orbit.covariance import Covariance

FRAME = "heliocentric, ecliptic J2000, TDB"

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
#: Gauss's constant, deg/d at 1 au.
_GAUSS = 0.98560766860142
_MPC = {
    "number": "number",
    "principal_desig": "designation",
    "orbit_type": "orbit_class",
    "H": "H_mag",
    "a_au": "a_au",
    "e": "e",
    "i_deg": "i_deg",
    "node_deg": "node_deg",
    "peri_deg": "peri_deg",
    "M_deg": "M_deg",
    "U": "condition_code",
}


def kind_of(columns: Sequence[str]) -> str:
    """Form of a table: ``sbdb``, ``mpc`` or nothing (the catalogue's own columns)."""
    names = set(columns)
    if {"pdes", "epoch", "e", "a", "i", "om", "w", "ma"} <= names:
        return "sbdb"
    if {"principal_desig", "epoch_jd_tt", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"} <= names:
        return "mpc"
    return ""


def from_sbdb(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row of a JPL Small-Body Database query (column names of its API) as a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in _SBDB.items() if row.get(theirs)}
    key = row["pdes"].strip()
    full = row.get("full_name", "")
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


def from_mpc(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row of the Minor Planet Center's orbits (with column names that carry units) as a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in _MPC.items() if row.get(theirs)}
    out["name"] = row.get("name", "").strip() or row["principal_desig"].strip()
    out["aliases"] = ";".join(a.strip() for a in row.get("other_desigs", "").replace("|", ";").split(";"))
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = row["epoch_jd_tt"]
    out["observed_jd"] = _middle(row.get("arc", ""), row.get("last_obs", ""))
    try:  # the mean motion has more digits of the axis than the axis
        axis = (_GAUSS / float(row["n_deg_d"])) ** (2.0 / 3.0)
        if abs(axis - float(row["a_au"])) < 1e-7:
            out["a_au"] = repr(axis)
    except (KeyError, ValueError, ZeroDivisionError):
        pass
    out["pha"] = {"1": "Y", "0": "N"}.get(row.get("pha_flag", ""), "")
    if not out.get("condition_code", "").isdigit():
        out["condition_code"] = ""
    return out | {"frame": FRAME, "orbit_source": f"MPC ({file})"}


def _middle(arc: str, last: str) -> str:
    """Julian date of the middle of an arc ("1893-2026", or "13 d" before the last observation); nothing if unknown."""
    try:
        if arc.endswith("d"):
            return repr(date.fromisoformat(last).toordinal() + 1721424.5 - 0.5 * float(arc.split()[0]))
        first, _, final = arc.partition("-")
        return repr(2451545.0 + 365.25 * (0.5 * (int(first) + int(final)) - 1999.5))
    except ValueError:
        return ""


def from_neocc(text: str, file: str) -> tuple[dict[str, str], Covariance | None]:
    """An orbit file of ESA's NEO Coordination Centre (OEF2, Keplerian elements, ``.ke1``).

    Returns
    -------
    dict
        A catalogue row.
    Covariance or None
        Upper triangle of its ``COV`` lines: au, degrees, and 1e-10 au/d2 for A2, as the ``RMS`` line shows.

    Raises
    ------
    InvalidInput
        The file is not one, or its covariance is not that of the parameters that it lists.
    """
    lines = [line.strip() for line in text.splitlines()]
    try:
        body = lines[lines.index("END_OF_HEADER") + 1 :]
        if "ECLM J2000" not in text:
            raise ValueError
        designation = next(line for line in body if line and not line.startswith("!"))
        words = {line.split()[0]: line.split()[1:] for line in body if line and not line.startswith("!")}
        kep = words["KEP"]
        day, scale = float(words["MJD"][0]), words["MJD"][1]
        if len(kep) != 6 or scale not in ("TDT", "TT", "TDB"):
            raise ValueError
    except (ValueError, KeyError, IndexError, StopIteration):
        raise InvalidInput("orbit file", file, "an OEF2.0 file with Keplerian elements, ECLM J2000") from None
    out = dict(zip(("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"), kep, strict=True))
    if designation.isdigit():
        out["number"] = designation
        name, out["designation"] = names_of(designation)
    else:
        name, out["designation"] = "", f"{designation[:4]} {designation[4:]}".strip()
    out["name"] = name or out["designation"] or designation
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = repr(day + 2400000.5)
    if "MAG" in words:
        out["H_mag"] = words["MAG"][0]
    if len(words.get("NGR", [])) == 2:
        out["A2_au_d2"] = repr(float(words["NGR"][1]) * 1e-10)
        if float(words["NGR"][0]) != 0.0:
            out["notes"] = f"solar radiation pressure is left out (area-to-mass ratio {words['NGR'][0]} m2/t)"
    out |= {"frame": FRAME, "orbit_source": f"ESA NEOCC ({file})", "orbit_solution": "NEOCC OEF2"}
    return out, _neocc_covariance(body, words, out, file)


def _neocc_covariance(
    body: Sequence[str], words: Mapping[str, Sequence[str]], row: Mapping[str, str], file: str
) -> Covariance | None:
    import astropy.units as u
    import numpy as np

    from flybystab.orbit.covariance import Covariance

    cells = [c for line in body if line.startswith("COV") for c in line.split()[1:]]
    if not cells:
        return None
    names = ["a", "e", "i", "node", "peri", "M"]
    units: list[u.UnitBase] = [u.au, u.dimensionless_unscaled, *[u.deg] * 4]
    try:
        upper = [float(c) for c in cells]
        # LSP: model, number of parameters, dimension, list of those solved for (2: Yarkovsky).
        solved = words.get("LSP", [])[3:]
        n = 6 + len(solved)
        if len(upper) != n * (n + 1) // 2 or any(s not in ("1", "2") for s in solved):
            raise ValueError
        matrix = np.zeros((n, n))
        matrix[np.triu_indices(n)] = upper
        matrix += np.triu(matrix, 1).T
        values = [float(row[c]) for c in ("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg")]
        keep = list(range(6))
        if "2" in solved:  # the area-to-mass ratio is marginalised: solar radiation is not modelled
            keep.append(6 + solved.index("2"))
            names.append("A2")
            units.append(1e-10 * u.au / u.d**2)
            values.append(float(words["NGR"][1]))
        rms = [float(c) for c in words.get("RMS", [])] or np.sqrt(np.diag(matrix))
        if len(rms) != n or not np.allclose(np.sqrt(np.diag(matrix)), rms, rtol=1e-4):
            raise ValueError
    except (ValueError, IndexError):
        raise InvalidInput(
            "orbit file",
            file,
            "COV lines that agree with the LSP and RMS lines, A2 at most beside the elements",
        ) from None
    epoch = _tdb(float(row["epoch_jd_tdb"]))
    return Covariance.in_units(epoch, names, values, matrix[np.ix_(keep, keep)], units, f"ESA NEOCC ({file})")


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
            row["diameter_m"] = _thousandfold(str(item["value"]), "diameter", file)
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
    return Covariance.in_units(_tdb(epoch), names, values, matrix, units, source)


def _tdb(day: float) -> Any:
    from astropy.time import Time

    return Time(day, format="jd", scale="tdb")


def _thousandfold(text: str, name: str, file: str) -> str:
    try:
        return f"{1000.0 * float(text):.10g}"
    except ValueError:
        raise InvalidInput(name, text, f"a number in {file}") from None


def with_physical_data(asteroids: Sequence[Asteroid]) -> tuple[Asteroid, ...]:
    """Asteroids whose empty physical columns are filled from the embedded tables where these have the body.

    First from the embedded catalogue; then spin period and amplitude from the LCDB.
    """
    from flybystab.catalogues.asteroid import identity
    from flybystab.catalogues.catalogue import catalogue, key_of
    from flybystab.catalogues.lightcurves import lightcurves

    known = {key_of(identity(a)): a for a in catalogue()}
    periods = {key_of(k): row for k, row in lightcurves().items()}

    def completed(a: Asteroid) -> Asteroid:
        key = key_of(identity(a))
        if key in known:
            return a.completed(known[key])
        if key not in periods:
            return a
        found, row = periods[key], dict(a.row)
        if not row.get("spin_period_h"):
            row["spin_period_h"] = found["spin_period_h"]
            row["spin_source"] = f"LCDB 2021 (U = {found['quality']})"
        row["spin_state"] = row.get("spin_state") or ("tumbling" if found["tumbles"] else "")
        row["amplitude_mag"] = row.get("amplitude_mag") or found["amplitude_mag"]
        return replace(a, row=row)

    return tuple(completed(a) for a in asteroids)


def foreign(asteroid: Asteroid) -> bool:
    """Whether a row comes from a table of orbits: its body is then completed from the embedded tables."""
    return asteroid.row.get("orbit_source", "").startswith(("JPL SBDB (", "MPC (", "ESA NEOCC ("))
