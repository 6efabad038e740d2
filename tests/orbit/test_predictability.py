"""Sigma points of an orbit, the growth of errors by two integrators, and the classes of predictability."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.errors import NoEncounter, OutOfSpan
from flybystab.orbit.elements import GM_SUN
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import FORCES
from flybystab.orbit.kepler import two_body
from flybystab.orbit.osculating_state import heliocentric
from flybystab.orbit.predictability import (
    MODEL_ERROR,
    Predictability,
    deviations_of,
    predictability,
    undisturbed_error,
)

DAY = Time("2029-04-13", scale="tdb")


@pytest.fixture(scope="module")
def known():
    return fs.Asteroid.from_catalogue("Apophis").orbit


@pytest.fixture(scope="module")
def exact(known):
    return replace(known, covariance=None)


def test_judgement():
    assert predictability(100.0, 9.0, 1.0) is Predictability.DETERMINED
    assert predictability(100.0, 1.0, 10.0) is Predictability.UNCERTAIN
    assert predictability(100.0, 100.0) is Predictability.ONE_OF_MANY
    assert predictability(100.0, 0.0, np.inf) is Predictability.ONE_OF_MANY
    assert predictability(100.0, 1.0, known=False) is Predictability.UNKNOWN
    assert predictability(100.0, 20.0, known=False) is Predictability.UNCERTAIN


def test_the_displacement_is_the_longest_axis_of_the_mapped_covariance(known):
    """By the other integrator, from the public sigma points."""
    span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
    row = fs.find_encounters(known, *span, within=0.01 * u.au, growth=True)[0]
    time = row["time"]
    ways = [0.5 * (a.at(time)[0] - b.at(time)[0]).to_value(u.m) for a, b in known.sigma_points()]
    longest = np.linalg.svd(np.array(ways))[1][0]
    assert row["displacement"].to_value(u.m) == pytest.approx(longest, rel=0.01)
    assert "one sigma" in deviations_of(known).label


def test_the_error_of_the_model_without_passages(known):
    """It begins with that of an epoch near by and grows with time; only passages add more."""
    orbit = fs.Asteroid.from_catalogue("Eros").orbit
    span = Time("2026-01-01", scale="tdb"), Time("2046-01-01", scale="tdb")
    table = fs.find_encounters(orbit, *span, within=0.5 * u.au, growth=True)
    years = np.abs((table["time"] - deviations_of(orbit).orbit.epoch).to_value(u.s))
    assert table["model_error"].to_value(u.m) == pytest.approx(undisturbed_error(years))
    assert undisturbed_error(np.zeros(1))[0] == MODEL_ERROR


def test_growth_of_a_quiet_orbit_is_that_of_two_bodies():
    """A metre away from the Sun changes the period: Eros, 20 years."""
    orbit = replace(fs.Asteroid.from_catalogue("Eros").orbit, covariance=None)
    start, stop = Time("2040-01-01", scale="tdb"), Time("2046-01-01", scale="tdb")
    row = fs.find_encounters(orbit, start, stop, within=1 * u.au, growth=True)[0]
    t = seconds(row["time"], orbit.epoch)
    state = heliocentric(orbit)
    out = np.concatenate([state[:3] / np.linalg.norm(state[:3]), np.zeros(3)])
    gap = two_body(GM_SUN, state + out, t) - two_body(GM_SUN, state, t)
    assert row["growth"] == pytest.approx(np.linalg.norm(gap[:3]), rel=0.05)
    assert row["displacement"].to_value(u.m) == pytest.approx(row["growth"])
    # No error of this orbit is known: a shift of a metre does not make it determined.
    assert row["predictability"] == "unknown"


def test_two_integrators_agree_on_the_growth(exact, known):
    for orbit, grade in ((exact, "unknown"), (known, "determined")):
        span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
        row = fs.find_encounters(orbit, *span, within=0.01 * u.au, growth=True)[0]
        encounter = fs.Encounter.from_orbit(orbit, "earth", DAY)
        assert encounter.predictability == row["predictability"] == grade
        assert encounter.growth == pytest.approx(row["growth"], rel=0.002)
    assert encounter.displacement.to_value(u.km) == pytest.approx(1.1, abs=0.2)  # JPL: 3.3 km at 3 sigma
    assert encounter.neighbour == "one sigma in the direction least known"


def test_growth_after_a_deep_encounter(exact):
    """A metre before the 2029 passage is five kilometres a year later."""
    need_ephemeris("de440")
    table = fs.find_encounters(
        exact,
        Time("2029-01-01", scale="tdb"),
        Time("2052-01-01", scale="tdb"),
        within=0.1 * u.au,
        ephemeris="de440",
        growth=True,
    )
    first, second = table["displacement"][:2].to_value(u.km)
    years = (table["time"][1] - table["time"][0]).to_value(u.yr)
    assert second / (first * 1e3) / years == pytest.approx(5.0, rel=0.1)


@pytest.mark.parametrize(
    ("day", "returns"), [("2028-09-12", False), ("2036-03-27", True), ("2051-04-20", True)]
)
def test_the_error_of_a_return_holds_another_ephemeris(exact, day, returns):
    """Two ephemerides differ by metres at the Earth: past 2029 that is hundreds of kilometres."""
    need_ephemeris("de440")
    ours, other = (
        fs.Encounter.from_orbit(
            exact,
            "earth",
            Time(day, scale="tdb"),
            within=0.6 * u.au,
            ephemeris=name,
            forces=FORCES[: FORCES.index("1PN") + 1],
        )
        for name in ("de440", "de421")
    )
    gap = abs(ours.distance - other.distance).to_value(u.km)
    error = ours.distance_error.to_value(u.km)
    assert (error > 100.0) == returns
    if returns:
        assert 0.5 * gap < error < 10.0 * gap
    assert ours.time_error.to_value(u.s) > 0.0


def test_centuries_end_in_a_statement(known):
    need_ephemeris("de440")
    later = Time("2147-09-20", scale="tdb")
    # which passages there are depends on the last digit of the model: some minimum of the distance there is
    encounter = fs.Encounter.from_orbit(
        known, "earth", later, search=3000 * u.d, within=1 * u.au, ephemeris="de440"
    )
    assert encounter.predictability is Predictability.ONE_OF_MANY
    assert encounter.displacement > encounter.distance
    with pytest.raises(NoEncounter, match=r"cannot be predicted that far.* au at this time"):
        fs.Encounter.from_orbit(
            known, "earth", Time("2182-08-31", scale="tdb"), within=1e4 * u.km, ephemeris="de440"
        )
    with pytest.raises(OutOfSpan):
        fs.Encounter.from_orbit(known, "earth", Time("2700-01-01", scale="tdb"), ephemeris="de440")


def test_a_distant_passage_centuries_away_converges():
    """Rounding of the way limits where r.v = 0 can be found."""
    need_ephemeris("de440")
    encounter = fs.Encounter.from_orbit(
        fs.Asteroid.from_catalogue("Eros").orbit,
        "earth",
        Time("2600-01-01", scale="tdb"),
        search=400 * u.d,
        within=1 * u.au,
        ephemeris="de440",
    )
    assert encounter.predictability is Predictability.DETERMINED


def test_impacts_are_judged_too(exact):
    """A body on its way to the Earth: displaced orbits hit as well, but no error of the orbit is known."""
    epoch = Time("2027-03-01", scale="tdb")
    orbit = fs.Orbit.from_state(epoch, [-1.3e6, 4e3, 3e3] * u.km, [15, 0, 0] * u.km / u.s, centre="earth")
    table = fs.find_encounters(orbit, epoch, Time("2027-03-03", scale="tdb"), growth=True)
    assert table["impact"][0]
    assert table["predictability"][0] == "unknown"
    encounter = fs.Encounter.from_orbit(orbit, "earth", table["time"][0])
    assert encounter.predictability is Predictability.UNKNOWN
