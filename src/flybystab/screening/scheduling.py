"""Scheduling of the tasks of a screening on the workers of an executor."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import dataclass
from itertools import islice
from pickle import PickleError
from typing import Any, NamedTuple, Protocol

from flybystab.catalogues.catalogue import Asteroid
from flybystab.errors import WorkersLost
from flybystab.screening.encounters import Finder
from flybystab.screening.grain_samples import GrainSample
from flybystab.screening.sample_verdicts import SampleVerdicts
from flybystab.screening.settings import Settings
from flybystab.screening.tasks import OpenPassage, Part, Rows, begin, joined


def _begin(
    asteroids: list[Asteroid], settings: Settings, finder: Finder, block: int
) -> list[list[Rows | OpenPassage]]:
    return [begin(a, settings, finder, block) for a in asteroids]


def _judge(part: Part | GrainSample, settings: Settings) -> SampleVerdicts:
    return part.judged(settings)


@dataclass(eq=False)
class _Asteroid:
    """An asteroid in progress: its passages, the number of open ones, and their initial number of samples."""

    position: int
    work: list[Rows | OpenPassage]
    open: int
    samples: int
    done: int = 0


class _Piece(NamedTuple):
    """Position of the result of a part."""

    asteroid: _Asteroid
    number: int
    passage: OpenPassage
    first: int


class Parts(Protocol):
    """Store of finished parts of long tasks."""

    def add(self, asteroid: int, passage: int, first: int, judged: SampleVerdicts) -> None:
        """Store a part: samples from `first` on of one passage of the asteroid."""

    def of(self, asteroid: int) -> Sequence[Mapping[str, Any]]:
        """Stored parts of an asteroid, with ``passage``, ``first`` and the result of `SampleVerdicts.stored`."""


class SerialExecutor(Executor):
    """Executor that computes immediately, in the calling thread."""

    _max_workers = 1

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The result, in a finished future."""
        future: Future[Any] = Future()
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

    Parts of asteroids in progress take precedence over new asteroids, so that few are open at a time.

    Parameters
    ----------
    chunk : int
        Asteroids in one call of a worker.
    window : int
        Calls in flight at a time: memory does not grow with the length of the list.
    block : int
        Samples by the dynamics in one part (:func:`flybystab.screening.tasks.opened`).
    report : callable, optional
        Called after every part with the completed fractions of the asteroids in progress, summed.
    parts : Parts, optional
        Stores finished parts, and holds those of an earlier run.

    Raises
    ------
    WorkersLost
        Names the asteroids in progress.
    """
    positions = iter(todo)
    waiting: deque[Iterator[tuple[_Piece, Part | GrainSample]]] = deque()
    calls: dict[Future[Any], list[int] | _Piece] = {}
    begun: dict[int, float] = {}

    def send() -> bool:
        """Send one call; False if there is nothing to send."""
        while waiting:
            if (found := next(waiting[0], None)) is not None:
                piece, part = found
                calls[executor.submit(_judge, part, settings)] = piece
                return True
            waiting.popleft()
        if chosen := list(islice(positions, chunk)):
            future = executor.submit(_begin, [asteroids[i] for i in chosen], settings, finder, block)
            calls[future] = chosen
        return bool(chosen)

    try:
        while True:
            while len(calls) < window and send():
                pass
            if not calls:
                return
            finished, _ = wait(calls, return_when=FIRST_COMPLETED)
            for future in finished:
                call = calls.pop(future)
                try:
                    answer = future.result()
                except Exception as error:
                    names = ", ".join(asteroids[i].name for i in _positions(call))
                    if (reason := _failed_workers(error, executor)) is None:
                        raise
                    raise WorkersLost(
                        f"{reason}; in progress: {names}. Finished asteroids are kept: the same call continues the run"
                    ) from error
                if isinstance(call, _Piece):
                    call.passage.take(call.first, answer)
                    asteroid = call.asteroid
                    if parts is not None:
                        parts.add(asteroid.position, call.number, call.first, answer)
                    asteroid.open -= not call.passage.left
                    if not call.passage.unjudged and call.passage.needed and not call.passage.sent:
                        asteroid.samples += len(call.passage.needed)
                        waiting.appendleft(_grain_pieces(asteroid, call.number, call.passage))
                    asteroid.done += len(answer.verdict)
                    begun[asteroid.position] = asteroid.done / asteroid.samples
                    if not asteroid.open:
                        del begun[asteroid.position]
                        yield asteroid.position, joined(asteroid.work, settings)
                    elif report is not None:
                        report(sum(begun.values()))
                    continue
                for i, work in zip(call, answer, strict=True):
                    for part in () if parts is None else parts.of(i):
                        found = work[part["passage"]] if part["passage"] < len(work) else None
                        if isinstance(found, OpenPassage):
                            found.take_stored([part])
                    left = [(n, w) for n, w in enumerate(work) if isinstance(w, OpenPassage) and w.left]
                    if left:
                        samples = sum(w.left for _, w in left)
                        waiting.append(_pieces(_Asteroid(i, work, len(left), samples), left))
                    else:
                        yield i, joined(work, settings)
    finally:
        for future in calls:
            future.cancel()


def _pieces(
    asteroid: _Asteroid, left: Sequence[tuple[int, OpenPassage]]
) -> Iterator[tuple[_Piece, Part | GrainSample]]:
    for number, passage in left:
        for first, part in list(passage.parts()):
            yield _Piece(asteroid, number, passage, first), part
        yield from _grain_pieces(asteroid, number, passage)


def _grain_pieces(
    asteroid: _Asteroid, number: int, passage: OpenPassage
) -> Iterator[tuple[_Piece, Part | GrainSample]]:
    for k, sample in passage.grain_samples():
        yield _Piece(asteroid, number, passage, k), sample


def _failed_workers(error: Exception, executor: Executor) -> str | None:
    """What happened to the workers; None for an error of the computation itself.

    Errors of lost workers come from concurrent.futures or from dask (``KilledWorker``, closed connections).
    """
    modules = {kind.__module__.partition(".")[0] for kind in type(error).__mro__}
    said = ": ".join(filter(None, (type(error).__name__, " ".join(str(error).split()))))
    if type(error).__name__ == "KilledWorker":
        return (
            "workers died, in most cases because they had too little memory (dask worker --memory-limit) or not the "
            f"same version of flybystab as this process ({said})"
        )
    if isinstance(error, BrokenExecutor | CancelledError) or "distributed" in modules:
        return f"workers died or were lost ({said})"
    if not isinstance(executor, SerialExecutor) and isinstance(error, _DESERIALISATION):
        return f"workers could not load the tasks: they need the same version of flybystab as this process ({said})"
    return None


#: Raised where a worker has no flybystab or another version of it; dask reports them as RuntimeError.
_DESERIALISATION = (ImportError, AttributeError, PickleError, RuntimeError)


def _positions(call: list[int] | _Piece) -> list[int]:
    return [call.asteroid.position] if isinstance(call, _Piece) else call


def window_of(executor: Executor) -> int:
    """Calls in flight that keep all workers busy."""
    return 4 * int(getattr(executor, "_max_workers", 0) or os.cpu_count() or 1)
