"""Where a screening is computed: here, on processes of this machine, or on a dask cluster."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread

from flybystab.errors import InvalidInput, MissingExtra, WorkersLost


def _follow_parent() -> None:
    """Prepare a worker process: the parent alone answers Ctrl-C, and its death, by SIGKILL too, ends the worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _start(pool: ProcessPoolExecutor, jobs: int) -> None:
    """Start all processes with interrupts blocked: they inherit that, and Ctrl-C finds none half-way up."""
    mask = getattr(signal, "pthread_sigmask", None)
    before = mask(signal.SIG_BLOCK, {signal.SIGINT}) if mask else None
    try:
        for _ in range(jobs):
            pool.submit(os.getpid)
    finally:
        if mask:
            mask(signal.SIG_SETMASK, before)


@contextmanager
def workers(jobs: int = 1, dask: str | None = None, timeout: float = 30.0) -> Iterator[Executor | None]:
    """An executor for `screen` and `Screening.run`, closed at the end.

    Parameters
    ----------
    jobs : int
        Processes on this machine; 1 computes here.
    dask : str, optional
        Address of a dask scheduler, such as ``tcp://host:8786``, or its scheduler file; `jobs` does not
        count then.
    timeout : float
        Seconds to wait for the scheduler.

    Yields
    ------
    Executor or None

    Raises
    ------
    InvalidInput
        `jobs` is no positive number.
    MissingExtra
        dask.distributed is not installed.
    WorkersLost
        The scheduler does not answer.
    """
    if isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1:
        raise InvalidInput("jobs", jobs, "a whole number, 1 or more")
    if dask is not None:
        try:
            from distributed import Client
        except ImportError:
            raise MissingExtra("distributed", "dask", "a dask cluster") from None
        where = {"scheduler_file": dask} if dask.endswith(".json") else {"address": dask}
        try:
            client = Client(**where, timeout=timeout)
        except (OSError, ValueError) as error:
            raise WorkersLost(f"no dask scheduler at {dask}: {error}") from None
        with client:
            yield client.get_executor()
    elif jobs == 1:
        yield None
    else:
        # Fresh processes: a fork of a process with threads can hang.
        pool = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_follow_parent)
        try:
            _start(pool, jobs)
            yield pool
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
