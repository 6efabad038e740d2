"""``flybystab cite``: BibTeX of the methods and data."""

from __future__ import annotations

import argparse

from flybystab import __version__
from flybystab.face.commands.common import show

HELP = "BibTeX of the methods and data"
EXAMPLE = "flybystab cite > flybystab.bib"


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    del sub  # none but --json


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    from flybystab.face.cite import BIBTEX, cite

    show(options, lambda: {"flybystab": __version__, "bibtex": list(BIBTEX.values())}, lambda: [cite()])
