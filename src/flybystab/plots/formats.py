"""File formats of figures and animations, by suffix."""

from __future__ import annotations

FIGURES = (".png", ".pdf", ".svg")
FILMS = (".gif", ".mp4")
