"""Orbit files of OrbFit, format OEF2.0: ESA NEOCC, NEODyS and AstDyS (``.ke0 .ke1 .eq0 .eq1``, ``neodys.cat``).

Elements: ``KEP`` a (au), e, i, node, peri, M (deg); ``EQU`` a (au), h, k, p, q, mean longitude (deg); ``COM`` q (au),
e, i, node, peri (deg), time of perihelion (MJD); ``CAR`` state with ecliptic axes (au, au/d). ``COV`` is the upper
triangle of the covariance, row by row, in the same units, m2/ton for the area-to-mass ratio and 1e-10 au/d2 for A2
(OrbFit 5.0, module ``orbit_elements``, and the description of the files at https://neo.ssa.esa.int/computer-access;
checked against the ``RMS`` lines).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from flybystab.catalogues.designations import is_comet, name_columns
from flybystab.catalogues.readers import FRAME, Contents, reader
from flybystab.catalogues.readers.conversion import CARTESIAN, COMETARY, KEPLERIAN, MJD, elements_row, number
from flybystab.catalogues.readers.covariances import covariance_of, printed_covariance
from flybystab.catalogues.readers.nongravitational import ORBFIT_AREA, nongravitational_columns
from flybystab.catalogues.readers.parameters import check_parameters
from flybystab.errors import InvalidInput

if TYPE_CHECKING:
    from flybystab.catalogues.readers import Entry
    from flybystab.orbit.covariance import Covariance

_SETS: Mapping[str, tuple[str, ...]] = {
    "KEP": KEPLERIAN,
    "EQU": ("a", "h", "k", "P", "Q", "L"),
    "COM": COMETARY,
    "CAR": CARTESIAN,
}
#: Parameters by model number, in the order of the LSP and NGR lines; other models are those of comets.
_PARAMETERS: Mapping[str, tuple[str, ...]] = {"0": (), "1": ("AMRAT", "A2")}
#: Units of these: m2/ton with the solar constant of OrbFit, 1e-10 au/d2.
_UNIT: Mapping[str, float] = {"AMRAT": ORBFIT_AREA, "A2": 1e-10}


def _is_oef(text: str) -> bool:
    return bool(re.match(r"\s*(format\s*=\s*'OEF2|(KEP|EQU|CAR|COM) )", text))


@reader(
    "OEF2.0",
    _is_oef,
    Contents(
        "Keplerian, equinoctial, cometary, cartesian",
        "full matrix",
        "AMRAT, A2",
        "H",
        files="NEOCC, NEODyS, AstDyS: `.ke0 .ke1 .eq0 .eq1`, `neodys.cat`",
    ),
)
def read_oef(text: str, file: str) -> list[Entry]:
    """The orbits in a file.

    Raises
    ------
    InvalidInput
    """
    header, _, body = text.partition("END_OF_HEADER")
    system = re.search(r"refsys\s*=\s*(\w+)\s+(\w+)", header)
    if not body or system is None or system.groups() != ("ECLM", "J2000"):
        raise InvalidInput("orbit file", file, "an OEF2.0 file with a header and refsys = ECLM J2000")
    if re.search(r"rectype\s*=\s*'1L", header):
        kind = re.search(r"elem\s*=\s*'(\w+)'", header)
        if kind is None or kind[1] != "KEP":
            raise InvalidInput("orbit file", file, "rows of Keplerian elements (elem = 'KEP')")
        lines = [line for line in body.splitlines() if line.strip() and not line.startswith("!")]
        return [_row(line, file) for line in lines]
    found = [_solution(name, lines, file) for name, lines in _blocks(body)]
    if not found:
        raise InvalidInput("orbit file", file, "an OEF2.0 file with elements (KEP, EQU, COM, CAR)")
    return found


def from_neocc(text: str, file: str) -> Entry:
    """The first orbit of an OEF2.0 file: a row, and its covariance or None."""
    return read_oef(text, file)[0]


def _blocks(body: str) -> Iterator[tuple[str, list[str]]]:
    """Name and lines of each orbit; comments are omitted except the RMS line."""
    name, lines = "", list[str]()
    for raw in body.splitlines():
        line = raw.strip()
        if line.startswith("!"):
            line = line[1:].strip() if line[1:].split()[:1] == ["RMS"] else ""
        if not line:
            continue
        if len(line.split()) <= 2 and not re.match(
            r"(KEP|EQU|COM|CAR|MJD|MAG|LSP|NGR|RMS|COV|COR|NOR)\b", line
        ):
            if lines:
                yield name, lines
            name, lines = line, []
        else:
            lines.append(line)
    if lines:
        yield name, lines


def _identity(text: str) -> dict[str, str]:
    """Name columns for a name in the form of OrbFit, without spaces: 2018VP1, 433, 2040P-L."""
    return name_columns(text.strip("' "))


def _solution(name: str, lines: Sequence[str], file: str) -> Entry:
    words: dict[str, list[str]] = {}
    for line in lines:
        key, *rest = line.split()
        words.setdefault(key, []).extend(rest)
    kinds = [k for k in _SETS if k in words]
    if len(kinds) != 1 or "MJD" not in words or len(words[kinds[0]]) != 6 or len(words["MJD"]) < 2:
        raise InvalidInput("orbit file", file, "one line of six elements and an epoch (MJD) for each object")
    day, scale = words["MJD"][:2]
    if scale not in ("TDT", "TT", "TDB"):
        raise InvalidInput("epoch", scale, f"TDT, TT or TDB in {file}")
    if any(k in words for k in ("COR", "NOR")) and "COV" not in words:
        raise InvalidInput("orbit file", file, "COV lines (not COR or NOR alone)")
    jd = number(day, "epoch", file) + MJD
    names, texts = _SETS[kinds[0]], [t.upper().replace("D", "E") for t in words[kinds[0]]]
    values = [number(t, n, file) for n, t in zip(names, texts, strict=True)]
    if "tp" in names:
        values[5] += MJD - jd
    row = _identity(name) | {"orbit_solution": "NEOCC OEF2" if kinds[0] == "KEP" else "OEF2", "frame": FRAME}
    row["orbit_source"] = f"ESA NEOCC ({file})" if kinds[0] == "KEP" else f"OrbFit {kinds[0]} ({file})"
    row |= elements_row(jd, names, texts, values)
    if "MAG" in words and number(words["MAG"][0], "MAG", file) > -9.0:
        row["H_mag"] = words["MAG"][0]
    parameters = _parameters(words, name, file)
    row |= nongravitational_columns(parameters, False, file, law="asteroid")
    covariance = _covariance(jd, names, values, words, parameters, row["orbit_source"], file)
    if covariance is None and kinds[0] != "KEP":
        covariance = printed_covariance(
            jd, names, texts, jd - MJD if "tp" in names else 0.0, row["orbit_source"]
        )
    return row, covariance


def _parameters(words: Mapping[str, Sequence[str]], name: str, file: str) -> dict[str, float]:
    """Values of the parameters of the force model by name: A2 (au/d2), AMRAT (m2/kg).

    Raises
    ------
    InvalidInput
        A model or a parameter is not supported, such as the outgassing of comets.
    """
    values = [number(v, "NGR", file) for v in words.get("NGR", [])]
    model = (words.get("LSP") or ["1" if values else "0"])[0]
    if model not in _PARAMETERS or (values and is_comet(name)):
        given = [f"model {model} of OrbFit, parameter {k + 1}" for k in range(max(len(values), 1))]
        check_parameters("OrbFit", given, file)
    labels = _PARAMETERS[model]
    if len(values) > len(labels) or (values and len(values) != len(labels)):
        check_parameters("OrbFit", [f"parameter {k + 1}" for k in range(len(labels), len(values))], file)
        raise InvalidInput("NGR", values, f"the parameters {', '.join(labels)} in {file}")
    found = dict(zip(labels, values, strict=False))
    solved = _solved(words, file)
    if any(s not in labels for s in solved):
        check_parameters("OrbFit", [s for s in solved if s not in labels], file)
    return {n: v * _UNIT[n] for n, v in found.items()}


def _solved(words: Mapping[str, Sequence[str]], file: str) -> list[str]:
    """Names of the parameters estimated together with the elements (end of the LSP line)."""
    lsp = words.get("LSP", [])
    labels = _PARAMETERS.get(lsp[0], ()) if lsp else ()
    out = []
    for text in lsp[3:]:
        k = int(number(text, "LSP", file))
        out.append(labels[k - 1] if 1 <= k <= len(labels) else f"parameter {text}")
    return out


def _covariance(
    jd: float,
    names: Sequence[str],
    values: Sequence[float],
    words: Mapping[str, Sequence[str]],
    parameters: Mapping[str, float],
    source: str,
    file: str,
) -> Covariance | None:
    if "COV" not in words:
        return None
    solved = _solved(words, file)
    n = 6 + len(solved)
    upper = [number(c, "COV", file) for c in words["COV"]]
    expected = "COV lines that agree with the LSP and RMS lines"
    if len(upper) != n * (n + 1) // 2:
        raise InvalidInput("orbit file", file, f"{expected} ({n * (n + 1) // 2} numbers, not {len(upper)})")
    matrix = np.zeros((n, n))
    matrix[np.triu_indices(n)] = upper
    matrix += np.triu(matrix, 1).T
    if np.any(np.diag(matrix) < 0.0):
        raise InvalidInput("orbit file", file, f"{expected}, with variances of zero or more")
    rms = [number(c, "RMS", file) for c in words.get("RMS", [])] or np.sqrt(np.diag(matrix))
    if len(rms) != n or not np.allclose(np.sqrt(np.diag(matrix)), rms, rtol=1e-4):
        raise InvalidInput("orbit file", file, expected)
    scale = np.array([1.0] * 6 + [_UNIT[s] for s in solved])
    all_values = [*values, *(parameters[s] for s in solved)]
    return covariance_of(jd, [*names, *solved], all_values, matrix * np.outer(scale, scale), source, file)


def _row(line: str, file: str) -> Entry:
    """The orbit in a one-line record: name, MJD, six elements, H, G and a flag."""
    cells = line.split()
    if len(cells) < 8:
        raise InvalidInput("row", line[:60], f"a name, an epoch and six elements in {file}")
    if len(cells) > 10 and cells[10] not in ("0", "0.0"):
        check_parameters("OrbFit", ["parameters of the force model, which this file does not give"], file)
    jd = number(cells[1], "epoch", file) + MJD
    row = _identity(cells[0]) | elements_row(jd, KEPLERIAN, cells[2:8], ())
    if len(cells) > 8 and number(cells[8], "H", file) > -9.0:
        row["H_mag"] = cells[8]
    source = f"OrbFit ({file})"
    return row | {"frame": FRAME, "orbit_source": source}, printed_covariance(
        jd, KEPLERIAN, cells[2:8], 0.0, source
    )
