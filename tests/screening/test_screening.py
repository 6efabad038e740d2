"""The chain from asteroids to rows: verdicts, probabilities, reproducibility, failure, stop and resume."""

import json
import pickle
import re
import signal
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import astropy.units as u
import numpy as np
import pytest
from scripted import NAMES, SPAN, day, same, screening, three

from flybystab.body.body import Material
from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import AU, R_EARTH
from flybystab.core.ellipsoid.yield_bound import tide_size
from flybystab.encounter.encounter import Encounter
from flybystab.encounter.reach import usual_start
from flybystab.errors import FlybystabWarning, InvalidInput, OutOfSpan, OutputFailed, UnknownName
from flybystab.flybys.flyby import flyby
from flybystab.orbit.planets import planet
from flybystab.screening import table_files, tasks
from flybystab.screening.columns import COLUMNS, VERDICTS, share_of
from flybystab.screening.draws import Attitudes, draws
from flybystab.screening.encounters import CloseApproach, close_approaches
from flybystab.screening.priors import Population
from flybystab.screening.progress import ProgressBar
from flybystab.screening.results import read_results
from flybystab.screening.sample_verdicts import contributors, sample_verdicts, wilson
from flybystab.screening.screening import Screening, screen
from flybystab.screening.settings import settings
from flybystab.screening.tasks import Part


def test_rows_say_what_they_must():
    # the cone: the bound takes the least slope of a surface, and decides less often on Mohr-Coulomb
    cone = Material(yield_surface="drucker-prager")
    table = screen(NAMES, *SPAN, finder=three, samples=20, seed=1, material=cone)
    assert len(table) == 5 * 3 + 1
    assert list(table.colnames) == list(COLUMNS)
    failed = table[table["asteroid"] == "Bennu"]
    assert failed["error"][0] == "NotConverged: lost"
    assert failed["verdict"][0] == ""
    good = table[table["error"] == ""]
    assert len(good) == 15
    assert set(good["decided_by"]) == {"bound", "dynamics"}
    far = good[good["distance"] > 0.01 * u.au]
    assert list(far["decided_by"]).count("bound") >= 3
    assert sum(far["samples_dynamic"]) < 0.1 * sum(far["samples"])
    shares = sum(good[share_of(v)] for v in VERDICTS)
    assert shares == pytest.approx(1.0)
    assert np.all(good["p_yield_low"] <= good["p_yield_high"])
    # A fast rotator without cohesion cannot exist; a close passage moulds what a far one does not.
    assert set(good[good["asteroid"] == "1950 DA"]["verdict"]) == {"NOT IN EQUILIBRIUM"}
    anteros = good[good["asteroid"] == "Anteros"]
    assert list(anteros["verdict"][:2]) == ["INTACT", "INTACT"]
    assert anteros["p_yield"][2] > anteros["p_yield"][0]
    assert anteros["margin"][0] > anteros["margin"][2]
    assert "density" in anteros["assumed"][0]
    assert anteros["contributors"][2]
    assert table.meta["settings"]["seed"] == 1
    assert table.meta["time_scale"] == "TDB"


def test_one_sample_is_the_catalogue_body():
    table = screen(["Anteros"], *SPAN, finder=three, material=Material(friction_angle=40 * u.deg))
    assert list(table["samples"]) == [0, 0, 0]
    assert np.all(table["friction_angle"] == 40 * u.deg)
    assert np.isfinite(table["numerical_error"][2])
    assert table["numerical_error"][2] < 1e-3 * u.deg


def test_a_distant_passage_adds_nothing_to_what_a_tumbler_mobilises_alone():
    # Apophis mobilises 8.49 to 8.53 deg (Mohr-Coulomb) as it tumbles freely
    far = screen(["Apophis"], "1990-01-01", "1999-01-01", within=0.04 * u.au)
    assert len(far) == 2
    assert np.all(far["friction_rise"] < 1e-3 * u.deg)
    assert far["required_friction_at_rest"].to_value(u.deg) == pytest.approx(8.5283, abs=1e-3)
    near = screen(["Apophis"], "2029-01-01", "2030-01-01", within=0.04 * u.au)
    assert np.all(near["friction_rise"] > 0.05 * u.deg)


def test_an_orbit_into_the_planet_is_an_impact():
    def hit(asteroid, settings):
        e = Encounter.hyperbolic("earth", periapsis=0.5 * R_EARTH * u.m, v_inf=9 * u.km / u.s)
        return [CloseApproach(asteroid, "earth", day(2462000.5), e.distance.to_value(u.m), 9000.0, e)]

    (row,) = screen(["Anteros"], *SPAN, samples=20, finder=hit)
    assert row["verdict"] == "IMPACT"
    assert row["p_impact"] + row["p_not_in_equilibrium"] == pytest.approx(1.0)
    assert row["p_yield"] == 1.0


def test_a_body_that_may_touch_the_ground_is_not_left_to_the_bound():
    """Strong bodies of 1.4 km half-length whose centres pass 1 km above the Moon's ground: some stand, some lie."""
    row = dict(Asteroid.from_catalogue("Anteros").row) | {
        "semi_axis_a_m": "1400", "semi_axis_b_m": "850", "semi_axis_c_m": "750", "diameter_m": "",
        "spin_period_h": "6", "name": "long",
    }  # fmt: skip
    a = Asteroid(row, file="made")
    floor = planet("moon").impact_distance
    enc = Encounter.hyperbolic("moon", (floor + 1000.0) * u.m, 5 * u.km / u.s)
    passage = CloseApproach(a, "moon", day(2462000.5), floor + 1000.0, 5000.0, enc)
    n = 12
    draw = draws(a, n, 3)._replace(axes=np.tile([1400.0, 850.0, 750.0], (n, 1)), cohesion=np.full(n, 1e6))
    attitudes = Attitudes.at(a, draw, 3, "moon")
    found = sample_verdicts(passage, draw, attitudes, Material())
    assert found.dynamic.all()
    assert {"IMPACT", "INTACT"} == set(found.verdict)
    frame = enc.periapsis_axes
    for i in range(n):
        one = flyby(draw.body(i, Material()), enc, frame @ attitudes.matrix(i), error=False, history=False)
        assert found.verdict[i] == one.verdict
    high = Encounter.hyperbolic("moon", (floor + 1500.0) * u.m, 5 * u.km / u.s)
    clear = sample_verdicts(
        replace(passage, distance=floor + 1500.0, encounter=high), draw, attitudes, Material()
    )
    assert not clear.dynamic.any()


def test_same_rows_for_any_executor_and_order():
    here = screen(NAMES, *SPAN, finder=three, samples=5, seed=2)
    with ThreadPoolExecutor(3) as pool:
        same(here, screen(NAMES, *SPAN, finder=three, samples=5, seed=2, executor=pool))
    turned = screen(NAMES[::-1], *SPAN, finder=three, samples=5, seed=2)
    for name in NAMES:
        same(here[here["asteroid"] == name], turned[turned["asteroid"] == name])
    other = screen(NAMES, *SPAN, finder=three, samples=5, seed=3)
    assert not np.array_equal(here["margin"], other["margin"], equal_nan=True) or not np.array_equal(
        here["contributors"], other["contributors"]
    )


def test_samples_may_be_split_at_will():
    """Parts of any size, in any order, on any number of workers: the same rows and samples, bit for bit."""
    run = screening(3, samples=41, seed=8, keep_samples=True)
    whole = dict(run.results())
    text = {i: json.dumps(rows) for i, rows in whole.items()}
    assert sum(r["samples_dynamic"] for r in whole[1]["rows"]) > 20
    for workers, block, chunk in ((1, 1, 1), (3, 5, 2), (2, 16, 1), (2, 1000, 3)):
        with ThreadPoolExecutor(workers) as pool:
            split = dict(run.results(pool, block=block, chunk=chunk, window=workers))
        assert {i: json.dumps(rows) for i, rows in split.items()} == text


def test_a_deep_passage_is_work_for_every_worker():
    """The samples of one asteroid are computed in separate small calls."""

    sizes = []

    class Counting(ThreadPoolExecutor):
        def submit(self, work, *given, **more):
            if isinstance(given[0], Part):
                sizes.append(given[0].last - given[0].first)
            return super().submit(work, *given, **more)

    run = Screening([Asteroid.from_catalogue("Anteros")], settings(*SPAN, samples=200, seed=1), three)
    with Counting(2) as pool:
        (_, result), *more = run.results(pool, block=10)
    assert not more
    assert len(result["rows"]) == 3
    assert sum(sizes) >= 192  # all but the first samples of the deep passage at least
    assert max(sizes) <= 80
    assert len(sizes) >= 15


def test_progress_shows_the_asteroid_in_work(tmp_path):
    """One asteroid alone: the bar moves, and the time left is known, before its row is there."""
    run = Screening([Asteroid.from_catalogue("Anteros")], settings(*SPAN, samples=200, seed=1), three)
    states = []
    with ThreadPoolExecutor(2) as pool:
        run.run(tmp_path / "x.ecsv", executor=pool, progress=states.append)
    assert [s.done for s in states] == [0] * (len(states) - 1) + [1]
    shares = [s.begun for s in states[1:-1]]
    assert len(shares) > 5
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < 0.3
    assert 0.7 < shares[-1] < 1.0
    assert all(0.0 < s.remaining < np.inf for s in states[1:-1])
    assert states[-1].begun == states[-1].remaining == 0.0
    half = next(s for s in states if s.begun > 0.5)
    assert ProgressBar().line(half, 100).startswith("[##########")


def test_quick_verdicts_are_those_of_the_dynamics():
    """No sample that the bound calls INTACT, and none that it calls impossible, is anything else."""
    decided = 0
    for q in (3.0, 6.0, 12.0, 40.0):
        enc = Encounter.hyperbolic("earth", periapsis=q * R_EARTH * u.m, v_inf=7 * u.km / u.s)
        for name in ("Apophis", "Anteros", "Geographos", "Toutatis"):
            a = Asteroid.from_catalogue(name)
            d = draws(a, 12, 5)
            p = CloseApproach(a, "earth", day(2462000.5), q * R_EARTH, 7000.0, enc)
            attitudes = Attitudes.at(a, d, 5, "earth")
            fast = sample_verdicts(p, d, attitudes, Material())
            full = sample_verdicts(p, d, attitudes, Material(), quick=False)
            assert fast.verdict == full.verdict
            by_bound = ~fast.dynamic & (np.array(full.verdict) == "INTACT")
            assert np.all(full.margin[by_bound] >= fast.margin[by_bound] - 1e-6)
            decided += int((~fast.dynamic).sum())
    assert decided > 80


def test_bound_from_distance_and_speed_covers_the_tide():
    a = Asteroid.from_catalogue("Apophis")
    for distance, v in ((0.01, 3000.0), (0.02, 12000.0), (0.049, 25000.0)):
        p = CloseApproach(a, "earth", day(2461000.5), distance * AU, v)
        start = usual_start(planet("earth"), distance * AU)
        e = Encounter.hyperbolic(
            "earth", periapsis=distance * u.au, v_inf=v * u.m / u.s, start_distance=start * u.m
        )
        bound, exact = p.bounds(), tide_size(e.tide, e.t_start, e.t_stop)
        assert all(b >= x for b, x in zip(bound, exact, strict=True))
        assert bound[0] < 1.1 * exact[0] + 3e-13  # the Sun's share is taken at 0.7 au
    # Near the Moon's orbit, and where the Sun bends a slow path, distance and speed say nothing.
    assert CloseApproach(a, "earth", p.time, 4e8, 6000.0).bounds() == (np.inf, np.inf)
    assert CloseApproach(a, "earth", p.time, 0.05 * AU, 2000.0).bounds() == (np.inf, np.inf)
    assert CloseApproach(a, "venus", p.time, 4e8, 6000.0).bounds()[0] < 1e-8


@pytest.mark.parametrize("suffix", ["ecsv", "parquet"])
def test_stopped_run_goes_on_without_losing_or_repeating(tmp_path, suffix):
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
    run = screening(samples=4, keep_samples=True)
    whole, out = tmp_path / f"whole.{suffix}", tmp_path / f"out.{suffix}"
    states = []
    run.run(whole, samples_output=tmp_path / f"s.{suffix}", progress=states.append)
    assert (states[-1].done, states[-1].rows) == (6, 16)
    assert sum(states[-1].verdicts.values()) == 16
    assert not list(tmp_path.glob("*.journal"))

    def interrupt(state):
        if state.done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.run(out, progress=interrupt)
    part = read_results(out)
    assert not part.meta["complete"]
    assert len(part) == 9
    journal = out.with_name(out.name + ".journal")
    journal.write_bytes(journal.read_bytes() + b'{"task": 3, "ro')  # killed in the middle of a line
    called = []
    again = Screening(run.asteroids, run.settings, lambda a, s: called.append(a.name) or three(a, s))
    again.run(out)
    assert called == NAMES[3:]
    assert not journal.exists()
    same(read_results(out), read_results(whole))
    assert read_results(out).meta["complete"]
    samples = read_results(tmp_path / f"s.{suffix}")
    assert len(samples) == 15 * 4
    assert set(samples["verdict"]) <= set(VERDICTS)


def test_a_run_stopped_inside_an_asteroid_goes_on_with_its_parts(tmp_path, monkeypatch):
    """The samples that were judged before the kill are not judged again, and the tables are the same."""
    run = Screening(
        [Asteroid.from_catalogue("Anteros")], settings(*SPAN, samples=200, seed=1, keep_samples=True), three
    )
    whole, out = tmp_path / "whole.ecsv", tmp_path / "out.ecsv"
    samples = tmp_path / "ws.ecsv", tmp_path / "s.ecsv"
    judged, original = [], Part.judged

    def counted(part, settings):
        judged.append(part.last - part.first)
        return original(part, settings)

    monkeypatch.setattr(Part, "judged", counted)
    run.run(whole, samples_output=samples[0])
    every = sum(judged)

    def stop(state):
        if state.begun > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.run(out, samples_output=samples[1], progress=stop)
    journal = tmp_path / "out.ecsv.journal"
    records = map(json.loads, journal.read_bytes().splitlines()[1:])
    kept = [len(record["verdict"]) for record in records if "verdict" in record]
    assert sum(kept) > 60
    assert read_results(out).meta["complete"] is False
    journal.write_bytes(
        journal.read_bytes() + b'{"task": 0, "passage": 2, "fir'
    )  # killed in the middle of a line
    judged.clear()
    run.run(out, samples_output=samples[1])
    assert sum(judged) == every - sum(kept)
    assert out.read_text() == whole.read_text()
    assert samples[1].read_text() == samples[0].read_text()
    assert not journal.exists()


def test_settings_are_checked():
    with pytest.raises(InvalidInput, match="start"):
        settings("soon", "2036-01-01")
    with pytest.raises(InvalidInput, match="stop"):
        settings("2036-01-01", "2026-01-01")
    with pytest.raises(OutOfSpan):
        settings("2026-01-01", "9999-01-01")
    with pytest.raises(UnknownName, match="earth"):
        settings(*SPAN, planets=["erth"])
    with pytest.raises(InvalidInput, match="within"):
        settings(*SPAN, within=-1 * u.au)
    for bad in (0, 1.5, True):
        with pytest.raises(InvalidInput, match="samples"):
            settings(*SPAN, samples=bad)
    with pytest.raises(InvalidInput, match="seed"):
        settings(*SPAN, seed=-1)
    with pytest.raises(UnknownName, match="Apophis"):
        screen(["Apohpis"], *SPAN)
    with pytest.raises(InvalidInput, match="once"):
        screen(["Apophis", 99942], *SPAN)


def test_output_is_checked_before_anything_is_computed(tmp_path):
    run = screening(2, lambda a, s: pytest.fail("computed"))
    with pytest.raises(InvalidInput, match="can be written"):
        run.run(tmp_path / "nowhere" / "x.ecsv")
    with pytest.raises(InvalidInput, match="keep_samples"):
        run.run(tmp_path / "x.ecsv", samples_output=tmp_path / "y.ecsv")


def test_finished_tables_are_not_overwritten_unasked(tmp_path):
    out, more = tmp_path / "x.ecsv", tmp_path / "y.ecsv"
    run = screening(3, samples=2, keep_samples=True)
    run.run(out)
    before = out.read_bytes()
    blind = Screening(run.asteroids, run.settings, lambda a, s: pytest.fail("computed"))
    with pytest.raises(InvalidInput, match=r"x\.ecsv: expected a file that does not exist; --overwrite"):
        blind.run(out)
    more.write_text("mine")
    with pytest.raises(InvalidInput, match=r"y\.ecsv: expected a file that does not exist"):
        blind.run(tmp_path / "z.ecsv", samples_output=more)
    assert (out.read_bytes(), more.read_text()) == (before, "mine")
    assert sorted(f.name for f in tmp_path.iterdir()) == ["x.ecsv", "y.ecsv"]
    other = screening(3, samples=2, seed=9)
    other.run(out, overwrite=True)
    assert read_results(out).meta["settings"]["seed"] == 9
    # An interrupted run is resumed over its own table, and only over its own.

    def interrupt(state):
        if state.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        other.run(out, overwrite=True, progress=interrupt)
    with pytest.raises(InvalidInput, match="another run is unfinished there"):
        run.run(out, overwrite=True)
    assert not read_results(out).meta["complete"]
    other.run(out)
    assert read_results(out).meta["complete"]


def test_row_groups_are_appended_while_tasks_end(tmp_path, monkeypatch):
    """In the order of the tasks, though they end in another one; what is unfinished has another name."""
    parquet = pytest.importorskip("pyarrow.parquet")
    monkeypatch.setattr(table_files, "ROW_GROUP", 4)
    out = tmp_path / "x.parquet"
    sizes = []

    class Backwards(Screening):
        """Pairs of asteroids in the wrong order."""

        def results(self, *given, **more):
            found = list(super().results(*given, **more))
            for k in range(0, len(found), 2):
                yield from found[k : k + 2][::-1]

    def look(state):
        assert not out.exists()
        sizes.append((tmp_path / "x.parquet.part").stat().st_size)

    run = screening(16, samples=2)
    Backwards(run.asteroids, run.settings, three).run(out, progress=look)
    assert len(set(sizes)) > 5  # grown several times before the end
    assert sizes == sorted(sizes)
    assert parquet.ParquetFile(out).num_row_groups == 12  # 46 rows
    run.run(tmp_path / "y.parquet")
    same(read_results(out), read_results(tmp_path / "y.parquet"))


@pytest.mark.parametrize("suffix", ["ecsv", "parquet"])
@pytest.mark.parametrize("limit", [2_000, 9_000, 12_500])
def test_a_disk_that_fills_up_in_the_middle_keeps_what_is_done(tmp_path, limit, suffix, monkeypatch):
    """A limit on the size of files simulates a full disk, for the journal or the table."""
    resource = pytest.importorskip("resource")
    if suffix == "parquet":
        pytest.importorskip("pyarrow")
        monkeypatch.setattr(table_files, "ROW_GROUP", 2)
    run, out = screening(samples=4), tmp_path / f"x.{suffix}"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
        with pytest.raises(OutputFailed, match=rf"asteroids are saved in .*x.{suffix}.journal") as caught:
            run.run(out)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, old)
    saved = int(re.search(r"(\d+) of 6 asteroids", str(caught.value))[1])
    assert 0 <= saved < 6
    called = []
    again = Screening(run.asteroids, run.settings, lambda a, s: called.append(a.name) or three(a, s))
    again.run(out)
    assert called == NAMES[saved:]
    run.run(tmp_path / f"whole.{suffix}")
    same(read_results(out), read_results(tmp_path / f"whole.{suffix}"))


def test_wilson_interval_and_contributors():
    # Agresti & Coull 1998: 0 of 20 -> upper limit z^2/(n + z^2)
    z2 = 1.959964**2
    assert wilson(0, 20) == (0.0, pytest.approx(z2 / (20 + z2)))
    assert wilson(20, 20)[0] == pytest.approx(20 / (20 + z2))
    assert wilson(5, 10)[0] == pytest.approx(1 - wilson(5, 10)[1])
    assert wilson(0, 0) == (0.0, 1.0)
    # The formula of Wilson (1927) in full, z = 1.959964.
    for k, n in ((1, 7), (33, 100), (999, 1000), (5, 100_000)):
        p, z = k / n, 1.959964
        centre, half = p + z2 / (2 * n), z * np.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        wanted = (centre - half) / (1 + z2 / n), (centre + half) / (1 + z2 / n)
        assert wilson(k, n) == pytest.approx(wanted, rel=1e-7)
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=(2, 300))
    text = contributors({"x": x, "y": y, "fixed": np.ones(300)}, np.exp(3 * x) + 0.01 * y)
    assert text.startswith("x +1.00")
    assert "fixed" not in text


def test_asteroids_travel_to_workers():
    a = Asteroid.from_catalogue("Apophis")
    _ = a.body, a.record, a.sources
    b = pickle.loads(pickle.dumps(a))
    assert b.row == a.row
    assert b.body.axes == pytest.approx(a.body.axes)
    assert pickle.loads(pickle.dumps(Population())) == Population()


def test_one_name_is_an_asteroid_and_not_a_file():
    (row,) = screen("Apophis", "2029-04-01", "2029-05-01", within=0.01 * u.au)
    assert row["asteroid"] == "Apophis"
    with pytest.raises(UnknownName, match="did you mean Apophis"):
        screen("Apopis", "2029-04-01", "2029-05-01")
    with pytest.raises(InvalidInput, match=r"catalogue file = Apophis\.csv: expected a readable file"):
        screen("Apophis.csv", "2029-04-01", "2029-05-01")


def test_a_damaged_journal_gives_the_same_table_and_a_warning(tmp_path):
    run = screening(samples=2)
    whole, out = tmp_path / "whole.ecsv", tmp_path / "out.ecsv"
    run.run(whole)

    def interrupt(state):
        if state.done == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.run(out, progress=interrupt)
    journal = tmp_path / "out.ecsv.journal"
    data = bytearray(journal.read_bytes())
    second = [k for k, byte in enumerate(data) if byte == 10][2]  # header, temporary file, first asteroid
    data[second + 400] ^= 4
    journal.write_bytes(data)
    states = []
    with pytest.warns(
        FlybystabWarning, match=r"damaged in 1 of its lines \(4\).* 3 of 6 asteroids are intact"
    ):
        run.run(out, progress=states.append)
    assert states[0].resumed == 3
    assert out.read_bytes() == whole.read_bytes()


def test_two_tables_need_two_files(tmp_path):
    run = Screening(
        screening(1).asteroids,
        settings(*SPAN, samples=2, keep_samples=True),
        lambda a, s: pytest.fail("computed"),
    )
    (tmp_path / "link").symlink_to(tmp_path)
    for other in (tmp_path / "x.ecsv", tmp_path / "link" / "x.ecsv"):
        with pytest.raises(InvalidInput, match="other than the output"):
            run.run(tmp_path / "x.ecsv", samples_output=other)
    assert [f.name for f in tmp_path.iterdir()] == ["link"]


def test_a_table_of_another_run_is_not_replaced_by_a_continued_one(tmp_path):
    out = tmp_path / "x.ecsv"
    run = screening(3)

    def interrupt(state):
        if state.done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.run(out, progress=interrupt)
    out.unlink()
    screening(2, seed=5).run(tmp_path / "other.ecsv")
    (tmp_path / "other.ecsv").rename(out)
    before = out.read_bytes()
    with pytest.raises(InvalidInput, match="does not exist"):
        run.run(out)
    assert out.read_bytes() == before
    run.run(out, overwrite=True)
    assert len(read_results(out)) == 9


BAD = {
    "sigma of text": {"density_sigma_kg_m3": "abc"},
    "negative sigma": {"density_sigma_kg_m3": "-1"},
    "sigma of an element": {"sigma_a_au": "abc"},
    "nan": {"e": "nan"},
    "Unix time": {"epoch_jd_tdb": "1700000000"},
    "a": {"a_au": "1e200"},
    "H": {"H_mag": "-1e308", "semi_axis_a_m": "", "semi_axis_b_m": "", "semi_axis_c_m": "", "diameter_m": ""},
    "A3": {"A3_au_d2": "1000"},
    "i": {"i_deg": "190"},
    "empty": dict.fromkeys(("a_au", "e", "i_deg", "node_deg", "peri_deg", "M_deg", "epoch_jd_tdb"), ""),
    "inside the Sun": {"a_au": "0.004", "e": "0.1"},
}


def test_one_bad_row_never_ends_a_run(tmp_path):
    """Each fails with its reason, the others are computed, and a continued run does not compute it again."""
    base = dict(Asteroid.from_catalogue("Apophis").row)
    rows = [base | change | {"name": name, "designation": name, "number": ""} for name, change in BAD.items()]
    run = Screening([Asteroid(base), *map(Asteroid, rows)], settings("2029-04-01", "2029-05-01", samples=2))
    out = tmp_path / "x.ecsv"

    def interrupt(state):
        if state.done == len(rows):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run.run(out, progress=interrupt)
    called = []
    again = Screening(
        run.asteroids, run.settings, lambda a, s: called.append(a.name) or close_approaches(a, s)
    )
    again.run(out)
    assert called == list(BAD)[-1:]
    table = read_results(out)
    assert table["verdict"][0] == "INTACT"
    assert list(table["asteroid"][1:]) == list(BAD)
    assert all(len(e) > 20 for e in table["error"][1:])
    assert "epoch_jd_tdb = 1700000000" in table["error"][list(BAD).index("Unix time") + 1]


def test_an_unexpected_error_and_a_time_limit_are_rows(tmp_path):
    def finder(asteroid, settings):
        if asteroid.name == "Anteros":
            raise ZeroDivisionError("no reason")
        while asteroid.name == "Toutatis":
            pass
        # The others get more time than the limit, which a busy machine may exceed.
        assert 0.0 < signal.setitimer(signal.ITIMER_REAL, 300.0)[0] <= 0.2
        return three(asteroid, settings)

    run = screening(4, finder, time_limit=0.2)
    run.run(tmp_path / "x.ecsv")
    table = read_results(tmp_path / "x.ecsv")
    errors = {row["asteroid"]: row["error"] for row in table}
    assert errors["Anteros"] == "ZeroDivisionError: no reason"
    assert errors["Toutatis"] == "NotConverged: Toutatis: not finished after the time limit of 0.2 s"
    assert errors["Apophis"] == errors["1950 DA"] == ""
    with pytest.raises(InvalidInput, match="time_limit"):
        screening(1, time_limit=0.0)
    with pytest.raises(InvalidInput, match="tolerance"):
        screening(1, tolerance=np.inf)


def test_an_orbit_of_endless_steps_is_given_up():
    """A period of nine hours, close to the Sun: the number of steps is limited, and the row says so."""
    row = dict(Asteroid.from_catalogue("Apophis").row) | {"a_au": "0.0098", "e": "0.5", "M_deg": "180"}
    table = screen(
        [Asteroid(row | {"A2_au_d2": "", "A1_au_d2": "", "A3_au_d2": ""})], "2026-01-01", "2100-01-01"
    )
    assert "1,000,000 steps taken at" in table["error"][0]


@pytest.mark.parametrize("block", [4, 64])
def test_statistics_of_samples_that_are_only_counted(monkeypatch, block):
    """Beyond the first `RANKED` samples the verdicts are counted: the same row whatever is kept, and in any parts."""
    asteroid = Asteroid.from_catalogue("Anteros")

    def rows(**more):
        run = Screening([asteroid], settings(*SPAN, samples=200, seed=1, **more), three)
        ((_, result),) = run.results(block=block)
        ranks = [row.pop("contributors") for row in result["rows"]]
        return json.dumps(result["rows"]), ranks, sum(row["samples_dynamic"] for row in result["rows"])

    monkeypatch.setattr(tasks, "RANKED", 60)
    counted = rows()
    assert counted == rows(keep_samples=True)
    monkeypatch.setattr(tasks, "RANKED", 1000)
    every = rows()
    assert counted[0] == every[0]
    assert counted[1] != every[1]
    assert counted[2] > 60
