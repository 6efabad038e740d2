"""The path of an encounter in skyfield is that of its orbit."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from reference import need_ephemeris

import flybystab as fs
from flybystab.encounter.vector_function import EncounterVector
from flybystab.errors import InvalidInput
from flybystab.orbit.observation import skyfield_times
from flybystab.orbit.vector_function import ephemeris_file


def test_encounter_and_orbit_are_seen_in_the_same_place():
    need_ephemeris("de440")
    orbit = fs.Asteroid.from_catalogue("Apophis").orbit
    encounter = fs.Encounter.from_orbit(orbit, "earth", Time("2029-04-13", scale="tdb"), ephemeris="de440")
    file = ephemeris_file("de440")
    t = skyfield_times(encounter.time + np.linspace(-6.0, 3.0, 7) * u.h)
    near = file["earth"] + EncounterVector(encounter)
    far = file["sun"] + orbit.to_skyfield(ephemeris="de440")
    assert np.abs(near.at(t).xyz.km - far.at(t).xyz.km).max() < 0.2
    here = file["earth"].at(t)
    assert here.observe(near).separation_from(here.observe(far)).arcseconds().max() < 1.0
    outside = near.at(skyfield_times(encounter.time + 40 * u.d)).xyz.km
    assert np.isnan(outside).all()


def test_a_scripted_encounter_has_no_date():
    with pytest.raises(InvalidInput, match="with a date"):
        EncounterVector(fs.Encounter.hyperbolic("earth", 2e7 * u.m, 5 * u.km / u.s))
