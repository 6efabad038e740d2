"""Geocentric points of Horizons through three flybys, from the state before each."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import horizons_track, need_ephemeris

from flybystab.orbit.epochs import later

J2000 = Time(2451545.0, format="jd", scale="tdb")


# The states were fitted to the points, with residuals of 1.6 m, 1.6 m and 118 m, and the Earth's pole of 2000.
@pytest.mark.parametrize(
    ("slug", "largest"), [("toutatis-2004", 25.0), ("2005-yu55-2011", 10.0), ("2012-tc4-2017", 150.0)]
)
def test_every_point(shared, slug, largest):
    need_ephemeris("de440")
    orbit, seconds, places = horizons_track(shared, slug)
    assert len(places) > 20
    for second, place in zip(seconds, places, strict=True):
        time = later(J2000, float(second))
        want = place * 1e3
        ours = orbit.at(time, "earth", "de440")[0].to_value(u.m)
        assert np.linalg.norm(ours - want) < largest
