"""Change of the spin of Apophis by the encounter of 13 April 2029, for 256 tumbling phases.

Benson et al. (2023) predict that the effective spin rate may be halved or doubled and the pole rotate by 10 deg or
more.
"""

import numpy as np
from astropy.time import Time

import flybystab as fs

apophis = fs.Asteroid.from_catalogue("Apophis")
encounter = fs.Encounter.from_orbit(apophis.orbit, "earth", Time("2029-04-13", scale="tdb"))
sample = fs.spin_sample(apophis, encounter, n=256)

slowest, fastest = sample.spin_ratio.min(), sample.spin_ratio.max()
moved = float(np.mean(sample.pole_change.value > 10))
print(f"spin rate times {slowest:.2f} to {fastest:.2f}; pole rotates by more than 10 deg in {moved:.0%}")
print(
    f"friction mobilised at most {sample.max_required_friction_angle.max():.2f}: {set(sample.verdict.tolist())}"
)
