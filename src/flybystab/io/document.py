"""Results as JSON documents (:mod:`flybystab.flybys.document`), for which :mod:`flybystab.io.schema` has schemas."""

from __future__ import annotations

from flybystab.flybys.document import (
    encounter_document,
    flyby_document,
    plain,
    sample_document,
    table_document,
)

__all__ = ["encounter_document", "flyby_document", "plain", "sample_document", "table_document"]
