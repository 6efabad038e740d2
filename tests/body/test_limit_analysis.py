"""Limit analysis: its stress fields against their equations and the elastic solution, its bounds against each other."""

import astropy.units as u
import numpy as np
import pytest

import flybystab as fs
from flybystab.body.elastic_stress import elastic_stress
from flybystab.body.equilibrium import equilibrium
from flybystab.body.limit_analysis import TERMS, cohesion_bounds, self_equilibrated
from flybystab.core.ellipsoid.tide import tensor
from flybystab.errors import InvalidInput

AXES = np.array([700.0, 500.0, 400.0])
RHO = 2000 * u.kg / u.m**3
SPIN = [1e-4, -2e-4, 9e-4] * u.rad / u.s
TIDE = 1e-7 * np.array([[2.0, 0.3, -0.4], [0.3, -1.5, 0.2], [-0.4, 0.2, -0.5]]) / u.s**2


def values(fields, at):
    """Stress tensors (f, n, 3, 3) at scaled coordinates."""
    terms = np.prod(at[:, None, :] ** TERMS, axis=2)
    return tensor(np.einsum("nt,ftc->fnc", terms, fields))


def test_six_fields_carry_no_load():
    """As many as stress functions ``(1 - m^2)^2 A`` with a symmetric ``A``; no divergence, no traction."""
    fields = self_equilibrated(AXES)
    assert len(fields) == 6
    rng = np.random.default_rng(0)
    h = 1e-3
    inside = rng.uniform(-0.5, 0.5, (5, 3))
    divergence = sum(
        (values(fields, inside + h * np.eye(3)[k]) - values(fields, inside - h * np.eye(3)[k]))[..., k]
        / (2 * h * AXES[k])
        for k in range(3)
    )
    assert np.abs(divergence).max() * AXES[2] < 1e-9
    surface = rng.normal(size=(20, 3))
    surface /= np.linalg.norm(surface, axis=1)[:, None]
    normals = surface / AXES
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    traction = np.einsum("fnij,nj->fni", values(fields, surface), normals)
    assert np.abs(traction).max() < 1e-9


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_the_elastic_stress_is_one_of_the_admissible_fields(nu):
    """Two solutions of the same equations by different routes differ by fields that carry no load."""
    body = fs.Body(AXES * u.m, RHO, spin=SPIN)
    elastic = elastic_stress(body, TIDE, poisson=nu)
    at = np.random.default_rng(1).uniform(-0.5, 0.5, (60, 3))
    given = 2.5 * (1 - np.sum(at**2, axis=1))[:, None, None] * elastic.mean.value
    rest = (elastic.at(at * AXES * u.m).value - given).ravel()
    ways = values(self_equilibrated(AXES), at).reshape(6, -1).T
    weights, *_ = np.linalg.lstsq(ways, rest, rcond=None)
    # the mean over the volume is by quadrature, good to 1e-4
    assert np.abs(ways @ weights - rest).max() < 1e-3 * np.abs(rest).max()


def test_without_need_of_cohesion_both_bounds_are_zero():
    body = fs.Body(AXES * u.m, RHO, 6 * u.h)
    assert equilibrium(body).admissible
    bounds = cohesion_bounds(body)
    assert (bounds.necessary.value, bounds.sufficient.value) == (0.0, 0.0)
    # the elastic stress needs some, at the surface: local yield that another stress field avoids
    assert elastic_stress(body).yield_region().required_cohesion > 1 * u.Pa


@pytest.mark.parametrize("surface", ["mohr-coulomb", "drucker-prager"])
def test_bounds_of_fast_rotators(surface):
    material = fs.Material(yield_surface=surface)
    body = fs.Body(AXES * u.m, RHO, 1.5 * u.h, material=material)
    bounds = cohesion_bounds(body)
    # the mean stress, by the equilibrium of the package
    enough, short = (
        equilibrium(body.with_(material=material.with_(cohesion=f * bounds.necessary)))
        for f in (1.001, 0.999)
    )
    assert enough.admissible
    assert not short.admissible
    # (5/2) s (1 - m^2) needs 2.5 times as much at the centre; the best field less, and less than the elastic one
    assert bounds.necessary < bounds.sufficient < 1.6 * bounds.necessary
    elastic = [elastic_stress(body, poisson=nu).yield_region().required_cohesion for nu in (0.0, 0.25, 0.45)]
    assert bounds.sufficient < min(elastic)


def test_bounds_scale_with_the_square_of_density_and_size():
    """At equal ``w^2/(pi G rho)`` stresses go as ``G rho^2 a^2``."""
    one = cohesion_bounds(fs.Body([300, 250, 200] * u.m, 1500 * u.kg / u.m**3, 1.2 * u.h))
    two = cohesion_bounds(fs.Body([600, 500, 400] * u.m, 3000 * u.kg / u.m**3, 1.2 * u.h / np.sqrt(2)))
    for a, b in ((one.necessary, two.necessary), (one.sufficient, two.sufficient)):
        assert (b / a).value == pytest.approx(16.0, rel=1e-2)


def test_bad_input_is_named():
    with pytest.raises(InvalidInput, match="body"):
        cohesion_bounds(5)
