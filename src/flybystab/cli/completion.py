"""``flybystab completion SHELL``: script for tab completion."""

from __future__ import annotations

import argparse

from flybystab.cli.common import document, show
from flybystab.cli.tab_completion import SHELLS

HELP = "script for tab completion in bash or zsh"
EXAMPLE = 'eval "$(flybystab completion bash)"'


def arguments(sub: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    sub.add_argument("shell", choices=SHELLS, help="the shell")


def run(options: argparse.Namespace) -> None:
    """Execute the command."""
    from flybystab.cli.main import command_parser
    from flybystab.cli.tab_completion import script

    text = script(options.shell, command_parser())
    show(
        options,
        lambda: document("completion", shell=options.shell, script=text),
        lambda: [text],
    )
