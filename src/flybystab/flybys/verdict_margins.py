"""Margins of a verdict: the distances from the thresholds at which it would change."""

from __future__ import annotations

from dataclasses import dataclass

import astropy.units as u
import numpy as np
from astropy.units import Quantity

from flybystab.errors import NotConverged
from flybystab.flybys.batch import FlybyRun
from flybystab.flybys.history import axes_of
from flybystab.flybys.inputs import FlybyInputs
from flybystab.flybys.verdict import Verdict, bound_fraction_upper, mass_edges
from flybystab.tabular import Record

#: A run that passes the largest axis ratio is followed to this multiple of it, to find the largest ratio it reaches.
FOLLOWED = 5.0
#: Rows of history of the run that is followed further.
ROWS = 20_000


@dataclass(frozen=True, repr=False)
class VerdictMargins(Record):
    """Distances of a verdict from its edges. A verdict is unreliable where `nearest` is small.

    Attributes
    ----------
    friction_angle : Quantity
        Friction angle less the largest required one, deg: the threshold of INTACT.
    axis_ratio : float
        Largest ``a1/a3`` during the encounter. A body that passes `limit` is followed beyond it, to five times the
        limit, with the homogeneous model extrapolated beyond its range, to determine whether the elongation stops.
        Infinite if the run cannot be followed.
    limit : float
        Axis ratio beyond which the verdict is BEYOND MODEL.
    strain : float
        Largest ``|ln(a_i/a_i(0))|`` of the three axes until the run ends (at `limit` at the latest).
    bound_fraction : float
        Bound mass fraction of the verdict, in the potential of the bound material.
    bound_fraction_upper : float
        The same in the potential of the whole body.
    relative : dict of str to float
        Relative distance from each edge that applies to the verdict: ``"friction"`` (over the friction angle),
        ``"axis ratio"`` (``1 - axis_ratio/limit``), ``"bound fraction"`` (to the nearest edge of a class).
        Negative beyond the edge.
    """

    friction_angle: Quantity
    axis_ratio: float
    limit: float
    strain: float
    bound_fraction: float
    bound_fraction_upper: float
    relative: dict[str, float]

    @property
    def nearest(self) -> tuple[str, float]:
        """The edge at the smallest relative distance, and that distance (absolute value)."""
        name = min(self.relative, key=lambda k: abs(self.relative[k]))
        return name, abs(self.relative[name])


def verdict_margins(inputs: FlybyInputs, run: FlybyRun) -> VerdictMargins:
    """Margins of the verdict of a run."""
    body = inputs.body
    phi, bound = body.material.phi, float(run.bound)
    start = float(body.axes[0] / body.axes[2])
    limit = max(inputs.max_axis_ratio, 1.001 * start)  # the kernel's limit of bodies that begin beyond it
    ratio, strain = start, 0.0
    if run.verdict not in (Verdict.INTACT, Verdict.NOT_IN_EQUILIBRIUM):
        ratio, strain = _course(inputs, limit, run)
    relative = {"friction": (phi - run.friction) / phi if phi > 0.0 else -np.inf}
    if run.verdict not in (Verdict.INTACT, Verdict.NOT_IN_EQUILIBRIUM, Verdict.IMPACT):
        relative["axis ratio"] = 1.0 - ratio / limit
        if bound < 1.0:
            relative["bound fraction"] = min((bound - edge for edge in mass_edges()), key=abs)
    return VerdictMargins(
        friction_angle=np.rad2deg(phi - run.friction) * u.deg,
        axis_ratio=ratio,
        limit=limit,
        strain=strain,
        bound_fraction=bound,
        bound_fraction_upper=bound
        if bound == 1.0
        else bound_fraction_upper(
            run.shape, run.velocity_gradient, body.rho * float(np.prod(body.axes) / np.prod(run.axes))
        ),
        relative={k: float(v) for k, v in relative.items()},
    )


def _course(inputs: FlybyInputs, limit: float, run: FlybyRun) -> tuple[float, float]:
    """Largest axis ratio, followed past the limit, and largest strain up to it."""
    beyond = run.verdict == Verdict.BEYOND_MODEL
    history = run.history
    if beyond or history is None:
        wider = inputs._replace(max_axis_ratio=FOLLOWED * limit) if beyond else inputs
        try:
            history = wider.run(keep=ROWS).history
        except NotConverged:
            return np.inf, float(np.abs(np.log(run.axes / inputs.body.axes)).max())
    assert history is not None
    axes = axes_of(history["shape"])
    ratios = axes[:, 0] / axes[:, 2]
    inside = axes[ratios <= limit] if beyond else axes
    strain = np.abs(np.log(np.concatenate([inside, run.axes[None]]) / inputs.body.axes)).max()
    return float(max(ratios.max(), run.axes[0] / run.axes[2])), float(strain)
