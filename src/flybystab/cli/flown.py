"""Flyby of one asteroid, shared by the commands ``flyby`` and ``report``."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from flybystab.cli.body_options import body_arguments
from flybystab.cli.common import (
    SURFACES,
    asteroid_of,
    catalogue_argument,
    material_arguments,
    tdb,
)
from flybystab.cli.shape_options import shape_arguments

if TYPE_CHECKING:
    from flybystab.catalogues.asteroid import Asteroid
    from flybystab.flybys.result import FlybyResult
    from flybystab.flybys.spin_sample import SpinSample

#: Time span of the search for the closest encounter without --date; covered by all supported ephemerides.
SPAN = ("2000-01-01", "2050-01-01")


def encounter_arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments for asteroid, encounter, material and sampled attitudes."""
    sub.add_argument(
        "name",
        help="number, name or designation in the embedded catalogue or in --catalogue, or a file with one orbit",
    )
    catalogue_argument(sub)
    sub.add_argument(
        "--date",
        help=f"date near the encounter, TDB (default: the closest encounter, {SPAN[0]} to {SPAN[1]})",
    )
    sub.add_argument("--planet", default="earth", help="planet (earth)")
    material_arguments(sub)
    body_arguments(sub)
    shape_arguments(sub)
    sub.add_argument(
        "--attitudes", type=int, default=64, metavar="N", help="number of sampled attitudes (64)"
    )
    sub.add_argument("--seed", type=int, default=0, help="random seed (0)")


def attitude_words(asteroid: Asteroid) -> str:
    """Description of the nominal attitude."""
    if asteroid.pole is None:
        return "nominal: pole unknown, spin axis along the orbital angular momentum"
    return "nominal: catalogued pole, arbitrary rotation phase"


def flown(options: argparse.Namespace) -> tuple[Asteroid, FlybyResult, SpinSample]:
    """Asteroid, flyby at the nominal attitude, and sampled attitudes, for --date or the closest encounter."""
    from flybystab.encounter.attitude import periapsis_axes
    from flybystab.encounter.encounter import Encounter
    from flybystab.errors import NoEncounter
    from flybystab.flybys import precompile
    from flybystab.flybys.flyby import flyby
    from flybystab.flybys.spin_sample import spin_sample
    from flybystab.orbit.search.encounter_finder import find_encounters

    asteroid = asteroid_of(options)
    precompile.start()
    if options.date is None:
        table = find_encounters(
            asteroid, tdb(SPAN[0], "start"), tdb(SPAN[1], "stop"), planets=[options.planet]
        )
        table = table[table["planet"] != "sun"]
        if len(table) == 0:
            raise NoEncounter(
                f"{asteroid.label} has no encounter with {options.planet} within 0.05 au between {SPAN[0]} and "
                f"{SPAN[1]}; choose another one with --date"
            )
        date = table["time"][int(table["distance"].argmin())]
    else:
        date = tdb(options.date, "--date")
    encounter = Encounter.from_orbit(asteroid.orbit, options.planet, date)
    attitude = None
    if asteroid.pole is not None:
        import astropy.units as u

        attitude = periapsis_axes(encounter) @ asteroid.attitude(0 * u.deg)
    precompile.wait()
    result = flyby(
        asteroid.body,
        encounter,
        attitude,
        surfaces=SURFACES,
        grains=getattr(options, "grains", None),
        seeds=getattr(options, "piles", 1),
    )
    sample = spin_sample(asteroid, encounter, n=options.attitudes, seed=options.seed)
    return asteroid, result, sample
