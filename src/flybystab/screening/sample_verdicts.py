"""Verdicts on many bodies in one encounter: by the bound where it decides, else by integration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import astropy.units as u
import numpy as np
from numpy.typing import NDArray

from flybystab.body.body import Material
from flybystab.core.ellipsoid.yield_bound import INTACT, UNDECIDED, quick_margins
from flybystab.errors import FlybystabError
from flybystab.flybys.batch import comparison_tolerance
from flybystab.flybys.flyby_many import follow_rows
from flybystab.flybys.verdict import Verdict
from flybystab.screening.draws import Attitudes, Draws
from flybystab.screening.encounters import CloseApproach
from flybystab.typing import Array, Document


def _quick(draw: Draws, code: int, size: tuple[float, float]) -> tuple[Array, NDArray[np.int64]]:
    n = len(draw.rho)
    friction, verdict = np.full((n, 2), np.inf), np.zeros(n, dtype=np.int64)
    quick_margins(
        np.ascontiguousarray(draw.axes),
        draw.rho,
        np.ascontiguousarray(draw.omega),
        draw.phi,
        draw.cohesion,
        code,
        *size,
        friction,
        verdict,
    )
    return friction, verdict


def friction_at_rest(draw: Draws, material: Material) -> Array:
    """Friction angle (rad) that each body mobilises far from any planet; inf where no angle suffices."""
    return _quick(draw, material.surface_code, (0.0, 0.0))[0][:, 0]


@dataclass
class SampleVerdicts:
    """Verdicts on the samples of one encounter.

    Attributes
    ----------
    verdict : list of str
        Empty where there is none.
    margin, rest : ndarray
        Friction angle of the material minus the largest one mobilised in the encounter; the one mobilised at rest, rad.
    dynamic : ndarray of bool
        Decided by integration, not by the bound.
    error : list of str
        Reason why there is no verdict; empty if there is one.
    distance : ndarray
        Of the closest approach, m.
    numerical : float
        Numerical error of the first mobilised angle, deg, where it was measured.
    grains : ndarray of bool
        Continued with grains.
    largest : ndarray
        Mass fraction of the largest clump; nan without grains.
    """

    verdict: list[str]
    margin: Array
    rest: Array
    dynamic: NDArray[np.bool_]
    error: list[str]
    distance: Array
    numerical: float = np.nan
    grains: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, dtype=bool))
    largest: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if len(self.grains) == 0:
            self.grains = np.zeros(len(self.verdict), dtype=bool)
            self.largest = np.full(len(self.verdict), np.nan)

    @classmethod
    def joined(cls, parts: Sequence[SampleVerdicts]) -> SampleVerdicts:
        """The samples of all parts, in their order."""
        return cls(
            [v for p in parts for v in p.verdict],
            np.concatenate([p.margin for p in parts]),
            np.concatenate([p.rest for p in parts]),
            np.concatenate([p.dynamic for p in parts]),
            [e for p in parts for e in p.error],
            np.concatenate([p.distance for p in parts]),
            grains=np.concatenate([p.grains for p in parts]),
            largest=np.concatenate([p.largest for p in parts]),
        )

    @classmethod
    def failed(cls, error: str, distance: float) -> SampleVerdicts:
        """One sample that could not be computed."""
        nothing = np.full(1, np.nan)
        return cls([""], nothing, nothing.copy(), np.zeros(1, dtype=bool), [error], np.full(1, distance))

    def stored(self) -> Document:
        """As JSON-compatible data, without loss of digits."""
        arrays = {name: getattr(self, name).tolist() for name in ("margin", "rest", "dynamic", "distance")}
        if self.grains.any():
            arrays |= {"grains": self.grains.tolist(), "largest": self.largest.tolist()}
        return {"verdict": [str(v) for v in self.verdict], "error": self.error, **arrays}

    @classmethod
    def restored(cls, stored: Document) -> SampleVerdicts:
        """Inverse of `stored`."""
        margin, rest, distance = (np.array(stored[n], dtype=float) for n in ("margin", "rest", "distance"))
        dynamic = np.array(stored["dynamic"], dtype=bool)
        return cls(
            list(stored["verdict"]), margin, rest, dynamic, list(stored["error"]), distance,
            grains=np.array(stored.get("grains", ()), dtype=bool),
            largest=np.array(stored.get("largest", ()), dtype=float),
        )  # fmt: skip


#: Samples that :func:`contributors` ranks at most: the standard error of a rank correlation is 0.003 then.
RANKED = 100_000


class Tally(NamedTuple):
    """Counts of samples: by verdict, integrated, continued with grains, and failed, with the first reason."""

    verdicts: Counter[str]
    dynamic: int
    grains: int
    failed: int
    error: str

    @classmethod
    def of(cls, found: SampleVerdicts) -> Tally:
        """Counts of the samples of one part."""
        errors = [e for e in found.error if e]
        dynamic, grains = int(found.dynamic.sum()), int(found.grains.sum())
        return cls(Counter(found.verdict), dynamic, grains, len(errors), errors[0] if errors else "")

    @property
    def samples(self) -> int:
        """Number of samples, with and without a verdict."""
        return self.verdicts.total()

    @classmethod
    def joined(cls, parts: Iterable[Tally]) -> Tally:
        """Counts of all parts, which are given in the order of the samples."""
        total = cls(Counter(), 0, 0, 0, "")
        for part in parts:
            total.verdicts.update(part.verdicts)
            total = cls(
                total.verdicts,
                total.dynamic + part.dynamic,
                total.grains + part.grains,
                total.failed + part.failed,
                total.error or part.error,
            )
        return total


def sample_verdicts(
    approach: CloseApproach,
    draw: Draws,
    attitudes: Attitudes,
    material: Material,
    *,
    tolerance: float = 1e-7,
    quick: bool = True,
    sharp: float = np.inf,
    measure: bool = False,
) -> SampleVerdicts:
    """Verdicts on bodies in one encounter: by the bound where it decides, else by integration.

    Parameters
    ----------
    approach : CloseApproach
    draw : Draws
    attitudes : Attitudes
        Of the same samples.
    material : Material
        Yield surface, dilatancy and brittleness; friction and cohesion are those of the draw.
    quick : bool
        Use the bound; otherwise every body is integrated.
    sharp : float
        Integrate a body although the bound decides if the bound on its mobilised friction angle exceeds the
        angle at rest by more than this, rad: the margin is then a value instead of a lower limit.
    measure : bool
        Measure the numerical error of the first body by a run with another step tolerance.
    """
    n = len(draw.rho)
    code = material.surface_code
    friction, decided = _quick(draw, code, approach.bounds())
    if not quick:
        decided[:] = UNDECIDED
    decided[(decided == INTACT) & (friction[:, 1] > friction[:, 0] + sharp)] = UNDECIDED
    failure = ""
    if np.any(decided == UNDECIDED):
        try:
            encounter = approach.meet()
        except FlybystabError as error:
            failure = f"{type(error).__name__}: {error}"
        else:
            if quick and not encounter.impact:
                close, sharper = _quick(draw, code, approach.close_bounds())
                fresh = (decided == UNDECIDED) & (sharper != UNDECIDED)
                fresh &= (sharper != INTACT) | (close[:, 1] <= close[:, 0] + sharp)
                fresh &= draw.axes[:, 0] <= encounter.height  # clear of the ground at any attitude
                friction[fresh], decided[fresh] = close[fresh], sharper[fresh]
    dynamic = decided == UNDECIDED
    distance = np.full(n, approach.distance)
    out = SampleVerdicts([""] * n, np.full(n, np.nan), friction[:, 0].copy(), dynamic, [""] * n, distance)
    for i in (int(k) for k in np.flatnonzero(~dynamic)):
        intact = decided[i] == INTACT
        out.verdict[i] = Verdict.INTACT if intact else Verdict.NOT_IN_EQUILIBRIUM
        out.margin[i] = draw.phi[i] - friction[i, 1 if intact else 0]
    todo = [int(k) for k in np.flatnonzero(dynamic)]
    if todo and failure:
        for i in todo:
            out.error[i] = failure
    elif todo:
        encounter = approach.meet()
        some = np.array(todo)
        rows = draw.rows(some, attitudes.matrices(some), material)
        table = follow_rows(rows, [encounter], tolerance=tolerance, workers=1)
        for k, i in enumerate(todo):
            out.error[i] = str(table.failure[k])
            out.verdict[i] = "" if out.error[i] else str(table.verdict[k])
            out.margin[i] = np.radians(table.margin[k].to_value(u.deg))
        if measure and dynamic[0] and not out.error[0]:
            looser = follow_rows(rows[:1], [encounter], tolerance=comparison_tolerance(tolerance), workers=1)
            pair = [t.max_required_friction_angle[0].to_value(u.deg) for t in (looser, table)]
            out.numerical = 0.0 if pair[0] == pair[1] else float(abs(pair[0] - pair[1]))
    return out


def verdicts_each(
    approaches: Sequence[CloseApproach],
    draw: Draws,
    attitudes: Attitudes,
    material: Material,
    *,
    tolerance: float = 1e-7,
) -> SampleVerdicts:
    """Verdicts on bodies with a separate encounter for each (arguments as of :func:`sample_verdicts`)."""
    return SampleVerdicts.joined(
        [
            sample_verdicts(p, draw.part(i, i + 1), attitudes.part(i, i + 1), material, tolerance=tolerance)
            for i, p in enumerate(approaches)
        ]
    )


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson score interval of a probability at 95 % confidence (`scipy.stats.binomtest`); (0, 1) without trials."""
    if trials == 0:
        return 0.0, 1.0
    from scipy.stats import binomtest

    interval = binomtest(successes, trials).proportion_ci(confidence_level=0.95, method="wilson")
    return float(interval.low), float(interval.high)


def contributors(inputs: dict[str, Array], outcome: Array, most: int = 3) -> str:
    """Inputs with the strongest Spearman rank correlation with the outcome."""
    from scipy.stats import rankdata

    good = np.isfinite(outcome)
    if good.sum() < 8 or np.ptp(outcome[good]) == 0.0:
        return ""
    ranks = rankdata(outcome[good])
    found = []
    for name, values in inputs.items():
        x = values[good]
        if np.ptp(x) > 1e-12 * np.abs(x).max():
            found.append((float(np.corrcoef(rankdata(x), ranks)[0, 1]), name))
    found.sort(key=lambda f: -abs(f[0]))
    return ", ".join(f"{name} {rho:+.2f}" for rho, name in found[:most])


def inputs(draw: Draws) -> dict[str, Array]:
    """The drawn inputs by name."""
    return {
        "friction angle": draw.phi,
        "cohesion": draw.cohesion,
        "density": draw.rho,
        "size": np.cbrt(np.prod(draw.axes, axis=1)),
        "b/a": draw.axes[:, 1] / draw.axes[:, 0],
        "c/b": draw.axes[:, 2] / draw.axes[:, 1],
        "spin period": draw.period,
    }
