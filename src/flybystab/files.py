"""Reading files that a user supplies: size and nesting are limited before anything is parsed.

Every reader of a user's file goes through this module, so that the limits are in one place and every
error names them::

    text = read_text(path, "catalogue file")          # decompresses gzip, at most TEXT_LIMIT bytes
    record = parse_json(text, "orbit file", path)     # nesting, digits and syntax checked
    content = parse_toml(text, "scenario file", path)
    for row in csv_rows(text, "catalogue file", path):
        ...

The module lies below every package that reads files and imports errors and types alone. `replace_file` writes a file.
"""

from __future__ import annotations

import csv
import gzip
import io
import json
import os
import re
import stat
import tempfile
import tomllib
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from flybystab.errors import InvalidInput
from flybystab.typing import Document

#: Largest text of one file after decompression, bytes. The MPC table of all near-Earth objects has 8 MB.
TEXT_LIMIT = 512 * 2**20
#: Largest JSON or TOML document, bytes.
DOCUMENT_LIMIT = 64 * 2**20
#: Largest cell of a CSV file, characters.
FIELD_LIMIT = 128 * 1024
#: Deepest nesting of arrays and tables in JSON and TOML; also the largest number of dots in a TOML key.
DEPTH_LIMIT = 100
#: Largest number of digits in a row: CPython itself refuses integers of more than 4,300.
DIGIT_LIMIT = 1000

_CHUNK = 2**20
_DIGITS = re.compile(rf"[0-9_]{{{DIGIT_LIMIT + 1},}}")
_STRING = re.compile(r'"""[\s\S]*?"""|\'\'\'[\s\S]*?\'\'\'|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'|#[^\n]*')
_JSON_STRING = re.compile(r'"(?:[^"\\]|\\.)*"')
_KEY = re.compile(rf"(?<![\w-])(?:[\w-]++|~)(?:[ \t]*+\.[ \t]*+(?:[\w-]++|~)){{{DEPTH_LIMIT},}}")


def replace_file(path: str | Path, data: bytes) -> Path:
    """Write a file through a temporary one beside it: readers see the old content or the new one; returns the path.

    Raises
    ------
    OSError
        The file cannot be written; nothing of it is left.
    """
    out = Path(path)
    number, part = tempfile.mkstemp(dir=out.parent, prefix=f".{out.name}.", suffix=".part")
    try:
        with os.fdopen(number, "wb") as stream:
            stream.write(data)
        os.chmod(part, 0o644)
        os.replace(part, out)
    except BaseException:
        os.unlink(part)
        raise
    return out


def read_bytes(path: str | Path, what: str, limit: int = TEXT_LIMIT, kind: str = "file") -> bytes:
    """Content of a file, decompressed if it is gzipped.

    Parameters
    ----------
    path : str or Path
        An ordinary file: a FIFO or device, which may never end, is refused.
    what : str
        Kind of the file, for the message: "catalogue file".
    limit : int
        Largest size after decompression, bytes.
    kind : str
        Expected kind, for the message: "CSV file".

    Raises
    ------
    InvalidInput
        The file cannot be read or decompressed, or is larger than `limit`.
    """
    if not isinstance(path, str | Path):
        raise InvalidInput(what, path, "a path")
    file = Path(path)
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            raise InvalidInput(what, path, "an ordinary file")
        with file.open("rb") as raw:
            packed = raw.read(2) == b"\x1f\x8b"
            raw.seek(0)
            stream: IO[bytes] | gzip.GzipFile = gzip.GzipFile(fileobj=raw) if packed else raw
            parts, size = [], 0
            while part := stream.read(_CHUNK):
                parts.append(part)
                size += len(part)
                if size > limit:
                    raise InvalidInput(what, path, f"a file of at most {_size(limit)}{_packed(packed)}")
    except InvalidInput:
        raise
    except (OSError, EOFError, zlib.error, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidInput(what, path, f"a readable {kind} ({reason})") from None
    return b"".join(parts)


def read_text(path: str | Path, what: str, limit: int = TEXT_LIMIT, kind: str = "file") -> str:
    """UTF-8 text of a file, with or without a byte-order mark (arguments and errors of :func:`read_bytes`)."""
    try:
        return read_bytes(path, what, limit, kind).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(what, path, f"a readable {kind} in UTF-8 ({error})") from None


def parse_json(text: str, what: str, path: str | Path) -> Any:
    """Content of a JSON document.

    Raises
    ------
    InvalidInput
        Not JSON, larger than `DOCUMENT_LIMIT`, nested deeper than `DEPTH_LIMIT`, or with an integer of more than
        `DIGIT_LIMIT` digits.
    """
    _check_document(text, what, path, _JSON_STRING)
    try:
        return json.loads(text)
    except ValueError as error:
        raise InvalidInput(what, path, f"a JSON document ({error})") from None


def parse_toml(text: str, what: str, path: str | Path) -> Document:
    """Content of a TOML document (limits and errors of :func:`parse_json`; keys of at most `DEPTH_LIMIT` dots)."""
    bare = _check_document(text, what, path, _STRING)
    if _KEY.search(bare):
        raise InvalidInput(what, path, f"keys of at most {DEPTH_LIMIT} parts")
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, ValueError, RecursionError) as error:
        raise InvalidInput(what, path, f"valid TOML ({error})") from None


def csv_rows(text: str, what: str, path: str | Path) -> Iterator[list[str]]:
    """Rows of a CSV text.

    Raises
    ------
    InvalidInput
        A cell is longer than `FIELD_LIMIT`, or the quoting is wrong.
    """
    # csv.field_size_limit belongs to the whole process; its default equals FIELD_LIMIT and is not changed here.
    reader = csv.reader(io.StringIO(text, newline=""))
    while True:
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error as error:
            limit = f"cells of at most {FIELD_LIMIT:,} characters" if "limit" in str(error) else "valid CSV"
            raise InvalidInput(what, path, f"{limit} (line {reader.line_num}: {error})") from None
        yield row


def _check_document(text: str, what: str, path: str | Path, strings: re.Pattern[str]) -> str:
    """The text with its strings blanked; text that is too large, too deep or has too many digits is an error."""
    if len(text) > DOCUMENT_LIMIT:
        raise InvalidInput(what, path, f"a document of at most {_size(DOCUMENT_LIMIT)}")
    bare = strings.sub("~", text)
    if _DIGITS.search(bare):
        raise InvalidInput(what, path, f"numbers of at most {DIGIT_LIMIT:,} digits")
    depth = 0
    for bracket in re.findall(r"[\[\]{}]", bare):
        depth += 1 if bracket in "[{" else -1
        if depth > DEPTH_LIMIT:
            raise InvalidInput(what, path, f"arrays and tables nested at most {DEPTH_LIMIT} deep")
    return bare


def _size(limit: int) -> str:
    return f"{limit >> 20} MB" if limit >= 2**20 else f"{limit:,} bytes"


def _packed(packed: bool) -> str:
    return " after decompression" if packed else ""
