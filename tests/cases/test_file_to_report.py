"""From the orbit file of an agency to the verdict and the page, by the commands."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.cli.main import main
from flybystab.encounter.encounter import Encounter
from flybystab.io.report import _encounter_rows

FILES = Path(__file__).parent / "files"
APOPHIS = Asteroid.from_catalogue("Apophis").row
_E = [APOPHIS[c] for c in ("e", "a_au", "i_deg", "node_deg", "peri_deg", "M_deg", "epoch_jd_tdb")]
E, A, I, NODE, PERI, M, EPOCH = _E

HORIZONS = f"""Target body name: 99942 Apophis (2004 MN4)      {{source: JPL#220}}
Center body name: Sun (10)                        {{source: DE441}}
Output units    : AU-D, deg, Julian Day Number (Tp)
Reference frame : Ecliptic of J2000.0
$$SOE
{EPOCH}00000000 = A.D. 2025-Nov-21 00:00:00.0000 TDB
 EC= {E} QR= {float(A) * (1 - float(E))} IN= {I}
 OM= {NODE} W = {PERI} Tp= 2461042.931950
 N = 1.1126 MA= {M} TA= 0.0
 A = {A} AD= 1.0 PR= 323.0
$$EOE
"""
FIND_ORB = f"""{{"num": 1, "ids": ["99942"], "objects": {{"99942": {{"object": "99942", "elements": {{
"central body": "Sun", "frame": "J2000 ecliptic", "epoch": {EPOCH}, "M": {float(M)!r}, "M sigma": 1e-6, "n": 1.1126,
"a": {float(A)!r},
"a sigma": 1e-9, "e": {float(E)!r}, "e sigma": 1e-8, "q": 0.746, "i": {I}, "i sigma": 1e-6, "arg_per": {PERI},
"arg_per sigma": 1e-6, "asc_node": {NODE}, "asc_node sigma": 1e-6, "Tp": 2461042.93, "H": 19.1}}}}}}}}"""
NEOCC = f"""format  = 'OEF2.0'       ! file format
rectype = 'ML'           ! record type (1L/ML)
refsys  = ECLM J2000     ! default reference system
END_OF_HEADER
99942
 KEP   {A} {E} {I} {NODE} {PERI} {M}
 MJD   {float(EPOCH) - 2400000.5:.9f} TDT
 MAG  18.937  0.150
 LSP   0  0    6
"""


def neodys():
    """The orbit of NEOCC in equinoctial elements (Broucke & Cefola 1972)."""
    node, peri, i = (np.radians(float(x)) for x in (NODE, PERI, I))
    e = float(E)
    values = [
        float(A), e * np.sin(node + peri), e * np.cos(node + peri), np.tan(i / 2) * np.sin(node),
        np.tan(i / 2) * np.cos(node), (float(M) + float(NODE) + float(PERI)) % 360.0,
    ]  # fmt: skip
    line = " EQU   " + " ".join(f"{float(x)!r}" for x in values)
    return "\n".join(line if x.startswith(" KEP") else x for x in NEOCC.splitlines()) + "\n"


@pytest.mark.parametrize("agency", ["JPL", "MPC", "NEOCC", "NEODyS", "Find_Orb", "Horizons"])
def test_an_orbit_file_gives_a_verdict_and_a_page(tmp_path, capsys, agency):
    """Apophis in 2029 from five publishers; its body is known by its number."""
    content = {
        "JPL": (FILES / "sbdb_covariance_same_epoch.json").read_text(),
        "MPC": (FILES / "apophis_2010.dat").read_text(),
        "NEOCC": NEOCC,
        "NEODyS": neodys(),
        "Find_Orb": FIND_ORB,
        "Horizons": HORIZONS,
    }[agency]
    file, page = tmp_path / "orbit", tmp_path / "page.html"
    file.write_text(content)
    date = ["--date", "2029-04-13"]
    assert main(["flyby", str(file), *date, "--attitudes", "4"]) == 0
    shown = capsys.readouterr().out
    assert "Apophis" in shown
    assert "2029-04-13" in shown
    assert "INTACT" in shown
    assert (
        main(["report", str(file), *date, "--attitudes", "4", "--samples", "1", "--output", str(page)]) == 0
    )
    html = page.read_text()
    assert "Apophis" in html
    assert "2029-04-13" in html


def test_a_file_of_several_orbits_asks_for_a_name(tmp_path, capsys):
    assert main(["flyby", str(FILES / "CometEls.txt")]) != 0
    error = capsys.readouterr().err
    assert "C/2020 F3 (NEOWISE)" in error
    assert "--catalogue" in error


@pytest.mark.parametrize(
    ("name", "date", "more"),
    [
        ("2020AB.json", "2019-12-29", ["--H", "27.5"]),  # MPC, a file without H
        ("2024BX1.ke1", "2024-01-21", []),  # NEOCC
        ("2018VP1.eq0", "2018-11-02", []),  # NEODyS
        ("find_orb_total.json", "2031-08-25", []),
    ],
)
def test_a_newly_found_object_has_a_verdict_by_the_population(capsys, name, date, more):
    """None of them is in the catalogue: --assume takes the body from the population and says so."""
    words = ["flyby", str(FILES / name), "--date", date, "--attitudes", "2", "--assume", *more]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert f"{date} " in shown
    assert "median of the population: diameter (from H and albedo)" in shown
    assert re.search(r"^verdict +[A-Z]", shown, re.MULTILINE)


def jpl_answer() -> str:
    """The orbit of 2020 AB as JPL would answer: elements with 1-sigmas, and H."""
    (a,) = catalogue(FILES / "2020AB.json")
    values = {mine: a.row[c] for mine, c in _NAMES_OF_JPL.items()}
    sigmas = {"a": "1e-4", "e": "4e-5", "i": "4e-4", "om": "1e-4", "w": "4e-4", "ma": "7e-3"}
    elements = [{"name": n, "value": v, "sigma": sigmas[n]} for n, v in values.items()]
    return json.dumps(
        {
            "object": {"fullname": "(2020 AB)", "des": "2020 AB", "orbit_class": {"code": "APO"}},
            "orbit": {
                "epoch": a.row["epoch_jd_tdb"],
                "orbit_id": "7",
                "elements": elements,
                "model_pars": [],
            },
            "phys_par": [{"name": "H", "value": "27.5"}],
        }
    )


_NAMES_OF_JPL = {"a": "a_au", "e": "e", "i": "i_deg", "om": "node_deg", "w": "peri_deg", "ma": "M_deg"}


def test_a_newly_found_object_of_jpl_has_a_page(tmp_path, capsys):
    """The page lists what is assumed, and that errors without correlations are not drawn."""
    file, page = tmp_path / "2020ab.json", tmp_path / "page.html"
    file.write_text(jpl_answer())
    words = ["report", str(file), "--date", "2019-12-29", "--assume", "--attitudes", "2", "--samples", "2"]
    assert main([*words, "--output", str(page)]) == 0
    assert "2020 AB" in capsys.readouterr().out
    html = page.read_text()
    assert "median of the population: diameter (from H and albedo)" in html
    assert re.search(
        r"not drawn</th>\s*<td[^>]*>orbit without errors \(1-sigmas without correlations\)", html
    )


def test_physical_parameters_of_a_file_complete_its_orbit(tmp_path, capsys):
    """The orbit of one file and the spin solutions of another; the page names their source."""
    spins = tmp_path / "spins.csv"
    spins.write_text(
        "period_h,lon_deg,lat_deg,weight,source\n0.05,10,20,2,lightcurve 1\n0.08,190,-20,1,lightcurve 2\n"
    )
    words = ["flyby", str(FILES / "2018VP1.eq0"), "--date", "2018-11-02", "--attitudes", "2", "--assume"]
    assert main([*words, "--phys", str(spins)]) == 0
    shown = capsys.readouterr().out
    assert "one of 2 alternative spin solutions (weight 67%)" in shown
    assert "pole unknown" not in shown
    assert "spin period" not in shown.partition("assumed")[2]


def test_the_page_of_an_impact_has_time_and_place_of_entry():
    """2024 BX1: seen west of Berlin at 00:32 to 00:33 UTC, which is 69 s before the same time in TDB."""
    orbit = catalogue(FILES / "2024BX1.ke1")[0].orbit
    e = Encounter.from_orbit(orbit, "earth", Time("2024-01-21", scale="tdb"))
    rows = dict(_encounter_rows(SimpleNamespace(encounter=e, contact=None), ""))
    assert "enters the atmosphere on 2024-01-21 00:33:4" in rows["impact"]
    assert "52.58 N 12.3" in rows["impact"]
