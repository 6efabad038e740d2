"""The same orbits in files with other line ends, encodings, orders of columns and spellings of names."""

import csv
import gzip
import io
import json
import random

import numpy as np
import pytest
from orbit_files import FILES, NEOWS, PLAIN, text

from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.designations import name_columns
from flybystab.errors import InvalidInput

TEXTS = {p.name: p.read_text() for p in sorted(FILES.iterdir()) if not p.name.startswith("bennu")}
TEXTS |= {name: make() for name, make in PLAIN.items()}


def found(path):
    """Names, states (m), laws and errors of the orbits of a file."""
    out = []
    for a in catalogue(path):
        known = a.orbit.covariance
        sigma = None if known is None else np.round(known.sigma, 12).tolist()
        out.append(
            (a.label, a.designation, np.round(a.orbit.position.value, 12).tolist(), a.orbit.nongrav, sigma)
        )
    return out


def is_json(content):
    return content.lstrip()[:1] in "{["


def rows_of(content):
    """Rows of a CSV text, or None."""
    rows = [r for r in csv.reader(io.StringIO(content)) if r]
    if is_json(content) or len(rows) < 2 or len(rows[0]) < 5 or len({len(r) for r in rows}) > 1:
        return None
    return rows


def written(rows, quoting=csv.QUOTE_MINIMAL):
    out = io.StringIO()
    csv.writer(out, quoting=quoting, lineterminator="\n").writerows(rows)
    return out.getvalue()


def shuffled(rows):
    order = random.Random(1).sample(range(len(rows[0])), len(rows[0]))
    return written([[row[k] for k in order] for row in rows])


def tabled(change):
    return lambda content: change(rows) if (rows := rows_of(content)) else None


def in_json(**options):
    return lambda content: json.dumps(json.loads(content), **options) if is_json(content) else None


BYTES = {
    "gzip": lambda c: gzip.compress(c.encode()),
    "Windows": lambda c: b"\xef\xbb\xbf" + c.replace("\n", "\r\n").encode(),
    "Macintosh": lambda c: c.replace("\n", "\r").encode(),
    "UTF-16": lambda c: c.encode("utf-16"),
    "DOS": lambda c: c.replace("\n", "\r\n").encode() + b"\x1a",
    "blank lines": lambda c: ("\n  \n" + c.rstrip("\n") + "\n\n   \n").encode(),
    "no last line end": lambda c: c.rstrip("\n").encode(),
}
CONTENT = {
    "columns in another order": tabled(shuffled),
    "quotes": tabled(lambda rows: written(rows, csv.QUOTE_ALL)),
    "one more column": tabled(lambda rows: written([[*rows[0], "comment"], *([*r, "-"] for r in rows[1:])])),
    "an empty column": tabled(lambda rows: written([[*r, ""] for r in rows])),
    "JSON in one line": in_json(separators=(",", ":")),
    "JSON, sorted keys": in_json(sort_keys=True, indent=4),
}


@pytest.mark.parametrize("name", TEXTS)
def test_the_orbits_do_not_depend_on_how_a_file_is_written(tmp_path, name):
    path = tmp_path / "orbits"
    path.write_text(TEXTS[name])
    expected = found(path)
    assert expected
    for label, change in CONTENT.items():
        changed = change(TEXTS[name])
        if changed is not None:
            path.write_text(changed)
            assert found(path) == expected, label
    for label, change in BYTES.items():
        path.write_bytes(change(TEXTS[name]))
        assert found(path) == expected, label


@pytest.mark.parametrize(
    ("given", "number", "designation"),
    [
        ("~0K8Q", "697402", ""), ("_QC0000", "", "2026 CA620"), ("K08T03C", "", "2008 TC3"),
        ("2010TU149", "", "2010 TU149"), ("2010_TU149", "", "2010 TU149"), ("2040P-L", "", "2040 P-L"),
        ("(2020 AB1)", "", "2020 AB1"), ("697402 (2004 AB12)", "697402", "2004 AB12"), ("0073Pb", "", "73P-B"),
        ("73P/Schwassmann-Wachmann 3-BT", "", "73P-BT"), ("332P/Ikeya-Murakami-C", "", "332P-C"),
        ("D/1993 F2-A (Shoemaker-Levy 9)", "", "D/1993 F2-A"), ("A/2017 U1", "", "A/2017 U1"),
        ("1I/'Oumuamua (A/2017 U1)", "", "1I"), ("C/-43 K1", "", "C/-43 K1"), ("174P/Echeclus", "", "174P"),
    ],
)  # fmt: skip
def test_numbers_and_designations_of_names(given, number, designation):
    columns = name_columns(given)
    assert (columns["number"], columns["designation"]) == (number, designation)


def test_provisional_designations_of_a_query_without_pdes(tmp_path):
    """The full name of an asteroid without a number is its designation in brackets."""
    (tmp_path / "q").write_text(
        "full_name,epoch,e,a,i,om,w,ma\n       (2020 AB1),2461000.5,.2,1.3,2,3,4,5\n"
        "    (4788 P-L),2461000.5,.2,1.3,2,3,4,5\n"
    )
    assert [(a.number, a.designation) for a in catalogue(tmp_path / "q")] == [
        (None, "2020 AB1"),
        (None, "4788 P-L"),
    ]


@pytest.mark.parametrize("packed", ["~0K8Q  ", "_QC0000", "K20A00B", "PLS2040"])
def test_packed_names_of_mpcorb(tmp_path, packed):
    (tmp_path / "m").write_text(packed + text("apophis_2010.dat")[7:166] + "\n")
    (a,) = catalogue(tmp_path / "m")
    expected = name_columns(packed.strip())
    assert (a.row.get("number", ""), a.designation) == (expected["number"], expected["designation"])


def test_an_interstellar_orbit_from_six_formats(tmp_path):
    """1I/'Oumuamua at one epoch: the sets of elements agree to their digits."""
    q, e, i, node, peri = 0.2559116, 1.2011338, 122.7417063, 24.5969096, 241.8105360
    a, since, epoch = q / (1.0 - e), 74.492678624, 2458080.5
    tp, mean = epoch - since, float(np.degrees(0.01720209895 * since / abs(a) ** 1.5))
    elements = {"central body": "Sun", "frame": "J2000 ecliptic", "epoch": epoch, "q": q, "a": a, "e": e, "i": i,
                "arg_per": peri, "asc_node": node, "Tp": tp}  # fmt: skip
    service = NEOWS | {"orbital_data": {
        "epoch_osculation": str(epoch), "equinox": "J2000", "eccentricity": str(e), "inclination": str(i),
        "semi_major_axis": str(a), "mean_anomaly": repr(mean), "ascending_node_longitude": str(node),
        "perihelion_argument": str(peri),
    }}  # fmt: skip
    header = "format  = 'OEF2.0'\nrefsys  = ECLM J2000\nEND_OF_HEADER\n1I\n"
    angles = f"{i} {node} {peri}"
    texts = {
        "OEF2.0": f"{header} COM {q} {e} {angles} {tp - 2400000.5!r}\n MJD {epoch - 2400000.5} TDT\n",
        "OEF2.0 with D": f"{header} KEP {a!r} {e} {angles} {mean!r}\n MJD {epoch - 2400000.5} TDT\n".replace(
            "e+", "D+"
        ),
        "SBDB": "full_name,epoch,e,q,i,om,w,tp,class\n"
        f"1I/'Oumuamua (A/2017 U1),{epoch},{e},{q},{i},{node},{peri},{tp!r},HYA\n",
        "Find_Orb": json.dumps({"num": 1, "objects": {"1I": {"object": "1I", "elements": elements}}}),
        "Sorcha": f"ObjID,FORMAT,q,e,inc,node,argPeri,t_p_MJD_TDB,epochMJD_TDB\n1I,COM,{q},{e},{i},{node},{peri},"
        f"{tp - 2400000.5!r},{epoch - 2400000.5}\n",
        "NeoWs": json.dumps(service),
    }
    places = []
    for name, content in texts.items():
        (tmp_path / "x").write_text(content)
        places.append(catalogue(tmp_path / "x")[0].orbit.position.to_value("km"))
        assert np.linalg.norm(places[-1] - places[0]) < 3000.0, (
            name
        )  # the Gaussian constant, and digits of Tp
    assert np.linalg.norm(places[0]) / 149597870.7 == pytest.approx(2.025, abs=1e-3)


@pytest.mark.parametrize(
    ("column", "value", "match"),
    [
        ("epoch", "58080.0", "epoch_jd_tdb"),  # a modified Julian date
        ("a", "190000000", "a_au"),  # kilometres
        ("e", "-.2", "e of 0 or more"),
        ("e", "1.2", "above 1 for a < 0"),
        ("i", "-7", "i_deg"),
        ("om", "", "om"),
    ],
)
def test_values_out_of_range_are_named(tmp_path, column, value, match):
    row = {
        "full_name": "X",
        "epoch": "2461000.5",
        "e": ".2",
        "a": "1.3",
        "i": "2",
        "om": "3",
        "w": "4",
        "ma": "5",
    }
    row[column] = value
    (tmp_path / "q").write_text(",".join(row) + "\n" + ",".join(row.values()) + "\n")
    with pytest.raises(InvalidInput, match=match):
        _ = catalogue(tmp_path / "q")[0].orbit


def test_an_eccentricity_above_one_in_mpcorb_is_named(tmp_path):
    line = text("apophis_2010.dat")
    (tmp_path / "m").write_text(line[:70] + "1.2011000" + line[79:])
    with pytest.raises(InvalidInput, match=r"e = 1\.2011: expected below 1 for a > 0"):
        _ = catalogue(tmp_path / "m")[0].orbit
