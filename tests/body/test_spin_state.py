"""States of rotation: growth rates and polhodes against integrated Euler equations."""

import astropy.units as u
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.body.spin_state import spin_state
from flybystab.body.stability import stability

AXES = np.array([300.0, 230.0, 180.0])
MOMENTS = (AXES**2).sum() - AXES**2


def body(omega, axes=AXES):
    return Body(
        axes * u.m,
        2000 * u.kg / u.m**3,
        spin=np.array(omega) * u.rad / u.s,
        material=Material(friction_angle=35 * u.deg, yield_surface="drucker-prager"),
    )


def course(omega, times):
    def rate(_, w):
        return np.cross(MOMENTS * w, w) / MOMENTS

    return solve_ivp(rate, (0, times[-1]), omega, t_eval=times, rtol=1e-11, atol=1e-16).y.T


def test_growth_rate_about_the_middle_axis_is_that_of_the_integrated_motion():
    omega = 3e-4
    state = spin_state(body([0, omega, 0]))
    assert state.mode == "middle axis"
    assert state.unstable
    # the growing eigenvector of the linearised equations, of tiny size
    j1, j2, j3 = MOMENTS
    tilt = 1e-6 * omega * np.array([np.sqrt((j3 - j2) / j1), 0, np.sqrt((j2 - j1) / j3)])
    for sign in (1, -1):
        start = np.array([0, omega, 0]) + tilt * [1, 1, sign]
        times = np.array([0.0, 2.0, 4.0]) / state.growth_rate.value
        w1 = np.abs(course(start, times)[:, 0])
        grows = w1[2] > w1[0]
        if grows:
            assert np.log(w1[2] / w1[0]) == pytest.approx(4.0, rel=1e-5)
            break
    else:
        pytest.fail("neither eigenvector grows")


@pytest.mark.parametrize(
    ("omega", "mode"), [((0, 0, 3e-4), "short axis"), ((3e-4, 0, 0), "long axis"), ((0, 0, 0), "no spin")]
)
def test_the_other_steady_states_are_not_unstable(omega, mode):
    state = spin_state(body(omega))
    assert (state.mode, state.steady, state.unstable) == (mode, True, False)
    own = equilibrium(body(omega)).required_friction_angle
    assert state.required_friction_angle.value == pytest.approx(own.to_value(u.deg), abs=1e-9)


def test_equal_moments_have_no_middle_axis():
    assert spin_state(body([0, 3e-4, 0], np.array([300.0, 300.0, 200.0]))).mode == "long axis"
    assert spin_state(body([0, 3e-4, 0], np.array([300.0, 200.0, 200.0]))).mode == "short axis"
    assert spin_state(body([1e-4, 3e-4, 0], np.array([300.0, 300.0, 200.0]))).steady


@pytest.mark.parametrize(
    ("omega", "mode"),
    [((1e-4, 0.5e-4, 2.8e-4), "short-axis mode"), ((2.5e-4, 1e-4, -1e-4), "long-axis mode")],
)
def test_required_friction_of_a_tumbler_is_the_largest_over_its_integrated_cycle(omega, mode):
    state = spin_state(body(omega))
    assert state.mode == mode
    assert not state.steady
    path = course(np.array(omega), np.linspace(0.0, 4e5, 800))
    largest = max(equilibrium(body(w)).required_friction_angle.to_value(u.deg) for w in path)
    assert state.required_friction_angle.value == pytest.approx(largest, abs=2e-3)
    assert state.required_friction_angle.value > equilibrium(body(omega)).required_friction_angle.value - 1e-9


def test_stability_reports_the_unstable_motion():
    s = stability(body([0, 1e-4, 0]))
    assert s.admissible
    assert s.spin_state.unstable
    assert "unstable" in repr(s)
    assert "tumbling" in repr(stability(body([1e-5, 0, 1e-4])))
    assert "axis" not in repr(stability(body([0, 0, 1e-4])))
