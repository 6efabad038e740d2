"""JSON schemas (draft 2020-12) of the documents printed by commands with ``--json``, one file each in ``schema/``."""

from __future__ import annotations

import json
from importlib import resources

from flybystab.errors import UnknownName
from flybystab.typing import Document

#: Kinds of document.
NAMES = (
    "flyby", "table", "stability", "result", "rates", "references", "figure", "atlas", "bench", "completion",
)  # fmt: skip


def schema(name: str) -> Document:
    """JSON schema of a kind of document.

    Parameters
    ----------
    name : str
        One of :data:`NAMES`, or the entry ``schema`` of a document, such as ``"flyby/1"``.

    Raises
    ------
    UnknownName
        There is no such schema in this version.
    """
    kind, _, version = name.partition("/")
    if kind not in NAMES:
        raise UnknownName("schema", name, [], f"(known: {', '.join(NAMES)})")
    text = resources.files("flybystab.io").joinpath("schema", f"{kind}.json").read_text(encoding="utf-8")
    found: Document = json.loads(text)
    if version and found["properties"]["schema"]["const"] != name:
        raise UnknownName("schema", name, [found["properties"]["schema"]["const"]], "")
    return found
