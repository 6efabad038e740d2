"""What a flyby gives: the result, its measured error, its history, and the table of many."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.verdict import Verdict
from flybystab.units import brief, counted

if TYPE_CHECKING:
    from flybystab.flybys.grains_flyby import GrainsOutcome

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class History:
    """The body and its orbit against time; every array has the same first dimension.

    Attributes
    ----------
    time : Quantity (n,)
        Since the start of the encounter.
    time_from_periapsis : Quantity (n,)
        Since closest approach.
    distance : Quantity (n,)
        Between the centres of asteroid and planet.
    regime : ndarray of str (n,)
        "rigid", "flowing" or "dispersed".
    semi_axes : Quantity (n, 3)
        Sorted, longest first.
    spin : Quantity (n, 3)
        Angular velocity in the frame of the encounter.
    required_friction_angle : Quantity (n,)
        Friction angle that the stress mobilises, with the body's cohesion; inf where none would do.
    pressure : Quantity (n,)
        Volume-averaged pressure, compression positive.
    shape, velocity_gradient : Quantity (n, 3, 3)
        ``S = 5 I/m`` and ``L`` in the frame of the encounter.
    """

    time: Quantity
    time_from_periapsis: Quantity
    distance: Quantity
    regime: NDArray[np.str_]
    semi_axes: Quantity
    spin: Quantity
    required_friction_angle: Quantity
    pressure: Quantity
    shape: Quantity
    velocity_gradient: Quantity

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        rows = len(self)
        if not rows:
            return "<History, no rows>"
        return (
            f"<History {rows} rows over {brief(self.time[-1] - self.time[0], u.h)}, "
            f"{', '.join(dict.fromkeys(map(str, self.regime)))}>"
        )


@dataclass(frozen=True)
class FlybyError:
    """Measured error of a result: its difference from a run with a 30 times larger step tolerance, or a 30 times
    smaller one where that one does not converge.

    Attributes
    ----------
    semi_axes, spin, bound_fraction : float
        Largest relative difference of the semi-axes, of the spin vector, absolute of the bound share.
    required_friction_angle, event_times : Quantity
        Absolute differences; nan if the two runs have different events.
    verdict_agrees : bool
        Whether both runs give the same verdict.
    tide : float
        Relative error of the stored tide, from the encounter.
    """

    semi_axes: float
    spin: float
    bound_fraction: float
    required_friction_angle: Quantity
    event_times: Quantity
    verdict_agrees: bool
    tide: float

    def __repr__(self) -> str:
        other = "" if self.verdict_agrees else ", the verdict differs"
        return (
            f"<FlybyError semi-axes {self.semi_axes:.1e}, spin {self.spin:.1e} (relative), friction angle "
            f"{self.required_friction_angle.value:.1e} deg{other}>"
        )


@dataclass(frozen=True, eq=False)
class FlybyResult:
    """What an encounter did to a body.

    Attributes
    ----------
    verdict : Verdict
        Compares equal to its text, ``r.verdict == "INTACT"``.
    verdict_class : str or None
        "M", "B" or "S" of Richardson et al. (1998) for bodies that lost mass.
    bound_fraction : float
        Share of the mass still bound (an upper bound, see :func:`flybystab.flybys.verdict.bound_fraction`).
    semi_axes : Quantity (3,)
        At the end, longest first.
    spin : Quantity
        Spin rate at the end.
    spin_vector : Quantity (3,)
        Angular velocity at the end, frame of the encounter.
    onset_time, arrest_time : Quantity or None
        First yield and last arrest since the start of the encounter; None if there was none.
    end_time : Quantity
        End of the run, since the start of the encounter; on an IMPACT the first touch.
    max_required_friction_angle : Quantity
        Largest friction angle that the body mobilises if it stays rigid throughout; inf if none would do.
    margin : Quantity
        Friction angle minus that: positive for a body that never yields.
    required_cohesion : Quantity
        NOT IN EQUILIBRIUM: the cohesion that would hold the body at its friction angle. Zero otherwise.
    lode_angle : Quantity or None
        Lode angle of the stress at first yield (-30 deg: extension, +30 deg: compression).
    spin_ratio : float
        Effective spin rate ``2 E/H`` after the encounter over that before it.
    pole_change : Quantity
        Angle between the angular momenta before and after; nan for a body without spin.
    error : FlybyError or None
        Measured error; None if it was not asked for.
    verdict_by_surface : dict of str to Verdict
        Verdicts with the other yield surfaces that were asked for, and with this one.
    robust : bool or None
        Whether the verdicts of the surfaces agree; None if only one was run.
    events : tuple of (str, Quantity)
        Every switch of regime, since the start of the encounter.
    body : Body
        The body afterwards.
    history : History or None
    modelled, left_out : tuple
        What the encounter and the body model contain, and what they leave out with its share.
    encounter : Encounter
    rung : str
        What gave the verdict: "rigid body", "ellipsoid" or "grains". Of grains, `semi_axes`, spin, `body` and
        `bound_fraction` are those of the pile with the median bound share; onset, margin and history stay those of the
        ellipsoid.
    grains : GrainsOutcome or None
        The distribution over piles of grains.
    """

    verdict: Verdict
    verdict_class: str | None
    bound_fraction: float
    semi_axes: Quantity
    spin: Quantity
    spin_vector: Quantity
    onset_time: Quantity | None
    arrest_time: Quantity | None
    end_time: Quantity
    max_required_friction_angle: Quantity
    max_required_friction_time: Quantity
    margin: Quantity
    required_cohesion: Quantity
    lode_angle: Quantity | None
    spin_ratio: float
    pole_change: Quantity
    error: FlybyError | None
    verdict_by_surface: dict[str, Verdict]
    robust: bool | None
    events: tuple[tuple[str, Quantity], ...]
    body: Body
    history: History | None = field(repr=False)
    modelled: tuple[str, ...] = field(repr=False)
    left_out: tuple[tuple[str, float], ...] = field(repr=False)
    encounter: Encounter = field(repr=False)
    rung: str = "ellipsoid"
    grains: GrainsOutcome | None = field(default=None, repr=False)

    @property
    def fragments(self) -> QTable | None:
        """Clumps at the end, for every seed (:class:`GrainsOutcome`); None unless `rung` is "grains"."""
        return None if self.grains is None else self.grains.fragments

    @property
    def largest_fraction(self) -> float:
        """Mass of the largest remnant over that of the body: of grains the median of the largest clump, else bound."""
        return self.bound_fraction if self.grains is None else self.grains.largest_fraction

    @property
    def contact(self) -> str | None:
        """What reaches the ground on an IMPACT, None otherwise.

        ``"path"``: the closest approach lies below the top of the atmosphere (the surface, if there is none);
        ``"body"``: the centre would pass above it, but the body is large enough there, towards the planet, to touch it.
        The run ends with the first touch: `end_time`.
        """
        if self.verdict != Verdict.IMPACT:
            return None
        return "path" if self.encounter.impact else "body"

    def __repr__(self) -> str:
        letter = f" ({self.verdict_class})" if self.verdict_class else ""
        phi = self.max_required_friction_angle
        own = brief(self.body.material.friction_angle)
        need = f"mobilises {brief(phi)} of {own}" if np.isfinite(phi) else "no friction keeps it rigid"
        robust = {None: "", True: ", robust", False: ", depends on the yield surface"}[self.robust]
        return (
            f"<FlybyResult {self.verdict}{letter}{robust}: {need}, "
            f"bound {self.bound_fraction:.4g}, then {brief(self.semi_axes, u.m)}, "
            f"spin rate x {self.spin_ratio:.4g}>"
        )


@dataclass(frozen=True, eq=False)
class FlybyTable:
    """Results of many encounters as arrays; attributes as in :class:`FlybyResult`, first dimension n.

    A row that could not be computed has the verdict "FAILED", its reason in `failure` and nan elsewhere; `contact` is
    empty where nothing reaches the ground.
    """

    verdict: NDArray[np.str_]
    bound_fraction: Array
    semi_axes: Quantity
    spin: Quantity
    max_required_friction_angle: Quantity
    margin: Quantity
    spin_ratio: Array
    pole_change: Quantity
    contact: NDArray[np.str_]
    failure: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.verdict)

    def __repr__(self) -> str:
        return f"<FlybyTable {len(self)} rows: {counted(self.verdict)}>"
