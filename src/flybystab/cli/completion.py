"""``flybystab completion SHELL``: completion with the tab key."""

from __future__ import annotations

import argparse

from flybystab._version import __version__
from flybystab.cli.common import show
from flybystab.cli.tab_completion import SHELLS

HELP = "completion with the tab key"
EXAMPLE = 'eval "$(flybystab completion bash)"'


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("shell", choices=SHELLS, help="for which shell")


def run(options: argparse.Namespace) -> None:
    """Answer the command."""
    from flybystab.cli.main import command_parser
    from flybystab.cli.tab_completion import script

    text = script(options.shell, command_parser())
    show(
        options,
        lambda: {"flybystab": __version__, "shell": options.shell, "script": text},
        lambda: [text],
    )
