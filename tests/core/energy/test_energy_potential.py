"""The energy of a deforming ellipsoid: index symbols, derivatives along a strain, classical bifurcations."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from flybystab.body.fluids import jacobi, maclaurin
from flybystab.core.ellipsoid.potential import gravity_coefficients, index_symbols
from flybystab.core.ellipsoid.rigid_stress import rigid_stress
from flybystab.core.ellipsoid.tide import components, tensor
from flybystab.core.energy.potential import (
    GRAVITY,
    MASS,
    energy,
    energy_along,
    energy_derivatives,
    path_frame,
    principal_axes,
    velocity_gradient,
)
from flybystab.core.numerics.tensors import unpack

SHAPES = [(1, 0.8, 0.6), (1, 1, 0.7), (1, 1, 1), (1, 0.5, 0.5), (1, 0.4, 0.2)]


def squared(axes):
    axes = np.array(axes, dtype=float)
    return axes**2 / np.prod(axes) ** (2 / 3)


def symbols(s):
    out = np.empty(3), np.empty((3, 3)), np.empty((3, 3, 3))
    index_symbols(*s, *out)
    return out


def norm(d):
    return np.sqrt(np.sum(d[:3] ** 2) + 2 * np.sum(d[3:] ** 2))


def derivatives(s, spin, d):
    return np.array(energy_derivatives(*s, *symbols(s), np.array(spin, float), np.array(d, float)))


def moments(s):
    return MASS / 5 * (s.sum() - s)


@pytest.mark.parametrize("axes", [*SHAPES, (1, 1 - 1e-7, 1 - 2e-7), (1, 0.1, 0.1)])
def test_index_symbols_are_the_integrals_they_stand_for(axes):
    s = np.square(axes)
    one, two, three = symbols(s)

    def integral(*index):
        def f(x):  # u = e^x
            n = 1 / (s + np.exp(x))
            return np.sqrt(np.prod(n)) * np.prod(n[list(index)]) * np.exp(x)

        return np.sqrt(np.prod(s)) * quad(f, -60, 40, epsabs=0, epsrel=1e-12, limit=400, points=[-5, 0, 5])[0]

    assert one == pytest.approx(gravity_coefficients(*s), rel=1e-13)
    for i, j in ((0, 1), (1, 2), (2, 2)):
        assert two[i, j] == pytest.approx(integral(i, j), rel=1e-10)
    for i, j, k in ((0, 1, 2), (0, 0, 1), (2, 1, 2), (2, 2, 2)):
        assert three[i, j, k] == pytest.approx(integral(i, j, k), rel=1e-10)


def test_index_symbols_satisfy_the_classical_recurrences():
    s = np.square((1, 0.8, 0.6))
    one, two, three = symbols(s)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert two[i, j] == pytest.approx((one[j] - one[i]) / (s[i] - s[j]), rel=1e-12)
    for i in range(3):  # 3 A_ii + sum over j != i of A_ij = 2/s_i (Chandrasekhar, section 21)
        assert 2 * two[i, i] + two[i].sum() == pytest.approx(2 / s[i], rel=1e-13)
    assert three[0, 1, 2] == pytest.approx((two[1, 2] - two[0, 2]) / (s[0] - s[1]), rel=1e-11)


@pytest.mark.parametrize("axes", SHAPES)
def test_derivatives_against_finite_differences_in_all_six_directions(axes):
    s = squared(axes)
    rng = np.random.default_rng(1)
    spin = 0.4 * rng.standard_normal(3)
    momentum = moments(s) * spin
    gradient = np.empty((3, 3))
    directions = [*np.eye(6), *rng.standard_normal((4, 6))]
    for d in directions:
        d = d / norm(d)
        velocity_gradient(*s, d, gradient)

        def phi(t, gradient=gradient):
            return energy(components(expm(2 * gradient * t) @ np.diag(s)), momentum)

        def stencil(h, phi=phi):
            return np.array([phi(k * h) for k in range(-4, 5)])

        v = stencil(4e-3)
        first = v @ [1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280] / 4e-3
        v = stencil(2e-2)
        second = v @ [-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560] / 2e-2**2
        third = (
            v @ [-7 / 240, 3 / 10, -169 / 120, 61 / 30, 0, -61 / 30, 169 / 120, -3 / 10, 7 / 240] / 2e-2**3
        )
        got = derivatives(s, spin, d)
        assert got[0] == pytest.approx(first, abs=1e-10)
        assert got[1] == pytest.approx(second, abs=1e-8)
        assert got[2] == pytest.approx(third, abs=2e-5)


@pytest.mark.parametrize("axes", SHAPES)
def test_first_derivative_is_the_work_of_the_rigid_stress(axes):
    """DPhi/dt = -V sigma:D for any spin, also that of a tumbling body."""
    s = squared(axes)
    rng = np.random.default_rng(2)
    stress = np.empty(6)
    for _ in range(10):
        spin = 0.5 * rng.standard_normal(3)
        d = rng.standard_normal(6)
        rigid_stress(*s, 1.0, 1.0, spin, np.zeros(6), stress)
        work = MASS * (stress[:3] @ d[:3] + 2 * stress[3:] @ d[3:])
        assert derivatives(s, spin, d)[0] == pytest.approx(-work, rel=1e-12, abs=1e-13)


def test_path_of_constant_gradient_and_its_slope():
    s = squared((1, 0.8, 0.6))
    rng = np.random.default_rng(3)
    rates, frame, gradient = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    axes, momentum = principal_axes(), moments(s) * rng.standard_normal(3)
    shape = axes.shape
    for _ in range(10):
        d = rng.standard_normal(6)
        path_frame(*s, d, rates, frame)
        velocity_gradient(*s, d, gradient)
        phi, slope, ratio2 = energy_along(rates, frame, momentum, 0.3, 1.0, 0.0, axes)
        assert shape == pytest.approx(components(expm(0.6 * gradient) @ np.diag(s)), rel=1e-12, abs=1e-12)
        assert phi == pytest.approx(energy(shape, momentum), rel=1e-13)
        squares = np.linalg.eigvalsh(tensor(shape))
        assert ratio2 == pytest.approx(squares[-1] / squares[0], rel=1e-12)
        ends = [energy_along(rates, frame, momentum, 0.3 + h, 1.0, 0.0, axes)[0] for h in (-1e-4, 1e-4)]
        assert slope == pytest.approx((ends[1] - ends[0]) / 2e-4, rel=1e-6, abs=1e-7)


def test_velocity_gradient_carries_no_relative_angular_momentum():
    s = squared((1, 0.7, 0.5))
    d = np.random.default_rng(4).standard_normal(6)
    gradient, matrix = np.empty((3, 3)), np.empty((3, 3))
    velocity_gradient(*s, d, gradient)
    unpack(d, matrix)
    assert np.allclose(gradient @ np.diag(s), (gradient @ np.diag(s)).T, atol=1e-15)
    assert np.allclose(gradient + gradient.T, 2 * matrix, atol=1e-15)


def test_energy_of_a_sphere():
    unit = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    assert energy(unit, np.zeros(3)) == pytest.approx(-3 / 5 * MASS**2 / np.pi, rel=1e-15)
    assert pytest.approx(3 / 10 * MASS**2 / np.pi) == GRAVITY
    momentum = np.array([0.1, -0.2, 0.4])
    spin_energy = energy(unit, momentum) - energy(unit, np.zeros(3))
    assert spin_energy == pytest.approx(momentum @ momentum / (2 * 0.4 * MASS), rel=1e-13)


# ---- the friction-free, incompressible limit must be Chandrasekhar's theory

TOROIDAL = np.array([1.0, -1.0, 0, 0, 0, 0]) / np.sqrt(2)


def maclaurin_curvature(e, d):
    f = maclaurin(np.sqrt(1 - e * e))
    return derivatives(squared((1, 1, f.a3_a1)), (0, 0, np.sqrt(f.load)), d)[1]


def test_jacobi_bifurcation_of_the_maclaurin_sequence():
    e = brentq(lambda e: maclaurin_curvature(e, TOROIDAL), 0.7, 0.9, xtol=1e-15)
    assert e == pytest.approx(0.812670010611742949, abs=1e-12)
    shear = np.array([0, 0, 0, 1.0, 0, 0]) / np.sqrt(2)  # the same mode turned by 45 degrees
    assert maclaurin_curvature(e, shear) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("e", [0.3, 0.6, 0.8])
def test_maclaurin_spheroids_before_it_are_minima_and_those_after_are_not(e):
    def least(e):
        basis = np.array(
            [
                [1, -1, 0, 0, 0, 0],
                [1, 1, -2, 0, 0, 0],
                *([0, 0, 0, *row] for row in np.eye(3)),
            ],
            dtype=float,
        )
        basis = np.array([b / norm(b) for b in basis])
        hessian = np.array([[maclaurin_curvature(e, (a + b)) for a in basis] for b in basis])
        diagonal = np.diag(hessian) / 4
        hessian = 0.5 * (hessian - diagonal[:, None] - diagonal[None, :])
        return np.linalg.eigvalsh(hessian)[0]

    assert least(e) > 0
    assert least(0.82) < 0
    assert derivatives(squared((1, 1, 0.6)), (0, 0, np.sqrt(maclaurin(0.6).load)), TOROIDAL)[
        0
    ] == pytest.approx(0)


def test_jacobi_ellipsoid_is_a_stationary_minimum_at_fixed_angular_momentum():
    f = jacobi(0.7)
    s = squared((1, f.a2_a1, f.a3_a1))
    spin = (0, 0, np.sqrt(f.load))
    rng = np.random.default_rng(5)
    for _ in range(50):
        d = rng.standard_normal(6)
        d[:3] -= d[:3].mean()
        first, second, _ = derivatives(s, spin, d)
        assert first == pytest.approx(0.0, abs=1e-13)
        assert second > 0


# ---- friction mobilised: theory.md section 5, no stress jump, associative


@pytest.mark.parametrize(
    ("axes", "w2", "angle", "curvature"),
    [
        ((1, 1, 1), 0.4, 10.164, 1.3516),
        ((1, 0.8, 0.7), 0.2, 2.838, 0.5586),
        ((1, 0.6, 0.6), 0.0, 11.093, 0.7955),
        ((1, 1, 0.6), 0.8, 27.901, 4.613),
    ],
)
def test_curvature_at_mobilised_friction(axes, w2, angle, curvature):
    s = squared(axes)
    stress = np.empty(6)
    spin = np.array([0, 0, np.sqrt(w2)])
    rigid_stress(*s, 1.0, 1.0, spin, np.zeros(6), stress)
    p = -stress[:3].mean()
    dev = stress[:3] + p
    k = np.linalg.norm(dev) / p
    assert np.rad2deg(np.arcsin(3 * k / (2 * np.sqrt(6) + k))) == pytest.approx(angle, abs=6e-4)
    d = np.zeros(6)
    d[:3] = dev / np.linalg.norm(dev) + k / 3
    assert derivatives(s, spin, d)[1] / (p * MASS) == pytest.approx(curvature, rel=1.5e-4)
