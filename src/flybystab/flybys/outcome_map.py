"""Verdicts over periapsis and hyperbolic excess speed, and over the target plane of an encounter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.body.body import Body
from flybystab.constants import C_LIGHT
from flybystab.encounter.attitude import about_z, periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.verdict import SEVERITY, Verdict
from flybystab.orbit.planets import Planet, planet
from flybystab.orbit.target_plane import capture_radius
from flybystab.progress import Progressing
from flybystab.saving import Columns
from flybystab.tabular import Tabular
from flybystab.typing import Array, Document
from flybystab.units import counted, to_si


@dataclass(frozen=True, eq=False)
class OutcomeMap(Tabular):
    """Verdicts over (periapsis, v_inf) for one body at several phases of its spin.

    Attributes
    ----------
    body : Body
    planet : Planet
    periapsis : Quantity (n,)
    v_inf : Quantity (m,)
    verdict : ndarray of str (n, m, k)
        For each of the k phases.
    axis_growth : ndarray (n, m, k)
        Long axis after the encounter over that before it.
    """

    body: Body
    planet: Planet
    periapsis: Quantity
    v_inf: Quantity
    verdict: NDArray[np.str_]
    axis_growth: Array

    _dimensions: ClassVar[tuple[str, ...]] = ("periapsis", "v_inf", "phase")

    def __len__(self) -> int:
        return self.verdict.size

    def _grid(self) -> tuple[int, ...]:
        return self.verdict.shape

    def _columns(self) -> tuple[Columns, Document]:
        columns, meta = super()._columns()
        n, m, k = self._grid()
        phase = np.tile(180.0 * np.arange(k) / k, n * m) * u.deg
        return {**dict(list(columns.items())[:2]), "phase": phase, **columns}, meta

    def __repr__(self) -> str:
        n, m, k = self._grid()
        where = self.planet.name.capitalize()
        return (
            f"<OutcomeMap {where}, {n} periapses x {m} v_inf x {k} phases: {counted(self.verdict.ravel())}>"
        )

    @property
    def worst(self) -> NDArray[np.str_]:
        """The most severe verdict over the phases, shape (n, m)."""
        rank = np.vectorize(SEVERITY.index, otypes=[int])(self.verdict)
        return np.array(SEVERITY, dtype=object)[rank.max(axis=-1)].astype(str)

    @property
    def share_yielding(self) -> Array:
        """Fraction of the phases in which the body yields or hits the planet, shape (n, m)."""
        return np.mean(self.verdict != str(Verdict.INTACT), axis=-1)


@check_arguments
def outcome_map(
    body: Body,
    periapsis: Quantity,
    v_inf: Quantity,
    on: str | Planet = "earth",
    *,
    phases: int = 8,
    retrograde: bool = False,
    tolerance: float = 1e-6,
    workers: int | None = None,
    progress: Progressing = None,
) -> OutcomeMap:
    """Verdicts of hyperbolic encounters over a grid, with the spin axis along the orbital angular momentum.

    Parameters
    ----------
    body : Body
    periapsis, v_inf : Quantity (n,), (m,)
        The grid.
    on : str or Planet
        The planet.
    phases : int
        Phases of the spin at the start, uniform over half a turn (an ellipsoid repeats after that).
    retrograde : bool
        Turn the spin axis against the orbital angular momentum.
    tolerance, workers, progress
        As in :func:`flybystab.flyby_many`.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """
    q = np.atleast_1d(to_si(periapsis, u.m, "periapsis", shape=None, low=0.0, open_low=True))
    v = np.atleast_1d(to_si(v_inf, u.m / u.s, "v_inf", shape=None, low=0.0, high=C_LIGHT))
    for name, given in (("periapsis", q), ("v_inf", v)):
        if not given.size:
            raise InvalidInput(name, "no values", "at least one value")
    if phases < 1:
        raise InvalidInput("phases", phases, "at least one phase")
    where = planet(on)
    flip = np.diag([1.0, -1.0, -1.0]) if retrograde else np.eye(3)
    turns = [about_z(np.pi * k / phases) @ flip for k in range(phases)]
    encounters = [Encounter.hyperbolic(where, x * u.m, y * u.m / u.s) for x in q for y in v]
    every = [e for e in encounters for _ in turns]
    table = flyby_many(
        [body] * len(every),
        every,
        turns * len(encounters),
        tolerance=tolerance,
        workers=workers,
        progress=progress,
    )
    shape = (q.size, v.size, phases)
    return OutcomeMap(
        body=body,
        planet=where,
        periapsis=q * u.m,
        v_inf=(v * u.m / u.s).to(u.km / u.s),
        verdict=np.asarray(table.verdict).reshape(shape),
        axis_growth=(table.semi_axes[:, 0].to_value(u.m) / body.axes[0]).reshape(shape),
    )


@dataclass(frozen=True, eq=False)
class TargetMap(Tabular):
    """Verdicts over the target plane of one direction of arrival.

    Attributes
    ----------
    planet : Planet
    v_inf : Quantity
    b_t, b_r : Quantity (n, m)
        Target-plane coordinates; n impact parameters, m directions.
    verdict : ndarray of str (n, m)
    max_required_friction_angle : Quantity (n, m)
    """

    planet: Planet
    v_inf: Quantity
    b_t: Quantity
    b_r: Quantity
    verdict: NDArray[np.str_]
    max_required_friction_angle: Quantity

    _dimensions: ClassVar[tuple[str, ...]] = ("impact_parameter", "direction")

    def __len__(self) -> int:
        return self.verdict.size

    def _grid(self) -> tuple[int, ...]:
        return self.verdict.shape

    def __repr__(self) -> str:
        n, m = self._grid()
        where = self.planet.name.capitalize()
        return f"<TargetMap {where}, {n} impact parameters x {m} directions: {counted(self.verdict.ravel())}>"

    @property
    def capture_radius(self) -> Quantity:
        """Impact parameter of a path that grazes the atmosphere, or the surface of a planet without one."""
        v = self.v_inf.to_value(u.m / u.s)
        return (capture_radius(self.planet.gm, self.planet.impact_distance, v) * u.m).to(u.km)


@check_arguments
def target_map(
    body: Body,
    v_inf: Quantity,
    periapsis: Quantity,
    directions: int = 24,
    on: str | Planet = "earth",
    *,
    attitude: object = None,
    tolerance: float = 1e-6,
    workers: int | None = None,
    progress: Progressing = None,
) -> TargetMap:
    """Verdicts of a body with its attitude fixed in space over the target plane.

    Parameters
    ----------
    body : Body
    v_inf : Quantity
        Above zero.
    periapsis : Quantity (n,)
        Of the paths.
    directions : int
        Directions of B, uniform over the circle.
    attitude : ndarray (3, 3), optional
        Body axes -> (S, T, R): along the asymptote, and the two axes of the target plane. By default the
        spin axis is along -R and the long axis along the asymptote, so that paths with B along +T are prograde.
    tolerance, workers, progress
        As in :func:`flybystab.flyby_many`.
    """
    where = planet(on)
    q = np.atleast_1d(to_si(periapsis, u.m, "periapsis", shape=None, low=0.0, open_low=True))
    v = to_si(v_inf, u.m / u.s, "v_inf", low=0.0, high=C_LIGHT, open_low=True)
    turn = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0]]) if attitude is None else np.asarray(attitude)
    if attitude is None:
        turn = turn @ np.diag([1.0, -1.0, -1.0])
    angles = 2.0 * np.pi * np.arange(directions) / directions
    impact = capture_radius(where.gm, q, v)
    encounters, rotations = [], []
    for x in q:
        encounter = Encounter.hyperbolic(where, x * u.m, v * u.m / u.s)
        e = 1.0 + x * v * v / where.gm
        # rows: S, B/|B| and S x B/|B| in the frame of the encounter (x periapsis, z angular momentum)
        c = 1.0 / e
        s = np.sqrt(1.0 - c * c)
        frame = periapsis_axes(encounter) @ np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]]).T
        for angle in angles:
            # (S, T, R) -> (S, B, S x B)
            spin = np.array(
                [[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]]
            )
            encounters.append(encounter)
            rotations.append(frame @ spin @ turn)
    table = flyby_many(
        [body] * len(encounters),
        encounters,
        rotations,
        tolerance=tolerance,
        workers=workers,
        progress=progress,
    )
    shape = (q.size, directions)
    return TargetMap(
        planet=where,
        v_inf=(v * u.m / u.s).to(u.km / u.s),
        b_t=(impact[:, None] * np.cos(angles) * u.m).to(u.km),
        b_r=(impact[:, None] * np.sin(angles) * u.m).to(u.km),
        verdict=np.asarray(table.verdict).reshape(shape),
        max_required_friction_angle=table.max_required_friction_angle.reshape(shape),
    )
