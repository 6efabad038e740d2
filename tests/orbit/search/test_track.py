"""The search within an integration does not change the integration."""

import astropy.units as u
import numpy as np
from astropy.time import Time

import flybystab as fs
from flybystab.core.numerics.jit import borrowed, kernel
from flybystab.orbit.forces import FORCES
from flybystab.orbit.search.steps import empty_room


@kernel
def marked(room, spare):
    room, spare = borrowed(room), borrowed(spare)
    more = np.zeros((18, 6))
    room.k[:] = 1.0
    spare.k[:] = 2.0
    more[:] = 3.0
    room.places.fast[:] = 4.0
    spare.places.fast[:] = 5.0
    return room.k[0, 0], spare.k[0, 0], more[0, 0], room.places.fast[0], spare.places.fast[0]


def test_borrowed_rooms_are_apart():
    assert marked(empty_room(), empty_room()) == (1.0, 2.0, 3.0, 4.0, 5.0)


def test_refining_an_approach_does_not_move_the_asteroid():
    """The steps do not depend on whether other approaches are refined: identical to the last bit."""
    names = ("Apophis", "Eros", "Toutatis", "Anteros", "Phaethon", "Ganymed")
    orbits = [fs.Asteroid.from_catalogue(name).orbit for name in names]
    span = Time("2010-01-01", scale="tdb"), Time("2049-01-01", scale="tdb")
    few = fs.find_encounters(orbits, *span, within=0.1 * u.au, forces=FORCES)
    many = fs.find_encounters(
        orbits,
        *span,
        ("earth", "venus", "mars", "mercury", "moon"),
        within=0.5 * u.au,
        forces=FORCES,
    )
    assert len(many) > 5 * len(few)
    near = many[(many["planet"] == "earth") & (many["distance"] < 0.1 * u.au)]
    assert len(few) == len(near) > 5
    for column in ("time", "distance", "v_inf", "b_t"):
        assert np.all(few[column] == near[column]), column
