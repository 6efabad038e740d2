"""Tables of the Asteroid Lightcurve Database (LCDB) as CSV, and tables of alternative spin solutions.

Columns of the LCDB: its ``readme.pdf``, section 4 (Warner, Harris & Pravec 2009, Icarus 202, 134;
https://minplanobs.org): Number, Name, Desig, Class, Diam (km), H, Period (h), AmpMax (mag), U (quality of the period, 3
is unambiguous), Notes (``T``: tumbling); ``-`` and -9.99 are missing values. A period or an amplitude with the flag
``<`` or ``>`` (PFlag, AmpFlag) is a bound and is not read. Column names with a numeric prefix (``19-Period``) are
accepted. If an asteroid has several rows, those of the best quality are alternative solutions with equal weights.

A table of spin solutions has the column ``period_h`` and, optionally, ``sigma_h``, ``lon_deg``, ``lat_deg`` (ecliptic
J2000), ``weight``, ``source``, ``name``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from flybystab.catalogues.physical import PhysicalData, physical_reader
from flybystab.catalogues.readers import header_of, rows_of
from flybystab.catalogues.readers.conversion import number
from flybystab.catalogues.spin_solutions import SpinSolution

#: Flags of a period or an amplitude that is an upper or a lower bound.
_BOUNDS = ("<", ">")
_MISSING = ("", "-", "-9.99", "-9.990")


def _plain(column: str) -> str:
    return re.sub(r"^\d+-", "", column)


def _is_lcdb(text: str) -> bool:
    return {"Number", "Name", "Period", "U"} <= {_plain(c) for c in header_of(text)}


@physical_reader(
    "LCDB (CSV)",
    _is_lcdb,
    "H, diameter, lightcurve amplitude, taxonomic class",
    "periods of the best quality; tumbling",
)
def read_lcdb(text: str, file: str) -> list[PhysicalData]:
    """The asteroids in a table.

    Raises
    ------
    InvalidInput
    """
    return bodies_of([{_plain(c): v for c, v in raw.items()} for raw in rows_of(text, file)], file)


def bodies_of(rows: Iterable[Mapping[str, str]], file: str) -> list[PhysicalData]:
    """The asteroids in rows keyed by column name; rows of one asteroid are merged."""
    bodies: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for raw in rows:
        row = {c: v for c, v in raw.items() if v not in _MISSING}
        names = tuple(row[c] for c in ("Number", "Name", "Desig") if row.get(c) not in (None, "0"))
        if names:
            bodies.setdefault(names, []).append(row)
    return [_body(names, rows, file) for names, rows in bodies.items()]


def _quality(row: Mapping[str, str]) -> float:
    """U as a number; a minus or plus (3-, 2+) subtracts or adds a third."""
    found = re.match(r"(\d)([-+]?)", row.get("U", ""))
    if found is None:
        return -1.0
    return float(found[1]) + {"-": -1.0 / 3.0, "+": 1.0 / 3.0, "": 0.0}[found[2]]


def _body(names: tuple[str, ...], rows: list[dict[str, str]], file: str) -> PhysicalData:
    merged: dict[str, str] = {}
    for row in rows:
        merged = row | merged
    out = {"H_mag": merged.get("H", ""), "taxonomic_class": merged.get("Class", "").rstrip("*:")}
    if out["taxonomic_class"]:
        out["taxonomic_source"] = f"LCDB ({file})"
    if "Diam" in merged:
        out["diameter_m"] = f"{1e3 * number(merged['Diam'], 'Diam', file):.10g}"
        out["diameter_source"] = f"LCDB ({file})"
    if "AmpMax" in merged and merged.get("AmpFlag") not in _BOUNDS:
        out |= {"amplitude_mag": merged["AmpMax"], "amplitude_source": f"LCDB ({file})"}
    timed = [row for row in rows if "Period" in row and row.get("PFlag") not in _BOUNDS]
    best = max((_quality(row) for row in timed), default=-1.0)
    spins = {}
    for row in timed:
        if _quality(row) == best:
            period = number(row["Period"], "Period", file)
            source = f"LCDB, U = {row.get('U', 'not given')} ({file})"
            spins[period] = SpinSolution(period, 0.0, None, 1.0, source)
    if "T" in re.split(r"[^A-Z]", merged.get("Notes", "").upper()) or merged.get("Notes", "")[:1] == "T":
        out["spin_state"] = "tumbling"
    return PhysicalData(names, {c: v for c, v in out.items() if v}, tuple(spins.values()))


def _is_solutions(text: str) -> bool:
    columns = set(header_of(text))
    return "period_h" in columns and columns <= {
        "period_h", "sigma_h", "lon_deg", "lat_deg", "weight", "source", "name",
    }  # fmt: skip


@physical_reader("spin solutions (CSV)", _is_solutions, "none", "periods with errors, poles, weights")
def read_solutions(text: str, file: str) -> list[PhysicalData]:
    """Alternative solutions, grouped by the column ``name`` if there is one.

    Raises
    ------
    InvalidInput
    """
    bodies: dict[str, list[SpinSolution]] = {}
    for row in rows_of(text, file):
        pole = None
        if row.get("lon_deg") and row.get("lat_deg"):
            pole = number(row["lon_deg"], "lon_deg", file), number(row["lat_deg"], "lat_deg", file)
        solution = SpinSolution(
            number(row["period_h"], "period_h", file),
            number(row["sigma_h"], "sigma_h", file) if row.get("sigma_h") else 0.0,
            pole,
            number(row["weight"], "weight", file) if row.get("weight") else 1.0,
            row.get("source") or f"spin solutions ({file})",
        )
        bodies.setdefault(row.get("name", ""), []).append(solution)
    return [PhysicalData((n,) if n else (), {}, tuple(s)) for n, s in bodies.items()]
