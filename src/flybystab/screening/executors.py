"""Executors of a screening: this process, processes of this machine, or a dask cluster."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import warnings
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread

from flybystab.errors import FlybystabWarning, InvalidInput, MissingExtra, WorkersLost
from flybystab.files import parse_json, read_text
from flybystab.typing import Document
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
        `workers` is not a positive integer, or the scheduler file gives no address.
    MissingExtra
        dask.distributed is not installed.
    WorkersLost
        The scheduler file does not exist, or the scheduler does not answer within `timeout`.

    Warns
    -----
    FlybystabWarning
        The scheduler has no workers yet: calls wait for them.
    """
    whole(workers, "workers", 1)
    if dask is not None:
        _import_distributed()
        with _quiet_dask(), _dask_client(dask, timeout) as client:
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


def _import_distributed() -> None:
    """Import distributed, which also sets up its loggers."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise MissingExtra("distributed", "dask", "a dask cluster") from None


def _dask_client(where: str, timeout: float) -> AbstractContextManager:
    """A connected client of a dask scheduler."""
    from distributed import Client

    address = _address(where)
    try:
        # In a thread of its own: the calling thread may run an event loop, as in a notebook.
        with ThreadPoolExecutor(1) as thread:
            found = thread.submit(asyncio.run, _identity(address, timeout)).result()
        client = Client(address, timeout=timeout)
    except Exception as error:  # of any type if the address is not that of a dask scheduler
        raise WorkersLost(
            f"no dask scheduler answers at {where} ({_reason(error, timeout)}){_certificates(address)}. Nothing was "
            "computed; results of an earlier, unfinished run are kept"
        ) from None
    if not found.get("workers"):
        warnings.warn(
            f"the dask scheduler at {where} has no workers: the run waits for them", FlybystabWarning, 4
        )
    return client


@contextmanager
def _quiet_dask() -> Iterator[None]:
    """Suppress tracebacks in the log of distributed: lost connections are raised as `WorkersLost`."""

    def critical(record: logging.LogRecord) -> bool:
        return record.levelno >= logging.CRITICAL

    handlers = [h for name in ("distributed", "distributed.client") for h in logging.getLogger(name).handlers]
    for handler in handlers:
        handler.addFilter(critical)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(critical)


def _address(where: str) -> str:
    """The address of a scheduler, from its scheduler file if `where` is one."""
    if not where.endswith(".json"):
        return where
    # Checked first: distributed waits for a missing file without a time limit.
    if not Path(where).exists():
        raise WorkersLost(f"the dask scheduler file {where} does not exist: start the scheduler first")
    content = parse_json(read_text(where, "dask scheduler file"), "dask scheduler file", where)
    address = content.get("address") if isinstance(content, dict) else None
    if not isinstance(address, str):
        raise InvalidInput("dask scheduler file", where, 'a JSON object with the "address" of the scheduler')
    return address


async def _identity(address: str, timeout: float) -> Document:
    """Identity of a scheduler, requested first because ``Client`` may wait longer than its timeout."""
    from distributed.comm import connect
    from distributed.security import Security

    async def ask() -> Document:
        comm = await connect(address, timeout=timeout, **Security().get_connection_args("client"))
        try:
            await comm.write({"op": "identity", "reply": True})
            return dict(await comm.read())
        finally:
            comm.abort()

    return await asyncio.wait_for(ask(), timeout)


def _reason(error: Exception, timeout: float) -> str:
    if isinstance(error, TimeoutError) and not str(error):
        return f"no answer within {timeout:g} s"
    return str(error) or type(error).__name__


def _certificates(address: str) -> str:
    if not address.startswith(("tls", "wss")):
        return ""
    settings = "distributed.comm.tls.ca-file and distributed.comm.tls.client"
    return f"; tls needs certificates: {settings} in the dask configuration"


def workers(
    jobs: int = 1, dask: str | None = None, timeout: float = 30.0
) -> AbstractContextManager[Executor | None]:
    """Deprecated name of :func:`open_executor`."""
    warnings.warn("executors.workers(jobs) is deprecated: use open_executor(workers)", DeprecationWarning, 2)
    return open_executor(jobs, dask, timeout)
