"""Sampled encounters of a population with one planet in one stratum of periapsis: the unit of work of the rates."""

from __future__ import annotations

from typing import NamedTuple

import astropy.units as u
import numpy as np
from astropy.table import QTable
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.catalogues.asteroid import Asteroid
from flybystab.catalogues.magnitude import diameter_of, magnitude_of
from flybystab.encounter.encounter import Encounter
from flybystab.errors import FlybystabError, InvalidInput
from flybystab.flybys.flyby import flyby
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.verdict import Verdict
from flybystab.population.rates import EncounterRates, encounter_rates
from flybystab.screening.draws import draws
from flybystab.screening.priors import Population
from flybystab.typing import Array

#: Geometric albedo that converts a given diameter to the absolute magnitude by which LCDB spin periods are selected.
ALBEDO = 0.14
#: Largest number of sets of bodies drawn to find enough bodies in equilibrium.
_ATTEMPTS = 20
#: Verdicts of the ellipsoid after which a body is continued with grains, if requested.
ENDS = (str(Verdict.BEYOND_MODEL), str(Verdict.MASS_LOSS), str(Verdict.DISRUPTED))
#: Fragments of at least this mass fraction are counted.
LEAST_FRAGMENT = 0.01
#: Fragments beside the largest whose mass fractions are kept.
LISTED_FRAGMENTS = 12


class Plan(NamedTuple):
    """Settings of a run of :func:`flybystab.disruption_rates`.

    ``edges`` are the limits of the strata in planetary radii; ``diameter`` (m) is nan for sizes from ``H``.
    """

    orbits: QTable
    planets: tuple[str, ...]
    edges: tuple[float, ...]
    samples: int
    seed: int
    diameter: float
    material: Material
    priors: Population
    grains: int


def impact_and_total(
    plan: Plan, planet_name: str, workers: int | None = None
) -> tuple[EncounterRates, float]:
    """Rates within the outer edge, and the rate of impacts, 1/yr."""
    rates = encounter_rates(plan.orbits, planet_name, workers=workers)
    body = rates.planet
    impact = rates.within(body.impact_distance * u.m)
    return rates.within(plan.edges[-1] * body.radius * u.m), float(impact.total.value)


def limits(plan: Plan, rates: EncounterRates, stratum: int) -> tuple[float, float]:
    """Periapsis distances between which the encounters of a stratum lie, m."""
    low, high = rates.planet.impact_distance, plan.edges[-1] * rates.planet.radius
    share = [(e - plan.edges[0]) / (plan.edges[-1] - plan.edges[0]) for e in plan.edges]
    return low + (high - low) * share[stratum], low + (high - low) * share[stratum + 1]


def sampled(
    plan: Plan, planet_index: int, stratum: int, rates: EncounterRates, workers: int | None
) -> QTable:
    """Sampled encounters of a stratum with their verdicts and weights (1/yr); without rows where there are none.

    Random numbers depend on the seed, the planet and the stratum only.
    """
    low, high = limits(plan, rates, stratum)
    outer = rates.within(high * u.m)
    total = float((outer.total - rates.within(low * u.m).total).value)
    if not total > 0.0:
        return QTable()
    rng = np.random.default_rng([plan.seed, planet_index, stratum])
    count = plan.samples
    table = outer.sample(count, int(rng.integers(2**31)), above=low * u.m)
    diameter = _diameters(plan, table["orbit"], rng)
    bodies = _bodies(plan, diameter, int(rng.integers(2**31)))
    turns = Rotation.random(count, random_state=rng)
    encounters = [
        Encounter.hyperbolic(outer.planet, periapsis=q, v_inf=v)
        for q, v in zip(table["periapsis"], table["v_inf"], strict=True)
    ]
    flown = flyby_many(bodies, encounters, list(turns.as_matrix()), workers=workers)
    axes = flown.semi_axes.to_value(u.m)
    table["planet"] = np.full(count, outer.planet.name, dtype="U16")
    table["diameter"] = diameter / 1e3 * u.km
    table["verdict"] = np.asarray(flown.verdict).astype("U20")
    table["spin_ratio"] = flown.spin_ratio
    table["spin_period"] = (2.0 * np.pi * u.rad / flown.spin).to(u.h)
    table["elongation_before"] = [b.axes[0] / b.axes[2] for b in bodies]
    table["elongation"] = axes[:, 0] / axes[:, 2]
    table["largest_fraction"] = flown.bound_fraction
    table["fragments"] = np.zeros(count, dtype=int)
    table["fragment_fractions"] = np.zeros((count, LISTED_FRAGMENTS))
    table["model"] = np.full(count, "ellipsoid", dtype="U9")
    if plan.grains:
        _carry_on(plan, table, bodies, encounters, turns)
    counted = ~np.isin(table["verdict"], ("FAILED", str(Verdict.NOT_IN_EQUILIBRIUM)))
    table["weight"] = np.where(counted, total / max(1, int(counted.sum())), 0.0) / u.yr
    return table


def _carry_on(
    plan: Plan, table: QTable, bodies: list[Body], encounters: list[Encounter], turns: Rotation
) -> None:
    """Replace the result of bodies that the ellipsoid cannot follow to the end by that of one pile of grains each."""
    for k in np.flatnonzero(np.isin(table["verdict"], ENDS)):
        try:
            result = flyby(
                bodies[k], encounters[k], turns[k], grains=plan.grains, seeds=[int(k)], model="grains", error=False,
                history=False,
            )  # fmt: skip
        except FlybystabError:  # friction outside the calibrated range
            continue
        assert result.grains is not None
        run = result.grains.runs[0]
        table["verdict"][k] = str(run.verdict)
        table["spin_ratio"][k] = run.spin_ratio
        table["spin_period"][k] = 2.0 * np.pi * u.rad / run.spin
        table["elongation"][k] = float((run.semi_axes[0] / run.semi_axes[2]).to_value(u.one))
        table["largest_fraction"][k] = run.largest_fraction
        fractions = np.sort(np.asarray(run.fragments["mass_fraction"]))[::-1]
        table["fragments"][k] = int(np.sum(fractions >= LEAST_FRAGMENT))
        others = fractions[1 : 1 + LISTED_FRAGMENTS]
        table["fragment_fractions"][k, : len(others)] = others
        table["model"][k] = "grains"


def _diameters(plan: Plan, orbits: NDArray[np.int64], rng: np.random.Generator) -> Array:
    """Diameter of each sampled asteroid, m: the one given, or from ``H`` with a drawn albedo."""
    if np.isfinite(plan.diameter):
        return np.full(len(orbits), plan.diameter)
    magnitude = np.asarray(plan.orbits["H"])[orbits]
    if not np.isfinite(magnitude).all():
        row = int(orbits[np.flatnonzero(~np.isfinite(magnitude))[0]])
        raise InvalidInput("diameter", None, f"a diameter, or H of every orbit (row {row} has none)")
    albedo = plan.priors.albedo.quantile(rng.random(len(orbits)))
    return np.asarray(diameter_of(magnitude, albedo))


def _bodies(plan: Plan, diameter: Array, seed: int) -> list[Body]:
    """Drawn bodies of given diameters (m) that are in equilibrium in isolation."""
    magnitude = np.asarray(magnitude_of(diameter, ALBEDO))
    group = np.round(magnitude).astype(int)
    found: list[Body | None] = [None] * len(diameter)
    for value in np.unique(group):
        rows = np.flatnonzero(group == value)
        size = float(np.exp(np.mean(np.log(diameter[rows]))))
        middle = float(magnitude_of(size, ALBEDO))
        model = Asteroid(
            {"name": "sample", "diameter_m": f"{size!r}", "H_mag": f"{middle:.4f}"}, file="population"
        )
        missing = list(rows)
        for attempt in range(_ATTEMPTS):
            drawn = draws(model, len(rows), seed + 104729 * attempt, plan.priors)
            for i in range(len(rows)):
                if not missing:
                    break
                body = drawn.body(i, plan.material)
                scaled = body.with_(semi_axes=body.semi_axes * (diameter[missing[0]] / size))
                if equilibrium(scaled).admissible:
                    found[missing.pop(0)] = scaled
        if missing:
            raise InvalidInput(
                "priors", plan.priors, "distributions of which at least 5 % are in equilibrium in isolation"
            )
    return [b for b in found if b is not None]
