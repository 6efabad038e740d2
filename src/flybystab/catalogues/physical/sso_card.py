"""Cards of SsODNet (``ssoCard``, JSON): best estimates of the parameters of one asteroid, with references.

Fields: https://doc.ssodnet.imcce.fr/ssocard.html and the cards in the tests of https://github.com/maxmahlke/rocks;
Berthier et al. (2023), A&A 671, A151. Diameter in km, mass in kg, density in kg/m3, periods in h, poles ecliptic J2000
in deg. The 1-sigma error is the mean of the absolute values of ``min`` and ``max``. Several entries of ``spins`` are
alternative solutions with equal weights.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flybystab.catalogues.physical import PhysicalData, physical_reader, source_of
from flybystab.catalogues.readers.conversion import number
from flybystab.catalogues.spin_solutions import SpinSolution
from flybystab.errors import InvalidInput
from flybystab.files import parse_json
from flybystab.typing import Document


def _is_card(text: str) -> bool:
    return text.lstrip().startswith("{") and '"ssocard"' in text and '"physical"' in text


@physical_reader(
    "SsODNet ssoCard",
    _is_card,
    "H, diameter, axis ratios, density (or mass), taxonomic class",
    "periods and poles with errors",
)
def read_card(text: str, file: str) -> list[PhysicalData]:
    """The body of a card.

    Raises
    ------
    InvalidInput
    """
    card = parse_json(text, "ssoCard", file)
    try:
        physical = card["parameters"]["physical"] or {}
        names = [card.get("number"), card.get("name"), card.get("id"), *(card.get("aliases") or [])]
        row = _row(physical, file)
        spins = physical.get("spins", physical.get("spin")) or []
        solutions = list(spins.values()) if isinstance(spins, Mapping) else list(spins)
        found = tuple(_solution(s, file) for s in solutions if isinstance(s, dict) and s.get("period"))
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput("ssoCard", file, f"a card of SsODNet ({error})") from None
    return [PhysicalData(tuple(str(n) for n in names if n), row, found)]


def _value(item: object, name: str, file: str) -> tuple[float, float]:
    """Value and error of a quantity; the error is zero if not given."""
    if not isinstance(item, Mapping):
        return number(item, name, file), 0.0
    error = item.get("error") or {}
    ends = [abs(float(error[k])) for k in ("min", "max") if error.get(k) is not None]
    return number(item.get("value"), name, file), float(np.mean(ends)) if ends else 0.0


def _known(item: object) -> bool:
    return item not in (None, "", {}) and not (isinstance(item, Mapping) and item.get("value") in (None, ""))


def _row(physical: Document, file: str) -> dict[str, str]:
    row: dict[str, str] = {}

    def source(item: Document) -> str:
        return source_of("SsODNet", item.get("bibref") or [], file)

    magnitude = physical.get("absolute_magnitude") or {}
    if _known(magnitude.get("H", magnitude)):
        row["H_mag"] = repr(_value(magnitude.get("H", magnitude), "H", file)[0])
    size = 0.0
    if _known(physical.get("diameter")):
        value, sigma = _value(physical["diameter"], "diameter", file)
        size = 1e3 * value
        row |= {"diameter_m": f"{size:.10g}", "diameter_source": source(physical["diameter"])}
        if sigma:
            row["diameter_sigma_m"] = f"{1e3 * sigma:.10g}"
    ellipsoid = physical.get("ellipsoid") or {}
    if size and _known(ellipsoid.get("a/b")) and _known(ellipsoid.get("b/c")):
        (p, _), (q, _) = (_value(ellipsoid[k], k, file) for k in ("a/b", "b/c"))
        c = 0.5 * size / (p * q * q) ** (1.0 / 3.0)
        axes = (p * q * c, q * c, c)
        row |= {f"semi_axis_{n}_m": f"{x:.10g}" for n, x in zip("abc", axes, strict=True)}
        row["semi_axes_source"] = source(ellipsoid)
    if _known(physical.get("density")):
        value, sigma = _value(physical["density"], "density", file)
        row |= {"density_kg_m3": repr(value), "density_source": source(physical["density"])}
        if sigma:
            row["density_sigma_kg_m3"] = repr(sigma)
    elif size and _known(physical.get("mass")):
        value, _ = _value(physical["mass"], "mass", file)
        row["density_kg_m3"] = f"{value / (np.pi / 6.0 * size**3):.6g}"
        row["density_source"] = f"mass of {source(physical['mass'])}, with diameter"
    taxonomy = physical.get("taxonomy") or {}
    if letter := taxonomy.get("class"):
        row["taxonomic_class"] = str(letter.get("value") if isinstance(letter, Mapping) else letter)
        row["taxonomic_source"] = source(taxonomy)
    return row


def _solution(item: Document, file: str) -> SpinSolution:
    period, sigma = _value(item["period"], "period", file)
    pole = None
    if _known(item.get("long")) and _known(item.get("lat")):
        pole = _value(item["long"], "long", file)[0], _value(item["lat"], "lat", file)[0]
    return SpinSolution(period, sigma, pole, 1.0, source_of("SsODNet", item.get("bibref") or [], file))
