"""States of asteroids by JPL's small-body code, from a table of the reference data."""

from __future__ import annotations

import csv
from pathlib import Path

import astropy.units as u
from astropy.time import Time

from flybystab.orbit.orbit import Orbit

#: Centres of the table by their names for :meth:`Orbit.from_state`.
_CENTRES = {"Sun": "sun", "SSB": "ssb"}


def reference_orbits(path: Path) -> dict[str, Orbit]:
    """Orbits of the states in ``states_reference.csv``, by the column ``id``.

    Columns: epoch (JD, TDB), centre, position and velocity (ICRF axes) in the given units, and A1, A2, A3 (au/d2).
    """
    out = {}
    with path.open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            length, speed = (u.Unit(text) for text in row["units"].split("_"))
            position, velocity = ([float(row[p + c]) for c in "xyz"] for p in ("", "v"))
            a1, a2, a3 = (float(row[f"A{k}_au_d2"]) * u.au / u.d**2 for k in (1, 2, 3))
            epoch = Time(float(row["epoch_jd_tdb"]), format="jd", scale="tdb")
            centre = _CENTRES[row["center"]]
            out[row["id"]] = Orbit.from_state(
                epoch, position * length, velocity * speed, centre, "ICRF", a1, a2, a3, name=row["object"]
            )
    return out
