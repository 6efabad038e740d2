"""Probability of survival for an uncertain point on the target plane.

A rubble pile approaches the Earth at 6 km/s. Its uncertainty region on the target plane is an elongated ellipse, as
after a few months of observations. The fraction of sampled points at which it survives is given with its sampling
error. Writes out/target_plane.png.
"""

from pathlib import Path

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.constants import GM_EARTH
from flybystab.orbit.planets import PLANETS
from flybystab.plots.outcome_map import verdict_points
from flybystab.screening.sample_verdicts import wilson

SPEED, N = 6.0e3, 300
pile = fs.Body(semi_axes=[140, 85, 75] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)
rng = np.random.default_rng(1)
centre, sigma, tilt = np.array([22e6, 5e6]), np.array([6e6, 0.5e6]), np.deg2rad(20)
turn = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]])
points = centre + (rng.standard_normal((N, 2)) * sigma) @ turn.T

encounters, attitudes = [], []
for b in points:
    size = np.hypot(*b)
    q = GM_EARTH / SPEED**2 * (np.sqrt(1 + (size * SPEED**2 / GM_EARTH) ** 2) - 1)
    encounters.append(fs.Encounter.hyperbolic("earth", q * u.m, SPEED * u.m / u.s))
    # the spin axis is fixed in space; the plane of the orbit rotates with B
    angle, phase = np.arctan2(b[1], b[0]), rng.uniform(0, np.pi)
    about_x = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
    about_z = np.array([[np.cos(phase), -np.sin(phase), 0], [np.sin(phase), np.cos(phase), 0], [0, 0, 1]])
    attitudes.append(about_x @ about_z)
table = fs.flyby_many([pile] * N, encounters, attitudes, tolerance=1e-6)
verdict = table.verdict
survives = int(np.count_nonzero((verdict == "INTACT") | (verdict == "RESHAPED")))
hits = int(np.count_nonzero(verdict == "IMPACT"))
low, high = wilson(survives, N)
probability = survives / N
print(
    f"survives with probability {probability:.3f} (95 % interval {low:.3f} to {high:.3f}); {hits} of {N} hit the Earth"
)

figure = Figure(figsize=(6.4, 4.2), layout="constrained")
d = PLANETS["earth"].impact_distance
disc = d * np.sqrt(1 + 2 * GM_EARTH / (d * SPEED**2))
axes = verdict_points(figure.subplots(), points * u.m, verdict, disc * u.m)
axes.set(aspect="equal", title="Earth, 300 clones: verdicts over the target plane")
Path("out").mkdir(exist_ok=True)
figure.savefig("out/target_plane.png", dpi=150)
inside = int(np.count_nonzero(np.hypot(*points.T) < disc))
