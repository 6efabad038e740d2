"""Bounds on the material from shape, spin and passages."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

from flybystab.body.body import Body
from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import R_EARTH, G
from flybystab.core.dynamics.run import body_state, integrate
from flybystab.core.material.surfaces import code_of
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby import flyby
from flybystab.plots.screening import inference_figure
from flybystab.screening import inference
from flybystab.screening.inference import infer, strongest_encounter, survived

DENSITIES = [1500, 2500] * u.kg / u.m**3


def test_spinning_sphere_has_its_closed_form():
    # w2 = (8/3) sin(phi)/(1 + sin(phi)), w2 = omega^2/(pi G rho)
    body = Body(semi_axes=[500, 500, 500] * u.m, density=2000 * u.kg / u.m**3, spin_period=3 * u.h)
    # on the cone: at the corner of Mohr-Coulomb the Lode angle is good to half the digits
    table = infer(body, densities=DENSITIES, cohesions=[0] * u.Pa, yield_surface="drucker-prager")
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
    (what,) = table.meta["passages"]
    assert what["passage"] == "Earth scripted, 19,134 km"
    assert what["followed"]
    assert what["adds_at_worst_attitude_deg"] == pytest.approx((most - rest)[np.isfinite(most)].max())


def test_bounds_are_where_the_dynamics_begins_to_yield():
    """Another route: located onsets in runs with friction just above and below, not the demand of rigidity."""
    a = Asteroid.from_catalogue("Anteros")
    enc = Encounter.hyperbolic("earth", periapsis=3 * R_EARTH * u.m, v_inf=6 * u.km / u.s)
    bodies, turns = inference._attitudes(a, 5, 7)
    for rho, c in ((1800.0, 0.0), (2500.0, 15.0)):
        table = infer(a, [enc], [rho] * u.kg / u.m**3, [c] * u.Pa, attitudes=5, seed=7)
        least, most = (table[f"friction_{n}_attitude"][0].to_value(u.rad) for n in ("any", "every"))

        def yields(phi, rho=rho, c=c):
            run = [
                integrate(
                    body_state(b.axes, rho, b.omega, q, phi=phi, cohesion=c, surface=code_of("mohr-coulomb")),
                    (enc.t_start, enc.t_stop),
                    enc.tide,
                )
                for b, q in zip(bodies, turns, strict=True)
            ]
            return sum(any(name == "onset" for name, _, _ in r.events) for r in run)

        assert yields(most + 1e-5) == 0
        assert yields(most - 1e-4) > 0
        assert yields(least - 1e-4) == 5
        assert yields(least + 1e-5) < 5


def test_cohesion_of_a_spinning_sphere_in_closed_form():
    # s = sqrt(2/3) rho a^2 w^2/5, p = rho a^2/5 (4/3 pi G rho - 2/3 w^2); on the cone s = k (p + Y cot phi)
    axis, rho, period = 300.0, 1500.0, 2.8 * 3600
    body = Body(semi_axes=[axis] * 3 * u.m, density=rho * u.kg / u.m**3, spin_period=period / 3600 * u.h)
    w2 = (2 * np.pi / period) ** 2
    s = np.sqrt(2 / 3) * rho * axis**2 * w2 / 5
    p = rho * axis**2 / 5 * (4 / 3 * np.pi * G * rho - 2 / 3 * w2)
    for phi in (20.0, 35.0):
        sine, tan = np.sin(np.radians(phi)), np.tan(np.radians(phi))
        y = tan * (s * (3 - sine) / (2 * np.sqrt(6) * sine) - p)
        table = infer(body, densities=[rho] * u.kg / u.m**3, cohesions=[y] * u.Pa)
        assert table["friction_equilibrium"][0].to_value(u.deg) == pytest.approx(phi, abs=1e-6)


def test_a_negligible_passage_is_bounded_instead_of_followed(monkeypatch):
    a = Asteroid.from_catalogue("Toutatis")  # a tumbler, at every phase
    enc = Encounter.hyperbolic("earth", periapsis=0.01 * u.au, v_inf=11 * u.km / u.s)
    args = a, [enc], [2000] * u.kg / u.m**3, [0, 20] * u.Pa
    cone = {"attitudes": 6, "yield_surface": "drucker-prager"}  # the bound of Mohr-Coulomb is wider
    quick = infer(*args, **cone)
    assert not quick.meta["passages"][0]["followed"]
    monkeypatch.setattr(inference, "NEGLIGIBLE", -1.0)
    full = infer(*args, **cone)
    assert full.meta["passages"][0]["followed"]
    assert np.all(quick["friction_any_attitude"] <= full["friction_any_attitude"] + 1e-6 * u.deg)
    assert np.all(quick["friction_every_attitude"] >= full["friction_every_attitude"] - 1e-6 * u.deg)


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


def test_the_strongest_encounter_is_that_of_the_strongest_tide():
    a = Asteroid.from_catalogue("Toutatis")
    past = survived(a, Time("1992-01-01", scale="tdb"), Time("2010-01-01", scale="tdb"))
    assert len(past) > 1
    table = infer(a, past, densities=[2000] * u.kg / u.m**3, cohesions=[0] * u.Pa, attitudes=2)
    assert "2004-09-29" in strongest_encounter(table)["passage"]
    assert strongest_encounter(infer(a, densities=[2000] * u.kg / u.m**3, attitudes=1)) is None


def test_figure_and_bad_input(tmp_path):
    a = Asteroid.from_catalogue("Anteros")
    path = inference_figure(infer(a, densities=DENSITIES), tmp_path / "f.png")
    assert path.stat().st_size > 20_000
    path = inference_figure(infer(a, densities=DENSITIES, cohesions=[0] * u.Pa), tmp_path / "f.png")
    assert path.read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(InvalidInput, match="densities"):
        infer(a, densities=[0] * u.kg / u.m**3)
    with pytest.raises(InvalidInput, match="attitudes"):
        infer(a, attitudes=0)
    with pytest.raises(InvalidInput, match="cohesions"):
        infer(a, cohesions=[np.nan] * u.Pa)


def test_a_name_is_not_an_asteroid():
    with pytest.raises(InvalidInput, match="from_catalogue"):
        infer("Toutatis")
