"""Change of spin in an encounter, sampled over the unknown attitude of the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body, Material
from flybystab.catalogues.tumbling import attitude_matrices, isotropic_directions, isotropic_rotations
from flybystab.encounter.attitude import periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.batch import TOLERANCE, body_rows
from flybystab.flybys.flyby_many import flyby_many, follow_rows
from flybystab.flybys.subject import subject_of
from flybystab.progress import Progressing
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import counted, whole


class SpinStates(Protocol):
    """Spin state of a catalogue entry: bodies and attitudes by phase (:class:`flybystab.Asteroid`)."""

    @property
    def pole(self) -> Array | None:
        """Direction of the angular momentum, ICRF; None if unknown."""

    def body_with(self, material: Material | None = None, *, phase: float = 0.0) -> Body:
        """The body at a phase of its rotation."""

    def angular_velocities(self, phase: Array) -> Array:
        """Angular velocities (n, 3) along the body axes, rad/s, at phases (n,) of the rotation."""


@dataclass(frozen=True, eq=False)
class SpinSample(Tabular):
    """Encounters of one body at many attitudes; arrays over the sample.

    Attributes
    ----------
    spin_ratio : ndarray (n,)
        Effective spin rate ``2 E/H`` after over before.
    pole_change : Quantity (n,)
        Angle between the angular momenta before and after.
    max_required_friction_angle : Quantity (n,)
        Largest friction angle mobilised.
    verdict : ndarray of str (n,)
    attitude : ndarray (n, 3, 3)
        Rotations at the start, body axes -> periapsis frame (:func:`flybystab.periapsis_axes`).
    pole_known : bool
        Whether the catalogued pole was used; otherwise poles are isotropic.
    seed : int
    subject : str
        Planet, encounter and body.
    """

    spin_ratio: Array
    pole_change: Quantity
    max_required_friction_angle: Quantity
    verdict: NDArray[np.str_]
    attitude: Array
    pole_known: bool
    seed: int
    subject: str = ""

    def __len__(self) -> int:
        return len(self.spin_ratio)

    def __repr__(self) -> str:
        finite = self.spin_ratio[np.isfinite(self.spin_ratio)]
        pole = "known pole" if self.pole_known else "isotropic poles"
        rate = f"spin rate x {finite.min():.3g} to {finite.max():.3g}" if len(finite) else "no spin before"
        return f"<SpinSample {len(self)} attitudes, {pole}: {counted(self.verdict)}; {rate}>"


def spin_sample(
    asteroid: SpinStates | Body,
    encounter: Encounter,
    n: int = 64,
    seed: int = 0,
    *,
    material: Material | None = None,
    tolerance: float = TOLERANCE,
    workers: int | None = None,
    progress: Progressing = None,
) -> SpinSample:
    """The same encounter at `n` attitudes.

    The pole is the catalogued one where it is known and the encounter is real (frame ICRF), isotropic otherwise.
    The rotation angle about the pole and, for a tumbler, the phase of its rotation are uniform in time. They cannot be
    predicted decades ahead, so that the distribution over the sample is the prediction.

    Parameters
    ----------
    asteroid : Asteroid or Body
    encounter : Encounter
    n, seed : int
        Size of the sample and seed of its random numbers.
    material : Material, optional
        Replaces that of the asteroid.
    tolerance : float
        As in :func:`flybystab.flybys.flyby.flyby`.
    workers : int, optional
        Number of threads, one for each core by default; the result does not depend on it.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Raises
    ------
    InvalidInput
        If `n` is not a positive whole number, or `seed` a negative one.
    """
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "an Encounter")
    if not isinstance(asteroid, Body) and not hasattr(asteroid, "pole"):
        raise InvalidInput("asteroid", asteroid, "an Asteroid or a Body")
    known = not isinstance(asteroid, Body) and asteroid.pole is not None and encounter.frame == "ICRF"
    states = spin_states(asteroid, n, seed, material, use_pole=known)
    attitudes = periapsis_axes(encounter) @ states.rotations
    if states.body.material.cut_off:
        bodies, turns = states.bodies(), list(attitudes)
        table = flyby_many(
            bodies, [encounter] * n, turns, tolerance=tolerance, workers=workers, progress=progress
        )
    else:
        table = follow_rows(
            states.rows(), [encounter], tolerance=tolerance, workers=workers, progress=progress
        )
    return SpinSample(
        spin_ratio=table.spin_ratio,
        pole_change=table.pole_change,
        max_required_friction_angle=table.max_required_friction_angle,
        verdict=table.verdict,
        attitude=attitudes,
        pole_known=known,
        seed=seed,
        subject=subject_of(asteroid, encounter),
    )


class SpinSampleStates(NamedTuple):
    """Spin states of one body.

    Attributes
    ----------
    body : Body
        Shape, density and material of all.
    omega : ndarray (n, 3)
        Angular velocities along the body axes, rad/s.
    rotations : ndarray (n, 3, 3)
        Body axes -> ICRF.
    """

    body: Body
    omega: Array
    rotations: Array

    def rows(self) -> NDArray[np.void]:
        """Records of the bodies in encounters of frame ICRF, all in the first encounter."""
        b = self.body
        n = len(self.omega)
        return body_rows(
            np.tile(b.axes, (n, 1)), np.full(n, b.rho), self.omega, self.rotations,
            np.full(n, b.material.phi), np.full(n, b.material.c_pa), b.material,
        )  # fmt: skip

    def bodies(self) -> list[Body]:
        """The bodies with their spins."""
        if (self.omega == self.body.omega).all():
            return [self.body] * len(self.omega)
        return [self.body.with_(spin=omega * u.rad / u.s) for omega in self.omega]


def spin_states(
    asteroid: SpinStates | Body, n: int, seed: int, material: Material | None = None, *, use_pole: bool = True
) -> SpinSampleStates:
    """Spin states at `n` phases: uniform about the pole, isotropic without one.

    Parameters
    ----------
    asteroid, n, seed, material
        As in :func:`spin_sample`.
    use_pole : bool
        Whether to use the catalogued pole.
    """
    n, seed = whole(n, "n", 1), whole(seed, "seed", 0)
    if not isinstance(asteroid, Body) and not hasattr(asteroid, "body_with"):
        raise InvalidInput("asteroid", asteroid, "a flybystab.Asteroid or a flybystab.Body")
    turn, phase, height, longitude = np.random.default_rng(seed).random((n, 4)).T
    directions = np.stack([height, longitude], axis=1)
    if isinstance(asteroid, Body):
        body = asteroid if material is None else asteroid.with_(material=material)
        return SpinSampleStates(body, np.tile(body.omega, (n, 1)), isotropic_rotations(turn, directions))
    body = asteroid.body_with(material)
    omega = asteroid.angular_velocities(phase)
    squares = body.axes**2
    momentum = (squares.sum() - squares) * omega
    pole = asteroid.pole if use_pole else None
    poles = isotropic_directions(directions) if pole is None else pole
    return SpinSampleStates(body, omega, attitude_matrices(momentum, poles, 2.0 * np.pi * turn))
