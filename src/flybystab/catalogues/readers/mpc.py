"""Orbits of the Minor Planet Center: tables with named columns, and the fixed columns of MPCORB.DAT.

Columns of MPCORB: https://minorplanetcenter.net/iau/info/MPOrbitFormat.html.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import names_of, unpacked, unpacked_date
from flybystab.catalogues.readers import FRAME, Contents, header_of, reader, rows_of
from flybystab.catalogues.readers.arcs import arc_columns
from flybystab.catalogues.readers.parameters import (
    check_parameters,
    looks_like_parameter,
    named_parameters,
)
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

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


def from_mpc(row: Mapping[str, str], file: str) -> dict[str, str]:
    """Convert a row of an MPC table (column names with units) to a catalogue row."""
    out = {mine: row[theirs] for theirs, mine in _MPC.items() if row.get(theirs)}
    out["name"] = row.get("name", "").strip() or row["principal_desig"].strip()
    out["aliases"] = ";".join(a.strip() for a in row.get("other_desigs", "").replace("|", ";").split(";"))
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = row["epoch_jd_tt"]
    out["observed_jd"] = _middle(row.get("arc", ""), row.get("last_obs", ""))
    if out["observed_jd"]:  # the MPC gives arcs of one opposition in days, longer ones in years
        out["single_opposition"] = "Y" if row["arc"].endswith("d") else "N"
    out |= arc_columns(row.get("first_obs"), row.get("last_obs"))
    try:  # the mean motion is printed with more significant digits than the semi-major axis
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
    """Julian date of the middle of an arc ("1893-2026", or "13 d" before the last observation); empty if unknown."""
    try:
        if arc.endswith("d"):
            return repr(date.fromisoformat(last).toordinal() + 1721424.5 - 0.5 * float(arc.split()[0]))
        first, _, final = arc.partition("-")
        return repr(2451545.0 + 365.25 * (0.5 * (int(first) + int(final)) - 1999.5))
    except ValueError:
        return ""


_COLUMNS = {"principal_desig", "epoch_jd_tt", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg"}


@reader(
    "MPC table",
    lambda text: set(header_of(text)) >= _COLUMNS,
    Contents("a, e, i, node, peri, M", "printed digits and U", "none", "H"),
)
def read_mpc(text: str, file: str) -> list[Entry]:
    """Rows of an MPC table with units in the column names."""
    check_parameters("table", [c for c in header_of(text) if looks_like_parameter(c)], file)
    return [(from_mpc(row, file), None) for row in rows_of(text, file)]


#: Packed designation, H and G (may be blank), packed epoch, then M in degrees.
_MPCORB = re.compile(r"^[0-9A-Za-z~_][0-9A-Za-z ]{6} .{5} .{5} [IJK]\d\d[1-9A-C][1-9A-V] [ \d]{3}\.\d{5} ")


def _body(text: str) -> list[str]:
    """Lines with orbits, after the line of dashes if there is one."""
    lines = text.splitlines()
    dashes = next((k for k, line in enumerate(lines[:100]) if line.startswith("-----")), -1)
    return [line for line in lines[dashes + 1 :] if line.strip()]


def _is_mpcorb(text: str) -> bool:
    lines = _body(text[:40000])
    return bool(lines) and bool(_MPCORB.match(lines[0]))


@reader(
    "MPCORB",
    _is_mpcorb,
    Contents(
        "a, e, i, node, peri, M",
        "printed digits and U",
        "none",
        "H",
        files="`MPCORB.DAT`, `NEA.txt`, `DAILY.DAT`",
    ),
)
def read_mpcorb(text: str, file: str) -> list[Entry]:
    """Rows of MPCORB.DAT, NEA.txt, DAILY.DAT and similar files.

    Raises
    ------
    InvalidInput
        A line does not have the columns of MPCORB.
    """
    out: list[Entry] = []
    for line in _body(text):
        if not _MPCORB.match(line):
            raise InvalidInput("row", line[:40], f"the fixed columns of MPCORB in {file}")
        check_parameters("table", named_parameters(line[160:]), file)
        key = unpacked(line[:7].strip())
        name = re.sub(r"^\(\d+\)", "", line[166:194].strip()).strip()
        number = key if key.isdigit() else ""
        row = {
            "name": name or names_of(key)[0] or key,
            "principal_desig": names_of(key)[1] if number else key,
            "number": number,
            "H": line[8:13].strip(),
            "epoch_jd_tt": repr(unpacked_date(line[20:25])),
            "M_deg": line[26:35].strip(),
            "peri_deg": line[37:46].strip(),
            "node_deg": line[48:57].strip(),
            "i_deg": line[59:68].strip(),
            "e": line[70:79].strip(),
            "n_deg_d": line[80:91].strip(),
            "a_au": line[92:103].strip(),
            "U": line[105:106].strip(),
            "arc": line[127:136].strip().replace("days", "d"),
        }
        last = line[194:202].strip()
        row["last_obs"] = f"{last[:4]}-{last[4:6]}-{last[6:]}" if last.isdigit() else ""
        out.append((from_mpc(row, file), None))
    return out
