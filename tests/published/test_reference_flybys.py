"""Flybys P1, P2, P3 of the reference runs: two integrators, converged to the digits given there."""

import astropy.units as u
import numpy as np
import pytest
from scenes import PILE, axes_of, carried, earth, material, momentum, stepped

from flybystab.flybys.flyby import flyby

# periapsis (R_E), dilatancy, end, onset, arrest (s), semi-axes (m), spin rate (rad/s)
CASES = {
    "P1": (2.2, 0.0, 33529.41, 8870.05, 11487.07, (1482.0711, 831.4329, 724.2891), 4.300585e-4),
    "P2": (2.0, 0.0, 33433.08, 8518.24, 15522.59, (2405.551, 664.6593, 558.2060), 2.735800e-4),
    "P3": (2.2, 1.0, 33529.41, 8870.05, 11597.13, (1491.879, 856.6994, 747.6521), 4.213195e-4),
}


@pytest.mark.parametrize("name", CASES)
def test_reference_case(name):
    q, dilatancy, end, onset, arrest, axes, spin = CASES[name]
    body = PILE.with_(material=material(35, dilatancy=dilatancy))
    r = flyby(body, earth(q))
    assert r.verdict == "RESHAPED"
    assert r.bound_fraction == 1.0
    # The references carry 7 digits, their times 2 decimals.
    np.testing.assert_allclose(r.semi_axes.to_value(u.m), axes, rtol=3e-7)
    assert r.spin.to_value(u.rad / u.s) == pytest.approx(spin, rel=3e-7)
    assert r.end_time.to_value(u.s) == pytest.approx(end, abs=0.01)
    assert r.onset_time.to_value(u.s) == pytest.approx(onset, abs=0.01)
    assert r.arrest_time.to_value(u.s) == pytest.approx(arrest, abs=0.01)
    assert r.error.semi_axes < 1e-6
    assert r.error.verdict_agrees
    # Triaxial extension: the stress of a stretched body at yield.
    assert -30.0 <= r.lode_angle.to_value(u.deg) < -25.0
    volume = np.prod(r.body.axes) / np.prod(PILE.axes)
    assert r.body.rho * volume == pytest.approx(PILE.rho, rel=1e-12)
    assert (volume == pytest.approx(1.0, abs=1e-8)) if dilatancy == 0 else volume > 1.05


@pytest.mark.parametrize("name", CASES)
def test_second_integrator_agrees(name):
    """Event-free time stepping, first order: Richardson extrapolation meets the default integrator."""
    q, dilatancy, *_ = CASES[name]
    body = PILE.with_(material=material(35, dilatancy=dilatancy))
    e = earth(q)
    fine = carried(body, e.t_start, e.t_stop, e.tide, tolerance=1e-10)
    coarse, middle, dense = (stepped(body, e.t_start, e.t_stop, n, e.tide) for n in (8000, 16000, 32000))
    reference = axes_of(fine.shape)
    errors = [np.abs(axes_of(s) / reference - 1.0).max() for s, _ in (coarse, middle, dense)]
    assert 1.6 < errors[0] / errors[1] < 2.5
    assert 1.6 < errors[1] / errors[2] < 2.5
    extrapolated = 2.0 * axes_of(dense[0]) - axes_of(middle[0])
    np.testing.assert_allclose(extrapolated, reference, rtol=2e-6)
    h = 2.0 * momentum(*dense) - momentum(*middle)
    np.testing.assert_allclose(h[2], momentum(fine.shape, fine.velocity_gradient)[2], rtol=2e-6)


@pytest.mark.parametrize("surface", ["mohr-coulomb", "matsuoka-nakai"])
@pytest.mark.parametrize(("q", "period"), [(2.4, 6.0), (2.2, 6.0), (2.0, -6.0)])
def test_second_integrator_agrees_on_the_true_normal(surface, q, period):
    """Associative flow where k depends on the Lode angle: corners and faces of Mohr-Coulomb included."""
    body = PILE.with_(spin_period=period * u.h, material=material(35, dilatancy=1.0, yield_surface=surface))
    e = earth(q)
    fine = carried(body, e.t_start, e.t_stop, e.tide, tolerance=1e-10)
    reference = axes_of(fine.shape)
    coarse, dense = (axes_of(stepped(body, e.t_start, e.t_stop, n, e.tide)[0]) for n in (8000, 16000))
    assert 1.7 < np.abs(coarse / reference - 1.0).max() / np.abs(dense / reference - 1.0).max() < 2.3
    np.testing.assert_allclose(2.0 * dense - coarse, reference, rtol=5e-6)


def test_halving_every_tolerance_changes_nothing():
    e = earth(2.0)
    runs = [carried(PILE, e.t_start, e.t_stop, e.tide, tolerance=tol) for tol in (1e-8, 5e-9)]
    assert [x[0] for x in runs[0].events] == [x[0] for x in runs[1].events]
    np.testing.assert_allclose(axes_of(runs[0].shape), axes_of(runs[1].shape), rtol=1e-7)
    np.testing.assert_allclose(runs[0].events[0][1], runs[1].events[0][1], rtol=0, atol=1e-5)
