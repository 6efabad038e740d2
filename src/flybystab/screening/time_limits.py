"""Time limits for the work on one asteroid."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from flybystab.errors import NotConverged


@contextmanager
def time_limit(seconds: float, name: str) -> Iterator[None]:
    """Raise :class:`NotConverged` in the body of the ``with`` statement when it takes too long.

    The limit uses the interval timer of the process. It acts in the main thread only, which is where worker processes
    compute, and between two calls of compiled kernels, which limit their own steps. Without such a timer (Windows), in
    other threads, or if the timer is in use, nothing is limited.

    Parameters
    ----------
    seconds : float
    name : str
        Description of the calculation, for the message.
    """
    main = threading.current_thread() is threading.main_thread()
    if not main or not hasattr(signal, "setitimer") or signal.getitimer(signal.ITIMER_REAL)[0] > 0.0:
        yield
        return

    def end(number: int, frame: FrameType | None) -> None:
        raise NotConverged(f"{name}: not finished after the time limit of {seconds:g} s")

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, min(seconds, 1e9))
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
