"""Throughput, overhead and memory of a screening, measured and printed as a table.

python benchmarks/screen.py throughput     samples per second by distance and workers; cost of 10^8 samples
python benchmarks/screen.py memory         resident memory while 10^6 rows are written
python benchmarks/screen.py samples        resident memory for 10^6 samples of one encounter
python benchmarks/screen.py catalogue [FILE] [--jobs N] [--samples N] [--output FILE]
                                           a whole run: time, verdicts, the ten closest to failure
python benchmarks/screen.py cneos RESULT   a table of results compared with the encounters predicted by CNEOS in 2021
"""

from __future__ import annotations

import argparse
import csv
import gzip
import io
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import astropy.units as u
from astropy.time import Time

from flybystab.catalogues.catalogue import Asteroid, catalogue, key_of
from flybystab.catalogues.completion import with_physical_data
from flybystab.constants import AU, R_EARTH
from flybystab.encounter.encounter import Encounter
from flybystab.screening.encounters import CloseApproach
from flybystab.screening.progress import ProgressBar
from flybystab.screening.results import read_results
from flybystab.screening.screening import Screening
from flybystab.screening.settings import Settings, settings
from flybystab.screening.summary import summary

SPAN = ("2026-01-01", "2050-01-01")
DISTANCES = {"0.02 au": 0.02 * AU, "10 R_E": 10 * R_EARTH, "4 R_E": 4 * R_EARTH, "2 R_E": 2 * R_EARTH}


def at(q: float, asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    e = Encounter.hyperbolic("earth", periapsis=q * u.m, v_inf=6 * u.km / u.s)
    return [CloseApproach(asteroid, "earth", Time(2462000.5, format="jd", scale="tdb"), q, 6000.0, e)]


def far(asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    return at(DISTANCES["0.02 au"], asteroid, settings)


def ten(asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    return at(DISTANCES["10 R_E"], asteroid, settings)


def four(asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    return at(DISTANCES["4 R_E"], asteroid, settings)


def two(asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    return at(DISTANCES["2 R_E"], asteroid, settings)


def duration(seconds: float) -> str:
    """A duration with a suitable unit: 48 s, 3 min, 2.5 h, 4 d."""
    for size, unit in ((86400.0, "d"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 1.5 * size:
            return f"{seconds / size:.2g} {unit}"
    return f"{seconds:.0f} s"


#: Distance, asteroids, samples of each.
CASES = (
    ("0.02 au", 200, 100),
    ("10 R_E", 100, 100),
    ("4 R_E", 50, 100),
    ("2 R_E", 20, 100),
    ("2 R_E", 1, 1000),
    ("0.02 au", 1, 100_000),
)
FINDERS = dict(zip(DISTANCES, (far, ten, four, two), strict=True))


class Measured(NamedTuple):
    """What a run took: wall time, processor time of its busiest process, s; samples, and those by dynamics."""

    wall: float
    processor: float
    samples: int
    dynamic: int


class Metered(Executor):
    """An executor that adds up the processor time of each of its processes."""

    def __init__(self, pool: Executor, workers: int) -> None:
        self.pool, self._max_workers = pool, workers
        self.spent: Counter[int] = Counter()

    def submit(self, work: Any, /, *given: Any, **more: Any) -> Future[Any]:
        """Submit a call."""
        outer: Future[Any] = Future()

        def done(inner: Future[Any]) -> None:
            process, seconds, answer = inner.result()
            self.spent[process] += seconds
            outer.set_result(answer)

        self.pool.submit(metered, work, *given, **more).add_done_callback(done)
        return outer


def metered(work: Any, *given: Any, **more: Any) -> tuple[int, float, Any]:
    """Process, processor time and answer of a call."""
    began = time.process_time()
    answer = work(*given, **more)
    return os.getpid(), time.process_time() - began, answer


def measured(run: Screening, pool: Executor | None, workers: int = 2) -> Measured:
    """A run here, or on the processes of a pool."""
    executor = None if pool is None else Metered(pool, workers)
    began, processor = time.perf_counter(), time.process_time()
    rows = [r for _, result in run.results(executor) for r in result["rows"]]
    wall, processor = time.perf_counter() - began, time.process_time() - processor
    busiest = max([processor, *(executor.spent.values() if executor else ())])
    return Measured(wall, busiest, sum(r["samples"] for r in rows), sum(r["samples_dynamic"] for r in rows))


def throughput() -> None:
    bodies = [a for a in catalogue() if a.name != "Bennu"]
    head = [("asteroids", 9), ("workers", 7), ("samples", 8), ("by dynamics", 11), ("samples/s", 10)]
    head += [("ratio", 6), ("of processor time", 18)]
    print(f"{'distance':>9} " + " ".join(f"{name:>{width}}" for name, width in head))
    rates: dict[tuple[str, int, int], float] = {}
    with ProcessPoolExecutor(2) as pool:
        # The first runs compile, in the workers, too.
        measured(Screening(bodies[:20], settings(*SPAN, samples=40), two), pool)
        measured(Screening(bodies[:4], settings(*SPAN, samples=20), two), None)
        for name, n, samples in CASES:
            chosen = bodies[:n] if n > 1 else [Asteroid.from_catalogue("Anteros")]
            run = Screening(chosen, settings(*SPAN, samples=samples), FINDERS[name])
            one = measured(run, None)
            for workers, m in ((1, one), (2, measured(run, pool))):
                rate = rates[name, n, workers] = m.samples / m.wall
                print(
                    f"{name:>9} {n:9d} {workers:7d} {m.samples:8d} {100 * m.dynamic / m.samples:10.1f}% "
                    f"{rate:10.0f} {one.wall / m.wall:6.2f} {one.processor / m.processor:18.2f}"
                )
        print("ratio: over one worker; of processor time: one worker's over that of the busier one of two")
        nothing = Screening(bodies, settings(*SPAN), nowhere)
        spent = measured(nothing, pool).wall
        print(f"overhead of one task: {1e3 * spent / len(bodies):.2f} ms")
    run = Screening(catalogue(), settings(*SPAN))
    began = time.perf_counter()
    found = sum(len(result["rows"]) for _, result in run.results())
    spent = time.perf_counter() - began
    years = 24 * len(run.asteroids)
    print(
        f"search and catalogue bodies, 1 worker: {years / spent:.0f} object-years/s ({found} encounters of "
        f"{len(run.asteroids)} asteroids in 24 years, {spent:.1f} s)"
    )
    # Fraction of the encounters within 0.05 au that come within 10 Earth radii, by area on the target plane.
    deep = (10 * R_EARTH / (0.05 * AU)) ** 2
    search = 1e6 * 24 / (years / spent) / 2
    draw = 1e8 * ((1 - deep) / rates["0.02 au", 200, 2] + deep / rates["2 R_E", 20, 2])
    print("on paper: 10^6 objects for 24 years, 10^8 samples, machines with two such cores")
    for machines in (1, 10, 100):
        print(
            f"{machines:4d} machines: {duration((search + draw) / machines)} "
            f"(search {duration(search / machines)}, samples {duration(draw / machines)})"
        )


def nowhere(asteroid: Asteroid, settings: Settings) -> list[CloseApproach]:
    """No encounter: measures the overhead of a task."""
    return []


class Rows(Screening):
    """Rows without computation: measures the journal and the writing of tables."""

    def results(self, *args: Any, skip: Any = (), **kwargs: Any) -> Iterator[tuple[int, dict[str, Any]]]:
        """The first asteroid's row for all of them; each pair ends in the wrong order."""
        _, pattern = next(iter(super().results(*args, **kwargs)))
        for i in range(len(self.asteroids)):
            yield min(i ^ 1, len(self.asteroids) - 1), pattern


def memory(count: int) -> None:
    """Peak resident memory of runs of up to `count` asteroids with one row each."""
    base = Asteroid.from_catalogue("Anteros")
    print(f"{'rows':>9} {'peak memory (MB)':>17} {'seconds':>8} {'table (MB)':>11}")
    with tempfile.TemporaryDirectory() as where:
        for suffix in ("ecsv", "parquet"):
            for n in (count // 100, count // 10, count):
                run = Rows([base] * n, settings(*SPAN, samples=100), far)
                began = time.perf_counter()
                out = Path(where) / f"x{n}.{suffix}"
                run.run(out)
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
                print(
                    f"{n:9d} {peak:17.0f} {time.perf_counter() - began:8.1f} "
                    f"{out.stat().st_size / 1e6:11.1f}  {suffix}"
                )


def sample_memory(count: int) -> None:
    """Peak resident memory of one encounter with up to `count` samples."""
    base = Asteroid.from_catalogue("Anteros")
    print(f"{'samples':>9} {'peak memory (MB)':>17} {'processor time (s)':>19}")
    with tempfile.TemporaryDirectory() as where:
        for n in (100, count // 10, count):
            began = time.process_time()
            Screening([base], settings(*SPAN, samples=n), far).run(Path(where) / f"x{n}.ecsv")
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(f"{n:9d} {peak:17.0f} {time.process_time() - began:19.1f}")


def whole(args: argparse.Namespace) -> None:
    asteroids = with_physical_data(catalogue(args.file)) if args.file else catalogue()
    run = Screening(asteroids, settings(*SPAN, samples=args.samples, seed=args.seed))
    output = args.output or Path(tempfile.mkdtemp()) / "screen.ecsv"
    began = time.perf_counter()
    if args.jobs > 1:
        with ProcessPoolExecutor(args.jobs) as pool:
            run.run(output, overwrite=True, executor=pool, progress=ProgressBar())
    else:
        run.run(output, overwrite=True, progress=ProgressBar())
    print(f"{time.perf_counter() - began:.1f} s with {args.jobs} workers; {output}")
    print(summary(output).text())


def cneos(result: Path, data: Path) -> None:
    """Encounters of the CNEOS table (2021) that are missing in a result, with their uncertainty at that time."""
    table = read_results(result)
    span = table.meta["settings"]["start_jd_tdb"], table.meta["settings"]["stop_jd_tdb"]
    file = table.meta["catalogue"]
    asteroids = catalogue() if str(file).startswith("embedded") else catalogue(file)
    names = {key_of(n): str(a.number or a.name) for a in asteroids for n in a.names}
    found: dict[str, list[tuple[float, float]]] = {}
    for row in table:
        key = str(row["number"]) if row["number"] > 0 else str(row["asteroid"])
        found.setdefault(key, []).append((float(row["jd_tdb"].value), float(row["distance"].value)))
    with gzip.open(data / "cneos_earth_1950_2040_lt0.05au.csv.gz") as raw:
        rows = list(csv.DictReader(io.TextIOWrapper(raw)))
    known = [
        r for r in rows if key_of(r["des"]) in names and span[0] <= float(r["jd_tdb_rounded_min"]) < span[1]
    ]
    sure = [r for r in known if r["t_sigma3_min"].lstrip("<").isdigit() and _minutes(r) < 60.0]
    lost = []
    for r in known:
        day, distance = float(r["jd_tdb_rounded_min"]), float(r["dist_au"])
        near = found.get(names[key_of(r["des"])], [])
        if not any(abs(d - day) < 0.01 + _minutes(r) / 1440 and abs(q - distance) < 1e-3 for d, q in near):
            closest = min(near, key=lambda x: abs(x[0] - day), default=(float("nan"),) * 2)
            lost.append((r, closest))
    print(
        f"{len(known)} encounters predicted in 2021, {len(known) - len(lost)} found at that time and distance;"
    )
    print(
        f"of the {len(sure)} whose time was known to an hour (3 sigma), {sum(r in sure for r, _ in lost)} not found"
    )
    print(
        f"{'asteroid':>12} {'predicted':>18} {'au':>8} {'least au':>8} {'3 sigma (d)':>11} {'nearest here':>14}"
    )
    for r, (day, distance) in lost:
        print(
            f"{r['des']:>12} {r['cd_tdb']:>18} {r['dist_au']:>8} {r['dist_min_au']:>8} "
            f"{_minutes(r) / 1440:11.2f} {day - float(r['jd_tdb_rounded_min']):+7.2f} d {distance:.5f}"
        )


def _minutes(row: dict[str, str]) -> float:
    """3-sigma of the time, minutes."""
    return float(row["t_sigma3_min"].lstrip("<") or 1e9)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("throughput", "memory", "samples", "catalogue", "cneos"))
    parser.add_argument("file", nargs="?", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--samples", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rows", type=int, default=1_000_000)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--data", type=Path, default=Path(__file__).resolve().parents[2] / "shared" / "data")
    args = parser.parse_args()
    if args.what == "throughput":
        throughput()
    elif args.what == "memory":
        memory(args.rows)
    elif args.what == "samples":
        sample_memory(args.rows)
    elif args.what == "cneos":
        cneos(args.file, args.data)
    else:
        whole(args)
    return 0


if __name__ == "__main__":
    sys.exit(main())
