"""A file format is one more module in the package of readers: nothing else is edited."""

import json
import sys

import pytest

from flybystab.catalogues import physical, readers
from flybystab.catalogues.catalogue import catalogue
from flybystab.cli.main import main

#: Apophis under another name: a, e, i, node, peri, M, epoch, and what a flyby needs of the body.
ORBIT = """
from flybystab.catalogues.readers import Contents, reader

COLUMNS = ("name", "a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg", "epoch_jd_tdb")
BODY = {"semi_axis_a_m": "225", "semi_axis_b_m": "165", "semi_axis_c_m": "155", "density_kg_m3": "2000",
        "spin_period_h": "30"}


@reader("mine", lambda text: text.startswith("MINE "), Contents("a, e, i, node, peri, M", "none", "none", "all"))
def read(text, file):
    return [(dict(zip(COLUMNS, line.split()[1:])) | BODY, None) for line in text.splitlines()]
"""
FILE = (
    "MINE Own 0.9223803173917017 0.1911663355386932 3.340958441017069 203.8996515621043 126.6728325163065 "
    "312.8054663584516 2461000.5"
)
PHYSICAL = """
from flybystab.catalogues.physical import PhysicalData, physical_reader


@physical_reader("my lab", lambda text: text.startswith("LAB "), "density", "none")
def read(text, file):
    return [PhysicalData((), {"density_kg_m3": text.split()[1], "density_source": "my lab"})]
"""


@pytest.fixture
def package(tmp_path, monkeypatch, request):
    """Adds a folder with one more module to a package of readers; afterwards nothing of it is left."""

    def add(package, formats, name, source):
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"{name}.py").write_text(source)
        assert formats.names  # registers the modules of the package before the copy
        monkeypatch.setattr(formats, "_found", dict(formats._found))
        monkeypatch.setattr(formats, "_imported", set(formats._imported))
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
        request.addfinalizer(lambda: sys.modules.pop(f"{package.__name__}.{name}", None))

    return add


def test_an_orbit_format_is_found_by_its_place_also_by_the_commands(tmp_path, package, capsys):
    file = tmp_path / "orbits.any"
    file.write_text(FILE)
    package(readers, readers.READERS, "another_publisher", ORBIT)
    assert "mine" in readers.READERS.names
    assert [a.name for a in catalogue(file)] == ["Own"]
    assert main(["flyby", "Own", "--catalogue", str(file), "--date", "2029-04-13", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["asteroid"].endswith("Own")
    assert found["encounter"]["distance_km"] == pytest.approx(38011, abs=100)
    assert main(["encounters", str(file), "--from", "2029-04-01", "--to", "2029-05-01", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["rows"]) == 1


def test_a_format_of_physical_parameters_is_found_by_its_place(tmp_path, package, capsys):
    file = tmp_path / "measured.any"
    file.write_text("LAB 1700")
    package(physical, physical.PHYSICAL_READERS, "my_lab", PHYSICAL)
    assert main(["stability", "Apophis", "--phys", str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["assumed"] == []  # without the file: the density
