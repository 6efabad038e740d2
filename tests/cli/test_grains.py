"""Grains from the shell: scenario, JSON, pictures."""

import json

import pytest

from flybystab.cli.main import main

SCENE = """
title = "a deep passage"
[body]
semi_axes = "1408, 850, 748 m"
density = "2 g/cm3"
spin_period = "6 h"
[material]
yield_surface = "mohr-coulomb"
[encounter]
periapsis = "1.6 R_earth"
v_inf = "5 km/s"
[grains]
number = 100
piles = 2
"""


@pytest.fixture
def scene(tmp_path, monkeypatch):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def test_a_scenario_with_grains(scene, capsys):
    assert main(["scenario", "scene.toml", "--json", "--output", "deep.png"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["rung"] == "grains"
    grains = document["grains"]
    assert [r["seed"] for r in grains["runs"]] == [0, 1]
    assert grains["fragments"][0]["mass_fraction"] == grains["runs"][0]["largest_fraction"]
    assert sum(p["share"] for p in grains["probabilities"].values()) == pytest.approx(1.0)
    assert 0.0 < grains["resolution_errors"]["largest_fraction"] < grains["largest_fraction"]
    assert (scene / "deep.png").stat().st_size > 20_000
    assert main(["scenario", "scene.toml", "--output", "deep.svg", "--movie", "deep.gif"]) == 0
    text = capsys.readouterr().out
    assert "2 piles: " in text
    assert "DISRUPTED" in text
    assert "largest clump" in text
    assert "error from the number of grains (100)" in text
    assert (scene / "deep.gif").read_bytes()[:3] == b"GIF"
    assert "movie      deep.gif" in text
    assert main(["scenario", "scene.toml", "--movie", "deep.avi"]) != 0
    assert "--movie = deep.avi" in capsys.readouterr().err


def test_wrong_keys_of_grains(scene, capsys):
    (scene / "scene.toml").write_text(SCENE.replace("number = 100", 'number = "100"'))
    assert main(["scenario", "scene.toml"]) != 0
    assert "grains.number" in capsys.readouterr().err
    (scene / "scene.toml").write_text(SCENE.replace("piles", "seeds"))
    assert main(["scenario", "scene.toml"]) != 0
    assert "seeds" in capsys.readouterr().err


def test_flyby_takes_grains_where_it_needs_none(capsys, scene):
    assert main(["flyby", "Apophis", "--date", "2029-04-13", "--grains", "100", "--attitudes", "2"]) == 0
    out = capsys.readouterr().out
    assert "verdict    INTACT" in out
    assert "piles" not in out
