"""Units of work of a screening: an asteroid, and parts of the samples of a long encounter.

A worker finds the encounters of many asteroids in one search (:func:`searched`), or of one by the finder of a user.
A worker then starts an asteroid: it computes verdicts for the catalogue body and a few samples of each encounter. The
other samples are completed immediately where the bound decides. Those that need an integration of the body, or of
their own orbit, are left in parts for all workers, so that a single encounter keeps every core busy. A sample depends
on the seed, the asteroid and its number only (:mod:`flybystab.screening.draws`): the rows do not depend on the
division into parts.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from flybystab.catalogues.catalogue import Asteroid
from flybystab.errors import FlybystabError
from flybystab.screening.clones import Clones, OrbitSampling, orbit_sampling
from flybystab.screening.draws import Attitudes, Samples
from flybystab.screening.encounters import BatchFinder, CloseApproach, Finder
from flybystab.screening.grain_samples import CATALOGUE_BODY, GrainSample, needing_grains
from flybystab.screening.result_rows import (
    Row,
    body_row,
    catalogue_body,
    failed_row,
    sample_rows,
    sampled_row,
)
from flybystab.screening.sample_verdicts import RANKED, SampleVerdicts, Tally, sample_verdicts, verdicts_each
from flybystab.screening.settings import Settings
from flybystab.screening.time_limits import time_limit
from flybystab.typing import Document

#: ``rows`` of encounters, and ``samples`` where they are kept.
Rows = dict[str, list[Row]]
#: Samples from which a worker estimates the fraction that must be integrated.
_PROBE = 8
#: Least and largest number of integrated samples in one part, and the number of parts aimed at.
_BLOCK, _LARGEST, _PARTS = 16, 256, 64
#: Cost of a sample decided by the bound over that of an integrated one, approximately.
_BOUND = 1 / 64


def block_of(samples: int) -> int:
    """Number of integrated samples in one part of an encounter."""
    return max(_BLOCK, min(_LARGEST, samples // _PARTS))


@dataclass(frozen=True)
class Part:
    """Some samples of an encounter.

    Attributes
    ----------
    approach : CloseApproach
    clones : Clones or None
        Set where each sample has its own orbit.
    first, last : int
        Number of the first of these samples, and of the first that is not one of them.
    samples : Samples or Attitudes
        All samples of the encounter; those of the part are drawn by the worker.
    """

    approach: CloseApproach
    clones: Clones | None
    first: int
    last: int
    samples: Samples | Attitudes

    def judged(self, settings: Settings) -> SampleVerdicts:
        """Verdicts on the samples."""
        attitudes = self.samples.part(self.first, self.last)
        given = attitudes.draws, attitudes, settings.material
        if self.clones is None:
            return sample_verdicts(self.approach, *given, tolerance=settings.tolerance)
        n = attitudes.count
        try:
            followed = self.clones.close_approaches(self.first, self.first + n)
        except FlybystabError:
            # The sample that fails is isolated, so that the result does not depend on the division into parts.
            return SampleVerdicts.joined(
                [self._one(self.clones, attitudes.part(k, k + 1), self.first + k, settings) for k in range(n)]
            )
        return verdicts_each(followed, *given, tolerance=settings.tolerance)

    def _one(self, clones: Clones, one: Attitudes, number: int, settings: Settings) -> SampleVerdicts:
        """Verdict on one sample alone."""
        try:
            followed = clones.close_approaches(number, number + 1)
        except FlybystabError as error:
            return SampleVerdicts.failed(f"{type(error).__name__}: {error}", clones.within)
        return verdicts_each(followed, one.draws, one, settings.material, tolerance=settings.tolerance)


@dataclass
class OpenApproach:
    """An encounter with samples that have no verdict yet.

    Attributes
    ----------
    approach : CloseApproach
    row : dict
        Of the catalogue body.
    orbits : OrbitSampling
    attitudes : Samples or Attitudes
        Of all samples, with their bodies.
    nominal : Attitudes or None
        The catalogue body, if bodies are continued with grains.
    whole : bool
        Keep the verdicts of all samples; otherwise only their counts and the verdicts of the first `RANKED`.
    size : int
        Samples of a part.
    judged : dict of int to SampleVerdicts
        Finished parts whose verdicts are kept, by their first sample.
    tallies : dict of int to Tally
        All finished parts, by their first sample.
    needed : dict of int to str
        Numbers and verdicts of the samples that remain to be continued with grains.
    carried : dict of int to SampleVerdicts
        Samples that have been continued with grains.
    unjudged : int
        Number of samples without a verdict.
    sent : bool
        The samples for grains have been given out.
    """

    approach: CloseApproach
    row: Row
    orbits: OrbitSampling
    attitudes: Samples | Attitudes
    nominal: Attitudes | None = None
    whole: bool = True
    size: int = 0
    judged: dict[int, SampleVerdicts] = field(default_factory=dict)
    tallies: dict[int, Tally] = field(default_factory=dict)
    needed: dict[int, str] = field(default_factory=dict)
    carried: dict[int, SampleVerdicts] = field(default_factory=dict)
    unjudged: int = field(init=False)
    sent: bool = False

    def __post_init__(self) -> None:
        self.unjudged = self.attitudes.count
        if self.nominal is not None:
            self._need(CATALOGUE_BODY, [str(self.row["verdict"])])

    @property
    def left(self) -> int:
        """Number of samples without a verdict, or that remain to be continued with grains."""
        return self.unjudged + len(self.needed)

    def take(self, first: int, judged: SampleVerdicts) -> SampleVerdicts:
        """Store the verdicts of a part, or of a sample by grains."""
        if judged.grains.any():
            self.carried[first] = judged
            self.needed.pop(first, None)
            return judged
        self.tallies[first] = Tally.of(judged)
        if self.whole or first < RANKED:
            self.judged[first] = judged
        self.unjudged -= len(judged.verdict)
        if self.nominal is not None:
            self._need(first, judged.verdict)
        return judged

    def _need(self, first: int, verdicts: Sequence[str]) -> None:
        """Add the samples that the ellipsoid cannot follow to the end."""
        self.needed |= {k: v for k, v in needing_grains(first, verdicts).items() if k not in self.carried}

    def grain_samples(self) -> Iterator[tuple[int, GrainSample]]:
        """The samples for grains with their numbers, given once, when all samples have a verdict of the ellipsoid."""
        if self.unjudged or self.sent or self.nominal is None:
            return
        self.sent = True
        for k, verdict in sorted(self.needed.items()):
            one = self.nominal if k == CATALOGUE_BODY else self.attitudes.part(k, k + 1)
            yield k, GrainSample(self.approach, self.orbits.clones, k, one, verdict)

    def part(self, first: int, last: int) -> Part:
        """Samples `first` to ``last - 1``."""
        return Part(self.approach, self.orbits.clones, first, last, self.attitudes)

    def parts(self) -> Iterator[tuple[int, Part]]:
        """Parts without verdicts, with the numbers of their first samples."""
        ends = [*sorted(self.tallies), self.attitudes.count]
        for begin, end in zip([0, *(k + self.tallies[k].samples for k in ends[:-1])], ends, strict=True):
            for k in range(begin, end, max(1, self.size)):
                yield k, self.part(k, min(k + self.size, end))

    def take_stored(self, stored: Sequence[Document]) -> None:
        """Store verdicts of an earlier run, from :meth:`flybystab.screening.journal.Journal.parts`."""
        for part in stored:
            first, judged = int(part["first"]), SampleVerdicts.restored(part)
            if judged.grains.any():
                if self.nominal is not None:
                    self.take(first, judged)
                continue
            last = first + len(judged.verdict)
            if all(last <= k or first >= k + t.samples for k, t in self.tallies.items()):
                self.take(first, judged)

    def rows(self, settings: Settings) -> Rows:
        """The rows, once all samples have a verdict."""
        row = self.row
        if (main := self.carried.get(CATALOGUE_BODY)) is not None:
            row = row | {"verdict": main.verdict[0], "error": row["error"] or main.error[0]}
            row["decided_by"] = row["decided_by"] if main.error[0] else "grains"
        if not self.judged:
            return {"rows": [row], "samples": []}
        result = SampleVerdicts.joined([self.judged[first] for first in sorted(self.judged)])
        tally = Tally.joined(self.tallies[first] for first in sorted(self.tallies))
        for k, one in self.carried.items():
            if k != CATALOGUE_BODY:
                result.verdict[k], result.largest[k] = one.verdict[0], one.largest[0]
                result.grains[k], result.error[k] = not one.error[0], one.error[0]
        if self.carried:
            tally = Tally.of(result)
        ranked = self.attitudes.part(0, min(RANKED, self.attitudes.count))
        row = sampled_row(row, self.orbits, tally, ranked.draws, result)
        if not settings.keep_samples:
            return {"rows": [row], "samples": []}
        everyone = self.attitudes.part(0, self.attitudes.count)
        return {"rows": [row], "samples": list(sample_rows(self.approach, everyone, result))}


def opened(approach: CloseApproach, settings: Settings, block: int) -> Rows | OpenApproach:
    """The rows of an encounter, or the encounter with its open samples.

    Parameters
    ----------
    approach : CloseApproach
    settings : Settings
    block : int
        Integrated samples in one part.
    """
    row = body_row(approach, settings)
    n = settings.samples
    if "verdict" not in row or (n <= 1 and not settings.grains):
        return {"rows": [row], "samples": []}
    nominal = catalogue_body(approach, settings) if settings.grains else None
    if n <= 1 and nominal is not None:
        alone = OpenApproach(
            approach, row, OrbitSampling(None, np.nan, ""), nominal.part(0, 0), nominal, size=1
        )
        return alone if alone.left else alone.rows(settings)
    samples = Samples(approach.asteroid, n, settings.seed, settings.population, approach.key)
    orbits = orbit_sampling(approach, n, settings.seed)
    whole = settings.keep_samples or nominal is not None or orbits.clones is not None
    work = OpenApproach(approach, row, orbits, samples, nominal, whole)
    probe = min(n, block, _PROBE)
    first = work.take(0, work.part(0, probe).judged(settings))
    if work.unjudged:
        # integrating the orbit of a clone costs more than the dynamics of the body
        least = _BOUND if work.orbits.clones is None else 1.0
        work.size = max(1, int(block / max(first.dynamic.mean(), least)))
        if work.unjudged > work.size:
            return work
        work.take(probe, work.part(probe, n).judged(settings))
    return work if work.left else work.rows(settings)


def begin(asteroid: Asteroid, settings: Settings, finder: Finder, block: int) -> list[Rows | OpenApproach]:
    """Encounters of an asteroid, each as its rows or with its open samples.

    An asteroid that fails or exceeds the time limit of the settings has one row with the reason: it does not end
    the run, and a resumed run does not compute it again.
    """
    try:
        with time_limit(settings.time_limit, asteroid.name):
            return [opened(approach, settings, block) for approach in finder(asteroid, settings)]
    except Exception as error:
        return [_failed(asteroid, settings, error)]


def searched(
    asteroids: Sequence[Asteroid], settings: Settings, finder: BatchFinder
) -> list[list[CloseApproach] | Rows]:
    """For each asteroid its encounters, found in one search, or the row of its failure.

    The search has the time limit of one asteroid. If it fails as a whole, the asteroids are searched one by one.
    """
    try:
        with time_limit(settings.time_limit, f"search for {len(asteroids)} asteroids"):
            found = finder.batch(asteroids, settings)
    except Exception:
        return [_searched_alone(a, settings, finder) for a in asteroids]
    return [
        _failed(a, settings, f) if isinstance(f, Exception) else f
        for a, f in zip(asteroids, found, strict=True)
    ]


def _searched_alone(asteroid: Asteroid, settings: Settings, finder: Finder) -> list[CloseApproach] | Rows:
    """The encounters of an asteroid, or the row of its failure."""
    try:
        with time_limit(settings.time_limit, asteroid.name):
            return finder(asteroid, settings)
    except Exception as error:
        return _failed(asteroid, settings, error)


def _failed(asteroid: Asteroid, settings: Settings, error: Exception) -> Rows:
    return {"rows": [failed_row(asteroid, settings, error)], "samples": []}


def joined(work: Sequence[Rows | OpenApproach], settings: Settings) -> Rows:
    """The rows of an asteroid whose encounters are all finished."""
    rows = [w.rows(settings) if isinstance(w, OpenApproach) else w for w in work]
    return {kind: [r for w in rows for r in w[kind]] for kind in ("rows", "samples")}
