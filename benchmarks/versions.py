"""Processor time of the flybys of two versions of the package, in turn, so that other programs affect both alike.

python benchmarks/versions.py OLD [NEW]         folders of two checkouts; NEW is this one by default
python benchmarks/versions.py calls OLD [NEW]   the same for calls of the public functions
python benchmarks/versions.py search OLD [NEW]  the same for searches for encounters, with their errors

Each version runs in a process of its own with compiled kernels. Without `calls`: the pile of `flybystab bench flyby` in
300 attitudes at 6 and 3 radii (rigid), 2.2 radii (a third of them flow) and 300 random scenes of `campaign.py stress`;
the ratio is the median over the rounds; outcomes that differ are counted. With `calls`: the same pile at 3 radii,
without yield, and at 2.2 radii, where it flows, in a default `fs.flyby` and in a row of `fs.flyby_many` over 200 random
attitudes on one thread; medians of the rounds. With `search`: encounters of the asteroids of the embedded catalogue
with the Earth below 0.05 au, with the default error; errors of the distance are against NEW at its least tolerance.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

#: Rounds, and flybys of each case.
ROUNDS, NUMBER = 15, 300
#: The same for calls of the public functions.
ROUNDS_CALLS, N_ROWS = 7, 200
#: Rounds and spans of the searches.
ROUNDS_SEARCH, SPANS = (
    5,
    {"24 years": ("2025-01-01", "2049-01-01"), "100 years": ("1950-01-01", "2050-01-01")},
)


def cases() -> dict[str, tuple[Any, Any]]:
    """Records of bodies and encounters by case."""
    import astropy.units as u
    import campaign
    import numpy as np
    from scipy.spatial.transform import Rotation

    import flybystab as fs
    from flybystab.bench.flyby import case
    from flybystab.flybys.batch import records

    body, _ = case()
    turns = Rotation.random(NUMBER, random_state=1).as_matrix()
    found = {}
    for q in (6.0, 3.0, 2.2):
        e = fs.Encounter.hyperbolic("earth", periapsis=q * fs.R_earth, v_inf=5 * u.km / u.s)
        found[f"{q:g} radii"] = records([body] * NUMBER, e.periapsis_axes.T @ turns, [e] * NUMBER)
    rng = np.random.default_rng(11)
    scenes = [campaign.draw(rng) for _ in range(NUMBER)]
    frames = np.stack([e.periapsis_axes.T @ turn for _, e, turn in scenes])
    found["random"] = records([b for b, _, _ in scenes], frames, [e for _, e, _ in scenes])
    return found


def kernels() -> Callable[[], dict[str, Any]]:
    """A function that returns the time per flyby (ms) and the outcomes of each case of `cases`."""
    import numpy as np

    from flybystab.core.dynamics.verdict_row import verdict_rows
    from flybystab.core.dynamics.workspace import Limits
    from flybystab.flybys.batch import MAX_STEPS, output_buffers

    every = np.arange(NUMBER)
    prepared = cases()

    def times() -> dict[str, Any]:
        answer = {}
        for name, (rows, met) in prepared.items():
            output = output_buffers(NUMBER, 0)
            start = time.process_time()
            verdict_rows(every, rows, met, Limits(1e-7, 12.0, MAX_STEPS), True, output)
            took = 1e3 * (time.process_time() - start) / NUMBER
            out = output.outcomes
            answer[name] = took, out["verdict"].tolist(), out["friction"].tolist(), out["axes"].tolist()
        return answer

    return times


def calls() -> Callable[[], dict[str, Any]]:
    """A function that returns the time of public calls (ms) with and without yield."""
    import astropy.units as u
    from scipy.spatial.transform import Rotation

    import flybystab as fs

    # as flybystab.bench.flyby.case, which versions from before the division into subpackages do not have
    body = fs.Body(
        semi_axes=[1400, 850, 750] * u.m,
        density=2000 * u.kg / u.m**3,
        spin_period=6 * u.h,
        material=fs.Material(yield_surface="drucker-prager"),
    )
    turns = list(Rotation.random(N_ROWS, random_state=1).as_matrix())

    def median(run: Callable[[], object], repeat: int) -> float:
        run()
        taken = []
        for _ in range(repeat):
            start = time.process_time()
            run()
            taken.append(1e3 * (time.process_time() - start))
        return statistics.median(taken)

    def times() -> dict[str, Any]:
        answer = {}
        for q, name in ((3.0, "no yield"), (2.2, "flow")):
            e = fs.Encounter.hyperbolic(
                "earth", periapsis=q * fs.R_earth, v_inf=5 * u.km / u.s, start_distance=10 * fs.R_earth
            )
            many = partial(fs.flyby_many, [body] * N_ROWS, [e] * N_ROWS, turns, workers=1)
            answer[f"flyby, {name}"] = median(partial(fs.flyby, body, e), 25)
            answer[f"row, {name}"] = median(many, 3) / N_ROWS
        return answer

    return times


def search() -> Callable[[], dict[str, Any]]:
    """A function that returns processor time (s), numbers of the asteroids, JD and distances (km) of each span."""
    import flybystab as fs

    asteroids = fs.catalogue()

    def found(
        span: tuple[str, str], tolerance: float | None
    ) -> tuple[float, list[int], list[float], list[float]]:
        start = time.process_time()
        table = fs.find_encounters(asteroids, *span, tolerance=tolerance, workers=1)
        took = time.process_time() - start
        return (
            took,
            table["index"].tolist(),
            table["time"].jd.tolist(),
            table["distance"].to_value("km").tolist(),
        )

    def times() -> dict[str, Any]:
        answer: dict[str, Any] = {"asteroids": len(asteroids)}
        for name, span in SPANS.items():
            answer[name] = found(span, None)
            if not truth:
                answer[f"{name}, tight"] = found(span, 1e-14)
        truth.append(True)
        return answer

    truth: list[bool] = []
    return times


def serve(prepare: Callable[[], Callable[[], dict[str, Any]]]) -> None:
    """Run all cases for each line that comes in, and write their times and outcomes."""
    times = prepare()
    while True:
        print(json.dumps(times()), flush=True)
        if not sys.stdin.readline():
            return


def answers(folder: Path, what: str) -> Iterator[dict[str, Any]]:
    """Times and outcomes of a version, a round each."""
    program = (
        f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import versions; "
        f"sys.path[:0] = [{str(folder / 'src')!r}, {str(folder / 'benchmarks')!r}]; versions.serve(versions.{what})"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for line in process.stdout:
            if line.startswith("{"):
                yield json.loads(line)
                process.stdin.write("\n")
                process.stdin.flush()


def print_calls(folders: list[Path]) -> None:
    """Print the medians of the times of public calls."""
    both = [answers(folder, "calls") for folder in folders]
    for a in both:
        next(a)  # compiles
    rounds = [[next(a) for a in both] for _ in range(ROUNDS_CALLS)]
    print(f"processor time of calls, medians of {ROUNDS_CALLS} rounds in turn, ms")
    print(f"{'':>6}" + "".join(f"{case:>18}" for case in rounds[0][0]))
    for k, version in enumerate(("old", "new")):
        medians = (statistics.median(r[k][case] for r in rounds) for case in rounds[0][0])
        print(f"{version:>6}" + "".join(f"{value:18.3f}" for value in medians))


def print_kernels(folders: list[Path]) -> None:
    """Print times, their ratio and the changes of the outcomes."""
    both = [answers(folder, "kernels") for folder in folders]
    first = [next(a) for a in both]  # compiles
    rounds = [[next(a) for a in both] for _ in range(ROUNDS)]
    print(
        f"processor time of {NUMBER} flybys at 1e-7, least of {ROUNDS} rounds in turn, ms each; largest changes"
    )
    print(
        f"{'case':>10} {'old':>8} {'new':>8} {'ratio':>6}   {'other verdicts':>14}  friction (deg)  axes (99 %)"
    )
    import numpy as np

    for name in first[0]:
        old, new = ([r[k][name][0] for r in rounds] for k in (0, 1))
        ratio = statistics.median(b / a for a, b in zip(old, new, strict=True))
        verdicts, friction, axes = (np.array([f[name][i] for f in first]) for i in (1, 2, 3))
        finite = np.isfinite(friction).all(axis=0)
        change = np.rad2deg(np.abs(np.diff(friction[:, finite], axis=0))).max(initial=0.0)
        with np.errstate(invalid="ignore"):
            stretched = np.abs(axes[1] / axes[0] - 1.0).max(axis=1)
        print(
            f"{name:>10} {min(old):8.4f} {min(new):8.4f} {ratio:6.2f}   {int((verdicts[0] != verdicts[1]).sum()):14d}"
            f"  {change:14.1e}  {np.nanquantile(stretched, 0.99):11.1e}"
        )


def print_search(folders: list[Path]) -> None:
    """Print rates of the searches and errors of their distances."""
    import numpy as np

    both = [answers(folder, "search") for folder in folders]
    first = [next(a) for a in both]  # compiles
    rounds = [[next(a) for a in both] for _ in range(ROUNDS_SEARCH)]
    asteroids = first[1]["asteroids"]
    print(
        f"{asteroids} asteroids of the embedded catalogue, one thread, processor time, least of {ROUNDS_SEARCH} rounds"
    )
    print(
        f"{'span':>10} {'':>4} {'object-years/s':>14} {'encounters':>10} {'median (km)':>11} {'p90 (km)':>9}"
    )
    for name in SPANS:
        _, index, days, km = (np.array(x) for x in first[1][f"{name}, tight"])
        for k, version in enumerate(("old", "new")):
            _, i, d, x = (np.array(column) for column in first[k][name])
            gaps = [
                np.abs(x - b)[(i == a) & (np.abs(d - t) < 1.0)].min(initial=np.inf)
                for a, t, b in zip(index, days, km, strict=True)
            ]
            years = float(name.split()[0])
            took = min(r[k][name][0] for r in rounds)
            median, most = np.percentile(gaps, [50, 90])
            print(
                f"{name:>10} {version:>4} {asteroids * years / took:14.0f} {len(i):10d} {median:11.2g} {most:9.2g}"
            )


def main() -> int:
    words = sys.argv[1:]
    modes = {"calls": print_calls, "search": print_search}
    show = modes.get(words[0], print_kernels) if words else print_kernels
    words = words[show is not print_kernels :]
    if not 1 <= len(words) <= 2:
        print(__doc__)
        return 2
    folders = [Path(word).resolve() for word in words]
    if len(folders) == 1:
        folders.append(Path(__file__).resolve().parents[1])
    show(folders)
    return 0


if __name__ == "__main__":
    sys.exit(main())
