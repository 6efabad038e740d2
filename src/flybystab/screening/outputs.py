"""Output tables of a run: they grow with the journal and are rebuilt from it after an interruption."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from flybystab.screening.journal import Journal
from flybystab.screening.result_rows import Row
from flybystab.screening.results import Column
from flybystab.screening.table_files import TableFile, write_rows

#: Key of the rows in a record of the journal -> file and columns of their table.
Tables = Mapping[str, tuple[Path, Mapping[str, Column]]]


class Outputs:
    """Tables written in the order of the tasks, independent of the order in which the tasks end.

    The rows of a task are appended as soon as all tasks before it are finished; those of tasks that end early stay in
    the journal, on disk. An unfinished table has a temporary name: after a kill the journal holds every row.

    Parameters
    ----------
    journal : Journal
    tables : mapping of str to (Path, columns)
    meta : mapping
        Provenance of a complete table.
    replace : bool
        Tables of these names that exist now may be replaced.
    """

    def __init__(
        self, journal: Journal, tables: Tables, meta: Mapping[str, object], *, replace: bool = True
    ) -> None:
        self._journal, self._tables, self._replace = journal, tables, replace
        self._next = 0
        self._files: dict[str, TableFile] = {}
        folders = {path.parent for path, _ in tables.values()}
        for name, inode in journal.unfinished_files:  # of a run that was killed
            for file in (folder / name for folder in folders):
                with suppress(OSError):
                    if file.lstat().st_ino == inode:
                        file.unlink()
        try:
            for kind, (path, columns) in tables.items():
                self._files[kind] = TableFile(path, columns, meta, replace=replace)
                journal.add_file(self._files[kind].part)
        except BaseException:
            self.discard()
            raise

    def follow(self, task: int = -1, content: Mapping[str, list[Row]] | None = None) -> None:
        """Append the rows of all tasks that are next; `content` is that of `task`, which need not be read again."""
        while self._next in self._journal:
            found = content if content and task == self._next else self._journal.task(self._next)
            for kind, file in self._files.items():
                for row in found[kind]:
                    file.write(row)
            self._next += 1

    def finish(self) -> None:
        """Give the tables their names when every task is finished."""
        self.follow()
        for file in self._files.values():
            file.finish()

    def discard(self) -> None:
        """Remove the unfinished tables."""
        for file in self._files.values():
            file.discard()

    def so_far(self, meta: Mapping[str, object]) -> None:
        """Write valid tables of the finished tasks.

        They are rebuilt from the journal, since an interrupt may have left an incomplete row.
        """
        self.discard()
        for kind, (path, columns) in self._tables.items():
            rows = (r for t in self._journal.tasks() for r in t[kind])
            write_rows(rows, path, columns, meta, replace=self._replace)
