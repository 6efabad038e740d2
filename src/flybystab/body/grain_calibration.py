"""Contact friction and cohesion of grains for a bulk friction angle and cohesion, from calibrated tables.

The tables are ``data/grains_friction.csv`` (spin-up of spheres, ``python -m flybystab.bench.grains_friction``) and
``data/grains_cohesion.csv`` (pulling and shearing of spheres, ``python -m flybystab.bench.grains_cohesion``).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import astropy.units as u
import numpy as np

from flybystab.errors import InvalidInput

#: Largest bulk cohesion over the central pressure ``2/3 pi G rho^2 R^2``. The time step falls as the root of their sum.
STRONGEST = 1000.0


@dataclass(frozen=True)
class Friction:
    """Contact friction with the friction angle of a pile of such grains."""

    mu_s: float
    beta: float
    angle: float  #: deg


@dataclass(frozen=True)
class CohesionRatio:
    """Bulk cohesion over ``c beta^2``, ``c`` the attraction per area of a contact, for a size of the contact patch."""

    beta: float
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
    """Calibrated cohesion, by the size of the contact patch."""
    rows = _rows("grains_cohesion.csv")
    found = [CohesionRatio(float(r["beta"]), float(r["ratio"]), float(r["scatter"])) for r in rows]
    return tuple(sorted(found, key=lambda c: c.beta))


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


def contact_cohesion(cohesion: float, friction: Friction, pressure: float) -> float:
    """Attraction per area of a contact, Pa, of a pile with a bulk cohesion (Pa).

    Parameters
    ----------
    cohesion : float
        Pa.
    friction : Friction
        Its contact patch carries the attraction.
    pressure : float
        Central pressure of the body, Pa.

    Raises
    ------
    InvalidInput
        A friction angle at which contacts have no patch or one smaller than the calibrated ones, or a cohesion beyond
        :data:`STRONGEST` times the pressure.
    """
    if cohesion == 0.0:
        return 0.0
    table = cohesion_table()
    if not table[0].beta - 1e-9 <= friction.beta <= table[-1].beta + 1e-9:
        angles = [
            f.angle for f in friction_table() if table[0].beta - 1e-9 <= f.beta <= table[-1].beta + 1e-9
        ]
        raise InvalidInput(
            "cohesion",
            f"{cohesion:g} Pa at a friction angle of {friction.angle:.1f} deg",
            f"no cohesion, or a friction angle of {min(angles):.1f} to {max(angles):.1f} deg: at others the contact "
            "patch that carries it is not calibrated",
        )
    if cohesion > STRONGEST * pressure:
        raise InvalidInput(
            "cohesion",
            cohesion * u.Pa,
            f"at most {STRONGEST * pressure:.3g} Pa, {STRONGEST:g} times the central pressure of this body: a stronger "
            "one needs time steps that are too short",
        )
    ratio = np.interp(friction.beta, [c.beta for c in table], [c.ratio for c in table])
    return float(cohesion / (ratio * friction.beta**2))
