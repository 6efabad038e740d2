"""Summary of a result table: counts, and the encounters closest to failure."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.table import QTable

from flybystab.errors import InvalidInput
from flybystab.flybys.verdict import Verdict
from flybystab.screening.columns import VERDICTS, share_of
from flybystab.screening.results import read_results
from flybystab.typing import Document
from flybystab.units import number_of

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
    "p_intact",
    "p_not_in_equilibrium",
    "assumed",
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
    expected : dict of str to float
        Expected number of encounters of each verdict: the probabilities over the samples, summed over the sampled
        encounters.
    sampled, assumed : int
        Encounters with samples, and those of bodies with properties that are assumed, not measured.
    samples, samples_dynamic : int
        Samples drawn, and those that were integrated.
    closest : QTable
        Encounters of bodies in equilibrium with the least margin, worst first.
    strongest : QTable
        Integrated encounters of bodies in equilibrium with the largest increase of mobilised friction.
    reshaped : QTable
        Encounters in which any sample, or the catalogue body, yields.
    undecided : QTable
        Encounters of bodies that are not in equilibrium at their catalogue values but are in some samples, the largest
        probability of INTACT first.
    contributors : dict of str to int
        Inputs to which the margin is most sensitive, with the number of encounters.
    errors : dict of str to int
        Reasons of failure.
    meta : dict
        Provenance.
    """

    rows: int
    failed: int
    verdicts: dict[str, int]
    expected: dict[str, float]
    sampled: int
    assumed: int
    samples: int
    samples_dynamic: int
    closest: QTable
    strongest: QTable
    reshaped: QTable
    undecided: QTable
    contributors: dict[str, int]
    errors: dict[str, int]
    meta: Document

    @property
    def dynamic_share(self) -> float:
        """Fraction of the samples that were integrated; nan without samples."""
        return self.samples_dynamic / self.samples if self.samples else float("nan")

    def text(self) -> str:
        """A few lines for a terminal: probabilities over the samples first, then the verdicts at catalogue values."""
        lines = [number_of(self.rows, "encounter") + (f", {self.failed} not computed" if self.failed else "")]
        if not self.meta.get("complete", True):
            lines[0] += " (unfinished run)"
        if self.sampled:
            one = self.sampled == 1
            lines.append(
                "probability over the samples"
                if one
                else f"expected number over the samples ({number_of(self.sampled, 'encounter')} with samples)"
            )
            lines += [f"  {name}: {n:.3g}" for name, n in self.expected.items()]
        lines.append("at the catalogue values" + self._caveat())
        lines += [f"  {name}: {n}" for name, n in self.verdicts.items()]
        if self.samples:
            lines.append(f"{self.samples} samples, {100 * self.dynamic_share:.2g} % of them integrated")
        if self.contributors:
            most = ", ".join(f"{name} ({n})" for name, n in self.contributors.items())
            lines.append(f"margin most sensitive to (encounters): {most}")
        for title, table in (
            ("closest to failure", self.closest),
            ("largest increase in the encounter", self.strongest),
            ("may yield", self.reshaped[:TOP]),
            ("not in equilibrium at the catalogue values, but in some of the samples", self.undecided),
        ):
            if len(table):
                lines += [f"{title}:", *("  " + line for line in _lines(table))]
        lines += [f"  {n} x {reason}" for reason, n in self.errors.items()]
        return "\n".join(lines)

    def _caveat(self) -> str:
        if not self.assumed:
            return ""
        caveat = (
            f" ({self.assumed} of {number_of(self.rows, 'encounter')} with assumed properties of the body"
        )
        return caveat + (")" if self.sampled else "; --samples 100 gives probabilities)")


def _lines(table: QTable) -> list[str]:
    out = []
    for row in table:
        line = f"{row['asteroid']:>16} {row['time_tdb'][:16]} {row['planet']:>7} "
        line += f"{row['distance'].to_value(u.km):11,.0f} km "
        if np.isfinite(row["p_intact"]):
            line += f"P(intact) {row['p_intact']:.3g}; "
        line += str(row["verdict"])
        if row["verdict"] == Verdict.NOT_IN_EQUILIBRIUM:  # no margin, and no effect of the encounter
            line += f" ({row['assumed']} assumed)" if row["assumed"] else ""
        else:
            line += f", margin {row['margin'].to_value(u.deg):.2f} deg, "
            line += f"{row['friction_rise'].to_value(u.deg):.3g} deg by the encounter"
        if np.isfinite(row["p_yield"]):
            line += f", yields in {100 * row['p_yield']:.3g} % of the samples"
        out.append(line)
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
    sampled = (np.asarray(table["samples"]) > 1) & ~failed
    shares = {str(v): np.nan_to_num(np.asarray(table[share_of(v)], dtype=float)) for v in VERDICTS}
    expected = {name: float(share[sampled].sum()) for name, share in shares.items()}
    unstable = ~failed & (verdict == Verdict.NOT_IN_EQUILIBRIUM) & sampled
    likely = np.argsort(-shares[str(Verdict.INTACT)], kind="stable")
    undecided = likely[unstable[likely] & (shares[str(Verdict.INTACT)][likely] > 0.0)]
    return Summary(
        rows=len(table),
        failed=int(failed.sum()),
        verdicts={str(v): counts[v] for v in VERDICTS if counts[v]},
        expected={name: n for name, n in expected.items() if n > 0.0},
        sampled=int(sampled.sum()),
        assumed=int(np.count_nonzero(np.asarray(table["assumed"], dtype=str) != "")),
        samples=int(np.maximum(table["samples"], 0).sum()),
        samples_dynamic=int(np.maximum(table["samples_dynamic"], 0).sum()),
        closest=table[order[:closest]][list(SHORT)],
        strongest=table[loaded[:closest]][list(SHORT)],
        reshaped=table[order[touched[order]]][list(SHORT)],
        undecided=table[undecided[:closest]][list(SHORT)],
        contributors=dict(first.most_common(4)),
        errors=dict(errors.most_common(10)),
        meta=dict(table.meta),
    )
