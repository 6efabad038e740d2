"""Public functions end in a result or a named error, for any arguments; more calls: benchmarks/attack.py."""

import pytest

fuzzed = pytest.importorskip("fuzzed", exc_type=ImportError)
CHEAP = (
    "Material",
    "Body",
    "from_elements",
    "from_state",
    "equilibrium",
    "catalogue",
    "from_catalogue",
    "cite",
)


@pytest.mark.parametrize("name", CHEAP)
def test_arguments_of_any_kind_end_in_a_result_or_a_named_error(name):
    counts, example = fuzzed.fuzz(name, 60)
    raw = {k: example[k] for k in counts if k not in ("result", "named error")}
    assert not raw
    assert counts["named error"] > 0
