"""Parameters of the material in a run, as slots of the parameter array (:mod:`flybystab.core.dynamics.state`)."""

from __future__ import annotations

from flybystab.core.numerics.jit import code

SURFACE = 0  # code of the yield surface
SIN_PHI = 1
COS_PHI = 2
BETA = 3  # dilatancy beta (not beta over k); 1 where NORMAL is on
COHESION = 4  # 5 Y/rho0 in units of a0^2 pi G rho0
VISCOSITY = 5  # 5 (2 mu)/rho0 in units of a0^2 sqrt(pi G rho0), FLUID only
EXPANSION = 6  # V/V0 at which dilation has ended
NORMAL = 13  # 1: associative flow on a slope k(theta), the true normal; 0: D along the stress deviator
PART = 14  # which part of the yield section the stress is on, see the codes below
BESIDE = 15  # angle past the normal of a Mohr-Coulomb face, rad, up to which a corner keeps the stress

# Where the stress is on the hexagon of Mohr-Coulomb in associative flow; SMOOTH on any other section.
SMOOTH = code(0)
EXTENSION_CORNER = code(1)
COMPRESSION_CORNER = code(2)
FACE = code(3)
