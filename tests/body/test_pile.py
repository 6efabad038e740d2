"""Piles made from bodies: shape, spin, friction, and the cache."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body import pile as piles
from flybystab.body.body import Body, Material
from flybystab.body.grain_calibration import contact_friction, friction_table
from flybystab.body.grain_sizes import GrainSizes, grain_sizes
from flybystab.body.pile import Pile, make_pile
from flybystab.body.shape import Shape
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.errors import InvalidInput, NotModelled, UnitMismatch, UnknownName, UnsettledBody


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))
    return tmp_path


def body(**changes):
    options = {
        "semi_axes": [1408, 850, 748] * u.m,
        "density": 2000 * u.kg / u.m**3,
        "spin_period": 6 * u.h,
        **changes,
    }
    return Body(**options)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"semi_axes": [1.1, 1.0, 1.0] * u.km, "spin_period": None},
        {"spin_period": None, "spin": [1e-4, 0, 2e-4] * u.rad / u.s},
    ],
)
def test_a_pile_has_the_body_s_shape_mass_and_spin(changes):
    b = body(**changes)
    made = make_pile(b, 300, 1)
    g = made.simulation.grains
    assert made.count == 300
    mass, centre, velocity, inertia, momentum = moments(g, g.mass > 0)
    axes, vectors = semi_axes(mass, inertia)
    np.testing.assert_allclose(made.axes, b.axes, rtol=0.02)
    np.testing.assert_allclose(axes * made.length, made.axes, rtol=1e-12)
    # density is that of the body up to what relaxation did to the volume
    np.testing.assert_allclose(np.prod(made.axes), np.prod(b.axes), rtol=2e-3)
    np.testing.assert_allclose(spin_of(inertia, momentum) / made.time, b.omega, atol=1e-9)
    assert np.abs(centre).max() < 1e-12
    assert np.abs(velocity).max() < 1e-12
    if b.axes[0] > 1.2 * b.axes[1]:
        assert abs(vectors[0, 0]) > 0.999  # the long axis lies along x


def test_piles_differ_by_seed_and_repeat():
    b = body()
    first, again, other = (make_pile(b, 100, s).simulation.grains.x for s in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_the_cache_is_used_and_made_anew_where_damaged(folder, monkeypatch):
    b = body()
    first = make_pile(b, 100, 1).simulation.grains.x
    (path,) = (folder / "piles").glob("*.npz")
    whole = path.read_bytes()
    calls = []
    monkeypatch.setattr(piles, "settled_pile", lambda *a: calls.append(a) or original(*a))
    np.testing.assert_array_equal(make_pile(b, 100, 1).simulation.grains.x, first)
    assert not calls
    for damage in (b"", whole[: len(whole) // 2], whole[:2000] + b"\0" * 64 + whole[2064:]):
        path.write_bytes(damage)
        np.testing.assert_array_equal(make_pile(b, 100, 1).simulation.grains.x, first)
        assert path.read_bytes() == whole or len(path.read_bytes()) == len(whole)
    assert len(calls) == 3


original = piles.settled_pile


def test_a_pile_of_another_size_and_density_is_the_same_in_scaled_units(folder):
    # without cohesion only the spin over sqrt(G rho) matters
    one = make_pile(body(), 100, 1)
    twice = body(semi_axes=[2816, 1700, 1496] * u.m, density=500 * u.kg / u.m**3, spin_period=12 * u.h)
    other = make_pile(twice, 100, 1)
    np.testing.assert_allclose(other.simulation.grains.x, one.simulation.grains.x, atol=1e-6)
    np.testing.assert_allclose(other.axes, 2 * one.axes, rtol=1e-6)
    assert len(list((folder / "piles").glob("*.npz"))) == 1


def test_friction_is_interpolated_and_refused_beyond_the_table():
    table = friction_table()
    assert len(table) >= 5
    for f in table:
        found = contact_friction(np.deg2rad(f.angle))
        assert (found.mu_s, found.beta) == pytest.approx((f.mu_s, f.beta))
    middle = contact_friction(np.deg2rad(35.0))
    assert middle.mu_s == pytest.approx(0.6)
    assert 0.15 < middle.beta < 0.3
    for angle in (5.0, 60.0):
        with pytest.raises(InvalidInput, match=rf"{table[0].angle:.1f} to {table[-1].angle:.1f} deg"):
            contact_friction(np.deg2rad(angle))


def test_bad_input_is_refused():
    with pytest.raises(InvalidInput, match="grains"):
        make_pile(body(), 3)
    with pytest.raises(InvalidInput, match="at most"):
        make_pile(body(), 10**9)
    with pytest.raises(InvalidInput, match="times the central pressure"):
        make_pile(body(material=Material(cohesion=10 * u.MPa)), 100)
    with pytest.raises(NotModelled, match="a pile of grains does not model a tension cut-off"):
        make_pile(body(material=Material(cohesion=10 * u.Pa, tensile_strength=1 * u.Pa)), 100)
    with pytest.raises(InvalidInput, match="brittle"):
        make_pile(body(material=Material(cohesion=10 * u.Pa, brittle=True)), 100)
    with pytest.raises(InvalidInput, match="friction_angle"):
        make_pile(body(material=Material(friction_angle=60 * u.deg)), 100)


@pytest.mark.parametrize("overlap", [float("nan"), float("inf"), -0.002, 0.0, 1e-9, 0.5, 1e300])
def test_an_overlap_out_of_range_is_refused(overlap):
    body = Body([200, 150, 140] * u.m, 2000 * u.kg / u.m**3, spin_period=5 * u.h)
    with pytest.raises(InvalidInput, match="overlap"):
        make_pile(body, 100, keep=False, overlap=overlap)


def test_a_public_pile_has_quantities_of_the_body():
    b = body()
    pile = Pile(b, 200, 3)
    assert pile.positions.shape == (200, 3)
    np.testing.assert_allclose(pile.masses.sum(), b.mass, rtol=1e-12)
    np.testing.assert_allclose(
        (pile.masses[:, None] * pile.positions).sum(axis=0) / b.mass, 0 * u.m, atol=1e-6 * u.m
    )
    np.testing.assert_allclose(pile.semi_axes, b.semi_axes, rtol=0.02)
    np.testing.assert_allclose(pile.spin_vector[2], 2 * np.pi * u.rad / (6 * u.h), rtol=1e-9)
    assert 0.25 < pile.porosity < 0.45  # random packings of spheres
    ratio = pile.radii.max() / pile.radii.min()
    assert 1.8 < ratio < 1.4 / 0.6
    assert "200 grains, seed 3" in repr(pile)
    # the state is a copy: advancing it leaves the pile as it was
    before = pile.positions
    pile.state().simulation.advance(0.1)
    np.testing.assert_array_equal(pile.positions, before)


def test_a_pile_has_the_form_of_a_polyhedron():
    shape = Shape.contact_binary([600, 450, 400] * u.m, [400, 350, 300] * u.m, facets=1000)
    pile = Pile(shape, 300, 1, density=2 * u.g / u.cm**3, spin_period=8 * u.h)
    # bulk density over the volume of the polyhedron
    np.testing.assert_allclose(pile.masses.sum() / shape.volume, 2 * u.g / u.cm**3, rtol=1e-9)
    inertia = shape.inertia.to_value(u.m**2)
    axes = np.sqrt(2.5 * (inertia.sum() - 2 * inertia))
    np.testing.assert_allclose(pile.semi_axes.to_value(u.m), axes, rtol=0.03)
    # the large lobe lies on the same side, and the neck holds as little: third moment and mass about the neck along x
    x, m = pile.positions.to_value(u.m)[:, 0], (pile.masses / pile.masses.sum()).value
    corners = shape.vertices.value[shape.facets]
    cone = (
        np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    )  # volumes from the origin
    third = (cone * (1.0 / 20.0) * _sum_of_products(corners[:, :, 0])).sum() / cone.sum()
    assert abs(third) ** (1 / 3) > 100.0
    assert m @ x**3 == pytest.approx(third, rel=0.35)
    np.testing.assert_allclose(pile.spin_vector[2], 2 * np.pi * u.rad / (8 * u.h), rtol=1e-6)


def _sum_of_products(x):
    """``a b c`` summed over all multisets of three out of the three corners of a facet: 20 times the mean of x^3 in the
    cone from the origin over it."""
    a, b, c = x.T
    return (
        a**3 + b**3 + c**3 + a * a * b + a * a * c + b * b * a + b * b * c + c * c * a + c * c * b + a * b * c
    )


@pytest.mark.parametrize("index", [-1.0, 0.0, 2.0, 3.0])
def test_sizes_follow_the_power_law(index):
    sizes = grain_sizes("power law", index, (1.0, 5.0))
    r = sizes.draw(40_000, np.random.default_rng(1))
    assert 1.0 <= r.min() < 1.001
    assert 4.95 < r.max() <= 5.0
    # cumulative counts at three radii, five standard errors
    for x in (1.3, 2.0, 3.5):
        if index == 0.0:
            share = 1.0 - np.log(x) / np.log(5.0)
        else:
            share = (x**-index - 5.0**-index) / (1.0 - 5.0**-index)
        assert (r > x).mean() == pytest.approx(share, abs=5 * np.sqrt(share * (1 - share) / len(r)))
    assert grain_sizes() == GrainSizes()


def test_a_pile_with_a_power_law_of_sizes():
    pile = Pile(body(), 200, 1, "power law", index=3.0, size_range=(1, 4))
    r = pile.radii / np.median(pile.radii)
    assert r.max() > 2.0
    assert (r < 1.3).mean() > 0.65
    np.testing.assert_allclose(pile.semi_axes, body().semi_axes, rtol=0.03)
    assert "power law 3" in repr(pile)


def test_the_friction_angle_of_a_pile_is_measured():
    pile = Pile(body(), 100, 1)
    found, error = pile.friction_angle.to_value(u.deg), pile.friction_angle_error.to_value(u.deg)
    assert 0.3 < error < 4.0
    assert abs(found - 35.0) < 3.0 * error
    loose = Pile(body(material=Material(friction_angle=18 * u.deg)), 100, 1).friction_angle.to_value(u.deg)
    assert loose < found - 8.0


def test_bad_piles_are_refused_by_name():
    shape = Shape.from_ellipsoid([3, 2, 1] * u.km, facets=200)
    rho = 2 * u.g / u.cm**3
    for name, make in {
        "source": lambda: Pile("Apophis"),
        "density": lambda: Pile(shape),
        "spin_period": lambda: Pile(body(), spin_period=3 * u.h),
        "material": lambda: Pile(shape, density=rho, material="sand"),
        "grains": lambda: Pile(body(), 7),
        "seed": lambda: Pile(body(), seed=-1),
        "index": lambda: Pile(body(), index=3.0),
        "size_range": lambda: Pile(body(), size_range=(1.0, 20.0)),
        "friction_angle": lambda: Pile(body(material=Material(friction_angle=70 * u.deg))),
    }.items():
        with pytest.raises(InvalidInput, match=name):
            make()
    for wrong in ((2.0, 1.0), (0.0, 1.0), (1.0,), "wide", (1.0, np.nan)):
        with pytest.raises(InvalidInput, match="size_range"):
            Pile(body(), size_range=wrong)
    for wrong in ("3", np.nan, True, 11.0):
        with pytest.raises(InvalidInput, match="index"):
            Pile(body(), size_distribution="power law", index=wrong)
    with pytest.raises(UnknownName, match="power law"):
        Pile(body(), size_distribution="powerlaw")
    with pytest.raises(UnitMismatch, match="density"):
        Pile(shape, density=2.0)
    with pytest.raises(UnsettledBody):
        Pile(body(state="flowing"))


def test_more_grains_than_fit_are_refused_with_the_number_that_fits(monkeypatch):
    body = Body([1408, 850, 748] * u.m, 2000 * u.kg / u.m**3)
    monkeypatch.setattr("flybystab.body.pile._memory", lambda: 8e6)
    with pytest.raises(InvalidInput, match="at most 2000 grains, which fit in the memory of this machine"):
        Pile(body, grains=2001)
    assert Pile(body, grains=2000).grains == 2000
    monkeypatch.setattr("flybystab.body.pile._memory", lambda: np.inf)
    with pytest.raises(InvalidInput, match="at most 200000 grains, which take days"):
        Pile(body, grains=200_001)
