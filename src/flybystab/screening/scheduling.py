"""Scheduling of the tasks of a screening on the workers of an executor."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import nullcontext
from dataclasses import dataclass, field
from itertools import islice
from pickle import PickleError
from typing import Any, NamedTuple, ParamSpec, Protocol, TypeGuard, TypeVar

from flybystab.catalogues.catalogue import Asteroid
from flybystab.core.numerics.threads import first_completed, interrupts_deferred
from flybystab.errors import WorkersLost
from flybystab.screening.encounters import BatchFinder, CloseApproach, Finder
from flybystab.screening.grain_samples import GrainSample
from flybystab.screening.sample_verdicts import SampleVerdicts
from flybystab.screening.settings import Settings
from flybystab.screening.tasks import OpenApproach, Part, Rows, begin, joined, searched
from flybystab.typing import Document

P = ParamSpec("P")
R = TypeVar("R")

#: Largest number of asteroids in one search, and of those named where workers are lost.
_BATCH, _NAMED = 64, 8


def _begin(
    asteroids: list[Asteroid], settings: Settings, finder: Finder, block: int
) -> list[list[Rows | OpenApproach]]:
    return [begin(a, settings, finder, block) for a in asteroids]


def _open(
    found: list[tuple[Asteroid, list[CloseApproach]]], settings: Settings, block: int
) -> list[list[Rows | OpenApproach]]:
    return [begin(a, settings, lambda *_, its=its: its, block) for a, its in found]


def _judge(part: Part | GrainSample, settings: Settings) -> SampleVerdicts:
    return part.judged(settings)


@dataclass(eq=False)
class _Asteroid:
    """An asteroid in progress: its encounters, the number of open ones, and their initial number of samples."""

    position: int
    work: list[Rows | OpenApproach]
    open: int
    samples: int
    done: int = 0


class _Piece(NamedTuple):
    """Asteroid, encounter and first sample of a part."""

    asteroid: _Asteroid
    number: int
    approach: OpenApproach
    first: int


class _Search(NamedTuple):
    """Asteroids that are searched for encounters in one call."""

    positions: list[int]


#: What is in flight: positions of new asteroids, a search, or a part.
_Call = list[int] | _Search | _Piece


class Parts(Protocol):
    """Store of finished parts of long tasks."""

    def add(self, asteroid: int, approach: int, first: int, judged: SampleVerdicts) -> None:
        """Store a part: samples from `first` on of one encounter of the asteroid."""

    def of(self, asteroid: int) -> Sequence[Document]:
        """Stored parts of an asteroid: ``passage`` (a number), ``first`` and the result of `SampleVerdicts.stored`."""


class SerialExecutor(Executor):
    """Executor that computes immediately, in the calling thread."""

    _max_workers = 1

    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        """The result, in a finished future."""
        future: Future[R] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


def scheduled(
    asteroids: Sequence[Asteroid],
    todo: Iterable[int],
    settings: Settings,
    finder: Finder,
    executor: Executor,
    *,
    chunk: int,
    window: int,
    block: int,
    report: Callable[[float], None] | None = None,
    parts: Parts | None = None,
) -> Iterator[tuple[int, Rows]]:
    """Rows of the asteroids at the positions `todo`, in order of completion: (position, rows).

    Parts of asteroids in progress take precedence over new asteroids, so that few are open at a time. A finder that
    searches for many asteroids at once (:class:`BatchFinder`) gets up to `_BATCH` of them, or as many as keep all calls
    in flight busy; their encounters are then computed in calls of their own.

    Parameters
    ----------
    chunk : int
        Asteroids in one call of a worker.
    window : int
        Calls in flight at a time: memory does not grow with the length of the list.
    block : int
        Integrated samples in one part (:func:`flybystab.screening.tasks.opened`).
    report : callable, optional
        Called after every part with the completed fractions of the asteroids in progress, summed.
    parts : Parts, optional
        Stores finished parts, and holds those of an earlier run.

    Raises
    ------
    WorkersLost
        Names the asteroids in progress.
    """
    batch = max(chunk, min(_BATCH, -(-len(asteroids) // window)))
    schedule = _Schedule(asteroids, iter(todo), settings, finder, executor, chunk, batch, block, parts)
    # a call of the serial executor is the calculation itself, which Ctrl-C ends at once
    deferred = nullcontext if isinstance(executor, SerialExecutor) else interrupts_deferred
    try:
        while True:
            yield from schedule.finished()
            with deferred():
                while len(schedule.calls) < window and schedule.send():
                    pass
            if not schedule.calls:
                return
            for future in first_completed(schedule.calls):
                call, answer = schedule.received(future)
                if isinstance(call, _Piece):
                    if (rows := schedule.take(call, answer)) is not None:
                        yield call.asteroid.position, rows
                    elif report is not None:
                        report(sum(schedule.completed.values()))
                    continue
                if isinstance(call, _Search):
                    schedule.found.extend(zip(call.positions, answer, strict=True))
                    continue
                for i, work in zip(call, answer, strict=True):
                    if (rows := schedule.start(i, work)) is not None:
                        yield i, rows
    finally:
        with deferred():
            for future in schedule.calls:
                future.cancel()


@dataclass(eq=False)
class _Schedule:
    """State of :func:`scheduled`, whose arguments it holds.

    Attributes
    ----------
    batch : int
        Asteroids in one search of a :class:`BatchFinder`.
    waiting : deque of iterators
        Parts of asteroids in progress that have not been sent.
    found, aside : deque
        Positions of asteroids that have been searched, with their encounters, which have not been sent, or the row of
        their failure; `aside` those without encounters before others that have been sent.
    calls : dict
        Calls in flight: positions of new asteroids, a search, or one part.
    completed : dict of int to float
        Completed fractions of the asteroids in progress.
    """

    asteroids: Sequence[Asteroid]
    positions: Iterator[int]
    settings: Settings
    finder: Finder
    executor: Executor
    chunk: int
    batch: int
    block: int
    parts: Parts | None
    waiting: deque[Iterator[tuple[_Piece, Part | GrainSample]]] = field(default_factory=deque)
    found: deque[tuple[int, list[CloseApproach] | Rows]] = field(default_factory=deque)
    aside: deque[tuple[int, list[CloseApproach] | Rows]] = field(default_factory=deque)
    calls: dict[Future[Any], _Call] = field(default_factory=dict)
    completed: dict[int, float] = field(default_factory=dict)

    def send(self) -> bool:
        """Send one call; False if there is nothing to send."""
        while self.waiting:
            if (found := next(self.waiting[0], None)) is not None:
                piece, part = found
                self.submit(piece, _judge, part, self.settings)
                return True
            self.waiting.popleft()
        if some := self.next_found():
            work = [(self.asteroids[i], its) for i, its in some]
            self.submit([i for i, _ in some], _open, work, self.settings, self.block)
            return True
        if isinstance(self.finder, BatchFinder):
            if chosen := list(islice(self.positions, self.batch)):
                new = [self.asteroids[i] for i in chosen]
                self.submit(_Search(chosen), searched, new, self.settings, self.finder)
        elif chosen := list(islice(self.positions, self.chunk)):
            new = [self.asteroids[i] for i in chosen]
            self.submit(chosen, _begin, new, self.settings, self.finder, self.block)
        return bool(chosen)

    def submit(self, call: _Call, function: Callable[..., Any], *arguments: object) -> None:
        """Submit a call.

        Raises
        ------
        WorkersLost
            The executor has lost its workers since the last result.
        """
        try:
            self.calls[self.executor.submit(function, *arguments)] = call
        except Exception as error:
            if not _is_loss(error):
                raise
            running = next(iter(self.calls.values()), call)
            raise self.workers_lost(f"workers died or were lost ({_said(error)})", running) from error

    def received(self, future: Future[Any]) -> tuple[_Call, Any]:
        """A finished call and its result.

        Raises
        ------
        WorkersLost
        """
        call = self.calls.pop(future)
        try:
            return call, future.result()
        except Exception as error:
            if (reason := _failed_workers(error, self.executor)) is None:
                raise
            raise self.workers_lost(reason, call) from error

    def workers_lost(self, reason: str, call: _Call) -> WorkersLost:
        """The error that names the asteroids of a call."""
        positions = _positions(call)
        names = ", ".join(self.asteroids[i].name for i in positions[:_NAMED])
        if len(positions) > _NAMED:
            names += f" and {len(positions) - _NAMED} others"
        return WorkersLost(
            f"{reason}; in progress: {names}. Finished asteroids are kept: the same call continues the run"
        )

    def next_found(self) -> list[tuple[int, list[CloseApproach]]]:
        """Up to `chunk` asteroids with encounters; those before them that have none are put aside."""
        out: list[tuple[int, list[CloseApproach]]] = []
        while self.found and len(out) < self.chunk:
            position, found = self.found.popleft()
            if _has_encounters(found):
                out.append((position, found))
            else:
                self.aside.append((position, found))
        return out

    def finished(self) -> Iterator[tuple[int, Rows]]:
        """Positions and rows of the next asteroids that have failed or have no encounters, in order."""
        while self.aside or (self.found and not _has_encounters(self.found[0][1])):
            position, found = (self.aside or self.found).popleft()
            yield position, found if isinstance(found, dict) else joined([], self.settings)

    def take(self, piece: _Piece, verdicts: SampleVerdicts) -> Rows | None:
        """Store the verdicts of a part; the rows of its asteroid if it was the last one."""
        asteroid, approach = piece.asteroid, piece.approach
        approach.take(piece.first, verdicts)
        if self.parts is not None:
            self.parts.add(asteroid.position, piece.number, piece.first, verdicts)
        asteroid.open -= not approach.left
        if not approach.unjudged and approach.needed and not approach.sent:
            asteroid.samples += len(approach.needed)
            self.waiting.appendleft(_grain_pieces(asteroid, piece.number, approach))
        asteroid.done += len(verdicts.verdict)
        self.completed[asteroid.position] = asteroid.done / asteroid.samples
        if asteroid.open:
            return None
        del self.completed[asteroid.position]
        return joined(asteroid.work, self.settings)

    def start(self, position: int, work: list[Rows | OpenApproach]) -> Rows | None:
        """Restore stored parts of an asteroid and queue the others; its rows if there are none."""
        for part in () if self.parts is None else self.parts.of(position):
            found = work[part["passage"]] if part["passage"] < len(work) else None
            if isinstance(found, OpenApproach):
                found.take_stored([part])
        left = [(n, w) for n, w in enumerate(work) if isinstance(w, OpenApproach) and w.left]
        if not left:
            return joined(work, self.settings)
        samples = sum(w.left for _, w in left)
        self.waiting.append(_pieces(_Asteroid(position, work, len(left), samples), left))
        return None


def _pieces(
    asteroid: _Asteroid, left: Sequence[tuple[int, OpenApproach]]
) -> Iterator[tuple[_Piece, Part | GrainSample]]:
    for number, approach in left:
        for first, part in list(approach.parts()):
            yield _Piece(asteroid, number, approach, first), part
        yield from _grain_pieces(asteroid, number, approach)


def _grain_pieces(
    asteroid: _Asteroid, number: int, approach: OpenApproach
) -> Iterator[tuple[_Piece, Part | GrainSample]]:
    for k, sample in approach.grain_samples():
        yield _Piece(asteroid, number, approach, k), sample


def _failed_workers(error: Exception, executor: Executor) -> str | None:
    """Description of the loss of workers; None for an error of the computation itself.

    Errors of lost workers come from concurrent.futures or from dask (``KilledWorker``, closed connections).
    """
    said = _said(error)
    if type(error).__name__ == "KilledWorker":
        return (
            "workers died, in most cases because they had too little memory (dask worker --memory-limit) or not the "
            f"same version of flybystab as this process ({said})"
        )
    if _is_loss(error):
        return f"workers died or were lost ({said})"
    if not isinstance(executor, SerialExecutor) and isinstance(error, _DESERIALISATION):
        return f"workers could not load the tasks: they need the same version of flybystab as this process ({said})"
    return None


def _said(error: Exception) -> str:
    """Type and message of an error in one line."""
    return ": ".join(filter(None, (type(error).__name__, " ".join(str(error).split()))))


def _is_loss(error: Exception) -> bool:
    """Whether an error of concurrent.futures or of dask means that workers or the scheduler were lost."""
    modules = {kind.__module__.partition(".")[0] for kind in type(error).__mro__}
    return isinstance(error, BrokenExecutor | CancelledError) or "distributed" in modules


#: Raised where a worker has no flybystab or another version of it; dask reports them as RuntimeError.
_DESERIALISATION = (ImportError, AttributeError, PickleError, RuntimeError)


def _has_encounters(found: list[CloseApproach] | Rows) -> TypeGuard[list[CloseApproach]]:
    """False if the search for an asteroid has failed or found no encounters."""
    return not isinstance(found, dict) and bool(found)


def _positions(call: _Call) -> list[int]:
    if isinstance(call, _Piece):
        return [call.asteroid.position]
    return call.positions if isinstance(call, _Search) else call


def window_of(executor: Executor) -> int:
    """Number of calls in flight with which all workers are busy."""
    return 4 * int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)
