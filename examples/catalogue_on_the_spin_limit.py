"""Asteroids of the catalogue compared with the spin limits of cohesionless bodies.

For each asteroid: spin rate in units of sqrt(pi G rho), and the friction angle required by shape and spin far from any
planet. Writes out/spin_limit.png.
"""

from pathlib import Path

import astropy.units as u
import numpy as np
from matplotlib.figure import Figure

import flybystab as fs
from flybystab.body.equilibrium import spin_limits

rate, flat, need = [], [], []
for asteroid in fs.catalogue():
    body = asteroid.body
    rate.append(np.linalg.norm(body.omega) * body.dynamical_time)
    flat.append(body.axes[2] / body.axes[0])
    need.append(fs.equilibrium(body).required_friction_angle.to_value(u.deg))
rate, flat, need = map(np.array, (rate, flat, need))
holds = need <= 35.0
print(
    f"{len(need)} bodies: {holds.sum()} are in equilibrium at 35 deg without cohesion, {(~holds).sum()} are not,"
)
print(f"{np.isinf(need).sum()} of these at no friction angle (mean tension)")

figure = Figure(figsize=(6.4, 4.4), layout="constrained")
axes = figure.subplots()
ratio = np.linspace(0.2, 1.0, 41)
for phi, style in ((20, ":"), (35, "--"), (50, "-")):
    edges = []
    for c in ratio:  # prolate bodies, c = b
        prolate = fs.Body(semi_axes=[1.0, c, c] * u.km, density=2000 * u.kg / u.m**3)
        edges.append(spin_limits(prolate, phi * u.deg).to_value(u.rad / u.s) * prolate.dynamical_time)
    low, high = np.transpose(edges)
    axes.plot(ratio, high, "k", ls=style, lw=1, label=f"spin limits for $a_2 = a_3$, {phi}°")
    axes.plot(ratio, np.where(low > 0, low, np.nan), "k", ls=style, lw=1)
axes.plot(flat[holds], rate[holds], "o", ms=3, color="#0072B2", label="in equilibrium at 35°")
axes.plot(flat[~holds], rate[~holds], "^", ms=4, color="#D55E00", label="not in equilibrium at 35°")
axes.set(
    xlabel="axis ratio $a_3/a_1$",
    ylabel=r"spin rate $\omega/\sqrt{\pi G\rho}$",
    yscale="log",
    ylim=(0.02, 20),
)
axes.legend(fontsize=7, frameon=False, loc="lower left")
Path("out").mkdir(exist_ok=True)
figure.savefig("out/spin_limit.png", dpi=150)
count, total = int(holds.sum()), len(need)
