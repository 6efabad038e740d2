"""Completion of orbits from files with the physical properties in the embedded tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flybystab.catalogues.asteroid import Asteroid


def with_physical_data(asteroids: Sequence[Asteroid]) -> tuple[Asteroid, ...]:
    """Asteroids with empty physical columns filled from the embedded tables.

    Values come from the embedded catalogue or, for asteroids that it does not contain, from the LCDB (spin period and
    amplitude).
    """
    from flybystab.catalogues.asteroid import identity
    from flybystab.catalogues.catalogue import catalogue, key_of
    from flybystab.catalogues.lightcurves import lightcurves

    known = {key_of(identity(a)): a for a in catalogue()}
    periods = {key_of(k): row for k, row in lightcurves().items()}

    def completed(a: Asteroid) -> Asteroid:
        key = key_of(identity(a))
        if key in known:
            return a.completed(known[key])
        if key not in periods:
            return a
        found, row = periods[key], dict(a.row)
        if not row.get("spin_period_h"):
            row["spin_period_h"] = found["spin_period_h"]
            row["spin_source"] = f"LCDB 2021 (U = {found['quality']})"
        row["spin_state"] = row.get("spin_state") or ("tumbling" if found["tumbles"] else "")
        row["amplitude_mag"] = row.get("amplitude_mag") or found["amplitude_mag"]
        return replace(a, row=row)

    return tuple(completed(a) for a in asteroids)


def foreign(asteroid: Asteroid) -> bool:
    """Whether an orbit comes from a file in a foreign format, so that its body is completed from the embedded tables.

    The source of such an orbit ends with the name of the file (:func:`flybystab.catalogues.catalogue.catalogue`).
    """
    return asteroid.row.get("orbit_source", "").endswith(f"({Path(asteroid.file).name})")
