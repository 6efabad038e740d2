"""Physical parameters from an answer of the JPL Small-Body Database for one object, with ``phys-par=1`` (JSON).

Fields: https://ssd-api.jpl.nasa.gov/doc/sbdb.html (``phys_par``). The orbit in the answer is not used.
"""

from __future__ import annotations

from flybystab.catalogues.physical import PhysicalData, physical_reader
from flybystab.catalogues.readers.conversion import number
from flybystab.catalogues.readers.sbdb_answer import physical
from flybystab.catalogues.spin_solutions import SpinSolution
from flybystab.errors import InvalidInput
from flybystab.files import parse_json


@physical_reader(
    "SBDB phys_par",
    lambda text: text.lstrip().startswith("{") and '"phys_par"' in text,
    "H, diameter, extent, density (or GM)",
    "period with error, pole",
)
def read_parameters(text: str, file: str) -> list[PhysicalData]:
    """The body of an answer.

    Raises
    ------
    InvalidInput
    """
    answer = parse_json(text, "file of physical parameters", file)
    thing = answer.get("object") or {}
    names = [thing.get(k) for k in ("des", "fullname", "shortname", "spkid")]
    try:
        row = physical(answer["phys_par"] or [], file)
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput(
            "file of physical parameters", file, f"phys_par of the SBDB API ({error})"
        ) from None
    spins: tuple[SpinSolution, ...] = ()
    if row.get("spin_period_h"):
        sigma = row.pop("spin_period_sigma_h", "")
        pole = None
        if row.get("pole_ecl_lon_deg"):
            pole = float(row.pop("pole_ecl_lon_deg")), float(row.pop("pole_ecl_lat_deg"))
        period = number(row.pop("spin_period_h"), "rot_per", file)
        spins = (SpinSolution(period, float(sigma or 0.0), pole, 1.0, row.pop("spin_source")),)
    return [PhysicalData(tuple(str(n) for n in names if n), row, spins)]
