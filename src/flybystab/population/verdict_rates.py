"""Rates of verdicts in a population, the result of :func:`flybystab.disruption_rates`, and derived quantities."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.units import Quantity
from numpy.typing import ArrayLike, NDArray

from flybystab.arguments import check_arguments
from flybystab.errors import InvalidInput
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.planets import planet
from flybystab.tabular import Collection
from flybystab.units import to_si

#: Verdicts of a body that changed its shape or lost mass and still exists.
CHANGED = (Verdict.RESHAPED, Verdict.MASS_LOSS, Verdict.DISRUPTED, Verdict.BEYOND_MODEL)


@dataclass(frozen=True, eq=False)
class DisruptionRates(Collection):
    """Rates of verdicts in a population.

    Attributes
    ----------
    table : QTable
        One row per planet and verdict: ``planet``, ``verdict``, ``rate`` and its sampling error ``rate_error`` (1/yr,
        of the whole population). A verdict without samples has the rate 0, and its error is the largest weight of
        a sample.
    samples : QTable
        Every sampled encounter: ``planet``, ``orbit`` (row), ``periapsis``, ``v_inf``, ``diameter``, ``verdict``,
        ``spin_ratio`` and ``spin_period`` (after the encounter), ``elongation`` (longest over shortest axis, also
        ``elongation_before``), ``largest_fraction`` of the mass, ``fragments`` (clumps of 1 % of the mass or more, by
        grains only), ``fragment_fractions`` (mass fractions of the fragments beside the largest, greatest first, zero
        where there are none), ``model`` (ellipsoid or grains) and ``weight`` (1/yr: its contribution to the rate).
    bodies : float
        Number of asteroids of the population.
    diameter : Quantity or None
        Of every body; None where it follows from ``H``.
    """

    table: QTable
    samples: QTable
    bodies: float
    diameter: Quantity | None

    def _rows(self) -> dict[str, Sized]:
        return {name: self.table[name] for name in self.table.colnames}

    @check_arguments
    def rate(self, verdict: str, planet_name: str | None = None) -> Quantity:
        """Rate of a verdict, 1/yr, over all planets or for one."""
        mask = self.table["verdict"] == str(verdict)
        if planet_name is not None:
            mask &= self.table["planet"] == planet(planet_name).name
        return self.table["rate"][mask].sum()

    @check_arguments
    def lifetime(self, *verdicts: str) -> Quantity:
        """Mean time, Myr, until a body of the population has an encounter with one of the verdicts."""
        total = sum((self.rate(v) for v in verdicts), 0.0 / u.yr)
        return (self.bodies / total).to(u.Myr) if total.value > 0.0 else np.inf * u.Myr

    @check_arguments
    def changed_fraction(self, time: Quantity, *verdicts: str) -> float:
        """Fraction of the population that met one of the verdicts within a time, ``1 - exp(-time/lifetime)``.

        By default the verdicts of bodies that were reshaped or lost mass. Rates are taken as constant in time and the
        same for all bodies, which is an upper limit: some bodies have several such encounters, others none.
        """
        span = to_si(time, u.s, "time", low=0.0)
        lifetime = self.lifetime(*(verdicts or CHANGED)).to_value(u.s)
        return float(-np.expm1(-span / lifetime))

    @check_arguments
    def spin_change_rate(self, least: float) -> Quantity:
        """Rate, 1/yr, of bodies that stay INTACT and whose spin rate changes by more than the fraction `least`."""
        share = to_si(least, u.dimensionless_unscaled, "least", low=0.0)
        mask = (self.samples["verdict"] == str(Verdict.INTACT)) & (
            np.abs(self.samples["spin_ratio"] - 1.0) > share
        )
        return self.samples["weight"][mask].sum()

    def cumulative(self, diameters: Quantity, *verdicts: str) -> Quantity:
        """Rate, 1/yr, of the verdicts (by default of all changes) for bodies larger than each of the diameters."""
        sizes = np.atleast_1d(to_si(diameters, u.m, "diameters", shape=None, low=0.0))
        mask, weight = self._mask(verdicts or CHANGED), self.samples["weight"].to_value(1 / u.yr)
        own = self.samples["diameter"].to_value(u.m)
        return np.array([weight[mask & (own >= size)].sum() for size in sizes]) / u.yr

    def fragment_rate(self, diameters: Quantity) -> Quantity:
        """Rate, 1/yr, at which fragments larger than each of the diameters are made, the largest remnants left out.

        Only bodies continued with grains have fragments, of which the twelve largest are kept: the rate is a lower
        limit if smaller ones exceed the diameter.
        """
        sizes = np.atleast_1d(to_si(diameters, u.m, "diameters", shape=None, low=0.0, open_low=True))
        own = np.cbrt(self.samples["fragment_fractions"]) * self.samples["diameter"].to_value(u.m)[:, None]
        weight = self.samples["weight"].to_value(1 / u.yr)
        return np.array([weight @ np.sum(own >= size, axis=1) for size in sizes]) / u.yr

    @check_arguments
    def contributors(self, *verdicts: str, most: int = 10) -> QTable:
        """Orbits with the largest rates of the verdicts: ``orbit`` (row of the population), ``rate``, ``samples``.

        The rates of single orbits rest on few samples each.
        """
        chosen = self.samples[self._mask(verdicts or CHANGED)]
        orbits, place, counts = np.unique(chosen["orbit"], return_inverse=True, return_counts=True)
        rate = np.bincount(place, weights=chosen["weight"].to_value(1 / u.yr), minlength=len(orbits))
        order = np.argsort(-rate, kind="stable")[:most]
        return QTable({"orbit": orbits[order], "rate": rate[order] / u.yr, "samples": counts[order]})

    def survivors(self) -> dict[str, tuple[float, float, float]]:
        """Weighted medians (16 and 84 %) of spin ratio, spin period and elongation of bodies that were changed."""
        chosen = self.samples[self._mask(CHANGED)]
        weight = chosen["weight"].to_value(1 / u.yr)
        period = chosen["spin_period"].to_value(u.h) if len(chosen) else np.empty(0)
        return {
            "spin_ratio": _quantiles(np.asarray(chosen["spin_ratio"]), weight),
            "spin_period_h": _quantiles(period, weight),
            "elongation_before": _quantiles(np.asarray(chosen["elongation_before"]), weight),
            "elongation": _quantiles(np.asarray(chosen["elongation"]), weight),
        }

    @check_arguments
    def outcome_map(
        self, periapsis: ArrayLike, v_inf: Quantity, *verdicts: str, planet_name: str
    ) -> NDArray[np.float64]:
        """Probability of the verdicts in bins of periapsis (planetary radii) and ``v_inf``; nan without samples.

        Parameters
        ----------
        periapsis : sequence of float (m + 1,)
            Edges of the bins in radii of the planet.
        v_inf : Quantity (n + 1,)
            Edges of the bins.

        Returns
        -------
        ndarray (n, m)
        """
        body = planet(planet_name)
        speeds = to_si(v_inf, u.km / u.s, "v_inf", shape=None, low=0.0)
        edges = np.asarray(periapsis, dtype=float)
        if edges.ndim != 1 or len(edges) < 2 or np.ndim(speeds) != 1 or len(np.atleast_1d(speeds)) < 2:
            raise InvalidInput("periapsis", periapsis, "two or more edges of bins, as of v_inf")
        here = self.samples["planet"] == body.name
        q = self.samples["periapsis"].to_value(u.m) / body.radius
        v = self.samples["v_inf"].to_value(u.km / u.s)
        counted = here & (self.samples["weight"].value > 0.0)
        bins = (np.atleast_1d(speeds), edges)
        hits, _, _ = np.histogram2d(
            v, q, bins, weights=(counted & self._mask(verdicts or CHANGED)).astype(float)
        )
        total, _, _ = np.histogram2d(v, q, bins, weights=counted.astype(float))
        return np.divide(hits, total, out=np.full_like(hits, np.nan), where=total > 0)

    def _mask(self, verdicts: Sequence[str]) -> NDArray[np.bool_]:
        return np.isin(np.asarray(self.samples["verdict"], dtype=str), [str(v) for v in verdicts])

    def __repr__(self) -> str:
        return f"<DisruptionRates {self.bodies:g} asteroids, {len(self.samples)} sampled encounters>"


def _quantiles(values: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[float, float, float]:
    """Weighted 16, 50 and 84 % quantiles; nan without values."""
    good = np.isfinite(values) & (weights > 0.0)
    if not good.any():
        return np.nan, np.nan, np.nan
    order = np.argsort(values[good])
    x, w = values[good][order], weights[good][order]
    low, middle, high = np.interp([0.16, 0.5, 0.84], (np.cumsum(w) - 0.5 * w) / w.sum(), x)
    return float(low), float(middle), float(high)
