"""Binary asteroids in encounters: mutual orbit, escape, collision, and the spin of the companion.

Primary and companion are point masses unless a figure is given (:mod:`flybystab.flybys.binary_figures`): an oblate
primary, and an ellipsoid as companion, whose rotation is then followed. The separation ``d`` of point masses obeys

    d'' = -G (m1 + m2) d/|d|^3 + K(t) d,

``K`` the tidal tensor of the encounter (planets, Moon, Sun and J2, as for the body). Terms of the next order are
smaller by ``|d|/R``, ``R`` the distance from the planet: 1e-4 for kilometres at some planetary radii.
"""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray
from scipy.integrate import DOP853

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.constants import G
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotConverged
from flybystab.flybys.binary_figures import Figures, averaged, rotation_matrices, synchronous
from flybystab.flybys.binary_figures import rates as figured
from flybystab.flybys.subject import subject_of
from flybystab.orbit.kepler import states_at_times
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import counted, to_si, whole

BOUND, ESCAPE, COLLISION = "bound", "escape", "collision"
#: Points of a step, as fractions of it, at which the separation is compared with that of contact.
_CHECKS = np.linspace(0.1, 1.0, 10)
_MAX_STEPS = 100_000
#: Relative tolerance of a step.
_TOLERANCE = 1e-10


@dataclass(frozen=True, eq=False)
class BinarySample(Tabular):
    """Mutual orbits of a binary after an encounter; arrays over the sampled phases and orientations.

    Attributes
    ----------
    semi_major_axis : Quantity (n,)
        Negative for hyperbolic orbits, nan after a collision.
    eccentricity : ndarray (n,)
    plane_change : Quantity (n,)
        Angle between the orbital angular momenta before and after.
    closest : Quantity (n,)
        Smallest separation during the encounter.
    fate : ndarray of str (n,)
        ``bound``, ``escape`` or ``collision``.
    spin_ratio : ndarray (n,)
        Effective spin rate of the companion (twice its energy over its angular momentum) after over before; nan for a
        point mass and after a collision.
    wobble : Quantity (n,)
        Angle between the angular momentum of the companion and its axis of greatest inertia afterwards; zero for
        principal rotation, about 90 deg in the long-axis mode; nan as `spin_ratio`.
    obliquity : Quantity (n,)
        Angle between the angular momenta of the companion and of the mutual orbit afterwards; nan as `spin_ratio`.
    tide_at_start : float
        Tide at the start of the encounter over ``G (m1 + m2)/a^3``: the size of the neglected tide before the start.
    seed : int
    subject : str
        Planet, encounter and primary.
    """

    semi_major_axis: Quantity
    eccentricity: Array
    plane_change: Quantity
    closest: Quantity
    fate: NDArray[np.str_]
    spin_ratio: Array
    wobble: Quantity
    obliquity: Quantity
    tide_at_start: float
    seed: int
    subject: str = ""

    def __len__(self) -> int:
        return len(self.fate)

    @check_arguments
    def probability(self, fate: str) -> float:
        """Fraction of the sample with a fate."""
        if fate not in (BOUND, ESCAPE, COLLISION):
            raise InvalidInput("fate", fate, f"one of {BOUND}, {ESCAPE}, {COLLISION}")
        return float(np.mean(self.fate == fate))

    def __repr__(self) -> str:
        return f"<BinarySample {len(self)} phases: {counted(self.fate)}>"


@check_arguments
def binary_flyby(
    primary: Body,
    encounter: Encounter,
    semi_major_axis: Quantity,
    *,
    mass_ratio: float | None = None,
    companion: Body | None = None,
    oblate: bool = False,
    eccentricity: float = 0.0,
    normal: Quantity | Array | None = None,
    samples: int = 64,
    seed: int = 0,
) -> BinarySample:
    """Integrate the mutual orbit of a binary through an encounter, at random phases.

    Parameters
    ----------
    primary : Body
        Its mass, and its mean radius for contact.
    encounter : Encounter
        One whose path clears the planet. For wide binaries choose a large ``start_distance``:
        :attr:`BinarySample.tide_at_start` is the size of the tide neglected before the start.
    semi_major_axis, eccentricity
        Of the mutual orbit before the encounter.
    mass_ratio : float
        Mass of the companion over that of the primary, 0.01 by default; it has the density of the primary. Not together
        with `companion`.
    companion : Body, optional
        An ellipsoid in synchronous rotation: its longest axis points to the primary at the start, and it turns about
        its shortest axis, which is normal to the orbit, with the mean motion. Its own spin is not used.
    oblate : bool
        Whether the figure of the primary acts on the orbit, averaged about its shortest axis, which is normal to the
        orbit at the start.
    normal : array_like (3,), optional
        Direction of the orbital angular momentum in the frame of the encounter; isotropic by default.
    samples, seed : int
        Number of phases (and orientations), and seed.

    Returns
    -------
    BinarySample

    Raises
    ------
    InvalidInput, UnitMismatch, NotConverged
    """
    if not isinstance(primary, Body):
        raise InvalidInput("primary", primary, "a flybystab.Body")
    if not isinstance(encounter, Encounter) or encounter.impact:
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter whose path clears the planet")
    a = to_si(semi_major_axis, u.m, "semi_major_axis", low=0.0, open_low=True)
    ratio, second_radius = _companion(primary, companion, mass_ratio)
    e = to_si(eccentricity, u.dimensionless_unscaled, "eccentricity", low=0.0, high=1.0, open_high=True)
    n = whole(samples, "samples", 1)
    mass = float(primary.mass.to_value(u.kg)) * (1.0 + ratio)
    contact = float(primary.mean_radius.to_value(u.m)) + second_radius
    if a * (1.0 - e) <= contact:
        raise InvalidInput(
            "semi_major_axis", semi_major_axis, f"a mutual orbit clear of contact at {contact:.4g} m"
        )
    rng = np.random.default_rng(whole(seed, "seed", 0))
    frames = _frames(normal, n, rng)
    mean_anomaly = 2.0 * np.pi * rng.random(n)
    # Units of the mutual orbit: length a, time sqrt(a^3/G m).
    unit = np.sqrt(a**3 / (G * mass))
    state = _states(e, mean_anomaly, frames)
    figures = None
    if companion is not None or oblate:
        pole = frames[:, :, 2]
        figures = Figures(
            averaged(primary.axes / a, pole) if oblate else np.zeros((n, 3, 3)),
            np.full(3, second_radius**2 / a**2 / 5.0)
            if companion is None
            else companion.axes**2 / a**2 / 5.0,
            1.0 / (1.0 + ratio),
        )
        state = np.concatenate([state, *synchronous(frames, state, 1.0)], axis=1)
    last, closest, collided = _carried(state, encounter, unit, contact / a, figures)
    tide = float(np.linalg.norm(encounter.tidal_tensor(encounter.t_start)) * unit**2)
    turning = figures if companion is not None else None
    subject = f"{subject_of(primary, encounter)}, mutual orbit {a / 1e3:.4g} km"
    return _sample(state, last, closest, collided, turning, a * u.m, tide, int(seed), subject)


def _sample(
    first: Array,
    last: Array,
    closest: Array,
    collided: NDArray[np.bool_],
    figures: Figures | None,
    length: Quantity,
    tide: float,
    seed: int,
    subject: str,
) -> BinarySample:
    """Orbits and rotations before and after, from states in units of `length` and of the mutual orbit.

    `figures` are those of an ellipsoidal companion, None for a point mass; `tide` is that at the start over
    ``G (m1 + m2)/a^3``.
    """
    x, v = last[:, :3], last[:, 3:6]
    before, after = np.cross(first[:, :3], first[:, 3:6]), np.cross(x, v)
    r = np.linalg.norm(x, axis=1)
    energy = 0.5 * np.sum(v * v, axis=1) - 1.0 / r
    vector = np.cross(v, after) - x / r[:, None]
    cosine = np.sum(before * after, axis=1) / (np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1))
    lost = np.where(collided, np.nan, 1.0)
    spin_ratio, wobble, obliquity = np.full((3, len(r)), np.nan)
    if figures is not None:
        spin_ratio, wobble, obliquity = _rotation(first, last, after, figures) * lost
    return BinarySample(
        semi_major_axis=-0.5 / energy * lost * length,
        eccentricity=np.linalg.norm(vector, axis=1) * lost,
        plane_change=np.rad2deg(np.arccos(np.clip(cosine, -1.0, 1.0))) * lost * u.deg,
        closest=closest * length,
        fate=np.where(collided, COLLISION, np.where(energy < 0.0, BOUND, ESCAPE)),
        spin_ratio=spin_ratio,
        wobble=np.rad2deg(wobble) * u.deg,
        obliquity=np.rad2deg(obliquity) * u.deg,
        tide_at_start=tide,
        seed=seed,
        subject=subject,
    )


def _companion(primary: Body, companion: Body | None, mass_ratio: float | None) -> tuple[float, float]:
    """Mass ratio and mean radius (m) of the companion."""
    radius = float(primary.mean_radius.to_value(u.m))
    if companion is None:
        given = 0.01 if mass_ratio is None else mass_ratio
        ratio = to_si(given, u.dimensionless_unscaled, "mass_ratio", low=0.0, high=1.0)
        return ratio, radius * float(np.cbrt(ratio))
    if not isinstance(companion, Body):
        raise InvalidInput("companion", companion, "a flybystab.Body")
    if mass_ratio is not None:
        raise InvalidInput("mass_ratio", mass_ratio, "none with a companion: it follows from the two bodies")
    ratio = float((companion.mass / primary.mass).to_value(u.one))
    if ratio > 1.0:
        raise InvalidInput("companion", companion, "a body that is not heavier than the primary")
    return ratio, float(companion.mean_radius.to_value(u.m))


def _rotation(first: Array, last: Array, orbital: Array, figures: Figures) -> Array:
    """Ratio of the effective spin rates, wobble and obliquity (rad) of the companions, (3, n)."""
    moments = figures.companion.sum() - figures.companion
    momentum = last[:, 10:] * moments
    size = np.linalg.norm(momentum, axis=1)
    effective = [
        np.sum(y[:, 10:] ** 2 * moments, axis=1) / np.linalg.norm(y[:, 10:] * moments, axis=1)
        for y in (first, last)
    ]
    outside = np.einsum("nij,nj->ni", rotation_matrices(last[:, 6:10]), momentum)
    across = np.linalg.norm(np.cross(outside, orbital), axis=1)
    return np.array(
        [
            effective[1] / effective[0],
            np.arccos(np.clip(np.abs(momentum[:, 2]) / size, 0.0, 1.0)),
            np.arctan2(across, np.sum(outside * orbital, axis=1)),
        ]
    )


def _frames(normal: Quantity | Array | None, n: int, rng: np.random.Generator) -> Array:
    """Axes (towards pericentre, along the motion there, normal) as columns, ``(n, 3, 3)``; pericentre at random."""
    if normal is None:
        z = rng.normal(size=(n, 3))
    else:
        try:
            z = np.tile(np.asarray(normal, dtype=float).reshape(3), (n, 1))
        except (TypeError, ValueError):
            raise InvalidInput("normal", normal, "a direction, three numbers") from None
    size = np.linalg.norm(z, axis=1)
    if not (np.isfinite(size) & (size > 0.0)).all():
        raise InvalidInput("normal", normal, "a direction, not all zero")
    z = z / size[:, None]
    x = rng.normal(size=(n, 3))
    x -= np.sum(x * z, axis=1)[:, None] * z
    x /= np.linalg.norm(x, axis=1)[:, None]
    return np.stack([x, np.cross(z, x), z], axis=2)


def _states(e: float, mean_anomaly: Array, frames: Array) -> Array:
    """Positions and velocities ``(n, 6)`` of orbits with ``a = G m = 1``."""
    # The solver divides by the eccentricity: a circle is an ellipse of the smallest eccentricity.
    path = states_at_times(1.0, 1.0 - e, max(e - 1.0, np.finfo(float).eps - 1.0), mean_anomaly)
    plane = frames[:, :, :2]
    return np.concatenate(
        [np.einsum("nij,nj->ni", plane, path[:, :2]), np.einsum("nij,nj->ni", plane, path[:, 2:])], axis=1
    )


def _carried(
    state: Array, encounter: Encounter, unit: float, contact: float, figures: Figures | None = None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Integrate all members together; returns final states, smallest separations, and the mask of those in contact.

    A member that touches keeps its state from then on, while the others are integrated further.
    """
    n, width = state.shape
    moving = np.ones(n, dtype=bool)
    closest = np.linalg.norm(state[:, :3], axis=1)
    t, stop = encounter.t_start / unit, encounter.t_stop / unit
    scale = unit**2

    def rates(time: float, flat: Array) -> Array:
        y = flat.reshape(n, width)
        tide = encounter.tidal_tensor(time * unit) * scale
        if figures is not None:
            out = figured(y, tide, figures)
            out[~moving] = 0.0
            return out.ravel()
        x = y[:, :3]
        out = np.empty_like(y)
        out[:, :3] = y[:, 3:]
        r2 = np.sum(x * x, axis=1)
        out[:, 3:] = -x / (r2 * np.sqrt(r2))[:, None] + x @ tide
        out[~moving] = 0.0
        return out.ravel()

    y = state.ravel()
    steps = 0
    while t < stop and moving.any():
        solver = DOP853(rates, t, y, stop, rtol=_TOLERANCE, atol=1e-3 * _TOLERANCE)
        touched = False
        while solver.status == "running" and not touched:
            message = solver.step()
            steps += 1
            if solver.status == "failed" or steps > _MAX_STEPS:
                raise NotConverged(f"mutual orbit of the binary: {message or 'too many steps'}")
            dense = solver.dense_output()
            times = solver.t_old + _CHECKS * (solver.t - solver.t_old)
            distance = np.linalg.norm(dense(times).reshape(n, width, -1)[:, :3], axis=1)
            closest[moving] = np.minimum(closest[moving], distance.min(axis=1)[moving])
            now = moving & (distance.min(axis=1) <= contact)
            if now.any():
                moving &= ~now
                touched = True
        t, y = solver.t, solver.y
    return y.reshape(n, width), closest, ~moving
