"""Notice printed by shell commands while kernels are compiled."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from numba.core import event

from flybystab.core.numerics.compile_notice import WORDS, Announcement

__all__ = ["WORDS", "Announcement", "announced"]


@contextmanager
def announced(stream: TextIO, *, elsewhere: bool = False) -> Iterator[None]:
    """Write the notice to a stream if kernels are compiled within the block.

    Parameters
    ----------
    stream : text file
    elsewhere : bool
        The computation runs in other processes. The notice is then written at once, unless the cache contains the first
        kernel of a screening.
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
    """Whether the cache contains the first kernel of a screening; also true without a cache."""
    from flybystab.core.ellipsoid.yield_bound import quick_margins

    folder = quick_margins.stats.cache_path
    return folder is None or any(Path(folder).glob("yield_bound.quick_margins-*.nbi"))
