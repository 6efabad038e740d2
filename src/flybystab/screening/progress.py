"""Progress of a screening: a bar on a terminal, occasional lines in a log; always on the standard error."""

from __future__ import annotations

import shutil
import sys
import time
from dataclasses import dataclass
from typing import TextIO

import numpy as np

#: Seconds between two lines where there is no terminal.
QUIET = 30.0
#: Seconds between two updates of the bar.
FRAME = 0.1


@dataclass(frozen=True)
class Progress:
    """Progress of a run.

    Attributes
    ----------
    done, total : int
        Asteroids.
    resumed : int
        Of these, finished in an earlier run.
    rows : int
        Encounters.
    verdicts : dict of str to int
        Encounters by verdict; "error" counts rows that failed.
    seconds : float
        Since this run began.
    begun : float
        Completed fraction of the asteroids in progress, by samples, summed over them.
    """

    done: int
    total: int
    resumed: int
    rows: int
    verdicts: dict[str, int]
    seconds: float
    begun: float = 0.0

    @property
    def rate(self) -> float:
        """Asteroids per second in this run."""
        return (self.done + self.begun - self.resumed) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def remaining(self) -> float:
        """Seconds left at this rate."""
        return (self.total - self.done - self.begun) / self.rate if self.rate > 0.0 else np.inf


class ProgressBar:
    """A callable for ``progress=``: a bar with rate, time left and verdicts.

    Parameters
    ----------
    stream : text file, optional
        The standard error by default. If it is no terminal, a line is written every 30 s and at the end.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.terminal = bool(getattr(self.stream, "isatty", lambda: False)())
        self._last = -np.inf if self.terminal else time.monotonic()

    def __call__(self, state: Progress) -> None:
        """Show a state."""
        now = time.monotonic()
        end = state.done >= state.total
        if not end and now - self._last < (FRAME if self.terminal else QUIET):
            return
        self._last = now
        if self.terminal:
            width = shutil.get_terminal_size().columns
            self.stream.write("\r" + self.line(state, width).ljust(width - 1) + ("\n" if end else ""))
        else:
            self.stream.write(self.line(state) + "\n")
        self.stream.flush()

    def end(self) -> None:
        """End the line of the bar, so that other text can follow."""
        if self.terminal:
            self.stream.write("\n")
            self.stream.flush()

    def line(self, state: Progress, width: int = 0) -> str:
        """One line of text, cut to `width` if it is positive."""
        share = (state.done + state.begun) / state.total if state.total else 1.0
        verdicts = ", ".join(f"{n} {v}" for v, n in sorted(state.verdicts.items(), key=lambda x: -x[1]))
        text = f"{state.done}/{state.total} asteroids, {state.rate:.3g}/s"
        if 0.0 < state.remaining < np.inf:
            text += f", {duration(state.remaining)} left"
        text += f", {state.rows} encounters" + (f": {verdicts}" if verdicts else "")
        if width:
            full = int(20 * share)
            text = f"[{'#' * full}{'.' * (20 - full)}] {text}"[: width - 1]
        return text


def duration(seconds: float) -> str:
    """A duration with a suitable unit: 48 s, 3 min, 2.5 h, 4 d."""
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.0f} s"
