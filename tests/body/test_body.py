"""A body does not change after its construction, and ambiguous values are rejected."""

import pickle

import astropy.units as u
import numpy as np
import pytest
from astropy.utils.masked import Masked

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.errors import InvalidInput, UnitMismatch

DENSITY = 2000 * u.kg / u.m**3


def test_a_body_does_not_follow_the_array_that_it_was_made_of():
    axes = np.array([1400.0, 850.0, 750.0]) * u.m
    body = Body(axes, DENSITY, spin_period=6 * u.h)
    before = equilibrium(body).required_friction_angle
    axes[1:] = [500.0, 400.0] * u.m
    np.testing.assert_array_equal(body.axes, [1400.0, 850.0, 750.0])
    np.testing.assert_array_equal(body.semi_axes.to_value(u.m), body.axes)
    assert equilibrium(body).required_friction_angle == before
    assert axes[1] == 500 * u.m  # nor is the caller's array touched


@pytest.mark.parametrize("name", ["semi_axes", "spin", "axes", "omega"])
def test_a_body_cannot_be_changed_in_place(name):
    body = Body([1.4, 0.85, 0.75] * u.km, DENSITY, spin=[0, 0, 1e-4] * u.rad / u.s)
    with pytest.raises(ValueError, match="read-only"):
        getattr(body, name)[0] = 9 * getattr(getattr(body, name), "unit", 1)


def test_bodies_are_themselves_and_travel():
    a, b = (Body([3, 2, 1] * u.m, DENSITY) for _ in range(2))
    assert a == a
    assert a != b
    assert b in [a, b]
    again = pickle.loads(pickle.dumps(a))
    np.testing.assert_array_equal(again.axes, a.axes)


def test_missing_values_are_refused():
    density = Masked([2000.0, 7.0] * u.kg / u.m**3, mask=[False, True])
    assert Body([3, 2, 1] * u.m, density[0]).rho == 2000.0
    with pytest.raises(InvalidInput, match="masked"):
        Body([3, 2, 1] * u.m, density[1])
    with pytest.raises(InvalidInput, match="masked"):
        Body(Masked([3, 2, 1] * u.m, mask=[False, False, True]), DENSITY)


@pytest.mark.parametrize("density", [2 * u.kg / u.m**3, 30 * u.g / u.cm**3])
def test_a_density_that_no_asteroid_has_is_refused(density):
    with pytest.raises(InvalidInput, match=r"density = .*: expected 50 to 25000 kg / m3 \(1 g / cm3 is 1000"):
        Body([3, 2, 1] * u.m, density)
    # comets and metal are taken, and what an encounter has drawn apart
    for real in (200, 8000):
        assert Body([3, 2, 1] * u.m, real * u.kg / u.m**3).rho == real
    apart = Body([3, 2, 1] * u.m, density, dispersed=True)
    assert apart.with_(material=Material(cohesion=1 * u.Pa)).rho == density.to_value(u.kg / u.m**3)


def test_hertz_could_be_turns_or_radians():
    with pytest.raises(UnitMismatch, match="turns or radians"):
        Body([3, 2, 1] * u.m, DENSITY, spin=[0, 0, 1e-4] * u.Hz)
    assert Body([3, 2, 1] * u.m, DENSITY, spin=[0, 0, 1] * u.deg / u.s).omega[2] == pytest.approx(np.pi / 180)


def test_brittle_is_a_yes_or_a_no():
    with pytest.raises(InvalidInput, match="True or False"):
        Material(brittle="no")
