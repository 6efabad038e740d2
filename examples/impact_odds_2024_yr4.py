"""Probability that 2024 YR4 hits the Moon on 22 December 2032, by two methods.

The orbit and its covariance are those of ESA NEOCC (2024YR4.ke1 in the folder of this script). The probability is
computed from clones of the orbit, and from the covariance mapped linearly to the target plane of the Moon. The value of
CNEOS (June 2025) is 4.3 %. Writes out/2024_yr4.png.
"""

from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.time import Time
from matplotlib.figure import Figure
from matplotlib.patches import Circle

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.encounter.linear_target_plane import ellipse
from flybystab.orbit.target_plane import capture_radius

(asteroid,) = catalogue(Path(__file__).with_name("2024YR4.ke1"))
day = Time("2032-12-22", scale="tdb")
moon = fs.encounter_distribution(asteroid, "moon", day, n=400, seed=1, search=5 * u.d)
earth = fs.encounter_distribution(asteroid, "earth", day, n=20, seed=1, search=5 * u.d)

clones, linear = moon.impact_probability, moon.linear.impact_probability
low, high = moon.impact_interval()
major, minor, angle = ellipse(moon.linear.covariance)
print(f"Moon: {clones:.3f} of the clones (95 % interval {low:.3f} to {high:.3f}), linear map {linear:.4f}")
print(f"1-sigma ellipse on the target plane: {major:.0f} by {minor:.1f}, {angle:.1f} from T to R")
nearest = earth.distance.min()
print(f"Earth: {earth.linear.impact_probability:.2g}; smallest distance of the clones {nearest:.0f}")

figure = Figure(figsize=(6.4, 3.2), layout="constrained")
axes = figure.subplots()
x, y = moon.b.to_value(1000 * u.km).T
axes.plot(x[~moon.impact], y[~moon.impact], "o", ms=3, mfc="none", mec="0.4", label="clones that miss")
axes.plot(x[moon.impact], y[moon.impact], "o", ms=3, color="black", label="clones that hit")
radius = capture_radius(moon.planet.gm, moon.planet.radius, moon.nominal["v_inf"].to_value(u.m / u.s)) / 1e6
axes.add_patch(Circle((0, 0), radius, fill=False))
turn = np.deg2rad(angle.value)
reach = 3 * major.to_value(1000 * u.km) * np.array([-1, 1])
middle = moon.linear.centre.to_value(1000 * u.km)
axes.plot(middle[0] + reach * np.cos(turn), middle[1] + reach * np.sin(turn), lw=0.8, label="3 sigma, linear")
axes.set(aspect="equal", title="2024 YR4 at the Moon, 22 December 2032")
axes.set(xlabel="B.T (1000 km)", ylabel="B.R (1000 km)", xlim=(-20, 20), ylim=(-8, 8))
axes.text(0.0, -0.9, "Moon", ha="center", va="center", fontsize=7)
axes.legend(frameon=False, fontsize=8, loc="lower left")
Path("out").mkdir(exist_ok=True)
figure.savefig("out/2024_yr4.png", dpi=150)
