"""Friction peaks that are searched last, and steps of flow that are not sampled: nothing is lost."""

import numpy as np
import pytest
from scenes import earth
from scipy.spatial.transform import Rotation

from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.dynamics.workspace import N_SUMMITS
from flybystab.core.material.yield_surface import required_frictions

TURNS = Rotation.random(12, random_state=5).as_matrix()
AXES, RHO, SPIN = np.array([180.0, 140.0, 110.0]), 2000.0, np.array([0.0, 1e-4, 2.5e-4])


@pytest.mark.parametrize("surface", [0, 1, 3])
def test_no_sample_of_a_rigid_flyby_exceeds_the_peak(surface):
    """The run at 1e-11 has more and shorter steps: other intervals are stored, and more than there is room for."""
    e = earth(2.4)
    for turn in TURNS:
        body = body_state(AXES, RHO, SPIN, turn, 0.5, surface=surface)
        loose, tight = (
            integrate(
                body,
                (e.t_start, e.t_stop),
                e.tide,
                limits=LIMITS._replace(tolerance=tolerance),
                unyielding=True,
                keep=20_000,
            )
            for tolerance in (1e-7, 1e-11)
        )
        h = tight.history
        sampled = required_frictions(surface, 0.0, h["deviator"], h["pressure"], h["determinant"])
        assert len(sampled) > 8 * N_SUMMITS
        assert sampled.max() <= tight.max_friction + 1e-12
        assert tight.max_friction - sampled.max() < 1e-2
        assert loose.max_friction == pytest.approx(tight.max_friction, abs=2e-6)


@pytest.mark.parametrize("surface", [0, 1, 2, 3])
@pytest.mark.parametrize("dilatancy", [0.0, 1.0])
def test_flow_is_the_same_whether_its_steps_are_sampled_or_not(surface, dilatancy):
    """A run with a history samples every step; without one only those near an event. Same result to the bit."""
    events = set()
    for k, turn in enumerate(TURNS):
        e = earth((1.05, 1.7, 2.1)[k % 3])
        phi, cohesion = np.radians((15.0, 25.0, 35.0, 45.0)[k % 4]), (0.0, 2.0)[k % 2]
        body = body_state(AXES, RHO, SPIN, turn, phi, cohesion, dilatancy, surface)
        limits = LIMITS._replace(tolerance=1e-7)
        sampled, plain = (
            integrate(body, (e.t_start, e.t_stop), e.tide, limits=limits, keep=keep) for keep in (50_000, 0)
        )
        assert str(plain.events) == str(sampled.events)  # with nan
        assert (plain.reason, plain.time, plain.steps) == (sampled.reason, sampled.time, sampled.steps)
        np.testing.assert_array_equal(plain.shape, sampled.shape)
        np.testing.assert_array_equal(plain.velocity_gradient, sampled.velocity_gradient)
        events |= {name for name, _, _ in plain.events}
    assert {"onset", "arrest"} | ({"loss of contact"} if dilatancy else set()) <= events
