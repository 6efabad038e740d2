"""Rates of the verdicts of encounters in a population, by planet.

The rate of a verdict is the encounter rate times the probability of the verdict, integrated over periapsis, hyperbolic
excess speed, attitude and the uncertain properties of the bodies. The periapsis is stratified: each stratum has the
same number of sampled encounters, so that the rare deep encounters, which decide the verdict, are well sampled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable, vstack
from astropy.units import Quantity
from scipy.spatial.transform import Rotation

from flybystab.body.body import Body, Material
from flybystab.body.equilibrium import equilibrium
from flybystab.catalogues.asteroid import Asteroid
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.planets import planet
from flybystab.population.rates import EncounterRates, elements_table, encounter_rates
from flybystab.screening.draws import draws
from flybystab.screening.priors import Population
from flybystab.units import to_si, whole

#: Planets that near-Earth asteroids meet.
PLANETS = ("mercury", "venus", "earth", "mars")
#: Strata in periapsis between the surface and the limit.
STRATA = 8
#: Geometric albedo that converts the diameter to the absolute magnitude by which LCDB spin periods are selected.
ALBEDO = 0.14


_NO_SAMPLES = QTable(
    {
        "orbit": np.empty(0, dtype=int),
        "v_inf": np.empty(0) * u.km / u.s,
        "periapsis": np.empty(0) * u.km,
        "planet": np.empty(0, dtype="U16"),
        "verdict": np.empty(0, dtype="U20"),
        "spin_ratio": np.empty(0),
        "weight": np.empty(0) / u.yr,
    }
)


@dataclass(frozen=True, eq=False)
class DisruptionRates:
    """Rates of verdicts in a population.

    Attributes
    ----------
    table : QTable
        One row per planet and verdict: ``planet``, ``verdict``, ``rate`` and its sampling error ``rate_error`` (1/yr,
        of the whole population). A verdict without samples has the rate 0, and its error is the largest weight
        of a sample.
    samples : QTable
        Every sampled encounter: ``planet``, ``orbit``, ``periapsis``, ``v_inf``, ``verdict``, ``spin_ratio`` and
        ``weight`` (1/yr: its contribution to the rate).
    bodies : int
        Orbits of the population.
    diameter : Quantity
    """

    table: QTable
    samples: QTable
    bodies: int
    diameter: Quantity

    def rate(self, verdict: str, planet_name: str | None = None) -> Quantity:
        """Rate of a verdict, 1/yr, over all planets or for one."""
        mask = self.table["verdict"] == str(verdict)
        if planet_name is not None:
            mask &= self.table["planet"] == planet(planet_name).name
        return self.table["rate"][mask].sum()

    def lifetime(self, *verdicts: str) -> Quantity:
        """Mean time, Myr, until a body of the population meets one of the verdicts."""
        total = sum((self.rate(v) for v in verdicts), 0.0 / u.yr)
        return (self.bodies / total).to(u.Myr) if total.value > 0.0 else np.inf * u.Myr

    def spin_change_rate(self, least: float) -> Quantity:
        """Rate, 1/yr, of bodies that stay INTACT and whose spin rate changes by more than the fraction `least`."""
        share = to_si(least, u.dimensionless_unscaled, "least", low=0.0)
        mask = (self.samples["verdict"] == str(Verdict.INTACT)) & (
            np.abs(self.samples["spin_ratio"] - 1.0) > share
        )
        return self.samples["weight"][mask].sum()

    def __repr__(self) -> str:
        return f"<DisruptionRates {self.bodies} orbits, {len(self.samples)} sampled encounters>"


def disruption_rates(
    population: Any,
    planets: Sequence[str] = PLANETS,
    *,
    diameter: Quantity = 1.0 * u.km,
    radii: float = 5.0,
    samples: int = 800,
    seed: int = 0,
    material: Material | None = None,
    priors: Population | None = None,
    workers: int | None = None,
) -> DisruptionRates:
    """Rates of every verdict in a population of asteroids.

    Parameters
    ----------
    population : table, or sequence of Orbit or Asteroid
        As in :func:`flybystab.encounter_rates`.
    planets : sequence of str
    diameter : Quantity
        Of every body; the verdicts of cohesionless bodies do not depend on it, but the drawn spin periods do.
    radii : float
        Encounters up to this many planetary radii from the centre are sampled. At two radii a tenth of the drawn bodies
        yield, between four and five about 1 % (those drawn close to their limit); farther ones are not counted.
    samples : int
        Sampled encounters per planet.
    seed : int
    material : Material, optional
        Yield surface and dilatancy; friction angle and cohesion are drawn.
    priors : flybystab.screening.priors.Population, optional
        Distributions of density, shape, spin period, friction and cohesion.
    workers : int, optional
        Threads; no result depends on it.

    Returns
    -------
    DisruptionRates
        Bodies that are not in equilibrium in isolation are drawn again: the rates are those of bodies that are.
    """
    size = to_si(diameter, u.m, "diameter", low=0.0, open_low=True)
    limit = to_si(radii, u.dimensionless_unscaled, "radii", low=1.0, high=100.0, open_low=True)
    number = whole(samples, "samples", STRATA)
    first = whole(seed, "seed", 0)
    if isinstance(planets, str):
        planets = (planets,)
    if not planets:
        raise InvalidInput("planets", planets, "at least one planet")
    magnitude = 5.0 * np.log10(1.329e6 / (size * np.sqrt(ALBEDO)))
    model = Asteroid(
        {"name": "sample", "diameter_m": f"{size!r}", "H_mag": f"{magnitude:.4f}"}, file="population"
    )
    matter = material or Material()
    tables, rows = [], []
    orbits = elements_table(population)
    for k, name in enumerate(planets):
        body = planet(name)
        edges = body.impact_distance + (limit * body.radius - body.impact_distance) * np.linspace(
            0.0, 1.0, STRATA + 1
        )
        within = [encounter_rates(orbits, body, edge * u.m, workers=workers) for edge in edges]
        rows.append((body.name, str(Verdict.IMPACT), within[0].total.value, 0.0))
        if not within[-1].total.value > 0.0:
            continue
        bodies = _bodies(model, number, first + 7919 * k, priors, matter)
        rng = np.random.default_rng([first, k])
        parts = [
            _stratum(within[i], within[i - 1], bodies[i - 1 :: STRATA], rng, workers)
            for i in range(1, STRATA + 1)
            if within[i].total > within[i - 1].total
        ]
        rows += _rows(body.name, parts)
        tables += parts
    names, verdicts, rates, errors = zip(*rows, strict=True)
    table = QTable(
        {
            "planet": list(names),
            "verdict": list(verdicts),
            "rate": np.array(rates) / u.yr,
            "rate_error": np.array(errors) / u.yr,
        }
    )
    samples_table = vstack(tables) if tables else _NO_SAMPLES.copy()
    return DisruptionRates(table, samples_table, len(orbits), (size * u.m).to(u.km))


def _bodies(
    model: Asteroid, number: int, seed: int, priors: Population | None, material: Material
) -> list[Body]:
    """Drawn bodies that are in equilibrium in isolation."""
    found: list[Body] = []
    for attempt in range(20):
        drawn = draws(model, number, seed + 104729 * attempt, priors)
        many = [drawn.body(i, material) for i in range(number)]
        found += [b for b in many if equilibrium(b).admissible]
        if len(found) >= number:
            return found[:number]
    raise InvalidInput(
        "priors", priors, "distributions of which at least 5 % are in equilibrium in isolation"
    )


def _stratum(
    outer: EncounterRates,
    inner: EncounterRates,
    bodies: list[Body],
    rng: np.random.Generator,
    workers: int | None,
) -> QTable:
    """Sampled encounters between two periapsis distances, their verdicts and weights."""
    sample = outer.sample(len(bodies), int(rng.integers(2**31)), above=inner.periapsis)
    encounters = [
        Encounter.hyperbolic(outer.planet, periapsis=q, v_inf=v)
        for q, v in zip(sample["periapsis"], sample["v_inf"], strict=True)
    ]
    turns = list(Rotation.random(len(bodies), random_state=rng).as_matrix())
    flown = flyby_many(bodies, encounters, turns, workers=workers)
    sample["planet"] = outer.planet.name
    sample["verdict"] = np.asarray(flown.verdict).astype("U20")
    sample["spin_ratio"] = flown.spin_ratio
    counted = ~np.isin(sample["verdict"], ("FAILED", str(Verdict.NOT_IN_EQUILIBRIUM)))
    total = (outer.total - inner.total).value
    sample["weight"] = np.where(counted, total / max(1, int(counted.sum())), 0.0) / u.yr
    return sample


def _rows(name: str, parts: Sequence[QTable]) -> list[tuple[str, str, float, float]]:
    """Rate and sampling error of each verdict at one planet, over its strata."""
    out = []
    for verdict in Verdict:
        if verdict in (Verdict.IMPACT, Verdict.NOT_IN_EQUILIBRIUM):
            continue
        rate, variance, least = 0.0, 0.0, 0.0
        for part in parts:
            weight = part["weight"].value
            n = int(np.count_nonzero(weight))
            if n == 0:
                continue
            share = float(np.mean(part["verdict"][weight > 0.0] == str(verdict)))
            total = float(weight.sum())
            rate += total * share
            variance += total**2 * share * (1.0 - share) / n
            least = max(least, total / n)
        out.append((name, str(verdict), rate, np.sqrt(variance) if rate > 0.0 else least))
    return out
