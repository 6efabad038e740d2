"""Tests with the declared minimum versions, or with the newest ones on another Python, in an environment of their own.

``python scripts/minimum_versions.py`` installs every dependency of pyproject.toml in the version that it requires at
least; ``--newest --python python3.13`` the newest ones for another interpreter. The package is installed, not linked,
so that its compiled kernels do not replace those of the working tree. Environments stay in ``out/`` for the next run.
"""

import argparse
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Extras whose packages the tests use.
EXTRAS = ("parquet", "xarray", "shapes", "dask", "spk", "test")
#: Tests that touch every dependency: tables and files, shapes, orbits, screenings, flybys, figures.
TESTS = (
    "tests/test_units.py", "tests/test_tabular.py", "tests/test_saving.py", "tests/test_files.py", "tests/io",
    "tests/body/test_equilibrium.py", "tests/body/test_shape.py", "tests/flybys/test_flyby.py",
    "tests/screening/test_results.py", "tests/screening/test_screening.py", "tests/orbit/test_orbit.py", "tests/plots",
)  # fmt: skip


def minima():
    """Requirements with every lower bound as the version itself."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    listed = [*project["dependencies"]]
    for extra in EXTRAS:
        listed += project["optional-dependencies"][extra]
    found = [
        re.match(r"([A-Za-z0-9_.-]+)>=([0-9.]+)$", text)
        for text in listed
        if not text.startswith("flybystab")
    ]
    return [f"{name}=={version}" for name, version in (m.groups() for m in found)]


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--python", default=sys.executable, help="interpreter (the running one)")
    parser.add_argument("--newest", action="store_true", help="newest versions instead of the minima")
    parser.add_argument("tests", nargs="*", default=TESTS, help="tests to run; other options go to pytest")
    options, others = parser.parse_known_args()
    name = ("newest " if options.newest else "minimum ") + Path(options.python).name
    place = ROOT / "out" / name.replace(" ", "-")
    python = place / "bin" / "python"
    if not python.exists():
        subprocess.run([options.python, "-m", "venv", place], check=True)
    pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    wanted = [f"{ROOT}[{','.join(EXTRAS)}]"] if options.newest else minima()
    subprocess.run([*pip, *wanted], check=True)
    shutil.rmtree(ROOT / "build", ignore_errors=True)
    subprocess.run([*pip, "--no-deps", "--force-reinstall", ROOT], check=True)
    listed = subprocess.run(
        [python, "-m", "pip", "freeze"], check=True, capture_output=True, text=True
    ).stdout
    print(" ".join(line for line in listed.splitlines() if "==" in line), flush=True)
    # the modules that tests share are not part of the package; -P keeps the working tree out of the path
    done = subprocess.run(
        [python, "-P", "-m", "pytest", "-q", "-p", "no:cacheprovider", *others, *options.tests], cwd=ROOT
    )
    sys.exit(done.returncode)


if __name__ == "__main__":
    main()
