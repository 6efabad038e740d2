"""One encounter of an asteroid with a planet: its path, its tide and its uncertainty."""
