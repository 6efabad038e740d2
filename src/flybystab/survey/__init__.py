"""Many asteroids: the catalogue, screening and its tables."""
