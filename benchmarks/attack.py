"""Attacks on the reliability of runs and of public functions: what was tried, survived and lost.

python benchmarks/attack.py journal [N]    bits of a journal flipped: is the table of the continued run the same?
python benchmarks/attack.py power [N]      journal and tables cut at any byte, as a power cut leaves them; the cost
python benchmarks/attack.py cost           time of fsync and of the checksum per record of the journal
python benchmarks/attack.py fuzz [N]       N calls of every public function with valid and invalid arguments
python benchmarks/attack.py bombs          files that are too large, too deep or too long
python benchmarks/attack.py table [N]      all of these, N (25) calls of every function and the tests of each kind of
                                           attack: the table of docs/reliability.md; the rest goes to standard error
"""

from __future__ import annotations

import gzip
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import fuzzed
from scripted import screening

from flybystab.catalogues.catalogue import catalogue
from flybystab.errors import FlybystabError
from flybystab.files import read_text
from flybystab.io.scenario import scenario
from flybystab.screening import journal as journals
from flybystab.screening.priors import Population
from flybystab.screening.results import read_results


def stopped(folder: Path) -> tuple[Path, Path, bytes]:
    """A run stopped after four of six asteroids: its output, its journal, and the table of a whole run."""
    whole, out = folder / "whole.ecsv", folder / "out.ecsv"
    screening(samples=2).run(whole)

    def interrupt(state):
        if state.done == 4:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        screening(samples=2).run(out, progress=interrupt)
    return out, out.with_name(out.name + ".journal"), whole.read_bytes()


def continued(out: Path, wanted: bytes) -> str:
    """How a continued run ends."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            screening(samples=2).run(out, overwrite=True)
        except FlybystabError:
            return "refused with a named error"
        except Exception as error:
            return f"RAW {type(error).__name__}"
    same = "same table" if out.read_bytes() == wanted else "WRONG TABLE"
    return same + (", damage reported" if said else "")


def damaged(n: int, damage: Callable[[bytes, random.Random], bytes]) -> Counter[str]:
    counts: Counter[str] = Counter()
    rng = random.Random(1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        out, journal, wanted = stopped(folder)
        data, table = journal.read_bytes(), out.read_bytes()
        for _ in range(n):
            journal.write_bytes(damage(data, rng))
            out.write_bytes(table)
            counts[continued(out, wanted)] += 1
            journal.unlink(missing_ok=True)
    return counts


def flipped(data: bytes, rng: random.Random) -> bytes:
    bit = rng.randrange(8 * len(data))
    changed = bytearray(data)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def cut_tables(n: int) -> Counter[str]:
    counts: Counter[str] = Counter()
    rng = random.Random(2)
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "x.ecsv"
        screening(samples=2).run(path)
        data = path.read_bytes()
        for _ in range(n):
            path.write_bytes(data[: rng.randrange(len(data))])
            try:
                read_results(path)
                counts["READ AS WHOLE"] += 1
            except FlybystabError:
                counts["refused with a named error"] += 1
    return counts


def cost() -> None:
    """Time per record of the journal, and that of its checksum."""
    record = {"rows": [{f"column {k}": 1.0 / (k + 1) for k in range(45)}], "samples": []}
    for interval, n in ((1e9, 5000), (journals.SYNC_INTERVAL, 5000), (0.0, 500)):
        journals.SYNC_INTERVAL = interval
        with tempfile.TemporaryDirectory(dir=".") as folder:
            journal = journals.Journal(Path(folder) / "j", {"run": "cost"})
            began, spent = time.perf_counter(), time.process_time()
            for k in range(n):
                journal.add(k, record)
            journal.sync()
            wall, processor = (time.perf_counter() - began) / n, (time.process_time() - spent) / n
            journal.close(remove=True)
        print(
            f"fsync at most every {interval:g} s: {1e6 * wall:.0f} us per record, "
            f"{1e6 * processor:.0f} us of processor time"
        )
    journals.SYNC_INTERVAL = 1.0
    with tempfile.TemporaryDirectory(dir=".") as folder:
        journal = journals.Journal(Path(folder) / "j", {"run": "cost"})
        body = json.dumps({"task": 1, **record}).encode()
        spent = time.process_time()
        for _ in range(5000):
            journal._checksum(body)
        spent = (time.process_time() - spent) / 5000
        journal.close(remove=True)
    print(f"checksum of {len(body)} bytes: {1e6 * spent:.1f} us of processor time")


def fuzz(n: int) -> Counter[str]:
    """Outcomes of `n` calls of every public callable; raw errors and slow calls are printed with their arguments."""
    total: Counter[str] = Counter()
    for name, (_, pools) in fuzzed.calls().items():
        valid = {k: pool[0] for k, pool in pools.items()}
        counts, example = fuzzed.fuzz(name, n)
        good = counts["result"], counts["named error"]
        print(
            f"{name:24s} {counts.total():6d} calls, {good[0]:6d} results, {good[1]:6d} named errors",
            flush=True,
        )
        for found, k in counts.items():
            kind = found if found in ("result", "named error", "too slow") else "raw"
            total[kind] += k
            if kind in ("raw", "too slow"):
                odd = {a: v for a, v in example[found].items() if v is not valid[a]}
                print(f"    {k} x {found}: {str(odd)[:200]}", flush=True)
    print(dict(total))
    return total


def bombs() -> Counter[str]:
    """How reading files that are too large ends: "refused", "read", or a raw error."""
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        huge = folder / "gzip.csv.gz"
        with gzip.open(huge, "wb", compresslevel=1) as stream:
            for _ in range(1024):
                stream.write(b"0" * 2**20)
        texts = {
            "field.csv": "name,notes\nx," + "y" * 200_000,
            "deep.json": "[" * 100_000 + "]" * 100_000,
            "digits.json": '{"a": ' + "1" * 5000 + "}",
            "deep.toml": "a = " + "[" * 100_000 + "]" * 100_000,
            "digits.toml": "a = " + "1" * 5000,
            "dots.toml": "a." * 50_000 + "b = 1",
        }
        for file, text in texts.items():
            (folder / file).write_text(text)
        for file in sorted(folder.iterdir()):
            readers: list[Callable[[Path], object]] = [catalogue]
            if file.suffix == ".toml":
                readers = [Population.from_file, scenario]
            if file.suffix == ".gz":
                readers.append(lambda path: read_text(path, "file"))
            for reader in readers:
                began = time.perf_counter()
                try:
                    reader(file)
                    end = kind = "read"
                except FlybystabError as error:
                    end, kind = str(error).replace(str(folder) + "/", "")[:90], "refused"
                except BaseException as error:
                    end = kind = f"raw {type(error).__name__}"
                counts[kind] += 1
                print(f"{file.name:14s} {time.perf_counter() - began:6.2f} s  {end}")
    return counts


#: Attack -> its tests, and what the version before the corrections lost.
TESTED = {
    "SIGKILL, Ctrl-C once and twice, dead workers, killed parent, full disk, stopped at any asteroid": (
        ["screening/test_executors.py", "screening/test_screening.py"],
        "ctrl_c or dead_process or killed_parent or killed_run or fills_up or stopped",
        "2 of 11 runs did not end at a second Ctrl-C",
    ),
    "files and links of the user with the names of temporary files, names that appear meanwhile, FIFOs, names of 249 "
    "bytes, equal output names, two runs on one file": (
        ["screening/test_results.py", "screening/test_screening.py"],
        "files_of_the_user or follow_links or long_names or two_tables or two_runs or another_run or overwritten or "
        "bad_outputs",
        "files replaced and truncated",
    ),
    "impossible values in a row, unexpected errors, endless integration": (
        ["screening/test_screening.py"],
        "bad_row or time_limit or endless",
        "the run",
    ),
    "dask: wrong and missing scheduler files, servers that are no scheduler, tls without certificates, schedulers and "
    "workers killed, out of memory or without the package": (
        ["screening/test_executors.py"],
        "dask or scheduler",
        "raw errors; a server that does not answer was waited for without end",
    ),
    "damaged orbit files": (["catalogues/readers/test_damaged_files.py"], "", "not tried"),
    "escape sequences, formulas and markup in names and cells": (
        ["cli/test_terminal.py", "cli/test_csv.py", "plots/test_labels.py", "screening/test_results.py"],
        "control or formulas or dollar or spreadsheet",
        "reached the terminal, figures and spreadsheets",
    ),
    "package that cannot be written, no home folder, `python -OO`, a fork while threads compute": (
        ["core/numerics/test_installation.py", "cli/test_terminal.py", "core/numerics/test_threads.py"],
        "installed or package_that or without or fork",
        "the fork hung without a word",
    ),
}


def tested(files: list[str], chosen: str) -> tuple[int, int]:
    """Tests that passed, and those that did not."""
    tests = Path(fuzzed.__file__).parent
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--tb=short", "-p", "no:cacheprovider", "-k", chosen]
        + [str(tests / file) for file in files],
        cwd=tests.parent,
        capture_output=True,
        text=True,
    )
    last = done.stdout.strip().splitlines()[-1]
    found = {word: int(k) for k, word in re.findall(r"(\d+) (passed|failed|error)", last)}
    if done.returncode:
        print(done.stdout, file=sys.stderr)
    return found.get("passed", 0), found.get("failed", 0) + found.get("error", 0) + (not found)


def table(n: int) -> None:
    """The table of docs/reliability.md."""

    def row(attack: str, tried: int, survived: int, before: str, command: str) -> None:
        rows.append(
            f"| {attack} | {tried:,} | {survived:,} | {tried - survived or 'none'} | {before} | {command} |"
        )
        print(rows[-1], file=sys.stderr, flush=True)

    rows: list[str] = []
    flips, cuts, tables = damaged(60, flipped), damaged(60, cut), cut_tables(500)
    for attack, counts, before, command in (
        ("one bit of a journal flipped", flips, "24 of 60 gave a wrong table", "journal"),
        (
            "journal cut at any byte, as by a power cut",
            cuts,
            "journals and tables that were not on the disk",
            "power",
        ),
    ):
        survived = sum(k for end, k in counts.items() if end.startswith(("same table", "refused")))
        row(attack, counts.total(), survived, before, f"`benchmarks/attack.py {command}`")
    row(
        "finished table cut at any byte", tables.total(), tables["refused with a named error"],
        "a table without rows was read as complete", "`benchmarks/attack.py power`",
    )  # fmt: skip
    with redirect_stdout(sys.stderr):
        ends = bombs()
    row(
        "gzip of 1 GB, cells of 200 kB, nesting of 100,000, 5,000 digits, keys of 50,000 dots", ends.total(),
        ends["refused"], "raw errors", "`benchmarks/attack.py bombs`",
    )  # fmt: skip
    for attack, (files, chosen, before) in TESTED.items():
        passed, failed = tested(files, chosen)
        named = ", ".join(f"`tests/{file}`" for file in files)
        row(attack, passed + failed, passed, before, named)
    with redirect_stdout(sys.stderr):
        calls = fuzz(n)
    row(
        f"calls of all {len(fuzzed.calls())} public callables with valid, borderline and invalid arguments",
        calls.total(), calls["result"] + calls["named error"], "481 of 32,000 raw", f"`benchmarks/attack.py fuzz {n}`",
    )  # fmt: skip
    print(
        "| tried | times | survived | lost | lost before | repeated by |\n| --- | --- | --- | --- | --- | --- |"
    )
    print("\n".join(rows))


def main() -> None:
    kind, *rest = sys.argv[1:] or ["help"]
    n = int(rest[0]) if rest else 0
    if kind == "journal":
        print(dict(damaged(n or 60, flipped)))
    elif kind == "power":
        print("journal:", dict(damaged(n or 60, cut)))
        print("table:", dict(cut_tables(n or 500)))
        cost()
    elif kind == "cost":
        cost()
    elif kind == "fuzz":
        fuzz(n or 200)
    elif kind == "bombs":
        bombs()
    elif kind == "table":
        table(n or 25)
    else:
        print(__doc__)
    shutil.rmtree(".hypothesis", ignore_errors=True)


if __name__ == "__main__":
    main()
