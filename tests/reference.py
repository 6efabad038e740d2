"""Where the reference data are, and ephemerides that a test cannot do without."""

import csv
import os
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

from flybystab.errors import MissingExtra
from flybystab.orbit.ephemeris import ephemeris
from flybystab.orbit.orbit import Orbit

SHARED = Path(os.environ.get("FLYBYSTAB_SHARED", Path(__file__).resolve().parents[2] / "shared"))


def need_ephemeris(name):
    """The ephemeris of that name; the test is skipped where it is not installed."""
    try:
        return ephemeris(name)
    except MissingExtra as error:
        pytest.skip(str(error))


def sbdb_orbit(row):
    """Orbit of a row of the Small-Body Database with full precision."""
    unit = u.au / u.d**2
    return Orbit.from_elements(
        Time(float(row["epoch"]), format="jd", scale="tdb"),
        float(row["a"]) * u.au,
        float(row["e"]),
        *(float(row[k]) * u.deg for k in ("i", "om", "w", "ma")),
        **{k: float(row[k] or 0) * unit for k in ("A1", "A2", "A3")},
        name=row["pdes"],
    )


def horizons_track(shared, slug):
    """Orbit before a flyby; seconds past J2000 (TDB) and geocentric places (km, ICRF) of Horizons."""
    with (shared / "preflyby_states_fitted.csv").open() as file:
        (state,) = (r for r in csv.DictReader(file) if r["slug"] == slug)
    whole, _, rest = state["epoch_jd_tdb"].partition(".")
    orbit = Orbit.from_state(
        Time(float(whole), float("0." + rest), format="jd", scale="tdb"),
        [float(state[c]) for c in ("x_au_helio_icrf", "y_au", "z_au")] * u.au,
        [float(state[c]) for c in ("vx_au_d", "vy_au_d", "vz_au_d")] * u.au / u.d,
    )
    with (shared / "horizons_geocentric_tracks.csv").open() as file:
        points = [r for r in csv.DictReader(file) if r["slug"] == slug]
    seconds = np.array([float(r["tdb_s_past_j2000"]) for r in points])
    return orbit, seconds, np.array([[float(r[c]) for c in ("x_km", "y_km", "z_km")] for r in points])
