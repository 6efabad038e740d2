"""Body and encounter in one line: the title of figures whose results hold neither."""

from __future__ import annotations

import astropy.units as u
import numpy as np

from flybystab.body.body import Body
from flybystab.encounter.encounter import Encounter


def subject_of(body: object, encounter: Encounter, *, varied: str = "") -> str:
    """Planet, encounter and body, such as "Earth, periapsis 3 radii, v_inf 5 km/s; 2800 x 1700 x 1500 m, ...".

    Parameters
    ----------
    body : Body or Asteroid
        An asteroid by its label, a body by its diameters, density, spin period and friction angle.
    encounter : Encounter
    varied : str
        Quantity that is varied and therefore left out: "periapsis", "density" or "friction_angle".
    """
    return f"{_encounter_text(encounter, varied)}; {_body_text(body, varied)}"


def _encounter_text(encounter: Encounter, varied: str) -> str:
    parts = [encounter.planet.name.capitalize()]
    if encounter.time is not None:
        return ", ".join(
            [*parts, encounter.time.tdb.iso[:10], f"{encounter.distance.to_value(u.km):,.0f} km"]
        )
    if varied != "periapsis":
        radii = encounter.distance.to_value(u.m) / encounter.planet.radius
        parts.append(f"periapsis {radii:.4g} radii")
    return ", ".join([*parts, f"v_inf {encounter.v_inf.to_value(u.km / u.s):.4g} km/s"])


def _body_text(body: object, varied: str) -> str:
    if not isinstance(body, Body):
        return str(getattr(body, "label", ""))
    parts = [" x ".join(f"{2.0 * a:.4g}" for a in body.axes) + " m"]
    if varied != "density":
        parts.append(f"{body.rho:.4g} kg/m3")
    rate = float(np.linalg.norm(body.omega))
    parts.append(f"{2.0 * np.pi / rate / 3600.0:.4g} h" if rate > 0.0 else "no spin")
    if varied != "friction_angle":
        parts.append(f"{body.material.friction_angle.to_value(u.deg):.4g} deg")
    return ", ".join(parts)
