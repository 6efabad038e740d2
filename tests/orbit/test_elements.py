"""Elements of a state and state of elements."""

import numpy as np
import pytest

from flybystab.constants import AU
from flybystab.orbit.elements import elements_from_state, state_from_elements


@pytest.mark.parametrize("e", [0.0, 1e-9, 0.3, 0.984, 0.99999, 1.0, 1.0000001, 1.2, 3.4])
@pytest.mark.parametrize("i", [0.0, 1e-7, 1.1, 3.1414])
@pytest.mark.parametrize("days", [-700.0, -3.0, 0.0, 90.0, 1500.0])
def test_elements_of_a_state_give_the_state_back(e, i, days):
    state = np.array(state_from_elements(1.3 * AU, e, i, 2.0, 4.0, days * 86400.0))
    again = np.array(state_from_elements(*elements_from_state(state)))
    # The rounding of e alone moves a far point of a long orbit by 1e-16 of 1/(1 - e).
    assert np.linalg.norm(again[:3] - state[:3]) < 0.05
    assert np.linalg.norm(again[3:] - state[3:]) < 1e-8


@pytest.mark.parametrize("e", [0.2, 0.9, 1.0, 1.7])
def test_elements_of_a_state_are_those_it_was_made_of(e):
    given = (0.7 * AU, e, 0.4, 5.0, 1.0, 40.0 * 86400.0)
    found = elements_from_state(np.array(state_from_elements(*given)))
    np.testing.assert_allclose(found, given, rtol=1e-12)
