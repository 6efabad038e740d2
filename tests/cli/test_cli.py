"""The command line: readable text, one JSON document, honest exit statuses, errors that teach."""

import io
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numba import njit

from flybystab.catalogues.catalogue import Asteroid
from flybystab.cli import compile_notice as compiling
from flybystab.cli.main import COMMANDS, main
from flybystab.core.ellipsoid import yield_bound as quick
from flybystab.screening.priors import Population
from flybystab.screening.results import read_results

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def run(capsys, *arguments):
    status = main([str(a) for a in arguments])
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_apophis_survives(capsys, tmp_path):
    picture = tmp_path / "with space" / "apophis.png"
    picture.parent.mkdir()
    status, out, err = run(capsys, "flyby", "Apophis", "--output", picture, "--attitudes", 64)
    assert status == 0, err
    assert "INTACT" in out
    assert "2029-04-13" in out
    assert "assumed    density" in out
    assert picture.read_bytes()[:4] == b"\x89PNG"


def test_apophis_as_json(capsys):
    status, out, _ = run(capsys, "flyby", "99942", "--date", "2029-04-13", "--json")
    assert status == 0
    d = json.loads(out)
    assert d["verdict"] == "INTACT"
    assert d["robust"] is True
    assert d["encounter"]["distance_km"] == pytest.approx(38011.5, abs=5)
    assert d["encounter"]["time_tdb"].startswith("2029-04-13T21:46:12")
    assert d["margin_deg"] == pytest.approx(
        d["friction_angle_deg"] - d["max_required_friction_angle_deg"], abs=1e-9
    )
    # Benson et al. (2023): the spin rate may halve or double, the pole moves by 10 deg or more
    spin = d["attitudes"]["spin_ratio"]
    assert 0.5 < spin["q0"] < 0.7
    assert 1.4 < spin["q100"] < 2.0
    assert d["attitudes"]["pole_change_deg"]["q100"] > 10
    assert d["attitudes"]["verdicts"] == {"INTACT": 64}
    assert set(d) >= {"asteroid", "assumed", "modelled", "left_out", "error"}


def test_scenario_of_the_reference_case(capsys, tmp_path):
    status, out, _ = run(capsys, "scenario", EXAMPLES / "disruption_p2.toml", "--json")
    assert status == 0
    d = json.loads(out)
    assert d["verdict"] == "RESHAPED"
    assert d["semi_axes_m"] == pytest.approx([2405.551, 664.6593, 558.2060], rel=3e-7)
    assert d["spin_rad_s"] == pytest.approx(2.735800e-4, rel=1e-6)
    assert d["onset_time_s"] == pytest.approx(8518.24, abs=0.01)
    assert d["robust"] is False
    picture = tmp_path / "p2.png"
    status, out, _ = run(capsys, "scenario", EXAMPLES / "disruption_p2.toml", "--output", picture)
    assert status == 0
    assert "depends on the yield surface" in out
    assert picture.stat().st_size > 10_000


def test_scenario_of_apophis(capsys):
    status, out, _ = run(capsys, "scenario", EXAMPLES / "apophis_2029.toml", "--json")
    assert status == 0
    assert json.loads(out)["verdict"] == "INTACT"


def test_encounters(capsys):
    status, out, _ = run(
        capsys, "encounters", "Apophis", "--from", "2029-01-01", "--to", "2029-12-31", "--json"
    )
    assert status == 0
    rows = json.loads(out)["rows"]
    assert len(rows) == 1
    assert rows[0]["distance_km"] == pytest.approx(38011.5, abs=10)
    status, out, _ = run(capsys, "encounters", "Apophis", "--from", "2029-01-01", "--to", "2029-12-31")
    assert "1 encounter within 0.05 au" in out


def test_stability(capsys):
    status, out, _ = run(capsys, "stability", "1950 DA", "--json")
    assert status == 0
    d = json.loads(out)
    assert d["admissible"] is False
    assert d["required_friction_angle_deg"] is None
    assert d["required_friction_angle_deg_reason"] == "no friction angle suffices"
    assert d["margin_deg"] is None
    assert d["required_cohesion_Pa"] > 10
    status, out, _ = run(capsys, "stability", "Toutatis")
    assert "Toutatis: in equilibrium with 35 deg" in out


def test_screen_and_show(capsys, tmp_path):
    table = tmp_path / "screening.ecsv"
    status, out, err = run(capsys, "screen", "--from", "2029-01-01", "--to", "2030-01-01", "--output", table)
    assert status == 0, err
    assert "INTACT" in out
    assert table.exists()
    status, out, _ = run(capsys, "show", table, "--json")
    rows = json.loads(out)["rows"]
    assert any("Apophis" in str(row["asteroid"]) or "Apophis" in str(row) for row in rows)


def test_an_ending_asks_for_a_film(capsys, tmp_path):
    film = tmp_path / "p2.gif"
    status, out, err = run(capsys, "scenario", EXAMPLES / "disruption_p2.toml", "--output", film)
    assert status == 0, err
    assert "required to stay rigid" in out
    assert "the material has 35 deg" in out
    assert film.read_bytes()[:6] == b"GIF89a"


def test_cite(capsys):
    status, out, _ = run(capsys, "cite")
    assert status == 0
    assert "@article{Sharma2013" in out


@pytest.mark.parametrize(
    ("arguments", "status", "text"),
    [
        (["flyby", "Apofis"], 1, "did you mean Apophis"),
        (["flyby", "Apophis", "--date", "yesterday"], 2, "a date such as"),
        (["flyby", "Apophis", "--date", "2700-01-01"], 1, "span"),
        (["flyby", "Apophis", "--friction", "95"], 2, "friction_angle"),
        (["flyby", "Apophis", "--surface", "mohr"], 2, "did you mean mohr-coulomb"),
        (["flyby", "Apophis", "--output", "/nowhere/x.png"], 1, "a folder that exists"),
        (["flyby", "Apophis", "--output", "x.doc"], 2, "ends in .png"),
        (["flyby", "Apophis", "--planet", "vulcan"], 2, "unknown"),
        (["flyby"], 2, "name"),
        (["flibby", "Apophis"], 2, "did you mean flyby"),
        (["flyby", "Apophis", "--colour", "red"], 2, "unrecognized"),
        (["flyby", "Apophis", "--attitudes", "0"], 2, "--attitudes = 0: expected a whole number, 1 or more"),
        (["flyby", "Apophis", "--seed", "-1"], 2, "--seed"),
        (["flyby", "Apophis", "--cohesion", "-1"], 2, "cohesion"),
        (["screen", "--samples", "0"], 2, "--samples = 0"),
        (["screen", "--jobs", "0"], 2, "--jobs = 0"),
        (["screen", "--within", "nan"], 2, "--within = nan"),
        (["screen", "--from", "2030-01-01", "--to", "2029-01-01"], 2, "a date after --from"),
        (["screen", "--planet", "earth", "--planet", "erth"], 2, "did you mean earth"),
        (["screen", "--output", "x.csv"], 2, "ends in .ecsv"),
        (["screen", "--output", "/nowhere/x.ecsv"], 1, "can be written"),
        (["screen", "--samples-output", "x.csv"], 2, "ends in .ecsv"),
        (["screen", "no-such-file.csv"], 1, "no-such-file"),
        (["encounters", "Apophis", "--clones", "-1"], 2, "--clones = -1"),
        (["encounters", "Apophis", "--from", "soon"], 2, "a date such as"),
        (["encounters", "Apophis", "--from", "1500-01-01"], 1, "span"),
        *(
            ([*command, "--from", "2999-01-01", "--to", "3000-01-01"], 1, "TDB is outside the span of DE4")
            for command in (
                ["encounters", "Apophis"],
                ["screen"],
                ["ephemeris", "Apophis"],
                ["impacts", "Apophis"],
            )
        ),
        (["infer", "Toutatis", "--surface", "mohr"], 2, "did you mean mohr-coulomb"),
        (["stability"], 2, "--all"),
        (["stability", "Anteros", "--output", "x.ecsv"], 2, "--all"),
        (["figure", "spin", "Anteros"], 2, "no asteroid"),
        (["scenario", "no-such-file.toml"], 1, "a readable file"),
        (["show", "no-such-file.ecsv"], 1, "no-such-file"),
    ],
)
def test_bad_usage(capsys, arguments, status, text):
    got, out, err = run(capsys, *arguments)
    assert got == status
    assert out == ""
    assert text in err
    assert "Traceback" not in err


GOOD = """
[body]
semi_axes = "1400, 850, 750 m"
density = "2000 kg/m3"
spin_period = "6 h"
[encounter]
periapsis = "3 R_earth"
v_inf = "5 km/s"
"""


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("", "", None),
        ("spin_period", "spinperiod", "did you mean spin_period"),
        ("[body]", "[bodi]", "did you mean body"),
        ('"6 h"', "6", "text with a unit"),
        ('"6 h"', '"6 kg"', "converts to s"),
        ('"6 h"', '"six h"', "numbers and a unit"),
        ('"1400, 850, 750 m"', '"1400, 850, -750 m"', "semi_axes"),
        ('"1400, 850, 750 m"', '"850, 1400, 750 m"', "a1 >= a2 >= a3"),
        ('density = "2000 kg/m3"', "", "body.density"),
        ('"3 R_earth"', '"nan R_earth"', "finite"),
        ("[encounter]", "[encounter", "valid TOML"),
        ("[encounter]", '[material]\nbrittle = "no"\n[encounter]', "true or false, without quotes"),
        ("[encounter]", "[material]\ndilatancy = 2\n[encounter]", "dilatancy"),
        ("[encounter]", '[material]\nfriction_angle = "90 deg"\n[encounter]', "friction_angle"),
        ("[encounter]", '[material]\nyield_surface = "mohr"\n[encounter]', "did you mean mohr-coulomb"),
        ("[encounter]", "[output]\nfigur = 1\n[encounter]", "did you mean figure"),
        ("[encounter]", '[output]\nfigure = "x.doc"\n[encounter]', "ends in .png"),
        ("[encounter]", '[attitude]\neuler_zxz = "1, 2 deg"\n[encounter]', "shape (3,)"),
        ("[encounter]", '[attitude]\nturn = "1 deg"\n[encounter]', "known pole"),
        ("[body]", "[body]\nphase = 0.5", "without body.asteroid"),
        ('"3 R_earth"', '"3 R_erth"', "did you mean earth"),
        ('"3 R_earth"', '"-3 R_earth"', "periapsis"),
        ('"5 km/s"', '"5 km/s"\nephemeris = "de421"', "encounter.date"),
        ('"5 km/s"', '"5 km/s"\ndate = 2029-04-13', "no such key together with encounter.date"),
        ('"5 km/s"', '"5 km/s"\nj2 = "yes"', "true or false"),
        ('"5 km/s"', '"5 km/s"\nplanet = "plannet"', "unknown planet"),
    ],
)
def test_scenario_files(capsys, tmp_path, old, new, text):
    file = tmp_path / "scene.toml"
    file.write_text(GOOD.replace(old, new) if old else GOOD)
    status, out, err = run(capsys, "scenario", file)
    if text is None:
        assert status == 0
        assert "INTACT" in out
    else:
        assert status == 1
        assert text in err
        assert out == ""


def test_radii_of_other_planets_and_a_figure(capsys, tmp_path):
    file, picture = tmp_path / "scene.toml", tmp_path / "scene.png"
    text = GOOD.replace("3 R_earth", "1.3 R_jupiter").replace("v_inf", 'planet = "jupiter"\nv_inf')
    file.write_text(text + f'[output]\nfigure = "{picture}"\n')
    status, out, err = run(capsys, "scenario", file, "--json")
    assert status == 0, err
    d = json.loads(out)
    assert d["encounter"]["distance_km"] == pytest.approx(1.3 * 71492)
    assert d["figure"] == str(picture)
    assert picture.exists()


def test_impact_is_reported(capsys, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(GOOD.replace("3 R_earth", "0.9 R_earth"))
    status, out, _ = run(capsys, "scenario", file, "--json")
    assert status == 0
    assert json.loads(out)["verdict"] == "IMPACT"


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_an_example(capsys, command):
    status, out, _ = run(capsys, command, "--help")
    assert status == 0
    assert f"flybystab {command}" in out.split("example:")[1]


def test_importing_is_quiet_and_cheap():
    code = (
        "import sys, flybystab; "
        "print(sorted(m for m in ('numba', 'astropy', 'rebound', 'matplotlib') if m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""


def test_every_public_name_is_there():
    import flybystab

    for name in flybystab.__all__:
        assert getattr(flybystab, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'flyy'"):
        flybystab.flyy  # noqa: B018


DIMENSIONLESS = {
    "spin_ratio", "bound_fraction", "share", "n", "seed", "q0", "q5", "q50", "q95", "q100",
    "INTACT", "semi_axes_relative", "spin_relative", "tide_error_relative", "growth",
    "axis_ratio", "axis_ratio_limit", "strain", "nearest_relative", "bound_fraction_upper",
}  # fmt: skip
UNITS = ("_deg", "_km", "_m", "_s", "_Pa", "_rad_s", "_km_s", "_J")


def numbers(value, key=""):
    if isinstance(value, dict):
        for k, v in value.items():
            yield from numbers(v, k)
    elif isinstance(value, list):
        for v in value:
            yield from numbers(v, key)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield key


@pytest.mark.parametrize("name", ["Apophis", "Duende"])
def test_every_number_says_its_unit(capsys, name):
    status, out, err = run(capsys, "flyby", name, "--attitudes", 4, "--json")
    assert status == 0, err
    keys = set(numbers(json.loads(out)))
    # keys of the quantiles stand below one that names the unit
    assert {k for k in keys if k not in DIMENSIONLESS and not k.endswith(UNITS)} == set()


def test_an_unknown_pole_is_said(capsys):
    status, out, _ = run(capsys, "flyby", "Duende", "--attitudes", 2)
    assert status == 0
    assert "pole unknown" in out


@pytest.mark.skipif(not Path("/bin/bash").exists(), reason="no bash")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("flybystab fl", "flyby"),
        ("flybystab flyby Apop", "Apophis"),
        ("flybystab flyby Apophis --at", "--attitudes"),
        ("flybystab flyby Apophis --date 2029-04-13 --pl", "--planet"),
        ("flybystab encounters Toutat", "Toutatis"),
        ("flybystab completion z", "zsh"),
    ],
)
def test_completion(capsys, words, expected):
    status, out, _ = run(capsys, "completion", "bash")
    assert status == 0
    code = f"""{out}
COMP_WORDS=({words}); COMP_CWORD=$(( ${{#COMP_WORDS[@]}} - 1 ))
function=$(complete -p flybystab | sed 's/.*-F \\([^ ]*\\).*/\\1/'); "$function" flybystab
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    done = subprocess.run(["/bin/bash", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [expected]
    assert done.stderr == ""


def test_files_are_completed_too(capsys, tmp_path):
    (tmp_path / "Apo.ke1").touch()
    (tmp_path / "own.csv").touch()
    _, out, _ = run(capsys, "completion", "bash")
    for words, expected in (("flyby Apo", ["Apo.ke1", "Apollo", "Apophis"]), ("show ow", ["own.csv"])):
        code = (
            f"{out}\nCOMP_WORDS=(flybystab {words}); COMP_CWORD=2; _shtab_flybystab; echo ${{COMPREPLY[@]}}"
        )
        done = subprocess.run(
            ["/bin/bash", "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
        )
        assert sorted(done.stdout.split()) == expected


def test_the_script_of_zsh(capsys):
    _, zsh, _ = run(capsys, "completion", "zsh")
    assert zsh.startswith("#compdef flybystab")
    assert re.search(r"names=\(.* Apophis .*\)", zsh)
    assert re.search(r":.*:_flybystab_asteroids", zsh)
    if shutil.which("zsh"):
        subprocess.run(["zsh", "-n"], input=zsh, text=True, check=True)


def test_stability_of_a_whole_catalogue(tmp_path, capsys):
    file, out = tmp_path / "two.csv", tmp_path / "levels.ecsv"
    head = "name,semi_axis_a_m,semi_axis_b_m,semi_axis_c_m,density_kg_m3,spin_period_h"
    file.write_text(f"{head}\nslow,200,160,150,2000,8\nfast,200,160,150,2000,1.5\n")
    assert main(["stability", "--all", str(file), "--output", str(out), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [r["level_40"] for r in rows] == [2, 0]
    assert rows[1]["required_friction_angle_deg"] is None
    assert rows[1]["required_friction_angle_deg_reason"] == "no friction angle suffices"
    assert rows[1]["density_kg_m3"] == rows[0]["density_kg_m3"] == 2000
    assert rows[1]["required_cohesion_Pa"] > 0
    assert out.exists()
    assert main(["stability", "--all", str(file)]) == 0
    text = capsys.readouterr().out
    assert "40 deg: 1 inadmissible" in text
    assert main(["stability"]) == 2
    assert "--all" in capsys.readouterr().err
    assert main(["stability", "Apophis", "--output", str(out)]) == 2
    assert main(["stability", "--all", "--catalogue", str(file)]) == 2
    assert "stability --all FILE" in capsys.readouterr().err
    file.write_text(f"{head}\nlight,200,160,150,2,8\n")
    assert main(["stability", "--all", str(file)]) == 1
    assert "none of the rows could be computed (1, of which 1: density_kg_m3 = 2:" in capsys.readouterr().err


def test_files_saved_by_excel_or_notepad_are_read(capsys, tmp_path):
    """They begin with a byte-order mark."""
    mark = "\ufeff"
    scene, table, population = (tmp_path / n for n in ("s.toml", "a.csv", "p.toml"))
    scene.write_text(mark + GOOD, encoding="utf-8")
    assert run(capsys, "scenario", scene)[0] == 0
    text = "name,semi_axis_a_m,semi_axis_b_m,semi_axis_c_m,density_kg_m3,spin_period_h\r\nA,300,200,150,2000,6\r\n"
    table.write_bytes((mark + text).encode())
    status, out, err = run(capsys, "stability", "--all", table, "--json")
    assert status == 0, err
    assert json.loads(out)["rows"][0]["asteroid"] == "A"
    population.write_text(mark + "cohesion_Pa = { kind = 'fixed', value = 3 }\n", encoding="utf-8")
    assert Population.from_file(population).cohesion_Pa.value == 3
    document = tmp_path / "d.json"
    document.write_text(mark + run(capsys, "scenario", scene, "--json")[1], encoding="utf-8")
    assert run(capsys, "cite", document)[0] == 0


@pytest.mark.parametrize(("json_too", "said"), [(False, 1), (True, 0)])
def test_compiling_is_said_once_and_in_logs_too(monkeypatch, json_too, said):
    """Of a command that compiles two kernels, and not of what is compiled after it."""
    errors = io.StringIO()
    monkeypatch.setattr(sys, "stderr", errors)

    def compiling_command(options):
        for _ in range(2):
            assert njit(lambda x: 2 * x)(3) == 6

    monkeypatch.setattr(COMMANDS["stability"], "run", compiling_command)
    assert main(["stability", "Anteros", *(["--json"] if json_too else [])]) == 0
    assert errors.getvalue() == said * compiling.WORDS
    compiling_command(None)
    assert errors.getvalue() == said * compiling.WORDS


def test_numba_tells_what_it_compiles():
    """The event that the announcement waits for: at the first call, not at later ones."""
    stream = io.StringIO()
    with compiling.announced(stream):

        @njit
        def twice(x):
            return 2 * x

        assert stream.getvalue() == ""
        assert twice(3) + twice(4) == 14
        assert (
            stream.getvalue()
            == "flybystab: compiling numerical kernels, once on this machine (about a minute) ...\n"
        )


def test_compiling_in_workers_is_said_beforehand(monkeypatch, tmp_path):
    """Where the cache has no kernel of a screening; once one has run, it has it, under the name looked for."""
    size = np.array([[300.0, 200.0, 150.0]])
    out, verdict = np.zeros((1, 2)), np.zeros(1, dtype=np.int64)
    one, spin = np.ones(1), np.array([[0.0, 0.0, 1e-4]])
    quick.quick_margins(size, 2000 * one, spin, 0.6 * one, 0 * one, 0, 1e-9, 1e-6, out, verdict)
    assert verdict[0] == quick.INTACT
    stream = io.StringIO()
    with compiling.announced(stream, elsewhere=True):
        assert stream.getvalue() == ""
    empty = SimpleNamespace(stats=SimpleNamespace(cache_path=str(tmp_path)))
    monkeypatch.setattr(quick, "quick_margins", empty)
    with compiling.announced(stream):
        assert stream.getvalue() == ""
    with compiling.announced(stream, elsewhere=True):
        assert stream.getvalue() == compiling.WORDS
        assert njit(lambda x: 3 * x)(3) == 9
    assert stream.getvalue() == compiling.WORDS


def test_an_asteroid_of_my_own_file(capsys, tmp_path):
    file = tmp_path / "mine.csv"
    file.write_text(
        "name,epoch_jd_tdb,a_au,e,i_deg,node_deg,peri_deg,M_deg,semi_axis_a_m,semi_axis_b_m,semi_axis_c_m,"
        "density_kg_m3,spin_period_h\n"
        "Mine,2461000.5,0.9223803173917017,0.1911663355386932,3.340958441017069,203.8996515621043,"
        "126.6728325163065,312.8054663584516,200,160,150,1800,12\n"
    )
    status, out, err = run(capsys, "flyby", "mine", "--catalogue", str(file), "--attitudes", "2", "--json")
    assert status == 0, err
    found = json.loads(out)
    assert found["encounter"]["time_tdb"].startswith("2029-04-13")
    assert found["verdict"] == "INTACT"
    assert found["catalogue"] == str(file)
    assert "embedded" not in out
    status, _, err = run(capsys, "stability", "yours", "--catalogue", str(file))
    assert status == 1
    assert f"unknown asteroid 'yours' ({file} has 1)" in err
    status, _, err = run(capsys, "stability", "yours")
    assert "others are read from a file" in err
    table, page = tmp_path / "table.ecsv", tmp_path / "page.html"
    span = ("--from", "2029-04-01", "--to", "2029-05-01")
    assert run(capsys, "screen", str(file), *span, "--output", str(table))[0] == 0
    assert read_results(table).meta["catalogue"] == str(file)
    assert list(read_results(table)["catalogue"]) == [str(file)]
    assert run(capsys, "report", str(file), "--attitudes", "2", "--output", str(page))[0] == 0
    for written in (table, page):
        assert str(file) in written.read_text()
        assert "embedded catalogue" not in written.read_text()


def test_a_row_of_the_user_is_not_from_the_embedded_catalogue():
    embedded = Asteroid.from_catalogue("Apophis")
    assert embedded.file.startswith("embedded catalogue")
    assert Asteroid(dict(embedded.row) | {"density_kg_m3": "1800"}).file == "given values"


def test_a_screening_of_a_body_that_cannot_be_says_so(capsys, tmp_path):
    """A density in g/cm3 is no verdict, and a missing document no traceback."""
    file = tmp_path / "mine.csv"
    row = dict(Asteroid.from_catalogue("Apophis").row) | {"density_kg_m3": "2.6"}
    file.write_text(",".join(row) + "\n" + ",".join(f'"{v}"' for v in row.values()) + "\n")
    dates = "--from", "2029-04-01", "--to", "2029-05-01"
    reason = "density_kg_m3 = 2.6: expected a value in [50, 25000] for (99942) Apophis"
    status, out, err = run(capsys, "screen", file, *dates, "--output", tmp_path / "x.ecsv")
    assert "1 encounter, 1 not computed" in out
    assert reason in out
    # there is a table, but nothing in it: a shell must not take that for done
    assert status == 1
    assert err.splitlines()[-1].startswith("flybystab: none of the rows could be computed (1, of which 1: ")
    assert reason in err
    status, out, err = run(capsys, "screen", file, *dates, "--output", tmp_path / "y.ecsv", "--json")
    assert (status, len(json.loads(out)["rows"])) == (1, 1)
    assert reason in err
    # one good row is an answer
    good = row | {"density_kg_m3": "2600", "number": "", "name": "Twin", "designation": "", "aliases": ""}
    with file.open("a") as stream:
        stream.write(",".join(f'"{v}"' for v in good.values()) + "\n")
    status, out, err = run(capsys, "screen", file, *dates, "--output", tmp_path / "z.ecsv")
    assert status == 0, err
    assert "2 encounters, 1 not computed" in out
    status, _, err = run(capsys, "cite", str(tmp_path / "none.json"))
    assert (status, err.count("\n")) == (1, 1)
    assert "expected a readable JSON document (No such file" in err
