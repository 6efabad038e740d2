"""Selection of the asteroids of a screening: by name, from files, or the whole embedded catalogue."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from flybystab.catalogues.asteroid import identity
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.completion import foreign, with_physical_data
from flybystab.errors import InvalidInput


def listed(
    asteroids: str | Path | Asteroid | Sequence[Asteroid | str | int | Path] | None,
) -> tuple[Asteroid, ...]:
    """Asteroids from what `screen` accepts; tables of orbits are completed by the embedded physical data."""
    if asteroids is None:
        return catalogue()
    if isinstance(asteroids, str | Path):
        path = Path(asteroids)
        named = isinstance(asteroids, str) and not path.suffix and not path.exists()
        asteroids = [str(asteroids) if named else path]
    if isinstance(asteroids, Asteroid):
        asteroids = [asteroids]
    if not isinstance(asteroids, Iterable) or isinstance(asteroids, bytes):
        raise InvalidInput("asteroids", asteroids, "asteroids, names, or paths of catalogue files")
    found: list[Asteroid] = []
    for a in asteroids:
        if isinstance(a, Asteroid):
            found.append(a)
        elif isinstance(a, Path):
            rows = catalogue(a)
            found += with_physical_data(rows) if any(map(foreign, rows)) else rows
        else:
            found.append(Asteroid.from_catalogue(a))
    if not found:
        raise InvalidInput(
            "asteroids", ", ".join(map(str, asteroids)) or "none", "at least one row with an asteroid"
        )
    keys = Counter(identity(a) for a in found)
    twice = [k for k, n in keys.items() if n > 1]
    if twice:
        raise InvalidInput(
            "asteroids", ", ".join(twice), "every asteroid once, by number, designation or name"
        )
    return tuple(found)
