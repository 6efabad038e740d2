"""Draws: their distributions, their reproducibility, and the catalogue's share in them."""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Material
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.lightcurves import periods_like
from flybystab.errors import InvalidInput, UnknownName
from flybystab.screening.distributions import Distribution, truncated_normal
from flybystab.screening.draws import Attitudes, Samples, draws, nominal, stream
from flybystab.screening.priors import Population

APOPHIS = Asteroid.from_catalogue("Apophis")
ANTEROS = Asteroid.from_catalogue("Anteros")
GRID = (np.arange(20000) + 0.5) / 20000


def test_distributions_have_the_moments_that_their_parameters_say():
    assert Distribution("uniform", low=25, high=45).quantile(GRID).mean() == pytest.approx(35)
    x = Distribution("normal", mean=2000, sd=700).quantile(GRID)
    assert (x.mean(), x.std()) == (pytest.approx(2000), pytest.approx(700, rel=1e-3))
    x = Distribution("lognormal", median=0.14, sigma=0.8).quantile(GRID)
    assert np.median(x) == pytest.approx(0.14, rel=1e-3)
    assert np.log(x).std() == pytest.approx(0.8, rel=1e-3)
    x = Distribution("loguniform", low=1, high=100).quantile(GRID)
    assert np.median(x) == pytest.approx(10, rel=1e-3)
    assert np.all(Distribution("fixed", value=3).quantile(GRID) == 3)
    x = Distribution("catalogue").quantile(GRID, np.array([1.0, 2.0, 4.0, 9.0]))
    assert [np.mean(x == v) for v in (1, 2, 4, 9)] == pytest.approx([0.25] * 4)


def test_truncation_keeps_the_shape_inside():
    x = truncated_normal(GRID, 0.0, 1.0, -0.5, 2.0)
    assert x.min() > -0.5
    assert x.max() < 2.0
    density = np.histogram(x, [-0.01, 0.01, 0.99, 1.01])[0]
    assert density[2] / density[0] == pytest.approx(np.exp(-0.5), rel=0.06)


@pytest.mark.parametrize(
    ("data", "error", "match"),
    [
        ({"cohesion": 3}, UnknownName, "cohesion_Pa"),
        ({"cohesion_Pa": {"kind": "unifrom", "low": 1, "high": 2}}, UnknownName, "uniform"),
        ({"cohesion_Pa": {"kind": "uniform", "low": 3, "high": 2}}, InvalidInput, "at most high"),
        ({"cohesion_Pa": {"kind": "uniform", "low": 3}}, InvalidInput, "high"),
        ({"cohesion_Pa": {"kind": "uniform", "lo": 3}}, UnknownName, "low"),
        ({"cohesion_Pa": "none"}, InvalidInput, "kind"),
        ({"albedo": {"kind": "lognormal", "median": -1.0, "sigma": 1.0}}, InvalidInput, "positive scale"),
        ({"albedo": {"kind": "normal", "mean": float("nan"), "sd": 1.0}}, InvalidInput, "finite"),
        ({"replace_assumed": 1}, InvalidInput, "true or false"),
        ({"cohesion_Pa": {"kind": "normal", "mean": 50, "sd": 50}}, InvalidInput, "low and high truncate"),
        ({"flattening": 1.2}, InvalidInput, "within"),
        ({"albedo": {"kind": "catalogue"}}, InvalidInput, "numbers of its own"),
        ({"density_by_class_kg_m3": {"S-type": 2000}}, InvalidInput, "first letters"),
        ({"density_by_class_kg_m3": {"S": {"kind": "normal", "mean": 3}}}, InvalidInput, "S.sd"),
        ({"log_elongation_sigma": "wide"}, InvalidInput, "0 to 1"),
    ],
)
def test_bad_population_is_named(data, error, match):
    with pytest.raises(error, match=match):
        Population.from_mapping(data)


def test_population_from_toml(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text(
        'cohesion_Pa = 0\n[friction_angle_deg]\nkind = "normal"\nmean = 33\nsd = 2\nlow = 20\nhigh = 50\n'
    )
    p = Population.from_file(path)
    d = draws(APOPHIS, 500, 1, p)
    assert np.all(d.cohesion == 0)
    assert np.degrees(d.phi).mean() == pytest.approx(33, abs=0.3)
    assert "33" in p.stated()["friction_angle_deg"]
    with pytest.raises(InvalidInput, match="readable"):
        Population.from_file(tmp_path / "missing.toml")
    path.write_text("cohesion_Pa = = 3")
    with pytest.raises(InvalidInput, match="TOML"):
        Population.from_file(path)
    path.write_text(Population().toml())
    assert Population.from_file(path) == Population()


def test_a_draw_depends_on_seed_and_asteroid_only():
    few, many = draws(ANTEROS, 10, 7), draws(ANTEROS, 50, 7)
    for name in ("axes", "rho", "phi", "omega"):
        assert np.array_equal(getattr(few, name), getattr(many, name)[:10])
    assert not np.array_equal(few.rho, draws(ANTEROS, 10, 8).rho)
    assert not np.array_equal(few.phi, draws(APOPHIS, 10, 7).phi)
    a = Attitudes.at(ANTEROS, few, 7, "earth", "2462240.4")
    b = Attitudes.at(ANTEROS, many, 7, "earth", "2462240.4")
    assert np.array_equal(a.matrix(3), b.matrix(3))
    assert not np.allclose(a.matrix(3), Attitudes.at(ANTEROS, few, 7, "venus", "2462240.4").matrix(3))
    assert stream(1, "a", "b").random() != stream(1, "ab").random()


def test_nominal_body_is_the_catalogues():
    for asteroid in catalogue()[::20]:
        d = nominal(asteroid, Material(friction_angle=30 * u.deg, cohesion=5 * u.Pa))
        body = d.body(0, Material())
        assert body.axes == pytest.approx(asteroid.body.axes, rel=2e-5)
        assert body.rho == asteroid.body.rho
        assert body.omega == pytest.approx(asteroid.body.omega)
        assert body.material.phi == pytest.approx(np.radians(30))
        assert body.material.c_pa == 5


def test_samples_spread_as_the_catalogue_says():
    d = draws(ANTEROS, 4000, 0)
    row = ANTEROS.record
    size = 2 * np.cbrt(np.prod(d.axes, axis=1))
    assert size.mean() == pytest.approx(row["diameter_m"].value, rel=0.01)
    assert size.std() == pytest.approx(row["diameter_sigma_m"].value, rel=0.05)
    assert d.rho.mean() == pytest.approx(row["density_kg_m3"].value, rel=0.02)
    assert d.rho.std() == pytest.approx(row["density_sigma_kg_m3"].value, rel=0.05)
    assert np.all(d.axes[:, 0] >= d.axes[:, 1])
    assert np.all(d.axes[:, 1] >= d.axes[:, 2])
    assert "flattening" in d.drawn
    eros = draws(Asteroid.from_catalogue("Eros"), 500, 0)
    assert eros.axes[:, 0].std() / eros.axes[:, 0].mean() < 0.02
    assert not eros.drawn


def test_apophis_samples_tumble_with_its_periods_about_its_pole():
    d = draws(APOPHIS, 20, 3)
    attitudes = Attitudes.at(APOPHIS, d, 3, "earth", "x")
    ratio = d.axes / d.axes[:, :1]
    assert ratio == pytest.approx(np.tile(ratio[0], (20, 1)))
    for i in range(20):
        momentum = attitudes.matrix(i) @ (d.omega[i] * (np.sum(d.axes[i] ** 2) - d.axes[i] ** 2))
        assert momentum / np.linalg.norm(momentum) == pytest.approx(APOPHIS.pole)
    assert np.ptp(d.omega[:, 0]) > 0


def test_unknown_pole_is_isotropic_and_turns_with_the_body():
    d = draws(ANTEROS, 3000, 3)
    attitudes = Attitudes.at(ANTEROS, d, 3, "earth", "x")
    poles = attitudes.poles
    assert poles.mean(axis=0) == pytest.approx(0, abs=0.04)
    assert attitudes.matrix(5)[:, 2] == pytest.approx(poles[5])


def test_body_from_absolute_magnitude_alone(tmp_path):
    path = tmp_path / "h.csv"
    path.write_text("name,H_mag\nSpeck,22\nNothing,\n")
    speck, nothing = catalogue(path)
    d = draws(speck, 2000, 0)
    # D = 1329 km / sqrt(0.14) 10^(-H/5) = 141 m
    assert np.median(2 * np.cbrt(np.prod(d.axes, axis=1))) == pytest.approx(141, rel=0.05)
    assert {"diameter (from H and albedo)", "density", "spin period", "elongation"} <= set(d.drawn)
    assert np.median(d.period) / 3600 == pytest.approx(np.median(periods_like(22.0)), rel=0.15)
    with pytest.raises(InvalidInput, match="--H"):
        draws(nothing, 1, 0)


def test_what_the_catalogue_lacks_comes_from_class_lightcurve_and_size(tmp_path):
    path = tmp_path / "h.csv"
    path.write_text("name,H_mag,taxonomic_class,amplitude_mag\nStony,18,Sq,1.0\nDark,18,Cb,\nBare,27,,\n")
    stony, dark, bare = (draws(a, 3000, 0) for a in catalogue(path))
    assert stony.rho.mean() == pytest.approx(2300, rel=0.02)
    assert dark.rho.std() == pytest.approx(300, rel=0.05)
    assert bare.rho.mean() == pytest.approx(2080, rel=0.02)  # 2000 +- 700 cut at 800 and 4000
    assert "density (from the class)" in stony.drawn
    ratio = stony.axes[:, 0] / stony.axes[:, 1]
    assert np.median(np.log10(ratio)) == pytest.approx(0.2, abs=0.01)
    # small bodies turn fast: the LCDB's median at H = 27 is minutes, at 18 hours
    assert np.median(bare.period) < 0.2 * np.median(dark.period)
    given = draws(catalogue(path)[0], 5, 0, Population.from_mapping({"density_kg_m3": 1500}))
    assert np.all(given.rho == 1500)


def test_assumed_values_can_be_replaced():
    p = Population.from_mapping({"density_kg_m3": 1234.0, "replace_assumed": True})
    assert np.all(draws(ANTEROS, 5, 0, p).rho == 1234.0)
    assert not np.any(draws(ANTEROS, 5, 0).rho == 1234.0)
    assert draws(Asteroid.from_catalogue("Bennu"), 50, 0, p).rho.mean() == pytest.approx(1194, rel=0.01)


@pytest.mark.parametrize("asteroid", [APOPHIS, ANTEROS])
def test_samples_drawn_in_parts_are_those_of_one_draw(asteroid):
    draw = draws(asteroid, 50, 7)
    every = Attitudes.at(asteroid, draw, 7, "earth", "x")
    samples = Samples(asteroid, 50, 7, None, ("earth", "x"))
    for first, last in ((0, 3), (3, 4), (17, 50)):
        part = samples.part(first, last)
        assert part.count == last - first
        for name in draw._fields:
            if name != "drawn":
                np.testing.assert_array_equal(getattr(part.draws, name), getattr(draw, name)[first:last])
        some = np.arange(last - first)
        np.testing.assert_array_equal(part.matrices(some), every.matrices(first + some))
