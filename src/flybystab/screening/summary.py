"""Summary of a result table: counts, and the encounters closest to failure."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.errors import InvalidInput
from flybystab.flybys.verdict import Verdict
from flybystab.screening.columns import VERDICTS
from flybystab.screening.results import read_results

#: Rows of a list in the text.
TOP = 20
#: Columns of the short lists.
SHORT = (
    "asteroid",
    "planet",
    "time_tdb",
    "distance",
    "v_inf",
    "verdict",
    "margin",
    "friction_rise",
    "p_yield",
)


@dataclass(frozen=True)
class Summary:
    """Summary of a result table.

    Attributes
    ----------
    rows, failed : int
        Encounters, and those that could not be computed.
    verdicts : dict of str to int
        Encounters by the verdict on the catalogue body.
    samples, samples_dynamic : int
        Samples drawn, and those that needed the dynamics.
    closest : QTable
        Encounters of bodies in equilibrium with the least margin, worst first.
    strongest : QTable
        Integrated encounters of bodies in equilibrium with the largest increase of mobilised friction.
    reshaped : QTable
        Encounters in which any sample, or the catalogue body, yields.
    contributors : dict of str to int
        Inputs to which the margin is most sensitive, with the number of passages.
    errors : dict of str to int
        Reasons of failure.
    meta : dict
        Provenance.
    """

    rows: int
    failed: int
    verdicts: dict[str, int]
    samples: int
    samples_dynamic: int
    closest: QTable
    strongest: QTable
    reshaped: QTable
    contributors: dict[str, int]
    errors: dict[str, int]
    meta: dict[str, Any]

    @property
    def dynamic_share(self) -> float:
        """Fraction of the samples that were integrated; nan without samples."""
        return self.samples_dynamic / self.samples if self.samples else float("nan")

    def text(self) -> str:
        """A few lines for a terminal."""
        lines = [
            f"{self.rows} encounter{'s' * (self.rows != 1)}"
            + (f", {self.failed} not computed" if self.failed else "")
        ]
        if not self.meta.get("complete", True):
            lines[0] += " (unfinished run)"
        lines += [f"  {name}: {n}" for name, n in self.verdicts.items()]
        if self.samples:
            lines.append(f"{self.samples} samples, {100 * self.dynamic_share:.2g} % of them by the dynamics")
        if self.contributors:
            most = ", ".join(f"{name} ({n})" for name, n in self.contributors.items())
            lines.append(f"margin most sensitive to (passages): {most}")
        for title, table in (
            ("closest to failure", self.closest),
            ("largest increase by the passage", self.strongest),
            ("may yield", self.reshaped[:TOP]),
        ):
            if len(table):
                lines += [f"{title}:", *("  " + line for line in _lines(table))]
        lines += [f"  {n} x {reason}" for reason, n in self.errors.items()]
        return "\n".join(lines)


def _lines(table: QTable) -> list[str]:
    out = []
    for row in table:
        p = f", yields in {100 * row['p_yield']:.3g} % of the samples" if np.isfinite(row["p_yield"]) else ""
        out.append(
            f"{row['asteroid']:>16} {row['time_tdb'][:16]} {row['planet']:>7} "
            f"{row['distance'].to_value(u.km):11,.0f} km {row['verdict']}, "
            f"margin {row['margin'].to_value(u.deg):.2f} deg, "
            f"{row['friction_rise'].to_value(u.deg):.3g} deg by the passage{p}"
        )
    return out


def summary(results: QTable | str | Path, closest: int = 10) -> Summary:
    """Summary of a result table or file.

    Raises
    ------
    InvalidInput
        The file cannot be read, or is no table of encounters.
    """
    table = results if isinstance(results, QTable) else read_results(results)
    missing = [c for c in (*SHORT, "decided_by", "samples", "error") if c not in table.colnames]
    if missing:
        raise InvalidInput("result table", ", ".join(table.colnames[:5]), f"one with the columns {missing}")
    verdict = np.asarray(table["verdict"], dtype=str)
    failed = verdict == ""
    stands = ~failed & (verdict != Verdict.NOT_IN_EQUILIBRIUM)
    margin = np.asarray(table["margin"].to_value(u.deg))
    yields = np.nan_to_num(np.asarray(table["p_yield"], dtype=float))
    order = np.lexsort((margin, -yields))
    order = order[stands[order]]
    rise = np.nan_to_num(np.asarray(table["friction_rise"].to_value(u.deg)), posinf=1e9)
    loaded = np.argsort(-rise, kind="stable")
    computed = np.asarray(table["decided_by"], dtype=str) == "dynamics"  # not upper limits
    loaded = loaded[(stands & computed)[loaded]]
    touched = stands & ((verdict != Verdict.INTACT) | (yields > 0.0))
    counts = Counter(verdict[~failed])
    first = (
        Counter(str(c).split(", ")[0].rpartition(" ")[0] for c in table["contributors"] if c)
        if "contributors" in table.colnames
        else Counter()
    )
    errors = Counter(e for e in np.asarray(table["error"], dtype=str) if e)
    return Summary(
        rows=len(table),
        failed=int(failed.sum()),
        verdicts={str(v): counts[v] for v in VERDICTS if counts[v]},
        samples=int(np.maximum(table["samples"], 0).sum()),
        samples_dynamic=int(np.maximum(table["samples_dynamic"], 0).sum()),
        closest=table[order[:closest]][list(SHORT)],
        strongest=table[loaded[:closest]][list(SHORT)],
        reshaped=table[order[touched[order]]][list(SHORT)],
        contributors=dict(first.most_common(4)),
        errors=dict(errors.most_common(10)),
        meta=dict(table.meta),
    )
