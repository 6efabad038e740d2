"""Whether a verdict depends on the yield surface, the spin phase or the friction angle."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity
from numpy.typing import NDArray

from flybystab.body.body import YIELD_SURFACES
from flybystab.errors import NotConverged
from flybystab.flybys.batch import FlybyRun
from flybystab.flybys.flyby_many import flyby_many
from flybystab.flybys.inputs import FlybyInputs
from flybystab.flybys.verdict import Verdict
from flybystab.tabular import Record
from flybystab.typing import Array
from flybystab.units import whole

#: Default number of spin phases.
PHASES = 8
#: Change of the friction angle, rad.
FRICTION = np.deg2rad(3.0)


@dataclass(frozen=True, eq=False)
class Robustness(Record):
    """Verdicts of the same encounter with one assumption changed at a time.

    Attributes
    ----------
    surface : dict of str to Verdict
        By yield surface.
    phase : Quantity (n,)
        Angles by which the body is turned about its angular momentum, deg; the first is zero.
    phase_verdict : ndarray of str (n,)
    friction_angle : Quantity (3,)
        That of the material, and 3 deg less and more (within [0, 90) deg).
    friction_verdict : ndarray of str (3,)
    """

    surface: dict[str, Verdict]
    phase: Quantity
    phase_verdict: NDArray[np.str_]
    friction_angle: Quantity
    friction_verdict: NDArray[np.str_]

    @property
    def robust(self) -> bool:
        """Whether all verdicts agree."""
        return len({*map(str, self.surface.values()), *self.phase_verdict, *self.friction_verdict}) == 1

    def __repr__(self) -> str:
        parts = [
            f"{name} {'agree' if len(set(map(str, found))) == 1 else 'differ'}"
            for name, found in (
                (f"{len(self.surface)} yield surfaces", list(self.surface.values())),
                (f"{len(self.phase)} spin phases", self.phase_verdict),
                ("friction angles +-3 deg", self.friction_verdict),
            )
        ]
        return f"<Robustness: {', '.join(parts)}>"


def surface_verdicts(inputs: FlybyInputs, run: FlybyRun, all_surfaces: bool = False) -> dict[str, Verdict]:
    """Verdicts on all yield surfaces of a body that stays rigid (or `all_surfaces`), else on its own.

    A surface on which the run cannot be followed is left out.
    """
    material = inputs.body.material
    verdicts = {material.yield_surface: run.verdict}
    yields = any(name == "onset" for name, _, _ in run.events)
    for name in () if yields and not all_surfaces else YIELD_SURFACES:
        if name not in verdicts:
            same = inputs.body.with_(material=material.with_(yield_surface=name))
            try:
                verdicts[name] = inputs._replace(body=same).run().verdict
            except NotConverged:
                continue
    return verdicts


def phases_of(value: object) -> int:
    """Number of spin phases for a value of ``robustness=``: 0 for False, 8 for True."""
    if isinstance(value, bool | np.bool_):
        return PHASES if value else 0
    return whole(value, "robustness", 1)


def robustness_of(inputs: FlybyInputs, run: FlybyRun, phases: int) -> Robustness:
    """Verdicts over all yield surfaces, `phases` spin phases and three friction angles."""
    body, material = inputs.body, inputs.body.material
    momentum = body.axes**2
    momentum = (momentum.sum() - momentum) * body.omega
    size = float(np.linalg.norm(momentum))
    axis = inputs.rotation @ (momentum / size if size > 0.0 else np.array([0.0, 0.0, 1.0]))
    # half a turn about a principal axis maps an ellipsoid onto itself
    principal = np.count_nonzero(momentum) <= 1
    angles = np.linspace(0.0, np.pi if principal else 2.0 * np.pi, phases, endpoint=False)
    phi = material.phi + np.array([-FRICTION, 0.0, FRICTION])
    phi = np.clip(phi, 0.0, np.nextafter(0.5 * np.pi, 0.0) - 1e-6)
    changed = [body.with_(material=material.with_(friction_angle=f * u.rad)) for f in phi[[0, 2]]]
    bodies = [body] * phases + changed
    start = inputs.encounter.periapsis_axes
    attitudes = [start @ _about(axis, angle) @ inputs.rotation for angle in (*angles, 0.0, 0.0)]
    table = flyby_many(
        bodies, [inputs.encounter] * len(bodies), attitudes,
        tolerance=inputs.tolerance, max_axis_ratio=inputs.max_axis_ratio, workers=1,
    )  # fmt: skip
    low, high = table.verdict[phases:]
    return Robustness(
        surface=surface_verdicts(inputs, run, all_surfaces=True),
        phase=np.rad2deg(angles) * u.deg,
        phase_verdict=table.verdict[:phases],
        friction_angle=np.rad2deg(phi) * u.deg,
        friction_verdict=np.array([low, str(run.verdict), high]),
    )


def _about(axis: Array, angle: float) -> Array:
    """Rotation matrix about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turned
