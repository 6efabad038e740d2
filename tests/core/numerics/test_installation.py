"""An installation that the user cannot write to, as one of an administrator."""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

import flybystab

#: Root may write everywhere: a process without that capability stands for a user.
USER = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search"] if os.geteuid() == 0 else []
pytestmark = pytest.mark.skipif(
    bool(USER) and shutil.which("setpriv") is None, reason="root, without setpriv to give up its rights"
)
SCRIPT = """
import os
from flybystab.core.numerics import compile_notice, jit, tensors
import numpy as np
compile_notice.install()
print(tensors.determinant(np.zeros(6)), jit.CACHE)
"""


@pytest.fixture
def installed():
    """A copy of the package without compiled kernels, which only its owner can write; and an empty home folder."""
    base = Path(tempfile.mkdtemp())  # not below a folder that is closed to others
    base.chmod(0o755)
    place = base / "site-packages"
    package = Path(flybystab.__file__).parent
    shutil.copytree(package, place / "flybystab", ignore=shutil.ignore_patterns("__pycache__"))
    home = base / "home"
    home.mkdir()
    for folder in (place, *place.rglob("*")):
        folder.chmod(0o555 if folder.is_dir() else 0o444)
    yield place, home
    for folder in (place, *place.rglob("*")):
        if folder.is_dir():
            folder.chmod(0o755)
    shutil.rmtree(base)


def answer(place, home):
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG", "FLYBYSTAB"))}
    environment |= {"HOME": str(home), "PYTHONPATH": str(place)}
    return subprocess.run(
        [*USER, sys.executable, "-c", SCRIPT], capture_output=True, text=True, env=environment, cwd="/"
    )


def test_a_package_that_cannot_be_written_keeps_its_kernels_in_the_cache_of_the_user(installed):
    place, home = installed
    first = answer(place, home)
    assert first.returncode == 0, first.stderr
    assert first.stdout.split()[1] == "True"
    assert f"kept in {home}" in first.stderr
    assert list(home.rglob("*.nbi"))
    second = answer(place, home)
    assert second.returncode == 0
    assert "compiling" not in second.stderr
    assert not list(place.rglob("__pycache__"))


def test_without_any_place_the_notice_names_the_remedy(installed):
    place, home = installed
    home.chmod(0o555)
    found = answer(place, home)
    assert found.returncode == 0, found.stderr
    assert found.stdout.split()[1] == "False"
    assert "NUMBA_CACHE_DIR" in found.stderr
