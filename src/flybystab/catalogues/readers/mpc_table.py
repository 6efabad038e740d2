"""Orbits of the Minor Planet Center as CSV with units in the column names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import date

from flybystab.catalogues.readers.common import FRAME, header, rows
from flybystab.catalogues.readers.registry import Entry, register

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
_NEEDED = {"principal_desig", "epoch_jd_tt", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"}


@register("MPC table (CSV)", "MPC", lambda text: header(text) >= _NEEDED)
def read(text: str, file: str) -> Iterator[Entry]:
    """Rows of a table."""
    for row in rows(text, file):
        yield from_mpc(row, file), None


def from_mpc(row: Mapping[str, str], file: str) -> dict[str, str]:
    """A row of the Minor Planet Center's orbits (with column names that carry units) as a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in _MPC.items() if row.get(theirs)}
    out["name"] = row.get("name", "").strip() or row["principal_desig"].strip()
    out["aliases"] = ";".join(a.strip() for a in row.get("other_desigs", "").replace("|", ";").split(";"))
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = row["epoch_jd_tt"]
    out["observed_jd"] = middle_of_arc(row.get("arc", ""), row.get("last_obs", ""))
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


def middle_of_arc(arc: str, last: str) -> str:
    """Julian date of the middle of an arc ("1893-2026", or "13 d" before the last observation); nothing if unknown."""
    try:
        if arc.endswith("d"):
            return repr(date.fromisoformat(last).toordinal() + 1721424.5 - 0.5 * float(arc.split()[0]))
        first, _, final = arc.partition("-")
        return repr(2451545.0 + 365.25 * (0.5 * (int(first) + int(final)) - 1999.5))
    except ValueError:
        return ""
