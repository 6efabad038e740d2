"""Contact friction and cohesion of grains for a bulk friction angle and cohesion, from calibrated tables.

The tables are ``data/grains_friction.csv`` (spin-up of spheres, ``python -m flybystab.bench.grains_friction``) and
``data/grains_cohesion.csv`` (pulling and shearing of spheres, ``python -m flybystab.bench.grains_cohesion``).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import astropy.units as u
import numpy as np

from flybystab.errors import InvalidInput

#: Largest bulk cohesion over the central pressure ``2/3 pi G rho^2 R^2``. The time step falls as the root of their sum.
STRONGEST = 1000.0
#: Least size of the contact patch of cohesive grains, which carries the attraction; its rolling resistance is
#: negligible.
PATCH = 0.01


@dataclass(frozen=True)
class Friction:
    """Contact friction, and the friction angle of a pile of such grains."""

    mu_s: float
    beta: float
    angle: float  #: deg


@dataclass(frozen=True)
class CohesionRatio:
    """Bulk cohesion over ``c beta^2``, ``c`` the attraction per area of a contact, at a friction angle."""

    angle: float  #: deg
    ratio: float
    scatter: float  #: half the range over piles, and over pulling and shearing


def _rows(name: str) -> list[dict[str, str]]:
    lines = [x for x in files("flybystab.data").joinpath(name).read_text().splitlines() if x]
    return list(csv.DictReader(x for x in lines if not x.startswith("#")))


@cache
def friction_table() -> tuple[Friction, ...]:
    """Calibrated friction, by angle."""
    rows = _rows("grains_friction.csv")
    found = [Friction(float(r["mu_s"]), float(r["beta"]), float(r["friction_angle_deg"])) for r in rows]
    return tuple(sorted(found, key=lambda f: f.angle))


@cache
def cohesion_table() -> tuple[CohesionRatio, ...]:
    """Calibrated cohesion, by the friction angle."""
    rows = _rows("grains_cohesion.csv")
    found = [
        CohesionRatio(float(r["friction_angle_deg"]), float(r["ratio"]), float(r["scatter"])) for r in rows
    ]
    return tuple(sorted(found, key=lambda c: c.angle))


def contact_friction(angle: float) -> Friction:
    """Contact friction of a pile with a friction angle (rad), interpolated in the calibrated table.

    Raises
    ------
    InvalidInput
        The angle is beyond the table.
    """
    table, degrees = friction_table(), float(np.rad2deg(angle))
    angles = [f.angle for f in table]
    if not angles[0] - 1e-9 <= degrees <= angles[-1] + 1e-9:
        raise InvalidInput(
            "friction_angle",
            f"{degrees:g} deg",
            f"an angle for which grains are calibrated: {angles[0]:.1f} to {angles[-1]:.1f} deg",
        )
    mu_s = float(np.interp(degrees, angles, [f.mu_s for f in table]))
    beta = float(np.interp(degrees, angles, [f.beta for f in table]))
    return Friction(mu_s, beta, degrees)


def contact_cohesion(cohesion: float, friction: Friction, pressure: float) -> tuple[float, Friction]:
    """Attraction per area of a contact, Pa, of a pile with a bulk cohesion (Pa), and its contact friction.

    Parameters
    ----------
    cohesion : float
        Pa.
    friction : Friction
        With a patch of at least :data:`PATCH` in the answer, which carries the attraction.
    pressure : float
        Central pressure of the body, Pa.

    Raises
    ------
    InvalidInput
        A cohesion beyond :data:`STRONGEST` times the pressure.
    """
    if cohesion == 0.0:
        return 0.0, friction
    if cohesion > STRONGEST * pressure:
        raise InvalidInput(
            "cohesion",
            cohesion * u.Pa,
            f"at most {STRONGEST * pressure:.3g} Pa, {STRONGEST:g} times the central pressure of this body: a stronger "
            "one needs time steps that are too short",
        )
    table = cohesion_table()
    ratio = np.interp(friction.angle, [c.angle for c in table], [c.ratio for c in table])
    friction = replace(friction, beta=max(friction.beta, PATCH))
    return float(cohesion / (ratio * friction.beta**2)), friction
