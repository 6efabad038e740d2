"""A screening that writes its tables to files: checks before the run, journal, progress, and what is kept on errors."""

from __future__ import annotations

import os
import time as clock
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

from flybystab.errors import FlybystabWarning, InvalidInput, OutputFailed
from flybystab.screening.columns import COLUMNS, SAMPLE_COLUMNS
from flybystab.screening.journal import Journal
from flybystab.screening.outputs import Outputs
from flybystab.screening.progress import Progress
from flybystab.screening.result_rows import Row
from flybystab.screening.results import Column, read_meta
from flybystab.screening.sample_verdicts import SampleVerdicts
from flybystab.screening.table_files import check_output
from flybystab.screening.tasks import Rows
from flybystab.typing import Document

#: Path and columns of each table of a run.
Tables = dict[str, tuple[Path, Mapping[str, Column]]]
#: Results in order of completion, from the journal, the report of progress, and the parts that are kept.
Results = Callable[[Journal, Callable[[float], None], "KeptParts"], Iterator[tuple[int, Rows]]]


def output_tables(output: str | Path, samples_output: str | Path | None, *, keep_samples: bool) -> Tables:
    """The tables of a run.

    Raises
    ------
    InvalidInput
        A file cannot be written, both are one file, or samples are not kept.
    """
    out = check_output(output)
    tables: Tables = {"rows": (out, COLUMNS)}
    if samples_output is not None:
        if not keep_samples:
            raise InvalidInput("samples_output", str(samples_output), "keep_samples in the settings")
        second = check_output(samples_output)
        if second.resolve() == out.resolve() or (second.exists() and out.exists() and second.samefile(out)):
            raise InvalidInput("samples_output", str(samples_output), "a file other than the output")
        tables["samples"] = second, SAMPLE_COLUMNS
    return tables


class ResumableRun:
    """One run of a screening with its journal and tables.

    Parameters
    ----------
    tables : dict
        Of :func:`output_tables`.
    total : int
        Number of asteroids.
    meta : callable
        Provenance of the tables; the argument tells whether they are complete.
    fingerprint : mapping
        Settings that must agree with those of the journal.
    overwrite : bool
        Replace existing tables.
    progress : callable, optional
        Called with a :class:`Progress` after every asteroid.

    Raises
    ------
    InvalidInput
        A table exists already, or the journal belongs to another run.
    """

    def __init__(
        self,
        tables: Tables,
        total: int,
        meta: Callable[[bool], Document],
        fingerprint: Mapping[str, object],
        *,
        overwrite: bool,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self.tables, self.total, self.meta, self.progress = tables, total, meta, progress
        self.output = tables["rows"][0]
        taken = self._existing(overwrite=overwrite)
        self.replace = overwrite or taken
        self.journal = Journal(self._journal_file, dict(fingerprint))
        if self.journal.damaged:
            # The caller of Screening.run.
            warnings.warn(self._damage(), FlybystabWarning, stacklevel=3)
        self.began = clock.monotonic()
        self.resumed = self.journal.count
        self.counts: Counter[str] = Counter()
        for task in self.journal.tasks():
            self._count(task["rows"])

    @property
    def _journal_file(self) -> Path:
        return self.output.with_name(self.output.name + ".journal")

    def _existing(self, *, overwrite: bool) -> bool:
        """True if a table exists; raises InvalidInput if it may not be replaced."""
        unfinished = os.path.lexists(self._journal_file)
        taken = [path for path, _ in self.tables.values() if os.path.lexists(path)]
        for path in () if overwrite else taken:
            # A resumed run may replace its own table only.
            if not unfinished or read_meta(path).get("settings") != self.meta(True)["settings"]:
                raise InvalidInput(
                    "output",
                    str(path),
                    "a file that does not exist; --overwrite (overwrite=True) replaces it",
                )
        return bool(taken)

    def _damage(self) -> str:
        """Description of the losses of a damaged journal."""
        journal = self.journal
        lines = ", ".join(map(str, journal.damaged[:10])) + (", ..." if len(journal.damaged) > 10 else "")
        return (
            f"{journal.path} is damaged in {len(journal.damaged)} of its lines ({lines}); their results are lost. "
            f"{journal.count} of {self.total} asteroids are intact, the others are recomputed"
        )

    def _count(self, rows: Iterable[Row]) -> None:
        self.counts.update(r.get("verdict") or "error" for r in rows)

    def state(self, begun: float = 0.0) -> Progress:
        """Progress of the run; `begun` is the sum of the fractions of the asteroids in progress."""
        seconds = clock.monotonic() - self.began
        rows, verdicts = self.counts.total(), dict(self.counts)
        return Progress(self.journal.count, self.total, self.resumed, rows, verdicts, seconds, begun)

    def report(self, begun: float = 0.0) -> None:
        """Call the function for the progress."""
        if self.progress is not None:
            self.progress(self.state(begun))

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Raise :class:`OutputFailed` for errors of the disk, with what is saved and how to resume."""
        try:
            yield
        except OSError as error:
            raise OutputFailed(
                f"{self.output.parent} can no longer be written ({error.strerror or error}). {self.journal.count} of "
                f"{self.total} asteroids are saved in {self.journal.path}: free some space and repeat "
                "the same command"
            ) from None

    def finish(self, results: Results) -> Progress:
        """Compute the missing results and write the tables; after an interruption, tables of the finished rows."""
        journal, outputs = self.journal, None
        try:
            with self.writing():
                outputs = Outputs(journal, self.tables, self.meta(True), replace=self.replace)
                outputs.follow()
            self.report()
            for i, result in results(journal, self.report, KeptParts(journal, self.writing)):
                with self.writing():
                    journal.add(i, result)
                    outputs.follow(i, result)
                self._count(result["rows"])
                self.report()
            with self.writing():
                outputs.finish()
        except BaseException:
            try:
                if outputs is not None:
                    with self.writing():
                        outputs.so_far(self.meta(False))
            finally:
                with suppress(OSError):  # a full disk is reported already
                    journal.close()
            raise
        journal.close(remove=True)
        return self.state()


class KeptParts:
    """Finished parts of the asteroids in progress, stored in the journal."""

    def __init__(self, journal: Journal, writing: Callable[[], AbstractContextManager[None]]) -> None:
        self._journal, self._writing = journal, writing

    def add(self, asteroid: int, encounter: int, first: int, verdicts: SampleVerdicts) -> None:
        """Store the verdicts on the samples of an encounter from number `first` on."""
        with self._writing():
            self._journal.add_part(asteroid, encounter, first, verdicts.stored())

    def of(self, asteroid: int) -> list[Document]:
        """The stored parts of an asteroid."""
        return self._journal.parts(asteroid)
