"""Scenes that several tests share, and the budgets that they check."""

from __future__ import annotations

from typing import Any

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Body, Material
from flybystab.constants import R_EARTH, G
from flybystab.core.dynamics import state
from flybystab.core.dynamics.ground import no_ground
from flybystab.core.dynamics.moreau import follow_steps
from flybystab.core.dynamics.regimes import Span, follow
from flybystab.core.dynamics.run import EXPANSION, LIMITS, Run, body_state, integrate, parameters
from flybystab.core.dynamics.workspace import Limits, new_log, workspace
from flybystab.core.ellipsoid.tide import TidePanels, components, no_tide, tensor, tide_at
from flybystab.encounter.encounter import Encounter

Array = NDArray[np.float64]

R_E = R_EARTH * u.m

#: Yield surface of the reference flybys P1-P3 and of the scenes whose numbers were computed with it.
CONE = "drucker-prager"

#: The rubble pile of Richardson, Bottke & Love (1998) and of the reference flybys.
PILE = Body(
    semi_axes=[1400, 850, 750] * u.m,
    density=2000 * u.kg / u.m**3,
    spin_period=6 * u.h,
    material=Material(yield_surface=CONE),
)


def earth(q: float, v_inf: float = 5.0, start: float = 10.0) -> Encounter:
    """Earth passage: periapsis and start in Earth radii, v_inf in km/s."""
    return Encounter.hyperbolic(
        "earth", periapsis=q * R_E, v_inf=v_inf * u.km / u.s, start_distance=start * R_E
    )


def material(phi: float, **kwargs: Any) -> Material:
    """Material with friction angle `phi` in deg; on the cone through compression unless a surface is given."""
    return Material(friction_angle=phi * u.deg, **({"yield_surface": CONE} | kwargs))


#: Limits of a run by their names in :func:`carried`.
_LIMITS = {"tolerance": "tolerance", "max_axis_ratio": "axis_ratio", "max_steps": "max_steps"}


def carried(
    body: Body,
    t_start: float,
    t_stop: float,
    tide: TidePanels | None = None,
    attitude: Array | None = None,
    **kwargs: Any,
) -> Run:
    """Array-level run of a body."""
    m = body.material
    turn = np.eye(3) if attitude is None else attitude
    given = {name: kwargs.pop(key) for key, name in _LIMITS.items() if key in kwargs}
    expansion = kwargs.pop("expansion", EXPANSION)
    return integrate(
        body_state(
            body.axes,
            body.rho,
            body.omega,
            turn,
            m.phi,
            m.c_pa,
            m.dilatancy,
            m.surface_code,
            m.brittle,
            expansion,
        ),
        Span(t_start, kwargs.pop("t_rest", t_stop), t_stop),
        no_tide() if tide is None else tide,
        limits=LIMITS._replace(**given),
        **kwargs,
    )


def axes_of(shape: Array) -> Array:
    """Semi-axes, longest first."""
    return np.sqrt(np.linalg.eigvalsh(shape)[..., ::-1])


def momentum(shape: Array, gradient: Array) -> Array:
    """Angular momentum per m/5."""
    flow = gradient @ shape
    return np.stack(
        [
            flow[..., 2, 1] - flow[..., 1, 2],
            flow[..., 0, 2] - flow[..., 2, 0],
            flow[..., 1, 0] - flow[..., 0, 1],
        ],
        axis=-1,
    )


def kinetic(shape: Array, gradient: Array) -> Array:
    """Kinetic energy per m/5: tr(L S L^T)/2."""
    return 0.5 * np.einsum("...ij,...jk,...ik->...", gradient, shape, gradient)


def potential(body: Body, shape: Array) -> Array:
    """Energy of self-gravity per m/5: -3 G m R_F."""
    from scipy.special import elliprf

    values = np.linalg.eigvalsh(shape)
    return -3.0 * G * body.mass.value * elliprf(values[..., 0], values[..., 1], values[..., 2])


def tides(tide: TidePanels, times: Array) -> Array:
    """Tidal tensors, shape (n, 3, 3)."""
    out = np.zeros((len(times), 6))
    for t, row in zip(times, out, strict=True):
        tide_at(tide.tau, tide.start, tide.width, tide.coefficients, t, row)
    return tensor(out)


def simpson(history: dict[str, Array], values: Array, samples: int) -> Array:
    """Integral of sampled `values` over a stretch whose steps have `samples` equal parts (2 or 4)."""
    t = history["time"]
    weights = {2: np.array([1, 4, 1]) / 6.0, 4: np.array([7, 32, 12, 32, 7]) / 90.0}[samples]
    total = np.zeros(values.shape[1:])
    for i in range(0, len(t) - samples, samples):
        total = total + (t[i + samples] - t[i]) * np.tensordot(
            weights, values[i : i + samples + 1], axes=(0, 0)
        )
    return total


def stepped(
    body: Body, t_start: float, t_stop: float, n: int, tide: TidePanels | None = None
) -> tuple[Array, Array]:
    """Shape (m2) and velocity gradient (1/s) from the time-stepping integrator, body axes along the frame."""
    m = body.material
    t0 = body.dynamical_time
    a0 = float(np.cbrt(np.prod(body.axes)))
    par = parameters(body.axes, body.rho, m.phi, m.c_pa, m.dilatancy, m.surface_code)
    y = np.zeros(15)
    y[:3] = (body.axes / a0) ** 2
    y[12:15] = body.omega * t0
    panels = no_tide() if tide is None else tide
    scaled = TidePanels(panels.tau / t0, panels.start, panels.width, panels.coefficients * t0**2)
    assert follow_steps(t_start / t0, t_stop / t0, n, y, par.material, scaled, m.brittle).done
    gradient = tensor(y[6:12])
    w = y[12:15]
    gradient += np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    return tensor(y[:6]) * a0**2, gradient / t0


def deforming(
    body: Body,
    rate: Array,
    t_stop: float,
    *,
    regime: int = state.FLOWING,
    viscosity: float = 0.0,
    tolerance: float = 1e-11,
    tide: TidePanels | None = None,
    limit: float = 100.0,
) -> tuple[Array, Array, list[tuple[int, float]], Array]:
    """Follow a body that starts with the velocity gradient ``rate + W`` (1/s), body axes along the frame.

    Returns shape (m2), velocity gradient (1/s), events (code, time in s) and the history's columns
    (time s, S in m2 as six components).
    """
    m = body.material
    t0 = body.dynamical_time
    a0 = float(np.cbrt(np.prod(body.axes)))
    par = parameters(body.axes, body.rho, m.phi, m.c_pa, m.dilatancy, m.surface_code, viscosity)
    y = np.zeros(15)
    y[:3] = (body.axes / a0) ** 2
    y[6:12] = components(rate) * t0
    y[12:15] = body.omega * t0
    panels = no_tide() if tide is None else tide
    scaled = TidePanels(panels.tau / t0, panels.start, panels.width, panels.coefficients * t0**2)
    run = new_log(20000, 64)
    follow(
        Span(0.0, t_stop / t0, t_stop / t0), regime, y, par, scaled, no_ground(), Limits(tolerance, limit, 200_000),
        m.brittle, False, run, workspace(),
    )  # fmt: skip
    w = y[12:15]
    gradient = tensor(y[6:12]) + np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    counts = run.counts[0]
    history = run.history[: counts["rows"]]
    rows = np.column_stack([history["time"] * t0, history["state"][:, :6] * a0**2])
    log = [(int(e["code"]), float(e["time"]) * t0) for e in run.events[: counts["events"]]]
    return tensor(y[:6]) * a0**2, gradient / t0, log, rows
