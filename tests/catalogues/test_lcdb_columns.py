"""The summary of the LCDB in fixed columns against its CSV form, and other releases."""

import numpy as np
import pytest

import flybystab as fs
from flybystab.catalogues.physical import read_physical
from flybystab.errors import InvalidInput

#: First and last column, counted from 1 as in the readme of the LCDB, and title.
COLUMNS = {
    "number": (1, 7, "NUMBER"), "name": (11, 40, "NAME"), "desig": (42, 61, "DESIG"), "family": (63, 70, "FAM"),
    "class": (74, 83, "CLASS"), "diameter": (89, 96, "DIA."), "H": (100, 105, "H"), "period_flag": (144, 144, "F"),
    "period": (146, 158, "PERIOD"), "amplitude_flag": (176, 176, "F"), "amin": (178, 181, "AMIN"),
    "amax": (183, 186, "AMAX"), "U": (188, 189, "U"), "notes": (191, 195, "NOTES"),
}  # fmt: skip
LEFT = ("name", "desig", "class", "U", "notes")
ROWS = [
    {"number": "433", "name": "Eros", "desig": "1898 DQ", "class": "S*", "diameter": "23.930", "H": "10.470",
     "period": "5.27000000", "amin": "0.06", "amax": "1.40", "U": "3"},
    {"number": "1862", "name": "Apollo", "desig": "1932 HA", "period_flag": ">", "period": "100.00000000",
     "amplitude_flag": "<", "amax": "0.50", "U": "2-"},
    {"number": "99942", "name": "Apophis", "desig": "2004 MN4", "H": "18.940", "period": "30.56000000",
     "amax": "1.14", "U": "3", "notes": "T"},
    {"number": "0", "name": "2012 TC4", "desig": "2012 TC4", "period": "0.20390000", "U": "3"},
]  # fmt: skip


def line(cells):
    out = [" "] * 218
    for key, text in cells.items():
        first, last, _ = COLUMNS[key]
        padded = text.ljust(last - first + 1) if key in LEFT else text.rjust(last - first + 1)
        out[first - 1 : last] = padded
    return "".join(out).rstrip()


def summary(shift=""):
    titles = [" "] * 218
    for first, _, title in COLUMNS.values():
        titles[first - 1 : first - 1 + len(title)] = title
    head = ["ASTEROID LIGHTCURVE DATABASE (LCDB) SUMMARY (Complete)", "GENERATED: 2023-10-01", ""]
    rows = [shift + line(r) for r in ROWS]
    return "\n".join([*head, shift + "".join(titles).rstrip(), "-" * 218, *rows]) + "\n"


def test_values_of_the_fixed_columns(tmp_path):
    path = tmp_path / "lc_summary_pub.txt"
    path.write_text(summary())
    a = fs.Asteroid.from_catalogue("Eros").with_physical(path)
    assert a.quantity("diameter_m").value == 23930.0
    assert (a.quantity("spin_period_h").value, a.row["amplitude_mag"], a.row["taxonomic_class"]) == (
        5.27,
        "1.40",
        "S",
    )
    assert a.sources["spin"] == "LCDB, U = 3 (lc_summary_pub.txt)"
    apophis = next(b for b in read_physical(path) if "Apophis" in b.names)
    assert (apophis.row["H_mag"], apophis.row["spin_state"]) == ("18.940", "tumbling")
    unnumbered = next(b for b in read_physical(path) if "2012 TC4" in b.names)
    assert "0" not in unnumbered.names
    np.testing.assert_allclose([s.period for s in unnumbered.spins], [0.2039])


def test_bounds_are_not_values(tmp_path):
    """A period of "> 100 h" and an amplitude of "< 0.5 mag" are neither."""
    (tmp_path / "x.txt").write_text(summary())
    apollo = next(b for b in read_physical(tmp_path / "x.txt") if "Apollo" in b.names)
    assert not apollo.spins
    assert "amplitude_mag" not in apollo.row


def test_columns_of_another_release_are_refused(tmp_path):
    (tmp_path / "x.txt").write_text(summary(shift="  "))
    with pytest.raises(InvalidInput, match="columns"):
        read_physical(tmp_path / "x.txt")


def test_letters_outside_of_utf_8(tmp_path):
    (tmp_path / "x.txt").write_bytes(summary().replace("Apollo ", "Ap\u00f4llo").encode("latin-1"))
    assert any("Ap\u00f4llo" in b.names for b in read_physical(tmp_path / "x.txt"))


def test_the_iau_spin_files_of_damit_are_refused(tmp_path):
    """Model 101: the same pole and rotation in ``spin.txt`` and, in other quantities, in ``IAUspin.txt``."""
    path = tmp_path / "spin.txt"
    path.write_text("35 -12 7.81323\n2433827.77154 0\n")
    (body,) = read_physical(path)
    assert (body.spins[0].pole, body.spins[0].period) == ((35.0, -12.0), 7.81323)
    assert 360.0 / (body.spins[0].period / 24.0) == pytest.approx(1105.816672, abs=1e-4)
    path.write_text("37 2 1105.816672\n2451545.0 15.6\n")
    with pytest.raises(InvalidInput, match="IAUspin"):
        read_physical(path)
