"""``flybystab cite [FILE]``: BibTeX of the methods and data."""

from __future__ import annotations

import argparse
from typing import Any

from flybystab._version import __version__
from flybystab.cli.common import show

HELP = "BibTeX of the methods and data used, for one result or for the whole package"
EXAMPLE = "flybystab cite screening.ecsv > flybystab.bib"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument(
        "file",
        nargs="?",
        help="table (.ecsv, .parquet) or JSON document (.json) of a command",
    )


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.io.citation import BIBTEX, cited

    entries = [BIBTEX[key] for key in cited(_result(options.file))]
    show(options, lambda: {"flybystab": __version__, "bibtex": entries}, lambda: ["\n\n".join(entries)])


def _result(path: str | None) -> Any:
    if path is None:
        return None
    if not path.endswith(".json"):
        from flybystab.screening.results import read_results

        return read_results(path)
    import json
    from pathlib import Path

    from flybystab.errors import InvalidInput

    try:
        return json.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as reason:
        raise InvalidInput("file", path, f"a readable JSON document ({reason.strerror})") from None
    except ValueError as reason:
        raise InvalidInput("file", path, f"a JSON document ({reason})") from None
