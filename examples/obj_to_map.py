"""Map of the slopes of Apophis on 13 April 2029, before, at and after closest approach, from a shape file.

The same in the shell: ``flybystab flyby Apophis --shape examples/relief.obj --map slopes.png``
"""

from pathlib import Path

import astropy.units as u
from astropy.time import Time

import flybystab as fs
from flybystab.plots.shape_map import surface_history_figure

shape = fs.Shape.read(Path(__file__).with_name("relief.obj"), unit=u.km)
asteroid = fs.Asteroid.from_catalogue("Apophis").with_shape(shape)
encounter = fs.Encounter.from_orbit(asteroid.orbit, "earth", Time("2029-04-13", scale="tdb"))
history = fs.surface_history(asteroid.body, encounter, asteroid.attitude(0 * u.deg), shape=shape)
surface_history_figure(history, 30 * u.deg).savefig("slopes.png")
