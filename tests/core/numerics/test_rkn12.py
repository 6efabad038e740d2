"""The method of order 12(10): its conditions, its observed order, and accelerations that depend on the velocity."""

import numpy as np
import pytest

from flybystab.core.numerics.jit import kernel
from flybystab.core.numerics.rkn12 import (
    ERROR_ORDER,
    N_STAGES,
    NODE,
    POSITION,
    VELOCITY,
    stage_state,
    step_error,
)


@kernel
def acceleration(y, friction, out):
    """Attraction by a unit mass at the origin, and friction."""
    r = np.sqrt(y[0] ** 2 + y[1] ** 2 + y[2] ** 2)
    out[:3] = y[3:]
    out[3:] = -y[:3] / r**3 - friction * y[3:]


@kernel
def end_of(y0, span, steps, friction):
    """State after equal steps, and the largest estimated error of a step."""
    y, new, k = y0.copy(), np.empty(6), np.empty((N_STAGES + 1, 6))
    h, largest = span / steps, 0.0
    for _ in range(steps):
        acceleration(y, friction, k[0])
        for s in range(1, N_STAGES):
            stage_state(s, y, h, k, new)
            acceleration(new, friction, k[s])
        stage_state(N_STAGES, y, h, k, new)
        largest = max(largest, step_error(h, k, 1.0, 1.0))
        y[:] = new
    return y, largest


def start(eccentricity):
    return np.array([1 - eccentricity, 0, 0, 0, np.sqrt((1 + eccentricity) / (1 - eccentricity)), 0.0])


def slope(sizes, errors):
    return np.polyfit(np.log(sizes), np.log(errors), 1)[0]


def test_the_weights_integrate_powers_of_time():
    """sum b c^k = 1/((k + 1)(k + 2)) and sum b' c^k = 1/(k + 1) for order 12; sum_j A_sj = c_s^2/2."""
    c, b, speed = NODE[:N_STAGES], POSITION[N_STAGES], VELOCITY[N_STAGES]
    for k in range(11):
        assert b @ c**k == pytest.approx(1.0 / ((k + 1) * (k + 2)), rel=1e-13)
    for k in range(12):
        assert speed @ c**k == pytest.approx(1.0 / (k + 1), rel=1e-13)
    assert POSITION[:N_STAGES].sum(axis=1) == pytest.approx(0.5 * c**2, abs=1e-14)
    assert VELOCITY[:N_STAGES].sum(axis=1) == pytest.approx(c, abs=1e-14)


@pytest.mark.parametrize(
    ("eccentricity", "span", "steps"), [(0.0, 6.0, (4, 5, 6, 7)), (0.1, 20.0, (22, 25, 28, 32))]
)
def test_the_order_is_twelve(eccentricity, span, steps):
    y0 = start(eccentricity)
    fine = end_of(y0, span, 8 * steps[-1], 0.0)[0]
    errors = [np.linalg.norm(end_of(y0, span, n, 0.0)[0] - fine) for n in steps]
    assert slope(1.0 / np.array(steps), errors) == pytest.approx(12.0, abs=0.7)


def test_the_error_of_a_step_has_its_order():
    y0, steps = start(0.1), np.array([30, 40, 60, 80])
    errors = [end_of(y0, 20.0, n, 0.0)[1] for n in steps]
    assert slope(1.0 / steps, errors) == pytest.approx(ERROR_ORDER, abs=0.2)


@pytest.mark.parametrize("friction", [1e-8, 1e-4, 1e-2])
def test_weak_dependence_on_the_velocity_keeps_the_accuracy(friction):
    """Error of 24 steps a revolution beyond that without friction: 1e-6 of the effect of the friction."""
    y0 = start(0.3)
    coarse, fine = (end_of(y0, 2 * np.pi, n, friction)[0] for n in (24, 400))
    effect = np.linalg.norm(fine - y0)
    assert effect > friction
    assert np.linalg.norm(coarse - fine) < 1e-6 * effect + 1e-10


def test_back_in_time_the_orbit_returns():
    y0 = start(0.3)
    there, _ = end_of(y0, 20.0, 300, 0.0)
    assert np.linalg.norm(there - y0) > 0.1
    assert end_of(there, -20.0, 300, 0.0)[0] == pytest.approx(y0, abs=1e-12)
