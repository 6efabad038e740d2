"""Where the wings meet: a body, an encounter, and what becomes of the body."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import DENSITY_RANGE, YIELD_SURFACES, Body, check_body
from flybystab.core.dynamics.run import REGIMES
from flybystab.core.ellipsoid.bound_mass import principal_axes
from flybystab.core.material.yield_surface import required_frictions
from flybystab.encounter.attitude import attitude_matrix, periapsis_axes
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, NotConverged
from flybystab.flybys.batch import TOLERANCE, Judged, axis_ratio, judged, step_tolerance
from flybystab.flybys.grains_flyby import SEEDS, handed_on, request
from flybystab.flybys.result import FlybyError, FlybyResult, History
from flybystab.flybys.verdict import letter_of

Array = NDArray[np.float64]
_Events = list[tuple[str, float, float]]

#: The looser run that measures the error allows this much more a step.
LOOSER = 30.0


def flyby(
    body: Body,
    encounter: Encounter,
    attitude: Any = None,
    *,
    tolerance: float = TOLERANCE,
    error: bool = True,
    history: bool = True,
    surfaces: str | Sequence[str] = (),
    max_axis_ratio: float = 6.0,
    grains: int | str | None = None,
    seeds: int | Sequence[int] = SEEDS,
    model: str | None = None,
) -> FlybyResult:
    """Carry a body through an encounter.

    Parameters
    ----------
    body : Body
    encounter : Encounter
        From :meth:`Encounter.hyperbolic` or :meth:`Encounter.from_orbit`.
    attitude : array_like (3, 3) or scipy Rotation, optional
        Rotation, body axes -> x periapsis, y motion at periapsis, z orbital angular momentum, at the start of
        the encounter; identity by default. See :func:`periapsis_axes` for attitudes given in ICRF.
    tolerance : float
        Relative error allowed in each integration step.
    error : bool
        Measure the error with a second, looser run.
    history : bool
        Keep the history.
    surfaces : str or sequence of str
        Other yield surfaces to run; the verdict is robust if they all agree.
    max_axis_ratio : float
        Axis ratio beyond which the homogeneous model is left.
    grains : int or "always", optional
        Number of grains of the piles that answer where the ellipsoid ends (beyond `max_axis_ratio`, with loss of
        mass, out of contact); ``"always"`` runs 500 grains whatever the ellipsoid says.
    seeds : int or sequence of int
        How many piles, or which; their outcomes are the distribution ``result.grains``.
    model : str, optional
        ``"grains"`` forces grains, ``"ellipsoid"`` excludes them.

    Returns
    -------
    FlybyResult

    Raises
    ------
    InvalidInput
        For an attitude that is no rotation, or a tolerance out of [1e-13, 1e-3].
    NotConverged
        If the integrator cannot go on; the message says where.
    """
    check_body(body)
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    tolerance, max_axis_ratio = step_tolerance(tolerance), axis_ratio(max_axis_ratio)
    asked = request(grains, seeds, model)
    rotation = periapsis_axes(encounter).T @ attitude_matrix(attitude)

    def carried(a_body: Body, tol: float, keep: int = 0, needs: bool = True) -> Judged:
        found = judged(a_body, encounter, rotation, tol, max_axis_ratio, keep, needs)
        if found.failure:
            raise NotConverged(found.failure)
        return found

    main = carried(body, tolerance, 20_000 if history else 0)
    verdicts = {body.material.yield_surface: main.verdict}
    for other in (surfaces,) if isinstance(surfaces, str) else surfaces:
        if other not in YIELD_SURFACES:
            raise InvalidInput("surfaces", other, f"names out of {YIELD_SURFACES}")
        if other not in verdicts:
            same = body.with_(material=body.material.with_(yield_surface=other))
            verdicts[other] = carried(same, tolerance, needs=False).verdict
    measured = None
    if error:
        loose = _compared(lambda tol: carried(body, tol), tolerance)
        difference = 0.0 if main.friction == loose.friction else abs(main.friction - loose.friction)
        measured = FlybyError(
            semi_axes=float(np.max(np.abs(loose.axes / main.axes - 1.0))),
            spin=_relative(loose.spin, main.spin),
            bound_fraction=abs(loose.bound - main.bound),
            required_friction_angle=np.rad2deg(difference) * u.deg,
            event_times=_event_difference(main.events, loose.events) * u.s,
            verdict_agrees=loose.verdict == main.verdict,
            tide=encounter.tide_error,
        )
    start = encounter.t_start
    onset = next((t for name, t, _ in main.events if name == "onset"), None)
    arrests = [t for name, t, _ in main.events if name in ("arrest", "jam")]
    lode = next((angle for name, _, angle in main.events if name == "onset"), None)
    result = FlybyResult(
        verdict=main.verdict,
        verdict_class=letter_of(main.verdict, main.bound),
        bound_fraction=main.bound,
        semi_axes=main.axes * u.m,
        spin=float(np.linalg.norm(main.spin)) * u.rad / u.s,
        spin_vector=main.spin * u.rad / u.s,
        onset_time=None if onset is None else (onset - start) * u.s,
        arrest_time=(arrests[-1] - start) * u.s if arrests else None,
        end_time=(main.time - start) * u.s,
        max_required_friction_angle=np.rad2deg(main.friction) * u.deg,
        max_required_friction_time=(main.friction_time - start) * u.s,
        margin=np.rad2deg(body.material.phi - main.friction) * u.deg,
        required_cohesion=main.lacking * u.Pa,
        lode_angle=None if lode is None else np.rad2deg(lode) * u.deg,
        spin_ratio=main.spin_ratio,
        pole_change=np.rad2deg(main.pole_change) * u.deg,
        error=measured,
        verdict_by_surface=verdicts,
        robust=None if len(verdicts) == 1 else len(set(verdicts.values())) == 1,
        events=tuple((name, (t - start) * u.s) for name, t, _ in main.events),
        body=_body_after(body, main, onset is not None),
        history=_history(main.history, encounter, body),
        modelled=(*encounter.forces, *_modelled(body)),
        left_out=encounter.left_out,
        encounter=encounter,
        rung="ellipsoid" if onset is not None else "rigid body",
    )
    return handed_on(result, body, encounter, rotation, asked)


def _compared(carried: Callable[[float], Judged], tolerance: float) -> Judged:
    """The run that measures the error: a looser one, or a tighter one where flow stalls the looser."""
    try:
        return carried(min(1e-3, tolerance * LOOSER))
    except NotConverged:
        return carried(max(1e-13, tolerance / LOOSER))


def _axes(shape: Array) -> Array:
    return np.sqrt(np.linalg.eigvalsh(shape)[..., ::-1])


def _spin(gradient: Array) -> Array:
    return 0.5 * np.stack(
        [
            gradient[..., 2, 1] - gradient[..., 1, 2],
            gradient[..., 0, 2] - gradient[..., 2, 0],
            gradient[..., 1, 0] - gradient[..., 0, 1],
        ],
        axis=-1,
    )


def _relative(a: Array, b: Array) -> float:
    norm = np.linalg.norm(b)
    return float(np.linalg.norm(a - b) / norm) if norm > 0.0 else float(np.linalg.norm(a))


def _event_difference(a: _Events, b: _Events) -> float:
    if [e[0] for e in a] != [e[0] for e in b]:
        return float("nan")
    return max((abs(x[1] - y[1]) for x, y in zip(a, b, strict=True)), default=0.0)


def _body_after(body: Body, found: Judged, yielded: bool) -> Body:
    axes, vectors = np.empty(3), np.empty((3, 3))
    principal_axes(found.shape, axes, vectors)
    vectors[:, 2] *= np.sign(np.linalg.det(vectors))
    material = body.material
    if yielded and material.brittle:
        material = material.with_(cohesion=0.0 * u.Pa)
    rho = float(body.rho * np.prod(body.axes) / np.prod(axes))
    return Body(
        semi_axes=axes * u.m,
        density=rho * u.kg / u.m**3,
        spin=vectors.T @ found.spin * u.rad / u.s,
        material=material,
        dispersed=not DENSITY_RANGE[0] <= rho <= DENSITY_RANGE[1],
    )


def _modelled(body: Body) -> tuple[str, ...]:
    m = body.material
    text = [
        "homogeneous ellipsoid, self-gravity",
        f"{m.yield_surface}, friction {np.rad2deg(m.phi):g} deg, cohesion {m.c_pa:g} Pa"
        + (" (brittle)" if m.brittle and m.c_pa > 0.0 else ""),
        "volume-preserving flow"
        if m.dilatancy == 0.0
        else "associative flow, its dilation fading out before V/V0 = 1.5"
        if m.dilatancy == 1.0
        else f"dilatancy {m.dilatancy:g} of the largest, fading out before V/V0 = 1.5",
    ]
    return tuple(text)


def _history(h: dict[str, Array] | None, encounter: Encounter, body: Body) -> History | None:
    if h is None:
        return None
    m = body.material
    required = required_frictions(m.surface_code, m.c_pa, h["deviator"], h["pressure"], h["determinant"])
    return History(
        time=(h["time"] - encounter.t_start) * u.s,
        time_from_periapsis=h["time"] * u.s,
        distance=(encounter.radius(h["time"]) * u.m).to(u.km),
        regime=np.array(REGIMES)[h["regime"]],
        semi_axes=_axes(h["shape"]) * u.m,
        spin=_spin(h["velocity_gradient"]) * u.rad / u.s,
        required_friction_angle=np.rad2deg(required) * u.deg,
        pressure=h["pressure"] * u.Pa,
        shape=h["shape"] * u.m**2,
        velocity_gradient=h["velocity_gradient"] / u.s,
    )
