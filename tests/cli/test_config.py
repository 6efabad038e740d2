"""Defaults of the user: a TOML file with options by command."""

import json

import pytest

from flybystab.cli.main import main

FLYBY = ["flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "1", "--json"]


@pytest.fixture
def config(tmp_path, monkeypatch):
    def write(text):
        path = tmp_path / "config.toml"
        path.write_text(text)
        monkeypatch.setenv("FLYBYSTAB_CONFIG", str(path))
        return path

    return write


def friction(capsys, *more):
    assert main([*FLYBY, *more]) == 0
    return json.loads(capsys.readouterr().out)["friction_angle_deg"]


def test_options_of_the_file_and_of_the_command_line(config, capsys):
    assert friction(capsys) == 35.0
    config(
        "[flyby]\nfriction = 31\n[all]\nfriction = 29\nsurface = 'drucker-prager'\n[screen]\nsamples = 7\n"
    )
    assert friction(capsys) == 31.0  # the table of the command before that of all
    assert friction(capsys, "--friction", "33") == 33.0
    assert friction(capsys, "--friction=33") == 33.0


def test_switches_and_lists(config, capsys):
    config("[encounters]\nplanet = ['earth', 'venus']\nwithin = 0.1\njson = true\n")
    assert main(["encounters", "Apophis", "--from", "2029-01-01", "--to", "2030-01-01"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {row["planet"] for row in found["rows"]} == {"earth"}
    assert main(["encounters", "Apophis", "--from", "2016-01-01", "--to", "2017-01-01"]) == 0
    assert {row["planet"] for row in json.loads(capsys.readouterr().out)["rows"]} == {"venus"}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[flybi]\nfriction = 1\n", "unknown command 'flybi'; did you mean flyby?"),
        ("[flyby]\nfrction = 1\n", "unknown option 'frction'; did you mean friction"),
        ("[flyby]\nfriction = true\n", "expected a number or text"),
        ("[flyby]\nassume = 1\n", "expected true or false"),
        ("flyby = 1\n", "expected a table"),
        ("[flyby\n", "expected TOML"),
        ("[flyby]\nfriction = 'much'\n", "much"),
    ],
)
def test_mistakes_are_named(config, capsys, text, reason):
    config(text)
    assert main(FLYBY) == 2
    assert reason in capsys.readouterr().err


def test_a_missing_file_and_no_file(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("FLYBYSTAB_CONFIG", str(tmp_path / "no.toml"))
    assert main(FLYBY) == 2
    assert "expected a file of defaults" in capsys.readouterr().err
    monkeypatch.setenv("FLYBYSTAB_CONFIG", "")
    assert friction(capsys) == 35.0
    monkeypatch.delenv("FLYBYSTAB_CONFIG")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    (tmp_path / "flybystab").mkdir()
    (tmp_path / "flybystab" / "config.toml").write_text("[flyby]\nfriction = 28\n")
    assert friction(capsys) == 28.0


def test_help_needs_no_valid_file(config, capsys):
    config("[flyby\n")
    assert main(["flyby", "--help"]) == 0
