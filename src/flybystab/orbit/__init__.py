"""Heliocentric orbits: ephemerides, planets, forces, and the search for encounters."""
