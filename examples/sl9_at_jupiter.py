"""How dense may a strengthless comet be that Jupiter draws out as it did Shoemaker-Levy 9?

The comet passed at 1.31 Jupiter radii in July 1992 on an orbit that was nearly a parabola. A sphere of grains that
does not spin is sent along it. The density below which it is drawn out past 6:1 bounds that of the comet from above.
Published simulations of the break-up speak of a few hundred kg/m3 (Asphaug & Benz 1996 and later work; quoted from
memory, not from the papers). The size cancels: without cohesion only the density counts.
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
