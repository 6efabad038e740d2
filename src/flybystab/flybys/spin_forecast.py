"""Forecast of the rotation of an asteroid after an encounter: periods, mode and pole over its unknown phase."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.arguments import levels as checked_levels
from flybystab.body.body import Body
from flybystab.catalogues.tumbling import ecliptic_direction
from flybystab.encounter.attitude import periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.rigid_course import rigid_course
from flybystab.flybys.shape_spin import RotationState, free_rotation
from flybystab.flybys.spin_sample import SpinStates, spin_states
from flybystab.flybys.subject import subject_of
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import to_si


@dataclass(frozen=True, eq=False)
class SpinForecast(Tabular):
    """Rotation after an encounter at ``n`` rotation phases.

    Attributes
    ----------
    precession_period, rotation_period, effective_period : Quantity, shape (n,)
        Of :class:`flybystab.flybys.shape_spin.RotationState`, h.
    mode : ndarray of str, shape (n,)
        "SAM" or "LAM".
    pole : ndarray, shape (n, 3)
        Direction of the angular momentum in the frame of the encounter.
    pole_change : Quantity, shape (n,)
        Angle from the pole before, deg.
    subject : str
        Planet, encounter and body.
    """

    precession_period: Quantity
    rotation_period: Quantity
    effective_period: Quantity
    mode: NDArray[np.str_]
    pole: Array
    pole_change: Quantity
    subject: str = ""

    def __len__(self) -> int:
        return len(self.mode)

    def __repr__(self) -> str:
        low, mid, high = np.quantile(self.precession_period.value, [0.05, 0.5, 0.95])
        short = np.mean(self.mode == "SAM")
        return f"<SpinForecast {len(self)} phases: precession {mid:.1f} h ({low:.1f} to {high:.1f}), SAM {short:.0%}>"

    @property
    def ecliptic(self) -> tuple[Quantity, Quantity]:
        """Ecliptic longitude and latitude (J2000) of the poles, deg; the frame of the encounter must be ICRF."""
        axes = np.stack([ecliptic_direction(0.0, 0.0), ecliptic_direction(0.5 * np.pi, 0.0)])
        x, y = axes @ self.pole.T
        z = np.cross(*axes) @ self.pole.T
        longitude = np.rad2deg(np.arctan2(y, x)) % 360.0
        return longitude * u.deg, np.rad2deg(np.arcsin(np.clip(z, -1.0, 1.0))) * u.deg

    @check_arguments
    def quantiles(self, name: str, levels: tuple[float, ...] = (0.05, 0.5, 0.95)) -> Quantity:
        """Quantiles of a quantity over the phases."""
        values = getattr(self, name, None)
        if not isinstance(values, Quantity):
            raise InvalidInput("name", name, "the name of a quantity of this result")
        return (
            np.quantile(values.value, checked_levels(levels, "levels"), method="inverted_cdf") * values.unit
        )


@check_arguments
def spin_forecast(
    asteroid: SpinStates | Body,
    encounter: Encounter,
    n: int = 64,
    seed: int = 0,
    *,
    turned: Quantity = 0.0 * u.deg,
    progress: Progressing = None,
) -> SpinForecast:
    """Rotation of an asteroid after an encounter, at `n` phases of its rotation.

    Parameters
    ----------
    asteroid : Asteroid or Body
        Its pole is the catalogued one where known; phases are uniform in time (:func:`flybystab.spin_sample`).
    encounter : Encounter
        Without an impact.
    n, seed : int
    turned : Quantity
        Angle by which the pole is moved towards the pole of the ecliptic, for its uncertainty.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    SpinForecast

    Notes
    -----
    The body is rigid: the forecast depends on the ratios of its moments of inertia, on spin state, pole, phase and on
    the tide, but not on density, size or strength.
    """
    if not isinstance(asteroid, Body) and not hasattr(asteroid, "pole"):
        raise InvalidInput("asteroid", asteroid, "an Asteroid or a Body")
    if not isinstance(encounter, Encounter) or encounter.impact:
        raise InvalidInput("encounter", encounter, "an Encounter without an impact")
    known = not isinstance(asteroid, Body) and asteroid.pole is not None and encounter.frame == "ICRF"
    states = spin_states(asteroid, n, seed, use_pole=known)
    bodies, rotations = states.bodies(), states.rotations
    frame = periapsis_axes(encounter)
    tilt = _tilt(rotations[0] @ (_moments(bodies[0]) * bodies[0].omega), to_si(turned, u.rad, "turned"))
    after: list[RotationState] = []
    change = []
    with progress_bar(progress, n, "phases", "spin forecast") as tick:
        for body, rotation in zip(bodies, rotations, strict=True):
            moments, start = _moments(body), tilt @ rotation
            course = rigid_course(body, encounter, frame @ start)
            state = free_rotation(moments, course.spin.value[-1], course.attitude[-1])
            before = start @ (moments * body.omega)
            now = state.momentum.value
            change.append(np.arctan2(np.linalg.norm(np.cross(before, now)), before @ now))
            after.append(state)
            tick(len(after))
    momenta = np.array([s.momentum.value for s in after])
    return SpinForecast(
        Quantity([s.precession_period for s in after]),
        Quantity([s.rotation_period for s in after]),
        Quantity([s.effective_period for s in after]),
        np.array([s.mode for s in after]),
        momenta / np.linalg.norm(momenta, axis=1)[:, None],
        np.rad2deg(change) * u.deg,
        subject_of(asteroid, encounter),
    )


def _moments(body: Body) -> Array:
    squares = body.axes**2
    return np.asarray((squares.sum() - squares) / 5.0)


def _tilt(pole: Array, angle: float) -> Array:
    """Rotation by an angle that moves a pole towards the north pole of the ecliptic."""
    if angle == 0.0:
        return np.eye(3)
    axis = np.cross(pole, ecliptic_direction(0.0, 0.5 * np.pi))
    x, y, z = axis / np.linalg.norm(axis)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)
