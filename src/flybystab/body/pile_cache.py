"""Cache of settled piles on disk, named by a digest of their inputs."""

from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from flybystab.core.grains.simulation import Simulation
from flybystab.files import replace_file
from flybystab.typing import Array

#: Version of the method by which piles are made: piles of other versions are not read.
RECIPE = 1
_STORED = ("x", "v", "w", "radius", "mass", "first", "other", "spring", "touching")


def cache_folder() -> Path:
    """Folder of the stored piles: ``$FLYBYSTAB_CACHE``, or ``flybystab`` in the user's cache folder."""
    own = os.environ.get("FLYBYSTAB_CACHE")
    if own:
        return Path(own) / "piles"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "flybystab" / "piles"


def stored_pile(inputs: Mapping[str, ArrayLike], make: Callable[[], Simulation]) -> dict[str, Array]:
    """The arrays of a settled pile, read from disk if they are stored there and intact.

    Parameters
    ----------
    inputs : dict
        Quantities that determine the pile: numbers, arrays of numbers or strings; among them `grains`, their number.
    make : callable
        Makes the pile if it is not stored.
    """
    plain = {
        k: v if isinstance(v, str) else [round(float(x), 9) for x in np.atleast_1d(v)]
        for k, v in inputs.items()
    }
    key = hashlib.sha256(json.dumps([RECIPE, plain], sort_keys=True).encode()).hexdigest()[:32]
    path = cache_folder() / f"{key}.npz"
    n = int(np.asarray(inputs["grains"]))
    try:
        with np.load(path, allow_pickle=False) as stored:
            found = {k: stored[k] for k in _STORED}
        if found["x"].shape == (n, 3) and all(np.all(np.isfinite(a)) for a in found.values()):
            return found
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        pass
    arrays = arrays_of(make())
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        content = io.BytesIO()
        np.savez(content, **arrays)  # type: ignore[arg-type]
        replace_file(path, content.getvalue())
    except OSError:  # without a cache the pile is recomputed at every use
        pass
    return arrays


def arrays_of(sim: Simulation) -> dict[str, Array]:
    """Grains and contacts of a simulation as they are stored."""
    p, last = sim.pairs, sim.pairs.first[-1]
    return {
        **sim.grains._asdict(),
        "first": p.first,
        "other": p.other[:last],
        "spring": p.spring[:last],
        "touching": p.touching[:last],
    }
