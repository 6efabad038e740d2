"""Published stability numbers of asteroids that the homogeneous ellipsoid can check.

Each test names its source and the tolerance that the model meets; a volume average cannot reproduce limits of local
failure at the surface, which publications often quote.
"""

import astropy.units as u
import numpy as np
import pytest

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium, spin_limits
from flybystab.body.surface_slope import surface_slopes
from flybystab.constants import G


def spinning(axes, density, period, friction=35.0, surface="drucker-prager"):
    return Body(
        np.array(axes) * u.m,
        density * u.kg / u.m**3,
        spin_period=period * u.h,
        material=Material(friction_angle=friction * u.deg, yield_surface=surface),
    )


def test_spin_limit_of_a_strengthless_sphere():
    """2.33 h at 2 g/cm3, P = sqrt(3 pi/(G rho)) (Harris 1996): the equator is weightless. To 0.2 %.

    The volume average fails later, at w2 = (8/3) sin/(1 + sin) < 4/3 for any friction: the same period at 90 deg.
    """
    period = np.sqrt(3 * np.pi / (G * 2000.0)) / 3600.0
    assert period == pytest.approx(2.33, rel=2e-3)
    for factor, lifted in ((0.999, True), (1.001, False)):
        slope = surface_slopes(spinning((500, 500, 500), 2000.0, factor * period)).slope
        assert bool(slope.max() > 90 * u.deg) == lifted
    limit = spin_limits(spinning((500, 500, 500), 2000.0, 10.0, friction=89.9))[1].value
    assert 2 * np.pi / limit / 3600.0 == pytest.approx(period, rel=1e-3)


@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb"])
def test_cohesion_of_1950_da(surface):
    """64 (+12, -20) Pa for internal failure, phi = 40 deg (Rozitis et al. 2014, Nature 512, 174).

    Diameter 1.30 km, 1.7 g/cm3, 2.1216 h, axes 1.46 : 1.39 : 1.07. The model gives 62 Pa (compression cone) and 66 Pa
    (Mohr-Coulomb); the interval is 44 to 76 Pa.
    """
    axes = np.array([1.46, 1.39, 1.07])
    axes *= 650.0 / np.cbrt(axes.prod())
    required = equilibrium(spinning(axes, 1700.0, 2.1216, 40.0, surface)).required_cohesion
    assert 44 * u.Pa < required < 76 * u.Pa


@pytest.mark.parametrize("surface", ["drucker-prager", "mohr-coulomb"])
@pytest.mark.parametrize("ratio", [1.0, 0.8, 0.7])
@pytest.mark.parametrize("density", [1500.0, 2000.0, 2500.0])
def test_cohesion_of_2000_gd65(density, ratio, surface):
    """150 to 450 Pa: diameter 2.3 km, 1.9529 h (Polishook et al. 2016, Icarus 267, 243).

    Prolate shapes, densities and friction angles (30 to 40 deg) as uncertain as they are: all inside the interval.
    """
    axes = np.array([1.0, ratio, ratio])
    axes *= 1150.0 / np.cbrt(axes.prod())
    for friction in (30.0, 35.0, 40.0):
        required = equilibrium(spinning(axes, density, 1.9529, friction, surface)).required_cohesion
        assert 150 * u.Pa < required < 450 * u.Pa


@pytest.mark.parametrize("axes", [(1.0, 1.0, 1.0), (1.0, 0.8, 0.7), (1.0, 0.5, 0.5)])
def test_cohesion_of_2016_ho3(axes):
    """At least 10 to 20 Pa of bulk cohesion by grains; less than 60 m, 28 min, 2 g/cm3.

    The compression cone alone asks for 5 to 9 Pa. A tensile strength of half the cohesion, as bonds between grains
    have, doubles that: 10 to 25 Pa.
    """
    size = np.array(axes)
    size *= 30.0 / np.cbrt(size.prod())
    body = spinning(size, 2000.0, 28.0 / 60.0)
    cone = equilibrium(body).required_cohesion
    assert 4 * u.Pa < cone < 9.5 * u.Pa
    cut = equilibrium(body.with_(material=body.material.with_(tensile_strength=0.5))).required_cohesion
    assert 9.5 * u.Pa < cut < 25 * u.Pa
    assert cut > 2 * cone
