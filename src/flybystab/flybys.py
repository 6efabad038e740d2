"""Where the wings meet: a body, an encounter, and what becomes of the body."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.aggregate.body import YIELD_SURFACES, Body
from flybystab.constants import G
from flybystab.core.ellipsoid import gravity_coefficients
from flybystab.core.motion import rigid_stress_components
from flybystab.core.passage import Passage, passage
from flybystab.core.rheology import required_friction
from flybystab.core.statics import demand, overload
from flybystab.errors import FlybystabError, InvalidInput, NotConverged
from flybystab.outcome import Verdict, bound_fraction, classed
from flybystab.sky.encounter import TAIL, Encounter

Array = NDArray[np.float64]

#: Step tolerance by default: 1e-8 in the shape of the reference cases (``flybystab bench flyby``).
TOLERANCE = 1e-8

#: The looser run that measures the error allows this much more a step.
LOOSER = 30.0


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


@dataclass(frozen=True)
class FlybyError:
    """Measured error of a result: its difference from a run with a 30 times larger step tolerance.

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
        Share of the mass still bound (an upper bound, see :func:`flybystab.outcome.bound_fraction`).
    semi_axes : Quantity (3,)
        At the end, longest first.
    spin : Quantity
        Spin rate at the end.
    spin_vector : Quantity (3,)
        Angular velocity at the end, frame of the encounter.
    onset_time, arrest_time : Quantity or None
        First yield and last arrest since the start of the encounter; None if there was none.
    end_time : Quantity
        End of the run, since the start of the encounter.
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
    if not 1e-13 <= tolerance <= 1e-3:
        raise InvalidInput("tolerance", tolerance, "a number in [1e-13, 1e-3]")
    rotation = periapsis_axes(encounter).T @ _rotation(attitude)

    def run(surface: str, tol: float, keep: int = 0, unyielding: bool = False) -> Passage:
        return _run(body, encounter, rotation, surface, tol, max_axis_ratio, keep, unyielding)

    surface = body.material.yield_surface
    holds, cohesion = _on_its_own(body)
    # A body that cannot exist on its own is not carried on: its demand at the start is the answer.
    main = run(surface, tolerance, 20_000 if history else 0, unyielding=not holds)
    yielded = any(name == "onset" for name, _, _ in main.events)
    needs = run(surface, tolerance, unyielding=True) if yielded else main
    verdict, letter, bound = _verdict(main, encounter, body, holds)
    verdicts = {surface: verdict}
    for other in surfaces:
        if other not in YIELD_SURFACES:
            raise InvalidInput("surfaces", other, f"names out of {YIELD_SURFACES}")
        if other != surface:
            other_body = body.with_(material=body.material.with_(yield_surface=other))
            other_run = run(other, tolerance)
            verdicts[other] = _verdict(other_run, encounter, body, _on_its_own(other_body)[0])[0]
    measured = None
    if error:
        loose = run(surface, min(1e-3, tolerance * LOOSER), unyielding=not holds)
        loose_needs = run(surface, min(1e-3, tolerance * LOOSER), unyielding=True) if yielded else loose
        loose_verdict = _verdict(loose, encounter, body, holds)
        measured = FlybyError(
            semi_axes=float(np.max(np.abs(_axes(loose.shape) / _axes(main.shape) - 1.0))),
            spin=_relative(_spin(loose.velocity_gradient), _spin(main.velocity_gradient)),
            bound_fraction=abs(loose_verdict[2] - bound),
            required_friction_angle=np.rad2deg(_difference(needs.max_friction, loose_needs.max_friction))
            * u.deg,
            event_times=_event_difference(main, loose) * u.s,
            verdict_agrees=loose_verdict[0] == verdict,
            tide=encounter.tide_error,
        )
    start = encounter.t_start
    onset = next((t for name, t, _ in main.events if name == "onset"), None)
    arrests = [t for name, t, _ in main.events if name in ("arrest", "jam")]
    lode = next((angle for name, _, angle in main.events if name == "onset"), None)
    margin = body.material.phi - needs.max_friction
    spin_ratio, pole_change = _spin_change(body, rotation, main)
    return FlybyResult(
        verdict=verdict,
        verdict_class=letter,
        bound_fraction=bound,
        semi_axes=_axes(main.shape) * u.m,
        spin=float(np.linalg.norm(_spin(main.velocity_gradient))) * u.rad / u.s,
        spin_vector=_spin(main.velocity_gradient) * u.rad / u.s,
        onset_time=None if onset is None else (onset - start) * u.s,
        arrest_time=(arrests[-1] - start) * u.s if arrests else None,
        end_time=(main.time - start) * u.s,
        max_required_friction_angle=np.rad2deg(needs.max_friction) * u.deg,
        max_required_friction_time=(needs.max_friction_time - start) * u.s,
        margin=np.rad2deg(margin) * u.deg,
        required_cohesion=(0.0 if holds else cohesion) * u.Pa,
        lode_angle=None if lode is None else np.rad2deg(lode) * u.deg,
        spin_ratio=spin_ratio,
        pole_change=pole_change * u.deg,
        error=measured,
        verdict_by_surface=verdicts,
        robust=None if len(verdicts) == 1 else len(set(verdicts.values())) == 1,
        events=tuple((name, (t - start) * u.s) for name, t, _ in main.events),
        body=_body_after(body, main, yielded),
        history=_history(main, encounter, body) if history else None,
        modelled=(*encounter.forces, *_modelled(body)),
        left_out=encounter.left_out,
        encounter=encounter,
    )


def _run(
    body: Body,
    encounter: Encounter,
    rotation: Array,
    surface: str,
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
        surface=YIELD_SURFACES.index(surface),
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


@dataclass(frozen=True, eq=False)
class FlybyTable:
    """Results of many encounters as arrays; attributes as in :class:`FlybyResult`, first dimension n.

    A row that could not be computed has the verdict "FAILED", its reason in `failure` and nan elsewhere.
    """

    verdict: NDArray[np.str_]
    bound_fraction: Array
    semi_axes: Quantity
    spin: Quantity
    max_required_friction_angle: Quantity
    margin: Quantity
    spin_ratio: Array
    pole_change: Quantity
    failure: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.verdict)


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
    surface = body.material.yield_surface
    holds = _on_its_own(body)[0]
    run = _run(body, encounter, rotation, surface, tolerance, max_axis_ratio, unyielding=not holds)
    needed = run.max_friction
    if any(name == "onset" for name, _, _ in run.events):
        needed = _run(
            body, encounter, rotation, surface, tolerance, max_axis_ratio, unyielding=True
        ).max_friction
    verdict, _, bound = _verdict(run, encounter, body, holds)
    ratio, turn = _spin_change(body, rotation, run)
    spin = float(np.linalg.norm(_spin(run.velocity_gradient)))
    return str(verdict), np.array([bound, *_axes(run.shape), spin, np.rad2deg(needed), ratio, turn])


def periapsis_axes(encounter: Encounter) -> Array:
    """Rotation matrix, frame of the encounter -> periapsis frame (x periapsis, z angular momentum).

    An attitude ``A`` (body axes -> ICRF) of a real encounter is ``periapsis_axes(encounter) @ A`` to `flyby`.
    """
    r = encounter.position(0.0)[0]
    h = np.cross(r, encounter.velocity(0.0)[0])
    x, z = r / np.linalg.norm(r), h / np.linalg.norm(h)
    return np.stack([x, np.cross(z, x), z])


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
    s = body.axes**2
    gravity = -2.0 * np.pi * G * body.rho * np.array(gravity_coefficients(*s))
    stress = np.zeros(6)
    rigid_stress_components(np.zeros(6), body.omega, s, gravity, stress)
    stress *= body.rho / 5.0
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


def _difference(a: float, b: float) -> float:
    return 0.0 if a == b else abs(a - b)


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
        regime=np.array(["rigid", "flowing", "dispersed", "fluid"])[h["regime"]],
        semi_axes=_axes(h["shape"]) * u.m,
        spin=_spin(h["velocity_gradient"]) * u.rad / u.s,
        required_friction_angle=np.rad2deg(required) * u.deg,
        pressure=h["pressure"] * u.Pa,
        shape=h["shape"] * u.m**2,
        velocity_gradient=h["velocity_gradient"] / u.s,
    )
