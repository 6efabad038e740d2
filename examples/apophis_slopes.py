"""Change of the surface slopes of Apophis by the encounter of 13 April 2029.

Published results for shape models with relief: slopes change by up to 4 deg for a bulk density of 1.29 g/cm3 and 2 deg
for a higher one (2.2 here), and about 1 % of the area is resurfaced. The body here is a smooth ellipsoid in the
observed tumbling state, at 64 phases; its slopes stay below the angle of repose. On a surface with relief, 1 to 2 % of
the area per degree of slope is near the angle of repose, and the area fraction that exceeds it is this density times
the mean increase of the slopes. On a sphere without spin the largest change is (3/2) GM/d^3 / (4/3 pi G rho).
"""

import astropy.units as u
import numpy as np
from astropy.time import Time

import flybystab as fs
from flybystab.constants import G

apophis = fs.Asteroid.from_catalogue("Apophis")
encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
frame = fs.periapsis_axes(encounter)
rng = np.random.default_rng(0)
turns, phases = rng.random(64) * 2 * np.pi, rng.random(64)

largest = {}
for density in (1.29, 2.2):
    changes, steepest, rises = [], [], []
    for turn, phase in zip(turns, phases, strict=True):
        body = apophis.body_with(phase=float(phase)).with_(density=density * u.g / u.cm**3)
        attitude = frame @ apophis.attitude(turn * u.rad, phase=float(phase))
        change = fs.surface_change(body, encounter, attitude, count=1000)
        changes.append(change.largest_change.to_value(u.deg))
        steepest.append(change.greatest.max().to_value(u.deg))
        rise = np.average((change.greatest - change.before).to_value(u.deg), weights=change.area.value)
        rises.append(float(rise))
    largest[density] = np.array(changes)
    tide = 1.5 * encounter.planet.gm / encounter.radius(0 * u.s).value ** 3
    sphere = float(np.rad2deg(tide / (4 / 3 * np.pi * G * density * 1e3)))
    print(
        f"{density} g/cm3: largest change {min(changes):.2f} to {max(changes):.2f} deg "
        f"(median {np.median(changes):.2f}, sphere {sphere:.2f}); "
        f"steepest slope {max(steepest):.1f} deg; mean increase {np.median(rises):.2f} deg"
    )
