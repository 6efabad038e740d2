"""Critical values: least friction angle, cohesion, density or periapsis at which an outcome is still acceptable."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments
from flybystab.body.body import DENSITY_RANGE, Body
from flybystab.encounter.attitude import about_z, attitude_matrix
from flybystab.encounter.attitude_at_periapsis import attitude_at_start
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput, UnknownName
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.subject import subject_of
from flybystab.flybys.verdict import SEVERITY, Verdict
from flybystab.progress import Progressing, progress_bar
from flybystab.tabular import Tabular
from flybystab.typing import Array
from flybystab.units import to_si, whole

#: Values at which a range is scanned from its safe end before the boundary is refined by bisection.
SCAN = 24


class Parameter(NamedTuple):
    """A quantity whose critical value can be found; a larger value is safer for all of them."""

    unit: u.UnitBase
    low: float
    high: float
    logarithmic: bool
    apply: Callable[[Body, Encounter, float], tuple[Body, Encounter]]


def _material(name: str, unit: u.UnitBase) -> Callable[[Body, Encounter, float], tuple[Body, Encounter]]:
    return lambda body, encounter, x: (
        body.with_(material=body.material.with_(**{name: x * unit})),
        encounter,
    )


def _periapsis(body: Body, encounter: Encounter, radii: float) -> tuple[Body, Encounter]:
    planet = encounter.planet
    start = max(encounter.start_distance.to_value(u.m), 1.01 * radii * planet.radius)
    return body, Encounter.hyperbolic(
        planet, radii * planet.radius * u.m, encounter.v_inf, start_distance=start * u.m
    )


#: Parameters by name: unit, range of the search, scale, and how a value is applied. A further parameter is one more
#: entry.
PARAMETERS = {
    "friction_angle": Parameter(u.deg, 0.1, 89.0, False, _material("friction_angle", u.deg)),
    "cohesion": Parameter(u.Pa, 1e-3, 1e6, True, _material("cohesion", u.Pa)),
    "density": Parameter(
        u.kg / u.m**3,
        DENSITY_RANGE[0],
        DENSITY_RANGE[1],
        True,
        lambda body, encounter, x: (body.with_(density=x * u.kg / u.m**3), encounter),
    ),
    "periapsis": Parameter(u.one, 1.0, 30.0, True, _periapsis),
}


@dataclass(frozen=True, eq=False)
class CriticalValues(Tabular):
    """Critical values of one quantity over the phases of the spin.

    Attributes
    ----------
    phase : Quantity (n,)
        Angle of the long axis from the direction to the planet at closest approach, about the spin axis, for a freely
        rotating body.
    value : Quantity (n,)
        Least value for which the outcome is no worse than `outcome`; infinite if no value of the range is
        sufficient, the lower end of the range if all are. A periapsis is in radii of the planet.
    error : Quantity (n,)
        Width of the last bracket; nan where `value` is an end of the range.
    quantity, outcome : str
    range : tuple of Quantity
        Ends of the range that was searched.
    subject : str
        Planet, encounter and body, without the quantity that was varied.
    """

    phase: Quantity
    value: Quantity
    error: Quantity
    quantity: str
    outcome: str
    range: tuple[Quantity, Quantity]
    subject: str = ""

    def __len__(self) -> int:
        return len(self.phase)

    @property
    def least(self) -> Quantity:
        """Critical value at the most favourable phase."""
        return self.value.min()

    @property
    def largest(self) -> Quantity:
        """Critical value at the least favourable phase, which is sufficient at every phase."""
        return self.value.max()

    def __repr__(self) -> str:
        span = f"{self.least:.4g} to {self.largest:.4g}"
        return f"<CriticalValues {self.quantity} for {self.outcome}: {span} over {len(self)} phases>"


@check_arguments
def critical(
    body: Body,
    encounter: Encounter,
    quantity: str,
    outcome: str = Verdict.INTACT,
    *,
    phases: int = 8,
    attitude: object = None,
    low: Quantity | None = None,
    high: Quantity | None = None,
    tolerance: float = 1e-3,
    workers: int | None = None,
    progress: Progressing = None,
) -> CriticalValues:
    """Least value of a quantity for which the outcome of an encounter is no worse than a given one, over spin phases.

    Parameters
    ----------
    body : Body
    encounter : Encounter
        For "periapsis" a hyperbolic one, whose planet and ``v_inf`` are kept.
    quantity : str
        "friction_angle", "cohesion", "density" or "periapsis".
    outcome : str
        The worst verdict that is accepted, in the order INTACT, RESHAPED, MASS LOSS, DISRUPTED, BEYOND MODEL.
    phases : int
        Phases at closest approach, uniform over half a turn about the body's ``+a3`` axis (an ellipsoid repeats after
        that).
    attitude : array_like (3, 3) or scipy Rotation, optional
        Body axes -> periapsis frame at closest approach, at phase zero; identity by default.
    low, high : Quantity, optional
        Range of the search, in place of that of :data:`PARAMETERS`.
    tolerance : float
        Relative width of the last bracket.
    workers, progress
        As in :func:`flybystab.flyby_many`.

    Returns
    -------
    CriticalValues

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName

    Notes
    -----
    A range is scanned at :data:`SCAN` values from the safe end; the first failure and the value before it are the
    bracket of a bisection. An outcome need not be a monotonic function of the quantity: values below the critical one
    may be safe again.
    """
    parameter = _parameter(quantity)
    worst = _worst(outcome)
    if not isinstance(body, Body):
        raise InvalidInput("body", body, "a flybystab.Body")
    if not isinstance(encounter, Encounter):
        raise InvalidInput("encounter", encounter, "a flybystab.Encounter")
    if quantity == "periapsis" and encounter.frame != "periapsis":
        raise InvalidInput("encounter", encounter, "a hyperbolic encounter, whose periapsis can be chosen")
    n = whole(phases, "phases", 1)
    width = to_si(tolerance, u.one, "tolerance", low=1e-10, high=0.5)
    grid = _grid(parameter, low, high)
    angle = np.pi * np.arange(n) / n
    search = _Search(body, encounter, parameter, attitude_matrix(attitude), angle, worst, workers)
    # Bisections of the widest bracket, relative to its safe end.
    bisections = int(np.ceil(np.log2(max(2.0, float(np.max(1.0 - grid[:-1] / grid[1:])) / width))))
    with progress_bar(progress, SCAN + bisections, "steps", quantity.replace("_", " ")) as tick:
        good, bad = search.brackets(grid, tick)
        refined = np.isfinite(good) & np.isfinite(bad)
        search.bisect(good, bad, width, lambda step: tick(min(SCAN + step, SCAN + bisections)))
    unit = parameter.unit
    return CriticalValues(
        phase=np.rad2deg(angle) * u.deg,
        value=good * unit,
        error=np.where(refined, good - bad, np.nan) * unit,
        quantity=quantity,
        outcome=str(outcome),
        range=(float(grid[0]) * unit, float(grid[-1]) * unit),
        subject=subject_of(body, encounter, varied=quantity),
    )


class _Search(NamedTuple):
    """Search of the critical values of one encounter at several phases (rad); `worst` is the accepted severity."""

    body: Body
    encounter: Encounter
    parameter: Parameter
    attitude: Array
    angle: Array
    worst: int
    workers: int | None

    def fails(self, values: Array, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Mask of the phases `rows` whose outcome is worse than accepted at the values, one for each phase."""
        scenes = [self.parameter.apply(self.body, self.encounter, float(x)) for x in values]
        turns = [
            attitude_at_start(b, e, self.attitude @ about_z(float(a)))
            for (b, e), a in zip(scenes, self.angle[rows], strict=True)
        ]
        table = flyby_many(
            [b for b, _ in scenes], [e for _, e in scenes], turns, workers=self.workers, progress=False
        )
        return np.array([SEVERITY.index(str(v)) > self.worst for v in table.verdict])

    def brackets(self, grid: Array, tick: Callable[[int], object]) -> tuple[Array, Array]:
        """Scan the grid from its safe, last end: the least safe value and the first failing one of each phase.

        The safe value is infinite where the last value of the grid fails, the failing one nan where none fails.
        """
        n = len(self.angle)
        good, bad = np.full(n, np.inf), np.full(n, np.nan)
        safe = np.arange(n)
        for k, x in enumerate(grid[::-1]):
            failing = self.fails(np.full(len(safe), x), safe)
            good[safe[~failing]] = x
            bad[safe[failing]] = x
            safe = safe[~failing]
            tick(k + 1)
            if not len(safe):
                break
        return good, bad

    def bisect(self, good: Array, bad: Array, width: float, tick: Callable[[int], object]) -> None:
        """Halve the brackets in place until they are narrower than `width` times their safe ends."""
        refined = np.isfinite(good) & np.isfinite(bad)
        step = 0
        while (rows := np.flatnonzero(refined & (good - bad > width * good))).size:
            middle = 0.5 * (good[rows] + bad[rows])
            failing = self.fails(middle, rows)
            bad[rows[failing]] = middle[failing]
            good[rows[~failing]] = middle[~failing]
            step += 1
            tick(step)


def _grid(parameter: Parameter, low: Quantity | None, high: Quantity | None) -> Array:
    """Values at which a parameter is scanned, ascending, in its unit."""
    first, last = (
        end if given is None else float(to_si(given, parameter.unit, name, low=0.0))
        for given, end, name in ((low, parameter.low, "low"), (high, parameter.high, "high"))
    )
    if not first < last:
        raise InvalidInput("low", low, f"less than high = {last:g} {parameter.unit}")
    space = np.geomspace if parameter.logarithmic and first > 0.0 else np.linspace
    return np.asarray(space(first, last, SCAN))


def _parameter(quantity: str) -> Parameter:
    if quantity not in PARAMETERS:
        near = get_close_matches(str(quantity), PARAMETERS, cutoff=0.4)
        raise UnknownName("quantity", str(quantity), near, f"(known: {', '.join(PARAMETERS)})")
    return PARAMETERS[quantity]


def _worst(outcome: str) -> int:
    accepted = SEVERITY[: SEVERITY.index(Verdict.BEYOND_MODEL) + 1]
    if str(outcome) not in accepted:
        near = get_close_matches(str(outcome), accepted, cutoff=0.4)
        raise UnknownName("outcome", str(outcome), near, f"(known: {', '.join(accepted)})")
    return SEVERITY.index(str(outcome))
