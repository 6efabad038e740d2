"""Outcome of piles of grains in an encounter: one run for each seed, and the distribution over the seeds."""

from __future__ import annotations

from collections.abc import Sized
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.arguments import check_arguments, finite
from flybystab.flybys.grains_resolution import ResolutionErrors, resolution_errors
from flybystab.flybys.verdict import Verdict, classed
from flybystab.tabular import Collection, Record, Tabular
from flybystab.typing import Array
from flybystab.units import brief

if TYPE_CHECKING:
    from astropy.table import QTable


#: A pile from which nothing escapes counts as whole if its largest clump has more than this fraction of the mass; the
#: remainder is loose grains and small satellites.
WHOLE = 0.9


def piles_of(count: int) -> str:
    """A number of piles as text: ``1 pile``, ``8 piles``."""
    return f"{count} pile{'' if count == 1 else 's'}"


@dataclass(frozen=True, eq=False)
class GrainsCourse(Tabular):
    """Clumps of one pile against time; every array has the same first dimension.

    Attributes
    ----------
    time : Quantity (m,)
        Since closest approach.
    largest_fraction, bound_fraction : ndarray (m,)
        Mass of the largest clump, without and with the material bound to it, over that of the body.
    semi_axes : Quantity (m, 3)
        Of the largest clump, longest first.
    spin : Quantity (m,)
        Spin rate of the largest clump.
    positions : Quantity (m, n, 3)
        Positions of the grains relative to the centre of the unperturbed body, frame of the encounter; nan for grains
        on the ground.
    """

    time: Quantity
    largest_fraction: Array
    bound_fraction: Array
    semi_axes: Quantity
    spin: Quantity
    positions: Quantity

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"<GrainsCourse {len(self)} rows, {self.positions.shape[1]} grains>"


@dataclass(frozen=True, eq=False, repr=False)
class GrainsRun(Record):
    """One pile after an encounter.

    Attributes
    ----------
    seed : int
    verdict : Verdict
    largest_fraction, bound_fraction : float
        Mass of the largest clump, without and with the material bound to it, over that of the body.
    ground_fraction : float
        Mass that reached the ground or the atmosphere.
    semi_axes, initial_semi_axes : Quantity (3,)
        Of the ellipsoid with the inertia of the largest clump, and of the pile at the start.
    spin_vector, initial_spin_vector : Quantity (3,)
        Angular velocity of the largest clump, and of the pile, frame of the encounter.
    fragments : QTable
        As :attr:`GrainsOutcome.fragments`, without the seed.
    spin_ratio, pole_change : float, Quantity
        Effective spin rate ``2 E/H`` of the largest clump over that of the pile at the start, and the angle between
        their angular momenta; nan for a pile without spin.
    axes_directions : ndarray (3, 3)
        Principal axes of the largest clump as columns, frame of the encounter.
    settled : bool
        Whether the clumps no longer changed at the end of the run.
    end_time : Quantity
        Of the run, since closest approach.
    course : GrainsCourse
    radius : Quantity (n,)
        Of the grains.
    label : ndarray (n,)
        Row of `fragments` of each grain at the end; -1 for loose grains and lost ones.
    steps : int
    wall_time : Quantity
    """

    seed: int
    verdict: Verdict
    largest_fraction: float
    bound_fraction: float
    ground_fraction: float
    semi_axes: Quantity
    initial_semi_axes: Quantity
    spin_vector: Quantity
    initial_spin_vector: Quantity
    spin_ratio: float
    pole_change: Quantity
    axes_directions: Array = field(repr=False)
    fragments: QTable = field(repr=False)
    settled: bool
    end_time: Quantity
    course: GrainsCourse = field(repr=False)
    radius: Quantity = field(repr=False)
    label: NDArray[np.int64] = field(repr=False)
    steps: int
    wall_time: Quantity

    _left_out: ClassVar[tuple[str, ...]] = ("course", "radius", "label")

    @property
    def stretch(self) -> float:
        """Longest semi-axis of the largest clump over that of the pile at the start."""
        return float((self.semi_axes[0] / self.initial_semi_axes[0]).to_value(u.one))

    @property
    def spin(self) -> Quantity:
        """Spin rate of the largest clump."""
        return np.linalg.norm(self.spin_vector)


@dataclass(frozen=True, eq=False)
class GrainsOutcome(Collection):
    """Result of an encounter by grains: a distribution over piles.

    Attributes
    ----------
    runs : tuple of GrainsRun
        One for each seed.
    fragments : QTable
        Clumps of at least 1 % of the mass: ``seed``, ``mass_fraction``, ``semi_axes`` (3), ``spin`` (3), ``position``
        and ``velocity`` (3) relative to the largest of the same seed, ``bound_to`` (row of the same seed; -1 for
        none), and the orbit about it: ``a`` and ``e`` (nan where unbound). Frame of the encounter.
    modelled : tuple of str
    wall_time : Quantity
        Of all runs together, those in parallel counted once.
    """

    runs: tuple[GrainsRun, ...]
    fragments: QTable = field(repr=False)
    modelled: tuple[str, ...] = field(repr=False)
    wall_time: Quantity = field(repr=False)

    def _rows(self) -> dict[str, Sized]:
        tables = [run.to_table() for run in self.runs]
        names = [name for name in tables[0].colnames if name not in ("axes_directions", "wall_time")]
        return {
            name: Quantity([t[name][0] for t in tables])
            if isinstance(tables[0][name], Quantity)
            else np.array([t[name][0] for t in tables])
            for name in names
        }

    @property
    def median(self) -> GrainsRun:
        """The run with the median mass of the largest clump (the lower of two middle ones)."""
        ordered = sorted(self.runs, key=lambda r: (r.largest_fraction, r.bound_fraction, -r.stretch))
        return ordered[(len(ordered) - 1) // 2]

    @property
    def verdict(self) -> Verdict:
        """Verdict of the median run; IMPACT if more than half of the runs end so."""
        hits = sum(r.verdict == Verdict.IMPACT for r in self.runs)
        if 2 * hits > len(self.runs):
            return Verdict.IMPACT
        if self.median.verdict != Verdict.IMPACT:
            return self.median.verdict
        return classed(self.median.largest_fraction)[0]

    @property
    def largest_fraction(self) -> float:
        """Of the median run: mass of the largest clump over that of the body."""
        return self.median.largest_fraction

    @property
    def bound_fraction(self) -> float:
        """Of the median run: mass of the largest clump and the material bound to it, over that of the body."""
        return self.median.bound_fraction

    @property
    def largest_range(self) -> tuple[float, float]:
        """Least and largest mass of the largest clump over the seeds."""
        found = [r.largest_fraction for r in self.runs]
        return min(found), max(found)

    @property
    def resolution_errors(self) -> ResolutionErrors:
        """Errors of :attr:`largest_fraction` and of the stretch of the median run from the finite number of grains.

        They are systematic and add to the spread over the seeds. Estimated
        (:mod:`flybystab.flybys.grains_resolution`) from flybys with up to 4,000 grains.
        """
        run = self.median
        whole = run.largest_fraction > WHOLE
        return resolution_errors(len(run.radius), run.largest_fraction, run.stretch, whole=whole)

    @check_arguments
    def probabilities(self, confidence: float = 0.68) -> dict[Verdict, tuple[float, float, float]]:
        """Fraction of the seeds with each verdict, and its Jeffreys interval at a level of confidence.

        Every verdict that occurs is listed, in the order of severity.
        """
        from scipy.stats import beta

        n, tail = len(self.runs), 0.5 * (1.0 - finite(confidence, "confidence", 0.0, 1.0))
        out = {}
        for verdict in Verdict:
            k = sum(r.verdict == verdict for r in self.runs)
            if k:
                low = 0.0 if k == 0 else float(beta.ppf(tail, k + 0.5, n - k + 0.5))
                high = 1.0 if k == n else float(beta.ppf(1.0 - tail, k + 0.5, n - k + 0.5))
                out[verdict] = (k / n, low, high)
        return out

    def __repr__(self) -> str:
        low, high = self.largest_range
        fractions = ", ".join(f"{v} {p[0]:.2g}" for v, p in self.probabilities().items())
        return (
            f"<GrainsOutcome {piles_of(len(self.runs))}: {fractions}; largest clump {self.largest_fraction:.3g} "
            f"({low:.3g} to {high:.3g}), {len(self.fragments)} clumps of 1 % or more, {brief(self.wall_time, u.s)}>"
        )
