"""BibTeX: all of it, or just what a result used."""

import json
import re

import astropy.units as u
import pytest

import flybystab as fs
from flybystab.cli.main import main
from flybystab.errors import InvalidInput
from flybystab.io.citation import BIBTEX, BY_KEY, BY_WORD, cited


def test_every_key_has_one_entry():
    for key, entry in BIBTEX.items():
        assert re.match(rf"@\w+\{{{key},\n", entry), key
        assert entry.count("{") == entry.count("}")
        assert "year" in entry or entry.startswith("@misc")
    for keys in (*BY_WORD.values(), *BY_KEY.values()):
        assert set(keys) <= set(BIBTEX)
    assert fs.cite().count("@") == len(BIBTEX)


def test_a_scripted_flyby_needs_no_ephemeris():
    pile = fs.Body(
        semi_axes=[1400, 850, 750] * u.m,
        density=2000 * u.kg / u.m**3,
        spin_period=6 * u.h,
        material=fs.Material(yield_surface="matsuoka-nakai"),
    )
    passage = fs.Encounter.hyperbolic("earth", periapsis=3 * fs.R_earth, v_inf=5 * u.km / u.s)
    keys = cited(fs.flyby(pile, passage, error=False, history=False))
    assert "MatsuokaNakai1974" in keys
    assert "DruckerPrager1952" in keys  # a body that stays rigid is tried on every yield surface
    assert not {"ReinLiu2012", "Park2021", "Folkner2009", "JPLSBDB"} & set(keys)


def test_a_table_of_encounters_names_its_ephemeris_and_no_dynamics(capsys, tmp_path):
    path = tmp_path / "found.ecsv"
    words = ["encounters", "Apophis", "--from", "2029-01-01", "--to", "2030-01-01", "--output", str(path)]
    assert main(words) == 0
    capsys.readouterr()
    assert main(["cite", str(path)]) == 0
    out = capsys.readouterr().out
    assert "@article{Park2021," in out or "@article{Folkner2009," in out
    assert "@book{HairerNorsettWanner1993," in out
    assert "ReinLiu2012" not in out


def test_a_document_of_a_real_flyby(capsys, tmp_path):
    assert main(["flyby", "Apophis", "--date", "2029-04-13", "--attitudes", "2", "--json"]) == 0
    path = tmp_path / "apophis.json"
    path.write_text(capsys.readouterr().out)
    assert main(["cite", str(path), "--json"]) == 0
    out = " ".join(json.loads(capsys.readouterr().out)["bibtex"])
    assert all(key in out for key in ("ReinSpiegel2015", "JPLSBDB", "DruckerPrager1952", "MatsuokaNakai1974"))


@pytest.mark.parametrize("bad", [3, {"rows": []}])
def test_what_is_no_result(bad):
    with pytest.raises(InvalidInput, match="result"):
        fs.cite(bad)


def test_a_broken_file(capsys, tmp_path):
    path = tmp_path / "broken.json"
    path.write_text("{")
    assert main(["cite", str(path)]) == 1
    assert "a JSON document" in capsys.readouterr().err
