"""Tidal tensor of the Earth at the closest approach of Apophis, from its formula and from the package.

Its eigenvalues are 2 GM/R^3 (extension) along the line to the planet and -GM/R^3 (compression) across it.
"""

import astropy.units as u
import numpy as np

import flybystab as fs
from flybystab.constants import GM_EARTH
from flybystab.core.ellipsoid.tide import tensor, tide_at

encounter = fs.Encounter.hyperbolic("earth", periapsis=38_012 * u.km, v_inf=5.841 * u.km / u.s)
out = np.zeros(6)
tide_at(*encounter.tide, 0.0, out)
package = tensor(out)

strength = GM_EARTH / 38_012e3**3
by_hand = strength * np.diag([2.0, -1.0, -1.0])
error = np.abs(package - by_hand).max() / strength

print("tide at closest approach (1/s2):")
print(package)
print(f"largest difference from GM/R^3 diag(2, -1, -1): {error:.1e} of GM/R^3")
