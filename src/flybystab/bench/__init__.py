"""Benchmarks as commands: error against time.

A benchmark is a module with ``rows(figure)``, which measures, draws the figure if a path is given and returns
dictionaries with units in their keys, and ``lines(rows)``, the table as text. A new one is one new module and one new
entry.
"""

from __future__ import annotations

#: Benchmarks by name (module of this package) with a description.
BENCHES = {
    "flyby": "integrators of one flyby",
    "many": "rate of many encounters by threads",
    "screen": "bound and dynamics of a screening",
    "grains": "piles of grains: cost, numerical error, reference data",
    "start": "first command on a fresh machine: compilation by kernel",
    "sky": "close approaches against JPL, search against ASSIST",
}
