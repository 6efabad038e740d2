"""The classical figures of equilibrium to the digits of the literature."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from flybystab.body.fluids import jacobi, maclaurin, roche, roche_limit
from flybystab.errors import InvalidInput

JACOBI = {
    0.9: (0.551873, 0.372567),
    0.8: (0.517216, 0.366837),
    0.6: (0.433781, 0.337330),
    0.4322: (0.345050, 0.284017),
}


def spheroid(e):
    return maclaurin(np.sqrt(1 - e * e))


def test_fastest_maclaurin_spheroid():
    top = minimize_scalar(
        lambda e: -spheroid(e).load, bounds=(0.9, 0.96), method="bounded", options={"xatol": 1e-10}
    )
    assert top.x == pytest.approx(0.929955685, abs=3e-8)
    assert -top.fun == pytest.approx(0.449331412123913854, abs=1e-14)


def test_maclaurin_at_the_jacobi_and_dynamical_points():
    assert spheroid(0.812670010611742949).load == pytest.approx(0.374229674786195634, abs=1e-14)
    assert spheroid(0.952886702).load == pytest.approx(0.440219895, abs=1e-9)


def test_maclaurin_against_its_elementary_formula():
    for e in (0.1, 0.5, 0.9, 0.99):
        q = np.sqrt(1 - e * e)
        expected = 2 * q / e**3 * (3 - 2 * e * e) * np.arcsin(e) - 6 / e**2 * (1 - e * e)
        assert spheroid(e).load == pytest.approx(expected, rel=1e-9 / e**2)


@pytest.mark.parametrize("a2", JACOBI)
def test_jacobi_ellipsoids(a2):
    assert jacobi(a2)[1:] == pytest.approx(JACOBI[a2], abs=6e-7)


def test_jacobi_sequence_ends_on_the_maclaurin_sequence():
    assert jacobi(1 - 1e-7).a3_a1 == pytest.approx(np.sqrt(1 - 0.812670010611742949**2), abs=1e-6)


def test_roche_limit_of_a_fluid():
    r = roche_limit()
    assert r.load == pytest.approx(0.0900929971, abs=6e-11)
    assert (r.a2_a1, r.a3_a1) == pytest.approx((0.511342804, 0.482573598), abs=2e-9)
    assert np.cbrt(4 / 3 / r.load) == pytest.approx(2.455175645, abs=6e-10)


def test_roche_load_is_reached_twice_below_the_limit():
    long = brentq(lambda x: roche(x).load - 0.08, 0.2, 0.5)
    round_ = brentq(lambda x: roche(x).load - 0.08, 0.53, 0.95)
    assert roche(long).a3_a1 < roche(round_).a3_a1


@pytest.mark.parametrize("bad", [0.0, 1.0, -1.0, 2.0, float("nan")])
def test_axis_ratio_outside_its_domain(bad):
    with pytest.raises(InvalidInput, match="a2_a1"):
        jacobi(bad)
    with pytest.raises(InvalidInput, match="a2_a1"):
        roche(bad)
