"""Tables of the JPL Small-Body Database query: CSV with the column names of its API."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from flybystab.catalogues.designations import names_of
from flybystab.catalogues.readers.common import FRAME, header, metres, rows
from flybystab.catalogues.readers.registry import Entry, register

#: Columns of a query -> columns of the catalogue.
COLUMNS = {
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

_NEEDED = {"pdes", "epoch", "e", "a", "i", "om", "w", "ma"}


@register("JPL SBDB query (CSV)", "JPL SBDB", lambda text: header(text) >= _NEEDED)
def read(text: str, file: str) -> Iterator[Entry]:
    """Rows of a query."""
    for row in rows(text, file):
        yield from_sbdb(row, file), None


def from_sbdb(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row of a JPL Small-Body Database query (column names of its API) as a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in COLUMNS.items() if row.get(theirs)}
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
        out["diameter_m"] = metres(row["diameter"], "diameter", file)
        if row.get("diameter_sigma"):
            out["diameter_sigma_m"] = metres(row["diameter_sigma"], "diameter_sigma", file)
    out["condition_code"] = out.get("condition_code", "") if out.get("condition_code", "").isdigit() else ""
    return out | {"frame": FRAME, "orbit_source": f"JPL SBDB ({file})"}
