"""Arrays of scripted encounters: each is the single one, in the broadcast shape; flybys take them row by row."""

import astropy.units as u
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flybystab as fs
from flybystab.errors import InvalidInput

BODY = fs.Body([1400, 850, 750] * u.m, 2000 * u.kg / u.m**3, 6 * u.h)


def test_periapsis_and_speed_broadcast():
    q, v = [2.0, 3.0, 4.0] * fs.R_earth, [5.0, 10.0] * u.km / u.s
    grid = fs.Encounter.hyperbolic("earth", q[:, None], v)
    assert grid.shape == (3, 2)
    for (i, j), one in np.ndenumerate(grid):
        single = fs.Encounter.hyperbolic("earth", q[i], v[j])
        assert one.distance == single.distance
        assert np.array_equal(one.tide.coefficients, single.tide.coefficients)
    with pytest.raises(InvalidInput, match="broadcasts"):
        fs.Encounter.hyperbolic("earth", q, v)


def test_one_body_through_many_encounters():
    grid = fs.Encounter.hyperbolic("earth", [2.0, 3.0, 4.0, 6.0] * fs.R_earth, 8 * u.km / u.s)
    table = fs.flyby_many(BODY, grid)
    every = fs.flyby_many([BODY] * 4, list(grid), [np.eye(3)] * 4)
    assert np.array_equal(table.verdict, every.verdict)
    assert np.array_equal(table.spin_ratio, every.spin_ratio)
    rows = fs.flyby_many(
        BODY, fs.Encounter.hyperbolic("earth", np.full((2, 3), 4.0) * fs.R_earth, 8 * u.km / u.s)
    )
    assert len(rows) == 6


def test_one_encounter_for_many_bodies_and_attitudes():
    one = fs.Encounter.hyperbolic("earth", 4 * fs.R_earth, 8 * u.km / u.s)
    turns = Rotation.random(5, random_state=1)
    table = fs.flyby_many(BODY, one, turns)
    assert len(table) == 5
    assert table.spin_ratio[2] == fs.flyby(BODY, one, turns[2], error=False).spin_ratio
    assert len(fs.flyby_many([BODY, BODY], one, np.eye(3))) == 2
    assert len(fs.flyby_many(BODY, one)) == 1
    with pytest.raises(InvalidInput, match="as many"):
        fs.flyby_many([BODY] * 3, [one] * 2)
