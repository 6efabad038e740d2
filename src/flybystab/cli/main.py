"""Command line interface; ``flybystab COMMAND --help`` describes each command, with an example.

Exit status: 0 success, 1 the result cannot be computed (the reason is on stderr), 2 wrong usage: an unknown argument,
or a value that is invalid whatever the asteroid or file. With ``--json``, stdout contains one JSON document and nothing
else. Slow imports are left to the commands that need them.
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
from flybystab.cli.common import printable
from flybystab.cli.config import default_words
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
        if arguments and arguments[0] in COMMANDS and not {"-h", "--help"} & set(arguments):
            arguments[1:1] = default_words(arguments[0], command_parsers(parser), arguments[1:])
        options = parser.parse_args(arguments)
    except WrongUsage as reason:
        print(printable(f"flybystab: {reason}"), file=sys.stderr)
        return 2
    except SystemExit as stop:  # argparse has printed the help or the error
        return int(stop.code or 0)
    options.words = arguments
    if options.command is None:
        parser.print_help()
        return 2
    # Dates are TDB; erfa warns of "dubious years" beyond the leap-second table, which applies to UTC only.
    warnings.filterwarnings("ignore", message=".*dubious year.*")
    try:
        check_arguments(options)
        # The notice of the Python interface would repeat that of the command.
        if (notice := sys.modules.get("flybystab.core.numerics.compile_notice")) is not None:
            notice.uninstall()
        if options.json or options.command in ("cite", "completion"):
            _run(options)
        else:
            from flybystab.cli.compile_notice import announced

            with announced(sys.stderr, elsewhere=getattr(options, "jobs", 1) > 1):
                _run(options)
        sys.stdout.flush()
    except WrongUsage as reason:
        print(printable(f"flybystab {options.command}: {reason} (see --help)"), file=sys.stderr)
        return 2
    except FlybystabError as reason:
        print(printable(f"flybystab: {reason}"), file=sys.stderr)
        return 1
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except OSError as reason:
        print(printable(f"flybystab: {reason}"), file=sys.stderr)
        return 1
    except MemoryError:
        print("flybystab: not enough memory for this command", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("flybystab: stopped", file=sys.stderr)
        return 1
    return 0


def _run(options: argparse.Namespace) -> None:
    """Run the command, with the style of the option --style if it has one."""
    if getattr(options, "style", "default") == "default":
        COMMANDS[options.command].run(options)
        return
    from flybystab.plots.style import figure_style

    with figure_style(options.style):
        COMMANDS[options.command].run(options)


class _Parser(argparse.ArgumentParser):
    """Parser that marks arguments for tab completion: FILE with files, ``name`` with files and asteroids."""

    def add_argument(self, *args: Any, **kwargs: Any) -> argparse.Action:
        """Add an argument."""
        action = super().add_argument(*args, **kwargs)
        if action.dest == "name":
            action.complete = ASTEROID  # type: ignore[attr-defined]
        elif action.dest in ("file", "asteroids") or action.metavar == "FILE":
            action.complete = FILE  # type: ignore[attr-defined]
        return action


class _Help(argparse.RawDescriptionHelpFormatter):
    """Formatter that keeps examples as written, and each command on one line with its description."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26)
        self._action_max_length = 16  # argparse ignores the indent of the commands


def command_parsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """The parsers of the commands by name."""
    actions = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    return dict(actions[0].choices)


def command_parser() -> argparse.ArgumentParser:
    """Argument parser of all commands."""
    parser = _Parser(
        prog="flybystab",
        description="Do rubble-pile asteroids survive their close planetary encounters?",
        epilog="examples:\n  flybystab flyby Apophis --output apophis.png\n  flybystab scenario p2.toml --json\n"
        "  flybystab screen --from 2026-01-01 --to 2036-01-01\n"
        "default values of options can be set in ~/.config/flybystab/config.toml, or in the file FLYBYSTAB_CONFIG",
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
