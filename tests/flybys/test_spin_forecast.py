"""Forecast of the rotation after an encounter."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from scenes import earth

import flybystab as fs
from flybystab.errors import InvalidInput
from flybystab.flybys.spin_forecast import spin_forecast

APOPHIS = fs.Asteroid.from_catalogue("Apophis")


def test_far_from_a_planet_the_rotation_stays():
    found = spin_forecast(APOPHIS, earth(60.0, start=70.0), n=4)
    assert found.precession_period.to_value(u.h) == pytest.approx(27.38547, rel=2e-3)
    assert found.rotation_period.to_value(u.h) == pytest.approx(264.178, rel=2e-2)
    assert set(found.mode) == {"SAM"}
    assert found.pole_change.value.max() < 0.2


def test_it_is_the_spin_sample_of_the_same_phases():
    encounter = fs.Encounter.from_orbit(APOPHIS.orbit, "earth", Time("2029-04-13", scale="tdb"))
    found = spin_forecast(APOPHIS, encounter, n=8, seed=3)
    sample = fs.spin_sample(APOPHIS, encounter, n=8, seed=3)
    _, momentum, j = APOPHIS._tumbling
    before = 2 * np.pi * j / momentum / 3600
    assert before / found.effective_period.to_value(u.h) == pytest.approx(sample.spin_ratio, rel=1e-5)
    assert found.pole_change.value == pytest.approx(sample.pole_change.value, rel=1e-3, abs=1e-3)
    longitude, latitude = found.ecliptic
    # the poles lie around the catalogued one, (275, -85) deg
    assert np.all(latitude < -50 * u.deg)
    assert longitude.min() >= 0 * u.deg
    turned = spin_forecast(APOPHIS, encounter, n=8, seed=3, turned=5 * u.deg)
    assert np.max(np.abs((turned.precession_period - found.precession_period).value)) > 0.1


def test_alternative_solutions():
    other = APOPHIS.with_tumbling(27.374 * u.h, 262.2 * u.h, inertia=(0.61, 0.965))
    j = other.body.inertia.value
    assert j[:2] / j[2] == pytest.approx([0.61, 0.965], rel=1e-12)
    assert other.body.volume.value == pytest.approx(APOPHIS.body.volume.value, rel=1e-12)
    assert other.quantity("precession_period_h") == 27.374 * u.h
    with pytest.raises(InvalidInput, match="inertia"):
        APOPHIS.with_tumbling(27 * u.h, 262 * u.h, inertia=(0.3, 0.6))
    with pytest.raises(InvalidInput, match="Encounter"):
        spin_forecast(APOPHIS, earth(0.9))
