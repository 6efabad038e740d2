"""The command line: ``flybystab COMMAND --help`` says what each one does, with examples.

Exit status: 0 done, 1 cannot be computed (why, on stderr), 2 wrong usage: words, or values that are wrong whatever
asteroids and files there are. With ``--json`` one document goes to
stdout and nothing else. Heavy modules are imported by the command that needs them.
"""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from flybystab._version import __version__
from flybystab.cli import COMMANDS
from flybystab.cli.arguments import check_arguments
from flybystab.cli.tab_completion import ASTEROID, FILE
from flybystab.errors import FlybystabError, WrongUsage


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    parser = command_parser()
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and not arguments[0].startswith("-") and arguments[0] not in COMMANDS:
        near = get_close_matches(arguments[0], COMMANDS, cutoff=0.5)
        hint = f"; did you mean {near[0]}?" if near else ""
        print(
            f"flybystab: no command {arguments[0]!r}{hint} (commands: {', '.join(COMMANDS)})", file=sys.stderr
        )
        return 2
    try:
        options = parser.parse_args(arguments)
    except SystemExit as stop:  # argparse has printed help or the reason
        return int(stop.code or 0)
    options.words = arguments
    if options.command is None:
        parser.print_help()
        return 2
    # Dates beyond the table of leap seconds are read as TDB; UTC would be "dubious" there.
    warnings.filterwarnings("ignore", message=".*dubious year.*")
    try:
        check_arguments(options)
        if options.json or options.command in ("cite", "completion"):
            COMMANDS[options.command].run(options)
        else:
            from flybystab.cli.compile_notice import announced

            with announced(sys.stderr, elsewhere=getattr(options, "jobs", 1) > 1):
                COMMANDS[options.command].run(options)
        sys.stdout.flush()
    except WrongUsage as reason:
        print(f"flybystab {options.command}: {reason} (--help says more)", file=sys.stderr)
        return 2
    except FlybystabError as reason:
        print(f"flybystab: {reason}", file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as reason:
        print(f"flybystab: {reason}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("flybystab: stopped", file=sys.stderr)
        return 1
    return 0


class _Parser(argparse.ArgumentParser):
    """Marks arguments for tab completion: FILE is completed with files, ``name`` also with asteroids."""

    def add_argument(self, *args: Any, **kwargs: Any) -> argparse.Action:
        """Add an argument."""
        action = super().add_argument(*args, **kwargs)
        if action.dest == "name":
            action.complete = ASTEROID  # type: ignore[attr-defined]
        elif action.dest in ("file", "asteroids") or action.metavar == "FILE":
            action.complete = FILE  # type: ignore[attr-defined]
        return action


class _Help(argparse.RawDescriptionHelpFormatter):
    """Examples as they are written, and no line broken after the name of a command."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26)
        self._action_max_length = 16  # argparse forgets that the commands are indented


def command_parser() -> argparse.ArgumentParser:
    """The parser of every command."""
    parser = _Parser(
        prog="flybystab",
        description="Do rubble-pile asteroids survive their close planetary encounters?",
        epilog="examples:\n  flybystab flyby Apophis --output apophis.png\n  flybystab scenario p2.toml --json\n"
        "  flybystab screen --from 2026-01-01 --to 2036-01-01",
        formatter_class=_Help,
    )
    parser.add_argument("--version", action="version", version=f"flybystab {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, command in COMMANDS.items():
        sub = commands.add_parser(
            name,
            help=command.HELP,
            description=command.HELP,
            epilog=f"example:\n  {command.EXAMPLE}",
            formatter_class=_Help,
        )
        sub.add_argument(
            "--json", action="store_true", help="print one JSON document, with units in its keys"
        )
        command.arguments(sub)
    return parser
