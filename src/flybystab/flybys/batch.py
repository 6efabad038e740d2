"""Bodies and encounters as records of the compiled kernels, and the outcomes read back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body, Material
from flybystab.core.dynamics import verdict_row as kernels
from flybystab.core.dynamics.ground import Ground, no_ground
from flybystab.core.dynamics.lane_rows import lane_rows
from flybystab.core.dynamics.rigid_lanes import LANES
from flybystab.core.dynamics.run import REGIMES, event_log, unpacked_history
from flybystab.core.dynamics.verdict_row import BODY, ENCOUNTER, NEAR_GROUND, OUTCOME, Encounters, Output
from flybystab.core.dynamics.workspace import Limits, new_log
from flybystab.core.verdict_codes import FAILED
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import TAIL
from flybystab.errors import InvalidInput
from flybystab.flybys.precompile import on_disk
from flybystab.flybys.verdict import Verdict, verdict_of
from flybystab.typing import Array
from flybystab.units import to_si


def verdict_rows(
    rows: NDArray[np.int64],
    bodies: NDArray[np.void],
    encounters: Encounters,
    limits: Limits,
    required: bool,
    output: Output,
) -> None:
    """:func:`flybystab.core.dynamics.verdict_row.verdict_rows`; without the kernels of flow while no body yields.

    In a process in which no body has yielded yet the bodies are first followed up to yield, by kernels that are
    compiled (or loaded) in a fraction of the time. The outcomes are the same.
    """
    if not getattr(kernels.verdict_rows, "overloads", True):
        kernels.rigid_rows(rows, bodies, encounters, limits, output)
        rows = rows[output.outcomes["verdict"][rows] == kernels.YIELDS]
    if len(rows):
        kernels.verdict_rows(rows, bodies, encounters, limits, required, output)


#: Least number of bodies that are followed side by side.
SIDE_BY_SIDE = 4 * LANES
#: Where the kernels for that are not on the disk, a process compiles them after this number of bodies.
WORTH_COMPILING = 1000
_one_by_one = 0


def side_by_side(
    rows: NDArray[np.int64], bodies: NDArray[np.void], encounters: Encounters
) -> NDArray[np.int64]:
    """Rows for :func:`flybystab.core.dynamics.lane_rows.lane_rows`: bodies clear of the ground, if there are many."""
    global _one_by_one
    chosen = bodies[rows]
    clear = encounters.rows["least"][chosen["encounter"]] > NEAR_GROUND * chosen["axes"][:, 0]
    count = int(np.count_nonzero(clear))
    if count < SIDE_BY_SIDE:
        return rows[:0]
    if not (getattr(lane_rows, "overloads", True) or on_disk(lane_rows)):
        _one_by_one += count
        if _one_by_one < WORTH_COMPILING:
            return rows[:0]
    return rows[clear]


#: Default step tolerance, with an error of 1e-8 in the shape of the reference cases (``flybystab bench flyby``).
TOLERANCE = 1e-8

#: Largest tolerance, and the factor between the tolerances of the two runs whose difference measures the error.
LARGEST, LOOSER = 1e-3, 30.0

#: Largest number of steps of a run.
MAX_STEPS = 200_000


def step_tolerance(value: object) -> float:
    """The relative error allowed in a step, checked."""
    return to_si(value, u.dimensionless_unscaled, "tolerance", low=1e-13, high=LARGEST)


def comparison_tolerance(tolerance: float) -> float:
    """Tolerance of the run that measures the error: `LOOSER` times larger, or smaller where that is not allowed."""
    return LOOSER * tolerance if LOOSER * tolerance <= LARGEST else tolerance / LOOSER


def axis_ratio(value: object) -> float:
    """The largest axis ratio, checked; infinite for no limit."""
    ratio = float(value) if isinstance(value, int | float | np.number) else np.nan
    if not ratio > 1.0:
        raise InvalidInput("max_axis_ratio", value, "a number above 1")
    return ratio


class RowInputs(NamedTuple):
    """Records of bodies and encounters: the rows to compute, and the first arguments of `verdict_rows`."""

    rows: NDArray[np.int64]
    bodies: NDArray[np.void]
    encounters: Encounters


class FlybyRun(NamedTuple):
    """Result of :func:`flybystab.core.dynamics.verdict_row.verdict_row` for a body, in SI units."""

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


def flyby_run(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    tolerance: float,
    max_axis_ratio: float,
    keep: int,
    required: bool,
    inputs: RowInputs | None = None,
) -> FlybyRun:
    """Follow a body through an encounter and classify the outcome.

    `rotation` takes body axes to the frame of the encounter; `inputs` is `one_row` of the three, if it has been
    computed already.
    """
    output = output_buffers(1, keep)
    if inputs is None:
        inputs = one_row(body, encounter, rotation)
    verdict_rows(*inputs, Limits(tolerance, float(max_axis_ratio), MAX_STEPS), required, output)
    out, log = output.outcomes[0], output.log
    rows = log.history[: log.counts[0]["rows"]]
    return FlybyRun(
        verdict_of(int(out["verdict"]), float(out["bound_fraction"])) or Verdict.INTACT,
        float(out["bound_fraction"]),
        out["axes"],
        out["spin"],
        float(out["friction"]),
        float(out["friction_time"]),
        float(out["spin_ratio"]),
        float(out["pole_change"]),
        float(out["lacking"]),
        float(out["time"]),
        REGIMES[out["regime"]],
        output.shape,
        output.gradient,
        event_log(log),
        unpacked_history(rows, body.axes, body.rho) if keep > 1 else None,
        failure_of(out, encounter, tolerance),
    )


def output_buffers(n: int, keep: int) -> Output:
    """Buffers for `n` outcomes, and the end state and record of a run with a history of `keep` rows."""
    return Output(np.empty(n, OUTCOME), np.empty((3, 3)), np.empty((3, 3)), new_log(keep, 64))


def one_row(body: Body, encounter: Encounter, rotation: Array | None = None) -> RowInputs:
    """Records of one body and its encounter; the identity rotation by default."""
    turn = np.eye(3) if rotation is None else rotation
    return RowInputs(np.zeros(1, dtype=np.int64), *records([body], turn[None], [encounter]))


def records(
    bodies: Sequence[Body], rotations: Array, encounters: Sequence[Encounter]
) -> tuple[NDArray[np.void], Encounters]:
    """Records of bodies and encounters; the same encounter is stored once."""
    met = {id(e): e for e in encounters}
    place = {key: k for k, key in enumerate(met)}
    materials = [b.material for b in bodies]
    rows = np.empty(len(bodies), BODY)
    rows["axes"] = [b.axes for b in bodies]
    rows["rho"] = [b.rho for b in bodies]
    rows["omega"] = [b.omega for b in bodies]
    rows["attitude"] = rotations
    rows["phi"] = [m.phi for m in materials]
    rows["cohesion"] = [m.c_pa for m in materials]
    rows["dilatancy"] = [m.dilatancy for m in materials]
    rows["surface"] = [m.surface_code for m in materials]
    rows["brittle"] = [m.brittle for m in materials]
    rows["encounter"] = [place[id(e)] for e in encounters]
    return rows, encounter_records(list(met.values()), max(float(b.axes[0]) for b in bodies))


def body_rows(
    axes: Array,
    rho: Array,
    omega: Array,
    attitude: Array,
    phi: Array,
    cohesion: Array,
    material: Material,
    encounter: NDArray[np.int64] | int = 0,
) -> NDArray[np.void]:
    """Records of n bodies (BODY) from arrays in SI units.

    Parameters
    ----------
    axes, omega : ndarray (n, 3)
        Semi-axes, longest first, m; angular velocities along them, rad/s.
    rho, phi, cohesion : ndarray (n,)
        kg/m3, rad, Pa.
    attitude : ndarray (n, 3, 3)
        Body axes -> frame of the encounter.
    material : Material
        Yield surface, dilatancy and brittleness.
    encounter : ndarray (n,) or int
        Numbers of the encounters.
    """
    rows = np.empty(len(axes), BODY)
    rows["axes"], rows["rho"], rows["omega"], rows["attitude"] = axes, rho, omega, attitude
    rows["phi"], rows["cohesion"], rows["encounter"] = phi, cohesion, encounter
    rows["dilatancy"], rows["surface"], rows["brittle"] = (
        material.dilatancy, material.surface_code, material.brittle,
    )  # fmt: skip
    return rows


def encounter_records(met: Sequence[Encounter], longest: float) -> Encounters:
    """Records of encounters of bodies with semi-axes up to `longest` (m)."""
    grounds = [ground_near(e, longest) for e in met]
    first_tide, tides = _joined([e.tide.coefficients for e in met])
    first_ground, positions = _joined([g.coefficients for g in grounds])
    rows = np.empty(len(met), ENCOUNTER)
    for k, (row, e, ground) in enumerate(zip(rows, met, grounds, strict=True)):
        row["start"], row["rest"], row["stop"] = span_of(e)
        t = e.tide
        row["tide"] = (t.tau, t.start, t.width, first_tide[k], first_tide[k + 1])
        row["ground"] = (ground.tau, ground.start, ground.width, first_ground[k], first_ground[k + 1])
        row["floor"], row["least"] = ground.floor, ground.least
    return Encounters(rows, tides, positions)


def _joined(series: Sequence[Array]) -> tuple[NDArray[np.int64], Array]:
    """Offsets of the series in one joined array, and the array; series of lower degree are padded with zeros."""
    first = np.concatenate([[0], np.cumsum([len(s) for s in series])]).astype(np.int64)
    out = np.zeros((first[-1], max(s.shape[1] for s in series), series[0].shape[2]))
    for s, k in zip(series, first, strict=False):
        out[k : k + len(s), : s.shape[1]] = s
    return first, out


def ground_near(encounter: Encounter, longest: float) -> Ground:
    """The ground along an encounter, for bodies with a long semi-axis (m); none where they stay well above it."""
    return encounter.ground if encounter.height <= NEAR_GROUND * longest else no_ground()


def span_of(encounter: Encounter) -> Array:
    """Start, rest and stop of a run, s, clock of the tide."""
    stop, limit = encounter.t_stop, encounter.t_stop + TAIL
    if encounter.impact_time is not None:  # a body of any size has touched the ground by then
        stop = limit = max(encounter.impact_time, encounter.t_start)
    return np.array([encounter.t_start, stop, limit], dtype=float)


def failure_of(out: np.void, encounter: Encounter, tolerance: float) -> str:
    """Reason that an outcome has no verdict; empty if it has one."""
    if out["verdict"] != FAILED:
        return ""
    return (
        f"the integration stopped {out['time'] - encounter.t_start:.1f} s after the start in the "
        f"{REGIMES[out['regime']]} regime after {out['steps']:.0f} steps "
        f"(tolerance {tolerance:g})"
    )
