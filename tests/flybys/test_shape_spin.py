"""Rotation of polyhedra through encounters against the kernels of the ellipsoid and the torque of point masses."""

import astropy.units as u
import numpy as np
import pytest
from scenes import earth
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.catalogues.tumbling import free_spin, tumbling_state
from flybystab.errors import InvalidInput
from flybystab.flybys import shape_spin as module
from flybystab.flybys.shape_spin import free_rotation, shape_spin

SHAPE = fs.Shape.perturbed([225.0, 165.0, 155.0] * u.m, amplitude=0.06, seed=2, facets=300)
TUMBLER = fs.Body.from_shape(SHAPE, density=1.29 * u.g / u.cm**3, spin=[1e-5, 2e-5, 6e-5] * u.rad / u.s)


def test_without_the_octupole_it_is_the_rigid_flyby_of_the_equivalent_ellipsoid():
    found = shape_spin(TUMBLER, earth(6.0), shape=SHAPE, error=1e-4)
    assert not found.octupole_included
    assert np.isnan(found.octupole_effect)
    result = fs.flyby(TUMBLER, earth(6.0))
    assert str(result.verdict) == "INTACT"
    assert found.spin_ratio == pytest.approx(result.spin_ratio, rel=1e-5)
    assert found.pole_change.to_value(u.deg) == pytest.approx(result.pole_change.to_value(u.deg), rel=1e-4)


def test_the_share_of_the_octupole_grows_with_size_over_distance():
    shares = {}
    for size in (1.0, 2.0):
        shape = SHAPE.scaled(diameter=size * 340 * u.m)
        body = fs.Body.from_shape(shape, density=1.29 * u.g / u.cm**3, spin=TUMBLER.spin)
        shares[size] = shape_spin(body, earth(6.0), shape=shape, error=1e-3).octupole_share
    assert shares[2.0] == pytest.approx(2.0 * shares[1.0], rel=1e-3)
    assert 1e-7 < shares[1.0] < 1e-5


def test_the_motion_with_the_octupole_is_that_of_point_masses(monkeypatch):
    """A body of 60 km at 2.2 Earth radii: torque of point masses at the nodes of a cubature of degree 3."""
    shape = SHAPE.scaled(diameter=60 * u.km)
    body = fs.Body.from_shape(shape, density=1.29 * u.g / u.cm**3, spin=TUMBLER.spin)
    encounter, turn = earth(2.2), Rotation.from_euler("ZXZ", [0.3, 0.9, 0.4])
    found = shape_spin(body, encounter, turn, shape=shape, error=1e-6)
    quadrupole = shape_spin(body, encounter, turn, shape=shape, error=1e-2)
    assert found.octupole_included
    assert not quadrupole.octupole_included

    corners = shape.vertices.value[shape.facets]
    volumes = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    four = np.concatenate([np.zeros((len(corners), 1, 3)), corners], axis=1)
    centre = four.mean(axis=1, keepdims=True)
    x = np.concatenate([centre, 2.0 / 3.0 * centre + four / 3.0], axis=1).reshape(-1, 3)
    mass = (volumes[:, None] * np.array([-0.8, 0.45, 0.45, 0.45, 0.45])).ravel() / shape.volume.value

    def exact(self, t, turned):
        planet = -turned.T @ encounter.positions(np.array([t]))[0]
        apart = planet - x
        pull = apart / np.linalg.norm(apart, axis=1)[:, None] ** 3 - planet / np.linalg.norm(planet) ** 3
        return encounter.planet.gm * (mass[:, None] * np.cross(x, pull)).sum(axis=0), np.zeros(3)

    monkeypatch.setattr(module._Motion, "torques", exact)
    true = shape_spin(body, encounter, turn, shape=shape, error=1e-6)
    size = np.linalg.norm(true.after.momentum.value)
    without = np.linalg.norm((quadrupole.after.momentum - true.after.momentum).value) / size
    with_it = np.linalg.norm((found.after.momentum - true.after.momentum).value) / size
    assert without > 1e-5
    assert with_it < 0.1 * without


def test_periods_of_free_rotation_are_those_of_the_tumbling_solution():
    moments = np.array([0.64, 0.97, 1.0])
    for mode, precession, rotation in (
        ("SAM", 27.38547, 264.178),
        ("SAM", 27.374, 262.2),
        ("LAM", 30.0, 75.0),
    ):
        momentum, j = tumbling_state(moments, precession * 3600, rotation * 3600, mode)
        omega = free_spin(moments, momentum, j, np.array([0.3]))[0][0]
        found = free_rotation(moments, omega, np.eye(3))
        assert found.mode == mode
        assert found.precession_period.value == pytest.approx(precession, rel=1e-9)
        assert found.rotation_period.value == pytest.approx(rotation, rel=1e-9)


def test_bodies_of_revolution_and_steady_spin():
    steady = free_rotation(np.array([0.64, 0.97, 1.0]), np.array([0, 0, 1e-4]), np.eye(3))
    assert steady.precession_period.to_value(u.s) == pytest.approx(2 * np.pi / 1e-4)
    assert np.isinf(steady.rotation_period.value)
    # oblate: the axis precesses at L/J1, the spin vector circles in the body at (J3 - J1) w3/J1
    moments, omega = np.array([0.8, 0.8, 1.0]), np.array([3e-5, 0.0, 1e-4])
    oblate = free_rotation(moments, omega, np.eye(3))
    size = np.linalg.norm(moments * omega)
    assert oblate.precession_period.to_value(u.s) == pytest.approx(2 * np.pi * 0.8 / size)
    assert oblate.rotation_period.to_value(u.s) == pytest.approx(2 * np.pi * 0.8 / (0.2 * 1e-4))
    near = free_rotation(np.array([0.8, 0.8 + 1e-7, 1.0]), omega, np.eye(3))
    assert near.precession_period.value == pytest.approx(oblate.precession_period.value, rel=1e-5)
    assert near.rotation_period.value == pytest.approx(oblate.rotation_period.value, rel=1e-5)


def test_bad_input_is_named():
    with pytest.raises(InvalidInput, match="error"):
        shape_spin(TUMBLER, earth(6.0), shape=SHAPE, error=0.5)
    with pytest.raises(InvalidInput, match="impact"):
        shape_spin(TUMBLER, earth(0.9), shape=SHAPE)
    with pytest.raises(InvalidInput, match="spin"):
        free_rotation(np.array([1.0, 2.0, 2.5]), np.zeros(3), np.eye(3))
