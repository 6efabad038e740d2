"""Slopes on polyhedral shapes against the closed forms of the ellipsoid and the studies of Apophis."""

import astropy.units as u
import numpy as np
import pytest
from scenes import earth

import flybystab as fs
from flybystab.body.shape_slope import shape_slopes
from flybystab.body.surface_slope import surface_slopes
from flybystab.constants import G
from flybystab.core.ellipsoid.surface_slope import effective_field
from flybystab.errors import InvalidInput
from flybystab.flybys.rigid_course import rigid_course

AXES = [1400.0, 850.0, 750.0] * u.m
SHAPE = fs.Shape.from_ellipsoid(AXES, facets=2000)
PILE = fs.Body.from_shape(SHAPE, density=2 * u.g / u.cm**3, spin_period=6 * u.h)


def closed_form(omega, tide):
    """Slopes, deg, of the facets in the linear field of the smooth ellipsoid."""
    field = np.empty((3, 3))
    effective_field(PILE.axes**2, np.pi * G * PILE.rho, omega, tide, field)
    down = -SHAPE.centroids.value @ field.T
    cosine = np.einsum("ni,ni->n", SHAPE.normals, down) / np.linalg.norm(down, axis=1)
    return np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0)))


def test_slopes_of_an_ellipsoidal_shape_are_those_of_the_ellipsoid():
    slopes = shape_slopes(SHAPE, PILE)
    error = slopes.slope.value - closed_form(PILE.omega, np.zeros(6))
    assert np.abs(error).max() < 0.5
    assert np.sqrt(np.mean(error**2)) < 0.1
    # and the mean over the surface is that of the smooth one
    smooth = surface_slopes(PILE)
    mean = [np.average(s.slope.value, weights=s.area.value) for s in (slopes, smooth)]
    assert mean[0] == pytest.approx(mean[1], rel=0.03)


def test_slopes_through_an_encounter_are_those_of_the_ellipsoid():
    encounter = earth(3.0)
    facets = fs.surface_change(PILE, encounter, shape=SHAPE)
    course = rigid_course(PILE, encounter, tolerance=1e-12)
    through = np.stack([closed_form(w, k) for w, k in zip(course.spin.value, course.tide.value, strict=True)])
    for got, expected in (
        (facets.before, through[0]),
        (facets.least, through.min(axis=0)),
        (facets.greatest, through.max(axis=0)),
    ):
        assert np.sqrt(np.mean((got.value - expected) ** 2)) < 0.1
    smooth = fs.surface_change(PILE, encounter, count=4000)
    mean = [np.average(c.change.value, weights=c.area.value) for c in (facets, smooth)]
    assert mean[0] == pytest.approx(mean[1], rel=0.01)


def test_changes_fall_with_density():
    """Valvano et al. (2022): slopes of Apophis change by up to 4 deg at 1.29 g/cm3, 2 deg at the higher density."""
    relief = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=1000)
    encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
    largest = {}
    for density in (1.29, 2.2, 3.5):
        body = fs.Body.from_shape(relief, density=density * u.g / u.cm**3, spin_period=30.5 * u.h)
        change = fs.surface_change(body, encounter, shape=relief)
        largest[density] = change.largest_change.to_value(u.deg)
    assert 2.0 < largest[1.29] < 6.0
    # the ratio of tide to self-gravity goes as 1/density
    assert largest[1.29] / largest[3.5] == pytest.approx(3.5 / 1.29, rel=0.15)


def test_a_shape_that_is_not_the_body_is_refused():
    other = fs.Shape.from_ellipsoid([1000.0, 900.0, 800.0] * u.m, facets=500)
    with pytest.raises(InvalidInput, match="equivalent ellipsoid"):
        fs.surface_change(PILE, earth(3.0), shape=other)
