"""Executors of a screening: this process, processes of this machine, or a dask cluster."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread

from flybystab.errors import MissingExtra, WorkersLost
from flybystab.units import whole


def _follow_parent() -> None:
    """Initialise a worker process: it ignores Ctrl-C, which the parent handles, and exits when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)


def _start(pool: ProcessPoolExecutor, workers: int) -> None:
    """Start all processes with SIGINT blocked, which they inherit until they have set their own handler."""
    mask = getattr(signal, "pthread_sigmask", None)
    before = mask(signal.SIG_BLOCK, {signal.SIGINT}) if mask else None
    try:
        for _ in range(workers):
            pool.submit(os.getpid)
    finally:
        if mask:
            mask(signal.SIG_SETMASK, before)


@contextmanager
def open_executor(
    workers: int = 1, dask: str | None = None, timeout: float = 30.0
) -> Iterator[Executor | None]:
    """An executor for `screen` and `Screening.run`, shut down on exit.

    Parameters
    ----------
    workers : int
        Processes on this machine; 1 computes in the calling process.
    dask : str, optional
        Address of a dask scheduler, such as ``tcp://host:8786``, or path of its scheduler file (``.json``);
        `workers` has no effect then.
    timeout : float
        Longest wait for the scheduler, s.

    Yields
    ------
    Executor or None

    Raises
    ------
    InvalidInput
        `workers` is not a positive integer.
    MissingExtra
        dask.distributed is not installed.
    WorkersLost
        The scheduler does not answer, or its scheduler file does not exist.
    """
    whole(workers, "workers", 1)
    if dask is not None:
        with _dask_client(dask, timeout) as client:
            yield client.get_executor()
    elif workers == 1:
        yield None
    else:
        # Spawned, not forked: the fork of a process with running threads can deadlock.
        pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_follow_parent)
        try:
            _start(pool, workers)
            yield pool
        except BaseException:
            # Results of running calls are no longer needed: a second Ctrl-C must not have to wait for them.
            _terminate(pool)
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _terminate(pool: ProcessPoolExecutor) -> None:
    """End the processes of a pool at once."""
    for process in list((pool._processes or {}).values()):
        process.terminate()


def _dask_client(where: str, timeout: float) -> AbstractContextManager:
    """A connected client of a dask scheduler."""
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtra("distributed", "dask", "a dask cluster") from None
    file = where.endswith(".json")
    if file and not Path(where).is_file():
        # distributed itself waits for such a file without a time limit.
        raise WorkersLost(f"no dask scheduler at {where}: the scheduler file does not exist")
    try:
        return Client(**{"scheduler_file" if file else "address": where}, timeout=timeout)
    except (OSError, ValueError, TypeError, KeyError, RuntimeError) as error:
        # TypeError: tls:// without certificates; KeyError, ValueError: not a scheduler file.
        hint = " (tls:// needs certificates in the dask configuration)" if where.startswith("tls") else ""
        raise WorkersLost(f"no dask scheduler at {where}: {error}{hint}") from None


def workers(
    jobs: int = 1, dask: str | None = None, timeout: float = 30.0
) -> AbstractContextManager[Executor | None]:
    """Deprecated name of :func:`open_executor`."""
    warnings.warn("executors.workers(jobs) is deprecated: use open_executor(workers)", DeprecationWarning, 2)
    return open_executor(jobs, dask, timeout)
