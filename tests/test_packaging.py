"""Every package of the source tree is listed for installation."""

import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_every_package_is_installed():
    listed = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"])
    source = ROOT / "src"
    found = {
        ".".join(p.parent.relative_to(source).parts) for p in (source / "flybystab").rglob("__init__.py")
    }
    assert listed - {"flybystab.data", "flybystab.data.covariances"} == found
