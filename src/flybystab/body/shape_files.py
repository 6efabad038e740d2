"""Triangle meshes from files: each format is one function in `FORMATS`; the format is detected from the content.

======  =============================================================================================
format  content
======  =============================================================================================
obj     Wavefront: ``v x y z`` and ``f i j k`` lines (numbers from 1, or from the end if negative)
ply     Stanford; read by trimesh
stl     text or binary; read by trimesh, equal corners merged
damit   DAMIT ``shape.txt``: ``nv nf``, the vertices, then for each facet a line ``3`` and a line of
        its corners (Durech, Sidorin & Kaasalainen 2010, A&A 513, A46)
tab     PDS vertex-facet table: ``nv`` (and perhaps ``nf``), numbered vertices, numbered facets
        (Neese 2004, EAR-A-5-DDR-RADARSHAPE-MODELS)
icq     implicitly connected quadrilaterals: ``q``, then six grids of ``(q + 1)^2`` vertices
        (Gaskell 2008); every quadrilateral is cut into two triangles
======  =============================================================================================
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.errors import InvalidInput, MissingExtra
from flybystab.files import read_bytes
from flybystab.typing import Array

Integers = NDArray[np.int64]
Mesh = tuple[Array, Integers]


def read_mesh(path: Path) -> Mesh:
    """Vertices ``(v, 3)`` in the unit of the file, and facets ``(f, 3)`` numbered from 0.

    Raises
    ------
    InvalidInput
        If the file is missing, too large, or in none of the formats.
    """
    data = read_bytes(path, "shape file")
    for recognised, read in FORMATS.values():
        if recognised(data):
            try:
                return read(data)
            except (ValueError, IndexError) as error:
                if isinstance(error, InvalidInput):
                    raise
                raise InvalidInput("path", path, f"a complete mesh ({error})") from None
    raise InvalidInput("path", path, f"a mesh in one of the formats {', '.join(FORMATS)}")


def write_mesh(path: Path, vertices: Array, facets: Integers, fields: Mapping[str, Quantity]) -> None:
    """Write a mesh with one number a facet and field: legacy VTK or PLY, both as text, by the suffix.

    Raises
    ------
    InvalidInput
        For another suffix, a name with spaces, or a field of another length.
    """
    writer = MESHES.get(path.suffix.lower())
    if writer is None:
        raise InvalidInput("path", path, f"a name that ends in {' or '.join(MESHES)}")
    lines = writer(vertices, facets, facet_fields(fields, len(facets)))
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def facet_fields(fields: Mapping[str, Quantity], facets: int) -> dict[str, Array]:
    """Numbers by facet, the unit appended to the name of each field.

    Raises
    ------
    InvalidInput
        For a name with spaces, or a field of another length.
    """
    values = {}
    for name, field in fields.items():
        quantity = Quantity(field)
        if len(name.split()) != 1 or quantity.shape != (facets,):
            raise InvalidInput(
                "fields", name, f"a name without spaces and {facets} values, one for each facet"
            )
        unit = quantity.unit.to_string().replace(" ", "")
        values[f"{name}_{unit}" if unit else name] = np.asarray(quantity.value)
    return values


def _vtk(vertices: Array, facets: Integers, fields: Mapping[str, Array]) -> list[str]:
    lines = ["# vtk DataFile Version 3.0", "flybystab shape, m", "ASCII", "DATASET POLYDATA"]
    lines += [f"POINTS {len(vertices)} double", *(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices)]
    lines += [f"POLYGONS {len(facets)} {4 * len(facets)}", *(f"3 {a} {b} {c}" for a, b, c in facets)]
    if fields:
        lines.append(f"CELL_DATA {len(facets)}")
    for name, values in fields.items():
        lines += [f"SCALARS {name} double 1", "LOOKUP_TABLE default", *(f"{x:.9g}" for x in values)]
    return lines


def _ply(vertices: Array, facets: Integers, fields: Mapping[str, Array]) -> list[str]:
    lines = ["ply", "format ascii 1.0", "comment flybystab shape, m", f"element vertex {len(vertices)}"]
    lines += [f"property double {x}" for x in "xyz"]
    lines += [f"element face {len(facets)}", "property list uchar int vertex_indices"]
    lines += [f"property double {name}" for name in fields]
    lines += ["end_header", *(f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices)]
    columns = np.array(list(fields.values())).reshape(len(fields), len(facets)).T
    return lines + [
        " ".join([f"3 {a} {b} {c}", *(f"{x:.9g}" for x in row)])
        for (a, b, c), row in zip(facets, columns, strict=True)
    ]


#: Formats in which a mesh is written, by suffix.
MESHES: dict[str, Callable[[Array, Integers, Mapping[str, Array]], list[str]]] = {".vtk": _vtk, ".ply": _ply}


def _lines(data: bytes) -> list[list[str]]:
    rows = (
        line.split("#")[0].replace(",", " ").split() for line in data.decode("utf-8", "replace").splitlines()
    )
    return [row for row in rows if row]


def _head(data: bytes) -> list[list[str]]:
    return _lines(data[:4096])[:4]


def _numbers(row: list[str]) -> list[float] | None:
    try:
        return [float(x.lower().replace("d", "e")) for x in row]
    except ValueError:
        return None


def _is_obj(data: bytes) -> bool:
    return any(row[0] == "v" and len(row) >= 4 for row in _lines(data[:65536]))


def _read_obj(data: bytes) -> Mesh:
    vertices: list[list[float]] = []
    facets: list[list[int]] = []
    for row in _lines(data):
        if row[0] == "v":
            vertices.append([float(x) for x in row[1:4]])
        elif row[0] == "f":
            numbers = [int(x.split("/")[0]) for x in row[1:]]
            corners = [n - 1 if n > 0 else len(vertices) + n for n in numbers]
            facets += [[corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1)]
    return _mesh(vertices, facets)


def _by_trimesh(kind: str) -> Callable[[bytes], Mesh]:
    def read(data: bytes) -> Mesh:
        try:
            import trimesh
        except ImportError:
            raise MissingExtra("trimesh", "shapes", f"reading {kind.upper()} files") from None
        mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False)
        mesh.merge_vertices()
        return _mesh(np.asarray(mesh.vertices), np.asarray(mesh.faces))

    return read


def _is_stl(data: bytes) -> bool:
    if data[:5] == b"solid" and b"facet" in data[:1024]:
        return True
    return len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")


def _counts(data: bytes) -> list[list[float] | None]:
    return [_numbers(row) for row in _head(data)]


def _is_damit(data: bytes) -> bool:
    head = _counts(data)
    return (
        len(head) > 1
        and head[0] is not None
        and len(head[0]) == 2
        and head[1] is not None
        and len(head[1]) == 3
    )


def _read_damit(data: bytes) -> Mesh:
    values = np.array([float(x) for row in _lines(data) for x in row])
    nv, nf = int(values[0]), int(values[1])
    vertices = values[2 : 2 + 3 * nv].reshape(nv, 3)
    rest = values[2 + 3 * nv :].astype(np.int64)
    if len(rest) == 4 * nf:
        rows = rest.reshape(nf, 4)
        if np.any(rows[:, 0] != 3):
            raise InvalidInput("facets", "other than triangles", "triangles, as DAMIT has them")
        facets = rows[:, 1:]
    else:
        facets = rest.reshape(nf, 3)
    return _mesh(vertices, facets - 1)


def _is_tab(data: bytes) -> bool:
    head = _counts(data)
    return (
        len(head) > 1
        and head[0] is not None
        and len(head[0]) <= 2
        and head[1] is not None
        and len(head[1]) == 4
    )


def _read_tab(data: bytes) -> Mesh:
    rows = [row for row in (_numbers(r) for r in _lines(data)) if row is not None]
    nv = int(rows[0][0])
    vertices = np.array([row[1:4] for row in rows[1 : 1 + nv]])
    numbers = [int(row[0]) for row in rows[1 : 1 + nv]]
    rest = rows[1 + nv :]
    if len(rows[0]) == 1:  # the number of facets is on a separate line
        nf, rest = int(rest[0][0]), rest[1:]
    else:
        nf = int(rows[0][1])
    facets = np.array([row[1:4] for row in rest[:nf]], dtype=np.int64) - numbers[0]
    if len(facets) != nf:
        raise ValueError(f"{len(facets)} of {nf} facets")
    return _mesh(vertices, facets)


def _is_icq(data: bytes) -> bool:
    head = _counts(data)
    if len(head) < 2 or head[0] is None or len(head[0]) != 1 or head[1] is None or len(head[1]) != 3:
        return False
    q = int(head[0][0])
    return q > 0 and len(_lines(data)) == 6 * (q + 1) ** 2 + 1


def _read_icq(data: bytes) -> Mesh:
    rows = _lines(data)
    q = int(rows[0][0])
    vertices = np.array([_numbers(row) for row in rows[1:]], dtype=float)
    facets = []
    for face in range(6):
        for i in range(q):
            for j in range(q):
                corner = face * (q + 1) ** 2 + i * (q + 1) + j
                a, b, c, d = corner, corner + 1, corner + q + 2, corner + q + 1
                facets += [[a, b, c], [a, c, d]]
    # edges of the six grids are stored twice
    extent = np.ptp(vertices, axis=0).max()
    _, first, number = np.unique(
        np.round(vertices / (1e-9 * extent)), axis=0, return_index=True, return_inverse=True
    )
    merged = number.reshape(-1)[np.array(facets)]
    whole = (merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2]) & (merged[:, 2] != merged[:, 0])
    return _mesh(vertices[first], merged[whole])


def _mesh(vertices: object, facets: object) -> Mesh:
    points, corners = np.array(vertices, dtype=float), np.array(facets, dtype=np.int64)
    if points.ndim != 2 or corners.ndim != 2 or len(corners) < 4:
        raise ValueError("no facets")
    return points, corners


#: Test and reader of each format, by its name.
FORMATS: dict[str, tuple[Callable[[bytes], bool], Callable[[bytes], Mesh]]] = {
    "ply": (lambda data: data[:3] == b"ply", _by_trimesh("ply")),
    "stl": (_is_stl, _by_trimesh("stl")),
    "obj": (_is_obj, _read_obj),
    "icq": (_is_icq, _read_icq),
    "damit": (_is_damit, _read_damit),
    "tab": (_is_tab, _read_tab),
}
