"""Columns of the result tables of a screening."""

from __future__ import annotations

import astropy.units as u

from flybystab.flybys.verdict import Verdict
from flybystab.screening.results import Column

#: Verdicts in the order of their columns.
VERDICTS = tuple(Verdict)
#: Verdicts of a body that flowed or worse.
YIELDED = (Verdict.RESHAPED, Verdict.MASS_LOSS, Verdict.DISRUPTED, Verdict.IMPACT, Verdict.BEYOND_MODEL)


def share_of(verdict: str) -> str:
    """Name of the column with the fraction of samples of a verdict."""
    return "p_" + verdict.lower().replace(" ", "_")


#: Columns of the table of encounters.
COLUMNS: dict[str, Column] = {
    "asteroid": Column(str, None, "name, or designation"),
    "number": Column(int, None, "IAU number, -1 without"),
    "planet": Column(str, None, "planet encountered"),
    "time_tdb": Column(
        str, None, "closest approach, ISO 8601, TDB; empty where the orbit could not be integrated"
    ),
    "jd_tdb": Column(float, u.d, "closest approach, Julian date, TDB"),
    "distance": Column(float, u.au, "distance of the centres at closest approach"),
    "v_inf": Column(float, u.km / u.s, "hyperbolic excess speed"),
    "verdict": Column(str, None, "verdict for the catalogue values and the given material"),
    "margin": Column(
        float, u.deg, "friction angle minus the largest one mobilised; a lower limit if decided by bound"
    ),
    "decided_by": Column(str, None, "bound, dynamics or grains"),
    "friction_angle": Column(float, u.deg, "friction angle of the catalogue body"),
    "cohesion": Column(float, u.Pa, "cohesion of the catalogue body"),
    "yield_surface": Column(str, None, "yield surface, also of the samples"),
    "semi_axis_a": Column(float, u.m, "long semi-axis of the catalogue body"),
    "semi_axis_b": Column(float, u.m, "middle semi-axis of the catalogue body"),
    "semi_axis_c": Column(float, u.m, "short semi-axis of the catalogue body"),
    "density": Column(float, u.kg / u.m**3, "bulk density of the catalogue body"),
    "spin_period": Column(float, u.h, "2 pi over the spin rate of the catalogue body"),
    "required_friction_at_rest": Column(
        float,
        u.deg,
        "largest mobilised far from the planet, for a tumbler over all phases; inf if no friction suffices",
    ),
    "friction_rise": Column(
        float, u.deg, "increase during the encounter; an upper limit if decided by bound"
    ),
    "samples": Column(int, None, "samples drawn"),
    "samples_dynamic": Column(int, None, "samples that were integrated"),
    "samples_grains": Column(int, None, "samples continued with grains"),
    **{share_of(v): Column(float, None, f"fraction of the samples with verdict {v}") for v in VERDICTS},
    "p_yield": Column(float, None, "fraction of the samples in equilibrium that yield or hit the planet"),
    "p_yield_low": Column(float, None, "lower end of its 95 % interval (Wilson)"),
    "p_yield_high": Column(float, None, "upper end of its 95 % interval (Wilson)"),
    "distance_sigma": Column(
        float, u.km, "1-sigma of the distance, from the covariance of the orbit; nan without one"
    ),
    "contributors": Column(
        str, None, "inputs to which the mobilised friction is most sensitive, with Spearman's rho"
    ),
    "assumed": Column(str, None, "properties of the catalogue body that are assumed, not measured"),
    "drawn": Column(str, None, "quantities of the samples that are drawn from priors"),
    "forces": Column(str, None, "forces on the orbit and sources of the tide"),
    "numerical_error": Column(
        float, u.deg, "measured error of the largest mobilised friction angle; nan if by bound"
    ),
    "seed": Column(int, None, "seed of the run"),
    "orbit": Column(str, None, "orbit solution"),
    "catalogue": Column(str, None, "catalogue of the asteroid"),
    "ephemeris": Column(str, None, "ephemeris of the planets"),
    "version": Column(str, None, "version of flybystab"),
    "error": Column(str, None, "reason why the row could not be computed"),
}

#: Columns of the table of samples.
SAMPLE_COLUMNS: dict[str, Column] = {
    "asteroid": Column(str, None, "name, or designation"),
    "planet": Column(str, None, "planet encountered"),
    "jd_tdb": Column(float, u.d, "closest approach, Julian date, TDB"),
    "sample": Column(int, None, "number of the sample"),
    "distance": Column(float, u.au, "closest-approach distance on the orbit of the sample"),
    "semi_axis_a": Column(float, u.m, "long semi-axis"),
    "semi_axis_b": Column(float, u.m, "middle semi-axis"),
    "semi_axis_c": Column(float, u.m, "short semi-axis"),
    "density": Column(float, u.kg / u.m**3, "bulk density"),
    "spin_period": Column(float, u.h, "2 pi over the spin rate"),
    "friction_angle": Column(float, u.deg, "friction angle"),
    "cohesion": Column(float, u.Pa, "cohesion"),
    "pole_x": Column(float, None, "x of the direction of the initial angular momentum, ICRF"),
    "pole_y": Column(float, None, "y of the direction of the initial angular momentum, ICRF"),
    "pole_z": Column(float, None, "z of the direction of the initial angular momentum, ICRF"),
    "angle": Column(float, u.deg, "rotation angle about the pole"),
    "phase": Column(float, None, "rotation phase of a tumbler"),
    "verdict": Column(str, None, "verdict"),
    "margin": Column(
        float, u.deg, "friction angle minus the largest one mobilised; a lower limit if decided by bound"
    ),
    "decided_by": Column(str, None, "bound, dynamics or grains"),
    "largest_fraction": Column(float, None, "mass fraction of the largest clump; nan without grains"),
    "error": Column(str, None, "reason why the sample could not be computed"),
}
