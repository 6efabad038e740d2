"""Upper bound on the density of a strengthless comet disrupted by Jupiter like Shoemaker-Levy 9.

The comet passed Jupiter at 1.31 radii in July 1992 on a nearly parabolic orbit. A granular sphere without spin is flown
on this orbit; the density below which it is elongated beyond 6:1 is an upper bound on that of the comet. Published
simulations of the break-up give a few hundred kg/m3 (Asphaug & Benz 1996 and later work; not checked against the
papers). Without cohesion the result does not depend on size.
"""

import astropy.units as u

import flybystab as fs
from flybystab.orbit.planets import PLANETS

radius = PLANETS["jupiter"].radius * u.m
encounter = fs.Encounter.hyperbolic("jupiter", 1.31 * radius, 0 * u.km / u.s, start_distance=12 * radius)


def verdict(density, surface="drucker-prager"):
    material = fs.Material(yield_surface=surface)
    comet = fs.Body(semi_axes=[750, 750, 750] * u.m, density=density * u.kg / u.m**3, material=material)
    return fs.flyby(comet, encounter, history=False, error=False).verdict


limits = {}
for surface in ("drucker-prager", "mohr-coulomb"):
    low, high = 300.0, 3000.0  # elongated beyond 6:1, and not
    while high - low > 5.0:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if verdict(middle, surface) == "BEYOND MODEL" else (low, middle)
    limits[surface] = low
    print(
        f"{surface}: elongated beyond 6:1 below {low:.0f} kg/m3; at twice that: {verdict(2 * low, surface)}"
    )
