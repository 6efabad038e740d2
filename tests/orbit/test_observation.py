"""Orbits in skyfield: against points of Horizons, and apparent places against astropy (ERFA)."""

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import (
    ICRS,
    TETE,
    AltAz,
    CartesianRepresentation,
    EarthLocation,
    SkyCoord,
    solar_system_ephemeris,
)
from astropy.time import Time
from astropy.utils import iers
from reference import horizons_track, need_ephemeris

import flybystab as fs
from flybystab.cli.main import main
from flybystab.constants import C_LIGHT
from flybystab.errors import InvalidInput, UnknownName
from flybystab.orbit.observation import phase_function, sky_positions, skyfield_times
from flybystab.orbit.observatories import CODES, observer
from flybystab.orbit.vector_function import ephemeris_file

J2000 = Time(2451545.0, format="jd", scale="tdb")
TRACKS = [("toutatis-2004", 0.005), ("2005-yu55-2011", 0.01), ("2012-tc4-2017", 0.2)]


def track(shared, slug):
    """Orbit before a flyby; times and geocentric places (km, ICRF) of Horizons."""
    orbit, seconds, places = horizons_track(shared, slug)
    return orbit, J2000 + seconds * u.s, places


@pytest.mark.parametrize(("slug", "km"), TRACKS)
@pytest.mark.parametrize("centre", ["sun", "ssb"])
def test_geometric_places_are_those_of_horizons(shared, slug, km, centre):
    need_ephemeris("de440")
    orbit, times, want = track(shared, slug)
    file = ephemeris_file("de440")
    path = orbit.to_skyfield(centre, "de440")
    path = file["sun"] + path if centre == "sun" else path
    t = skyfield_times(times)
    away = (path.at(t).xyz.km - file["earth"].at(t).xyz.km).T
    assert np.linalg.norm(away - want, axis=1).max() < km
    # The direction to far better than an arcsecond; one time gives what many give.
    angle = np.linalg.norm(np.cross(away, want), axis=1) / np.sum(want**2, axis=1)
    assert np.degrees(angle.max()) * 3600 < 0.2
    one = (
        path.at(skyfield_times(times[3])).xyz.km.ravel()
        - file["earth"].at(skyfield_times(times[3])).xyz.km.ravel()
    )
    assert np.linalg.norm(one - away[3]) < 1e-3


@pytest.mark.parametrize("place", [None, "568", "-30.24,-70.74,2200"])
def test_apparent_places_are_those_of_astropy(shared, place):
    """Light time by hand, aberration, deflection, precession, nutation and horizon by ERFA instead of skyfield."""
    need_ephemeris("de440")
    orbit, times, _ = track(shared, "2005-yu55-2011")
    times = times[:: len(times) // 5]
    where = None if place is None else observer(place)
    table = sky_positions(orbit, times, where, 21.3, eph="de440")
    file = ephemeris_file("de440")
    with (
        solar_system_ephemeris.set(str(need_ephemeris("de440").path)),
        iers.conf.set_temp("auto_download", False),
    ):
        for k, time in enumerate(times):
            site = EarthLocation.from_geocentric(0, 0, 0, u.m)
            if where is not None:
                site = EarthLocation.from_geodetic(
                    where.longitude * u.deg, where.latitude * u.deg, where.height * u.m
                )
            here = file["earth"].at(skyfield_times(time)).xyz.m.ravel()
            here = here + site.get_gcrs_posvel(time)[0].xyz.to_value(u.m)
            late = 0.0
            for _ in range(4):
                there = orbit.at(time - late * u.s, "ssb", "de440")[0].to_value(u.m)
                late = np.linalg.norm(there - here) / C_LIGHT
            assert table["distance"][k].to_value(u.m) == pytest.approx(C_LIGHT * late, rel=1e-7)
            coord = SkyCoord(ICRS(CartesianRepresentation(there * u.m)))
            frame = TETE(obstime=time, location=site)
            seen = coord.transform_to(frame)
            ours = SkyCoord(table["ra"][k], table["dec"][k], frame=frame)
            assert seen.separation(ours).to_value(u.arcsec) < 0.3
            if where is not None:
                horizon = coord.transform_to(AltAz(obstime=time, location=site))
                ours = AltAz(alt=table["altitude"][k], az=table["azimuth"][k], obstime=time, location=site)
                # Delta T, polar motion
                assert SkyCoord(horizon).separation(SkyCoord(ours)).to_value(u.arcsec) < 5.0


def test_rates_are_differences_of_places(shared):
    need_ephemeris("de440")
    orbit, times, _ = track(shared, "toutatis-2004")
    near = times[5] + np.array([-2.0, 0.0, 2.0]) * u.min
    table = sky_positions(orbit, near, observer("F51"), eph="de440")
    east = (
        (table["ra"][2] - table["ra"][0]).to_value(u.arcsec) * np.cos(table["dec"][1].to_value(u.rad)) / 4.0
    )
    north = (table["dec"][2] - table["dec"][0]).to_value(u.arcsec) / 4.0
    assert table["ra_rate"][1].value == pytest.approx(east, rel=1e-4)
    assert table["dec_rate"][1].value == pytest.approx(north, rel=1e-4)


def test_magnitude():
    """At a phase angle of 90 deg, where tan(phase/2) = 1, the two exponentials are e^-3.33 and e^-1.87."""
    assert phase_function(0.0, 0.15) == 1.0
    assert phase_function(np.pi / 2, 0.15) == pytest.approx(0.85 * 0.035793 + 0.15 * 0.154124, rel=1e-4)
    assert np.all(np.diff(phase_function(np.linspace(0.0, 2.0, 50), 0.15)) < 0.0)


def test_places_of_observatories():
    assert observer("500") is None
    mauna_kea = observer("568")
    assert mauna_kea.latitude == pytest.approx(19.826, abs=0.01)
    assert mauna_kea.height == pytest.approx(4200, abs=100)
    assert observer("000").latitude == pytest.approx(51.477, abs=0.01)
    assert observer("10, 20").height == 0.0
    for code in CODES[1:]:
        assert -100.0 < observer(code).height < 5000.0
    with pytest.raises(UnknownName, match="give LAT,LON,ALT"):
        observer("Z99")
    for bad in ("100,0,0", "1,2,3,4", "a,b", "nan,0"):
        with pytest.raises(InvalidInput):
            observer(bad)


def test_the_command(capsys):
    arguments = ["ephemeris", "Apophis", "--from", "2029-04-10", "--to", "2029-04-15", "--step", "12h"]
    assert main([*arguments, "--observer", "568"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3 + 11
    assert "Maunakea" in lines[0]
    assert main([*arguments, "--json"]) == 0
    assert '"ra_deg"' in capsys.readouterr().out
    assert main([*arguments, "--step", "0d"]) == 2
    assert main([*arguments, "--observer", "Z99"]) == 1
    assert main([*arguments, "--to", "2000-01-01"]) == 2
    # Third magnitude at the passage of 2029 (Giorgini et al. 2008: V = 3.1 to 3.4).
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    table = sky_positions(orbit, Time(["2029-04-13T19:00", "2029-04-13T21:00"], scale="tdb"), None, 19.09)
    assert 3.0 < table["V"].value.min() < 4.0
