"""Progress of calculations that may take longer than two seconds, on the standard error: bars by tqdm, lines in a log.

Functions with the argument ``progress`` show a bar after :data:`DELAY` if the standard error is a terminal or belongs
to a notebook. ``True`` asks for it everywhere (where there is no terminal, a line every :data:`QUIET` seconds),
``False`` for none, and a function is called with the finished and the total number of parts instead.
"""

from __future__ import annotations

import multiprocessing
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from tqdm.std import tqdm

#: Types accepted by the argument ``progress``.
Progressing = bool | Callable[[int, int], None] | None
#: Seconds before a bar appears that was not requested.
DELAY = 2.0
#: Seconds between two lines where there is no terminal.
QUIET = 30.0
#: Seconds between two updates of a bar, on a terminal and in a notebook, which may keep all of them.
FRAME, NOTEBOOK_FRAME = 0.1, 0.5
_FORMAT = "{desc}[{bar:20}] {n_fmt}/{total_fmt}{unit}, {rate_noinv_fmt}, {remaining} left{postfix}"
_LINE = "{desc}{n_fmt}/{total_fmt}{unit}, {rate_noinv_fmt}, {remaining} left{postfix}"
#: Held while a bar is shown; calculations nested in that one show none.
_busy = threading.Lock()


class Bar:
    """A bar on a terminal or in a notebook, occasional lines elsewhere.

    Parameters
    ----------
    total : int
        Number of parts.
    unit : str
        Name of the parts, such as "asteroids".
    title : str
    stream : text file, optional
        The standard error by default.
    delay : float
        Seconds before it appears.
    leave : bool
        Whether the bar stays after the end.
    initial : int
        Parts that were finished before; they do not count in the rate.
    """

    def __init__(
        self,
        total: int,
        unit: str,
        title: str = "",
        *,
        stream: TextIO | None = None,
        delay: float = 0.0,
        leave: bool = True,
        initial: int = 0,
    ) -> None:
        self.stream = sys.stderr if stream is None else stream
        self.drawn = draws(self.stream)
        self._frame = NOTEBOOK_FRAME if in_notebook() else FRAME
        self.total, self.initial = total, initial
        self._begun = time.monotonic()
        self._next = self._begun + (delay if self.drawn else QUIET)
        self._words = {"desc": f"{title} " if title else "", "unit": f" {unit}"}
        self._leave, self._lock = leave, threading.Lock()
        self._outer = _busy.acquire(blocking=False)
        self._bar: tqdm | None = None
        self._note, self._done = "", float(initial)

    def __call__(self, done: float, note: str = "") -> None:
        """Show the number of finished parts, and a note behind it."""
        with self._lock:
            self._done, self._note = done, note
            now = time.monotonic()
            if now < self._next:
                return
            self._next = now + (self._frame if self.drawn else QUIET)
            self._show()

    def _show(self) -> None:
        if not self.drawn:
            self.stream.write(self._text() + "\n")
            self.stream.flush()
            return
        if self._bar is None:
            self._bar = tqdm(
                total=self.total,
                initial=self.initial,
                file=self.stream,
                bar_format=_FORMAT,
                ascii=".#",
                ncols=_width(),
                nrows=20,
                leave=self._leave,
                delay=1e-9,
                mininterval=0.0,
                **self._words,
            )
            self._bar.start_t = self._bar._time() - (time.monotonic() - self._begun)
        self._update()
        self._bar.refresh()

    def _update(self) -> None:
        assert self._bar is not None
        self._bar.n = int(self._done) if float(self._done).is_integer() else round(self._done, 2)
        self._bar.ncols = _width()
        self._bar.set_postfix_str(self._note, refresh=False)
        self._bar.last_print_t = self._bar._time()  # otherwise close() treats the bar as never shown

    def text(self, done: float, note: str, seconds: float, width: int = 0) -> str:
        """One line: with a bar and as wide as `width` if it is positive."""
        return tqdm.format_meter(
            int(done) if float(done).is_integer() else round(done, 2),
            self.total,
            seconds,
            ncols=width or None,
            ascii=".#",
            initial=self.initial,
            bar_format=_FORMAT if width else _LINE,
            prefix=self._words["desc"],
            unit=self._words["unit"],
            postfix=note or None,
        )

    def _text(self) -> str:
        return self.text(self._done, self._note, time.monotonic() - self._begun)

    def __del__(self) -> None:
        self._release()  # a bar that was never closed must not hide those of later calculations

    def _release(self) -> None:
        if getattr(self, "_outer", False):
            _busy.release()
            self._outer = False

    def close(self) -> None:
        """Draw the last state and end the line, so that other text can follow."""
        self._release()
        with self._lock:
            if self._bar is not None:
                self._update()
                self._bar.close()
                self._bar = None
            elif not self.drawn and self._done >= self.total:
                self.stream.write(self._text() + "\n")
                self.stream.flush()


@contextmanager
def progress_bar(
    asked: Progressing, total: int, unit: str, title: str = ""
) -> Iterator[Callable[[float], None]]:
    """A function that takes the number of finished parts, for the argument ``progress`` of a calculation.

    Parameters
    ----------
    asked : bool, function (done, total) or None
        The argument ``progress``.
    total : int
    unit : str
        Name of the parts, in the plural.
    title : str
        Name of the calculation.

    Raises
    ------
    InvalidInput
        For another type.
    """
    check_progress(asked)
    if callable(asked):
        yield lambda done: asked(int(done), total)
        return
    wanted = asked is not False and (asked or draws(sys.stderr))
    if not wanted or not _outermost() or _busy.locked():
        yield lambda done: None
        return
    bar = Bar(total, unit, title, delay=0.0 if asked else DELAY, leave=bool(asked))
    try:
        yield bar
    finally:
        bar.close()


def check_progress(asked: object) -> None:
    """Check that the argument ``progress`` is one of :data:`Progressing`.

    Raises
    ------
    InvalidInput
    """
    if asked is not None and not isinstance(asked, bool) and not callable(asked):
        from flybystab.errors import InvalidInput

        raise InvalidInput("progress", asked, "True, False, None or a function of (done, total)")


def draws(stream: object) -> bool:
    """True if bars can be drawn on a stream: a terminal, or the standard error of a notebook."""
    terminal = bool(getattr(stream, "isatty", lambda: False)())
    return terminal or (stream is sys.stderr and in_notebook())


def _width() -> int:
    """Columns of the terminal less one; 79 if the number is unknown."""
    return shutil.get_terminal_size().columns - 1


def in_notebook() -> bool:
    """True if Python runs in the kernel of a notebook."""
    if "IPython" not in sys.modules:
        return False
    shell = sys.modules["IPython"].get_ipython()
    return shell is not None and "IPKernelApp" in shell.config


def _outermost() -> bool:
    """True in the main thread of the main process: others would write into its bar."""
    return threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None
