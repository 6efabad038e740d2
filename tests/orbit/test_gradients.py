"""Gradients of the acceleration against five-point differences of the acceleration itself."""

from __future__ import annotations

import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

from flybystab.constants import AU, DAY
from flybystab.core.numerics.jit import kernel
from flybystab.orbit.ephemeris import BODIES, N_ALL, N_BODIES
from flybystab.orbit.forces import FORCES, ForceModel, acceleration_among, bodies, force_model
from flybystab.orbit.nongravitational import (
    N_PARAMETERS,
    RADIATION_PRESSURE,
    NonGravitational,
    add_nongravitational,
    nongravitational_by_parameters,
)
from flybystab.orbit.search.acceleration import empty_places, field
from flybystab.orbit.search.variational import gradient
from flybystab.orbit.state_transition import acceleration_gradient
from flybystab.typing import Array

T = 1e6
LAW = NonGravitational((3e-9, -2e-9, 1e-9), "comet", delay=35.0 * 86400.0, area_to_mass=1e-5)


@kernel
def at(model: ForceModel, x: Array, v: Array, places: Array, rates: Array, out: Array) -> None:
    bodies(model, T, places, rates)
    acceleration_among(model, T, places, rates, x, v, out)


def differences(model: ForceModel, y: Array, steps: Array) -> Array:
    """Derivatives (3, 6) of the acceleration by position and velocity, to fourth order."""
    out = np.empty((3, 6))
    places, rates = np.zeros((N_ALL, 3)), np.zeros((N_BODIES, 3))
    for j in range(6):
        total = np.zeros(3)
        for weight, side in ((8.0, 1.0), (-8.0, -1.0), (-1.0, 2.0), (1.0, -2.0)):
            z, a = y.copy(), np.empty(3)
            z[j] += side * steps[j]
            at(model, z[:3], z[3:], places, rates, a)
            total += weight * a
        out[:, j] = total / (12.0 * steps[j])
    return out


@pytest.mark.parametrize(
    ("names", "near", "error"),
    [
        (FORCES[:N_ALL], 0.0, 1e-9),
        (("sun point mass", "1PN"), 0.0, 1e-9),
        (("earth J2", "earth J3", "earth J4"), 8e6, 1e-7),
        (("earth point mass", "earth J2", "earth J3", "earth J4"), 3e7, 1e-8),
        (("non-gravitational",), 0.0, 1e-6),
        # The terms of 1PN beside the Schwarzschild one are left out: 4 U/c^2 of the Earth's gradient is 4e-8 of it.
        (FORCES, 4e7, 1e-7),
    ],
)
def test_gradients_are_the_differences_of_the_acceleration(names, near, error):
    """Both users: the state transition (one body after the other) and the search (from the almanac)."""
    window = need_ephemeris("de421").window(Time(2459000.5, format="jd", scale="tdb"), 0.0, 100.0 * DAY)
    model = force_model(window, names, LAW)
    y = np.array([0.8 * AU, -0.6 * AU, 0.1 * AU, 2e4, 1.5e4, -3e3])
    if near:
        y = window.states(BODIES.index("earth"), np.array([T]))[0] + [
            0.6 * near,
            -0.64 * near,
            0.48 * near,
            4e3,
            5e3,
            0,
        ]
    steps = np.repeat([1e-3 * (near or AU), 30.0], 3)
    expected = differences(model, y, steps)
    places, rates = np.zeros((N_ALL, 3)), np.zeros((N_BODIES, 3))
    bodies(model, T, places, rates)
    found, by_law = np.empty((3, 6)), np.empty((N_PARAMETERS, 3))
    acceleration_gradient(model, T, places - y[:3], rates, y[3:], found, by_law)
    size = np.abs(expected[:, :3]).max()
    assert np.abs(found[:, :3] - expected[:, :3]).max() < error * size
    # Velocity acts through 1PN, where the motion of the sources (13 m/s of the Sun) counts, and the transverse force.
    if not near and expected[:, 3:].any():
        assert np.abs(found[:, 3:] - expected[:, 3:]).max() < 3e-2 * np.abs(expected[:, 3:]).max()
    acting = field(window, [n for n in names if n != "non-gravitational"])
    other = np.empty((3, 6))
    gradient(acting, model.law, T, y, False, False, empty_places(), other, by_law)
    assert np.abs(other - found)[:, :3].max() < max(error, 2e-9) * max(size, 4e-14)


def test_derivatives_by_the_parameters():
    """The acceleration is linear in A1, A2, A3 and AMRAT; DT against differences with another step."""
    law = LAW.parameters
    r, v = np.array([0.8 * AU, -0.6 * AU, 0.1 * AU]), np.array([2e4, 1.5e4, -3e3])
    by = np.empty((N_PARAMETERS, 3))
    nongravitational_by_parameters(law, r, v, True, by)
    whole = np.zeros(3)
    add_nongravitational(law, r, v, whole)
    summed = law.a1 * by[0] + law.a2 * by[1] + law.a3 * by[2] + law.pressure / RADIATION_PRESSURE * by[4]
    assert np.allclose(summed, whole, rtol=1e-13)
    ends = np.zeros((2, 3))
    for sign, out in zip((1.0, -1.0), ends, strict=True):
        add_nongravitational(law._replace(delay=law.delay + sign * 3600.0), r, v, out)
    assert np.allclose(by[3], (ends[0] - ends[1]) / 7200.0, rtol=1e-5)
    nongravitational_by_parameters(law, r, v, False, by)
    assert not by[3].any()
