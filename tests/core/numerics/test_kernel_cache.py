"""Kernels on disk are recompiled if a source of any kernel that they call has changed."""

import ast
import os
import subprocess
import sys

import pytest

from flybystab.core.numerics import kernel_cache
from flybystab.core.numerics.kernel_cache import ROOT, imports, sources

COMPILED = {k: v for k, v in os.environ.items() if k not in ("NUMBA_DISABLE_JIT", "FLYBYSTAB_KERNELS")}


def imported(file):
    """The same by Python's own parser."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{a.name}" for a in node.names}
    found = {kernel_cache._file(n) for n in names if n.split(".")[0] == ROOT.name}
    return found - {None}


def test_imports_are_those_that_python_reads():
    # a line of a docstring may look like an import: one file too many does no harm
    for file in ROOT.rglob("*.py"):
        assert imported(file) <= imports(file), file


def test_sources_reach_through_other_files():
    found = {f.name for f in sources(ROOT / "core" / "dynamics" / "run.py")}
    assert {"run.py", "potential.py", "constants.py", "jit.py"} <= found
    assert not any("cli" in f.parts for f in sources(ROOT / "core" / "dynamics" / "run.py"))


def small_package(folder):
    """A package of that name with one kernel that calls another; a script that calls it and counts what is loaded."""
    package = folder / "flybystab"
    (package / "core" / "numerics").mkdir(parents=True)
    for name in ("core/numerics/kernel_cache.py", "core/numerics/jit.py"):
        (package / name).write_bytes((ROOT / name).read_bytes())
    (package / "__init__.py").touch()
    (package / "core/__init__.py").touch()
    (package / "core/numerics/__init__.py").touch()
    (package / "values.py").write_text("FACTOR = 2.0\n")
    (package / "inner.py").write_text(
        "from flybystab.core.numerics.jit import kernel\nfrom flybystab.values import FACTOR\n\n"
        "@kernel\ndef inner(x):\n    return FACTOR * x\n"
    )
    (package / "outer.py").write_text(
        "from flybystab.core.numerics.jit import kernel\nfrom flybystab.inner import inner\n\n"
        "@kernel\ndef outer(x):\n    return inner(x) + 1.0\n"
    )
    script = "from flybystab.outer import outer; print(outer(10.0), sum(outer.stats.cache_hits.values()))"

    def run(**environment):
        done = subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            text=True,
            cwd=folder,
            env=COMPILED | environment,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    return package, run


def test_a_changed_callee_is_seen(tmp_path):
    """A caller that did not change answers with the new code of what it calls, and is cached where nothing changed."""
    package, run = small_package(tmp_path)
    assert run() == ["21.0", "0"]
    assert run() == ["21.0", "1"]
    (package / "values.py").write_text("FACTOR = 3.0\n")
    assert run() == ["31.0", "0"]


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_files_are_compiled_anew(tmp_path, suffix):
    """Cut off anywhere, empty, or with other bytes at the start: the right number, and then the cache again."""
    _, run = small_package(tmp_path)
    assert run() == ["21.0", "0"]
    (file,) = tmp_path.rglob(f"outer*.{suffix}")
    whole = file.read_bytes()
    for text in (
        b"",
        whole[:1],
        whole[:20],
        whole[: len(whole) // 2],
        whole[:-1],
        b"\n\x00" + whole,
        whole[60:],
    ):
        file.write_bytes(text)
        assert run() == ["21.0", "0"], text[:20]
        assert run() == ["21.0", "1"]


def test_installations_share_a_folder(tmp_path):
    """Kernels are found by their sources wherever these are; not with other sources or for another processor."""
    (_, one), (package, two) = small_package(tmp_path / "one"), small_package(tmp_path / "two")
    shared = {"FLYBYSTAB_KERNELS": str(tmp_path / "kernels")}
    assert one(**shared) == ["21.0", "0"]
    assert two(**shared) == ["21.0", "1"]
    assert not list((tmp_path / "two").rglob("*.nbi"))
    generic = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
    assert two(**shared, **generic) == ["21.0", "0"]
    assert one(**shared, **generic) == ["21.0", "1"]  # both kinds lie beside each other
    assert one(**shared) == ["21.0", "1"]
    (package / "values.py").write_text("FACTOR = 3.0\n")
    assert two(**shared) == ["31.0", "0"]
    assert one(**shared) == ["21.0", "1"]


def test_old_versions_in_a_shared_folder_are_removed(tmp_path):
    package, run = small_package(tmp_path)
    shared = {"FLYBYSTAB_KERNELS": str(tmp_path / "kernels")}
    source = package / "core/numerics/kernel_cache.py"
    text = source.read_text()
    assert f"KEPT = {kernel_cache.KEPT}\n" in text
    source.write_text(text.replace(f"KEPT = {kernel_cache.KEPT}\n", "KEPT = 1\n"))
    for factor in range(2):
        (package / "values.py").write_text(f"FACTOR = {factor}.0\n")
        assert run(**shared) == [f"{10 * factor + 1}.0", "0"]
    assert len(list((tmp_path / "kernels" / "outer").iterdir())) == 1
    assert run(**shared)[1] == "1"


def test_an_index_that_names_a_class_no_longer_there_is_out_of_date(tmp_path):
    """The signature of a kernel on disk holds the classes of its arguments; an update may have renamed one."""
    package = tmp_path / "flybystab"
    (package / "core" / "numerics").mkdir(parents=True)
    for name in ("core/numerics/kernel_cache.py", "core/numerics/jit.py"):
        (package / name).write_bytes((ROOT / name).read_bytes())
    for name in ("__init__.py", "core/__init__.py", "core/numerics/__init__.py"):
        (package / name).touch()
    source = (
        "from typing import NamedTuple\nfrom flybystab.core.numerics.jit import kernel\n\n"
        "class Pair(NamedTuple):\n    a: float\n    b: float\n\n"
        "@kernel\ndef total(p):\n    return p.a + p.b\n\nVALUE = total(Pair(1.0, 2.0))\n"
    )
    # the kernel of a user, whose own file does not change
    (tmp_path / "script.py").write_text(
        "from numba import njit\nfrom flybystab import sums\n\n"
        "@njit(cache=True)\ndef difference(p):\n    return p.a - p.b\n\n"
        "print(sums.VALUE + difference(sums.PAIR))\n"
    )
    source += "PAIR = Pair(2.0, 2.0)\n"
    for text in (source, source.replace("Pair", "Couple")):
        (package / "sums.py").write_text(text)
        done = subprocess.run(
            [sys.executable, "-c", "import script"],
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=COMPILED,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip() == "3.0"
