"""Result files: both formats say the same, journals survive any cut, bad outputs are found at once."""

import json
import os

import astropy.units as u
import numpy as np
import pytest

from flybystab.errors import InvalidInput
from flybystab.screening import table_files
from flybystab.screening.journal import Journal
from flybystab.screening.results import Column, read_results, table_of
from flybystab.screening.table_files import check_output, write_rows

COLUMNS = {
    "name": Column(str, None, "a name"),
    "number": Column(int, None, "a number"),
    "distance": Column(float, u.au, "a distance"),
    "angle": Column(float, u.deg, "an angle"),
    "text": Column(str, None, "free text"),
    "flag": Column(bool, None, "a flag"),
}
META = {"title": "test", "settings": {"seed": 3}}


def rows(n):
    for i in range(n):
        yield {
            "name": f"body {i}",
            "number": i,
            "distance": i / 7,
            "angle": np.inf if i % 2 else None,
            "text": 'a, "b"; # c' if i % 3 else "",
            "flag": i % 2 == 0,
        }


@pytest.mark.parametrize("suffix", [".ecsv", ".parquet"])
@pytest.mark.parametrize("n", [0, 1, 25])
def test_files_give_back_what_was_written(tmp_path, suffix, n, monkeypatch):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    monkeypatch.setattr(table_files, "ROW_GROUP", 10)
    path = tmp_path / f"out{suffix}"
    assert write_rows(rows(n), path, COLUMNS, META) == n
    table = read_results(path)
    wanted = table_of(rows(n), COLUMNS, META)
    assert table.colnames == wanted.colnames == list(COLUMNS)
    assert len(table) == n
    assert table.meta["settings"]["seed"] == 3
    assert not path.with_name(path.name + ".part").exists()
    for name in COLUMNS:
        assert table[name].unit == wanted[name].unit
        assert table[name].info.description == COLUMNS[name].text
        if n:
            assert [str(x) for x in table[name]] == [str(x) for x in wanted[name]]


def test_a_failing_source_leaves_no_file(tmp_path):
    def broken():
        yield from rows(3)
        raise OSError(28, "No space left on device")

    path = tmp_path / "x.ecsv"
    with pytest.raises(OSError, match="No space"):
        write_rows(broken(), path, COLUMNS, META)
    assert list(tmp_path.iterdir()) == []


def test_journal_recovers_from_a_cut_at_every_byte(tmp_path):
    header = {"run": "abc"}
    path = tmp_path / "j"
    journal = Journal(path, header)
    for task in (2, 0, 5):
        journal.add(task, {"rows": [{"name": f"é{task}", "x": float("nan")}]})
    journal.add(2, {"rows": []})
    journal.close()
    data = path.read_bytes()
    ends = [i + 1 for i, byte in enumerate(data) if byte == 10]
    for cut in range(len(data) + 1):
        path.write_bytes(data[:cut])
        again = Journal(path, header)
        whole = max(sum(e <= cut for e in ends) - 1, 0)
        assert [t for t in range(9) if t in again] == sorted([2, 0, 5][:whole])
        assert again.count == whole
        again.add(9, {"rows": [{"name": "new"}]})
        again.close()
        last = Journal(path, header)
        tasks = list(last.tasks())
        assert [t["task"] for t in tasks] == [*sorted([2, 0, 5][:whole]), 9]
        assert tasks[-1]["rows"][0]["name"] == "new"
        last.close(remove=True)
    assert not path.exists()


def test_journal_of_another_run_is_refused(tmp_path):
    Journal(tmp_path / "j", {"run": "abc", "settings": {"seed": 1, "samples": 9}}).close()
    with pytest.raises(InvalidInput, match="another run is unfinished there, with seed = 1 instead of 2"):
        Journal(tmp_path / "j", {"run": "abd", "settings": {"seed": 2, "samples": 9}})
    (tmp_path / "k").write_text(json.dumps([1]) + "\n")
    with pytest.raises(InvalidInput, match="journal"):
        Journal(tmp_path / "k", {"run": "abc"})


def test_two_runs_cannot_write_the_same_journal(tmp_path):
    pytest.importorskip("fcntl")
    first = Journal(tmp_path / "j", {"run": "abc"})
    with pytest.raises(InvalidInput, match="no other run"):
        Journal(tmp_path / "j", {"run": "abc"})
    first.close()
    Journal(tmp_path / "j", {"run": "abc"}).close()


def test_bad_outputs_are_found_before_work(tmp_path, monkeypatch):
    with pytest.raises(InvalidInput, match="ends in"):
        check_output(tmp_path / "x.csv")
    with pytest.raises(InvalidInput, match="can be written"):
        check_output(tmp_path / "no" / "x.ecsv")
    (tmp_path / "d.ecsv").mkdir()
    with pytest.raises(InvalidInput, match="directory"):
        check_output(tmp_path / "d.ecsv")
    monkeypatch.setattr(table_files, "LEAST_SPACE", 2**70)
    with pytest.raises(InvalidInput, match="free"):
        check_output(tmp_path / "x.ecsv")
    monkeypatch.undo()
    assert check_output(tmp_path / "x.ecsv").name == "x.ecsv"
    assert not (tmp_path / "x.ecsv").exists()
    if os.getuid():
        tmp_path.chmod(0o500)
        with pytest.raises(InvalidInput, match="can be written"):
            check_output(tmp_path / "x.ecsv")


def test_unreadable_results_are_named(tmp_path):
    for name, content in (("a.ecsv", "nonsense"), ("b.parquet", "nonsense"), ("c.txt", "")):
        (tmp_path / name).write_text(content)
        with pytest.raises(InvalidInput, match="result file"):
            read_results(tmp_path / name)
