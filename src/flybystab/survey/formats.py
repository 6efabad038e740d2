"""Tables of orbits from elsewhere, read as catalogue rows: JPL SBDB queries, MPC, NEOCC.

Only the columns that are understood are used. A size, shape or spin that such a table does not give is drawn
(:mod:`flybystab.survey.population`), or taken from the embedded catalogue by `with_physical_data`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.survey.asteroid import Asteroid

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
    out["number"] = key if key.isdigit() else ""
    out["designation"] = designation or ("" if key.isdigit() else key)
    out["name"] = row.get("name", "").strip() or out["designation"] or key
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
    out["pha"] = {"1": "Y", "0": "N"}.get(row.get("pha_flag", ""), "")
    if not out.get("condition_code", "").isdigit():
        out["condition_code"] = ""
    return out | {"frame": FRAME, "orbit_source": f"MPC ({file})"}


def from_neocc(text: str, file: str) -> dict[str, str]:
    """An orbit file of ESA's NEO Coordination Centre (OEF2, Keplerian elements, ``.ke1``) as a catalogue row.

    Raises
    ------
    InvalidInput
        The file is not one.
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
    else:
        out["designation"] = f"{designation[:4]} {designation[4:]}".strip()
    out["name"] = out.get("designation", designation)
    out["epoch_jd_tdb"] = repr(day + 2400000.5)
    if "MAG" in words:
        out["H_mag"] = words["MAG"][0]
    if len(words.get("NGR", [])) == 2:
        out["A2_au_d2"] = repr(float(words["NGR"][1]) * 1e-10)
    return out | {"frame": FRAME, "orbit_source": f"ESA NEOCC ({file})", "orbit_solution": "NEOCC OEF2"}


def _thousandfold(text: str, name: str, file: str) -> str:
    try:
        return f"{1000.0 * float(text):.10g}"
    except ValueError:
        raise InvalidInput(name, text, f"a number in {file}") from None


def with_physical_data(asteroids: Sequence[Asteroid]) -> tuple[Asteroid, ...]:
    """Asteroids whose empty physical columns are filled from the embedded catalogue where it has the body."""
    from flybystab.survey.catalogue import catalogue, key_of
    from flybystab.survey.population import identity

    known = {key_of(identity(a)): a for a in catalogue()}
    return tuple(a.completed(known[k]) if (k := key_of(identity(a))) in known else a for a in asteroids)
