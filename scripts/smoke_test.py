"""Install the wheel and the sdist in clean environments and try them outside the repository.

``python scripts/smoke_test.py dist`` takes the newest of each out of that folder. The wheel must answer from the
shell and from Python, and hold the files of the source tree and no others; the wheel made from the sdist must hold the
same files.
"""

import json
import subprocess
import sys
import tempfile
import venv
import zipfile
from pathlib import Path

FIVE_LINES = """
import astropy.units as u, flybystab as fs
pile = fs.Body(semi_axes=[1400, 850, 750] * u.m, density=2 * u.g / u.cm**3, spin_period=6 * u.h)
passage = fs.Encounter.hyperbolic("earth", periapsis=2.2 * fs.R_earth, v_inf=5 * u.km / u.s)
print(fs.flyby(pile, passage).verdict)
"""


def run(*command, cwd):
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))} ended with {done.returncode}:\n{done.stdout}{done.stderr}")
    return done.stdout


def sources():
    """Paths in the wheel of the modules in the source tree."""
    root = Path(__file__).resolve().parents[1]
    found = {p.relative_to(root / "src").as_posix() for p in (root / "src" / "flybystab").rglob("*.py")}
    return found | {f"flybystab/{p.relative_to(root).as_posix()}" for p in (root / "data").rglob("*.py")}


def main(folder):
    wheel = max(folder.glob("flybystab-*.whl"), key=lambda p: p.stat().st_mtime)
    sdist = max(folder.glob("flybystab-*.tar.gz"), key=lambda p: p.stat().st_mtime)
    with tempfile.TemporaryDirectory(prefix="flybystab smoke ") as name:
        place = Path(name)
        venv.create(place / "env", with_pip=True)
        python = place / "env" / "bin" / "python"
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", wheel, cwd=place)
        answer = json.loads(
            run(place / "env/bin/flybystab", "flyby", "Apophis", "--attitudes", 4, "--json", cwd=place)
        )
        assert answer["verdict"] == "INTACT", answer["verdict"]
        assert abs(answer["encounter"]["distance_km"] - 38011.5) < 5, answer["encounter"]
        assert run(python, "-c", FIVE_LINES, cwd=place).strip() == "RESHAPED"
        home = run(python, "-c", "import flybystab; print(flybystab.__file__)", cwd=place)
        assert str(place) in home, home
        run(
            python, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps",
            "--wheel-dir", place / "again", sdist, cwd=place,
        )  # fmt: skip
        again = next((place / "again").glob("*.whl"))
        files = [sorted(zipfile.ZipFile(w).namelist()) for w in (wheel, again)]
        assert files[0] == files[1], set(files[0]) ^ set(files[1])
        modules = {name for name in files[0] if name.endswith(".py")}
        assert modules == sources(), modules ^ sources()
    print(f"{wheel.name} answers in a clean environment; {sdist.name} makes the same {len(files[0])} files")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
