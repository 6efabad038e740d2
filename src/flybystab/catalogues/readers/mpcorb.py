"""MPCORB.DAT, NEA.txt and DAILY.DAT of the Minor Planet Center: fixed columns, packed dates and designations.

Columns from https://www.minorplanetcenter.net/iau/info/MPOrbitFormat.html, packed forms from .../PackedDes.html and
.../PackedDates.html.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import date

from flybystab.catalogues.designations import names_of
from flybystab.catalogues.readers.common import FRAME
from flybystab.catalogues.readers.mpc_table import middle_of_arc
from flybystab.catalogues.readers.registry import Entry, register
from flybystab.errors import InvalidInput

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_CENTURY = {"I": 18, "J": 19, "K": 20}
#: Packed name, H and G, packed epoch, and the four angles.
_LINE = re.compile(
    r"^[0-9A-Za-z~]{5,7} .{8,14}[I-K]\d{2}[1-9A-C][1-9A-V] (?:[ \d]{3}\.\d{5} {1,2}){4}", re.MULTILINE
)


def unpacked(packed: str) -> str:
    """Number or designation from its packed form; text in another form is returned as it is.

    ``00433`` is 433, ``a0001`` 360001, ``~0K8Q`` 697402, ``K04M04N`` 2004 MN4, ``J99R36Q`` 1999 RQ36, ``PLS2040``
    2040 P-L.
    """
    text = packed.strip()
    if re.fullmatch(r"~[0-9A-Za-z]{4}", text):
        number = 0
        for c in text[1:]:
            number = 62 * number + _DIGITS.index(c)
        return str(620_000 + number)
    if re.fullmatch(r"[0-9A-Za-z]\d{4}", text):
        return str(10_000 * _DIGITS.index(text[0]) + int(text[1:]))
    if re.fullmatch(r"(PL|T[123])S\d{4}", text):
        return f"{int(text[3:])} {text[0]}-{text[1]}"
    if re.fullmatch(r"[IJK]\d{2}[A-HJ-Y][0-9A-Za-z]\d[A-Z]", text):
        cycle = 10 * _DIGITS.index(text[4]) + int(text[5])
        return f"{_CENTURY[text[0]]}{text[1:3]} {text[3]}{text[6]}{cycle or ''}"
    return text


def julian_day(packed: str) -> float:
    """Julian date, TT, of a packed date: ``K107N`` is 2010-07-23.0."""
    year = 100 * _CENTURY[packed[0]] + int(packed[1:3])
    return date(year, _DIGITS.index(packed[3]), _DIGITS.index(packed[4])).toordinal() + 1721424.5


@register("MPCORB (fixed columns)", "MPC", lambda text: bool(_LINE.search(text[: 1 << 18])))
def read(text: str, file: str) -> Iterator[Entry]:
    """Rows of the file, behind a header that ends in a line of dashes, if there is one.

    Raises
    ------
    InvalidInput
        A line that is not in the format.
    """
    lines = text.splitlines()
    dashes = next((k for k, line in enumerate(lines) if line.startswith("-----")), -1)
    for number, line in enumerate(lines[dashes + 1 :], start=dashes + 2):
        if line.strip():
            try:
                yield _row(line, file), None
            except (ValueError, KeyError, IndexError) as error:
                raise InvalidInput(
                    "row", f"line {number} of {file}", f"the columns of MPCORB ({error})"
                ) from None


def _row(line: str, file: str) -> dict[str, str]:
    name = unpacked(line[:7])
    elements = {
        "a_au": line[92:103], "e": line[70:79], "i_deg": line[59:68], "node_deg": line[48:57],
        "peri_deg": line[37:46], "M_deg": line[26:35],
    }  # fmt: skip
    out = {column: repr(float(text)) for column, text in elements.items()}
    # TT and TDB differ by less than 2 ms.
    out["epoch_jd_tdb"] = repr(julian_day(line[20:25]))
    if line[8:13].strip():
        out["H_mag"] = repr(float(line[8:13]))
    code = line[105:106].strip()
    out["condition_code"] = code if code.isdigit() else ""
    if name.isdigit():
        known = names_of(name)
        out["number"], out["designation"] = name, known[1]
        out["name"] = line[166:194].partition(")")[2].strip() or known[0] or known[1] or name
    else:
        out["number"], out["designation"], out["name"] = "", name, name
    last = line[194:202].strip()
    if len(last) == 8 and last.isdigit():
        arc = line[127:136].strip()
        length = arc if "-" in arc else f"{arc.partition(' ')[0]} d"
        out["observed_jd"] = middle_of_arc(length, f"{last[:4]}-{last[4:6]}-{last[6:]}")
    return out | {"frame": FRAME, "orbit_source": f"MPC ({file})"}
