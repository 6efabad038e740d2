"""Progress of a screening: its state, and the bar that shows it (:mod:`flybystab.progress`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TextIO

import numpy as np

from flybystab.progress import Bar
from flybystab.units import number_of


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

    @property
    def note(self) -> str:
        """Encounters by verdict, the most frequent first."""
        verdicts = ", ".join(f"{n} {v}" for v, n in sorted(self.verdicts.items(), key=lambda x: -x[1]))
        return number_of(self.rows, "encounter") + (f": {verdicts}" if verdicts else "")


class ProgressBar:
    """A callable for ``progress=`` of a screening: a bar with rate, time left and verdicts.

    Parameters
    ----------
    stream : text file, optional
        The standard error by default. If it is no terminal, a line is written every 30 s and at the end.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._bar = Bar(0, "asteroids", stream=stream)

    def __call__(self, state: Progress) -> None:
        """Show a state."""
        self._bar.total, self._bar.initial = state.total, state.resumed
        self._bar(state.done + state.begun, state.note)
        if state.done >= state.total:
            self._bar.close()

    def line(self, state: Progress, width: int = 0) -> str:
        """One line of text: with a bar and as wide as `width` if it is positive."""
        self._bar.total, self._bar.initial = state.total, state.resumed
        return self._bar.text(state.done + state.begun, state.note, state.seconds, width)

    def end(self) -> None:
        """End the line of the bar, so that other text can follow."""
        self._bar.close()
