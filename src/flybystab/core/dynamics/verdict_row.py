"""Dynamics of many bodies in encounters and their verdicts, one row each, without Python objects.

`rigid_rows` integrates bodies up to yield only: it does not contain the kernels of flow, whose compilation takes
several times as long. Bodies that yield get the verdict YIELDS and have to be passed to `verdict_rows`; for the others
both functions give the same outcome.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flybystab.constants import G
from flybystab.core.dynamics.ground import Ground
from flybystab.core.dynamics.regimes import Span
from flybystab.core.dynamics.run import EXPANSION, BodyState, FinalState, evolve, evolve_rigid
from flybystab.core.dynamics.state import RIGID
from flybystab.core.dynamics.workspace import BEYOND, ONSET, STUCK, TOUCH, Limits, Log, new_log, reset
from flybystab.core.ellipsoid.bound_mass import (
    angle_between,
    bound_share,
    momentum,
    principal_axes,
    spin_vector,
)
from flybystab.core.ellipsoid.rigid_stress import demand, overload, rigid_stress
from flybystab.core.ellipsoid.tide import TidePanels
from flybystab.core.numerics.jit import code, inlined, kernel
from flybystab.core.verdict_codes import BEYOND_MODEL, FAILED, FLOWED, IMPACT, INTACT, NOT_IN_EQUILIBRIUM
from flybystab.typing import Array

#: A body at the start of its encounter: axes (m), density (kg/m3), spin along the axes (rad/s), rotation body axes ->
#: frame of the encounter, material as in :class:`flybystab.core.dynamics.run.BodyState`, number of the encounter.
BODY = np.dtype(
    [
        ("axes", "f8", 3),
        ("rho", "f8"),
        ("omega", "f8", 3),
        ("attitude", "f8", (3, 3)),
        ("phi", "f8"),
        ("cohesion", "f8"),
        ("dilatancy", "f8"),
        ("surface", "i8"),
        ("brittle", "i8"),
        ("encounter", "i8"),
    ]
)

#: Series on panels of equal width in ``asinh(t/tau)``: the panels `first` to `last` of a joined array of coefficients.
_SERIES = [("tau", "f8"), ("start", "f8"), ("width", "f8"), ("first", "i8"), ("last", "i8")]

#: An encounter: span (s; see :class:`flybystab.core.dynamics.regimes.Span`), tide, and ground (m; see
#: :class:`flybystab.core.dynamics.ground.Ground`).
ENCOUNTER = np.dtype(
    [
        ("start", "f8"),
        ("rest", "f8"),
        ("stop", "f8"),
        ("tide", _SERIES),
        ("ground", _SERIES),
        ("floor", "f8"),
        ("least", "f8"),
    ]
)

#: Outcome of a row.
OUTCOME = np.dtype(
    [
        ("verdict", "i8"),  # code
        ("bound_fraction", "f8"),
        ("axes", "f8", 3),  # m, longest first
        ("spin", "f8", 3),  # rad/s, frame of the encounter
        ("friction", "f8"),  # largest friction angle mobilised if rigid throughout, rad
        ("friction_time", "f8"),  # s
        ("spin_ratio", "f8"),
        ("pole_change", "f8"),  # rad
        ("lacking", "f8"),  # cohesion that a body out of equilibrium without a tide lacks, Pa
        ("time", "f8"),  # end of the run, s
        ("reason", "i8"),
        ("regime", "i8"),
        ("steps", "i8"),
    ]
)

#: Contact with the ground is not tested if the height of the centre is always above this many longest semi-axes.
NEAR_GROUND = 100.0

#: Verdict of `rigid_rows` for a body that yields.
YIELDS = code(-2)
# Typed constants: numba compiles a kernel anew for each literal argument.
_UNYIELDING: Any = np.bool_(True)
_NO_ROWS, _ONE = code(0), code(1)


class Encounters(NamedTuple):
    """Encounters of many rows.

    Attributes
    ----------
    rows : ndarray of ENCOUNTER, shape (e,)
    tides : ndarray, shape (panels, degree + 1, 6)
        Coefficients of all tides, s^-2.
    positions : ndarray, shape (panels, degree + 1, 3)
        Coefficients of the positions of the planets, m.
    """

    rows: NDArray[Any]
    tides: Array
    positions: Array


class Output(NamedTuple):
    """Output of rows: outcomes of all, and end state and record of the last.

    Attributes
    ----------
    outcomes : ndarray of OUTCOME, shape (n,)
    shape, gradient : ndarray (3, 3)
        ``S`` (m2) and ``L`` (1/s) at the end.
    log : Log
        Times in s.
    """

    outcomes: NDArray[Any]
    shape: Array
    gradient: Array
    log: Log


@kernel
def in_equilibrium(body: BodyState, stress: Array) -> bool:
    """True if the body is in equilibrium without a tide; writes its stress there, Pa."""
    s1, s2, s3 = body.axes[0] ** 2, body.axes[1] ** 2, body.axes[2] ** 2
    rigid_stress(s1, s2, s3, body.rho, np.pi * G * body.rho, body.omega, np.zeros(6), stress)
    size = 0.0
    for i in range(6):
        size = max(size, abs(stress[i]))
    return overload(body.surface, body.phi, body.cohesion, stress) <= 1e-12 * size


@kernel
def write_end(
    body: BodyState,
    end: FinalState,
    holds: bool,
    stress: Array,
    out: Any,
    shape: Array,
    gradient: Array,
    log: Log,
) -> None:
    """Write the fields of the outcome that do not depend on flow: end, friction, lacking cohesion, axes and spin."""
    out["time"], out["reason"], out["regime"] = end.time, end.reason, end.regime
    out["steps"] = log.counts[0]["steps"]
    out["friction"], out["friction_time"] = end.peak.friction, end.peak.time
    out["lacking"] = 0.0
    if not holds:
        out["lacking"] = demand(body.surface, body.phi, body.cohesion, stress)[1]
    out["bound_fraction"] = 1.0
    axes, spin, vectors = np.empty(3), np.empty(3), np.empty((3, 3))
    principal_axes(shape, axes, vectors)
    spin_vector(gradient, spin)
    for i in range(3):
        out["axes"][i] = axes[i]
        out["spin"][i] = spin[i]
    before, after = np.empty(3), np.empty(3)
    rate = momentum(shape, gradient, after)
    first = np.empty((3, 3))
    still = np.empty((3, 3))
    _initial(body.axes, body.omega, body.attitude, still, first)
    rate_before = momentum(still, first, before)
    out["spin_ratio"] = rate / rate_before if rate_before > 0.0 else (np.inf if rate > 0.0 else 1.0)
    out["pole_change"] = angle_between(before, after)


@inlined
def _rigid_row(
    body: BodyState,
    span: Span,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    out: Any,
    shape: Array,
    gradient: Array,
    log: Log,
) -> None:
    """`verdict_row` up to yield; for a body that yields only the verdict YIELDS is written."""
    stress = np.empty(6)
    holds = in_equilibrium(body, stress)
    end = evolve_rigid(body, span, tide, ground, limits, not holds, shape, gradient, log)
    out["verdict"] = YIELDS
    if end.reason != ONSET:
        write_end(body, end, holds, stress, out, shape, gradient, log)
        out["verdict"] = verdict_code(end.reason, holds, end.reason == TOUCH or ground.least < 0.0, False)


@inlined
def verdict_row(
    body: BodyState,
    span: Span,
    tide: TidePanels,
    ground: Ground,
    limits: Limits,
    required: bool,
    out: Any,
    shape: Array,
    gradient: Array,
    log: Log,
) -> None:
    """Integrate the motion of a body in an encounter and classify the outcome.

    Parameters
    ----------
    body : BodyState
    span : Span
        s.
    tide : TidePanels
        SI.
    ground : Ground
        The run of a body that reaches it ends there.
    limits : Limits
        An axis ratio below that of the body is raised to it.
    required : bool
        If true, a body that yields is integrated once more as a rigid one, for the friction that it would require.
    out : record of OUTCOME
        The verdict is FAILED if the integrator stopped early.
    shape, gradient : ndarray (3, 3)
        ``S`` (m2) and ``L`` (1/s) at the end.
    log : Log
        Times in s.
    """
    stress = np.empty(6)
    holds = in_equilibrium(body, stress)
    limits = Limits(
        limits.tolerance, max(limits.axis_ratio, 1.001 * body.axes[0] / body.axes[2]), limits.max_steps
    )
    # A body out of equilibrium is integrated as a rigid one: its demand at the start is the result.
    end = evolve(body, span, tide, ground, limits, not holds, np.zeros((3, 3)), shape, gradient, log)
    reason = end.reason
    yielded = log.counts[0]["events"] > 0 and log.events[0]["code"] == ONSET
    write_end(body, end, holds, stress, out, shape, gradient, log)
    if holds and end.regime != RIGID:
        axes = out["axes"]
        rho = body.rho * body.axes[0] * body.axes[1] * body.axes[2] / (axes[0] * axes[1] * axes[2])
        out["bound_fraction"] = bound_share(shape, gradient, rho)
    if yielded and required and reason != STUCK:
        second = evolve_rigid(
            body, span, tide, ground, limits, _UNYIELDING, np.empty((3, 3)), np.empty((3, 3)), new_log(_NO_ROWS, _ONE)
        )  # fmt: skip
        out["friction"], out["friction_time"] = second.peak.friction, second.peak.time
        reason = STUCK if second.reason == STUCK else reason
    out["verdict"] = verdict_code(reason, holds, end.reason == TOUCH or ground.least < 0.0, yielded)


@kernel
def verdict_code(reason: int, holds: bool, hits: bool, yielded: bool) -> int:
    """Verdict of a run that ends for `reason`; `holds` if the body is in equilibrium without a tide."""
    if reason == STUCK:
        return FAILED
    if not holds:
        return NOT_IN_EQUILIBRIUM
    if hits:
        return IMPACT
    if reason == BEYOND:
        return BEYOND_MODEL
    return FLOWED if yielded else INTACT


@kernel
def _initial(axes: Array, omega: Array, attitude: Array, shape: Array, gradient: Array) -> None:
    """Shape and velocity gradient of a rigid body in the frame of its encounter."""
    w = np.zeros(3)
    for i in range(3):
        for j in range(3):
            w[i] += attitude[i, j] * omega[j]
            shape[i, j] = (
                attitude[i, 0] * attitude[j, 0] * axes[0] ** 2
                + attitude[i, 1] * attitude[j, 1] * axes[1] ** 2
                + attitude[i, 2] * attitude[j, 2] * axes[2] ** 2
            )
    gradient[0, 0] = gradient[1, 1] = gradient[2, 2] = 0.0
    gradient[2, 1], gradient[1, 2] = w[0], -w[0]
    gradient[0, 2], gradient[2, 0] = w[1], -w[1]
    gradient[1, 0], gradient[0, 1] = w[2], -w[2]


@kernel
def body_of(row: Any) -> BodyState:
    """State record of a row of BODY."""
    return BodyState(
        row["axes"], row["rho"], row["omega"], row["attitude"], row["phi"], row["cohesion"], row["dilatancy"],
        row["surface"], row["brittle"] > 0, EXPANSION,
    )  # fmt: skip


@kernel
def encounter_of(row: Any, encounters: Encounters) -> tuple[Span, TidePanels, Ground]:
    """Span, tide and ground of the encounter of a row of BODY."""
    e = encounters.rows[row["encounter"]]
    s = e["tide"]
    panels = np.ascontiguousarray(encounters.tides[s["first"] : s["last"]])
    g = e["ground"]
    last = g["first"] if e["least"] > NEAR_GROUND * row["axes"][0] else g["last"]
    positions = np.ascontiguousarray(encounters.positions[g["first"] : last])
    return (
        Span(e["start"], e["rest"], e["stop"]),
        TidePanels(s["tau"], s["start"], s["width"], panels),
        Ground(g["tau"], g["start"], g["width"], e["floor"], e["least"], 1.0, positions),
    )


@kernel
def verdict_rows(
    rows: NDArray[np.int64],
    bodies: NDArray[Any],
    encounters: Encounters,
    limits: Limits,
    required: bool,
    output: Output,
) -> None:
    """`verdict_row` for the given rows of ``bodies[n]`` (BODY); writes those rows of the outcomes.

    Parameters
    ----------
    rows : ndarray of int (m,)
    bodies : ndarray of BODY (n,)
    encounters : Encounters
    limits, required
        As in `verdict_row`.
    output : Output
    """
    for i in rows:
        body = body_of(bodies[i])
        span, tide, ground = encounter_of(bodies[i], encounters)
        reset(output.log)
        verdict_row(
            body, span, tide, ground, limits, required,
            output.outcomes[i], output.shape, output.gradient, output.log,
        )  # fmt: skip


@kernel
def rigid_rows(
    rows: NDArray[np.int64], bodies: NDArray[Any], encounters: Encounters, limits: Limits, output: Output
) -> None:
    """`verdict_rows` for the bodies that do not yield; the others have the verdict YIELDS."""
    for i in rows:
        body = body_of(bodies[i])
        span, tide, ground = encounter_of(bodies[i], encounters)
        reset(output.log)
        _rigid_row(
            body, span, tide, ground, limits, output.outcomes[i], output.shape, output.gradient, output.log
        )
