"""Batches and maps give what single bodies give."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.body.stability import stability
from flybystab.body.stability_regions import stability_many, stability_map
from flybystab.constants import G
from flybystab.errors import InvalidInput, UnknownName

RHO = 1900.0


def body(axes, w2, **material):
    omega = np.sqrt(w2 * np.pi * G * RHO)
    return Body(
        np.array(axes) * u.km,
        RHO * u.kg / u.m**3,
        spin=[0, 0, omega] * u.rad / u.s,
        material=Material(**material),
    )


def sample(n, seed=0, **material):
    rng = np.random.default_rng(seed)
    return [body(-np.sort(-rng.uniform(0.3, 1, 3)), rng.uniform(0, 0.9), **material) for _ in range(n)]


def test_many_bodies_agree_with_each_alone():
    # the cone: minima on the corners of Mohr-Coulomb are found to 1e-7 only
    cone = "drucker-prager"
    bodies = sample(12, friction_angle=32 * u.deg, cohesion=3 * u.Pa, yield_surface=cone)
    table = stability_many(bodies)
    for i, b in enumerate(bodies):
        s, e = stability(b), equilibrium(b)
        assert table.level[i] == s.level
        assert table.required_friction_angle[i].value == pytest.approx(e.required_friction_angle.value)
        assert table.mean_pressure[i].value == pytest.approx(e.mean_pressure.value)
        assert table.required_cohesion[i].value == pytest.approx(e.required_cohesion.value)
        assert table.energy_second[i].value == pytest.approx(s.critical_energy.second.value, rel=1e-8)
        assert table.strain_second[i] == pytest.approx(s.critical_strain.second, rel=1e-8)
        # the search of a single body starts from more directions
        assert table.energy_barrier[i] >= s.critical_energy.barrier * (1 - 1e-3)


def test_answers_do_not_depend_on_the_threads():
    bodies = sample(40)
    one, three = (stability_many(bodies, workers=n, depth="second") for n in (1, 3))
    assert np.array_equal(one.energy_second, three.energy_second, equal_nan=True)
    assert np.array_equal(one.names(), three.names())


def test_depth_decides_what_is_computed():
    bodies = sample(5)
    shallow = stability_many(bodies, depth="infinitesimal")
    assert np.isnan(shallow.energy_second).all()
    deep = stability_many(bodies, depth="third")
    assert not np.isnan(deep.energy_third).any()
    assert np.isnan(deep.energy_barrier).all()


def test_friction_angle_in_place_of_the_bodies_own():
    bodies = sample(30, seed=2)
    levels = [
        stability_many(bodies, friction_angle=f * u.deg, depth="infinitesimal").level for f in (5, 20, 40)
    ]
    assert levels[0].sum() < levels[1].sum() < levels[2].sum()


def test_map_over_shapes_is_dimensionless_and_agrees_with_a_body():
    a2, a3 = np.linspace(0.2, 1, 9), np.linspace(0.2, 1, 7)
    cone = "drucker-prager"  # see above
    t = stability_map(a2[None, :], a3[:, None], 0.3, 30 * u.deg, yield_surface=cone)
    assert t.level.shape == (7, 9)
    shape = a3[:, None] <= a2[None, :]
    assert np.array_equal(t.level >= 0, shape)
    assert set(t.names()[~shape]) == {"not a shape"}
    i, j = 3, 7
    s = stability(body((1, a2[j], a3[i]), 0.3, friction_angle=30 * u.deg, yield_surface=cone))
    assert t.level[i, j] == s.level
    ratio = (s.critical_energy.second / s.binding_energy).value
    assert t.energy_second[i, j].value == pytest.approx(ratio, rel=1e-9)
    assert t.required_friction_angle[i, j].value == pytest.approx(s.equilibrium.required_friction_angle.value)


def test_map_over_spin_and_shape():
    w2 = np.linspace(0, 1.2, 25)
    t = stability_map(1.0, 0.8, w2, 30 * u.deg, depth="infinitesimal")
    assert np.array_equal(t.level > 0, w2 <= 0.87453)  # the spin limit of (1, 1, 0.8)


def test_empty_input_gives_an_empty_table():
    assert stability_many([]).level.shape == (0,)


def test_bad_input_is_named():
    with pytest.raises(UnknownName, match="second"):
        stability_map(1, 0.8, 0.1, 30 * u.deg, depth="secnd")
    with pytest.raises(UnknownName, match="mohr"):
        stability_map(1, 0.8, 0.1, 30 * u.deg, yield_surface="mohr")
    with pytest.raises(InvalidInput, match="w2"):
        stability_map(1, 0.8, -0.1, 30 * u.deg)
    with pytest.raises(InvalidInput, match="one yield surface"):
        stability_many([*sample(1), *sample(1, yield_surface="matsuoka-nakai")])
    with pytest.raises(InvalidInput, match="workers"):
        stability_many(sample(1), workers=0)
