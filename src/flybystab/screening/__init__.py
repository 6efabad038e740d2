"""Many asteroids through many encounters: settings, samples, journal, tables, inference."""
