"""Many bodies through many encounters: which passages could reshape which asteroids, and how likely.

Each asteroid is one task. Its encounters are found; at each one the catalogue body and the samples of
:mod:`flybystab.survey.population` meet the tide. What the bound of :mod:`flybystab.survey.quick` decides is
decided by it, the rest by the dynamics (:mod:`flybystab.survey.judging`). Tasks share nothing, and their
random numbers depend on the seed and the asteroid only, so that any executor gives the same rows.
"""

from __future__ import annotations

import hashlib
import json
import os
import time as clock
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable
from astropy.time import Time
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab import __version__
from flybystab.aggregate.body import Material
from flybystab.constants import AU
from flybystab.errors import FlybystabError, InvalidInput, OutputFailed, WorkersLost
from flybystab.outcome import Verdict
from flybystab.sky.ephemeris import ephemeris
from flybystab.sky.planets import planet
from flybystab.survey.catalogue import Asteroid, catalogue
from flybystab.survey.columns import COLUMNS, SAMPLE_COLUMNS, VERDICTS, YIELDED, share_of
from flybystab.survey.draws import Attitudes, Draws, draws, identity, nominal
from flybystab.survey.formats import foreign, with_physical_data
from flybystab.survey.judging import Judged, Passage, contributors, inputs, judge, judge_each, wilson
from flybystab.survey.population import Population
from flybystab.survey.results import Journal, check_output, table_of, write_rows
from flybystab.survey.spread import Spread, spread
from flybystab.units import to_si, whole

Array = NDArray[np.float64]


#: The margin of the catalogue body is computed, not bounded, where the bound is this far from rest, rad.
SHARP = float(np.radians(0.01))


@dataclass(frozen=True)
class Settings:
    """What a screening computes, apart from the list of asteroids.

    Attributes
    ----------
    start, stop : float
        Julian dates, TDB.
    planets : tuple of str
    within : float
        Largest distance, m.
    samples, seed : int
    material : Material
        Of the catalogue body; yield surface and dilatancy also of the samples.
    population : Population
    tolerance : float
        Step tolerance of the dynamics.
    keep_samples : bool
        Return the samples, too.
    """

    start: float
    stop: float
    planets: tuple[str, ...]
    within: float
    samples: int
    seed: int
    material: Material
    population: Population
    tolerance: float = 1e-7
    keep_samples: bool = False

    def stated(self) -> dict[str, Any]:
        """Everything that fixes the rows, as plain data."""
        m = self.material
        return {
            "start_jd_tdb": self.start,
            "stop_jd_tdb": self.stop,
            "planets": list(self.planets),
            "within_au": self.within / AU,
            "samples": self.samples,
            "seed": self.seed,
            "friction_angle_deg": float(np.rad2deg(m.phi)),
            "cohesion_Pa": m.c_pa,
            "yield_surface": m.yield_surface,
            "dilatancy": m.dilatancy,
            "brittle": m.brittle,
            "population": self.population.stated(),
            "tolerance": self.tolerance,
            "flybystab": __version__,
        }


def screen_passage(passage: Passage, settings: Settings) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Row of one encounter, and the rows of its samples if they are kept."""
    asteroid, material = passage.asteroid, settings.material
    where = (passage.planet, f"{passage.time.tdb.jd:.1f}")
    row = _head(asteroid, settings) | {
        "planet": passage.planet,
        "time_tdb": passage.time.tdb.isot,
        "jd_tdb": float(passage.time.tdb.jd),
        "distance": passage.distance / AU,
        "v_inf": passage.v_inf / 1000.0,
    }
    try:
        known = nominal(asteroid, material, settings.population)
        attitude = Attitudes.at(asteroid, known, settings.seed, "nominal", *where)
        main = judge(
            passage, known, attitude, material, tolerance=settings.tolerance, sharp=SHARP, measure=True
        )
    except FlybystabError as error:
        return row | {"error": f"{type(error).__name__}: {error}"}, []
    row |= {
        "verdict": main.verdict[0],
        "margin": float(np.rad2deg(main.margin[0])),
        "decided_by": "dynamics" if main.dynamic[0] else "bound",
        "required_friction_at_rest": float(np.rad2deg(main.rest[0])),
        "friction_rise": float(np.rad2deg(_rise(known.phi[0] - main.margin[0], main.rest[0]))),
        "numerical_error": main.numerical,
        "error": main.error[0],
        "assumed": "; ".join(
            (*asteroid.assumptions, *(d for d in known.drawn if d.split(" (")[0] not in asteroid.assumptions))
        ),
        "forces": "; ".join(passage.encounter.forces)
        if passage.encounter
        else "bound on the tide of all bodies",
        **{f"semi_axis_{x}": float(a) for x, a in zip("abc", known.axes[0], strict=True)},
        "density": float(known.rho[0]),
        "spin_period": float(known.period[0]) / 3600.0,
        "samples": 0,
        "samples_dynamic": 0,
    }
    if settings.samples <= 1:
        return row, []
    draw = draws(asteroid, settings.samples, settings.seed, settings.population)
    attitudes = Attitudes.at(asteroid, draw, settings.seed, *where)
    orbits = spread(passage, settings.samples, settings.seed)
    if orbits.passages is None:
        result = judge(passage, draw, attitudes, material, tolerance=settings.tolerance)
    else:
        result = judge_each(orbits.passages, draw, attitudes, material, tolerance=settings.tolerance)
    distances = _distances(passage, orbits, settings.samples)
    counts = Counter(result.verdict)
    judged = settings.samples - counts[""]
    stands = judged - counts[Verdict.NOT_IN_EQUILIBRIUM]
    yielded = sum(counts[v] for v in YIELDED)
    low, high = wilson(yielded, stands)
    row |= {
        "samples": judged,
        "samples_dynamic": int(result.dynamic.sum()),
        **{share_of(v): counts[v] / judged if judged else np.nan for v in VERDICTS},
        "p_yield": yielded / stands if stands else np.nan,
        "p_yield_low": low,
        "p_yield_high": high,
        "distance_sigma": orbits.sigma / 1000.0,
        "contributors": contributors(inputs(draw) | {"distance": distances}, result.margin),
        "drawn": "; ".join((*draw.drawn, *(("orbit",) if orbits.passages else ()))),
        "assumed": "; ".join(filter(None, (row["assumed"], orbits.note))),
    }
    failures = [e for e in result.error if e]
    if failures and not row["error"]:
        row["error"] = f"{len(failures)} samples: {failures[0]}"
    if not settings.keep_samples:
        return row, []
    return row, list(_samples(passage, distances, draw, attitudes, result))


def _distances(passage: Passage, orbits: Spread, samples: int) -> Array:
    """Distance of each sample's passage, m."""
    if orbits.passages is None:
        return np.full(samples, passage.distance)
    return np.array([p.distance for p in orbits.passages])


def _rise(most: float, rest: float) -> float:
    """What a passage adds to the mobilised friction; inf beyond any friction, nan if rest needs that, too."""
    return most - rest if np.isfinite(rest) else np.nan


def _samples(
    passage: Passage, distances: Array, draw: Draws, attitudes: Attitudes, result: Judged
) -> Iterator[dict[str, Any]]:
    for i in range(len(draw.rho)):
        pole = attitudes.pole(i)
        yield {
            "asteroid": passage.asteroid.name,
            "planet": passage.planet,
            "jd_tdb": float(passage.time.tdb.jd),
            "sample": i,
            "distance": float(distances[i]) / AU,
            **{f"semi_axis_{x}": float(a) for x, a in zip("abc", draw.axes[i], strict=True)},
            "density": float(draw.rho[i]),
            "spin_period": float(draw.period[i]) / 3600.0,
            "friction_angle": float(np.rad2deg(draw.phi[i])),
            "cohesion": float(draw.cohesion[i]),
            **{f"pole_{x}": float(n) for x, n in zip("xyz", pole, strict=True)},
            "angle": 360.0 * float(attitudes.uniform[i, 2]),
            "phase": float(draw.phase[i]),
            "verdict": str(result.verdict[i]),
            "margin": float(np.rad2deg(result.margin[i])),
            "decided_by": "dynamics" if result.dynamic[i] else "bound",
            "error": result.error[i],
        }


def _head(asteroid: Asteroid, settings: Settings) -> dict[str, Any]:
    return {
        "asteroid": asteroid.name,
        "number": -1 if asteroid.number is None else asteroid.number,
        "friction_angle": float(np.rad2deg(settings.material.phi)),
        "cohesion": settings.material.c_pa,
        "yield_surface": settings.material.yield_surface,
        "seed": settings.seed,
        "orbit": asteroid.row.get("orbit_solution", ""),
        "catalogue": asteroid.file,
        "ephemeris": ephemeris().name,
        "version": __version__,
    }


def passages(asteroid: Asteroid, settings: Settings) -> list[Passage]:
    """Encounters of an asteroid, in time."""
    from flybystab.sky.finder import find_encounters

    table = find_encounters(
        asteroid.orbit,
        Time(settings.start, format="jd", scale="tdb"),
        Time(settings.stop, format="jd", scale="tdb"),
        planets=list(settings.planets),
        within=settings.within * u.m,
        threads=1,
    )
    found = [
        Passage(
            asteroid,
            str(row["planet"]),
            row["time"],
            float(row["distance"].to_value(u.m)),
            float(row["v_inf"].to_value(u.m / u.s)),
        )
        for row in table
    ]
    return sorted(found, key=lambda p: (p.time.tdb.jd, p.planet))


#: What finds the passages of an asteroid: a function that workers can import.
Finder = Callable[[Asteroid, Settings], list[Passage]]


def screen_asteroid(
    asteroid: Asteroid, settings: Settings, finder: Finder = passages
) -> dict[str, list[dict[str, Any]]]:
    """All rows of one asteroid: the unit of work. What fails is a row that says why."""
    try:
        found = finder(asteroid, settings)
    except FlybystabError as error:
        return {
            "rows": [_head(asteroid, settings) | {"error": f"{type(error).__name__}: {error}"}],
            "samples": [],
        }
    rows, samples = [], []
    for passage in found:
        row, more = screen_passage(passage, settings)
        rows.append(row)
        samples += more
    return {"rows": rows, "samples": samples}


def _work(
    asteroids: list[Asteroid], settings: Settings, finder: Finder
) -> list[dict[str, list[dict[str, Any]]]]:
    return [screen_asteroid(a, settings, finder) for a in asteroids]


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes
    ----------
    done, total : int
        Asteroids.
    resumed : int
        Of these, from a former run.
    rows : int
        Encounters.
    verdicts : dict of str to int
        Encounters by verdict; "error" counts rows that failed.
    seconds : float
        Since this run began.
    """

    done: int
    total: int
    resumed: int
    rows: int
    verdicts: dict[str, int]
    seconds: float

    @property
    def rate(self) -> float:
        """Asteroids per second in this run."""
        return (self.done - self.resumed) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def remaining(self) -> float:
        """Seconds left at this rate."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else np.inf


class Screening:
    """A screening that can be run, stopped and taken up again.

    Parameters
    ----------
    asteroids : sequence of Asteroid
    settings : Settings
    finder : callable
        Finds the passages of an asteroid; those of its orbit by default.
    """

    def __init__(self, asteroids: Sequence[Asteroid], settings: Settings, finder: Finder = passages) -> None:
        self.asteroids = tuple(asteroids)
        self.settings = settings
        self.finder = finder

    def meta(self, *, complete: bool = True) -> dict[str, Any]:
        """Provenance of the table."""
        files = sorted({a.file for a in self.asteroids})
        return {
            "title": "encounters of asteroids and what they do to rubble piles",
            "time_scale": "TDB",
            "frame": "ICRF",
            "complete": complete,
            "asteroids": len(self.asteroids),
            "catalogue": files if len(files) > 1 else (files[0] if files else ""),
            "ephemeris": ephemeris().name,
            "settings": self.settings.stated(),
            "nominal": "catalogue values and the material given; unknown poles and angles are drawn",
        }

    def fingerprint(self) -> dict[str, Any]:
        """What must agree for two runs to share a journal."""
        digest = hashlib.sha256()
        for a in self.asteroids:
            digest.update(json.dumps(sorted(a.row.items())).encode())
            if a.covariance is not None:
                digest.update(a.covariance.values.tobytes() + a.covariance.matrix.tobytes())
        settings = json.dumps(self.settings.stated() | {"ephemeris": ephemeris().name}, sort_keys=True)
        digest.update(settings.encode())
        return {
            "flybystab": __version__,
            "run": digest.hexdigest(),
            "samples": self.settings.keep_samples,
            "settings": self.settings.stated() | {"asteroids": len(self.asteroids)},
        }

    def results(
        self,
        executor: Executor | None = None,
        *,
        skip: Iterable[int] = (),
        chunk: int = 1,
        window: int | None = None,
    ) -> Iterator[tuple[int, dict[str, list[dict[str, Any]]]]]:
        """Results of the asteroids that are not in `skip`, as they are done: (position, result).

        Parameters
        ----------
        executor : concurrent.futures.Executor, optional
            Anything with ``submit``; without it, here.
        chunk : int
            Asteroids in one call of a worker.
        window : int, optional
            Calls in flight at a time: memory does not grow with the length of the list.
        """
        done = set(skip)
        todo = [i for i in range(len(self.asteroids)) if i not in done]
        if executor is None:
            for i in todo:
                yield i, screen_asteroid(self.asteroids[i], self.settings, self.finder)
            return
        chunks = iter([todo[k : k + chunk] for k in range(0, len(todo), chunk)])
        limit = window or 4 * int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)
        pending: dict[Future[Any], list[int]] = {}
        try:
            while True:
                while len(pending) < limit and (part := next(chunks, None)) is not None:
                    future = executor.submit(
                        _work, [self.asteroids[i] for i in part], self.settings, self.finder
                    )
                    pending[future] = part
                if not pending:
                    return
                finished, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    part = pending.pop(future)
                    try:
                        results = future.result()
                    except (BrokenExecutor, CancelledError) as error:
                        lost = ", ".join(self.asteroids[i].name for i in part)
                        raise WorkersLost(f"workers died or went away ({error}); in work: {lost}") from None
                    yield from zip(part, results, strict=True)
        finally:
            for future in pending:
                future.cancel()

    def run(
        self,
        output: str | Path,
        *,
        samples_output: str | Path | None = None,
        executor: Executor | None = None,
        chunk: int = 1,
        progress: Callable[[Progress], None] | None = None,
    ) -> Progress:
        """Compute what is missing and write the files.

        Parameters
        ----------
        output : str or Path
            Table of encounters, ``.ecsv`` or ``.parquet``. Its journal stands next to it meanwhile.
        samples_output : str or Path, optional
            Table of samples; needs ``keep_samples`` in the settings.

        Raises
        ------
        InvalidInput, MissingExtra
            The output cannot be written, or another run's journal is in the way: before anything is computed.
        WorkersLost
            Processes of the executor died; the rows so far are in the file and the same call goes on.
        OutputFailed
            The disk is full, or gone, in the middle; the rows so far are in the journal and the same call goes on.
        KeyboardInterrupt
            After the rows so far have been written into a valid file; the same call goes on later.
        """
        out = check_output(output)
        extra = None if samples_output is None else check_output(samples_output)
        if extra is not None and not self.settings.keep_samples:
            raise InvalidInput("samples_output", str(extra), "keep_samples in the settings")
        journal = Journal(out.with_name(out.name + ".journal"), self.fingerprint())
        began = clock.monotonic()
        resumed = len(journal.where)
        counts: Counter[str] = Counter()
        rows = 0
        complete = False

        def state() -> Progress:
            return Progress(
                len(journal.where),
                len(self.asteroids),
                resumed,
                rows,
                dict(counts),
                clock.monotonic() - began,
            )

        def tell() -> None:
            if progress is not None:
                progress(state())

        for task in journal.tasks():
            rows += len(task["rows"])
            counts.update(r.get("verdict") or "error" for r in task["rows"])
        unwritten: OSError | None = None
        try:
            tell()
            for i, result in self.results(executor, skip=journal.where, chunk=chunk):
                try:
                    journal.add(i, result)
                except OSError as error:
                    unwritten = error
                    break
                rows += len(result["rows"])
                counts.update(r.get("verdict") or "error" for r in result["rows"])
                tell()
            complete = unwritten is None
        finally:
            meta = self.meta(complete=complete)
            try:
                write_rows((r for t in journal.tasks() for r in t["rows"]), out, COLUMNS, meta)
                if extra is not None:
                    write_rows(
                        (r for t in journal.tasks() for r in t["samples"]), extra, SAMPLE_COLUMNS, meta
                    )
            except OSError as error:
                unwritten = error
            journal.close(remove=complete and unwritten is None)
            if unwritten is not None:
                raise OutputFailed(
                    f"{out.parent} cannot be written any more ({unwritten.strerror}). {len(journal.where)} of "
                    f"{len(self.asteroids)} asteroids are safe in {journal.path}: make room and start the same "
                    "run again"
                )
        return state()


def settings(
    start: Time | str,
    stop: Time | str,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    samples: int = 1,
    seed: int = 0,
    material: Material | None = None,
    population: Population | None = None,
    *,
    tolerance: float = 1e-7,
    keep_samples: bool = False,
) -> Settings:
    """Checked settings of a screening (arguments of :func:`screen`)."""
    dates = []
    for name, date in (("start", start), ("stop", stop)):
        try:
            dates.append(float(Time(date, scale="tdb").jd if isinstance(date, str) else date.tdb.jd))
        except (ValueError, AttributeError, TypeError):
            raise InvalidInput(
                name, date, "an astropy Time or an ISO date such as 2029-04-13 (TDB)"
            ) from None
    if not dates[0] < dates[1]:
        raise InvalidInput("stop", stop, f"a date after start = {start}")
    for name, number, least in (("samples", samples, 1), ("seed", seed, 0)):
        whole(number, name, least)
    ephemeris().check(*(Time(d, format="jd", scale="tdb") for d in dates))
    names = (planets,) if isinstance(planets, str) else tuple(planets)
    if not names:
        raise InvalidInput("planets", planets, "at least one planet")
    return Settings(
        start=dates[0],
        stop=dates[1],
        planets=tuple(planet(p).name for p in names),
        within=to_si(within, u.m, "within", low=0.0, open_low=True),
        samples=int(samples),
        seed=int(seed),
        material=material or Material(),
        population=population or Population(),
        tolerance=tolerance,
        keep_samples=keep_samples,
    )


def screen(
    asteroids: str | Path | Sequence[Asteroid | str | int | Path] | None,
    start: Time | str,
    stop: Time | str,
    planets: Sequence[str] = ("earth",),
    within: Quantity = 0.05 * u.au,
    samples: int = 1,
    seed: int = 0,
    executor: Executor | None = None,
    material: Material | None = None,
    population: Population | None = None,
    *,
    tolerance: float = 1e-7,
    progress: Callable[[Progress], None] | None = None,
    finder: Finder = passages,
) -> QTable:
    """What the encounters of asteroids do to them as rubble piles.

    Parameters
    ----------
    asteroids : sequence of Asteroid, str or int, or a path, or None
        Asteroids, their names in the embedded catalogue, or paths of catalogue files (:func:`catalogue`); None
        for the embedded catalogue.
    start, stop : Time or str
        Span; text is read as TDB.
    planets : sequence of str
        Planets whose encounters count.
    within : Quantity
        Largest distance of an encounter.
    samples : int
        Above one: draws of the uncertain inputs for every encounter, beside the catalogue's values.
    seed : int
        Fixes every draw, for any executor.
    executor : concurrent.futures.Executor, optional
        Where the asteroids are computed; here and one by one without it.
    material : Material, optional
        Of the catalogue body: 35 deg and no cohesion by default. Samples draw theirs from `population`.
    population : Population, optional
        Distributions of what is not known.
    tolerance : float
        Step tolerance of the dynamics.
    progress : callable, optional
        Called with a :class:`Progress` after every asteroid.
    finder : callable
        Finds the passages of an asteroid, instead of its orbit.

    Returns
    -------
    QTable
        One row per encounter (:data:`COLUMNS`), by asteroid and time; provenance in ``meta``.

    Notes
    -----
    For long runs use :meth:`Screening.run`, which writes to a file and can be taken up again.
    """
    chosen = listed(asteroids)
    wanted = settings(start, stop, planets, within, samples, seed, material, population, tolerance=tolerance)
    run = Screening(chosen, wanted, finder)
    began = clock.monotonic()
    found: dict[int, list[dict[str, Any]]] = {}
    counts: Counter[str] = Counter()
    for i, result in run.results(executor):
        found[i] = result["rows"]
        counts.update(r.get("verdict") or "error" for r in result["rows"])
        if progress is not None:
            rows = sum(counts.values())
            progress(Progress(len(found), len(chosen), 0, rows, dict(counts), clock.monotonic() - began))
    return table_of((r for i in sorted(found) for r in found[i]), COLUMNS, run.meta())


def listed(asteroids: str | Path | Sequence[Asteroid | str | int | Path] | None) -> tuple[Asteroid, ...]:
    """Asteroids from what `screen` accepts; bodies of tables of orbits are completed from the embedded tables."""
    if asteroids is None:
        return catalogue()
    if isinstance(asteroids, str | Path):
        asteroids = [Path(asteroids)]
    found: list[Asteroid] = []
    for a in asteroids:
        if isinstance(a, Asteroid):
            found.append(a)
        elif isinstance(a, Path):
            rows = catalogue(a)
            found += with_physical_data(rows) if any(map(foreign, rows)) else rows
        else:
            found.append(Asteroid.from_catalogue(a))
    if not found:
        raise InvalidInput("asteroids", asteroids, "at least one asteroid")
    keys = Counter(identity(a) for a in found)
    twice = [k for k, n in keys.items() if n > 1]
    if twice:
        raise InvalidInput("asteroids", ", ".join(twice), "every asteroid once")
    return tuple(found)
