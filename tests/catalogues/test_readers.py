"""Readers: the content decides the format, and a new format is one registered function."""

import gzip
from pathlib import Path

import pytest

from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.physical_data import foreign
from flybystab.catalogues.readers import registry
from flybystab.catalogues.readers.mpcorb import julian_day, unpacked
from flybystab.errors import InvalidInput

CASES = Path(__file__).resolve().parents[1] / "cases"


@pytest.fixture
def readers():
    """The registry, restored afterwards."""
    registry.load_readers()
    kept = dict(registry.READERS)
    yield registry
    registry.READERS.clear()
    registry.READERS.update(kept)


def test_a_format_is_one_registered_function(readers, tmp_path):
    @readers.register("blank-separated", "My survey", lambda text: text.startswith("@survey"))
    def read(text, file):
        for line in text.splitlines()[1:]:
            name, a, e, i = line.split()
            row = {
                "name": name,
                "a_au": a,
                "e": e,
                "i_deg": i,
                "node_deg": "1",
                "peri_deg": "2",
                "M_deg": "3",
            }
            yield row | {"epoch_jd_tdb": "2461000.5", "orbit_source": f"My survey ({file})"}, None

    path = tmp_path / "new.dat"
    path.write_text("@survey\nOne 1.3 0.3 5\nTwo 2.0 0.5 6\n")
    one, two = catalogue(path)
    assert (one.name, two.quantity("e").value) == ("One", 0.5)
    assert one.orbit.epoch.jd == 2461000.5
    # its bodies are completed from the embedded tables, as those of the other agencies
    assert foreign(one)


@pytest.mark.parametrize("name", ["orbit", "orbit.csv", "orbit.json", "ORBIT.KE1"])
@pytest.mark.parametrize(
    ("case", "known"),
    [("2023BU.ke0", "2023 BU"), ("apophis_sbdb.txt", "99942"), ("apophis_2010.dat", "99942")],
)
@pytest.mark.parametrize("packed", [False, True])
def test_the_content_decides_not_the_name(tmp_path, name, case, known, packed):
    data = (CASES / case).read_bytes()
    path = tmp_path / name
    path.write_bytes(gzip.compress(data) if packed else data)
    (asteroid,) = catalogue(path)
    assert known in (str(asteroid.number), asteroid.designation)


def test_mpcorb_line_of_apophis():
    """An orbit of 2008 in the fixed columns, packed epoch K107N = 2010-07-23.0."""
    (a,) = catalogue(CASES / "apophis_2010.dat")
    assert (a.name, a.number, a.row["condition_code"]) == ("Apophis", 99942, "1")
    assert a.row["epoch_jd_tdb"] == "2455400.5"
    elements = [float(a.row[c]) for c in ("M_deg", "peri_deg", "node_deg", "i_deg", "e", "a_au", "H_mag")]
    assert elements == [202.49545, 126.41859, 204.43202, 3.33173, 0.1911104, 0.9223398, 19.2]


@pytest.mark.parametrize(
    ("packed", "name"),
    [
        ("00433", "433"),
        ("a0001", "360001"),
        ("~0K8Q", "697402"),
        ("~0000", "620000"),
        ("K04M04N", "2004 MN4"),
        ("J99R36Q", "1999 RQ36"),
        ("K08T03C", "2008 TC3"),
        ("K07Tf8A", "2007 TA418"),
        ("J95X00A", "1995 XA"),
        ("PLS2040", "2040 P-L"),
        ("T1S3138", "3138 T-1"),
        ("Apophis", "Apophis"),
    ],
)
def test_packed_names(packed, name):
    assert unpacked(packed) == name


def test_packed_dates():
    assert julian_day("K107N") == 2455400.5
    assert julian_day("J9611") == 2450083.5
    assert julian_day("K01AM") == 2452204.5  # 2001-10-22


def test_a_damaged_line_is_named(tmp_path):
    path = tmp_path / "x.dat"
    text = (CASES / "apophis_2010.dat").read_text()
    path.write_text(text + text.replace("0.1911104", "0.19x1104"))
    with pytest.raises(InvalidInput, match="line 2"):
        catalogue(path)


def test_what_no_reader_recognises_lists_the_formats(tmp_path):
    path = tmp_path / "x.txt"
    path.write_text("lorem ipsum\n")
    with pytest.raises(InvalidInput, match="MPCORB"):
        catalogue(path)
