"""Inverse questions, with four well-known asteroids as worked examples."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Body, Material
from flybystab.body.bounds import density_intervals, required_cohesion, requirements
from flybystab.body.equilibrium import equilibrium
from flybystab.errors import InvalidInput

GCC = u.g / u.cm**3
# the cone: the Lode angle of an oblate body at a corner of Mohr-Coulomb is known to half the digits only
FRICTION = Material(friction_angle=35 * u.deg, yield_surface="drucker-prager")
EXAMPLES = {
    # near-spheroidal, D 2.0-2.4 km, density unknown
    "Anteros": Body([1.1, 1.05, 1.05] * u.km, 2.0 * GCC, 2.8695 * u.h, material=FRICTION),
    "1950 DA": Body([0.73, 0.695, 0.535] * u.km, 1.7 * GCC, 2.1216 * u.h, material=FRICTION),
    "Didymos": Body([0.394, 0.394, 0.290] * u.km, 2.8 * GCC, 2.26 * u.h, material=FRICTION),
    "1999 KW4": Body([0.766, 0.7475, 0.6735] * u.km, 1.97 * GCC, 2.7645 * u.h, material=FRICTION),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_bounds_are_the_edges_of_equilibrium(name):
    b = EXAMPLES[name]
    (low, high), *more = density_intervals(b)
    assert not more
    assert high.value == 25_000
    for factor, holds in ((0.999, False), (1.001, True)):
        assert equilibrium(b.with_(density=factor * low)).admissible is holds
    r = requirements(b, samples=1)
    assert r.least_density[0].to_value(GCC) == pytest.approx(low.to_value(GCC), rel=1e-10)


def test_anteros_must_be_denser_than_a_light_rubble_pile():
    # a sphere gives w2 = 8/3 sin/(1+sin): the shape changes this by a few per cent only
    sin = np.sin(np.deg2rad(35))
    w2 = 8 / 3 * sin / (1 + sin)
    sphere = (2 * np.pi / (2.8695 * 3600)) ** 2 / (np.pi * 6.6743e-11 * w2) / 1000
    assert density_intervals(EXAMPLES["Anteros"])[0, 0].to_value(GCC) == pytest.approx(sphere, rel=0.06)


def test_1950_da_is_in_mean_tension_and_needs_cohesion():
    b = EXAMPLES["1950 DA"]
    e = equilibrium(b)
    assert e.in_tension
    assert np.isinf(e.required_friction_angle)
    # Rozitis et al. (2014) find 44 to 76 Pa
    assert 40 < e.required_cohesion.to_value(u.Pa) < 80
    r = requirements(b, density_sigma=0.3 * GCC)
    assert 0.7 < r.probability_of_tension() < 0.9
    assert np.isinf(r.quantiles("friction_angle")).all()
    low, mid, high = r.quantiles("cohesion").value
    assert low < mid < high


def test_cohesion_opens_a_second_interval_of_light_bodies():
    b = EXAMPLES["1950 DA"]
    light, heavy = density_intervals(b.with_(material=FRICTION.with_(cohesion=30 * u.Pa)))
    assert light[1] < heavy[0]
    for rho, holds in ((light.mean(), True), (0.5 * (light[1] + heavy[0]), False), (heavy.mean(), True)):
        m = FRICTION.with_(cohesion=30 * u.Pa)
        assert equilibrium(b.with_(density=rho, material=m)).admissible is holds


def test_required_cohesion_falls_with_friction():
    y = required_cohesion(EXAMPLES["Didymos"], [10, 20, 30, 40] * u.deg).value
    assert np.all(np.diff(y) < 0)


def test_uncertainty_is_reproducible_and_grows_with_the_errors():
    b = EXAMPLES["1999 KW4"]
    narrow = requirements(b, density_sigma=0.05 * GCC, seed=3)
    wide = requirements(b, density_sigma=0.24 * GCC, seed=3)
    again = requirements(b, density_sigma=0.24 * GCC, seed=3)
    spread = [np.ptp(r.quantiles("cohesion").value) for r in (narrow, wide)]
    assert spread[0] < spread[1]
    assert np.array_equal(wide.cohesion, again.cohesion)
    # density does not enter the density bound
    assert np.ptp(wide.least_density.value) == 0.0
    shape = requirements(b, semi_axes_sigma=[20, 20, 20] * u.m)
    assert np.ptp(shape.least_density.value) > 0.0


def test_bad_input_is_named():
    b = EXAMPLES["Anteros"]
    with pytest.raises(InvalidInput, match="samples"):
        requirements(b, samples=0)
    with pytest.raises(InvalidInput, match="steady spin"):
        requirements(b.with_(spin=[1e-4, 0, 1e-4] * u.rad / u.s))
    with pytest.raises(InvalidInput, match="spin_period_sigma"):
        requirements(b.with_(spin=[0, 0, 0] * u.rad / u.s), spin_period_sigma=1 * u.h)
