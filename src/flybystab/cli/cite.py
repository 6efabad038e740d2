"""``flybystab cite [FILE]``: BibTeX entries for the methods and data used."""

from __future__ import annotations

import argparse

from flybystab.cli.common import document, show

HELP = "BibTeX entries for the methods and data used in a result, or in the whole package"
EXAMPLE = "flybystab cite screening.ecsv > flybystab.bib"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument(
        "file",
        nargs="?",
        help="table (.ecsv, .parquet) or JSON document (.json) written by a command",
    )


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.io.citation import BIBTEX, cited

    entries = [BIBTEX[key] for key in cited(_result(options.file))]
    show(options, lambda: document("references", bibtex=entries), lambda: ["\n\n".join(entries)])


def _result(path: str | None) -> object:
    if path is None:
        return None
    if not path.endswith(".json"):
        from flybystab.screening.results import read_results

        return read_results(path)
    from flybystab.files import DOCUMENT_LIMIT, parse_json, read_text

    return parse_json(read_text(path, "file", DOCUMENT_LIMIT, "JSON document"), "file", path)
