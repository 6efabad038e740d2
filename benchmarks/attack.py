"""Attacks on the reliability of runs and of public functions: what was tried, survived and lost.

python benchmarks/attack.py journal [N]    bits of a journal flipped: is the table of the continued run the same?
python benchmarks/attack.py power [N]      journal and tables cut at any byte, as a power cut leaves them; cost of fsync
python benchmarks/attack.py fuzz [N]       N calls of every public function with valid and invalid arguments
python benchmarks/attack.py bombs          files that are too large, too deep or too long
"""

from __future__ import annotations

import gzip
import random
import shutil
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
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
    """Time per record of the journal."""
    record = {"rows": [{f"column {k}": 1.0 / (k + 1) for k in range(45)}], "samples": []}
    for interval, n in ((1e9, 5000), (journals.SYNC_INTERVAL, 5000), (0.0, 500)):
        journals.SYNC_INTERVAL = interval
        with tempfile.TemporaryDirectory(dir=".") as folder:
            journal = journals.Journal(Path(folder) / "j", {"run": "cost"})
            began = time.perf_counter()
            for k in range(n):
                journal.add(k, record)
            journal.sync()
            spent = (time.perf_counter() - began) / n
            journal.close(remove=True)
        print(f"fsync at most every {interval:g} s: {1e6 * spent:.0f} us per record")
    journals.SYNC_INTERVAL = 1.0


def fuzz(n: int) -> None:
    total: Counter[str] = Counter()
    for name, (_, pools) in fuzzed.calls().items():
        valid = {k: pool[0] for k, pool in pools.items()}
        fuzzed.outcome(name, valid, limit=600)  # compiles the kernels
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


def bombs() -> None:
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
                    end = "READ"
                except FlybystabError as error:
                    end = str(error).replace(str(folder) + "/", "")[:90]
                except BaseException as error:
                    end = f"RAW {type(error).__name__}"
                print(f"{file.name:14s} {time.perf_counter() - began:6.2f} s  {end}")


def main() -> None:
    kind, *rest = sys.argv[1:] or ["help"]
    n = int(rest[0]) if rest else 0
    if kind == "journal":
        print(dict(damaged(n or 60, flipped)))
    elif kind == "power":
        print("journal:", dict(damaged(n or 60, cut)))
        print("table:", dict(cut_tables(n or 500)))
        cost()
    elif kind == "fuzz":
        fuzz(n or 200)
    elif kind == "bombs":
        bombs()
    else:
        print(__doc__)
    shutil.rmtree(".hypothesis", ignore_errors=True)


if __name__ == "__main__":
    main()
