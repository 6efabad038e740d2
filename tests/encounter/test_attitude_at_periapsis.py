"""Attitudes at closest approach: the free rotation from the start ends there, and a far planet lets it."""

import astropy.units as u
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import flybystab as fs

FAR = fs.Encounter.hyperbolic("earth", 400 * fs.R_earth, 15 * u.km / u.s, start_distance=600 * fs.R_earth)


@pytest.mark.parametrize(
    "spin", [(0, 0, 3e-4), (2e-4, 1e-4, 3e-4), (0, 0, 0)], ids=["steady", "tumbling", "none"]
)
def test_a_free_body_has_the_attitude_at_closest_approach(spin):
    body = fs.Body([300, 220, 150] * u.m, 2000 * u.kg / u.m**3, spin=np.array(spin) * u.rad / u.s)
    target = Rotation.from_rotvec([0.3, -0.4, 0.8]).as_matrix()
    result = fs.flyby(body, FAR, target, attitude_at="periapsis", tolerance=1e-11)
    history = result.history
    k = int(np.abs(history.time_from_periapsis.to_value(u.s)).argmin())
    t = history.time_from_periapsis[k].to_value(u.s)
    # shape tensor in the periapsis frame at the row nearest to closest approach
    turn = fs.periapsis_axes(FAR)
    shape = turn @ history.shape[k].to_value(u.m**2) @ turn.T
    expected = target @ np.diag(body.axes**2) @ target.T
    drift = 2.0 * np.linalg.norm(spin) * abs(t) * body.axes[0] ** 2
    assert shape == pytest.approx(expected, abs=2e-3 * body.axes[0] ** 2 + drift)


def test_the_start_is_the_target_for_a_body_without_spin():
    body = fs.Body([300, 220, 150] * u.m, 2000 * u.kg / u.m**3)
    assert fs.attitude_at_start(body, FAR, None) == pytest.approx(np.eye(3))


def test_steady_and_tumbling_formulas_agree():
    steady = fs.Body([300, 220, 150] * u.m, 2000 * u.kg / u.m**3, 5 * u.h)
    almost = steady.with_(spin_period=None, spin=np.array([1e-13, 0.0, steady.omega[2]]) * u.rad / u.s)
    one, two = (fs.attitude_at_start(b, FAR, None) for b in (steady, almost))
    assert one == pytest.approx(two, abs=1e-6)
