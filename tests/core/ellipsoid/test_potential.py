"""Self-gravity of the ellipsoid against 30-digit values, SciPy, quadrature and its own identities."""

import numpy as np
import pytest
from scipy.special import elliprd, elliprf

from flybystab.core.ellipsoid.potential import carlson_fd, gravity_coefficients, potential_coefficient

REFERENCE = {  # semi-axes: A_i to 18 digits
    (1.0, 0.8, 0.6): (0.479980529908161288, 0.635205705153574635, 0.884813764938264077),
    (1.0, 1.0, 0.5): (0.472799717437430156, 0.472799717437430156, 1.05440056512513969),
    (1.0, 0.5, 0.5): (0.347127995067928463, 0.826436002466035768, 0.826436002466035768),
    (1.0, 0.1, 0.01): (0.00522321319135758884, 0.179607790278989363, 1.81516899652965305),
}


@pytest.mark.parametrize("axes", REFERENCE)
def test_gravity_coefficients_match_thirty_digit_values(axes):
    assert gravity_coefficients(*np.square(axes)) == pytest.approx(REFERENCE[axes], rel=5e-15)


def test_coefficients_of_any_shape_sum_to_two_and_order_as_the_axes():
    rng = np.random.default_rng(1)
    for s in np.sort(10 ** rng.uniform(-4, 0, (200, 3)))[:, ::-1]:
        a = gravity_coefficients(*s)
        assert sum(a) == pytest.approx(2.0, abs=1e-14)
        assert a[0] <= a[1] <= a[2]


def test_carlson_integrals_agree_with_scipy():
    rng = np.random.default_rng(2)
    for x, y, z in 10 ** rng.uniform(-6, 6, (200, 3)):
        expected = elliprf(x, y, z), elliprd(y, z, x), elliprd(z, x, y), elliprd(x, y, z)
        assert carlson_fd(x, y, z) == pytest.approx(expected, rel=5e-15)


def test_potential_of_a_sphere_and_its_laplacian():
    # -pi G rho (A_0 - r^2 2/3) = -2 pi G rho (a^2 - r^2/3)
    assert potential_coefficient(4.0, 4.0, 4.0) == pytest.approx(8.0, rel=1e-15)
    # A_0 = sum A_i a_i^2: the surface potential integral's Euler identity for a homogeneous function
    s = np.array([1.0, 0.49, 0.2])
    assert potential_coefficient(*s) == pytest.approx(float(np.dot(gravity_coefficients(*s), s)), rel=1e-14)
