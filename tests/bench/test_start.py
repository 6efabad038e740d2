"""The benchmark of the first answer."""

from flybystab.bench import start


def test_compilations_are_counted_once_and_not_again_in_the_second_run(monkeypatch):
    code = (
        "import numpy as np; from flybystab.core.numerics.tensors import eigensystem; "
        "eigensystem(np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3]), np.empty(3), np.empty((3, 3)))"
    )
    monkeypatch.setattr(start, "CASES", {"one kernel": code})
    whole, *kernels = start.rows()
    assert whole["compilations"] == sum(r["compilations"] for r in kernels) > 1
    assert whole["compilations_second_run"] == 0
    assert whole["cpu_second_run_s"] < whole["cpu_s"]
    assert "core.numerics.tensors.eigensystem" in [r["kernel"] for r in kernels]
    assert 0.0 < sum(r["cpu_s"] for r in kernels) < whole["cpu_s"]
    assert start.lines([whole, *kernels])[0].startswith("one kernel: ")
