"""Samples computed by grains: the rows do not depend on the executor, and each sample is one unit of the journal."""

import json
from concurrent.futures import ThreadPoolExecutor

import astropy.units as u
import numpy as np
import pytest
from scripted import SPAN, day

from flybystab.body.body import Material
from flybystab.catalogues.catalogue import Asteroid
from flybystab.constants import R_EARTH
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby import flyby
from flybystab.screening import grain_samples
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.result_rows import catalogue_body
from flybystab.screening.sample_verdicts import SampleVerdicts
from flybystab.screening.screening import Screening, screen
from flybystab.screening.settings import settings

DEEP = Encounter.hyperbolic("earth", periapsis=1.4 * R_EARTH * u.m, v_inf=5 * u.km / u.s)
FAR = Encounter.hyperbolic("earth", periapsis=30 * R_EARTH * u.m, v_inf=5 * u.km / u.s)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FLYBYSTAB_CACHE", str(tmp_path / "cache"))


def two(asteroid, settings):
    """A deep encounter and a distant one."""
    return [
        CloseApproach(asteroid, "earth", day(2462000.5 + k), e.distance.to_value(u.m), 5000.0, e)
        for k, e in enumerate((DEEP, FAR))
    ]


def study(samples=8, grains=40, **options):
    with pytest.warns(UserWarning, match="grains") if grains and grains < 100 else _nothing():
        chosen = settings(*SPAN, samples=samples, seed=1, grains=grains, keep_samples=True, **options)
    return Screening([Asteroid.from_catalogue("Anteros")], chosen, two)


class _nothing:
    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False


def test_only_the_samples_that_need_them_are_carried_on():
    ((_, plain),) = study(grains=None).results()
    ((_, found),) = study().results()
    deep, far = (r for r in found["rows"])
    assert json.dumps(far) == json.dumps(plain["rows"][1])
    carried = 0
    for before, after in zip(plain["samples"], found["samples"], strict=True):
        if before["verdict"] in grain_samples.ESCALATED:
            carried += after["decided_by"] == "grains"
            assert after["decided_by"] == "grains" or after["error"].startswith("no grains")
            assert after["verdict"] != "BEYOND MODEL" or after["error"]
            assert 0.0 < after["largest_fraction"] <= 1.0 or after["error"]
        else:
            for key, value in before.items():
                assert after[key] == value or np.isnan(value), key
    assert deep["samples_grains"] == carried > 2
    assert deep["decided_by"] == "grains"
    assert plain["rows"][0]["verdict"] == "BEYOND MODEL"
    assert deep["p_beyond_model"] < plain["rows"][0]["p_beyond_model"]


def test_a_sample_is_the_flyby_of_one_pile():
    run = study(samples=1, grains=40)
    ((_, found),) = run.results()
    row = found["rows"][0]
    assert row["decided_by"] == "grains"
    asteroid = run.asteroids[0]
    passage = two(asteroid, run.settings)[0]
    attitudes = catalogue_body(passage, run.settings)
    body = attitudes.draws.body(0, run.settings.material)
    attitude = DEEP.periapsis_axes @ attitudes.matrix(0)
    with pytest.warns(UserWarning, match="40 grains"):
        one = flyby(body, DEEP, attitude, grains=40, seeds=[0])
    assert row["verdict"] == one.verdict


@pytest.mark.parametrize("samples", [1, 8])
def test_rows_do_not_depend_on_the_executor(samples):
    text = json.dumps(dict(study(samples).results()))
    for workers, block in ((1, 1), (3, 2)):
        with ThreadPoolExecutor(workers) as pool:
            assert json.dumps(dict(study(samples).results(pool, block=block))) == text


def test_a_run_is_resumed_by_the_sample(tmp_path, monkeypatch):
    whole, output = tmp_path / "whole.ecsv", tmp_path / "resumed.ecsv"
    run = study()
    run.run(whole)
    calls = []
    true = grain_samples.grains_flyby

    def counted(*given, **more):
        calls.append(more["seeds"][0])
        if len(calls) == 3:
            raise KeyboardInterrupt
        return true(*given, **more)

    monkeypatch.setattr(grain_samples, "grains_flyby", counted)
    with pytest.raises(KeyboardInterrupt):
        study().run(output)
    assert len(calls) == 3
    before = list(calls)
    study().run(output)
    assert sorted(calls[3:] + before[:2]) == sorted(
        set(calls)
    )  # the interrupted one is repeated, the others are not
    assert output.read_text() == whole.read_text()


def test_verdicts_of_grains_survive_the_journal():
    nan = np.full(1, np.nan)
    one = SampleVerdicts(
        ["DISRUPTED"],
        nan,
        nan,
        np.ones(1, bool),
        [""],
        nan,
        grains=np.ones(1, bool),
        largest=np.array([1 / 3]),
    )
    back = SampleVerdicts.restored(json.loads(json.dumps(one.stored())))
    assert back.grains.all()
    assert back.largest[0] == 1 / 3
    plain = SampleVerdicts.restored(SampleVerdicts.failed("x", 1.0).stored())
    assert "grains" not in plain.stored()
    assert not plain.grains.any()


def test_a_sample_without_grains_keeps_its_verdict_and_the_reason():
    # beyond the calibrated friction
    run = study(
        samples=1, grains=40, material=Material(friction_angle=60 * u.deg, yield_surface="mohr-coulomb")
    )
    ((_, found),) = run.results()
    row = found["rows"][0]
    if row["verdict"] in grain_samples.ESCALATED:
        assert row["decided_by"] == "dynamics"
        assert "no grains: InvalidInput: friction_angle" in row["error"]


def test_the_settings_state_the_grains():
    assert study(grains=40).settings.stated()["grains"] == 40
    assert "grains" not in study(grains=None).settings.stated()
    with pytest.raises(InvalidInput, match="grains"):
        screen(["Anteros"], *SPAN, finder=two, grains=3)
