"""The journal of a screening: finished tasks on disk, whatever ends the run.

Every finished task is one line next to the output, and so is every finished part of one that takes long. A killed run
leaves at worst half a last line, which the next run drops; it then goes on with what is missing. Tables are made from
it in the order of the tasks.
"""

from __future__ import annotations

import json
import os
from array import array
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from flybystab.errors import InvalidInput


class Journal:
    """Finished tasks and parts of tasks, one JSON line each, behind a first line that says which run they belong to.

    Parameters
    ----------
    path : Path
        Created if it is not there.
    header : mapping
        What the run computes; a journal with another header is refused.

    Attributes
    ----------
    count : int
        Finished tasks; ``task in journal`` says whether one of them is finished.

    Raises
    ------
    InvalidInput
        The file is the journal of another run, or not a journal, or another process writes to it.
    """

    def __init__(self, path: Path, header: Mapping[str, Any]) -> None:
        self.path = path
        self.count = 0
        # Offset of each task's line, -1 where there is none: 8 bytes a task.
        self._offsets = array("q")
        # Of tasks that are not finished: the offsets of their parts.
        self._parts: dict[int, list[int]] = {}
        wanted = json.dumps(header, sort_keys=True)
        # Unbuffered: what is written is in the hands of the system, and a full disk is noticed at once.
        self._file = path.open("ab", buffering=0)
        self._lock()
        try:
            if path.stat().st_size:
                self._recover(wanted)
            else:
                self._file.write(wanted.encode() + b"\n")
        except BaseException:
            self._file.close()
            raise

    def _lock(self) -> None:
        """Refuse a second process on the same journal."""
        try:
            import fcntl
        except ImportError:  # not on this system
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise InvalidInput("journal", str(self.path), "no other run that writes to it now") from None
        except OSError:  # a file system without locks
            pass

    def _recover(self, wanted: str) -> None:
        with self.path.open("r+b") as stream:
            first, line = stream.readline(), wanted.encode() + b"\n"
            if first != line:
                if not line.startswith(first):
                    raise InvalidInput(
                        "journal",
                        str(self.path),
                        "this run's journal; another run is unfinished there"
                        f"{_difference(first, line)}. Start that one again to finish it, or remove the file",
                    )
                stream.seek(0)  # killed while it wrote its first line
                stream.write(line)
                stream.truncate()
                return
            end = stream.tell()
            for line in stream:
                try:
                    found = json.loads(line) if line.endswith(b"\n") else {}
                    task, part = int(found["task"]), "first" in found
                except (ValueError, KeyError, TypeError):
                    break
                if part:
                    self._parts.setdefault(task, []).append(end)
                else:
                    self._note(task, end)
                end += len(line)
            stream.truncate(end)

    def __contains__(self, task: object) -> bool:
        return isinstance(task, int) and 0 <= task < len(self._offsets) and self._offsets[task] >= 0

    def _note(self, task: int, offset: int) -> None:
        if task in self:
            return
        if task >= len(self._offsets):
            self._offsets.extend([-1] * (task + 1 - len(self._offsets)))
        self._offsets[task] = offset
        self._parts.pop(task, None)
        self.count += 1

    def add(self, task: int, content: Mapping[str, Any]) -> None:
        """Write down a finished task; a task that is there already is not repeated."""
        if task in self:
            return
        self._note(task, self._append({"task": task, **content}))

    def add_part(self, task: int, passage: int, first: int, content: Mapping[str, Any]) -> None:
        """Write down a part of a task: samples from `first` on of one of its passages."""
        offset = self._append({"task": task, "passage": passage, "first": first, **content})
        self._parts.setdefault(task, []).append(offset)

    def _append(self, content: Mapping[str, Any]) -> int:
        """Write one line; where it begins."""
        line = memoryview(json.dumps(content).encode() + b"\n")
        offset = self._file.seek(0, os.SEEK_END)
        while line:
            line = line[self._file.write(line) :]
        return offset

    def parts(self, task: int) -> list[dict[str, Any]]:
        """The parts of a task that is not finished."""
        with self.path.open("rb") as stream:
            return [self._line(stream, offset) for offset in self._parts.get(task, ())]

    @staticmethod
    def _line(stream: BinaryIO, offset: int) -> dict[str, Any]:
        stream.seek(offset)
        return dict(json.loads(stream.readline()))

    def tasks(self) -> Iterator[dict[str, Any]]:
        """The finished tasks in their order, read one by one."""
        with self.path.open("rb") as stream:
            for offset in self._offsets:
                if offset >= 0:
                    yield self._line(stream, offset)

    def task(self, task: int) -> dict[str, Any]:
        """A finished task."""
        with self.path.open("rb") as stream:
            return self._line(stream, self._offsets[task])

    def close(self, *, remove: bool = False) -> None:
        """Close the file, and remove it if everything it holds is safe elsewhere."""
        self._file.close()
        if remove:
            self.path.unlink(missing_ok=True)


def _difference(theirs: bytes, ours: bytes) -> str:
    """In what another run's header differs, for a reader."""
    try:
        a, b = (json.loads(text).get("settings", {}) for text in (theirs, ours))
    except (ValueError, AttributeError):
        return ""
    keys = [k for k in b if a.get(k) != b[k]]
    if not a or not keys:
        return ""
    return ", with " + ", ".join(f"{k} = {a.get(k)} instead of {b[k]}" for k in keys[:3])
