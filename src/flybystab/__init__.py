"""flybystab: do rubble-pile asteroids survive their close planetary encounters?"""

from __future__ import annotations

__version__ = "0.1.0"
