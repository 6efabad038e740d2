"""Failure distance of a granular sphere in a slowly increasing tide, as a function of the friction angle.

Comparison of the closed form d/Rp (rho/rho_p)^(1/3) = [(3 - sin phi)/(2 sin phi)]^(1/3) (Holsapple & Michel 2006) with
the onset of yield in the dynamics.
"""

import numpy as np

from flybystab.constants import G
from flybystab.core.dynamics.run import LIMITS, body_state, integrate
from flybystab.core.ellipsoid.tide import tide_panels

RHO = 2000.0
rate = np.sqrt(np.pi * G * RHO)
worst = 0.0
print("phi (deg)  closed form  dynamics")
for phi in (10, 20, 30, 40, 50):
    sine = np.sin(np.deg2rad(phi))
    distance = ((3.0 - sine) / (2.0 * sine)) ** (1.0 / 3.0)
    strength = 4.0 / 3.0 / distance**3 * rate**2  # GM/R^3 at failure
    span = 2000.0 / rate

    def ramp(t, strength=strength, span=span):
        x = 2.0 * strength * t / span
        return np.stack([2 * x, -x, -x, 0 * x, 0 * x, 0 * x], axis=-1)

    tide, _ = tide_panels(ramp, 0.0, span, span, width=0.2)
    body = body_state(np.full(3, 500.0), RHO, np.zeros(3), np.eye(3), np.deg2rad(phi))
    run = integrate(body, (0.0, span), tide, limits=LIMITS._replace(tolerance=1e-10))
    onset = run.events[0][1]
    found = (4.0 / 3.0 * rate**2 / (2.0 * strength * onset / span)) ** (1.0 / 3.0)
    worst = max(worst, abs(found / distance - 1.0))
    print(f"{phi:9d}  {distance:11.4f}  {found:8.4f}")
print(f"largest relative difference {worst:.1e}")
