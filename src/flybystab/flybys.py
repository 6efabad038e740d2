"""Where the wings meet: a body, an encounter, and what becomes of the body."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.aggregate.body import YIELD_SURFACES, Body
from flybystab.aggregate.equilibrium import stress_components
from flybystab.core.passage import REGIMES, Passage, passage
from flybystab.core.rheology import required_friction
from flybystab.core.statics import demand, overload
from flybystab.errors import FlybystabError, InvalidInput, NotConverged
from flybystab.flyby_results import FlybyError, FlybyResult, FlybyTable, History
from flybystab.outcome import Verdict, bound_fraction, classed
from flybystab.sky.encounter import TAIL, Encounter
from flybystab.units import to_si

Array = NDArray[np.float64]

#: Step tolerance by default: 1e-8 in the shape of the reference cases (``flybystab bench flyby``).
TOLERANCE = 1e-8

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
    surfaces: Sequence[str] = (),
    max_axis_ratio: float = 6.0,
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
    surfaces : sequence of str
        Other yield surfaces to run; the verdict is robust if they all agree.
    max_axis_ratio : float
        Axis ratio beyond which the homogeneous model is left.

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
    if not isinstance(body, Body):
        raise InvalidInput("body", body, "a flybystab.Body")
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    tolerance = to_si(tolerance, u.dimensionless_unscaled, "tolerance", low=1e-13, high=1e-3)
    max_axis_ratio = _axis_ratio(max_axis_ratio)
    rotation = periapsis_axes(encounter).T @ _rotation(attitude)

    def carried(tol: float, keep: int = 0) -> _Carried:
        return _carried(body, encounter, rotation, tol, max_axis_ratio, keep)

    main = carried(tolerance, 20_000 if history else 0)
    run = main.run
    verdicts = {body.material.yield_surface: main.verdict}
    for other in surfaces:
        if other not in YIELD_SURFACES:
            raise InvalidInput("surfaces", other, f"names out of {YIELD_SURFACES}")
        if other not in verdicts:
            same = body.with_(material=body.material.with_(yield_surface=other))
            same_run, holds = _run(same, encounter, rotation, tolerance, max_axis_ratio), _on_its_own(same)[0]
            verdicts[other] = _verdict(same_run, encounter, same, holds)[0]
    measured = None
    if error:
        loose = _compared(carried, tolerance)
        difference = 0.0 if main.friction == loose.friction else abs(main.friction - loose.friction)
        measured = FlybyError(
            semi_axes=float(np.max(np.abs(_axes(loose.run.shape) / _axes(run.shape) - 1.0))),
            spin=_relative(_spin(loose.run.velocity_gradient), _spin(run.velocity_gradient)),
            bound_fraction=abs(loose.bound - main.bound),
            required_friction_angle=np.rad2deg(difference) * u.deg,
            event_times=_event_difference(run, loose.run) * u.s,
            verdict_agrees=loose.verdict == main.verdict,
            tide=encounter.tide_error,
        )
    start = encounter.t_start
    onset = next((t for name, t, _ in run.events if name == "onset"), None)
    arrests = [t for name, t, _ in run.events if name in ("arrest", "jam")]
    lode = next((angle for name, _, angle in run.events if name == "onset"), None)
    spin_ratio, pole_change = _spin_change(body, rotation, run)
    return FlybyResult(
        verdict=main.verdict,
        verdict_class=main.letter,
        bound_fraction=main.bound,
        semi_axes=_axes(run.shape) * u.m,
        spin=float(np.linalg.norm(_spin(run.velocity_gradient))) * u.rad / u.s,
        spin_vector=_spin(run.velocity_gradient) * u.rad / u.s,
        onset_time=None if onset is None else (onset - start) * u.s,
        arrest_time=(arrests[-1] - start) * u.s if arrests else None,
        end_time=(run.time - start) * u.s,
        max_required_friction_angle=np.rad2deg(main.friction) * u.deg,
        max_required_friction_time=(main.friction_time - start) * u.s,
        margin=np.rad2deg(body.material.phi - main.friction) * u.deg,
        required_cohesion=main.cohesion * u.Pa,
        lode_angle=None if lode is None else np.rad2deg(lode) * u.deg,
        spin_ratio=spin_ratio,
        pole_change=pole_change * u.deg,
        error=measured,
        verdict_by_surface=verdicts,
        robust=None if len(verdicts) == 1 else len(set(verdicts.values())) == 1,
        events=tuple((name, (t - start) * u.s) for name, t, _ in run.events),
        body=_body_after(body, run, onset is not None),
        history=_history(run, encounter, body) if history else None,
        modelled=(*encounter.forces, *_modelled(body)),
        left_out=encounter.left_out,
        encounter=encounter,
    )


def _axis_ratio(value: Any) -> float:
    """The largest axis ratio, checked; infinite for no limit."""
    ratio = float(value) if isinstance(value, int | float | np.number) else np.nan
    if not ratio > 1.0:
        raise InvalidInput("max_axis_ratio", value, "a number above 1")
    return ratio


def _compared(carried: Callable[[float], _Carried], tolerance: float) -> _Carried:
    """The run that measures the error: a looser one, or a tighter one where flow stalls the looser."""
    try:
        return carried(min(1e-3, tolerance * LOOSER))
    except NotConverged:
        return carried(max(1e-13, tolerance / LOOSER))


class _Carried(NamedTuple):
    """A run with its verdict and the friction that the body would need to stay rigid throughout."""

    run: Passage
    verdict: Verdict
    letter: str | None
    bound: float
    friction: float  # rad
    friction_time: float  # s, clock of the tide
    cohesion: float  # Pa; what a body that cannot exist on its own lacks, else zero


def _carried(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    tolerance: float,
    max_axis_ratio: float,
    keep: int = 0,
) -> _Carried:
    """Carry a body through an encounter and judge it; `rotation` takes body axes to the encounter's frame."""
    holds, cohesion = _on_its_own(body)
    # A body that cannot exist on its own is not carried on: its demand at the start is the answer.
    run = _run(body, encounter, rotation, tolerance, max_axis_ratio, keep, unyielding=not holds)
    needs = run
    if any(name == "onset" for name, _, _ in run.events):
        needs = _run(body, encounter, rotation, tolerance, max_axis_ratio, unyielding=True)
    lacks = 0.0 if holds else cohesion
    return _Carried(
        run, *_verdict(run, encounter, body, holds), needs.max_friction, needs.max_friction_time, lacks
    )


def _run(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    tolerance: float,
    max_axis_ratio: float,
    keep: int = 0,
    unyielding: bool = False,
) -> Passage:
    """One run of the dynamics; `rotation` takes body axes to the frame of the encounter."""
    stop, limit = encounter.t_stop, encounter.t_stop + TAIL
    if encounter.impact and encounter.impact_time is not None:
        stop = limit = max(encounter.impact_time, encounter.t_start)
    material = body.material
    result = passage(
        body.axes,
        body.rho,
        body.omega,
        rotation,
        encounter.t_start,
        limit,
        encounter.tide,
        t_rest=stop,
        phi=material.phi,
        cohesion=material.c_pa,
        dilatancy=material.dilatancy,
        surface=material.surface_code,
        brittle=material.brittle,
        unyielding=unyielding,
        tolerance=tolerance,
        max_axis_ratio=max(max_axis_ratio, 1.001 * body.axes[0] / body.axes[2]),
        keep=keep,
    )
    if result.reason == "stuck":
        raise NotConverged(
            f"the integration stopped {result.time - encounter.t_start:.1f} s after the start in the "
            f"{result.regime} regime after {result.steps} steps (tolerance {tolerance:g})"
        )
    return result


def flyby_many(
    bodies: Sequence[Body],
    encounters: Sequence[Encounter],
    attitudes: Sequence[Any] | None = None,
    *,
    tolerance: float = TOLERANCE,
    max_axis_ratio: float = 6.0,
    workers: int | None = None,
) -> FlybyTable:
    """Carry bodies through encounters, row by row, on all cores.

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
        If the lengths differ.
    """
    n = len(bodies)
    if len(encounters) != n or (attitudes is not None and len(attitudes) != n):
        raise InvalidInput("encounters", len(encounters), f"as many encounters and attitudes as bodies, {n}")
    columns = np.full((n, 8), np.nan)
    verdicts = np.full(n, "FAILED", dtype="U20")
    failures = np.full(n, "", dtype=object)

    def rows(indices: range) -> None:
        for i in indices:
            try:
                verdicts[i], columns[i] = _row(
                    bodies[i],
                    encounters[i],
                    None if attitudes is None else attitudes[i],
                    tolerance,
                    max_axis_ratio,
                )
            except FlybystabError as reason:
                failures[i] = str(reason)

    threads = workers or os.cpu_count() or 1
    if threads == 1 or n == 1:
        rows(range(n))
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(rows, [range(k, n, 4 * threads) for k in range(4 * threads)]))
    return FlybyTable(
        verdict=verdicts,
        bound_fraction=columns[:, 0],
        semi_axes=columns[:, 1:4] * u.m,
        spin=columns[:, 4] * u.rad / u.s,
        max_required_friction_angle=columns[:, 5] * u.deg,
        margin=np.array([np.rad2deg(b.material.phi) for b in bodies]) * u.deg - columns[:, 5] * u.deg,
        spin_ratio=columns[:, 6],
        pole_change=columns[:, 7] * u.deg,
        failure=failures.astype(str),
    )


def _row(
    body: Body, encounter: Encounter, attitude: Any, tolerance: float, max_axis_ratio: float
) -> tuple[str, Array]:
    rotation = periapsis_axes(encounter).T @ _rotation(attitude)
    found = _carried(body, encounter, rotation, tolerance, max_axis_ratio)
    run = found.run
    ratio, turn = _spin_change(body, rotation, run)
    spin = float(np.linalg.norm(_spin(run.velocity_gradient)))
    values = [found.bound, *_axes(run.shape), spin, np.rad2deg(found.friction), ratio, turn]
    return str(found.verdict), np.array(values)


def periapsis_axes(encounter: Encounter) -> Array:
    """Rotation matrix, frame of the encounter -> periapsis frame (x periapsis, z angular momentum).

    An attitude ``A`` (body axes -> ICRF) of a real encounter is ``periapsis_axes(encounter) @ A`` to `flyby`.
    """
    return encounter.periapsis_axes


def _rotation(attitude: Any) -> Array:
    if attitude is None:
        return np.eye(3)
    matrix = attitude.as_matrix() if hasattr(attitude, "as_matrix") else attitude
    try:
        matrix = np.asarray(matrix, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput("attitude", attitude, "a rotation matrix or a scipy Rotation") from None
    if matrix.shape != (3, 3) or not np.all(np.isfinite(matrix)):
        raise InvalidInput("attitude", attitude, "a (3, 3) rotation matrix of finite numbers")
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-8 or np.linalg.det(matrix) < 0.0:
        raise InvalidInput("attitude", attitude, "a proper rotation: A A^T = 1, det A = +1")
    return matrix


def _on_its_own(body: Body) -> tuple[bool, float]:
    """Whether the body can exist far from any planet, and the cohesion (Pa) that it needs there."""
    stress = stress_components(body)
    m = body.material
    excess = overload(m.surface_code, m.phi, m.c_pa, stress)
    holds = excess <= 1e-12 * float(np.abs(stress).max())
    return holds, demand(m.surface_code, m.phi, m.c_pa, stress)[1]


def _verdict(
    run: Passage, encounter: Encounter, body: Body, holds: bool
) -> tuple[Verdict, str | None, float]:
    """Verdict, class and bound share of a run."""
    if not holds:
        return Verdict.NOT_IN_EQUILIBRIUM, None, 1.0
    bound = 1.0
    if run.regime != "rigid":
        volume = 4.0 / 3.0 * np.pi * np.sqrt(np.linalg.det(run.shape))
        bound = bound_fraction(run.shape, run.velocity_gradient, body.mass.value / volume)
    if encounter.impact:
        return Verdict.IMPACT, None, bound
    if run.reason == "beyond model":
        return Verdict.BEYOND_MODEL, None, bound
    if not any(name == "onset" for name, _, _ in run.events):
        return Verdict.INTACT, None, bound
    return *classed(bound), bound


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


def _cross(w: Array) -> Array:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def _momentum(shape: Array, gradient: Array) -> tuple[Array, float]:
    """Angular momentum per ``m/5``, and effective spin rate ``2 E/H`` of the rigid rotation with it."""
    flow = gradient @ shape
    h = 2.0 * _spin(flow)
    inertia = np.trace(shape) * np.eye(3) - shape
    omega = np.linalg.solve(inertia, h)
    norm = float(np.linalg.norm(h))
    return h, float(omega @ h) / norm if norm > 0.0 else 0.0


def _spin_change(body: Body, rotation: Array, run: Passage) -> tuple[float, float]:
    """Ratio of the effective spin rates and angle between the angular momenta (deg), after and before."""
    before, rate_before = _momentum(
        rotation @ np.diag(body.axes**2) @ rotation.T, _cross(rotation @ body.omega)
    )
    after, rate_after = _momentum(run.shape, run.velocity_gradient)
    return _ratio(rate_after, rate_before), _angle(before, after)


def _ratio(a: float, b: float) -> float:
    return a / b if b > 0.0 else np.inf if a > 0.0 else 1.0


def _angle(a: Array, b: Array) -> float:
    """Angle between two vectors, deg; nan if one vanishes."""
    if not (np.any(a) and np.any(b)):
        return float("nan")
    return float(np.rad2deg(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _relative(a: Array, b: Array) -> float:
    norm = np.linalg.norm(b)
    return float(np.linalg.norm(a - b) / norm) if norm > 0.0 else float(np.linalg.norm(a))


def _event_difference(a: Passage, b: Passage) -> float:
    if [e[0] for e in a.events] != [e[0] for e in b.events]:
        return float("nan")
    return max((abs(x[1] - y[1]) for x, y in zip(a.events, b.events, strict=True)), default=0.0)


def _body_after(body: Body, run: Passage, yielded: bool) -> Body:
    values, vectors = np.linalg.eigh(run.shape)
    vectors = vectors[:, ::-1]
    vectors[:, 2] *= np.sign(np.linalg.det(vectors))
    axes = np.sqrt(values[::-1])
    material = body.material
    if yielded and material.brittle:
        material = material.with_(cohesion=0.0 * u.Pa)
    return Body(
        semi_axes=axes * u.m,
        density=body.rho * np.prod(body.axes) / np.prod(axes) * u.kg / u.m**3,
        spin=vectors.T @ _spin(run.velocity_gradient) * u.rad / u.s,
        material=material,
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


def _history(run: Passage, encounter: Encounter, body: Body) -> History | None:
    h = run.history
    if h is None:
        return None
    m = body.material
    required = np.array(
        [
            required_friction(m.surface_code, m.c_pa, s, p, d)
            for s, p, d in zip(h["deviator"], h["pressure"], h["determinant"], strict=True)
        ]
    )
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
