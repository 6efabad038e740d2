"""The tables of a run: they follow its journal, and are made from it again where the run does not reach its end."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flybystab.screening.journal import Journal
from flybystab.screening.results import Column
from flybystab.screening.table_files import TableFile, write_rows

#: What tasks hold, and where it goes: kind of rows -> file and columns.
Tables = Mapping[str, tuple[Path, Mapping[str, Column]]]


class Outputs:
    """Tables that grow while tasks end, in the order of the tasks whatever the order in which they end.

    A task's rows are appended as soon as all tasks before it are done; those that ended early wait in the journal, on
    disk. What is not finished is no table: after a kill the journal has every row.

    Parameters
    ----------
    journal : Journal
    tables : mapping of str to (Path, columns)
    meta : mapping
        Provenance of a whole table.
    """

    def __init__(self, journal: Journal, tables: Tables, meta: Mapping[str, Any]) -> None:
        self._journal, self._tables = journal, tables
        self._next = 0
        self._files: dict[str, TableFile] = {}
        try:
            for kind, (path, columns) in tables.items():
                self._files[kind] = TableFile(path, columns, meta)
        except BaseException:
            self.discard()
            raise

    def follow(self, task: int = -1, content: Mapping[str, Any] | None = None) -> None:
        """Append what can be appended; `content` is that of `task`, which need not be read again."""
        while self._next in self._journal:
            found = content if content and task == self._next else self._journal.task(self._next)
            for kind, file in self._files.items():
                for row in found[kind]:
                    file.write(row)
            self._next += 1

    def finish(self) -> None:
        """Give the tables their names, when every task is done."""
        self.follow()
        for file in self._files.values():
            file.finish()

    def discard(self) -> None:
        """Drop the tables as far as they are."""
        for file in self._files.values():
            file.discard()

    def so_far(self, meta: Mapping[str, Any]) -> None:
        """Valid tables of the tasks that are done, instead of the ones that were growing.

        An interrupt may have come in the middle of a row: they are made from the journal.
        """
        self.discard()
        for kind, (path, columns) in self._tables.items():
            write_rows((r for t in self._journal.tasks() for r in t[kind]), path, columns, meta)
