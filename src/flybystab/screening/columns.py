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
    """Name of the column with the share of a verdict."""
    return "p_" + verdict.lower().replace(" ", "_")


#: Columns of the table of encounters.
COLUMNS: dict[str, Column] = {
    "asteroid": Column(str, None, "name, or designation"),
    "number": Column(int, None, "IAU number, -1 without"),
    "planet": Column(str, None, "planet encountered"),
    "time_tdb": Column(
        str, None, "closest approach, ISO 8601, TDB; empty where the asteroid could not be followed"
    ),
    "jd_tdb": Column(float, u.d, "closest approach, Julian date, TDB"),
    "distance": Column(float, u.au, "between the centres at closest approach"),
    "v_inf": Column(float, u.km / u.s, "speed relative to the planet, far from it"),
    "verdict": Column(str, None, "verdict on the catalogue's values and the material given"),
    "margin": Column(
        float, u.deg, "friction angle minus the largest one mobilised; a lower limit if decided by bound"
    ),
    "decided_by": Column(str, None, "bound or dynamics"),
    "friction_angle": Column(float, u.deg, "of the catalogue body"),
    "cohesion": Column(float, u.Pa, "of the catalogue body"),
    "yield_surface": Column(str, None, "form of the yield surface, of the samples, too"),
    "semi_axis_a": Column(float, u.m, "long semi-axis of the catalogue body"),
    "semi_axis_b": Column(float, u.m, "middle semi-axis of the catalogue body"),
    "semi_axis_c": Column(float, u.m, "short semi-axis of the catalogue body"),
    "density": Column(float, u.kg / u.m**3, "bulk density of the catalogue body"),
    "spin_period": Column(float, u.h, "2 pi over the spin rate of the catalogue body"),
    "required_friction_at_rest": Column(float, u.deg, "mobilised by the free body; inf if none would do"),
    "friction_rise": Column(
        float, u.deg, "what the passage adds to that; an upper limit if decided by bound"
    ),
    "samples": Column(int, None, "samples drawn"),
    "samples_dynamic": Column(int, None, "samples that needed the dynamics"),
    **{share_of(v): Column(float, None, f"share of the samples with verdict {v}") for v in VERDICTS},
    "p_yield": Column(float, None, "share of the samples in equilibrium that yield, or hit the planet"),
    "p_yield_low": Column(float, None, "95 % interval (Wilson) of that probability"),
    "p_yield_high": Column(float, None, "95 % interval (Wilson) of that probability"),
    "distance_sigma": Column(
        float, u.km, "1-sigma of the distance, from the orbit's covariance; nan where none is known"
    ),
    "contributors": Column(
        str, None, "inputs that the mobilised friction follows most, with rank correlation"
    ),
    "assumed": Column(str, None, "what nobody measured in the catalogue body"),
    "drawn": Column(str, None, "what the samples draw from distributions"),
    "forces": Column(str, None, "what moves the asteroid and makes the tide"),
    "numerical_error": Column(
        float, u.deg, "of the largest mobilised friction angle, measured; nan if by bound"
    ),
    "seed": Column(int, None, "seed of the run"),
    "orbit": Column(str, None, "orbit solution"),
    "catalogue": Column(str, None, "where the asteroid comes from"),
    "ephemeris": Column(str, None, "of the planets"),
    "version": Column(str, None, "of flybystab"),
    "error": Column(str, None, "why the row could not be computed"),
}

#: Columns of the table of samples.
SAMPLE_COLUMNS: dict[str, Column] = {
    "asteroid": Column(str, None, "name, or designation"),
    "planet": Column(str, None, "planet encountered"),
    "jd_tdb": Column(float, u.d, "closest approach, Julian date, TDB"),
    "sample": Column(int, None, "number of the sample"),
    "distance": Column(float, u.au, "at closest approach, of the sample's orbit"),
    "semi_axis_a": Column(float, u.m, "long semi-axis"),
    "semi_axis_b": Column(float, u.m, "middle semi-axis"),
    "semi_axis_c": Column(float, u.m, "short semi-axis"),
    "density": Column(float, u.kg / u.m**3, "bulk density"),
    "spin_period": Column(float, u.h, "2 pi over the spin rate"),
    "friction_angle": Column(float, u.deg, "angle of friction"),
    "cohesion": Column(float, u.Pa, "cohesion"),
    "pole_x": Column(float, None, "direction of the angular momentum at the start, ICRF"),
    "pole_y": Column(float, None, "direction of the angular momentum at the start, ICRF"),
    "pole_z": Column(float, None, "direction of the angular momentum at the start, ICRF"),
    "angle": Column(float, u.deg, "turn about the pole"),
    "phase": Column(float, None, "phase of a tumbler in its rotation period"),
    "verdict": Column(str, None, "verdict"),
    "margin": Column(
        float, u.deg, "friction angle minus the largest one mobilised; a lower limit if decided by bound"
    ),
    "decided_by": Column(str, None, "bound or dynamics"),
    "error": Column(str, None, "why the sample could not be computed"),
}
