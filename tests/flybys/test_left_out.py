"""Neglected effects of large bodies."""

import astropy.units as u
import pytest

import flybystab as fs
from flybystab.constants import GM_EARTH, G


def flown(size):
    body = fs.Body([size, 0.8 * size, 0.7 * size] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)
    return fs.flyby(body, fs.Encounter.hyperbolic("earth", 2.2 * fs.R_earth, 5 * u.km / u.s), error=False)


def test_size_and_mass_of_large_bodies_are_named():
    small, large = flown(1400.0), flown(2e6)
    assert small.left_out == small.inputs.encounter.left_out
    found = dict(large.left_out)
    distance = 2.2 * fs.R_earth.to_value(u.m)
    # 2 GM x/r^3 (1 + 1.5 x/r): difference of the attraction at the end of the axis and at the centre
    x = 1e-3 * distance
    exact = 1.0 / (distance - x) ** 2 - 1.0 / distance**2
    third = (exact / (2.0 * x / distance**3) - 1.0) / (x / distance)
    assert found["tide: third order"] == pytest.approx(third * 2e6 / distance, rel=2e-3)
    mass = large.inputs.body.mass.to_value(u.kg)
    assert found["orbit: mass of the body"] == pytest.approx(G * mass / GM_EARTH)
