"""Matrices of the own integrator against those of rebound, and the covariances that follow from them."""

from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.orbit.default_forces import default_forces
from flybystab.orbit.ephemeris import BODIES, ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import NonGravitational
from flybystab.orbit.osculating_state import heliocentric
from flybystab.orbit.search import neighbours
from flybystab.orbit.search.acceleration import field
from flybystab.orbit.search.steps import empty_room
from flybystab.orbit.search.variational import carry_with_deviations


@pytest.fixture(scope="module")
def apophis():
    need_ephemeris("de440")
    return fs.Asteroid.from_catalogue("Apophis").orbit


def by_the_search(orbit, time):
    """Derivatives (6, 11) of the state at `time`."""
    t = seconds(time, orbit.epoch)
    window = ephemeris("de440").window(orbit.epoch, min(t, 0.0), max(t, 0.0))
    names = default_forces(orbit, *BODIES)
    acting = field(window, [name for name in names if name != "non-gravitational"])
    there, change = np.empty((1, 6)), np.empty((1, 6, 11))
    state = orbit.barycentric(window)
    reached = carry_with_deviations(
        acting,
        orbit.nongrav.parameters,
        0.0,
        state,
        np.array([t]),
        1e-14,
        empty_room(),
        np.eye(5),
        there,
        change,
    )
    assert reached == 1
    return change[0]


@pytest.mark.parametrize(
    ("day", "error"),
    [("2025-01-01", 1e-7), ("2029-04-12", 1e-7), ("2029-04-20", 1e-6), ("2035-01-01", 1e-5)],
)
@pytest.mark.parametrize("comet", [False, True])
def test_two_integrators_have_the_same_matrix(apophis, day, error, comet):
    """Before and after the passage of Apophis in 2029; a comet has strong non-gravitational acceleration."""
    law = NonGravitational((1e-8, 3e-9, -2e-9), "comet", 10 * 86400.0, 0.2) if comet else apophis.nongrav
    orbit = replace(apophis, nongrav=law, covariance=None)
    time = Time(day, scale="tdb")
    found, want = by_the_search(orbit, time), orbit.state_transition(time, "de440")
    state = heliocentric(orbit)
    unit = np.repeat([np.linalg.norm(state[:3]), np.linalg.norm(state[3:])], 3)
    gap = (found[:, :6] - want.matrix) * unit / unit[:, None]
    assert np.linalg.norm(gap) < error * np.linalg.norm(want.matrix * unit / unit[:, None])
    for column, other in zip(found[:, 6:].T, want.parameters.T, strict=True):
        assert np.linalg.norm((column - other) / unit) <= 1e-4 * np.linalg.norm(other / unit)


def test_displacements_are_those_of_the_sigma_points(apophis, monkeypatch):
    """A limit below zero turns the linear theory off: each sigma point is integrated."""
    span = Time("2015-01-01", scale="tdb"), Time("2045-01-01", scale="tdb")
    runs = []
    for limit in (neighbours._LINEAR, -1.0):
        monkeypatch.setattr(neighbours, "_LINEAR", limit)
        runs.append(fs.find_encounters(apophis, *span, within=0.1 * u.au, growth=True, ephemeris="de440"))
    linear, points = runs
    assert len(linear) == len(points) >= 2
    assert linear["displacement"].to_value(u.km) == pytest.approx(
        points["displacement"].to_value(u.km), rel=0.01
    )
    assert (linear["displacement"] != points["displacement"]).any()
    assert list(linear["predictability"]) == list(points["predictability"])
