"""Rates of the verdicts of encounters in a population, by planet.

The rate of a verdict is the encounter rate times the probability of the verdict, integrated over periapsis, hyperbolic
excess speed, attitude and the uncertain properties of the bodies. The periapsis is stratified: each stratum has the
same number of sampled encounters, so that the rare deep encounters, which decide the verdict, are well sampled.
"""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable, vstack
from astropy.units import Quantity

from flybystab._version import __version__
from flybystab.arguments import check_arguments
from flybystab.body.body import Material, refuse_cut_off
from flybystab.core.numerics.threads import first_completed, interrupts_deferred
from flybystab.errors import FlybystabWarning, InvalidInput
from flybystab.flybys.verdict import Verdict
from flybystab.orbit.planets import planet
from flybystab.population.rates import EncounterRates, Orbits, elements_table
from flybystab.population.sampled_encounters import LISTED_FRAGMENTS, Plan, impact_and_total, sampled
from flybystab.population.verdict_rates import DisruptionRates
from flybystab.progress import Progressing, progress_bar
from flybystab.screening.journal import Journal
from flybystab.screening.priors import Population
from flybystab.typing import Document
from flybystab.units import to_si, whole

#: Planets that near-Earth asteroids encounter.
PLANETS = ("mercury", "venus", "earth", "mars")
#: Strata in periapsis between the surface and the limit.
STRATA = 8


@check_arguments
def disruption_rates(
    population: Orbits,
    planets: Sequence[str] = PLANETS,
    *,
    diameter: Quantity | None = 1.0 * u.km,
    radii: float = 5.0,
    samples: int = 800,
    seed: int = 0,
    material: Material | None = None,
    priors: Population | None = None,
    grains: int | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    journal: str | Path | None = None,
    progress: Progressing = None,
) -> DisruptionRates:
    """Rates of every verdict in a population of asteroids.

    Parameters
    ----------
    population : table, or sequence of Orbit or Asteroid
        As in :func:`flybystab.encounter_rates`.
    planets : sequence of str
    diameter : Quantity or None
        Of every body; None for the sizes that follow from the absolute magnitudes ``H`` of the population and the prior
        of the albedo. The verdicts of cohesionless bodies depend on size through their spin periods only.
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
    grains : int, optional
        Number of grains of the pile that replaces the ellipsoid after the verdicts BEYOND MODEL, MASS LOSS and
        DISRUPTED: a few seconds for each. Without it such bodies keep the verdict of the ellipsoid.
    workers : int, optional
        Number of threads; results do not depend on it.
    executor : concurrent.futures.Executor, optional
        Computes the strata, such as processes or the executor of a dask client; results do not depend on it.
    journal : str or Path, optional
        File in which finished strata are kept: the same call resumes an interrupted run. Removed at the end.
    progress : bool or function, optional
        Whether to show a bar (:mod:`flybystab.progress`); after two seconds on a terminal by default.

    Returns
    -------
    DisruptionRates
        Bodies that are not in equilibrium in isolation are drawn again: the rates are those of bodies that are.

    Raises
    ------
    InvalidInput, UnitMismatch, UnknownName
    """
    plan = _plan(population, planets, diameter, radii, samples, seed, material, priors, grains)
    rates = {name: impact_and_total(plan, name, workers) for name in plan.planets}
    tasks = [
        (k, i)
        for k, name in enumerate(plan.planets)
        for i in range(STRATA)
        if rates[name][0].total.value > 0.0
    ]
    parts: dict[tuple[int, int], QTable] = {}
    with (
        _journal(journal, plan) as book,
        progress_bar(progress, len(tasks), "strata", "rates of verdicts") as tick,
    ):
        if book is not None:
            parts |= {tasks[done["task"]]: _restored(done["columns"]) for done in book.tasks()}
        todo = [(n, t) for n, t in enumerate(tasks) if t not in parts]
        for number, task, table in _results(plan, todo, rates, workers, executor):
            parts[task] = table
            if book is not None:
                book.add(number, {"columns": _stored(table)})
            tick(len(parts))
    return _joined(plan, rates, parts)


def _plan(
    population: Orbits,
    planets: Sequence[str],
    diameter: Quantity | None,
    radii: float,
    samples: int,
    seed: int,
    material: Material | None,
    priors: Population | None,
    grains: int | None,
) -> Plan:
    """Checked arguments of :func:`disruption_rates`."""
    size = np.nan if diameter is None else to_si(diameter, u.m, "diameter", low=0.0, open_low=True)
    limit = to_si(radii, u.dimensionless_unscaled, "radii", low=1.0, high=100.0, open_low=True)
    number, first = whole(samples, "samples", STRATA), whole(seed, "seed", 0)
    if isinstance(planets, str):
        planets = (planets,)
    if not planets:
        raise InvalidInput("planets", planets, "at least one planet")
    orbits = elements_table(population)
    if diameter is None and "H" not in orbits.colnames:
        raise InvalidInput("diameter", None, "a diameter, or a population with absolute magnitudes H")
    refuse_cut_off(material or Material(), "disruption_rates")
    return Plan(
        orbits,
        tuple(planet(name).name for name in planets),
        tuple(1.0 + (limit - 1.0) * np.linspace(0.0, 1.0, STRATA + 1)),
        max(1, number // STRATA),
        first,
        size,
        material or Material(),
        priors or Population(),
        0 if grains is None else whole(grains, "grains", 1),
    )


@contextmanager
def _journal(path: str | Path | None, plan: Plan) -> Iterator[Journal | None]:
    """The journal of a run, removed when the run ends without an error; None without a path."""
    if path is None:
        yield None
        return
    book = Journal(Path(path), _fingerprint(plan))
    try:
        if book.damaged:
            warnings.warn(
                f"{book.path} is damaged in {len(book.damaged)} of its lines; these strata are recomputed",
                FlybystabWarning,
                stacklevel=5,
            )
        yield book
    except BaseException:
        book.close()
        raise
    book.close(remove=True)


def _results(
    plan: Plan,
    todo: Sequence[tuple[int, tuple[int, int]]],
    rates: dict[str, tuple[EncounterRates, float]],
    workers: int | None,
    executor: Executor | None,
) -> Iterator[tuple[int, tuple[int, int], QTable]]:
    """Strata in order of completion, on the executor or one by one."""
    if executor is None:
        for number, (k, i) in todo:
            yield number, (k, i), sampled(plan, k, i, rates[plan.planets[k]][0], workers)
        return
    with interrupts_deferred():
        calls = {executor.submit(_task, plan, k, i): (number, (k, i)) for number, (k, i) in todo}
    try:
        while calls:
            for call in first_completed(calls):
                yield *calls.pop(call), call.result()
    finally:
        with interrupts_deferred():
            for call in calls:
                call.cancel()


def _task(plan: Plan, planet_index: int, stratum: int) -> QTable:
    """One stratum in a worker of an executor."""
    rates, _ = impact_and_total(plan, plan.planets[planet_index], 1)
    return sampled(plan, planet_index, stratum, rates, 1)


def _fingerprint(plan: Plan) -> Document:
    """Description of a run: two runs share a journal only if it agrees."""
    digest = hashlib.sha256()
    for name in plan.orbits.colnames:
        column = plan.orbits[name]
        digest.update(name.encode() + np.ascontiguousarray(getattr(column, "value", column)).tobytes())
    digest.update(repr((plan.material, plan.priors)).encode())
    return {
        "flybystab": __version__,
        "run": digest.hexdigest(),
        "settings": {
            "planets": list(plan.planets),
            "radii": plan.edges[-1],
            "samples": plan.samples,
            "seed": plan.seed,
            "diameter_m": None if np.isnan(plan.diameter) else plan.diameter,
            "grains": plan.grains,
        },
    }


def _stored(table: QTable) -> Document:
    """Columns of a table as lists, with their units."""
    return {
        name: [np.asarray(getattr(table[name], "value", table[name])).tolist(), str(table[name].unit or "")]
        for name in table.colnames
    }


def _restored(columns: Document) -> QTable:
    """Inverse of `_stored`."""
    return QTable(
        {
            name: np.array(values) * u.Unit(unit) if unit else np.array(values)
            for name, (values, unit) in columns.items()
        }
    )


def _joined(
    plan: Plan, rates: dict[str, tuple[EncounterRates, float]], parts: dict[tuple[int, int], QTable]
) -> DisruptionRates:
    rows: list[tuple[str, str, float, float]] = []
    tables: list[QTable] = []
    for k, name in enumerate(plan.planets):
        total, impact = rates[name]
        if not total.total.value > 0.0:
            rows.append((name, str(Verdict.IMPACT), 0.0, 0.0))
            continue
        strata = [parts[k, i] for i in range(STRATA) if len(parts[k, i])]
        rows += _rows(name, strata, impact)
        tables += strata
    names, verdicts, values, errors = zip(*rows, strict=True)
    table = QTable(
        {
            "planet": list(names),
            "verdict": list(verdicts),
            "rate": np.array(values) / u.yr,
            "rate_error": np.array(errors) / u.yr,
        }
    )
    weight = plan.orbits["weight"] if "weight" in plan.orbits.colnames else np.ones(len(plan.orbits))
    size = None if np.isnan(plan.diameter) else (plan.diameter * u.m).to(u.km)
    joined = vstack(tables) if tables else _no_samples()
    return DisruptionRates(table, joined, float(np.sum(weight)), size)


def _no_samples() -> QTable:
    """The table of samples without rows."""
    texts, numbers = ("planet", "verdict", "model"), ("orbit", "fragments")
    units = {"v_inf": u.km / u.s, "periapsis": u.km, "diameter": u.km, "spin_period": u.h, "weight": 1 / u.yr}
    table = QTable({name: np.empty(0, dtype=int) for name in numbers})
    for name in texts:
        table[name] = np.empty(0, dtype="U20")
    for name, unit in units.items():
        table[name] = np.empty(0) * unit
    for name in ("spin_ratio", "elongation_before", "elongation", "largest_fraction"):
        table[name] = np.empty(0)
    table["fragment_fractions"] = np.empty((0, LISTED_FRAGMENTS))
    return table


def _rows(name: str, parts: Sequence[QTable], impact: float) -> list[tuple[str, str, float, float]]:
    """Rate and sampling error of each verdict at one planet, over its strata.

    Impacts of the centre of mass have the rate `impact` (1/yr) without error; bodies of the samples that touch the
    ground or the atmosphere with any part are added to them.
    """
    out = []
    for verdict in (Verdict.IMPACT, *(v for v in Verdict if v != Verdict.IMPACT)):
        if verdict == Verdict.NOT_IN_EQUILIBRIUM:
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
        if verdict == Verdict.IMPACT:
            out.append((name, str(verdict), impact + rate, float(np.sqrt(variance))))
        else:
            out.append((name, str(verdict), rate, float(np.sqrt(variance)) if rate > 0.0 else least))
    return out
