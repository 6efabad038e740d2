"""The summary of a result table."""

import astropy.units as u
import pytest
from astropy.table import QTable

from flybystab.errors import InvalidInput
from flybystab.plots.screening import results_figure
from flybystab.screening.columns import COLUMNS, VERDICTS, share_of
from flybystab.screening.results import table_of
from flybystab.screening.summary import summary
from flybystab.screening.table_files import write_rows

ROWS = [
    {"asteroid": "calm", "verdict": "INTACT", "margin": 12.0, "p_yield": 0.0, "samples": 10},
    {"asteroid": "tight", "verdict": "INTACT", "margin": 0.5, "p_yield": 0.0, "samples": 10},
    {"asteroid": "soft", "verdict": "RESHAPED", "margin": -3.0, "p_yield": 0.4, "samples": 10},
    {"asteroid": "spun", "verdict": "NOT IN EQUILIBRIUM", "margin": -20.0, "samples": 0},
    {"asteroid": "lost", "verdict": "", "error": "NotConverged: x"},
]
for row, n in zip(ROWS, (0, 5, 10, 0, 0), strict=True):
    row |= {"contributors": "friction angle +0.99, size -0.10" if row.get("samples") else ""}
    row |= {"decided_by": "dynamics" if row.get("margin", 9) < 9 else "bound"}
    row |= {"samples_dynamic": n, "friction_rise": 0.1 * n}
for k, row in enumerate(ROWS):
    row |= {"planet": "earth", "time_tdb": "2029-04-13T21:46:00", "distance": 0.001 * (k + 1), "v_inf": 6.0}
    row |= {share_of(v): float(row["verdict"] == v) for v in VERDICTS}


def test_summary_counts_and_ranks(tmp_path):
    s = summary(table_of(ROWS, COLUMNS, {"complete": False}), closest=2)
    assert (s.rows, s.failed) == (5, 1)
    assert s.verdicts == {"INTACT": 2, "RESHAPED": 1, "NOT IN EQUILIBRIUM": 1}
    assert list(s.closest["asteroid"]) == ["soft", "tight"]
    assert list(s.reshaped["asteroid"]) == ["soft"]
    assert [str(n) for n in s.strongest["asteroid"]] == ["soft", "tight"]
    assert s.dynamic_share == pytest.approx(0.5)
    assert s.errors == {"NotConverged: x": 1}
    assert s.contributors == {"friction angle": 3}
    text = s.text()
    assert "most sensitive to (encounters): friction angle (3)" in text
    assert "unfinished" in text
    assert "margin -3.00 deg, 1 deg by the encounter, yields in 40 % of the samples" in text


def test_probabilities_come_before_the_catalogue_values():
    row = ROWS[3] | {"samples": 50, "p_intact": 0.6, "p_not_in_equilibrium": 0.4, "p_yield": 0.0}
    row |= {"margin": -float("inf"), "friction_rise": float("nan"), "assumed": "density, spin period"}
    s = summary(table_of([row], COLUMNS, {}))
    assert s.expected == {"INTACT": 0.6, "NOT IN EQUILIBRIUM": 0.4}
    lines = s.text().splitlines()
    assert lines[:3] == ["1 encounter", "probability over the samples", "  INTACT: 0.6"]
    assert lines[4] == "at the catalogue values (1 of 1 encounter with assumed properties of the body)"
    assert lines[5] == "  NOT IN EQUILIBRIUM: 1"
    assert "P(intact) 0.6; NOT IN EQUILIBRIUM (density, spin period assumed)" in s.text()
    assert "inf" not in s.text()
    assert "nan" not in s.text()


def test_summary_without_samples_says_how_to_get_probabilities():
    row = ROWS[0] | {"samples": 0, "assumed": "density"}
    s = summary(table_of([row], COLUMNS, {}))
    assert s.expected == {}
    assert (
        "1 of 1 encounter with assumed properties of the body; --samples 100 gives probabilities" in s.text()
    )


def test_summary_of_a_file_and_its_figure(tmp_path):
    write_rows(ROWS, tmp_path / "x.ecsv", COLUMNS, {"title": "t"})
    assert summary(tmp_path / "x.ecsv").rows == 5
    assert results_figure(tmp_path / "x.ecsv", tmp_path / "x.png").read_bytes()[:4] == b"\x89PNG"
    with pytest.raises(InvalidInput, match="columns"):
        summary(QTable({"a": [1] * u.m}))
    assert summary(table_of([], COLUMNS, {})).rows == 0
