"""What digits and U of the MPC say of an orbit: classes, the middle of the arc, and encounters behind a deep one."""

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import GCRS, ITRS, CartesianRepresentation
from astropy.time import Time

import flybystab as fs
from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.orbit_errors import FACTOR, FACTOR_UNRELIABLE, error_of, runoff
from flybystab.catalogues.readers.arcs import arc_columns
from flybystab.catalogues.readers.mpc import from_mpc
from flybystab.constants import AU, YEAR
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.epochs import later
from flybystab.orbit.kepler import two_body
from flybystab.orbit.osculating_state import heliocentric
from flybystab.orbit.predictability import deviations_of, predictability
from flybystab.screening.clones import orbit_sampling
from flybystab.screening.encounters import CloseApproach

# MPCORB as of February 2026
HEAD = "number,name,principal_desig,epoch_jd_tt,a_au,e,i_deg,node_deg,peri_deg,M_deg,n_deg_d,U,arc,last_obs"
ROWS = {
    "Duende": "367943,Duende,2012 DA14,2461000.5,0.9102541,0.0894753,11.6101,146.90817,195.63687,51.74369,1.13490659,2,"
    "2012-2013,2013-02-21",
    "Apophis": "99942,Apophis,2004 MN4,2461000.5,0.9223803,0.1911663,3.34096,203.89965,126.67283,312.80547,1.11259993,"
    "0,2004-2021,2021-05-20",
    "2023 CX1": ",,2023 CX1,2459988.5,1.6854528,0.4551803,3.56508,323.83256,219.03655,346.26399,0.45043195,"
    "5,0 d,2023-02-13",
    "2024 BX1": ",,2024 BX1,2460329.5,1.3364558,0.3754714,7.29282,300.11837,243.65808,329.26447,0.63792872,"
    "5,0 d,2024-01-21",
}


def mpc(name, **changes):
    row = dict(zip(HEAD.split(","), ROWS[name].split(","), strict=True)) | changes
    return Asteroid(from_mpc(row, "MPCORB"), file="MPCORB")


def test_classes_are_those_of_the_mpc():
    """Upper edges, arcsec in ten years: https://minorplanetcenter.net/iau/info/UValue.html."""
    edges = [1.0, 4.4, 19.6, 86.5, 382, 1692, 7488, 33121, 146502]
    middles = [np.degrees(runoff(c)) * 3600.0 * 10.0 * YEAR for c in range(10)]
    for c, edge in enumerate(edges):
        assert middles[c] < edge < middles[c + 1]


def test_mean_motion_gives_the_axis_its_digits():
    """JPL's axis of Apophis: eight digits of n determine it better than seven of a."""
    truth = fs.Asteroid.from_catalogue("Apophis")
    assert float(truth.row["epoch_jd_tdb"]) == 2461000.5
    a = float(truth.row["a_au"])
    assert abs(float(mpc("Apophis").row["a_au"]) - a) < 1e-8
    assert abs(float(mpc("Apophis", n_deg_d="").row["a_au"]) - 0.9223803) < 1e-12
    # a mean motion of something else is not believed
    assert mpc("Apophis", n_deg_d="1.2").row["a_au"] == "0.9223803"


def test_the_longitude_is_known_where_it_was_observed():
    """Without rounding only U is left: sigma vanishes in the middle of the arc and grows by the runoff from there."""
    row = dict(mpc("Duende").row) | {"orbit_source": "elsewhere"}
    rock = Asteroid(row, file="elsewhere")
    covariance = rock.orbit.covariance
    assert "U of elsewhere" in covariance.source
    assert covariance.caveat == "by the U of its elements"
    seen = Time(float(row["observed_jd"]), format="jd", scale="tdb")
    assert 2012.9 < seen.jyear < 2013.1
    axis = float(row["a_au"]) * AU
    (way,) = np.linalg.svd(covariance.matrix)[0][:, :1].T * np.sqrt(np.linalg.svd(covariance.matrix)[1][0])
    for years, share in ((0.0, 0.0), (10.0, 1.0), (-10.0, 1.0)):
        t = (seen - rock.epoch).to_value(u.s) + years * YEAR
        gap = np.linalg.norm(
            np.subtract(*(two_body(GM_SUN, covariance.values + k * way, t)[:3] for k in (0.0, 1.0)))
        )
        assert gap == pytest.approx(share * axis * runoff(2) * FACTOR * 10.0 * YEAR, rel=0.2, abs=1e3)


@pytest.mark.parametrize("name", ["2023 CX1", "2024 BX1"])
def test_asteroids_on_their_way_to_the_earth_are_determined(name):
    """Seen for hours before they fell, CX1 off Dieppe and BX1 near Berlin."""
    rock = mpc(name)
    passage = fs.Encounter.from_orbit(rock.orbit, "earth", rock.epoch, search=3 * u.d)
    assert passage.impact
    assert passage.predictability == "determined"
    assert passage.displacement < 100 * u.km
    when = later(passage.time, passage.impact_time).utc
    place = GCRS(CartesianRepresentation(passage.position(passage.impact_time * u.s)), obstime=when)
    found = place.transform_to(ITRS(obstime=when)).earth_location.to_geodetic()
    utc, lat, lon = FELL[name]
    assert abs((when - Time(utc)).to_value(u.s)) < 20.0
    assert abs(found.lat.deg - lat) < 0.3
    assert abs(found.lon.deg - lon) < 1.0


#: Where and when the fireballs were seen (IMO, Jenniskens 2023, Spurny et al. 2024), 20 to 80 km below.
FELL = {"2023 CX1": ("2023-02-13 02:59:13", 49.95, 0.0), "2024 BX1": ("2024-01-21 00:32:40", 52.6, 12.4)}


def test_duende_in_2003_is_not_determined():
    """CNEOS has 2003-08-18 07:57 at 0.0388 au: the elements of 2025 lie behind the passage at 34,000 km of 2013."""
    span = Time("2003-07-01", scale="tdb"), Time("2014-01-01", scale="tdb")
    table = fs.find_encounters(mpc("Duende"), *span, within=0.1 * u.au, growth=True)
    first, last = table[0], table[-1]
    assert first["predictability"] != "determined"
    off = (first["time"] - Time("2003-08-18 07:57", scale="tdb")) * first["v_rel"]
    assert 1e5 * u.km < abs(off) < 2.0 * first["displacement"]
    assert last["predictability"] == "determined"
    assert last["time"].iso[:10] == "2013-02-15"
    assert "digits and U" in table.meta["neighbours"][0]
    passage = fs.Encounter.from_orbit(mpc("Duende").orbit, "earth", first["time"], within=0.1 * u.au)
    assert passage.predictability == first["predictability"]
    assert "digits and U" in passage.neighbour


def test_apophis_in_2029_is_determined():
    span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
    ours, jpl = (
        fs.find_encounters(a, *span, growth=True)[0]
        for a in (mpc("Apophis"), fs.Asteroid.from_catalogue("Apophis"))
    )
    assert ours["predictability"] == "determined"
    away = np.linalg.norm((ours["position"] - jpl["position"]).to_value(u.km))
    assert away < 3.0 * ours["displacement"].to_value(u.km) < 1000.0


def test_an_error_of_the_velocity_alone_has_a_growth():
    """U without an arc: the place is known at the epoch, so the displacement there is none."""
    row = dict(mpc("Apophis").row) | {"orbit_source": "elsewhere", "observed_jd": ""}
    day = Time("2029-04-13", scale="tdb")
    passage = fs.Encounter.from_orbit(Asteroid(row, file="elsewhere").orbit, "earth", day)
    assert 1.0 < passage.growth < np.inf
    assert passage.growth == pytest.approx(passage.displacement.to_value(u.m))


def test_a_screening_says_what_is_known():
    rock = mpc("Apophis")
    note = orbit_sampling(
        CloseApproach(rock, "earth", Time("2029-04-13 21:46", scale="tdb"), 3.8e7, 5.8e3), 10, 0
    ).note
    assert note == "orbit without errors (known only by the digits and U of its elements)"


@pytest.mark.parametrize(
    ("arc", "last", "code", "reliable"),
    [
        ("20 d", "2025-06-01", "5", True),  # one opposition, this year
        ("20 d", "2015-06-01", "5", False),
        ("20 d", "2015-06-01", "2", False),
        ("1998-2012", "2012-06-01", "4", False),  # several oppositions, but weak
        ("1998-2012", "2012-06-01", "1", True),
    ],
)
def test_u_of_weak_orbits_from_old_observations_is_not_reliable(arc, last, code, reliable):
    """No encounter of theirs is determined: of JPL's later orbits more than 1 % are beyond three sigma."""
    rock = mpc("Apophis", U=code, arc=arc, last_obs=last)
    covariance = rock.orbit.covariance
    assert covariance.reliable is reliable
    assert not covariance.digits_alone
    assert deviations_of(rock.orbit).known is reliable
    assert predictability(1e9, 1.0, known=covariance.reliable) == ("determined" if reliable else "unknown")


def test_one_sigma_is_a_part_of_the_runoff():
    """The whole runoff for an orbit whose U is not reliable."""
    good, weak = (
        np.linalg.norm(mpc("Apophis", U="2", arc=arc, last_obs="2015-06-01").orbit.covariance.sigma[3:])
        for arc in ("2014-2016", "20 d")
    )
    assert weak / good == pytest.approx(FACTOR_UNRELIABLE / FACTOR, rel=0.1)


@pytest.mark.parametrize(
    ("first", "last", "single"),
    [
        ("2004-03-15", "2004-04-14", "Y"),
        ("2004-Mar-15", "2021-05-20.25", "N"),
        ("1893-10-29", "2026-02-10", "N"),
    ],
)
def test_arcs_by_their_first_and_last_observation(first, last, single):
    columns = arc_columns(first, last)
    middle = Time([first.replace("Mar", "03"), last.partition(".")[0]], scale="tdb").jd.mean()
    assert float(columns["observed_jd"]) == middle
    assert columns["single_opposition"] == single
    assert not arc_columns(first, None)
    assert not arc_columns("", last)
    assert not arc_columns(last, first)


def test_a_row_that_says_nothing_has_no_covariance():
    row = dict(mpc("Apophis").row) | {"orbit_source": "elsewhere", "condition_code": ""}
    assert error_of(row, Time(2461000.5, format="jd", scale="tdb")) is None
    hyperbola = row | {"orbit_source": "MPC (x)", "a_au": "-2.0", "e": "1.5"}
    assert error_of(hyperbola, Time(2461000.5, format="jd", scale="tdb")) is None
    assert heliocentric(Asteroid(row).orbit).shape == (6,)
