"""History of a flyby and its measured error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.core.dynamics.run import REGIMES
from flybystab.core.material.yield_surface import required_frictions
from flybystab.flybys.batch import FlybyRun
from flybystab.flybys.inputs import FlybyInputs
from flybystab.tabular import Record, Tabular
from flybystab.typing import Array
from flybystab.units import brief

_Events = list[tuple[str, float, float]]


@dataclass(frozen=True, eq=False)
class History(Tabular):
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
        Friction angle that the stress mobilises, with the body's cohesion; inf where no angle suffices.
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

    _dimensions: ClassVar[tuple[str, ...]] = ("time",)

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
class FlybyError(Record):
    """Measured error of a result: its difference from a run with a 30 times larger step tolerance, or a 30 times
    smaller one where that one does not converge.

    Attributes
    ----------
    semi_axes, spin, bound_fraction : float
        Largest relative difference of the semi-axes and of the spin vector; absolute difference of the bound fraction.
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


def history_of(h: dict[str, Array], inputs: FlybyInputs) -> History:
    """The history from the columns that the kernel wrote (:class:`flybystab.core.dynamics.run.Run`)."""
    m, encounter = inputs.body.material, inputs.encounter
    required = required_frictions(m.surface_code, m.c_pa, h["deviator"], h["pressure"], h["determinant"])
    return History(
        time=(h["time"] - encounter.t_start) * u.s,
        time_from_periapsis=h["time"] * u.s,
        distance=(encounter.distances(h["time"]) * u.m).to(u.km),
        regime=np.array(REGIMES)[h["regime"]],
        semi_axes=axes_of(h["shape"]) * u.m,
        spin=_spin(h["velocity_gradient"]) * u.rad / u.s,
        required_friction_angle=np.rad2deg(required) * u.deg,
        pressure=h["pressure"] * u.Pa,
        shape=h["shape"] * u.m**2,
        velocity_gradient=h["velocity_gradient"] / u.s,
    )


def measured_error(run: FlybyRun, other: FlybyRun, tide_error: float) -> FlybyError:
    """Differences between a run and another one with another step tolerance."""
    difference = 0.0 if run.friction == other.friction else abs(run.friction - other.friction)
    return FlybyError(
        semi_axes=float(np.max(np.abs(other.axes / run.axes - 1.0))),
        spin=_relative(other.spin, run.spin),
        bound_fraction=abs(other.bound - run.bound),
        required_friction_angle=np.rad2deg(difference) * u.deg,
        event_times=_event_difference(run.events, other.events) * u.s,
        verdict_agrees=other.verdict == run.verdict,
        tide=tide_error,
    )


def axes_of(shape: Array) -> Array:
    """Semi-axes, longest first, of shape tensors (..., 3, 3)."""
    axes: Array = np.sqrt(np.linalg.eigvalsh(shape)[..., ::-1])
    return axes


def _spin(gradient: Array) -> Array:
    """Axial vectors of the antisymmetric parts of velocity gradients."""
    g = gradient
    pairs = ((2, 1), (0, 2), (1, 0))
    return 0.5 * np.stack([g[..., i, j] - g[..., j, i] for i, j in pairs], axis=-1)


def _relative(a: Array, b: Array) -> float:
    norm = np.linalg.norm(b)
    return float(np.linalg.norm(a - b) / norm) if norm > 0.0 else float(np.linalg.norm(a))


def _event_difference(a: _Events, b: _Events) -> float:
    if [e[0] for e in a] != [e[0] for e in b]:
        return float("nan")
    return max((abs(x[1] - y[1]) for x, y in zip(a, b, strict=True)), default=0.0)
