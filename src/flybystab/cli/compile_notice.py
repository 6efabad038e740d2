"""A word while kernels are compiled: the first run on a machine is otherwise silent for a minute."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from numba.core import event

WORDS = "flybystab: compiling its kernels, once on this machine (about a minute) ...\n"


class Announcement(event.Listener):
    """Says on a stream, once, that kernels are compiled, at the first one; kernels from the cache do not count."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.said = False

    def say(self) -> None:
        """Say it, unless it has been said."""
        if not self.said:
            self.said = True
            self.stream.write(WORDS)
            self.stream.flush()

    def on_start(self, event: event.Event) -> None:
        """Numba begins to compile a function."""
        self.say()

    def on_end(self, event: event.Event) -> None:
        """Numba has compiled a function."""


@contextmanager
def announced(stream: TextIO, *, elsewhere: bool = False) -> Iterator[None]:
    """Announce compilations on a stream, a terminal or a log, until the end of the block.

    Parameters
    ----------
    stream : text file
    elsewhere : bool
        Whether other processes compute: their kernels are announced at once, if the cache has none of a screening's.
    """
    listener = Announcement(stream)
    if elsewhere and not _cached():
        listener.say()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)


def _cached() -> bool:
    """Whether a screening has run here: its first kernel is in the cache, or cannot be."""
    from flybystab.core.ellipsoid.yield_bound import quick_margins

    folder = quick_margins.stats.cache_path
    return folder is None or any(Path(folder).glob("yield_bound.quick_margins-*.nbi"))
