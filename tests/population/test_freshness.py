"""Probability of a fresh surface."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable
from astropy.time import Time

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.population.freshness import fresh_fraction, fresh_probability, freshness

APOPHIS = fs.Asteroid.from_catalogue("Apophis")


def test_poisson_encounters_beyond_the_span():
    none = np.zeros(0)
    assert fresh_probability([none], 0.0, 2e-6, 1e6) == pytest.approx(1 - np.exp(-2))
    assert fresh_probability([none], 100.0, 2e-6, 50.0) == 0.0
    assert fresh_probability([np.array([30.0])], 100.0, 0.0, 50.0) == 1.0
    assert fresh_probability([np.array([80.0])], 100.0, 0.0, 50.0) == 0.0
    half = fresh_probability([np.array([30.0]), none], 100.0, 1e-6, 1e6)
    assert half == pytest.approx(0.5 + 0.5 * (1 - np.exp(-1e-6 * (1e6 - 100))))
    with pytest.raises(InvalidInput, match="ages"):
        fresh_probability([], 100.0, 0.0, 50.0)


def test_poisson_law_by_simulation():
    """Ages of the last encounter of random histories, the first 2e5 yr of which are followed."""
    rng = np.random.default_rng(1)
    rate, span, weathering = 1.5e-6, 2e5, 1e6
    last = rng.exponential(1 / rate, 200_000)
    followed = [np.array([x]) if x < span else np.zeros(0) for x in last[:20_000]]
    assert fresh_probability(followed, span, rate, weathering) == pytest.approx(
        np.mean(last < weathering), abs=0.01
    )


def test_apophis_before_and_after_2029():
    limits = {"earth": 45_000 * u.km}
    before = freshness(APOPHIS, limits, now=Time("2028-01-01", scale="tdb"))
    assert len(before.followed) == 0
    expected = fs.encounter_rates([APOPHIS], "earth", periapsis=limits["earth"]).rate[0]
    assert before.rate.to_value(1 / u.yr) == pytest.approx(expected.to_value(1 / u.yr))
    years = 1e6 - 100
    assert before.probability == pytest.approx(1 - np.exp(-expected.to_value(1 / u.yr) * years))
    after = freshness(APOPHIS, limits, now=Time("2030-01-01", scale="tdb"), span=5 * u.yr)
    assert after.followed["time"][0].iso[:10] == "2029-04-13"
    assert after.probability == 1.0
    with pytest.raises(InvalidInput, match="distances"):
        freshness(APOPHIS, {})


def test_an_encounter_counts_with_the_share_of_the_orbits_that_have_it():
    """The distance in 2029 of clones spreads by about 1 km: a limit at their median has half of them inside."""
    orbit = APOPHIS.orbit
    spread = fs.encounter_distribution(orbit, "earth", Time("2029-04-13", scale="tdb"), n=24, seed=3)
    limit = {"earth": np.median(spread.distance.to_value(u.km)) * u.km}
    options = {"now": Time("2030-01-01", scale="tdb"), "span": 5 * u.yr, "weathering": 1e4 * u.yr}
    found = freshness(APOPHIS, limit, clones=24, seed=3, **options)
    assert found.share_followed == 0.5
    assert len(np.unique(found.followed["index"])) == 12
    beyond = 1 - np.exp(-found.rate.to_value(1 / u.yr) * (1e4 - 5))
    assert found.probability == pytest.approx(0.5 + 0.5 * beyond, rel=1e-9)
    inside = {"earth": limit["earth"] + 30 * u.km}
    assert freshness(APOPHIS, inside, clones=6, **options).probability == 1.0
    body = fs.Body([200, 170, 150] * u.m, 2000 * u.kg / u.m**3, 5 * u.h)
    bare = fs.Asteroid(orbit=replace(orbit, covariance=None), body=body)
    with pytest.raises(InvalidInput, match="covariance"):
        freshness(bare, limit, clones=6, **options)


def test_the_fresh_share_of_a_population_is_the_mean_over_its_orbits():
    orbits = QTable(
        {"a": [1.2, 1.5] * u.au, "e": [0.45, 0.5], "i": [5.0, 10.0] * u.deg, "weight": [3.0, 1.0]}
    )
    rates = fs.encounter_rates(orbits, "earth", 16 * fs.R_earth).rate.to_value(1 / u.yr)
    expected = np.average(1 - np.exp(-1e6 * rates), weights=[3.0, 1.0])
    assert fresh_fraction(orbits, {"earth": 16.0}) == pytest.approx(expected, rel=1e-9)
    both = fresh_fraction(orbits, {"earth": 16.0, "venus": 16.0})
    assert expected < both < 1.0
    with pytest.raises(InvalidInput, match="radii"):
        fresh_fraction(orbits, {"earth": 0.5})
