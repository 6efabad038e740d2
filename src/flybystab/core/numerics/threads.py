"""Work shared by threads: compiled kernels run without the interpreter's lock."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from numbers import Integral
from typing import TypeVar

from flybystab.errors import FlybystabWarning, InvalidInput

T = TypeVar("T")
R = TypeVar("R")


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


def in_order(work: Callable[[T], R], tasks: Iterable[T], threads: int) -> Iterator[R]:
    """Results of ``work(task)`` in the order of the tasks; an exception (or Ctrl-C) cancels those not started."""
    tasks = list(tasks)
    if threads < 2 or len(tasks) < 2:
        yield from map(work, tasks)
        return
    pool = ThreadPoolExecutor(threads)
    _active.add(pool)
    try:
        yield from pool.map(work, tasks)
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
