"""Self-gravity without principal axes against Carlson's integrals, identities and differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flybystab.core.ellipsoid.potential import gravity_coefficients
from flybystab.core.ellipsoid.self_gravity import REACH, gravity_derivative, gravity_tensor, invariant_ratio
from flybystab.core.ellipsoid.tide import components, tensor
from flybystab.core.numerics.tensors import inverse


def of(c):
    """``Gamma`` of six components, and the inverse of the shape tensor."""
    sinv, out = np.empty((3, 3)), np.empty((3, 3))
    det = inverse(c, sinv)
    gravity_tensor(c, sinv, det, np.empty(3), np.empty((3, 3)), out)
    return out, sinv, det


def shape(squares, seed=None):
    turn = np.eye(3) if seed is None else Rotation.random(random_state=seed).as_matrix()
    return components(turn @ np.diag(squares) @ turn.T)


@pytest.mark.parametrize("kind", ["needle", "between", "disc"])
@pytest.mark.parametrize("limit", [9.0, *REACH])
def test_every_rule_keeps_its_digits_up_to_its_reach(kind, limit):
    def squares(r):
        return {"needle": [r * r, 1, 1], "between": [r * r, r, 1], "disc": [r * r, r * r, 1]}[kind]

    ratios = np.geomspace(1.0, 25.0, 400)
    reach = np.array([sum(squares(r)) * sum(1 / x for x in squares(r)) for r in ratios])
    r = ratios[reach <= limit * (1.0 + 1e-12)][-1]
    gamma, _, det = of(shape(squares(r)))
    assert np.sqrt(det) * np.diag(gamma) == pytest.approx(gravity_coefficients(*squares(r)), rel=1e-14)


def test_a_turned_body_has_its_gravity_along_its_axes():
    rng = np.random.default_rng(4)
    for seed in range(100):
        squares = np.sort(10.0 ** rng.uniform(0.0, 1.6, 3))[::-1]
        turn = Rotation.random(random_state=seed).as_matrix()
        gamma, _, det = of(shape(squares, seed))
        expected = turn @ np.diag(gravity_coefficients(*squares)) @ turn.T
        # the tensor itself knows its least axis to 1e-16 times the square of the axis ratio
        assert np.sqrt(det) * gamma == pytest.approx(expected, abs=1e-14 * squares[0] / squares[2])
        assert np.sqrt(det) * np.trace(gamma) == pytest.approx(2.0, rel=1e-13)


def test_beyond_the_rules_the_principal_axes_are_taken():
    squares = np.array([1.0, 0.01, 0.0001])  # 1 : 0.1 : 0.01
    c = shape(squares)
    gamma, sinv, det = of(c)
    assert invariant_ratio(c, sinv) > REACH[-1]
    assert np.sqrt(det) * np.diag(gamma) == pytest.approx(gravity_coefficients(*squares), rel=1e-14)


def test_spread_bounds_the_axis_ratio():
    rng = np.random.default_rng(5)
    for seed in range(200):
        squares = 10.0 ** rng.uniform(0.0, 2.0, 3)
        r = np.sqrt(squares.max() / squares.min())
        c = shape(squares, seed)
        assert invariant_ratio(c, of(c)[1]) >= (r + 1.0 + 1.0 / r) ** 2 * (1.0 - 1e-12)
    c = shape([36.0, 6.0, 1.0])
    assert invariant_ratio(c, of(c)[1]) == pytest.approx((6.0 + 1.0 + 1.0 / 6.0) ** 2)


@pytest.mark.parametrize("squares", [[1, 1, 1], [2, 2, 1], [3, 1, 1], [4, 2, 1], [36, 10, 1], [200, 20, 1]])
def test_derivative_is_that_of_a_homogeneous_function_and_of_differences(squares):
    c = shape(np.array(squares, dtype=float), seed=7)
    gamma, sinv, det = of(c)
    slopes = np.empty((6, 6))
    gravity_derivative(c, sinv, det, slopes)
    # Gamma(x S) = x^(-3/2) Gamma(S)
    assert tensor(c @ slopes) == pytest.approx(-1.5 * gamma, rel=1e-10, abs=1e-12 * np.abs(gamma).max())
    h = 1e-5
    for k in range(6):
        more, less = of(c + h * np.eye(6)[k])[0], of(c - h * np.eye(6)[k])[0]
        difference = components(more - less) / (2 * h)
        assert slopes[k] == pytest.approx(difference, abs=1e-7 * np.abs(slopes).max())
