"""Dependence of the verdict on the yield surface for a 2.8 x 1.7 x 1.5 km pile at several distances from the Earth."""

import astropy.units as u

import flybystab as fs
from flybystab.body.body import YIELD_SURFACES

pile = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h)
verdicts = {}
for q in (1.8, 2.0, 2.2, 2.6, 3.0):
    encounter = fs.Encounter.hyperbolic(
        "earth", periapsis=q * fs.R_earth, v_inf=5 * u.km / u.s, start_distance=10 * fs.R_earth
    )
    result = fs.flyby(pile, encounter, surfaces=YIELD_SURFACES, history=False)
    verdicts[q] = result.verdict_by_surface
    stretch = result.semi_axes[0] / pile.semi_axes[0]
    by_surface = ", ".join(f"{k} {v}" for k, v in result.verdict_by_surface.items())
    print(f"q = {q} R_E  x{stretch:.3f}  robust {result.robust!s:5s}  {by_surface}")
robust = [q for q, v in verdicts.items() if len(set(v.values())) == 1]
print("robust at", robust)
