"""Compilation in a second process."""

import os
from types import SimpleNamespace

import pytest

from flybystab.core.dynamics import verdict_row
from flybystab.flybys import precompile


@pytest.fixture
def cores(monkeypatch):
    monkeypatch.setattr(precompile, "CACHE", True)
    monkeypatch.setattr(os, "cpu_count", lambda: 2)


def test_a_process_is_started_only_for_kernels_that_are_not_on_disk(monkeypatch, cores, tmp_path):
    mark = tmp_path / "mark"
    monkeypatch.setattr(precompile, "_RIGID", f"open({str(mark)!r}, 'w').close()")
    monkeypatch.setattr(precompile, "on_disk", lambda kernel: True)
    assert not precompile.start()
    precompile.wait()
    assert not mark.exists()
    monkeypatch.setattr(precompile, "on_disk", lambda kernel: kernel is not verdict_row.rigid_rows)
    assert precompile.start()
    assert not precompile.start()  # one is enough
    precompile.wait()
    assert mark.exists()
    precompile.wait()


def test_a_process_that_fails_does_no_harm(monkeypatch, cores):
    monkeypatch.setattr(precompile, "_RIGID", "raise SystemExit(3)")
    monkeypatch.setattr(precompile, "on_disk", lambda kernel: False)
    assert precompile.start()
    precompile.wait()


def test_only_kernels_with_an_up_to_date_index_are_on_disk():
    class File:
        def __init__(self, index):
            self.index = index

        def _load_index(self):
            return self.index

    def kept(index):
        return SimpleNamespace(_cache=SimpleNamespace(_cache_file=File(index)))

    assert precompile.on_disk(kept({"signature": "file"}))
    assert not precompile.on_disk(kept({}))  # none, or out of date
    assert precompile.on_disk(SimpleNamespace())  # nothing is known: no second process


def test_the_second_process_compiles_what_a_rigid_flyby_needs():
    """In this process, where the kernels are there already: a flyby and a sample in which nothing yields."""
    exec(precompile._RIGID, {})
    assert precompile.on_disk(verdict_row.rigid_rows)
