"""Readers of physical parameters of asteroids, one module per publisher; the format is detected from the content.

A module registers its function with :func:`physical_reader`; adding a format means adding a module.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from flybystab.catalogues.readers import decoded
from flybystab.catalogues.registry import Formats
from flybystab.catalogues.spin_solutions import SpinSolution, solution_columns
from flybystab.errors import InvalidInput
from flybystab.files import read_bytes

if TYPE_CHECKING:
    from flybystab.catalogues.asteroid import Asteroid


@dataclass(frozen=True)
class PhysicalData:
    """Physical parameters of one body.

    Attributes
    ----------
    names : tuple of str
        Number, name and designation, as far as the file gives them; empty if it does not name its body.
    row : mapping of str to str
        Catalogue columns, including those of the sources.
    spins : tuple of SpinSolution
        Spin solutions; several are alternatives.
    """

    names: tuple[str, ...]
    row: Mapping[str, str]
    spins: tuple[SpinSolution, ...] = ()


@dataclass(frozen=True)
class PhysicalReader:
    """A file format.

    Attributes
    ----------
    name : str
    identify : callable
        Whether a text has this format; must not raise.
    read : callable
        Returns the bodies in a text; the second argument is the name of the file.
    physical, spin : str
        Parameters that are read, for the table in ``docs/inputs.md``.
    """

    name: str
    identify: Callable[[str], bool]
    read: Callable[[str, str], list[PhysicalData]]
    physical: str
    spin: str


#: The formats, in the order in which they are tried.
PHYSICAL_READERS: Formats[PhysicalReader] = Formats(__name__)

_Read = Callable[[str, str], list[PhysicalData]]


def physical_reader(
    name: str, identify: Callable[[str], bool], physical: str, spin: str
) -> Callable[[_Read], _Read]:
    """Register the decorated function as the reader of a format."""

    def register(read: _Read) -> _Read:
        PHYSICAL_READERS.add(PhysicalReader(name, identify, read, physical, spin))
        return read

    return register


def read_physical(path: str | Path) -> list[PhysicalData]:
    """The bodies of a file of physical parameters; gzipped files are decompressed.

    Raises
    ------
    InvalidInput
        The file cannot be read, or has no known format.
    """
    raw = read_bytes(path, "file of physical parameters")
    text = decoded(raw, "file of physical parameters", path)
    found = PHYSICAL_READERS.of(text)
    if found is None:
        known = ", ".join(PHYSICAL_READERS.names)
        raise InvalidInput("file of physical parameters", path, f"a file of one of: {known}")
    return found.read(text, Path(path).name)


def with_physical(asteroid: Asteroid, *paths: str | Path) -> Asteroid:
    """An asteroid with its physical parameters replaced by those of files.

    A file without names is assumed to describe this asteroid; from a table, the rows with one of its names are used.
    Values in later files replace those in earlier ones, except spin solutions, which are all kept as alternatives. A
    new diameter scales known semi-axes.

    Raises
    ------
    InvalidInput
        A file does not contain this asteroid.
    """
    from flybystab.catalogues.record import key_of

    keys = {key_of(name) for name in asteroid.names}
    given: dict[str, str] = {}
    spins: list[SpinSolution] = []
    for path in paths:
        bodies = read_physical(path)
        mine = [b for b in bodies if not b.names or keys & {key_of(n) for n in b.names}]
        if not mine:
            shown = ", ".join(b.names[0] for b in bodies[:5]) or "none"
            raise InvalidInput(
                "file of physical parameters", path, f"data of {asteroid.label}; it has: {shown}"
            )
        for body in mine:
            given |= {c: v for c, v in body.row.items() if v}
            spins += body.spins
    row = dict(asteroid.row) | body_of(asteroid, given)
    if spins:
        row |= solution_columns(spins)
        row["spin_state"] = given.get("spin_state") or row["spin_state"]
    own = {c for c in row if row[c] != asteroid.row.get(c)}
    row["assumed"] = ";".join(c for c in asteroid.assumed if c not in own)
    return replace(asteroid, row=row)


def body_of(asteroid: Asteroid, given: Mapping[str, str]) -> dict[str, str]:
    """Columns for new values of a body: known semi-axes are scaled to a new diameter, errors of old values removed."""
    from flybystab.catalogues.record import SHAPE

    out = dict(given)
    if "diameter_m" in out:
        out.setdefault("diameter_sigma_m", "")
    if "density_kg_m3" in out:
        out.setdefault("density_sigma_kg_m3", "")
        out["density_assumed"] = "false"
    if all(c in out for c in SHAPE):
        axes = [float(out[c]) for c in SHAPE]
        out.setdefault("diameter_m", repr(2.0 * (axes[0] * axes[1] * axes[2]) ** (1.0 / 3.0)))
        return out | {"shape_kind": "measured"}
    if "diameter_m" in out and asteroid.knows(*SHAPE):
        axes = asteroid.semi_axes.value.tolist()
        factor = 0.5 * float(out["diameter_m"]) / (axes[0] * axes[1] * axes[2]) ** (1.0 / 3.0)
        out |= {c: repr(x * factor) for c, x in zip(SHAPE, axes, strict=True)}
    return out


def source_of(publisher: str, items: Sequence[Mapping[str, object]], file: str) -> str:
    """Text for the source of a value: publisher, references (``shortbib``) and file."""
    refs = ", ".join(str(x.get("shortbib")) for x in items if x.get("shortbib"))
    return f"{publisher}: {refs} ({file})" if refs else f"{publisher} ({file})"
