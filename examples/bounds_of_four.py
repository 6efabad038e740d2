"""Friction angle, density and cohesion of four asteroids from shape and spin, with error propagation.

The asteroids are Anteros, whose density has not been measured, 1950 DA, for which no friction angle suffices, and
Didymos and 1999 KW4 (Moshup), two fast-rotating primaries of binaries. Values and errors are those of the catalogue;
the errors of the three axes are taken as independent. Each line gives the median and the 1-sigma interval.

The trace of the mean stress changes sign at the density at which centrifugal forces balance gravity,
rho_t = omega^2 (a1^2 + a2^2)/(4 pi G a1 a2 a3 R_F(a1^2, a2^2, a3^2)): below it, a body is in mean tension.
"""

import astropy.units as u
import numpy as np
from scipy.special import elliprf

import flybystab as fs
from flybystab.body.bounds import requirements
from flybystab.constants import G

FRICTION = 35  # deg, where friction is given


def interval(samples, name, digits):
    """Median and 1-sigma interval, and the fraction of the samples for which no value suffices."""
    low, mid, high = (f"{q:.{digits}f}" if np.isfinite(q) else "none" for q in samples.quantiles(name).value)
    none = np.mean(~np.isfinite(getattr(samples, name).value))
    if low == "none":
        return f"none suffices for {none:.0%} of the samples"
    return f"{mid} ({low} to {high})" + (f"; none suffices for {none:.0%} of the samples" if none else "")


found = {}
for name in ("Anteros", "1950 DA", "Didymos", "1999 KW4"):
    asteroid = fs.Asteroid.from_catalogue(name, material=fs.Material(friction_angle=FRICTION * u.deg))
    period, density = asteroid.quantity("spin_period_h"), asteroid.quantity("density_kg_m3")
    samples = requirements(
        asteroid.body,
        semi_axes_sigma=[asteroid.quantity(f"semi_axis_{axis}_sigma_m").value for axis in "abc"] * u.m,
        density_sigma=asteroid.quantity("density_sigma_kg_m3"),
        spin_period_sigma=asteroid.quantity("spin_period_sigma_h"),
    )
    nominal = fs.equilibrium(asteroid.body)
    a1, a2, a3 = asteroid.body.axes
    omega = 2 * np.pi / period.to_value(u.s)
    balance = omega**2 * (a1**2 + a2**2) / (4 * np.pi * G * a1 * a2 * a3 * elliprf(a1**2, a2**2, a3**2))
    found[name] = (nominal, samples, balance, density.value)

    source = asteroid.row["density_source"].split(";")[0]
    print(f"{asteroid.label}: period {period.value} h; {density.value:.0f} kg/m3 ({source})")
    state = "in mean tension: no friction angle suffices" if nominal.in_tension else "in mean compression"
    print(f"    nominal body {state} (transition at {balance:.0f} kg/m3)")
    print(f"    probability of mean tension: {samples.probability_of_tension():.2f}")
    print(f"    friction needed without cohesion (deg): {interval(samples, 'friction_angle', 1)}")
    print(f"    least density at {FRICTION} deg (kg/m3): {interval(samples, 'least_density', 0)}")
    print(f"    cohesion needed at {FRICTION} deg (Pa): {interval(samples, 'cohesion', 1)}")
