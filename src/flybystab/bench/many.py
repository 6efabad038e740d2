"""Rate of many encounters: ``flyby`` one by one, and ``flyby_many`` on one thread and on all."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path

import astropy.units as u
from scipy.spatial.transform import Rotation

from flybystab.bench.flyby import case
from flybystab.encounter.encounter import Encounter
from flybystab.errors import InvalidInput
from flybystab.flybys.flyby import flyby
from flybystab.flybys.flyby_many import flyby_many
from flybystab.typing import Document
from flybystab.units import R_earth


def rows(figure: str | Path | None = None, n: int = 400, repeat: int = 9) -> list[Document]:
    """Rows of case, threads, wall and processor time per encounter (s), and their ratios to those of one thread.

    Random attitudes of the pile of the flyby benchmark, at 3 radii (rigid) and at 2.2 radii (most of them flow).
    This benchmark has no figure.
    """
    if figure is not None:
        raise InvalidInput("--output", str(figure), "no figure for this benchmark")
    body, _ = case()
    turns = list(Rotation.random(n, random_state=1).as_matrix())
    cores = os.cpu_count() or 1
    out: list[Document] = []
    for q in (3.0, 2.2):
        e = Encounter.hyperbolic(
            "earth", periapsis=q * R_earth, v_inf=5 * u.km / u.s, start_distance=10 * R_earth
        )

        def run_many(e: Encounter, workers: int) -> None:
            flyby_many([body] * n, [e] * n, turns, workers=workers)

        def one_by_one(e: Encounter = e) -> None:
            for turn in turns:
                flyby(body, e, turn, error=False, history=False)

        def many(workers: int, e: Encounter = e) -> Callable[[], None]:
            return lambda: run_many(e, workers)

        runs: dict[tuple[str, int], Callable[[], None]] = {("flyby, one by one", 1): one_by_one}
        for workers in sorted({1, cores}):
            runs["flyby_many", workers] = many(workers)
        best: dict[tuple[str, int], tuple[float, float]] = {}
        for _ in range(repeat):  # in turn, so that other load affects all of them alike
            for key, run in runs.items():
                wall, cpu = time.perf_counter(), time.process_time()
                run()
                took = (time.perf_counter() - wall) / n, (time.process_time() - cpu) / n
                best[key] = min(best.get(key, took), took)
        for (what, threads), (wall, cpu) in best.items():
            out.append(
                {
                    "what": what,
                    "periapsis_R_E": q,
                    "threads": threads,
                    "wall_s": wall,
                    "cpu_s": cpu,
                    "rate_over_threads_times_one": best["flyby_many", 1][0] / (threads * wall),
                    # processor time per row: includes contention of the threads, not the load of other programs
                    "cpu_of_one_over_cpu": best["flyby_many", 1][1] / cpu,
                }
            )
    return out


def lines(rows: list[Document]) -> list[str]:
    """The table as text."""
    head = (
        f"{'what':18s} {'q (R_E)':>8s} {'threads':>8s} {'wall (ms)':>10s} {'cpu (ms)':>9s} "
        f"{'rate/(threads x one)':>21s} {'cpu of one/cpu':>15s}"
    )
    return [head] + [
        f"{r['what']:18s} {r['periapsis_R_E']:8.1f} {r['threads']:8d} {1e3 * r['wall_s']:10.3f} "
        f"{1e3 * r['cpu_s']:9.3f} {r['rate_over_threads_times_one']:21.2f} "
        f"{r['cpu_of_one_over_cpu']:15.2f}"
        for r in rows
    ]
