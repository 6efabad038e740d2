"""Compilation notice: the first run on a machine compiles the kernels, which takes about a minute.

The shell shows the notice during a command (:mod:`flybystab.cli.compile_notice`); in Python and in notebooks
:func:`install` shows it at the first kernel that is compiled after a name of the package has been used.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TextIO

from numba.core import event
from numba.misc.appdirs import AppDirs

from flybystab.core.numerics.jit import CACHE

WORDS = "flybystab: compiling numerical kernels, once on this machine (about a minute) ...\n"
#: Notices if the folder of the package, or also the user's cache folder, is not writable.
KEPT = "flybystab: compiling numerical kernels (about a minute), once; they are kept in {folder} ...\n"
NOT_KEPT = (
    "flybystab: compiling numerical kernels (about a minute) for this process only: neither the package nor the user's "
    "cache folder can be written; set NUMBA_CACHE_DIR to a folder that can\n"
)


def words() -> str:
    """Text of the notice, with the folder of the kernels if it is not that of their sources."""
    if not CACHE:
        return NOT_KEPT
    if folder := os.environ.get("NUMBA_CACHE_DIR"):
        return KEPT.format(folder=folder)
    package = Path(__file__).resolve().parents[2]
    if os.access(package / "core" / "numerics", os.W_OK):
        return WORDS
    return KEPT.format(folder=AppDirs(appname="numba", appauthor=False).user_cache_dir)


class Announcement(event.Listener):
    """Listener for compilation by numba that writes the notice once; kernels loaded from the cache do not count.

    Parameters
    ----------
    stream : text file, optional
        By default ``sys.stderr`` at the time of the notice.
    package : str
        Only functions of this package count; by default all.
    """

    def __init__(self, stream: TextIO | None = None, package: str = "") -> None:
        self.stream = stream
        self.package = package
        self.said = False

    def say(self) -> None:
        """Write the notice unless it has been written."""
        if not self.said:
            self.said = True
            stream = sys.stderr if self.stream is None else self.stream
            stream.write(words())
            stream.flush()

    def on_start(self, event: event.Event) -> None:
        """Numba begins to compile a function."""
        module = event.data["dispatcher"].py_func.__module__
        if not self.package or (module or "").partition(".")[0] == self.package:
            self.say()

    def on_end(self, event: event.Event) -> None:
        """Numba has compiled a function."""


_INSTALLED: list[Announcement] = []


def install() -> None:
    """Show the notice when the first kernel of this package is compiled in this process; later calls do nothing."""
    if not _INSTALLED:
        _INSTALLED.append(Announcement(package="flybystab"))
        event.register("numba:compile", _INSTALLED[0])


def uninstall() -> None:
    """Undo :func:`install`; for the shell, which shows its own notice, or none with ``--json``."""
    if _INSTALLED:
        event.unregister("numba:compile", _INSTALLED.pop())
