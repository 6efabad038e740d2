"""Free tumbling in closed form against integrated Euler equations and published spin states."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flybystab.catalogues.tumbling import (
    attitude_matrix,
    ecliptic_direction,
    free_spin,
    isotropic_direction,
    precession_period,
    tumbling_state,
)
from flybystab.errors import InvalidInput, UnknownName

MOMENTS = np.array([0.64, 0.97, 1.0])


def integrated(moments, omega, t, axis):
    """Angular velocity along the axes at `t`, and the azimuth that body `axis` gained about L."""

    def rates(_, y):
        w, q = y[:3], y[3:].reshape(3, 3)
        wx = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return np.concatenate([-np.cross(w, moments * w) / moments, (q @ wx).ravel()])

    start = np.concatenate([omega, attitude_matrix(moments * omega, [0, 0, 1], 0.0).ravel()])
    y = solve_ivp(rates, (0, t), start, method="DOP853", rtol=1e-12, atol=1e-14, max_step=t / 400).y
    e = y[3:].reshape(3, 3, -1)[:, axis]
    return y[:3, -1], np.unwrap(np.arctan2(e[1], e[0]))[-1] - np.arctan2(e[1, 0], e[0, 0])


@pytest.mark.parametrize(("j", "axis"), [(0.985, 2), (0.9702, 2), (0.9698, 0), (0.8, 0), (0.65, 0)])
def test_free_spin_solves_eulers_equations(j, axis):
    momentum = 1.3
    omega, period = free_spin(MOMENTS, momentum, j, np.array([0.1, 0.47, 1.1]))
    assert np.linalg.norm(MOMENTS * omega, axis=1) == pytest.approx(momentum, rel=1e-13)
    assert momentum**2 / (MOMENTS * omega**2).sum(axis=1) == pytest.approx(j, rel=1e-13)
    assert omega[2] == pytest.approx(omega[0], rel=1e-12)
    later, _ = integrated(MOMENTS, omega[0], 0.37 * period, axis)
    assert later == pytest.approx(omega[1], abs=1e-9)
    # Over a whole period the axis of the mode has turned by the mean rate times the period.
    _, turned = integrated(MOMENTS, omega[0], period, axis)
    assert turned == pytest.approx(2 * np.pi * period / precession_period(MOMENTS, momentum, j), rel=1e-8)


@pytest.mark.parametrize(("mode", "j"), [("SAM", 0.985), ("LAM", 0.8)])
def test_tumbling_state_inverts_the_two_periods(mode, j):
    rotation = free_spin(MOMENTS, 2.0, j, np.zeros(1))[1]
    momentum, found = tumbling_state(MOMENTS, precession_period(MOMENTS, 2.0, j), rotation, mode)
    assert (momentum, found) == (pytest.approx(2.0, rel=1e-9), pytest.approx(j, rel=1e-9))


def test_apophis_excitation_agrees_with_photometry():
    # Lee et al. 2022 periods and inertia ratios; Pravec et al. 2014: E/E0 = 1.024 +- 0.013 (3 sigma).
    _, j = tumbling_state(MOMENTS, 27.38547 * 3600, 264.178 * 3600, "SAM")
    assert MOMENTS[2] / j == pytest.approx(1.024, abs=0.013)


def test_impossible_periods_are_refused():
    with pytest.raises(InvalidInput, match="ratio in"):
        tumbling_state(MOMENTS, 27.4, 27.4, "SAM")
    with pytest.raises(InvalidInput, match="ascending order"):
        tumbling_state(np.array([1.0, 0.5, 0.7]), 27.4, 264.0, "SAM")
    with pytest.raises(UnknownName, match="PAM"):
        tumbling_state(MOMENTS, 27.4, 264.0, "PAM")


def test_attitude_is_a_rotation_that_points_the_momentum_at_the_pole():
    rng = np.random.default_rng(1)
    for _ in range(5):
        momentum, pole = rng.normal(size=(2, 3))
        q = attitude_matrix(momentum, pole, rng.uniform(0, 6))
        assert q @ q.T == pytest.approx(np.eye(3), abs=1e-14)
        assert np.linalg.det(q) == pytest.approx(1.0)
        assert q @ momentum / np.linalg.norm(momentum) == pytest.approx(
            pole / np.linalg.norm(pole), abs=1e-14
        )


def test_ecliptic_pole_has_the_known_right_ascension_and_declination():
    pole = ecliptic_direction(0.0, np.pi / 2)  # RA 270 deg, Dec 66.56 deg
    assert np.degrees(np.arcsin(pole[2])) == pytest.approx(66.5607, abs=1e-4)
    assert np.degrees(np.arctan2(pole[1], pole[0])) % 360 == pytest.approx(270.0)


def test_isotropic_directions_have_no_mean_and_equal_spread():
    n = np.array([isotropic_direction(x) for x in np.random.default_rng(2).uniform(size=(20000, 2))])
    assert np.linalg.norm(n, axis=1) == pytest.approx(1.0)
    assert n.mean(axis=0) == pytest.approx(0.0, abs=0.02)
    assert (n.T @ n) / len(n) == pytest.approx(np.eye(3) / 3, abs=0.01)
