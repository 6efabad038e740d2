"""Processor time of flybys in two checkouts of the package, in turn, on one machine.

Usage: ``python benchmarks/two_versions.py OLD [NEW]``: folders of the checkouts (``git worktree add OLD COMMIT``);
NEW is this one by default. Both run under this interpreter, with its libraries; their kernels are compiled first.

The pile of ``flybystab bench flyby`` passes the Earth at 3 radii, without yield, and at 2.2 radii, where it flows. The
cases are a default ``fs.flyby`` of each and a row of ``fs.flyby_many`` on one thread, over 200 random attitudes.
Medians of `ROUNDS` rounds of both checkouts in turn.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROUNDS = 7
CASES = ("flyby, no yield", "flyby, flow", "row of many, no yield", "row of many, flow")
N_ROWS = 200


def times() -> dict[str, float]:
    """Processor time of each case in the package on the path, s; called in the process of a checkout."""
    import astropy.units as u
    from scipy.spatial.transform import Rotation

    import flybystab as fs

    cone = fs.Material(yield_surface="drucker-prager")
    body = fs.Body(
        semi_axes=[1400, 850, 750] * u.m, density=2000 * u.kg / u.m**3, spin_period=6 * u.h, material=cone
    )
    turns = list(Rotation.random(N_ROWS, random_state=1).as_matrix())
    out = {}

    def median(run: Any, repeat: int) -> float:
        run()
        taken = []
        for _ in range(repeat):
            start = time.process_time()
            run()
            taken.append(time.process_time() - start)
        return statistics.median(taken)

    for q, name in ((3.0, "no yield"), (2.2, "flow")):
        encounter = fs.Encounter.hyperbolic(
            "earth", periapsis=q * fs.R_earth, v_inf=5 * u.km / u.s, start_distance=10 * fs.R_earth
        )

        def one(e: fs.Encounter = encounter) -> None:
            fs.flyby(body, e)

        def many(e: fs.Encounter = encounter) -> None:
            fs.flyby_many([body] * N_ROWS, [e] * N_ROWS, turns, workers=1)

        out[f"flyby, {name}"] = median(one, 25)
        out[f"row of many, {name}"] = median(many, 3) / N_ROWS
    return out


def run(checkout: Path) -> dict[str, float]:
    """`times` in a process that imports the package of a checkout."""
    environment = {**os.environ, "PYTHONPATH": str(checkout / "src")}
    done = subprocess.run(
        [sys.executable, __file__, "times"], env=environment, capture_output=True, text=True, check=True
    )
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    here = Path(__file__).resolve().parents[1]
    if sys.argv[1:] == ["times"]:
        print(json.dumps(times()))
        return
    if len(sys.argv) not in (2, 3):
        raise SystemExit(__doc__)
    checkouts = [Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve() if len(sys.argv) == 3 else here]
    rounds: list[list[dict[str, float]]] = [[], []]
    for checkout in checkouts:
        run(checkout)  # compiles
    for _ in range(ROUNDS):
        for found, checkout in zip(rounds, checkouts, strict=True):
            found.append(run(checkout))
    print(f"{'ms of processor time':20s}" + "".join(f"{case:>24s}" for case in CASES))
    for name, found in zip(("old", "new"), rounds, strict=True):
        medians = (1e3 * statistics.median(row[case] for row in found) for case in CASES)
        print(f"{name:20s}" + "".join(f"{value:24.3f}" for value in medians))


if __name__ == "__main__":
    main()
