"""Follow a body through an encounter."""

from __future__ import annotations

from collections.abc import Sequence

from flybystab.body.body import YIELD_SURFACES, Body, check_settled
from flybystab.body.pile import Pile
from flybystab.encounter.attitude import attitude_matrix
from flybystab.encounter.attitude_at_periapsis import attitude_at_start
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotConverged
from flybystab.flybys.batch import (
    LOOSER,
    TOLERANCE,
    FlybyRun,
    RowInputs,
    axis_ratio,
    comparison_tolerance,
    one_row,
    step_tolerance,
)
from flybystab.flybys.escalation import escalated, request
from flybystab.flybys.inputs import FlybyInputs
from flybystab.flybys.result import FlybyResult
from flybystab.flybys.rigid_course import check_tension
from flybystab.flybys.robustness import phases_of, robustness_of
from flybystab.progress import Progressing

#: Rows of history kept at most.
ROWS = 20_000


def flyby(
    body: Body | Pile,
    encounter: Encounter,
    attitude: object = None,
    *,
    tolerance: float = TOLERANCE,
    error: bool = True,
    history: bool = True,
    surfaces: str | Sequence[str] = (),
    max_axis_ratio: float = 6.0,
    robustness: bool | int = False,
    grains: int | str | None = None,
    seeds: int | Sequence[int] | None = None,
    model: str | None = None,
    attitude_at: str = "start",
    progress: Progressing = None,
) -> FlybyResult:
    """Follow a body through an encounter.

    Parameters
    ----------
    body : Body or Pile
        A pile of grains is always simulated as grains.
    encounter : Encounter
        From :meth:`Encounter.hyperbolic` or :meth:`Encounter.from_orbit`.
    attitude : array_like (3, 3) or scipy Rotation, optional
        Rotation, body axes -> x periapsis, y motion at periapsis, z orbital angular momentum, at the start of
        the encounter; identity by default. See :func:`periapsis_axes` for attitudes given in ICRF.
    tolerance : float
        Relative error allowed in each integration step.
    error : bool
        Measure the error with a second run, at a tolerance 30 times larger, or 30 times smaller from 3e-5 on.
    history : bool
        Keep the history.
    surfaces : str or sequence of str
        Further yield surfaces; the verdict is robust if they all agree. By default the result has the verdicts on all
        four for a body that stays rigid, at negligible cost.
    max_axis_ratio : float
        Axis ratio beyond which the homogeneous model does not apply.
    robustness : bool or int
        Number of spin phases (True: 8) at which the encounter is repeated; it is also repeated with a friction angle 3
        deg larger and smaller and on all yield surfaces: ``result.robustness``.
    grains : int or "always", optional
        Number of grains of the piles that are simulated where the ellipsoid is not applicable (beyond `max_axis_ratio`,
        with loss of mass, out of contact); ``"always"`` runs 500 grains in any case.
    seeds : int or sequence of int
        Number of piles, or their seeds; their outcomes are the distribution ``result.grains``. 8 by default for a body.
        For a pile, its own seed by default, or that many seeds starting with its own.
    model : str, optional
        ``"grains"`` forces grains, ``"ellipsoid"`` excludes them.
    attitude_at : str
        ``"start"``: `attitude` is that at the start of the encounter; ``"periapsis"``: that which the freely rotating
        body would have at closest approach (:func:`attitude_at_start`).
    progress : bool or function, optional
        Of grains: whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    FlybyResult

    Raises
    ------
    InvalidInput
        For an attitude that is not a rotation, or a tolerance outside [1e-13, 1e-3].
    UnsettledBody
        For the body of an earlier result that was still flowing, dispersed, partly unbound or on the ground.
    NotModelled
        For a body with a tension cut-off that yields.
    NotConverged
        If the integration fails; the message gives the time.
    """
    pile = body if isinstance(body, Pile) else None
    body = body.body if isinstance(body, Pile) else body
    check_settled(body)
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    if not isinstance(surfaces, str | Sequence):
        raise InvalidInput("surfaces", surfaces, "a name or a sequence of names")
    for name, value in (("error", error), ("history", history)):
        if not isinstance(value, bool):
            raise InvalidInput(name, value, "True or False")
    tolerance, max_axis_ratio = step_tolerance(tolerance), axis_ratio(max_axis_ratio)
    asked, phases = request(grains, seeds, model, pile), phases_of(robustness)
    if attitude_at not in ("start", "periapsis"):
        raise InvalidInput("attitude_at", attitude_at, '"start" or "periapsis"')
    if attitude_at == "periapsis":
        attitude = attitude_at_start(body, encounter, attitude)
    rotation = encounter.periapsis_axes.T @ attitude_matrix(attitude)
    check_tension(body, encounter, attitude)
    inputs = FlybyInputs(body, encounter, rotation, tolerance, max_axis_ratio)
    row = one_row(body, encounter, rotation)
    run = inputs.run(keep=ROWS if history else 0, required=True, row=row)
    comparison = _comparison(inputs, row) if error else None
    verdicts = {body.material.yield_surface: run.verdict} if len(surfaces) else {}
    for other in (surfaces,) if isinstance(surfaces, str) else surfaces:
        if other not in YIELD_SURFACES:
            raise InvalidInput("surfaces", other, f"names out of {YIELD_SURFACES}")
        if other not in verdicts:
            same = body.with_(material=body.material.with_(yield_surface=other))
            verdicts[other] = inputs._replace(body=same).run().verdict
    result = FlybyResult(inputs, run, comparison, verdicts)
    if phases:
        result = result.with_(robustness=robustness_of(inputs, run, phases))
    return escalated(result, body, encounter, rotation, asked, pile, progress)


def _comparison(inputs: FlybyInputs, row: RowInputs) -> FlybyRun:
    """The run that measures the error; with a smaller tolerance where the larger one does not converge."""
    tolerance = inputs.tolerance
    try:
        return inputs._replace(tolerance=comparison_tolerance(tolerance)).run(required=True, row=row)
    except NotConverged:
        return inputs._replace(tolerance=max(1e-13, tolerance / LOOSER)).run(required=True, row=row)
