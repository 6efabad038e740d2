"""Comets of the Minor Planet Center: ``CometEls.txt`` and ``cometels.json``.

Columns: https://minorplanetcenter.net/iau/info/CometOrbitFormat.html. Times are TT. Lines without an epoch contain
unperturbed elements, which are taken as osculating at perihelion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import date
from typing import TYPE_CHECKING

from flybystab.catalogues.designations import name_columns, unpacked
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import COMETARY, number, perihelion_row
from flybystab.catalogues.readers.covariances import printed_covariance
from flybystab.catalogues.readers.parameters import (
    check_parameters,
    looks_like_parameter,
    named_parameters,
)
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry

_LINE = re.compile(
    r"^(?P<key>[ \d]{4}[CPDXAI][ 0-9A-Za-z]{7})  (?P<year>[- \d]{4}) (?P<month>[ \d]\d) (?P<day>[ \d]\d\.[ \d]{4}) "
    r"(?P<q>[ \d]{2}\.\d{2,6} *)  (?P<e>[ \d]\.\d{2,6} *)  (?P<peri>[ \d]{3}\.\d{2,4} *)  "
    r"(?P<node>[ \d]{3}\.\d{2,4} *)  (?P<i>[ \d]{3}\.\d{2,4} *)  (?P<epoch>[ \d]{8})(?P<rest>.*)$"
)
_JSON = {"q": "Perihelion_dist", "e": "e", "i": "i", "node": "Node", "peri": "Peri"}
_OTHER = frozenset({"H", "G"})


def _first_line(text: str) -> str:
    return next((line for line in text.splitlines() if line.strip()), "")


@reader(
    "MPC CometEls",
    lambda text: bool(_LINE.match(_first_line(text))),
    Contents("q and Tp, any conic", "printed digits", "none", "none"),
)
def read_comets(text: str, file: str) -> list[Entry]:
    """Rows of ``CometEls.txt``.

    Raises
    ------
    InvalidInput
        A line does not have these columns.
    """
    out = []
    for line in text.splitlines():
        if not line.strip():
            continue
        found = _LINE.match(line)
        if not found:
            raise InvalidInput("row", line[:60], f"the fixed columns of CometEls.txt in {file}")
        check_parameters("table", named_parameters(found["rest"]), file)
        cells = {k: v.strip() for k, v in found.groupdict().items()}
        label = found["rest"][13:69].strip() or unpacked(found["key"].strip())
        magnitude = found["rest"][2:6].strip()
        perihelion = _day(cells["year"], cells["month"], cells["day"], file)
        out.append(_entry(label, cells, perihelion, cells["epoch"], magnitude, file))
    return out


def _day(year: str, month: str, day: str, file: str) -> tuple[float, str]:
    """Julian date at the preceding midnight, and the printed fraction of the day."""
    whole, _, fraction = day.partition(".")
    try:
        midnight = date(int(year), int(month), 1).toordinal() + int(whole) - 1 + 1721424.5
        float("0." + fraction)
    except ValueError:
        raise InvalidInput("date", f"{year} {month} {day}", f"a date in {file}") from None
    return midnight, "0." + (fraction or "0")


def _entry(
    label: str, cells: Mapping[str, str], perihelion: tuple[float, str], epoch: str, magnitude: str, file: str
) -> Entry:
    midnight, fraction = perihelion
    tp = midnight + float(fraction)
    jd = _day(epoch[:4], epoch[4:6], epoch[6:], file)[0] if epoch else tp
    elements = [number(cells[n], n, file) for n in COMETARY[:5]]
    source = f"MPC comets ({file})"
    row = name_columns(label) | {"orbit_source": source, "orbit_class": "COM"}
    row |= perihelion_row(jd, elements, jd - tp)
    if magnitude:
        row["notes"] = f"total magnitude {magnitude} at 1 au: that of the coma, not of the nucleus"
    texts = [*(cells[n] for n in COMETARY[:5]), fraction]
    return row, printed_covariance(jd, COMETARY, texts, jd - midnight, source)


def _is_json(text: str) -> bool:
    return text.lstrip()[:1] == "[" and '"Designation_and_name"' in text and '"Year_of_perihelion"' in text


@reader(
    "MPC comets (JSON)",
    _is_json,
    Contents("q and Tp, any conic", "printed digits", "none", "none", files="`cometels.json`"),
)
def read_comets_json(text: str, file: str) -> list[Entry]:
    """Rows of ``cometels.json``.

    Raises
    ------
    InvalidInput
    """
    return [_json_entry(row, file) for row in parse_json(text, "catalogue file", file)]


def _json_entry(row: Document, file: str) -> Entry:
    names = [k for k, v in row.items() if v and looks_like_parameter(k) and k not in _OTHER]
    check_parameters("table", names, file)
    try:
        cells = {mine: str(row[theirs]) for mine, theirs in _JSON.items()}
        perihelion = _day(
            str(row["Year_of_perihelion"]),
            str(row["Month_of_perihelion"]),
            f"{float(row['Day_of_perihelion']):.10g}",
            file,
        )
        label = str(row["Designation_and_name"])
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidInput("row", dict(row), f"the fields of cometels.json in {file} ({error})") from None
    epoch = ""
    if row.get("Epoch_year"):
        epoch = f"{int(row['Epoch_year']):04d}{int(row['Epoch_month']):02d}{int(float(row['Epoch_day'])):02d}"
    return _entry(label, cells, perihelion, epoch, str(row.get("H") or ""), file)
