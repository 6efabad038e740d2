"""Piles made from bodies: shape, spin, friction, and the cache."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body import pile as piles
from flybystab.body.body import Body, Material
from flybystab.body.pile import contact_friction, friction_table, make_pile
from flybystab.core.grains.clumps import moments, semi_axes, spin_of
from flybystab.errors import InvalidInput


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
    with pytest.raises(InvalidInput, match="cohesion"):
        make_pile(body(material=Material(cohesion=10 * u.Pa)), 100)
    with pytest.raises(InvalidInput, match="friction_angle"):
        make_pile(body(material=Material(friction_angle=60 * u.deg)), 100)
