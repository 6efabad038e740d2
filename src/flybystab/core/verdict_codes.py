"""Integer codes of verdicts in the kernels; :mod:`flybystab.flybys.verdict` names them."""

from __future__ import annotations

from flybystab.core.numerics.jit import code

#: Not decided, or not computed.
FAILED = code(0)
INTACT = code(1)
#: Yielded and ended inside the model: its class follows from its bound mass fraction.
FLOWED = code(2)
IMPACT = code(5)
BEYOND_MODEL = code(6)
NOT_IN_EQUILIBRIUM = code(7)
