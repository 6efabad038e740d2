"""Many bodies through many encounters, row by row in compiled code."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body, check_settled
from flybystab.core.dynamics.lane_rows import lane_rows
from flybystab.core.dynamics.verdict_row import OUTCOME, YIELDS, Encounters
from flybystab.core.dynamics.workspace import Limits
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.core.verdict_codes import FAILED
from flybystab.encounter.attitude import attitude_matrices
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotModelled, UnsettledBody
from flybystab.flybys.batch import (
    MAX_STEPS,
    SIDE_BY_SIDE,
    TOLERANCE,
    axis_ratio,
    encounter_records,
    failure_of,
    output_buffers,
    records,
    side_by_side,
    step_tolerance,
    verdict_rows,
)
from flybystab.flybys.rigid_course import check_tension
from flybystab.flybys.table import FlybyTable
from flybystab.flybys.verdict import Verdict, verdict_of
from flybystab.progress import Progressing, progress_bar
from flybystab.typing import Array

T = TypeVar("T")


def flyby_many(
    bodies: Sequence[Body],
    encounters: Sequence[Encounter],
    attitudes: Sequence[object] | None = None,
    *,
    tolerance: float = TOLERANCE,
    max_axis_ratio: float = 6.0,
    workers: int | None = None,
    progress: Progressing = None,
) -> FlybyTable:
    """Follow bodies through encounters, one for each row, on all cores.

    Parameters
    ----------
    bodies, encounters : sequences of equal length n; either may be a single one
        An array of encounters (:meth:`Encounter.hyperbolic` of arrays) is taken row by row.
    attitudes : sequence of n rotations, or one, optional
        As in :func:`flyby`; identity by default.
    tolerance, max_axis_ratio
        As in :func:`flyby`.
    workers : int, optional
        Number of threads, one for each core by default; no result depends on it.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    FlybyTable

    Raises
    ------
    InvalidInput
        If the lengths differ, an argument is not a body or an encounter, the tolerance is outside [1e-13, 1e-3], or
        `workers` is not a positive whole number. An invalid attitude or an unsettled body only fails its own row.
    """
    bodies, encounters, attitudes = _broadcast(bodies, encounters, attitudes)
    n = len(bodies)
    if len(encounters) != n or (attitudes is not None and len(attitudes) != n):
        raise InvalidInput("encounters", len(encounters), f"as many encounters and attitudes as bodies, {n}")
    tolerance, max_axis_ratio = step_tolerance(tolerance), axis_ratio(max_axis_ratio)
    threads = worker_count(workers)
    rotations, failures = attitude_matrices(attitudes, n)
    if n:
        frames = {id(e): e.periapsis_axes.T for e in encounters}
        rotations = np.stack([frames[id(e)] for e in encounters]) @ rotations
    for i in (k for k, b in enumerate(bodies) if b.state != "rigid" and not failures[k]):
        try:
            check_settled(bodies[i])
        except UnsettledBody as reason:
            failures[i] = str(reason)
    for i in (k for k, b in enumerate(bodies) if b.material.cut_off and not failures[k]):
        try:
            check_tension(bodies[i], encounters[i], None if attitudes is None else attitudes[i])
        except NotModelled as reason:
            failures[i] = str(reason)
    if not n:
        return _table(np.empty(0, OUTCOME), np.zeros(0), [], failures, tolerance)
    rows, met = records(bodies, rotations, encounters)
    out = _outcomes(rows, met, np.flatnonzero(failures == ""), tolerance, max_axis_ratio, threads, progress)
    return _table(out, rows["phi"], encounters, failures, tolerance)


def follow_rows(
    rows: NDArray[np.void],
    encounters: Sequence[Encounter],
    *,
    tolerance: float = TOLERANCE,
    workers: int | None = None,
    progress: Progressing = None,
) -> FlybyTable:
    """`flyby_many` for bodies that exist as records only (:func:`flybystab.flybys.batch.body_rows`).

    Parameters
    ----------
    rows : ndarray of BODY (n,)
        Attitudes in the frame of the encounter. The bodies are settled and without a tension cut-off.
    encounters : sequence of Encounter
        Those that the rows refer to.
    tolerance, workers, progress
        As in :func:`flyby_many`.
    """
    tolerance, threads = step_tolerance(tolerance), worker_count(workers)
    failures = np.full(len(rows), "", dtype=object)
    if not len(rows):
        return _table(np.empty(0, OUTCOME), np.zeros(0), [], failures, tolerance)
    met = encounter_records(encounters, float(rows["axes"].max()))
    out = _outcomes(rows, met, np.arange(len(rows)), tolerance, 6.0, threads, progress)
    return _table(out, rows["phi"], [encounters[k] for k in rows["encounter"]], failures, tolerance)


def _outcomes(
    bodies: NDArray[np.void],
    encounters: Encounters,
    rows: NDArray[np.int64],
    tolerance: float,
    max_axis_ratio: float,
    threads: int,
    progress: Progressing,
) -> NDArray[np.void]:
    """Outcomes (OUTCOME) of the bodies in `rows`; the others are marked as not computed.

    Many bodies are first followed up to yield side by side, in half the time and with the same outcomes bit for bit.
    """
    out = np.empty(len(bodies), OUTCOME)
    _fail(out)
    limits = Limits(tolerance, max_axis_ratio, MAX_STEPS)

    def together(indices: NDArray[np.int64]) -> None:
        lane_rows(indices, bodies, encounters, limits, out)

    def singly(indices: NDArray[np.int64]) -> None:
        output = output_buffers(0, 0)._replace(outcomes=out)
        verdict_rows(indices, bodies, encounters, limits, True, output)

    with progress_bar(progress, len(rows), "flybys") as tick:
        first = side_by_side(rows, bodies, encounters)
        done = 0
        for part in _in_parts(together, first, threads, SIDE_BY_SIDE):
            done += int(np.count_nonzero(out["verdict"][part] != YIELDS))
            tick(done)
        rigid = first[out["verdict"][first] != YIELDS]
        for part in _in_parts(singly, np.setdiff1d(rows, rigid), threads, 1):
            done += len(part)
            tick(done)
    return out


def _in_parts(
    work: Callable[[NDArray[np.int64]], None], rows: NDArray[np.int64], threads: int, least: int
) -> Iterator[NDArray[np.int64]]:
    """Call `work` with parts of at least `least` rows, in several threads; yields the parts that are done, in order."""
    # Rows that flow take longer: more parts than threads.
    parts = 1 if threads == 1 else max(1, min(len(rows) // least, 16 * threads))
    pieces = [rows[k::parts].copy() for k in range(parts)] if len(rows) else []
    for piece, _ in zip(pieces, in_order(work, pieces, threads), strict=True):
        yield piece


def _table(
    out: NDArray[np.void],
    phi: Array,
    encounters: Sequence[Encounter],
    failures: NDArray[np.object_],
    tolerance: float,
) -> FlybyTable:
    """The outcomes as a table; completes the reasons of failures."""
    found = [verdict_of(int(row["verdict"]), row["bound_fraction"]) for row in out]
    names = np.array(["FAILED" if v is None else str(v) for v in found], dtype="U20")
    for lost in map(int, np.flatnonzero(names == "FAILED")):
        if not failures[lost]:
            failures[lost] = failure_of(out[lost], encounters[lost], tolerance)
        _fail(out[lost])
    paths = np.array(["path" if e.impact else "body" for e in encounters], dtype="U4")
    return FlybyTable(
        verdict=names,
        bound_fraction=out["bound_fraction"],
        semi_axes=out["axes"] * u.m,
        spin=np.array([np.linalg.norm(w) for w in out["spin"]]) * u.rad / u.s,
        max_required_friction_angle=np.rad2deg(out["friction"]) * u.deg,
        margin=np.rad2deg(phi - out["friction"]) * u.deg,
        spin_ratio=out["spin_ratio"],
        pole_change=np.rad2deg(out["pole_change"]) * u.deg,
        contact=np.where(names == Verdict.IMPACT, paths, ""),
        failure=failures.astype(str),
    )


def _fail(rows: NDArray[np.void] | np.void) -> None:
    """Mark outcomes as not computed."""
    for name in OUTCOME.names or ():
        rows[name] = FAILED if OUTCOME[name].kind == "i" else np.nan


def _broadcast(
    bodies: object, encounters: object, attitudes: object
) -> tuple[list[Body], list[Encounter], list[object] | None]:
    """The arguments as lists; a single body, encounter or rotation is used for all rows."""
    if hasattr(attitudes, "as_matrix"):  # a scipy Rotation, of one or of many
        attitudes = attitudes.as_matrix()
    one_attitude = isinstance(attitudes, np.ndarray) and attitudes.shape == (3, 3)
    first = [bodies] if isinstance(bodies, Body) else _all(Body, bodies, "bodies")
    second = [encounters] if isinstance(encounters, Encounter) else _all(Encounter, encounters, "encounters")
    third = [attitudes] if attitudes is None or one_attitude else _all(object, attitudes, "attitudes")
    single = isinstance(bodies, Body), isinstance(encounters, Encounter), attitudes is None or one_attitude
    lengths = len(first), len(second), len(third)
    n = next((length for length, one in zip(lengths, single, strict=True) if not one), 1)
    first, second = first * n if single[0] else first, second * n if single[1] else second
    if attitudes is None:
        return first, second, None
    return first, second, third * n if single[2] else third


def _all(kind: type[T], values: object, name: str) -> list[T]:
    """The values as a list; an error names the first that is not of the kind."""
    try:
        if not isinstance(values, Iterable):
            raise TypeError
        out = list(values.ravel() if isinstance(values, np.ndarray) and values.dtype == object else values)
    except TypeError:
        raise InvalidInput(name, values, "a sequence, one for each row") from None
    for i, value in enumerate(out):
        if not isinstance(value, kind):
            raise InvalidInput(f"{name}[{i}]", value, f"a flybystab {kind.__name__}")
    return out
