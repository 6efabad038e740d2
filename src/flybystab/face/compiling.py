"""A word on the terminal while kernels are compiled: the first run on a machine is otherwise silent for a minute."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from numba.core import event

WORDS = "flybystab: compiling its kernels, once on this machine (about a minute) ...\n"


class Announcement(event.Listener):
    """Says on a stream that kernels are compiled, at the first one; kernels from the cache do not count."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.said = False

    def on_start(self, event: event.Event) -> None:
        """Numba begins to compile a function."""
        if not self.said:
            self.said = True
            self.stream.write(WORDS)
            self.stream.flush()

    def on_end(self, event: event.Event) -> None:
        """Numba has compiled a function."""


def announce(stream: TextIO) -> Announcement:
    """Announce compilations from now on."""
    listener = Announcement(stream)
    event.register("numba:compile", listener)
    return listener


def announce_elsewhere(stream: TextIO) -> None:
    """Say at once that kernels will be compiled, in other processes, if the cache has none of a screening's."""
    from flybystab.core.quick import quick_margins

    folder = quick_margins.stats.cache_path
    if folder is not None and not any(Path(folder).glob("quick.quick_margins-*.nbi")):
        stream.write(WORDS)
        stream.flush()
