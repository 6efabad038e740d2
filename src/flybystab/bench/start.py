"""Time of the first command on a fresh machine: processor time of compilation by kernel, and of the command afterwards.

Each case runs in a process of its own with an empty folder for kernels. The times of a kernel leave out the kernels
that it calls; what a second process compiles meanwhile (:mod:`flybystab.flybys.precompile`) is not included.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from numba.core import event

from flybystab.errors import InvalidInput
from flybystab.typing import Document

#: Cases: statements that are run in Python.
CASES = {
    "import": "import flybystab; flybystab.flyby",
    "flyby Apophis (rigid)": "from flybystab.cli.main import main; main(['flyby', 'Apophis'])",
    "flow": "import flybystab; from flybystab.bench.flyby import case; flybystab.flyby(*case())",
}
#: Kernels listed for each case.
LISTED = 15


class _Compilations(event.Listener):
    """Own processor time of each function that numba compiles."""

    def __init__(self) -> None:
        self.times: dict[str, float] = {}
        self.counts: dict[str, int] = {}
        self._open: list[tuple[float, float]] = []

    def on_start(self, event: event.Event) -> None:
        """Note the start of a compilation, which may be inside that of its caller."""
        self._open.append((time.process_time(), 0.0))

    def on_end(self, event: event.Event) -> None:
        """Add the time of a compilation, without those inside it."""
        start, inner = self._open.pop()
        took = time.process_time() - start
        function = event.data["dispatcher"].py_func
        name = f"{function.__module__}.{function.__name__}".removeprefix("flybystab.")
        self.times[name] = self.times.get(name, 0.0) + took - inner
        self.counts[name] = self.counts.get(name, 0) + 1
        if self._open:
            outer = self._open[-1]
            self._open[-1] = outer[0], outer[1] + took


def measure(code: str) -> Document:
    """Run Python code in this process: processor time, and own times and numbers of the compilations."""
    found = _Compilations()
    event.register("numba:compile", found)
    try:
        exec(code, {})
    except SystemExit as end:
        if end.code:
            raise
    return {"cpu_s": time.process_time(), "times": found.times, "counts": found.counts}


def _run(code: str, folder: str) -> Document:
    """`measure` in a new process that keeps its kernels in a folder."""
    environment = os.environ | {"NUMBA_CACHE_DIR": folder}
    environment.pop("FLYBYSTAB_KERNELS", None)
    program = f"import json; from flybystab.bench.start import measure; print('\\n' + json.dumps(measure({code!r})))"
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=environment, check=True
    )
    found: Document = json.loads(done.stdout.splitlines()[-1])
    return found


def rows(figure: str | Path | None = None) -> list[Document]:
    """Rows of case, kernel ("all" for the process), compilations, processor time, and that of a second run (s)."""
    if figure is not None:
        raise InvalidInput("--output", str(figure), "no figure for this benchmark")
    out: list[Document] = []
    for case, code in CASES.items():
        with tempfile.TemporaryDirectory() as folder:
            first, second = _run(code, folder), _run(code, folder)
        out.append(
            {
                "case": case,
                "kernel": "all",
                "compilations": sum(first["counts"].values()),
                "cpu_s": first["cpu_s"],
                "cpu_second_run_s": second["cpu_s"],
                "compilations_second_run": sum(second["counts"].values()),
            }
        )
        times = first["times"]
        for name in sorted(times, key=lambda n: -times[n]):
            row = {"kernel": name, "compilations": first["counts"][name], "cpu_s": times[name]}
            out.append({"case": case, **row, "cpu_second_run_s": None, "compilations_second_run": None})
    return out


def lines(rows: list[Document]) -> list[str]:
    """The table as text: of each case the process and the kernels that take longest."""
    out = []
    for case in dict.fromkeys(r["case"] for r in rows):
        whole, *kernels = (r for r in rows if r["case"] == case)
        out.append(
            f"{case}: {whole['cpu_s']:.1f} s of processor time, {whole['compilations']} compilations; then "
            f"{whole['cpu_second_run_s']:.2f} s, {whole['compilations_second_run']}"
        )
        out += [f"  {r['cpu_s']:6.2f} s  {r['compilations']:2d}  {r['kernel']}" for r in kernels[:LISTED]]
    return out
