"""Completion of commands, options and names of asteroids with the tab key, made from the parser itself."""

from __future__ import annotations

import argparse
import shlex

#: Commands whose first word is an asteroid.
_NAMED = ("flyby", "report", "encounters", "stability", "infer")

_BASH = """\
_flybystab() {{
  local word="${{COMP_WORDS[COMP_CWORD]}}" IFS=$'\\n'
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W {commands} -- "$word"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{cases}
  esac
}}
complete -o default -F _flybystab flybystab
"""


def script(shell: str, parser: argparse.ArgumentParser) -> str:
    """The script for ``bash`` or ``zsh`` (which reads that of bash)."""
    commands = _commands(parser)
    names = _names()
    cases = []
    for command, sub in commands.items():
        options = [o for action in sub._actions for o in action.option_strings if o.startswith("--")]
        choices = [str(c) for a in sub._actions if not a.option_strings and a.choices for c in a.choices]
        words = shlex.quote("\n".join(options))
        first = names if command in _NAMED else choices
        line = f'    {command}) if [ "${{word#-}}" != "$word" ]; then COMPREPLY=($(compgen -W {words} -- "$word"))'
        if first:
            quoted = shlex.quote("\n".join(first))
            line += f'; elif [ "$COMP_CWORD" -eq 2 ]; then COMPREPLY=($(compgen -W {quoted} -- "$word"))'
        cases.append(line + "; fi ;;")
    text = _BASH.format(commands=shlex.quote("\n".join(commands)), cases="\n".join(cases))
    return ("autoload -Uz bashcompinit && bashcompinit\n" if shell == "zsh" else "") + text


def _commands(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    return {}


def _names() -> list[str]:
    """Names without spaces: those with one would need quotes."""
    from flybystab.catalogues.catalogue import catalogue

    return sorted(a.name for a in catalogue() if a.name.isalnum())
