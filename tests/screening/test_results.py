"""Result files: both formats say the same, journals survive any cut, bad outputs are found at once."""

import json
import os
import shutil
import subprocess
import sys

import astropy.units as u
import numpy as np
import pytest

from flybystab.errors import InvalidInput, OutputFailed
from flybystab.screening import table_files
from flybystab.screening.journal import Journal
from flybystab.screening.results import Column, read_results, table_of
from flybystab.screening.table_files import check_output, write_rows
from flybystab.screening.tables import write_table

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


@pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX")
def test_a_folder_that_the_user_cannot_write_to_is_named(tmp_path):
    # root may write everywhere: a process without that capability stands for a user
    user = []
    if os.geteuid() == 0:
        if shutil.which("setpriv") is None:
            pytest.skip("root, without setpriv to give up its rights")
        user = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search"]
    script = (
        "import sys\nfrom flybystab.screening.table_files import check_output\n"
        "try:\n    check_output(sys.argv[1])\nexcept Exception as error:\n    print(type(error).__name__, error)"
    )
    closed = tmp_path / "closed"
    closed.mkdir()
    (closed / "old.ecsv").write_text("")
    (closed / "old.ecsv").chmod(0o400)
    for mode, name in ((0o500, "x.ecsv"), (0o700, "old.ecsv")):
        closed.chmod(mode)
        done = subprocess.run(
            [*user, sys.executable, "-c", script, closed / name], capture_output=True, text=True, check=True
        )
        assert done.stdout.startswith("InvalidInput output = "), done.stdout
        assert "a file that can be written" in done.stdout
    closed.chmod(0o700)


def test_unreadable_results_are_named(tmp_path):
    for name, content in (("a.ecsv", "nonsense"), ("b.parquet", "nonsense"), ("c.txt", "")):
        (tmp_path / name).write_text(content)
        with pytest.raises(InvalidInput, match="result file"):
            read_results(tmp_path / name)


@pytest.mark.parametrize("suffix", [".ecsv", ".parquet"])
def test_a_table_cut_anywhere_is_refused(tmp_path, suffix):
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"x{suffix}"
    write_rows(rows(3), path, COLUMNS, META)
    data = path.read_bytes()
    for cut in {*range(0, len(data), 7), *range(len(data) - 120, len(data))}:
        path.write_bytes(data[:cut])
        with pytest.raises(InvalidInput, match="result file"):
            read_results(path)
    path.write_bytes(data)
    assert len(read_results(path)) == 3
    if suffix == ".ecsv":
        path.write_bytes(
            data[: data[:-1].rindex(b"\n") + 1]
        )  # as a power cut between two rows would leave it
        with pytest.raises(InvalidInput, match="the 3 rows that its header gives; 2 are there"):
            read_results(path)
        write_table(table_of(rows(3), COLUMNS, META), path)
        data = path.read_bytes()
        assert read_results(path).meta["rows"] == 3
        path.write_bytes(data[: data[:-1].rindex(b"\n") + 1])
        with pytest.raises(InvalidInput, match="2 are there"):
            read_results(path)


def test_text_that_a_spreadsheet_would_run_is_quoted(tmp_path):
    names = ["=1+1", "+x", "-x", "@x", "# x", 'a"b,c', "plain", ""]
    path = tmp_path / "x.ecsv"
    write_rows(({"name": n, "number": -1, "distance": -1.0} for n in names), path, COLUMNS, META)
    assert list(read_results(path)["name"]) == names
    cells = [line for line in path.read_text().splitlines() if not line.startswith("# ")][1:]
    assert all(line.startswith('"') for line in cells[:6])
    assert cells[6].startswith("plain,-1,-1.0,")


def test_a_damaged_bit_of_a_journal_is_noticed(tmp_path):
    """A flipped bit loses its own record at most, and says so; no record comes back changed."""
    header = {"run": "abc", "settings": {"seed": 1}}
    path = tmp_path / "j"
    journal = Journal(path, header)
    wanted = {t: [{"name": f"body {t}", "margin": t / 7}] for t in range(4)}
    for task, content in wanted.items():
        journal.add(task, {"rows": content})
    journal.close()
    data = path.read_bytes()
    first = data.index(b"\n") + 1
    for bit in range(0, 8 * len(data), 5):
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        again = Journal(path, header)
        found = {t["task"]: t["rows"] for t in again.tasks()}
        assert all(wanted[t] == content for t, content in found.items())
        if bit // 8 < first - 1:
            assert (len(found), again.damaged) == (4, [1])
        elif bit // 8 == len(data) - 1:  # the end of the last line: as if it had not been written in full
            assert len(found) == 3
        else:
            assert len(found) >= 2
            assert again.damaged
        again.close()


def test_records_that_change_under_a_run_are_noticed(tmp_path):
    path = tmp_path / "j"
    journal = Journal(path, {"run": "abc"})
    journal.add(0, {"rows": [{"x": 1.5}]})
    path.write_bytes(path.read_bytes().replace(b"1.5", b"2.5"))
    with pytest.raises(OutputFailed, match="was changed while the run used it"):
        journal.task(0)
    journal.close()


def test_journals_do_not_follow_links_and_take_ordinary_files_only(tmp_path):
    target = tmp_path / "mine"
    target.write_text("")
    (tmp_path / "j").symlink_to(target)
    with pytest.raises(InvalidInput, match="symbolic link"):
        Journal(tmp_path / "j", {"run": "abc"})
    assert target.read_text() == ""
    os.mkfifo(tmp_path / "f")
    with pytest.raises(InvalidInput, match="ordinary file"):
        Journal(tmp_path / "f", {"run": "abc"})


def test_files_of_the_user_survive(tmp_path):
    """Files with the names of temporary ones, links and files that appear meanwhile are left alone."""
    kept = {name: tmp_path / name for name in ("x.ecsv.probe", "x.ecsv.part", "x.ecsv.1.part", "target")}
    for name, path in kept.items():
        path.write_text(name)
    out = tmp_path / "x.ecsv"
    out.symlink_to(kept["target"])
    check_output(out)
    write_rows(rows(3), out, COLUMNS, META)
    assert len(read_results(out)) == 3
    assert not out.is_symlink()
    assert {name: path.read_text() for name, path in kept.items()} == {name: name for name in kept}

    def meanwhile():
        yield from rows(1)
        new.write_text("mine")

    for new in (tmp_path / "new.ecsv", out):
        with pytest.raises(OutputFailed, match="by another program"):
            write_rows(meanwhile(), new, COLUMNS, META)
        assert new.read_text() == "mine"
    assert sorted(f.name for f in tmp_path.iterdir()) == sorted([*kept, "x.ecsv", "new.ecsv"])


def test_outputs_that_are_no_ordinary_files_or_have_long_names_are_refused(tmp_path):
    os.mkfifo(tmp_path / "f.ecsv")
    with pytest.raises(InvalidInput, match="ordinary file"):
        check_output(tmp_path / "f.ecsv")
    with pytest.raises(InvalidInput, match="shorter by 2 bytes"):
        check_output(tmp_path / ("x" * 244 + ".ecsv"))
    with pytest.raises(InvalidInput, match="null"):
        check_output("a\0.ecsv")
