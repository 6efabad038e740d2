"""Where the asteroid goes: ephemeris, forces, orbit, encounter."""
