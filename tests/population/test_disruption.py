"""Rates of verdicts: budgets against encounter rates, limits of strong material, sampling errors that hold."""

import signal
import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest
from astropy.table import QTable

import flybystab as fs
from flybystab.errors import InvalidInput, UnitMismatch
from flybystab.screening.priors import Population

RNG = np.random.default_rng(1)
ORBITS = QTable({"a": RNG.uniform(0.9, 2.5, 50), "e": RNG.uniform(0.3, 0.7, 50), "i": RNG.uniform(2, 30, 50)})


@pytest.fixture(scope="module")
def earth():
    return fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=4)


def test_the_verdicts_add_up_to_the_encounters(earth):
    radius = earth_radius()
    total = fs.encounter_rates(ORBITS, "earth", 5 * radius).total
    assert earth.table["rate"].sum().value == pytest.approx(total.value, rel=1e-12)
    impact = fs.encounter_rates(ORBITS, "earth", radius + 100 * u.km).total
    assert earth.rate("IMPACT").value == pytest.approx(impact.value, rel=1e-12)
    assert earth.samples["weight"].sum().value == pytest.approx((total - impact).value, rel=1e-12)


def earth_radius():
    return fs.encounter_rates(ORBITS, "earth").planet.radius * u.m


def test_periapses_lie_in_their_strata_and_every_stratum_has_as_many(earth):
    q = earth.samples["periapsis"].to_value(u.km)
    low, high = earth_radius().to_value(u.km) + 100.0, 5 * earth_radius().to_value(u.km)
    counts, _ = np.histogram(q, np.linspace(low, high, 9))
    assert np.all(counts == 20)


def test_strong_bodies_stay_intact():
    strong = Population.from_mapping({"cohesion_Pa": {"kind": "fixed", "value": 1e7}})
    rates = fs.disruption_rates(ORBITS, ["earth"], samples=16, priors=strong)
    assert rates.rate("INTACT").value > 0.0
    assert rates.rate("RESHAPED").value == 0.0
    assert rates.lifetime("RESHAPED", "BEYOND MODEL", "DISRUPTED") == np.inf * u.Myr
    # what was not met has the rate of one sample as its error
    row = rates.table[rates.table["verdict"] == "RESHAPED"]
    assert row["rate_error"][0] > 0.0 / u.yr


def test_other_seeds_agree_within_the_sampling_error(earth):
    other = fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=5)
    for verdict in ("INTACT", "RESHAPED"):
        one, two = (r.table[r.table["verdict"] == verdict][0] for r in (earth, other))
        sigma = np.hypot(one["rate_error"].value, two["rate_error"].value)
        assert abs(one["rate"].value - two["rate"].value) < 3.5 * sigma


def test_threads_and_repetition_change_nothing(earth):
    again = fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=4, workers=1)
    assert np.array_equal(again.samples["verdict"], earth.samples["verdict"])
    assert np.array_equal(again.table["rate"].value, earth.table["rate"].value)


def test_lifetime_and_change_of_spin(earth):
    disturbed = earth.rate("RESHAPED") + earth.rate("BEYOND MODEL")
    assert earth.lifetime("RESHAPED", "BEYOND MODEL").value == pytest.approx(
        50e-6 / disturbed.value, rel=1e-12
    )
    assert earth.spin_change_rate(0.0) <= earth.rate("INTACT") * (1.0 + 1e-12)  # sums in another order
    assert earth.spin_change_rate(0.5) <= earth.spin_change_rate(0.1)


def test_a_population_out_of_reach_has_no_verdicts():
    far = QTable({"a": [3.0], "e": [0.1], "i": [5.0]})
    rates = fs.disruption_rates(far, ["earth"], samples=8)
    assert len(rates.samples) == 0
    assert rates.rate("INTACT").value == 0.0
    assert rates.spin_change_rate(0.1).value == 0.0


def test_bad_input_is_named():
    with pytest.raises(UnitMismatch):
        fs.disruption_rates(ORBITS, ["earth"], diameter=1000.0)
    with pytest.raises(InvalidInput, match="samples"):
        fs.disruption_rates(ORBITS, ["earth"], samples=3)
    with pytest.raises(InvalidInput, match="at least one planet"):
        fs.disruption_rates(ORBITS, [])


def test_a_run_is_resumed_from_its_journal_and_gives_the_same(tmp_path, earth):
    from flybystab.population import sampled_encounters

    path = tmp_path / "rates.journal"
    calls = []

    def stop(done, total):
        calls.append(done)
        if done == 3:
            raise KeyboardInterrupt

    options = {"samples": 160, "seed": 4, "journal": path}
    with pytest.raises(KeyboardInterrupt):
        fs.disruption_rates(ORBITS, ["earth"], progress=stop, **options)
    assert path.exists()
    with pytest.raises(InvalidInput, match="journal of this run"):
        fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=5, journal=path)
    counts = []
    again = fs.disruption_rates(
        ORBITS, ["earth"], progress=lambda done, total: counts.append(done), **options
    )
    assert counts == [4, 5, 6, 7, 8]
    assert not path.exists()
    assert again.samples.colnames == earth.samples.colnames
    for name in earth.samples.colnames:
        assert np.array_equal(np.asarray(again.samples[name]), np.asarray(earth.samples[name]))
    assert sampled_encounters.ENDS  # the module that processes import


CHILD = """
import sys
import numpy as np
from astropy.table import QTable
import flybystab as fs
rng = np.random.default_rng(1)
orbits = QTable({"a": rng.uniform(0.9, 2.5, 50), "e": rng.uniform(0.3, 0.7, 50), "i": rng.uniform(2, 30, 50)})
def report(done, total):
    print(done, flush=True)
    if done == 3:
        sys.stdin.read()  # waits for its end
fs.disruption_rates(orbits, ["earth"], samples=160, seed=4, journal=sys.argv[1], progress=report)
"""


def test_a_run_that_was_killed_is_resumed(tmp_path, earth):
    """SIGKILL after three of eight strata: the rest is computed, and the result is that of an undisturbed run."""
    path = tmp_path / "rates.journal"
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert [child.stdout.readline().strip() for _ in range(3)] == ["1", "2", "3"]
    child.kill()
    child.communicate()
    assert child.returncode == -signal.SIGKILL
    counts = []
    again = fs.disruption_rates(
        ORBITS,
        ["earth"],
        samples=160,
        seed=4,
        journal=path,
        progress=lambda done, total: counts.append(done),
    )
    assert counts == [4, 5, 6, 7, 8]
    assert not path.exists()
    for name in earth.samples.colnames:
        assert np.array_equal(np.asarray(again.samples[name]), np.asarray(earth.samples[name]))


def test_processes_give_the_same(earth):
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        other = fs.disruption_rates(ORBITS, ["earth"], samples=160, seed=4, executor=pool)
    assert np.array_equal(other.samples["verdict"], earth.samples["verdict"])
    assert np.array_equal(other.table["rate"].value, earth.table["rate"].value)


def test_sizes_follow_from_absolute_magnitudes():
    table = ORBITS.copy()
    table["H"] = np.linspace(15.0, 22.0, len(table))
    fixed = Population.from_mapping({"albedo": {"kind": "fixed", "value": 0.14}})
    rates = fs.disruption_rates(table, ["earth"], diameter=None, samples=80, seed=1, priors=fixed)
    expected = 1329.0 / np.sqrt(0.14) * 10 ** (-0.2 * np.asarray(table["H"])[rates.samples["orbit"]])
    assert rates.samples["diameter"].to_value(u.km) == pytest.approx(expected, rel=1e-12)
    largest = rates.samples["diameter"].max()
    everything = rates.cumulative(0 * u.km, *set(rates.samples["verdict"]))[0]
    assert everything.value == pytest.approx(rates.samples["weight"].value.sum(), rel=1e-12)
    assert rates.cumulative(1.01 * largest, "INTACT")[0].value == 0.0
    with pytest.raises(InvalidInput, match="absolute magnitudes"):
        fs.disruption_rates(ORBITS, ["earth"], diameter=None)
    table["H"][3] = np.nan
    with pytest.raises(InvalidInput, match="row 3 has none"):
        fs.disruption_rates(table, ["earth"], diameter=None, samples=800)


def test_what_follows_from_the_samples(earth):
    lifetime = earth.lifetime("RESHAPED", "MASS LOSS", "DISRUPTED", "BEYOND MODEL")
    assert earth.changed_fraction(lifetime) == pytest.approx(1 - np.exp(-1), rel=1e-12)
    top = earth.contributors(most=3)
    changed = np.isin(earth.samples["verdict"], ["RESHAPED", "MASS LOSS", "DISRUPTED", "BEYOND MODEL"])
    one = changed & (earth.samples["orbit"] == top["orbit"][0])
    assert top["rate"][0].value == pytest.approx(earth.samples["weight"][one].value.sum(), rel=1e-12)
    assert np.all(np.diff(top["rate"].value) <= 0.0)
    after = earth.survivors()
    assert after["elongation"][1] > after["elongation_before"][1]  # tides draw bodies out
    share = earth.outcome_map([1.0, 5.1], [0.0, 100.0] * u.km / u.s, planet_name="earth")
    counted = earth.samples["weight"].value > 0.0
    assert share[0, 0] == pytest.approx(changed[counted].mean(), rel=1e-12)


def test_grains_take_over_where_the_ellipsoid_ends():
    weak = Population.from_mapping(
        {
            "friction_angle_deg": {"kind": "fixed", "value": 30},
            "cohesion_Pa": 0,
            "density_kg_m3": {"kind": "fixed", "value": 1000},
            "spin_period_h": {"kind": "fixed", "value": 6},
        }
    )
    slow = QTable({"a": [1.05] * u.au, "e": [0.1], "i": [3.0] * u.deg})
    plain = fs.disruption_rates(slow, ["earth"], radii=1.6, samples=8, seed=2, priors=weak)
    ends = np.isin(plain.samples["verdict"], ["BEYOND MODEL", "MASS LOSS", "DISRUPTED"])
    assert ends.any()
    carried = fs.disruption_rates(slow, ["earth"], radii=1.6, samples=8, seed=2, priors=weak, grains=100)
    assert np.array_equal(carried.samples["model"] == "grains", ends)
    assert np.all(carried.samples["verdict"] != "BEYOND MODEL")
    assert np.all(carried.samples["fragments"][ends] >= 1)
    fractions = np.asarray(carried.samples["fragment_fractions"])
    total = fractions.sum(axis=1) + np.asarray(carried.samples["largest_fraction"])
    assert np.all(total[ends] <= 1.0 + 1e-9)
    assert np.all(fractions[~ends] == 0.0)
    assert np.all(np.diff(fractions, axis=1) <= 0.0)
    # a fragment of the mass fraction f has the diameter f^(1/3) of that of the body, 1 km
    weight = carried.samples["weight"].to_value(1 / u.yr)
    rate = carried.fragment_rate([0.01 ** (1 / 3), 0.999] * u.km)
    assert rate[0].value == pytest.approx(weight @ np.sum(fractions >= 0.01, axis=1), rel=1e-12)
    assert rate[0].value > 0.0
    assert rate[1].value == 0.0
    assert plain.fragment_rate(1 * u.m)[0].value == 0.0
    assert np.array_equal(carried.samples["verdict"][~ends], plain.samples["verdict"][~ends])
    assert carried.table["rate"].sum().value == pytest.approx(plain.table["rate"].sum().value, rel=1e-12)
