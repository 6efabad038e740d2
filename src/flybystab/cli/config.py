"""User defaults: a TOML file with default values of options, by command.

::

    [screen]
    within = 0.1
    samples = 200
    planet = ["earth", "venus"]

    [flyby]
    friction = "38+-4"

The file is that named by the environment variable ``FLYBYSTAB_CONFIG``, otherwise
``~/.config/flybystab/config.toml`` (``$XDG_CONFIG_HOME``). Its options are inserted before those of the command line,
which take precedence. Options in the table ``[all]`` apply to every command that has them.
"""

from __future__ import annotations

import argparse
import os
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

from flybystab.errors import WrongUsage

if TYPE_CHECKING:
    from flybystab.typing import Document

VARIABLE = "FLYBYSTAB_CONFIG"
#: Largest file, bytes.
LIMIT = 1_000_000


def config_file() -> Path | None:
    """The file of defaults; None if there is none.

    Raises
    ------
    WrongUsage
        The file named by the environment variable does not exist.
    """
    named = os.environ.get(VARIABLE)
    if named is not None:
        if not named:  # an empty variable disables the defaults
            return None
        if not Path(named).is_file():
            raise WrongUsage(f"{VARIABLE} = {named}: expected a file of defaults")
        return Path(named)
    home = os.environ.get("XDG_CONFIG_HOME") or os.path.join(os.path.expanduser("~"), ".config")
    path = Path(home) / "flybystab" / "config.toml"
    return path if path.is_file() else None


def default_words(command: str, parsers: dict[str, argparse.ArgumentParser], given: list[str]) -> list[str]:
    """Default values for a command as command-line arguments.

    Parameters
    ----------
    command : str
    parsers : dict
        Parser of every command.
    given : list of str
        The command line; defaults of options that it contains are omitted.

    Raises
    ------
    WrongUsage
        The file cannot be read, or has an unknown command or option.
    """
    path = config_file()
    if path is None:
        return []
    tables = _tables(path)
    for name, table in tables.items():
        if name != "all" and name not in parsers:
            _unknown(path, "command", name, [*parsers, "all"])
        if not isinstance(table, dict):
            raise WrongUsage(f"{path}: {name} = {table!r}: expected a table [{name}] of options")
        known = _options(*(parsers.values() if name == "all" else [parsers[name]]))
        for key in table:
            if key not in known:
                _unknown(path, "option", key, sorted(known))
    own = _options(parsers[command])
    given_names = {word.split("=", 1)[0] for word in given if word.startswith("--")}
    words: list[str] = []
    for key, value in {**tables.get("all", {}), **tables.get(command, {})}.items():
        if key in own and f"--{key}" not in given_names:
            words += _words(path, key, value, own[key])
    return words


def _options(*parsers: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    """Options by name without dashes, except --help."""
    return {
        word[2:]: action
        for parser in parsers
        for action in parser._actions
        for word in action.option_strings
        if word.startswith("--") and word != "--help"
    }


def _words(path: Path, key: str, value: object, action: argparse.Action) -> list[str]:
    if action.nargs == 0:  # a flag
        if not isinstance(value, bool):
            raise WrongUsage(f"{path}: {key} = {value!r}: expected true or false")
        return [f"--{key}"] if value else []
    values = value if isinstance(value, list) else [value]
    if not all(isinstance(v, str | int | float) and not isinstance(v, bool) for v in values):
        raise WrongUsage(f"{path}: {key} = {value!r}: expected a number or text")
    return [f"--{key}={v}" for v in values]


def _tables(path: Path) -> Document:
    import tomllib

    from flybystab.files import read_text

    try:
        return tomllib.loads(read_text(path, "config", LIMIT, "file of defaults"))
    except tomllib.TOMLDecodeError as error:
        raise WrongUsage(f"{path}: expected TOML ({error})") from None


def _unknown(path: Path, what: str, name: str, known: list[str]) -> None:
    near = get_close_matches(name, known, n=3, cutoff=0.5)
    hint = f"; did you mean {', '.join(near)}?" if near else ""
    raise WrongUsage(f"{path}: unknown {what} {name!r}{hint}")
