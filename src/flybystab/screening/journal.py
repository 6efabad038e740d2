"""The journal of a screening: results of finished asteroids, and of parts of long ones, on disk.

The journal is kept beside the output during a run. Each record is one line of JSON with a checksum. It is written as
soon as its result is available, and synchronised to disk at least every `SYNC_INTERVAL` seconds and before the run
reports success. A run that was killed, also by a power failure, resumes from its journal; the last line may then be
incomplete and is dropped. A record whose checksum does not agree is reported, and its result is recomputed.
"""

from __future__ import annotations

import errno
import json
import os
import time as clock
from array import array
from collections.abc import Iterator, Mapping
from hashlib import blake2b
from io import FileIO
from pathlib import Path
from typing import BinaryIO

from flybystab.errors import InvalidInput, OutputFailed
from flybystab.typing import Document

#: Longest time between two fsync calls while records are written, s: the most work that a power failure can lose.
SYNC_INTERVAL = 1.0

_MARK = b', "checksum": "'


class Journal:
    """Records of finished tasks and of parts of tasks behind a header that identifies the run.

    Parameters
    ----------
    path : Path
        Created if it does not exist.
    header : mapping
        Description of the run; the journal of another run is refused.

    Attributes
    ----------
    count : int
        Number of finished tasks; ``task in journal`` tells whether a task is finished.
    damaged : list of int
        Numbers of the lines that were damaged when the journal was opened.
    resumed : bool
        The journal existed.

    Raises
    ------
    InvalidInput
        The file is the journal of another run, or not a journal, or in use by another process.
    """

    def __init__(self, path: Path, header: Mapping[str, object]) -> None:
        self.path = path
        self.count = 0
        self.damaged: list[int] = []
        self.unfinished_files: list[tuple[str, int]] = []
        # Offset of each task's record, -1 without one: 8 bytes per task.
        self._offsets = array("q")
        # Offsets of the parts of tasks that are not finished.
        self._parts: dict[int, list[int]] = {}
        text = json.dumps(header, sort_keys=True).encode()
        # Checksums depend on the header: a record of another run never passes as one of this run.
        self._key = blake2b(text, digest_size=32).digest()
        self._file = _open_locked(path)
        self._synced = clock.monotonic()
        try:
            self.resumed = os.fstat(self._file.fileno()).st_size > 0
            if self.resumed:
                self._recover(text + b"\n")
            else:
                self._file.write(text + b"\n")
                self.sync()
                sync_folder(path.parent)
        except BaseException:
            self._file.close()
            raise

    def _recover(self, header: bytes) -> None:
        """Index the records that are intact."""
        with self.path.open("rb") as stream:
            first = stream.readline()
            end, number = stream.tell(), 1
            for line in stream:
                number += 1
                if not line.endswith(b"\n"):
                    break  # the run ended while it wrote this line
                if (found := self._decoded(line)) is None:
                    self.damaged.append(number)
                elif "unfinished_file" in found:
                    self.unfinished_files.append((found["unfinished_file"], found["inode"]))
                elif "first" in found:
                    self._parts.setdefault(found["task"], []).append(end)
                else:
                    self._note(found["task"], end)
                end += len(line)
        intact = number - 1 - len(self.damaged) > 0 and end > len(first)
        if first != header and not header.startswith(first):
            if not (intact and (self.count or self._parts or self.unfinished_files)):
                raise InvalidInput(
                    "journal",
                    str(self.path),
                    f"the journal of this run; another run is unfinished there{_difference(first, header)}. "
                    "Start that one again to finish it, or remove the file",
                )
            self.damaged.insert(0, 1)  # the header is damaged, but its records are those of this run
        elif first != header:  # the run ended while it wrote its header
            os.ftruncate(self._file.fileno(), 0)
            self._file.write(header)
            return
        os.ftruncate(self._file.fileno(), end)

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

    def add(self, task: int, content: Mapping[str, object]) -> None:
        """Record a finished task, unless it is recorded already."""
        if task in self:
            return
        self._note(task, self._append({"task": task, **content}))

    def add_part(self, task: int, approach: int, first: int, content: Mapping[str, object]) -> None:
        """Record a part of a task: the samples from `first` on of one of its encounters."""
        offset = self._append({"task": task, "passage": approach, "first": first, **content})
        self._parts.setdefault(task, []).append(offset)

    def add_file(self, path: Path) -> None:
        """Record that this run writes the file `path`, to be removed if the run does not reach its end."""
        self._append({"unfinished_file": path.name, "inode": path.stat().st_ino, "folder": str(path.parent)})

    def _append(self, content: Mapping[str, object]) -> int:
        """Write one record; returns its offset."""
        body = json.dumps(content).encode()[:-1]
        line = memoryview(body + _MARK + self._checksum(body) + b'"}\n')
        offset = self._file.seek(0, os.SEEK_END)
        while line:
            line = line[self._file.write(line) :]
        if clock.monotonic() - self._synced > SYNC_INTERVAL:
            self.sync()
        return offset

    def _checksum(self, body: bytes) -> bytes:
        return blake2b(body, digest_size=8, key=self._key).hexdigest().encode()

    def _decoded(self, line: bytes) -> Document | None:
        """Content of a record; None if it is damaged."""
        body, mark, rest = line.rpartition(_MARK)
        if not mark or rest != self._checksum(body) + b'"}\n':
            return None
        return dict(json.loads(line))

    def sync(self) -> None:
        """Synchronise written records to disk."""
        sync_file(self._file.fileno())
        self._synced = clock.monotonic()

    def parts(self, task: int) -> list[Document]:
        """The parts of a task that is not finished."""
        with self.path.open("rb") as stream:
            return [self._record(stream, offset) for offset in self._parts.get(task, ())]

    def _record(self, stream: BinaryIO, offset: int) -> Document:
        stream.seek(offset)
        found = self._decoded(stream.readline())
        if found is None:
            raise OutputFailed(
                f"{self.path} was changed while the run used it (byte {offset}): run the same command again; "
                "damaged results are recomputed"
            )
        return found

    def tasks(self) -> Iterator[Document]:
        """The finished tasks in their order, read one by one."""
        with self.path.open("rb") as stream:
            for offset in self._offsets:
                if offset >= 0:
                    yield self._record(stream, offset)

    def task(self, task: int) -> Document:
        """A finished task."""
        with self.path.open("rb") as stream:
            return self._record(stream, self._offsets[task])

    def close(self, *, remove: bool = False) -> None:
        """Close the file; `remove` it once the tables made from it are on disk."""
        if remove:
            # Removed before the lock is released, so that no other run can open it.
            self.path.unlink(missing_ok=True)
            sync_folder(self.path.parent)
        else:
            self.sync()
        self._file.close()


def _open_locked(path: Path) -> FileIO:
    """The file opened for appending and locked, without following a symbolic link."""
    while True:
        try:
            flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0)
            # A FIFO without a reader would block.
            number = os.open(path, flags | getattr(os, "O_NONBLOCK", 0), 0o666)
        except OSError as error:
            reason = "not a symbolic link" if error.errno == errno.ELOOP else error.strerror
            raise InvalidInput("journal", str(path), f"a file that can be written ({reason})") from None
        if not path.is_file():
            os.close(number)
            raise InvalidInput("journal", str(path), "an ordinary file")
        # Unbuffered: a full disk is noticed with the record that does not fit.
        file = os.fdopen(number, "ab", buffering=0)
        _lock(file, path)
        try:
            if os.stat(path).st_ino == os.fstat(number).st_ino:
                return file
        except FileNotFoundError:
            pass
        file.close()  # another run has just finished and removed it


def _lock(file: FileIO, path: Path) -> None:
    """Refuse a second process on the same journal."""
    try:
        import fcntl
    except ImportError:  # not on this system
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise InvalidInput("journal", str(path), "no other run that writes to it now") from None
    except OSError:  # a file system without locks
        pass


def sync_file(number: int) -> None:
    """Force a file to the disk, where the file system can."""
    try:
        os.fsync(number)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EROFS):
            raise


def sync_folder(path: Path) -> None:
    """Force the entries of a folder to the disk, where the system can."""
    try:
        number = os.open(path, os.O_RDONLY)
    except OSError:  # Windows, or a folder that may be written but not read
        return
    try:
        sync_file(number)
    finally:
        os.close(number)


def _difference(theirs: bytes, ours: bytes) -> str:
    """The settings in which the header of another run differs."""
    try:
        a, b = (json.loads(text).get("settings", {}) for text in (theirs, ours))
        keys = [k for k in b if a.get(k) != b[k]]
    except (ValueError, AttributeError):
        return ""
    if not a or not keys:
        return ""
    return ", with " + ", ".join(f"{k} = {a.get(k)} instead of {b[k]}" for k in keys[:3])
