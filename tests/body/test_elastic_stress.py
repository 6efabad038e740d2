"""Elastic stress of ellipsoids against closed forms of spheres and cylinders, and against its equations."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.body.elastic_stress import elastic_stress, stress_change
from flybystab.constants import G
from flybystab.core.ellipsoid.rigid_stress import rigid_stress
from flybystab.core.ellipsoid.surface_slope import effective_field
from flybystab.errors import InvalidInput

RHO = 2000.0
TIDE = 1e-7 * np.array([[2.0, 0.3, -0.4], [0.3, -1.5, 0.2], [-0.4, 0.2, -0.5]])
SPIN = [1e-4, -2e-4, 3e-4] * u.rad / u.s


def triaxial():
    return fs.Body([700.0, 500.0, 400.0] * u.m, RHO * u.kg / u.m**3, spin=SPIN)


@pytest.mark.parametrize("nu", [0.0, 0.25, 0.4, 0.49])
def test_a_self_gravitating_sphere(nu):
    """Love (1927), section 98: radial and tangential stress of a solid sphere under its own gravity."""
    a = 500.0
    ball = fs.Body([a, a, a] * u.m, RHO * u.kg / u.m**3)
    r = np.linspace(0.0, 1.0, 7)
    stress = elastic_stress(ball, poisson=nu).at(np.column_stack([r * a, 0 * r, 0 * r]) * u.m).value
    scale = RHO * 4 / 3 * np.pi * G * RHO * a * a / (10 * (1 - nu))
    assert stress[:, 0, 0] == pytest.approx(-scale * (3 - nu) * (1 - r**2), abs=1e-9 * scale)
    tangential = -scale * ((3 - nu) - (1 + 3 * nu) * r**2)
    assert stress[:, 1, 1] == pytest.approx(tangential, abs=1e-9 * scale)
    assert stress[:, 2, 2] == pytest.approx(tangential, abs=1e-9 * scale)


def test_a_spinning_sphere():
    """The isotropic part of the centrifugal force, (2/3) omega^2 r, acts as a gravity of the other sign."""
    a, nu, w = 500.0, 0.3, 2e-4
    ball = fs.Body([a, a, a] * u.m, RHO * u.kg / u.m**3)
    x = np.array([[0.0, 0.0, 0.0]]) * u.m
    rest = elastic_stress(ball, poisson=nu).at(x).value[0]
    spinning = elastic_stress(ball.with_(spin=[0, 0, w] * u.rad / u.s), poisson=nu).at(x).value[0]
    gravity = 4 / 3 * np.pi * G * RHO
    # at the centre the quadrupole part has no trace
    assert np.trace(spinning) / np.trace(rest) == pytest.approx(1 - (2 / 3) * w**2 / gravity, rel=1e-10)
    assert spinning[0, 0] == pytest.approx(spinning[1, 1])
    assert spinning[0, 0] > spinning[2, 2]


def test_a_long_spinning_body_is_a_rotating_cylinder():
    """Timoshenko & Goodier, Theory of Elasticity, section 119 and 203: plane strain with no axial force."""
    a, nu, w = 100.0, 0.3, 1e-4
    rod = fs.Body([20_000.0, a, a] * u.m, RHO * u.kg / u.m**3)
    r = np.array([0.0, 0.5, 0.99])
    x = np.column_stack([0 * r, r * a, 0 * r]) * u.m
    spinning = elastic_stress(rod.with_(spin=[w, 0, 0] * u.rad / u.s), poisson=nu).at(x)
    stress = (spinning - elastic_stress(rod, poisson=nu).at(x)).value / (RHO * w**2 * a**2)
    first = (3 - 2 * nu) / (8 * (1 - nu))
    assert stress[:, 1, 1] == pytest.approx(first * (1 - r**2), rel=1e-4, abs=1e-6)
    hoop = first - (1 + 2 * nu) / (8 * (1 - nu)) * r**2
    assert stress[:, 2, 2] == pytest.approx(hoop, rel=1e-4)
    assert stress[:, 0, 0] == pytest.approx(nu / (4 * (1 - nu)) * (1 - 2 * r**2), rel=1e-3)


def test_equilibrium_and_free_surface_of_a_tumbling_body_in_a_tide():
    """Differences of the stress against the body force; with the compatible strain these fix the solution."""
    body = triaxial()
    found = elastic_stress(body, TIDE / u.s**2, poisson=0.3)
    field = np.empty((3, 3))
    six = np.array([TIDE[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
    effective_field(body.axes**2, np.pi * G * RHO, body.omega, six, field)
    rng = np.random.default_rng(0)
    h = 1.0
    for x in rng.uniform(-0.5, 0.5, (4, 3)) * body.axes:
        divergence = np.zeros(3)
        for k in range(3):
            step = h * np.eye(3)[k]
            ends = found.at(np.array([x + step, x - step]) * u.m).value
            divergence += (ends[0] - ends[1])[:, k] / (2 * h)
        assert divergence == pytest.approx(-RHO * field @ x, rel=1e-6, abs=1e-9)
    n = rng.standard_normal((20, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    surface = n * body.axes
    traction = np.einsum("nij,nj->ni", found.at(surface * u.m).value, surface / body.axes**2)
    assert np.abs(traction).max() * body.axes[2] < 1e-9 * np.abs(found.mean.value).max()


def test_the_mean_is_that_of_the_rigid_body_for_any_poisson_ratio():
    body = triaxial()
    six = np.array([TIDE[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
    rigid = np.empty(6)
    rigid_stress(*body.axes**2, RHO, np.pi * G * RHO, body.omega, six, rigid)
    local = []
    for nu in (0.0, 0.2, 0.45):
        found = elastic_stress(body, TIDE / u.s**2, poisson=nu)
        mean = found.mean.value
        got = [mean[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        assert got == pytest.approx(rigid, rel=1e-3, abs=1e-3 * np.abs(rigid).max())
        local.append(found.at([[0.0, 0.0, 0.0]] * u.m).value[0, 2, 2])
    assert np.ptp(local) > 0.1 * abs(local[0])


def test_yield_of_a_sphere():
    """Gravity: the deviator is (1 + 3 nu - (3 - nu)) r^2 and cohesion is needed at the surface first."""
    a, nu = 500.0, 0.25
    ball = fs.Body([a, a, a] * u.m, RHO * u.kg / u.m**3)
    stress = elastic_stress(ball, poisson=nu)
    scale = RHO * 4 / 3 * np.pi * G * RHO * a * a / (10 * (1 - nu))
    phi = np.deg2rad(30.0)
    r = np.linspace(0, 1, 2001)
    radial = scale * (3 - nu) * (1 - r**2)
    hoop = scale * ((3 - nu) - (1 + 3 * nu) * r**2)
    # Mohr-Coulomb, compression positive: c cos(phi) = (s1 - s3)/2 - (s1 + s3)/2 sin(phi)
    high, low = np.maximum(radial, hoop), np.minimum(radial, hoop)
    needed = ((high - low) / 2 - (high + low) / 2 * np.sin(phi)) / np.cos(phi)
    material = fs.Material(friction_angle=30 * u.deg, cohesion=0.5 * needed.max() * u.Pa)
    region = stress.yield_region(material)
    assert region.depth < 0.02
    assert region.required_cohesion.value == pytest.approx(needed.max(), rel=0.03)
    start = r[np.argmax(needed > 0.5 * needed.max())]
    assert region.share == pytest.approx(1.0 - start**3, abs=0.03)
    strong = fs.Material(friction_angle=30 * u.deg, cohesion=2 * needed.max() * u.Pa)
    assert stress.yield_region(strong).share == 0.0


def test_a_fast_spinning_sphere_yields_at_its_centre():
    """Beyond the spin limit the tension is largest inside: the interior fails first (Hirabayashi 2015)."""
    a = 500.0
    w = 1.3 * np.sqrt(4 / 3 * np.pi * G * RHO)
    fast = fs.Body([a, a, a] * u.m, RHO * u.kg / u.m**3, spin=[0, 0, w] * u.rad / u.s)
    region = elastic_stress(fast, poisson=0.25).yield_region(fs.Material(cohesion=1 * u.Pa))
    assert region.depth > 0.9
    slow = fast.with_(spin=[0, 0, 0.3 * w] * u.rad / u.s)
    assert elastic_stress(slow, poisson=0.25).yield_region().depth < 0.1


def test_changes_and_bad_input():
    body = triaxial()
    still = elastic_stress(body)
    assert stress_change(still, still).value == 0.0
    tide = [elastic_stress(body, k * TIDE / u.s**2) for k in (0.0, 1.0, 2.0)]
    one, two = stress_change(tide[0], tide[1]), stress_change(tide[0], tide[2])
    assert two.value == pytest.approx(2 * one.value, rel=1e-6)
    with pytest.raises(InvalidInput, match="second"):
        stress_change(still, elastic_stress(body, poisson=0.3))
    with pytest.raises(InvalidInput, match="poisson"):
        elastic_stress(body, poisson=0.5)
    with pytest.raises(InvalidInput, match="inside"):
        still.at([[800.0, 0.0, 0.0]] * u.m)
