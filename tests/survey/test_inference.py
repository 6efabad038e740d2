"""Bounds on the material from shape, spin and passages."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

from flybystab.aggregate.body import Body
from flybystab.constants import R_EARTH, G
from flybystab.errors import InvalidInput
from flybystab.flybys import flyby
from flybystab.sky.encounter import Encounter
from flybystab.survey.catalogue import Asteroid
from flybystab.survey.inference import infer, inference_figure, survived

DENSITIES = [1500, 2500] * u.kg / u.m**3


def test_spinning_sphere_has_its_closed_form():
    # w2 = (8/3) sin(phi)/(1 + sin(phi)), w2 = omega^2/(pi G rho)
    body = Body(semi_axes=[500, 500, 500] * u.m, density=2000 * u.kg / u.m**3, spin_period=3 * u.h)
    table = infer(body, densities=DENSITIES, cohesions=[0] * u.Pa)
    w2 = (2 * np.pi / 10800) ** 2 / (np.pi * G * DENSITIES.value)
    sine = w2 / (8 / 3 - w2)
    assert np.sin(table["friction_equilibrium"]).value == pytest.approx(sine, rel=1e-9)
    assert np.all(table["friction_any_attitude"] == table["friction_equilibrium"])


def test_passages_only_tighten_and_agree_with_the_flyby():
    a = Asteroid.from_catalogue("Anteros")
    enc = Encounter.hyperbolic("earth", periapsis=3 * R_EARTH * u.m, v_inf=6 * u.km / u.s)
    table = infer(a, [enc], DENSITIES, [0, 50] * u.Pa, attitudes=6, seed=2)
    assert len(table) == 4
    rest, least, most = (
        table[f"friction_{n}"].value for n in ("equilibrium", "any_attitude", "every_attitude")
    )
    assert np.all(least >= rest)
    assert np.all(most >= least)
    assert np.all(most[[0, 2]] > rest[[0, 2]])
    assert np.all(most[[1, 3]] <= most[[0, 2]])  # cohesion helps
    # The same demand along one attitude, by the public function.
    body = a.body.with_(density=DENSITIES[0])
    one = flyby(body, enc, error=False, history=False).max_required_friction_angle.value
    assert rest[0] - 1e-6 <= one
    assert table.meta["passages"] == ["earth scripted 19134 km"]


def test_fast_rotator_needs_cohesion():
    table = infer(
        Asteroid.from_catalogue("1950 DA"), densities=[1700] * u.kg / u.m**3, cohesions=[0, 200] * u.Pa
    )
    assert table["friction_equilibrium"][0] == np.inf * u.deg
    assert table["friction_equilibrium"][1] < 60 * u.deg


def test_toutatis_2004_is_among_its_passages_and_hardly_loads_it():
    a = Asteroid.from_catalogue("Toutatis")
    past = survived(a, Time("2000-01-01", scale="tdb"), Time("2010-01-01", scale="tdb"), within=0.02 * u.au)
    assert [e.time.tdb.isot[:10] for e in past] == ["2004-09-29"]
    table = infer(a, past, densities=[2000] * u.kg / u.m**3, cohesions=[0] * u.Pa, attitudes=8)
    rise = table["friction_every_attitude"][0] - table["friction_equilibrium"][0]
    assert 0 * u.deg <= rise < 1 * u.deg


def test_figure_and_bad_input(tmp_path):
    a = Asteroid.from_catalogue("Anteros")
    path = inference_figure(infer(a, densities=DENSITIES, cohesions=[0] * u.Pa), tmp_path / "f.png")
    assert path.read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(InvalidInput, match="densities"):
        infer(a, densities=[0] * u.kg / u.m**3)
    with pytest.raises(InvalidInput, match="attitudes"):
        infer(a, attitudes=0)
    with pytest.raises(InvalidInput, match="cohesions"):
        infer(a, cohesions=[np.nan] * u.Pa)
