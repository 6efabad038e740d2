"""Orbits that deviate from an orbit by given amounts: its clones, sigma points and neighbours."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.time import Time

from flybystab.orbit.ephemeris import Ephemeris
from flybystab.orbit.epochs import seconds
from flybystab.orbit.forces import NonGravitational
from flybystab.typing import Array

if TYPE_CHECKING:
    from flybystab.orbit.orbit import Orbit


def deviated(
    orbit: Orbit,
    epoch: Time,
    states: Array,
    parameters: Array,
    label: str,
    ephemeris: str | Ephemeris | None,
    first: int = 0,
) -> tuple[Orbit, ...]:
    """Orbits that deviate from an orbit propagated to `epoch`.

    Parameters
    ----------
    states, parameters : ndarray, shapes (m, 6) and (m, 5)
        Deviations of the state (m, m/s) and of A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg).
    label : str
        Their names are this and a number, from `first` on.
    """
    position, velocity, centre = orbit.position, orbit.velocity, orbit.centre
    if abs(seconds(epoch, orbit.epoch)) > 1e-3:
        centre = "sun"
        position, velocity = orbit.at(epoch, centre, ephemeris)
    else:
        epoch = orbit.epoch
    r, v, old = position.to_value(u.m), velocity.to_value(u.m / u.s), orbit.nongrav
    mean = np.array([*old.a, old.delay, old.area_to_mass])
    return tuple(
        replace(
            orbit,
            epoch=epoch,
            position=(r + ds[:3]) * u.m,
            velocity=(v + ds[3:]) * u.m / u.s,
            centre=centre,
            nongrav=_changed(old, mean + da),
            name=f"{orbit.name} {label} {k}".strip(),
            covariance=None,
        )
        for k, (ds, da) in enumerate(zip(states, parameters, strict=True), first)
    )


def _changed(law: NonGravitational, values: Array) -> NonGravitational:
    """The law with other A1, A2, A3 (m/s2), DT (s), AMRAT (m2/kg)."""
    a1, a2, a3, delay, area = values.tolist()
    return NonGravitational((a1, a2, a3), law.law, delay, area)
