"""Text on a terminal: names from files cannot control it; the command runs without docstrings and assertions, too."""

import subprocess
import sys

import pytest

from flybystab.cli import COMMANDS
from flybystab.cli.common import printable
from flybystab.cli.main import main


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("Apophis", "Apophis"),
        ("a\tb\nc", "a\tb\nc"),
        ("\x1b[31mred", "\\x1b[31mred"),
        ("\x9b2J", "\\x9b2J"),
        ("abc\u202etxt.exe", "abc\\u202etxt.exe"),
        ("\r\x07\x00", "\\r\\x07\\x00"),
        ("Öpik 1998 × 4", "Öpik 1998 × 4"),
    ],
)
def test_control_characters_are_shown_as_escapes(text, shown):
    assert printable(text) == shown


def test_a_name_cannot_control_the_terminal(capsys, tmp_path):
    assert main(["flyby", "\x1b]0;owned\x07Apophis"]) == 1
    error = capsys.readouterr().err
    assert "\x1b" not in error
    assert "\\x1b]0;owned" in error
    law = tmp_path / "pi\x1b[2Jle.csv"
    law.write_text("a,e,i\n1.3,0.4,10\n")
    assert main(["rates", str(law), "--planet", "earth"]) == 0
    assert "\x1b" not in capsys.readouterr().out


def test_it_runs_without_docstrings_and_assertions():
    done = subprocess.run(
        [sys.executable, "-OO", "-m", "flybystab", "flyby", "Apophis", "--json"],
        capture_output=True,
        text=True,
        timeout=600,
        check=True,
    )
    assert '"verdict": "INTACT"' in done.stdout


def test_too_little_memory_is_told_without_a_traceback(capsys, monkeypatch):
    def run(options):
        raise MemoryError

    monkeypatch.setattr(COMMANDS["cite"], "run", run)
    assert main(["cite"]) == 1
    assert capsys.readouterr().err == "flybystab: not enough memory for this command\n"
