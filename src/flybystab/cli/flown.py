"""One asteroid through one encounter: what ``flyby`` and ``report`` have in common."""

from __future__ import annotations

import argparse
from typing import Any

from flybystab.cli.common import (
    SURFACES,
    asteroid_of,
    catalogue_argument,
    material_arguments,
    tdb,
)

#: Span searched for the closest encounter when no date is given: inside every supported ephemeris.
SPAN = ("2000-01-01", "2050-01-01")


def passage_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the asteroid, its encounter, its material, and the sample of attitudes."""
    sub.add_argument(
        "name", help="number, name or designation in the embedded catalogue, or in that of --catalogue"
    )
    catalogue_argument(sub)
    sub.add_argument(
        "--date", help=f"near the encounter, TDB; the closest one of {SPAN[0]} to {SPAN[1]} if left out"
    )
    sub.add_argument("--planet", default="earth", help="planet encountered (earth)")
    material_arguments(sub)
    sub.add_argument("--attitudes", type=int, default=64, metavar="N", help="attitudes to sample (64)")
    sub.add_argument("--seed", type=int, default=0, help="seed of the samples (0)")


def attitude_words(asteroid: Any) -> str:
    """At which attitude the first result is: the sample is there because it cannot be known."""
    if asteroid.pole is None:
        return "one of many: the pole is not known; spin axis along the orbital angular momentum"
    return "one of many: the catalogued pole, an arbitrary turn about it"


def flown(options: argparse.Namespace) -> tuple[Any, Any, Any]:
    """Asteroid, result and sample of attitudes of its encounter at the date, or of its closest one."""
    from flybystab.encounter.attitude import periapsis_axes
    from flybystab.encounter.encounter import Encounter
    from flybystab.errors import NoEncounter
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.spin_sample import spin_sample
    from flybystab.orbit.search.encounter_finder import find_encounters

    asteroid = asteroid_of(options)
    if options.date is None:
        table = find_encounters(
            asteroid, tdb(SPAN[0], "start"), tdb(SPAN[1], "stop"), planets=[options.planet]
        )
        if len(table) == 0:
            raise NoEncounter(
                f"{asteroid.label} has no encounter with {options.planet} within 0.05 au from {SPAN[0]} to "
                f"{SPAN[1]}; give a date with --date"
            )
        date = table["time"][int(table["distance"].argmin())]
    else:
        date = tdb(options.date, "--date")
    encounter = Encounter.from_orbit(asteroid.orbit, options.planet, date)
    attitude = None
    if asteroid.pole is not None:
        import astropy.units as u

        attitude = periapsis_axes(encounter) @ asteroid.attitude(0 * u.deg)
    result = flyby(asteroid.body, encounter, attitude, surfaces=SURFACES)
    sample = spin_sample(asteroid, encounter, n=options.attitudes, seed=options.seed)
    return asteroid, result, sample
