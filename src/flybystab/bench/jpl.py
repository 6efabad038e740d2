"""JPL data of 2020: orbits of near-Earth asteroids, and JPL's list of their close approaches from January to June.

Read from ``../shared/data`` beside a checkout, or ``$FLYBYSTAB_SHARED/data``; nothing is downloaded.
"""

from __future__ import annotations

import csv
import gzip
import os
from pathlib import Path
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.time import Time
from numpy.typing import NDArray

from flybystab.errors import InvalidInput
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.orbit import Orbit
from flybystab.orbit.search.encounter_finder import find_encounters

SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[3] / "../shared")) / "data"
ORBITS, APPROACHES = "nea_sbdb_fullprec_2020-09.csv.gz", "cad_earth_2020_jan_jun.csv.gz"
SPAN = Time(2458840.5, format="jd", scale="tdb"), Time(2459040.5, format="jd", scale="tdb")
COMETS = ("CometA", "COM", "ETc", "HTC", "JFc", "JFC", "HYP", "PAR")
UNIT = u.au / u.d**2


class Errors(NamedTuple):
    """Each event of JPL's list compared with the encounter found nearest in time.

    Attributes
    ----------
    events : list of dict
        Rows of the list.
    distance : ndarray
        Distance found minus distance listed, km; nan without an encounter within a day.
    time : ndarray
        Time found minus time listed, s.
    growth : ndarray
        Displacement of a neighbour over that at the epoch.
    """

    events: list[dict[str, str]]
    distance: NDArray[np.float64]
    time: NDArray[np.float64]
    growth: NDArray[np.float64]


def read(name: str, folder: Path = SHARED) -> list[dict[str, str]]:
    """Rows of one of the files.

    Raises
    ------
    InvalidInput
        The file does not exist.
    """
    path = folder / name
    if not path.is_file():
        raise InvalidInput("FLYBYSTAB_SHARED", str(folder), f"a folder with data/{name}")
    with gzip.open(path, "rt") as file:
        return list(csv.DictReader(file))


def orbits(folder: Path = SHARED) -> dict[str, tuple[Orbit, str]]:
    """Orbits of SBDB of September 2020 by primary designation, with the number of the solution."""
    out = {}
    for row in read(ORBITS, folder):
        if not row["a"] or row["class"] in COMETS:
            continue
        i, node, peri, mean = (float(row[k]) * u.deg for k in ("i", "om", "w", "ma"))
        orbit = Orbit.from_elements(
            Time(float(row["epoch"]), format="jd", scale="tdb"),
            float(row["a"]) * u.au,
            float(row["e"]),
            i,
            node,
            peri,
            mean,
            A1=float(row["A1"] or 0.0) * UNIT,
            A2=float(row["A2"] or 0.0) * UNIT,
            A3=float(row["A3"] or 0.0) * UNIT,
            name=row["pdes"],
        )
        out[row["pdes"]] = orbit, row["orbit_id"].replace("JPL", "").strip()
    return out


def approaches(
    known: dict[str, tuple[Orbit, str]], name: str, folder: Path = SHARED, growth: bool = False
) -> Errors:
    """The events of JPL's list against a search from its orbits with an ephemeris."""
    events = [e for e in read(APPROACHES, folder) if e["des"] in known]
    names = sorted({e["des"] for e in events})
    place = {n: i for i, n in enumerate(names)}
    table = find_encounters(
        [known[n][0] for n in names], *SPAN, within=0.6 * u.au, ephemeris=ephemeris(name), growth=growth
    )
    index, jd = np.array(table["index"]), np.array(table["time"].jd)
    km = table["distance"].to_value(u.km)
    out = np.full((3, len(events)), np.nan)
    for k, event in enumerate(events):
        rows = np.flatnonzero(index == place[event["des"]])
        gap = jd[rows] - float(event["jd"])
        if rows.size and np.abs(gap).min() < 1.0:
            best = int(np.argmin(np.abs(gap)))
            out[:2, k] = km[rows[best]] - float(event["dist"]) * u.au.to(u.km), gap[best] * 86400.0
            out[2, k] = table["growth"][rows[best]] if growth else np.nan
    return Errors(events, *out)
