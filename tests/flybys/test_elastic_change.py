"""Change of the elastic stress in the encounter of Apophis in 2029."""

import astropy.units as u
import numpy as np
from astropy.time import Time

import flybystab as fs
from flybystab.flybys.elastic_change import elastic_change


def test_apophis_2029():
    """About 0.5 Pa in published finite-element models; here the largest von Mises stress of the ellipsoid."""
    apophis = fs.Asteroid.from_catalogue("Apophis")
    encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
    attitude = fs.periapsis_axes(encounter) @ apophis.attitude(0 * u.deg)
    change = elastic_change(apophis.body, encounter, attitude)
    assert 0.3 < change.largest.value < 1.0
    # the scale rho (GM/d^3) a^2
    scale = 2600.0 * encounter.planet.gm / encounter.distance.to_value(u.m) ** 3 * apophis.body.axes[0] ** 2
    assert 0.4 * scale < change.largest.value < 1.2 * scale
    # a fraction of the stress of gravity itself
    assert change.largest < 0.2 * -np.trace(change.before.mean) / 3
