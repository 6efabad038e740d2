"""Upper bound on the density of a strengthless comet elongated by Jupiter like Shoemaker-Levy 9.

The comet passed at 1.31 Jupiter radii in July 1992 on a nearly parabolic orbit. A granular sphere without spin follows
this orbit. The density below which it is elongated beyond 6:1 is an upper bound on that of the comet. Published
simulations of the break-up give a few hundred kg/m3 (Asphaug & Benz 1996 and later work; not checked against the
papers). Without cohesion the result does not depend on size.
"""

import astropy.units as u

import flybystab as fs
from flybystab.orbit.planets import PLANETS

radius = PLANETS["jupiter"].radius * u.m
passage = fs.Encounter.hyperbolic("jupiter", 1.31 * radius, 0 * u.km / u.s, start_distance=12 * radius)


def fate(density, surface="drucker-prager"):
    material = fs.Material(yield_surface=surface)
    comet = fs.Body(semi_axes=[750, 750, 750] * u.m, density=density * u.kg / u.m**3, material=material)
    return fs.flyby(comet, passage, history=False, error=False).verdict


limits = {}
for surface in ("drucker-prager", "mohr-coulomb"):
    low, high = 300.0, 3000.0  # drawn out, and not
    while high - low > 5.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fate(middle, surface) == "BEYOND MODEL" else (low, middle)
    limits[surface] = low
    print(f"{surface}: drawn out past 6:1 below {low:.0f} kg/m3; at twice that: {fate(2 * low, surface)}")
