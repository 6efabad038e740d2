"""Two-body motion around periapsis, held against conservation laws and 40-digit arithmetic."""

import mpmath as mp
import numpy as np
import pytest

from flybystab.constants import GM_EARTH, R_EARTH
from flybystab.orbit.kepler import (
    anomaly_at_distance,
    states_at_times,
    stumpff,
    time_at_anomaly,
    time_at_distance,
    two_body,
)

Q = 1.1 * R_EARTH
TIMES = np.concatenate([-np.logspace(6, -3, 25), [0.0], np.logspace(-3, 6, 25)])


@pytest.mark.parametrize("v_inf", [0.0, 1e-5, 10.0, 1e3, 3e4])
def test_energy_and_angular_momentum_are_kept(v_inf):
    f = Q * v_inf**2 / GM_EARTH
    x, y, vx, vy = states_at_times(GM_EARTH, Q, f, TIMES).T
    r = np.hypot(x, y)
    energy = 0.5 * (vx**2 + vy**2) - GM_EARTH / r - 0.5 * v_inf**2
    assert np.abs(energy).max() < 4e-15 * GM_EARTH * (2 + f) / Q
    assert np.abs((x * vy - y * vx) / np.sqrt(GM_EARTH * Q * (2 + f)) - 1).max() < 1e-12


@pytest.mark.parametrize("f", [3.0, 0.4, 1e-6, 1e-13, 0.0, -1e-9, -0.3])
@pytest.mark.parametrize("ratio", [1.0 + 1e-9, 1.7, 30.0])
def test_time_of_flight_against_forty_digits(f, ratio):
    """Kepler's equation for ellipse and hyperbola, Barker's for the parabola."""
    gm, q = GM_EARTH, Q
    if f < 0 and ratio > (2 + f) / -f:
        assert np.isnan(time_at_distance(gm, q, f, ratio * q))
        return
    with mp.workdps(40):
        e, r = 1 + mp.mpf(f), mp.mpf(ratio * q)
        if f == 0:
            d = mp.sqrt(2 * (r - q) / (2 * mp.mpf(q)))  # tan(nu/2)
            d = mp.sqrt(r / q - 1)
            exact = mp.sqrt(2 * mp.mpf(q) ** 3 / gm) * (d + d**3 / 3)
        elif f > 0:
            a = q / mp.mpf(f)
            h = mp.acosh((r / a + 1) / e)
            exact = mp.sqrt(a**3 / gm) * (e * mp.sinh(h) - h)
        else:
            a = -q / mp.mpf(f)
            h = mp.acos((1 - r / a) / e)
            exact = mp.sqrt(a**3 / gm) * (h - e * mp.sin(h))
        assert abs(time_at_distance(gm, q, f, ratio * q) / exact - 1) < 1e-14


@pytest.mark.parametrize("f", [50.0, 0.4, 1e-10, 0.0, -0.2])
def test_time_and_state_are_inverse(f):
    """Distance of the state found at a time gives that time back, on both branches."""
    t = np.logspace(1, 4, 30)
    x, y, _, _ = states_at_times(GM_EARTH, Q, f, t).T
    back = np.array([time_at_distance(GM_EARTH, Q, f, r) for r in np.hypot(x, y)])
    np.testing.assert_allclose(back, t, rtol=1e-9)  # near periapsis distance says little about time
    x1, y1, _, _ = states_at_times(GM_EARTH, Q, f, -t).T
    np.testing.assert_array_equal(x1, x)
    np.testing.assert_array_equal(y1, -y)


def test_ellipse_repeats_after_a_period():
    f = -0.35
    period = 2 * np.pi * np.sqrt((Q / 0.35) ** 3 / GM_EARTH)
    one = states_at_times(GM_EARTH, Q, f, np.array([-300.0, 1000.0, 7000.0]))
    two = states_at_times(GM_EARTH, Q, f, np.array([-300.0, 1000.0, 7000.0]) + 3 * period)
    np.testing.assert_allclose(one, two, rtol=1e-11)


@pytest.mark.parametrize("psi", [-400.0, -1.0000001, -0.9999999, -1e-8, 0.0, 0.5, 0.9999999, 1.0000001, 9.0])
def test_stumpff_series_meet_closed_forms(psi):
    with mp.workdps(40):
        exact = [
            mp.nsum(lambda j, k=k: (-mp.mpf(psi)) ** j / mp.factorial(2 * j + k), [0, 80]) for k in range(4)
        ]
    np.testing.assert_allclose(stumpff(psi), [float(v) for v in exact], rtol=3e-15)


def test_anomaly_is_nan_inside_periapsis():
    assert np.isnan(anomaly_at_distance(Q, 0.4, 0.9 * Q))
    assert time_at_anomaly(GM_EARTH, Q, 0.4, 0.0) == 0.0


@pytest.mark.parametrize("f", [4.0, 0.3, 1e-9, 0.0, -0.2, -0.9, -1.0])
def test_two_body_motion_from_any_point_is_that_from_periapsis(f):
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]

    def at(t):
        x, y, vx, vy = states_at_times(GM_EARTH, Q, f, np.array([t]))[0]
        return np.concatenate([turn @ [x, y, 0], turn @ [vx, vy, 0]])

    for start, wait in ((-3e4, 5e4), (0.0, 7e5), (100.0, -3e5), (-2e5, 1e3), (5e3, 0.0)):
        error = two_body(GM_EARTH, at(start), wait) - at(start + wait)
        assert np.abs(error[:3]).max() < 1e-3
        assert np.abs(error[3:]).max() < 1e-6
