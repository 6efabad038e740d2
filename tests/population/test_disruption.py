"""Rates of verdicts: budgets against encounter rates, limits of strong material, sampling errors that hold."""

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable

import flybystab as fs
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.screening.priors import Population

RNG = np.random.default_rng(1)
ORBITS = QTable({"a": RNG.uniform(0.9, 2.5, 50), "e": RNG.uniform(0.3, 0.7, 50), "i": RNG.uniform(2, 30, 50)})


@pytest.fixture(scope="module")
def earth():
    return fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=4)


def test_the_verdicts_add_up_to_the_encounters(earth):
    radius = earth_radius()
    total = fs.encounter_rates(ORBITS, "earth", 5 * radius).total
    assert earth.table["rate"].sum().value == pytest.approx(total.value, rel=1e-12)
    impact = fs.encounter_rates(ORBITS, "earth", radius + 100 * u.km).total
    assert earth.rate("IMPACT").value == pytest.approx(impact.value, rel=1e-12)
    assert earth.samples["weight"].sum().value == pytest.approx((total - impact).value, rel=1e-12)


def earth_radius():
    return fs.encounter_rates(ORBITS, "earth").planet.radius * u.m


def test_periapses_lie_in_their_strata_and_every_stratum_has_as_many(earth):
    q = earth.samples["periapsis"].to_value(u.km)
    low, high = earth_radius().to_value(u.km) + 100.0, 5 * earth_radius().to_value(u.km)
    counts, _ = np.histogram(q, np.linspace(low, high, 9))
    assert np.all(counts == 20)


def test_strong_bodies_stay_intact():
    strong = Population.from_mapping({"cohesion_Pa": {"kind": "fixed", "value": 1e7}})
    rates = fs.disruption_rates(ORBITS, ["earth"], samples=16, priors=strong)
    assert rates.rate("INTACT").value > 0.0
    assert rates.rate("RESHAPED").value == 0.0
    assert rates.lifetime("RESHAPED", "BEYOND MODEL", "DISRUPTED") == np.inf * u.Myr
    # what was not met has the rate of one sample as its error
    row = rates.table[rates.table["verdict"] == "RESHAPED"]
    assert row["rate_error"][0] > 0.0 / u.yr


def test_other_seeds_agree_within_the_sampling_error(earth):
    other = fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=5)
    for verdict in ("INTACT", "RESHAPED"):
        one, two = (r.table[r.table["verdict"] == verdict][0] for r in (earth, other))
        sigma = np.hypot(one["rate_error"].value, two["rate_error"].value)
        assert abs(one["rate"].value - two["rate"].value) < 3.5 * sigma


def test_threads_and_repetition_change_nothing(earth):
    again = fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=4, workers=1)
    assert np.array_equal(again.samples["verdict"], earth.samples["verdict"])
    assert np.array_equal(again.table["rate"].value, earth.table["rate"].value)


def test_lifetime_and_change_of_spin(earth):
    disturbed = earth.rate("RESHAPED") + earth.rate("BEYOND MODEL")
    assert earth.lifetime("RESHAPED", "BEYOND MODEL").value == pytest.approx(
        50e-6 / disturbed.value, rel=1e-12
    )
    assert earth.spin_change_rate(0.0) <= earth.rate("INTACT")
    assert earth.spin_change_rate(0.5) <= earth.spin_change_rate(0.1)


def test_a_population_out_of_reach_has_no_verdicts():
    far = QTable({"a": [3.0], "e": [0.1], "i": [5.0]})
    rates = fs.disruption_rates(far, ["earth"], samples=8)
    assert len(rates.samples) == 0
    assert rates.rate("INTACT").value == 0.0
    assert rates.spin_change_rate(0.1).value == 0.0


def test_bad_input_is_named():
    with pytest.raises(UnitMismatch):
        fs.disruption_rates(ORBITS, ["earth"], diameter=1000.0)
    with pytest.raises(InvalidInput, match="samples"):
        fs.disruption_rates(ORBITS, ["earth"], samples=3)
    with pytest.raises(InvalidInput, match="at least one planet"):
        fs.disruption_rates(ORBITS, [])
