"""Slopes on an irregular shape during a flyby at the distance of Apophis, with a map.

The shape is generated (an ellipsoid with Gaussian relief). To use a shape from a file:
``shape = fs.Shape.read("apophis.obj", unit=u.km)``.
"""

import sys

import astropy.units as u

import flybystab as fs
from flybystab.plots.shape_map import slope_change_figure

shape = fs.Shape.perturbed([225, 165, 155] * u.m, amplitude=0.06, seed=2)
body = fs.Body.from_shape(shape, density=1.29 * u.g / u.cm**3, spin_period=30.5 * u.h)
encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
change = fs.surface_change(body, encounter, shape=shape)
largest = change.largest_change.to_value(u.deg)
print(
    f"largest change {largest:.2f} deg; {100 * change.share_passing(30 * u.deg):.2f} % of the area passes 30 deg"
)
if len(sys.argv) > 1:
    slope_change_figure(shape, change, 30 * u.deg).savefig(sys.argv[1], dpi=120)
