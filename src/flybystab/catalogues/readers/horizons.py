"""Answers of JPL Horizons: osculating elements and vectors, as text or CSV, and object data pages.

Centre, units, axes and time scale are read from the header of the answer
(https://ssd.jpl.nasa.gov/horizons/manual.html#output), non-gravitational parameters from the description of the object.
Only the first epoch of a table is read.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import is_comet, name_columns
from flybystab.catalogues.readers import Contents, reader
from flybystab.catalogues.readers.conversion import (
    CARTESIAN,
    elements_row,
    heliocentric_state,
    number,
    rotated,
    state_of,
    state_row,
)
from flybystab.catalogues.readers.covariances import decimals_of, printed_covariance
from flybystab.catalogues.readers.nongravitational import nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters, looks_like_parameter
from flybystab.constants import AU, DAY
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.orbit.elements import GM_TOTAL

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance

_VECTOR = ("X", "Y", "Z", "VX", "VY", "VZ")
_COMETARY = {"QR": "q", "EC": "e", "IN": "i", "OM": "node", "W": "peri", "TP": "tp"}
_KEPLERIAN = {"A": "a", "EC": "e", "IN": "i", "OM": "node", "W": "peri", "MA": "M"}
#: Length (m) and time (s) of the output units.
_UNITS = {"AU-D": (AU, DAY), "KM-S": (1e3, 1.0), "KM-D": (1e3, DAY)}
_PAIR = re.compile(r"([A-Za-z][A-Za-z0-9-]*) ?= *([-+]?[.\d]+(?:[EeDd][-+]?\d+)?|n\.a\.)")


def _is_horizons(text: str) -> bool:
    head = text[:60000]
    if text.lstrip()[:1] in "{[":  # the API returns the same text within JSON
        return '"result"' in text and ("JPL/HORIZONS" in text or "$$SOE" in text)
    return (
        "$$SOE" in text and "Target body name:" in head and ("Output units" in head or "JDT" in head)
    ) or ("JPL/HORIZONS" in head and "osc. elements" in head and "EPOCH=" in head)


@reader(
    "JPL Horizons",
    _is_horizons,
    Contents(
        "elements or vectors, text or CSV; Sun or barycentre; ecliptic or ICRF; au or km; or the page of the object",
        "printed digits",
        "A1, A2, A3, their law, DT, AMRAT",
        "H, radius, rotation period",
    ),
)
def read_horizons(text: str, file: str) -> list[Entry]:
    """The orbit of an answer.

    Raises
    ------
    InvalidInput
        The centre is neither the Sun nor the barycentre of the solar system, the axes are neither ecliptic nor ICRF,
        or there are parameters that are not modelled.
    """
    if text.lstrip().startswith("{"):
        text = str(parse_json(text, "orbit file", file).get("result", ""))
    header, _, table = text.partition("$$SOE")
    row = _physical(header) | _nongravitational(header, file)
    if not table:
        return [_own_orbit(header, row, file)]
    centre, axes = _centre(header, file), _axes(header, file)
    length, day = _units(header, file)
    jd, cells = _first(header, table.partition("$$EOE")[0], file)
    source = f"JPL Horizons ({file})"
    row = name_columns(_target(header, file)) | row | {"orbit_source": source}
    if "orbit_solution" not in row and (solution := re.search(r"\{source: ([^}]+)\}", header)):
        row["orbit_solution"] = solution[1].strip()
    if all(c in cells for c in _VECTOR):
        scale = np.array([length] * 3 + [length / day] * 3)
        values = np.array([number(cells[c], c, file) for c in _VECTOR]) * scale
        state = rotated(values) if axes == "ecliptic" else values
        row |= state_row(jd, heliocentric_state(jd, state, centre, _barycentre(header)))
        texts = [cells[c] for c in _VECTOR]
        return [(row, _of_digits(jd, values, scale, texts, source))]
    if "EC" not in cells:
        raise InvalidInput("table", ", ".join(cells), f"elements, or positions with velocities, in {file}")
    if axes != "ecliptic":
        raise InvalidInput("reference frame", axes, f"ecliptic of J2000 for elements in {file}")
    gm = _gm(header, length, day, centre, file)
    return [_elements(jd, cells, row, length, centre, gm, source, file, _barycentre(header))]


def _line(header: str, name: str) -> str:
    found = re.findall(rf"^{name}\s*:(.*)$", header, re.MULTILINE)
    return found[-1].split("{")[0].strip() if found else ""


def _target(header: str, file: str) -> str:
    target = _line(header, "Target body name")
    if not target:
        raise InvalidInput("orbit file", file, "an answer of Horizons with the name of its target")
    return re.sub(r"\((\d{7,8})\)$", "", target).strip()


def _centre(header: str, file: str) -> str:
    text = _line(header, "Center body name")
    found = re.search(r"\((\d+)\)", text)
    site = _line(header, "Center-site name")
    if found is None or found[1] not in ("0", "10") or site not in ("", "BODY CENTER"):
        given = f"{text} {site}".strip() or "not given"
        raise InvalidInput(
            "centre", given, f"Sun (10) or Solar System Barycenter (0), body centre, in {file}"
        )
    return "sun" if found[1] == "10" else "ssb"


def _barycentre(header: str) -> str:
    """Ephemeris that defines the centre: DE441 since 2021, DE431 or DE405 before."""
    found = re.search(r"^Center body name\s*:.*\{source: *DE-?0*(\d+)", header, re.MULTILINE)
    return f"de{found[1]}" if found else "de441"


def _axes(header: str, file: str) -> str:
    text = f"{_line(header, 'Reference frame')} {_line(header, 'Coordinate systm')}"
    if re.search("equator of|body|B1950|FK4", text, re.IGNORECASE) or not text.strip():
        raise InvalidInput(
            "reference frame", text.strip() or "not given", f"ecliptic of J2000 or ICRF in {file}"
        )
    if "LT" in _line(header, "Output type").split():
        raise InvalidInput("output type", _line(header, "Output type"), f"GEOMETRIC states in {file}")
    return "ecliptic" if "ecliptic" in text.lower() else "equator"


def _units(header: str, file: str) -> tuple[float, float]:
    text = _line(header, "Output units").split(",")[0].strip().upper()
    if text not in _UNITS:
        raise InvalidInput("output units", text or "not given", f"one of {', '.join(_UNITS)} in {file}")
    return _UNITS[text]


def _first(header: str, table: str, file: str) -> tuple[float, dict[str, str]]:
    """Julian date (TDB) and values by name for the first epoch of a table."""
    titles = [line for line in header.splitlines() if re.match(r"\s*JD(TDB|TT|UT)?\s*,", line)]
    scale = re.search(r"^\s*JD(\w*)", titles[-1] if titles else header[-2000:], re.MULTILINE)
    body = table.strip()
    lines = body.splitlines()
    if not lines:
        raise InvalidInput("table", "empty", f"at least one epoch in {file}")
    if (scale and scale[1] == "UT") or re.search(r"\b(UT|UTC)\b", lines[0]):
        raise InvalidInput("time scale", "UT", f"TDB or TT in {file}")
    if titles:
        columns = [c.strip().upper() for c in titles[-1].split(",")]
        cells = dict(zip(columns, (c.strip() for c in lines[0].split(",")), strict=False))
        return number(next(iter(cells.values())), "epoch", file), {k: v for k, v in cells.items() if v}
    start = re.match(r"\s*(\d+\.\d+)\s*=", lines[0])
    if start is None:
        raise InvalidInput("table", lines[0][:60], f"a Julian date in {file}")
    block = [lines[0].partition("TDB")[2]]
    for line in lines[1:]:
        if re.match(r"\s*\d{6,}\.\d+\s*=", line):
            break
        block.append(line)
    pairs = {k.upper(): v for k, v in _PAIR.findall("\n".join(block))}
    return float(start[1]), pairs


def _gm(header: str, length: float, day: float, centre: str, file: str) -> float | None:
    """GM of the elements (m3/s2; None for the Sun), from the header if it is given there."""
    from flybystab.orbit.elements import GM_SUN

    text = _line(header, "Keplerian GM")
    if not text:
        return GM_TOTAL if centre == "ssb" else None
    gm = number(text.split()[0], "Keplerian GM", file) * length**3 / day**2
    if centre == "sun" and abs(gm / GM_SUN - 1.0) > 1e-6:
        raise InvalidInput("Keplerian GM", text, f"that of the Sun in {file}")
    return gm


def _elements(
    jd: float,
    cells: Mapping[str, str],
    row: dict[str, str],
    length: float,
    centre: str,
    gm: float | None,
    source: str,
    file: str,
    barycentre: str = "de441",
) -> Entry:
    au = length / AU  # Tp is a Julian date whatever the output units
    use = (
        _KEPLERIAN
        if all(c in cells for c in _KEPLERIAN) and number(cells["EC"], "EC", file) < 1.0
        else _COMETARY
    )
    missing = [c for c in use if c not in cells]
    if missing:
        raise InvalidInput("elements", ", ".join(missing), f"a column of each of {', '.join(use)} in {file}")
    names = list(use.values())
    texts = [cells[c] for c in use]
    values = [number(t, c, file) for t, c in zip(texts, use, strict=True)]
    values[0] *= au
    offset = 0.0
    if use is _COMETARY:
        offset = jd
        values[5] -= jd
    in_au = [repr(values[0]), *texts[1:]] if au != 1.0 else texts
    if centre == "ssb":
        row |= state_row(jd, heliocentric_state(jd, state_of(names, values, gm), "ssb", barycentre))
    else:
        row |= elements_row(jd, names, in_au, values)
    return row, printed_covariance(jd, names, in_au, offset, source, gm)


def _of_digits(
    jd: float, values: np.ndarray, scale: np.ndarray, texts: list[str], source: str
) -> Covariance | None:
    """Covariance from the printed digits of a state; `scale` is the unit of its components (m, m/s)."""
    in_au = values / np.array([AU] * 3 + [AU / DAY] * 3)
    step = scale / np.array([AU] * 3 + [AU / DAY] * 3)
    shown = []
    for value, text, factor in zip(in_au, texts, step, strict=True):
        decimals = int(np.floor(decimals_of(text) - np.log10(factor)))
        shown.append(f"{value:.{max(decimals, 0)}f}")
    return printed_covariance(jd, CARTESIAN, shown, 0.0, source)


def _own_orbit(header: str, row: dict[str, str], file: str) -> Entry:
    """The orbit solution on an object data page, at the epoch of the solution."""
    page = header.partition("osc. elements")[2]
    pairs: dict[str, str] = {}
    for key, value in _PAIR.findall(page):
        pairs.setdefault(key.upper(), value)
    missing = [c for c in ("EPOCH", *_COMETARY) if c not in pairs]
    if missing:
        raise InvalidInput("orbit file", file, f"the elements {', '.join(missing)} of the object")
    title = re.search(r"JPL/HORIZONS\s+(.*?)\s{2,}\d{4}-", header)
    source = f"JPL Horizons ({file})"
    jd = number(pairs["EPOCH"], "EPOCH", file)
    out = name_columns(title[1] if title else "unnamed") | row | {"orbit_source": source}
    if solution := re.search(r"soln ref\.= *([^,\n]+)", header):
        out["orbit_solution"] = solution[1].strip()
    return _elements(jd, pairs, out, AU, "sun", None, source, file)


def _physical(header: str) -> dict[str, str]:
    """H, diameter and period from the description of the object."""
    found: dict[str, str] = {}
    _, _, part = header.partition("physical")
    pairs = {k: v for k, v in _PAIR.findall(part.partition("***")[0]) if v != "n.a."}
    if "H" in pairs:
        found["H_mag"] = pairs["H"]
    if "RAD" in pairs and float(pairs["RAD"]) > 0.0:
        found["diameter_m"] = f"{2000.0 * float(pairs['RAD']):.10g}"
        found["diameter_source"] = "JPL Horizons"
    if "ROTPER" in pairs and float(pairs["ROTPER"]) > 0.0:
        found["spin_period_h"] = pairs["ROTPER"]
        found["spin_source"] = "JPL Horizons"
    return found


def _nongravitational(header: str, file: str) -> dict[str, str]:
    """A1, A2, A3, their law, DT and AMRAT from the description of the object.

    Raises
    ------
    InvalidInput
        There are parameters that are not modelled, or constants of the law are missing.
    """
    block = re.search(
        r"non-gravitational force model[^\n]*:\s*\n(.*?)(?:\n\s*\n|\n\*{5}|\n(?:ASTEROID|COMET) comments|\Z)",
        header,
        re.DOTALL,
    )
    if block is None:
        return {}
    pairs = {k: number(v, k, file) for k, v in _PAIR.findall(block[1]) if v != "n.a."}
    given = {k: v for k, v in pairs.items() if v != 0.0 and looks_like_parameter(k)}
    check_parameters("JPL", given, file)
    comet = is_comet(name_columns(_line(header, "Target body name") or "x")["designation"])
    return nongravitational_columns(pairs, comet, file)
