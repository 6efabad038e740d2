"""Many bodies through many encounters, row by row in compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body, check_settled
from flybystab.core.dynamics import verdict_row as judgement
from flybystab.core.numerics.threads import in_order, worker_count
from flybystab.encounter.attitude import attitude_matrices
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, UnsettledBody
from flybystab.flybys.batch import (
    MAX_STEPS,
    TOLERANCE,
    axis_ratio,
    buffers,
    columns,
    failure_of,
    judge_rows,
    step_tolerance,
)
from flybystab.flybys.table import FlybyTable
from flybystab.flybys.verdict import Verdict, verdict_of

T = TypeVar("T")


def flyby_many(
    bodies: Sequence[Body],
    encounters: Sequence[Encounter],
    attitudes: Sequence[Any] | None = None,
    *,
    tolerance: float = TOLERANCE,
    max_axis_ratio: float = 6.0,
    workers: int | None = None,
) -> FlybyTable:
    """Follow bodies through encounters, one for each row, on all cores.

    Parameters
    ----------
    bodies, encounters : sequences of equal length n
    attitudes : sequence of rotations, optional
        As in :func:`flyby`; identity by default.
    tolerance, max_axis_ratio
        As in :func:`flyby`.
    workers : int, optional
        Threads (kernels release the interpreter lock), one a core by default; no result depends on it.

    Returns
    -------
    FlybyTable

    Raises
    ------
    InvalidInput
        If the lengths differ, for anything but bodies and encounters, a tolerance outside [1e-13, 1e-3], or
        `workers` that is not a positive whole number. An invalid attitude or an unsettled body only fails its own row.
    """
    bodies, encounters = _all(Body, bodies, "bodies"), _all(Encounter, encounters, "encounters")
    attitudes = None if attitudes is None else _all(object, attitudes, "attitudes")
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
    rows = np.flatnonzero(failures == "")
    phi = np.array([b.material.phi for b in bodies], dtype=float)
    out = np.full((n, judgement.N_ANSWER), np.nan)
    out[:, judgement.VERDICT] = judgement.FAILED
    inputs = columns(bodies, rotations, encounters) if n else ()

    def part(indices: NDArray[np.int64]) -> None:
        judge_rows(indices, *inputs, tolerance, max_axis_ratio, MAX_STEPS, True, *buffers(0), out)

    if threads == 1 or len(rows) < 2:
        if len(rows):
            part(rows)
    else:  # rows that flow take longer: more parts than threads
        parts = min(len(rows), 16 * threads)
        list(in_order(part, [rows[k::parts].copy() for k in range(parts)], threads))
    found = [verdict_of(int(row[judgement.VERDICT]), row[judgement.BOUND]) for row in out]
    names = np.array(["FAILED" if v is None else str(v) for v in found], dtype="U20")
    for lost in map(int, np.flatnonzero(names == "FAILED")):
        if not failures[lost]:
            failures[lost] = failure_of(out[lost], encounters[lost], tolerance)
        out[lost] = np.nan
    paths = np.array(["path" if e.impact else "body" for e in encounters], dtype="U4")
    axes, spin = out[:, judgement.AXES : judgement.AXES + 3], out[:, judgement.SPIN : judgement.SPIN + 3]
    return FlybyTable(
        verdict=names,
        bound_fraction=out[:, judgement.BOUND],
        semi_axes=axes * u.m,
        spin=np.array([np.linalg.norm(w) for w in spin]) * u.rad / u.s,
        max_required_friction_angle=np.rad2deg(out[:, judgement.FRICTION]) * u.deg,
        margin=np.rad2deg(phi - out[:, judgement.FRICTION]) * u.deg,
        spin_ratio=out[:, judgement.SPIN_RATIO],
        pole_change=np.rad2deg(out[:, judgement.POLE_CHANGE]) * u.deg,
        contact=np.where(names == Verdict.IMPACT, paths, ""),
        failure=failures.astype(str),
    )


def _all(kind: type[T], values: Any, name: str) -> list[T]:
    """The values as a list; an error names the first that is not of the kind."""
    try:
        out = list(values)
    except TypeError:
        raise InvalidInput(name, values, "a sequence, one for each row") from None
    for i, value in enumerate(out):
        if not isinstance(value, kind):
            raise InvalidInput(f"{name}[{i}]", value, f"a flybystab {kind.__name__}")
    return out
