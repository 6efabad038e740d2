"""Constraints on the density and friction angle of Anteros from its spin.

Anteros is nearly spherical and rotates in 2.8695 h. A cohesionless sphere is in equilibrium if
omega^2 <= (8/3) sin phi/(1 + sin phi) pi G rho; the catalogued shape changes this limit slightly. The density has not
been measured, so that the lower bound from this condition is its only constraint.
"""

import astropy.units as u
import numpy as np

import flybystab as fs
from flybystab.body.bounds import density_intervals
from flybystab.constants import G

anteros = fs.Asteroid.from_catalogue("Anteros")
period = anteros.quantity("spin_period_h")
omega = 2 * np.pi / period.to_value(u.s)
print(f"{anteros.label}: period {period:.4f}, not measured: {', '.join(anteros.assumptions) or 'nothing'}")
print("friction (deg)  least density (kg/m3): sphere, catalogued shape; cohesion at 1500 kg/m3 (Pa)")
worst = 0.0
for phi in (25, 30, 35, 40, 45):
    material = fs.Material(friction_angle=phi * u.deg)
    sine = np.sin(np.deg2rad(phi))
    closed = omega**2 / (np.pi * G * 8 / 3 * sine / (1 + sine))
    size = anteros.body.mean_radius
    ball = fs.Body(
        semi_axes=[1, 1, 1] * size, density=1500 * u.kg / u.m**3, spin_period=period, material=material
    )
    sphere = density_intervals(ball)[0, 0].to_value(u.kg / u.m**3)
    worst = max(worst, abs(sphere / closed - 1))
    shaped = density_intervals(anteros.body_with(material))[0, 0].to_value(u.kg / u.m**3)
    light = anteros.body_with(material).with_(density=1500 * u.kg / u.m**3)
    cohesion = fs.equilibrium(light).required_cohesion.to_value(u.Pa)
    print(f"{phi:14d}  {sphere:26.0f}  {shaped:15.0f}  {cohesion:29.0f}")
print(f"largest relative difference from the closed form: {worst:.1e}")
