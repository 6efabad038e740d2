"""Geocentric points of Horizons through three flybys, from the state before each."""

import csv

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.orbit.orbit import Orbit, later

J2000 = Time(2451545.0, format="jd", scale="tdb")


# The states were fitted to the points, with residuals of 1.6 m, 1.6 m and 118 m, and the Earth's pole of 2000.
@pytest.mark.parametrize(
    ("slug", "largest"), [("toutatis-2004", 25.0), ("2005-yu55-2011", 10.0), ("2012-tc4-2017", 150.0)]
)
def test_every_point(shared, slug, largest):
    need_ephemeris("de440")
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
    assert len(points) > 20
    for row in points:
        time = later(J2000, float(row["tdb_s_past_j2000"]))
        want = np.array([float(row[c]) for c in ("x_km", "y_km", "z_km")]) * 1e3
        ours = orbit.at(time, "earth", "de440")[0].to_value(u.m)
        assert np.linalg.norm(ours - want) < largest
