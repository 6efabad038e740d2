"""Element tables of JPL: ``ELEMENTS.NUMBR``, ``ELEMENTS.UNNUM`` and ``ELEMENTS.COMET``.

Columns are marked by a line of dashes (https://ssd.jpl.nasa.gov/sb/elem_tables.html): epoch in MJD, TDB; a or q in au;
angles in degrees; Tp as ``yyyymmdd.ddddd``, TDB. The tables do not contain non-gravitational parameters.
"""

from __future__ import annotations

import re
from datetime import date
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import MJD, elements_row, number
from flybystab.catalogues.readers.covariances import printed_covariance
from flybystab.catalogues.readers.parameters import check_parameters
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

_KEPLERIAN = {"a": "a", "e": "e", "i": "i", "Node": "node", "w": "peri", "M": "M"}
_COMETARY = {"q": "q", "e": "e", "i": "i", "Node": "node", "w": "peri", "Tp": "tp"}
_OTHER = frozenset({"Num", "Name", "Num Name", "Designation", "Epoch", "H", "G", "Ref"})


def _is_elements(text: str) -> bool:
    lines = text.splitlines()[:2]
    if len(lines) < 2 or not re.fullmatch(r"\s*-+( +-+){6,}\s*", lines[1]):
        return False
    return {"Epoch", "e", "i", "w", "Node"} <= set(lines[0].split())


@reader(
    "JPL elements",
    _is_elements,
    Contents(
        "a and M, or q and Tp", "printed digits", "none", "H", files="`ELEMENTS.NUMBR`, `.UNNUM`, `.COMET`"
    ),
)
def read_elements(text: str, file: str) -> list[Entry]:
    """Rows of a table.

    Raises
    ------
    InvalidInput
        The table has unknown columns, or a row has missing or invalid values.
    """
    header, dashes, *lines = text.splitlines()
    spans = [match.span() for match in re.finditer("-+", dashes)]
    # A value may start to the left of its dashes; the last column extends to the end of the line.
    starts = [0, *(stop for _, stop in spans[:-1])]
    columns = [" ".join(c.split()) for c in _cut(header, starts)]
    known = {*_KEPLERIAN, *_COMETARY, *_OTHER}
    check_parameters("table", [c for c in columns if c and c not in known], file)
    return [
        _entry(dict(zip(columns, _cut(line, starts), strict=True)), file) for line in lines if line.strip()
    ]


def _cut(line: str, starts: list[int]) -> list[str]:
    return [line[a:b].strip() for a, b in zip(starts, [*starts[1:], None], strict=True)]


def _entry(row: dict[str, str], file: str) -> Entry:
    label = row.get("Designation") or row.get("Num Name") or f"{row.get('Num', '')} {row.get('Name', '')}"
    jd = number(row.get("Epoch"), "Epoch", file) + MJD
    comet = "Tp" in row
    names = _COMETARY if comet else _KEPLERIAN
    if any(not row.get(c) for c in names):
        raise InvalidInput("row", label, f"values of {', '.join(names)} in {file}")
    source = f"JPL elements ({file})"
    out = name_columns(label) | {"orbit_source": source, "orbit_solution": row.get("Ref", "")}
    texts = [row[c] for c in names]
    offset = 0.0
    if comet:
        midnight, texts[5] = _perihelion(texts[5], file)
        offset = jd - midnight
        out["orbit_class"] = "COM"
    elif row.get("H"):
        out["H_mag"] = row["H"]
    values = [number(t, n, file) for t, n in zip(texts, names, strict=True)]
    values[5] -= offset
    out |= elements_row(jd, list(names.values()), texts, values)
    return out, printed_covariance(jd, list(names.values()), texts, offset, source)


def _perihelion(text: str, file: str) -> tuple[float, str]:
    """Julian date at the preceding midnight and printed fraction of the day of ``yyyymmdd.ddddd``."""
    whole, _, fraction = text.partition(".")
    try:
        midnight = date(int(whole[:-4]), int(whole[-4:-2]), int(whole[-2:])).toordinal() + 1721424.5
        float("0." + fraction)
    except ValueError:
        raise InvalidInput("Tp", text, f"a date as yyyymmdd.ddddd in {file}") from None
    return midnight, "0." + (fraction or "0")
