"""Public functions end in a result or a named error, for any arguments; more calls: benchmarks/attack.py."""

from importlib.util import find_spec

import pytest

fuzzed = pytest.importorskip("fuzzed", exc_type=ImportError)
#: Calls that take a second or more: fewer of them.
SLOW = (
    "disruption_rates",
    "encounter_distribution",
    "find_encounters",
    "infer",
    "screen",
    "virtual_impactors",
)
#: Calls that refuse nothing: all arguments are optional lists of names, or any text is valid.
NEVER = (
    "Asteroid.knows",
    "Asteroid.with_physical",
    "Body.with_",
    "DisruptionRates.lifetime",
    "FlybyResult.with_",
    "Material.with_",
)


@pytest.fixture(autouse=True)
def folder(monkeypatch, tmp_path):
    """Some calls write files."""
    monkeypatch.chdir(tmp_path)


def test_every_public_callable_is_called():
    assert fuzzed.public() == sorted(fuzzed.valid()), "add a valid call of new names to tests/fuzzed.py"


def test_valid_calls_give_results():
    # without a file of the format, or the extra, at hand these are refused
    absent = {"Encounter.from_oem", "Encounter.from_spk"}
    if find_spec("pyvista") is None:
        absent.add("Shape.to_pyvista")
    refused = [
        name
        for name, (_, pools) in fuzzed.calls().items()
        if name not in SLOW
        and fuzzed.outcome(name, {k: pool[0] for k, pool in pools.items()}, 600) != "result"
    ]
    assert set(refused) <= absent


@pytest.mark.parametrize("name", fuzzed.public())
def test_arguments_of_any_kind_end_in_a_result_or_a_named_error(name):
    counts, example = fuzzed.fuzz(name, 3 if name in SLOW else 15)
    raw = {k: example[k] for k in counts if k not in ("result", "named error")}
    assert not raw
    if name not in (*SLOW, *NEVER):
        assert counts["named error"] > 0
