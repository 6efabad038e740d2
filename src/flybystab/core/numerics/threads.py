"""Work shared by threads: compiled kernels run without the interpreter's lock.

Ctrl-C inside a lock of :mod:`concurrent.futures` can leave it locked, and the threads that need it then never end:
calls of an executor are made, and waited for, with :func:`interrupts_deferred`.
"""

from __future__ import annotations

import os
import signal
import threading
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from numbers import Integral
from typing import TypeVar

from flybystab.errors import FlybystabWarning, InvalidInput

T = TypeVar("T")
R = TypeVar("R")


#: Longest time until a deferred Ctrl-C takes effect, s.
_POLL = 0.1
#: Thread pools that are computing now.
_active: set[ThreadPoolExecutor] = set()


def _warn_before_fork() -> None:
    """Warn of a fork while threads compute: locks held by threads stay locked in the child, which may hang."""
    if _active:
        warnings.warn(
            "this process forks while threads of flybystab compute: the child may hang. Start processes by spawn "
            '(multiprocessing.get_context("spawn"))',
            FlybystabWarning,
            stacklevel=2,
        )


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_warn_before_fork)


@contextmanager
def interrupts_deferred() -> Iterator[Callable[[], bool]]:
    """Ctrl-C in the block takes effect at its end. Yields a function that returns True once it has been pressed.

    Without effect in other threads than the main one, which receive no signals.
    """
    usual = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(usual):
        yield lambda: False
        return
    pressed: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, usual)
    if pressed:
        usual(signal.SIGINT, None)


def first_completed(futures: Collection[Future[R]]) -> set[Future[R]]:
    """Wait until one of the futures is done; returns those that are."""
    done: set[Future[R]] = set()
    with interrupts_deferred() as interrupted:
        while not done and not interrupted():
            done = wait(futures, timeout=_POLL, return_when=FIRST_COMPLETED).done
    return done


def in_order(work: Callable[[T], R], tasks: Iterable[T], threads: int) -> Iterator[R]:
    """Results of ``work(task)`` in the order of the tasks; an exception (or Ctrl-C) cancels those not started."""
    tasks = list(tasks)
    if threads < 2 or len(tasks) < 2:
        yield from map(work, tasks)
        return
    pool = ThreadPoolExecutor(threads)
    _active.add(pool)
    try:
        with interrupts_deferred():
            futures = [pool.submit(work, task) for task in tasks]
        for future in futures:
            first_completed([future])
            yield future.result()
    finally:
        pool.shutdown(cancel_futures=True)
        _active.discard(pool)


def worker_count(workers: int | None, threads: int | None = None) -> int:
    """Number of threads to use: `workers`, or one per processor.

    Parameters
    ----------
    workers : int or None
    threads : int, optional
        Deprecated name of `workers` in some public functions; warns.

    Raises
    ------
    InvalidInput
        Not a positive whole number.
    """
    name, value = "workers", workers
    if threads is not None:
        warnings.warn("threads is deprecated: use workers", DeprecationWarning, stacklevel=3)
        name, value = "threads", threads
    if value is None:
        return os.cpu_count() or 1
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise InvalidInput(name, value, "a whole number, 1 or more")
    return int(value)
