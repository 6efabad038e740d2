"""Result of the encounter of one body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.body.body import Body
from flybystab.body.surface_slope import SlopeChange
from flybystab.constants import G
from flybystab.core.ellipsoid.potential import carlson_fd
from flybystab.encoding import encoded
from flybystab.encounter.encounter import Encounter
from flybystab.flybys.batch import FlybyRun
from flybystab.flybys.history import FlybyError, History, history_of, measured_error
from flybystab.flybys.inputs import FlybyInputs, modelled
from flybystab.flybys.remnant import body_after, final_attitude
from flybystab.flybys.robustness import Robustness, surface_verdicts
from flybystab.flybys.surface_change import slopes_of
from flybystab.flybys.verdict import Verdict, letter_of, settled
from flybystab.flybys.verdict_margins import VerdictMargins, verdict_margins
from flybystab.saving import Columns
from flybystab.tabular import Record
from flybystab.typing import Array, Document
from flybystab.units import brief

if TYPE_CHECKING:
    from astropy.table import QTable

    from flybystab.flybys.grains_outcome import GrainsOutcome

#: Columns of a result as a table of one row; columns whose value is None are left out.
_COLUMNS = (
    "verdict",
    "verdict_class",
    "rung",
    "margin",
    "max_required_friction_angle",
    "bound_fraction",
    "semi_axes",
    "spin",
    "spin_ratio",
    "pole_change",
    "spin_vector",
    "attitude",
    "required_cohesion",
    "lode_angle",
    "onset_time",
    "arrest_time",
    "end_time",
    "contact",
    "robust",
)
#: Stored here, because composing the unit takes ten times as long.
RAD_S = u.rad / u.s


@dataclass(frozen=True, eq=False, init=False, repr=False)
class FlybyResult(Record):
    """Outcome of an encounter. Quantities, history, body and margins are computed on first access.

    Attributes
    ----------
    verdict : Verdict
        Compares equal to its text, ``r.verdict == "INTACT"``.
    verdict_class : str or None
        "M", "B" or "S" of Richardson et al. (1998) for bodies that lost mass.
    bound_fraction : float
        Bound mass fraction, in the potential of what stays bound
        (:func:`flybystab.flybys.verdict.bound_fraction`).
    inputs : FlybyInputs
        Body, encounter and settings of the run.
    rung : str
        Model that gave the verdict: "rigid body", "ellipsoid" or "grains". With grains, `semi_axes`, spin, `body`,
        `attitude` and `bound_fraction` are those of the pile with the median bound mass fraction, while onset, margins
        and history are those of the ellipsoid.
    grains : GrainsOutcome or None
        Distribution over piles of grains.
    """

    verdict: Verdict
    verdict_class: str | None
    bound_fraction: float
    inputs: FlybyInputs
    rung: str
    grains: GrainsOutcome | None
    _stored: ClassVar[tuple[str, ...]] = ("inputs", "_run", "_comparison", "_by_surface", "_changed")
    _run: FlybyRun
    _comparison: FlybyRun | None
    _by_surface: dict[str, Verdict]
    _changed: dict[str, object]

    def __init__(
        self,
        inputs: FlybyInputs,
        _run: FlybyRun,
        _comparison: FlybyRun | None = None,
        _by_surface: Mapping[str, Verdict] | None = None,
        _changed: Mapping[str, object] | None = None,
        **changes: object,
    ) -> None:
        found = self.__dict__
        changed = {**(_changed or {}), **changes}
        found.update(inputs=inputs, _run=_run, _comparison=_comparison, _changed=changed)
        found.update(_by_surface=dict(_by_surface or {}), grains=None)
        found.update(verdict=_run.verdict, bound_fraction=_run.bound)
        found["verdict_class"] = letter_of(_run.verdict, _run.bound)
        found["rung"] = "rigid body" if self._onset is None else "ellipsoid"
        found.update(changed)

    def with_(self, **changes: Any) -> FlybyResult:
        """A copy with some attributes replaced."""
        return replace(self, **changes)

    @property
    def _onset(self) -> tuple[float, float] | None:
        """Time (s, clock of the tide) and Lode angle (rad) of the first yield."""
        return next(((t, angle) for name, t, angle in self._run.events if name == "onset"), None)

    def _since_start(self, time: float) -> Quantity:
        return (time - self.inputs.encounter.t_start) * u.s

    @property
    def encounter(self) -> Encounter:
        """The encounter."""
        return self.inputs.encounter

    @cached_property
    def semi_axes(self) -> Quantity:
        """Semi-axes at the end, longest first, shape (3,), m."""
        return self._run.axes * u.m

    @cached_property
    def spin(self) -> Quantity:
        """Spin rate at the end, rad/s."""
        return float(np.linalg.norm(self._run.spin)) * RAD_S

    @cached_property
    def spin_vector(self) -> Quantity:
        """Angular velocity at the end, shape (3,), frame of the encounter, rad/s."""
        return self._run.spin * RAD_S

    @cached_property
    def attitude(self) -> Array:
        """Rotation matrix at the end, body axes of `body` -> frame of the encounter (ICRF for a real one), (3, 3).

        Right-handed principal axes, longest first. The spin has the same sign along ``a3`` as at the start (positive
        if it had none there), so that a prograde body remains prograde. The next encounter takes ``result.body`` with
        ``periapsis_axes(next) @ result.attitude`` if both are in ICRF, after the free rotation in between.
        """
        return final_attitude(self._run.shape, self._run.spin, float(self.inputs.body.omega[2]))

    @cached_property
    def body(self) -> Body:
        """The body after the encounter, along its own axes; ``state`` is its state (see :class:`flybystab.Body`)."""
        return body_after(self.inputs.body, self._run, self.attitude, self._onset is not None)

    @cached_property
    def energy(self) -> Quantity:
        """Kinetic energy in the frame of the centre of mass and energy of self-gravity at the end, J.

        Without dissipation, a body of negative energy cannot expand without limit; one of positive energy does.
        """
        run, mass = self._run, float(self.inputs.body.mass.to_value(u.kg))
        flow = run.velocity_gradient @ run.shape @ run.velocity_gradient.T
        gravity = 0.6 * G * mass**2 * float(carlson_fd(*(run.axes**2))[0])
        return (0.1 * mass * float(np.trace(flow)) - gravity) * u.J

    @cached_property
    def settled(self) -> bool:
        """Whether the body is at rest, disperses permanently or is outside the model at the end of the run.

        Otherwise it still flows or is out of contact, with too little energy to disperse: a body without friction
        oscillates indefinitely. Its verdict and bound mass fraction are then those of one instant of that motion.
        """
        return settled(self._run.verdict, self._run.regime, self.energy.value)

    @cached_property
    def onset_time(self) -> Quantity | None:
        """First yield since the start of the encounter, s; None if the body never yields."""
        return None if self._onset is None else self._since_start(self._onset[0])

    @cached_property
    def arrest_time(self) -> Quantity | None:
        """Last arrest of the flow since the start of the encounter, s; None if there was none."""
        times = [t for name, t, _ in self._run.events if name in ("arrest", "jam")]
        return self._since_start(times[-1]) if times else None

    @cached_property
    def end_time(self) -> Quantity:
        """End of the run since the start of the encounter, s; for an IMPACT the first contact."""
        return self._since_start(self._run.time)

    @cached_property
    def max_required_friction_angle(self) -> Quantity:
        """Largest friction angle that the body mobilises if it stays rigid throughout, deg; inf if none suffices."""
        return np.rad2deg(self._run.friction) * u.deg

    @cached_property
    def max_required_friction_time(self) -> Quantity:
        """Time of the largest mobilised friction angle since the start of the encounter, s."""
        return self._since_start(self._run.friction_time)

    @cached_property
    def margin(self) -> Quantity:
        """Friction angle of the material less the largest required one, deg; positive if the body never yields."""
        return np.rad2deg(self.inputs.body.material.phi - self._run.friction) * u.deg

    @cached_property
    def required_cohesion(self) -> Quantity:
        """Cohesion that keeps the body rigid at its friction angle, Pa; nan for a body that yields in the encounter.

        NOT IN EQUILIBRIUM: the cohesion that holds the body at rest. Zero where the material is sufficient. For a
        body that yields during the encounter the value takes further flybys: :func:`flybystab.critical`.
        """
        lacking = self._run.lacking
        return (np.nan if lacking == 0.0 and self.margin < 0.0 * u.deg else lacking) * u.Pa

    @cached_property
    def lode_angle(self) -> Quantity | None:
        """Lode angle of the stress at first yield, deg (-30: extension, +30: compression)."""
        return None if self._onset is None else np.rad2deg(self._onset[1]) * u.deg

    @cached_property
    def spin_ratio(self) -> float:
        """Effective spin rate ``2 E/H`` after the encounter over that before it."""
        return self._run.spin_ratio

    @cached_property
    def pole_change(self) -> Quantity:
        """Angle between the angular momenta before and after, deg; nan for a body without spin."""
        return np.rad2deg(self._run.pole_change) * u.deg

    @cached_property
    def events(self) -> tuple[tuple[str, Quantity], ...]:
        """Name and time (s, since the start of the encounter) of every change of regime."""
        return tuple((name, self._since_start(t)) for name, t, _ in self._run.events)

    @cached_property
    def error(self) -> FlybyError | None:
        """Measured error; None if no second run was made."""
        if self._comparison is None:
            return None
        return measured_error(self._run, self._comparison, self.inputs.encounter.tide_error)

    @cached_property
    def verdict_by_surface(self) -> dict[str, Verdict]:
        """Verdict by yield surface: all four for a body that stays rigid, otherwise its own and those requested."""
        return self._by_surface or surface_verdicts(self.inputs, self._run)

    @property
    def robust(self) -> bool | None:
        """Whether the verdicts of the yield surfaces agree; None if only one was run."""
        verdicts = self.verdict_by_surface
        return None if len(verdicts) == 1 else len(set(verdicts.values())) == 1

    @cached_property
    def robustness(self) -> Robustness | None:
        """Verdicts over the spin phase and the friction angle; None without ``robustness=``."""
        return None

    @cached_property
    def margins(self) -> VerdictMargins:
        """Margins of the verdict in friction, axis ratio and bound mass fraction, and the strain."""
        return verdict_margins(self.inputs, self._run)

    @cached_property
    def history(self) -> History | None:
        """The body and its orbit against time; None if it was not kept."""
        return None if self._run.history is None else history_of(self._run.history, self.inputs)

    @cached_property
    def surface(self) -> SlopeChange:
        """Slopes of the surface on the rigid course: ``surface.share_passing(angle)``, ``surface.share_lifted``."""
        return slopes_of(self.inputs)

    @cached_property
    def modelled(self) -> tuple[str, ...]:
        """Effects that are modelled, of the encounter and of the body."""
        return (*self.inputs.encounter.forces, *modelled(self.inputs.body))

    @property
    def left_out(self) -> tuple[tuple[str, float], ...]:
        """Neglected effects, each with its estimated relative size.

        Those of a large body are included from 1e-3 on: the third order of the tide at the end of the long axis, 1.5
        times the semi-axis over the distance, and the mass over that of the planet.
        """
        body, encounter = self.inputs.body, self.inputs.encounter
        distance = max(float(encounter.distance.to_value(u.m)), encounter.planet.radius)
        own = (
            ("tide: third order", 1.5 * float(body.axes[0]) / distance),
            ("orbit: mass of the body", G * float(body.mass.to_value(u.kg)) / encounter.planet.gm),
        )
        return (*encounter.left_out, *((name, share) for name, share in own if share >= 1e-3))

    @property
    def fragments(self) -> QTable | None:
        """Clumps at the end, for every seed (:class:`GrainsOutcome`); None unless `rung` is "grains"."""
        return None if self.grains is None else self.grains.fragments

    @property
    def largest_fraction(self) -> float:
        """Mass of the largest remnant over that of the body: the median largest clump of grains, or the bound mass."""
        return self.bound_fraction if self.grains is None else self.grains.largest_fraction

    @property
    def contact(self) -> str | None:
        """Whether the path or only the extent of the body reaches the ground on an IMPACT; None otherwise.

        ``"path"``: the closest approach lies below the top of the atmosphere (the surface, if there is none);
        ``"body"``: the centre would pass above it, but the body is large enough there, towards the planet, to touch it.
        The run ends with the first contact: `end_time`.
        """
        if self.verdict != Verdict.IMPACT:
            return None
        return "path" if self.encounter.impact else "body"

    def _columns(self) -> tuple[Columns, Document]:
        values = {name: getattr(self, name) for name in _COLUMNS}
        row = {
            name: value[None] if isinstance(value, Quantity) else np.asarray(value)[None]
            for name, value in ((k, str(v) if isinstance(v, str) else v) for k, v in values.items())
            if value is not None
        }
        encounter = self.encounter
        about = {"planet": encounter.planet, "time": encounter.time, "body": self.inputs.body}
        about |= {"distance": encounter.distance, "v_inf": encounter.v_inf}
        return row, {**self._about(), **{k: encoded(v) for k, v in about.items()}}

    def to_dict(self) -> Document:
        """JSON document of the result (schema ``flyby/1``): units in the keys, numbers or None."""
        from flybystab.flybys.document import flyby_document

        return flyby_document(self)

    def __repr__(self) -> str:
        letter = f" ({self.verdict_class})" if self.verdict_class else ""
        phi = self.max_required_friction_angle
        own = brief(self.inputs.body.material.friction_angle)
        need = f"mobilises {brief(phi)} of {own}" if np.isfinite(phi) else "no friction keeps it rigid"
        robust = {None: "", True: ", robust", False: ", depends on the yield surface"}[self.robust]
        if not self.settled:
            robust += f", not determined: still {self._run.regime} at the end"
        return (
            f"<FlybyResult {self.verdict}{letter}{robust}: {need}, "
            f"bound {self.bound_fraction:.4g}, then {brief(self.semi_axes, u.m)}, "
            f"spin rate x {self.spin_ratio:.4g}>"
        )
