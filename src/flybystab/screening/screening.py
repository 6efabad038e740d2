"""Screening: verdicts on the encounters of many asteroids, with probabilities.

Each asteroid is one task (:mod:`flybystab.screening.tasks`). Its encounters are found on its orbit, in one search for
up to 64 asteroids. For each encounter verdicts are computed for the catalogue body and for samples drawn from
:mod:`flybystab.screening.priors`. For most of them the bound of :mod:`flybystab.core.ellipsoid.yield_bound` proves that
the body does not yield; the others are integrated (:mod:`flybystab.screening.sample_verdicts`), in parts that are
distributed over all workers where there are many. Tasks are independent. Their random numbers depend on the seed, the
asteroid and the sample only, so that the rows do not depend on the executor.

:func:`screen` returns a table; :meth:`Screening.run` writes one and can be resumed
(:mod:`flybystab.screening.resumable_run`).
"""

from __future__ import annotations

import hashlib
import json
import time as clock
from collections import Counter
from collections.abc import Callable, Container, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path

import astropy.units as u
from astropy.time import Time
from astropy.units import Quantity

from flybystab._version import __version__
from flybystab.arguments import check_arguments
from flybystab.body.body import Material
from flybystab.catalogues.catalogue import Asteroid
from flybystab.orbit.ephemeris import ephemeris
from flybystab.progress import check_progress, progress_bar
from flybystab.result_table import ResultTable
from flybystab.screening.columns import COLUMNS
from flybystab.screening.encounters import Finder, close_approaches
from flybystab.screening.priors import Population
from flybystab.screening.progress import Progress
from flybystab.screening.result_rows import Row
from flybystab.screening.results import table_of
from flybystab.screening.resumable_run import ResumableRun, output_tables
from flybystab.screening.scheduling import Parts, SerialExecutor, scheduled, window_of
from flybystab.screening.selection import listed
from flybystab.screening.settings import Settings, settings
from flybystab.screening.tasks import Rows, block_of
from flybystab.typing import Document


class Screening:
    """A screening that can be run, interrupted and resumed.

    Parameters
    ----------
    asteroids : sequence of Asteroid
    settings : Settings
    finder : callable
        Finds the encounters of an asteroid; by default those of its orbit. One with a method ``batch``
        (:class:`flybystab.screening.encounters.BatchFinder`) searches for many asteroids at once.
    """

    def __init__(
        self, asteroids: Sequence[Asteroid], settings: Settings, finder: Finder = close_approaches
    ) -> None:
        self.asteroids = tuple(asteroids)
        self.settings = settings
        self.finder = finder

    def meta(self, *, complete: bool = True) -> Document:
        """Provenance of the table."""
        files = sorted({a.file for a in self.asteroids})
        return {
            "title": "encounters of asteroids and their effect on rubble piles",
            "time_scale": "TDB",
            "frame": "ICRF",
            "complete": complete,
            "asteroids": len(self.asteroids),
            "catalogue": files if len(files) > 1 else (files[0] if files else ""),
            "ephemeris": ephemeris().name,
            "settings": self.settings.stated(),
            "nominal": "catalogue values and the material given; unknown poles and angles are drawn",
        }

    def fingerprint(self) -> Document:
        """Settings that must agree for two runs to share a journal."""
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
        skip: Container[int] = (),
        chunk: int = 1,
        window: int | None = None,
        block: int | None = None,
        report: Callable[[float], None] | None = None,
        parts: Parts | None = None,
    ) -> Iterator[tuple[int, Rows]]:
        """Results of the asteroids that are not in `skip`, in order of completion: (position, result).

        Parameters
        ----------
        executor : concurrent.futures.Executor, optional
            Anything with ``submit``; by default this process.
        chunk : int
            Asteroids in one call of a worker.
        window : int, optional
            Calls in flight at a time; four per worker by default.
        block : int, optional
            Samples that are integrated in one call of a worker. The rows do not depend on it.
        report : callable, optional
            Called with the completed fractions of the asteroids in progress, summed.
        parts : Parts, optional
            Stores finished parts of long tasks, and holds those of an earlier run.
        """
        todo = (i for i in range(len(self.asteroids)) if i not in skip)
        if executor is None:
            executor, window = SerialExecutor(), 1
        yield from scheduled(
            self.asteroids,
            todo,
            self.settings,
            self.finder,
            executor,
            chunk=chunk,
            window=window or window_of(executor),
            block=block or block_of(self.settings.samples),
            report=report,
            parts=parts,
        )

    def run(
        self,
        output: str | Path,
        *,
        samples_output: str | Path | None = None,
        overwrite: bool = False,
        executor: Executor | None = None,
        chunk: int = 1,
        progress: Callable[[Progress], None] | None = None,
    ) -> Progress:
        """Compute the missing results and write the files.

        Parameters
        ----------
        output : str or Path
            Table of encounters, ``.ecsv`` or ``.parquet``. The journal is kept beside it until the run ends.
        samples_output : str or Path, optional
            Table of samples; needs ``keep_samples`` in the settings.
        overwrite : bool
            Replace existing tables of these names. The tables of the run that this one resumes are always
            replaced.

        Raises
        ------
        InvalidInput, MissingExtra
            The output cannot be written or exists already, or the journal belongs to another run. Raised before
            anything is computed.
        WorkersLost
            Processes of the executor died; the rows so far are in the file and the same call resumes the run.
        OutputFailed
            The disk became full or unavailable, or another program created a file of the output's name; the rows
            so far are in the journal and the same call resumes the run.
        KeyboardInterrupt
            After the rows so far have been written to a valid file; the same call resumes the run.
        """
        run = ResumableRun(
            output_tables(output, samples_output, keep_samples=self.settings.keep_samples),
            len(self.asteroids),
            lambda complete: self.meta(complete=complete),
            self.fingerprint(),
            overwrite=overwrite,
            progress=progress,
        )
        return run.finish(
            lambda journal, report, kept: self.results(
                executor, skip=journal, chunk=chunk, report=report, parts=kept
            )
        )


@check_arguments
def screen(
    asteroids: str | Path | Asteroid | Sequence[Asteroid | str | int | Path] | None,
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
    grains: int | None = None,
    progress: bool | Callable[[Progress], None] | None = None,
    finder: Finder = close_approaches,
) -> ResultTable:
    """Verdicts on the encounters of asteroids, modelled as rubble piles.

    Parameters
    ----------
    asteroids : sequence of Asteroid, str or int, or a path or name, or None
        Asteroids, their names in the embedded catalogue, or paths of catalogue files (:func:`catalogue`); None
        for the embedded catalogue.
    start, stop : Time or str
        Span; text is read as TDB.
    planets : sequence of str
        Planets whose encounters count.
    within : Quantity
        Largest distance of an encounter.
    samples : int
        Number of samples of the uncertain inputs per encounter, in addition to the catalogue values; 1 for none.
    seed : int
        Seed of all random numbers.
    executor : concurrent.futures.Executor, optional
        Computes the asteroids, by default one by one in this process; results do not depend on it.
    material : Material, optional
        Of the catalogue body: 35 deg and no cohesion by default. Samples draw theirs from `population`.
    population : Population, optional
        Distributions of unmeasured quantities.
    tolerance : float
        Step tolerance of the dynamics.
    grains : int, optional
        Number of grains per pile. Samples that the ellipsoid cannot follow to the end are continued with one pile
        each.
    progress : bool or callable, optional
        Show a bar (:mod:`flybystab.progress`), or a function that is called with a :class:`Progress` after
        every asteroid.
    finder : callable
        Finds the encounters of an asteroid, in place of a search along its orbit. One with a method ``batch``
        (:class:`flybystab.screening.encounters.BatchFinder`) searches for many asteroids at once.

    Returns
    -------
    ResultTable
        One row per encounter (:data:`COLUMNS`), by asteroid and time; provenance in ``meta``.

    Notes
    -----
    For long runs use :meth:`Screening.run`, which writes to a file and can be resumed.
    """
    chosen = listed(asteroids)
    wanted = settings(
        start, stop, planets, within, samples, seed, material, population, tolerance=tolerance, grains=grains
    )
    run = Screening(chosen, wanted, finder)
    began = clock.monotonic()
    found: dict[int, list[Row]] = {}
    counts: Counter[str] = Counter()
    check_progress(progress)
    with progress_bar(not callable(progress) and progress, len(chosen), "asteroids", "screening") as tick:
        for i, result in run.results(executor):
            found[i] = result["rows"]
            counts.update(r.get("verdict") or "error" for r in result["rows"])
            tick(len(found))
            if callable(progress):
                rows = sum(counts.values())
                progress(Progress(len(found), len(chosen), 0, rows, dict(counts), clock.monotonic() - began))
    return table_of((r for i in sorted(found) for r in found[i]), COLUMNS, run.meta())
