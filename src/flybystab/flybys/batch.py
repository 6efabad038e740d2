"""Bodies and encounters as rows of the arrays that the compiled judgement takes, and its answers read back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body
from flybystab.core.dynamics import verdict_row as judgement
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.dynamics.run import REGIMES, event_log, unpacked_history
from flybystab.core.dynamics.workspace import N_EVENT, N_HISTORY
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import TAIL
from flybystab.errors import InvalidInput
from flybystab.flybys.verdict import Verdict, verdict_of
from flybystab.typing import Array
from flybystab.units import to_si

#: :func:`flybystab.core.dynamics.verdict_row.judge_rows`, to be called with the arrays of `one_row`.
judge_rows: Any = judgement.judge_rows

#: Step tolerance by default: 1e-8 in the shape of the reference cases (``flybystab bench flyby``).
TOLERANCE = 1e-8

#: Steps after which a run is given up.
MAX_STEPS = 200_000


def step_tolerance(value: Any) -> float:
    """The relative error allowed in a step, checked."""
    return to_si(value, u.dimensionless_unscaled, "tolerance", low=1e-13, high=1e-3)


def axis_ratio(value: Any) -> float:
    """The largest axis ratio, checked; infinite for no limit."""
    ratio = float(value) if isinstance(value, int | float | np.number) else np.nan
    if not ratio > 1.0:
        raise InvalidInput("max_axis_ratio", value, "a number above 1")
    return ratio


class Judged(NamedTuple):
    """Result of :func:`flybystab.core.dynamics.verdict_row.judge` for a body, in SI units."""

    verdict: Verdict
    bound: float
    axes: Array
    spin: Array
    friction: float  # rad
    friction_time: float  # s, clock of the tide
    spin_ratio: float
    pole_change: float  # rad
    lacking: float  # cohesion, Pa
    time: float  # s, clock of the tide
    regime: str  # at the end
    shape: Array
    velocity_gradient: Array
    events: list[tuple[str, float, float]]
    history: dict[str, Array] | None
    failure: str


def judged(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    tolerance: float,
    max_axis_ratio: float,
    keep: int,
    needs: bool,
    inputs: tuple[Any, ...] | None = None,
) -> Judged:
    """Follow a body through an encounter and classify the outcome.

    `rotation` takes body axes to the frame of the encounter; `inputs` is `one_row` of the three, if it is at hand.
    """
    out = np.empty((1, judgement.N_ANSWER))
    shape, gradient, rows, events, count = room = buffers(keep)
    judge_rows(
        *(one_row(body, encounter, rotation) if inputs is None else inputs), tolerance,
        float(max_axis_ratio), MAX_STEPS, needs, *room, out,
    )  # fmt: skip
    out = out[0]
    return Judged(
        verdict_of(int(out[judgement.VERDICT]), float(out[judgement.BOUND])) or Verdict.INTACT,
        float(out[judgement.BOUND]),
        out[judgement.AXES : judgement.AXES + 3],
        out[judgement.SPIN : judgement.SPIN + 3],
        float(out[judgement.FRICTION]),
        float(out[judgement.FRICTION_TIME]),
        float(out[judgement.SPIN_RATIO]),
        float(out[judgement.POLE_CHANGE]),
        float(out[judgement.LACKING]),
        float(out[judgement.TIME]),
        REGIMES[int(out[judgement.REGIME])],
        shape,
        gradient,
        event_log(events, count),
        unpacked_history(rows[: count[0]], body.axes, body.rho) if keep > 1 else None,
        failure_of(out, encounter, tolerance),
    )


def buffers(keep: int) -> tuple[Array, Array, Array, Array, NDArray[np.int64]]:
    """Shape, velocity gradient, history of `keep` rows, event log and counts, for the kernel to write."""
    history, events = np.zeros((max(keep, 1), N_HISTORY)), np.zeros((64, N_EVENT))
    return np.empty((3, 3)), np.empty((3, 3)), history, events, np.zeros(4, dtype=np.int64)


def one_row(body: Body, encounter: Encounter, rotation: Array | None = None) -> tuple[Any, ...]:
    """One body and encounter as the first arguments of `judge_rows`; the identity rotation by default."""
    turn = np.eye(3) if rotation is None else rotation
    return np.zeros(1, dtype=np.int64), *columns([body], turn[None], [encounter])


def columns(bodies: Sequence[Body], rotations: Array, encounters: Sequence[Encounter]) -> tuple[Any, ...]:
    """Bodies and encounters as the arrays of `judge_rows`; the same encounter is stored once."""
    met = {id(e): e for e in encounters}
    place = {key: k for k, key in enumerate(met)}
    tides = [e.tide for e in met.values()]
    longest = max(b.axes[0] for b in bodies)
    grounds = [ground_near(e, longest) for e in met.values()]
    return (
        np.array([b.axes for b in bodies]),
        np.array([b.rho for b in bodies]),
        np.array([b.omega for b in bodies]),
        np.ascontiguousarray(rotations),
        np.array([_material(b) for b in bodies]),
        np.array([place[id(e)] for e in encounters], dtype=np.int64),
        np.array([span_of(e) for e in met.values()]),
        np.array([[t.tau, t.start, t.width] for t in tides]),
        *_joined([t.coefficients for t in tides]),
        np.array([[g.tau, g.start, g.width, g.floor, g.least] for g in grounds]),
        *_joined([g.coefficients for g in grounds]),
    )


def _joined(series: Sequence[Array]) -> tuple[NDArray[np.int64], Array]:
    """Offsets of the series in one joined array, and the array; series of lower degree are padded with zeros."""
    first = np.concatenate([[0], np.cumsum([len(s) for s in series])]).astype(np.int64)
    out = np.zeros((first[-1], max(s.shape[1] for s in series), series[0].shape[2]))
    for s, k in zip(series, first, strict=False):
        out[k : k + len(s), : s.shape[1]] = s
    return first, out


def _material(body: Body) -> Array:
    m = body.material
    return np.array([m.phi, m.c_pa, m.dilatancy, m.surface_code, m.brittle], dtype=float)


def ground_near(encounter: Encounter, longest: float) -> Ground:
    """The ground along an encounter that bodies of a long semi-axis (m) may touch; none where it is far below."""
    return encounter.ground if encounter.height <= judgement.NEAR_GROUND * longest else no_ground()


def span_of(encounter: Encounter) -> Array:
    """Start, rest and stop, s, clock of the tide: a row of spans of `judge_rows`."""
    stop, limit = encounter.t_stop, encounter.t_stop + TAIL
    if encounter.impact_time is not None:  # a body of any size has touched the ground by then
        stop = limit = max(encounter.impact_time, encounter.t_start)
    return np.array([encounter.t_start, stop, limit], dtype=float)


def failure_of(out: Array, encounter: Encounter, tolerance: float) -> str:
    """Reason that a row has no verdict; empty if it has one."""
    if out[judgement.VERDICT] != judgement.FAILED:
        return ""
    return (
        f"the integration stopped {out[judgement.TIME] - encounter.t_start:.1f} s after the start in the "
        f"{REGIMES[int(out[judgement.REGIME])]} regime after {out[judgement.STEPS]:.0f} steps "
        f"(tolerance {tolerance:g})"
    )
