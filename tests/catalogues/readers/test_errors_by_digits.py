"""Orbits of files without errors: their digits may make them uncertain, but never determined."""

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time
from orbit_files import PLAIN, UNKNOWN

import flybystab as fs
from flybystab.catalogues.catalogue import Asteroid, catalogue
from flybystab.catalogues.readers import READERS
from flybystab.orbit.predictability import deviations_of

APOPHIS = Asteroid.from_catalogue("Apophis").row


def test_every_reader_has_such_a_file():
    """But for the covariance of Find_Orb, which is nothing else."""
    assert (
        set(PLAIN) == set(READERS.names) - {"Find_Orb covariance"} == set(UNKNOWN) - {"Find_Orb covariance"}
    )


@pytest.mark.parametrize("name", PLAIN)
def test_an_orbit_without_errors_is_not_known(tmp_path, name):
    path = tmp_path / "file"
    path.write_text(PLAIN[name]())
    assert READERS[name].identify(PLAIN[name]())
    for a in catalogue(path):
        assert not deviations_of(a.orbit).known, (a.name, a.orbit.covariance)


def test_every_digit_without_an_error_is_unknown_and_few_are_uncertain(tmp_path):
    """Apophis in 2029 from JPL's elements: with all digits nothing is said of their error; four are 30,000 km."""
    columns = ("epoch", "e", "a", "i", "om", "w", "ma")
    cells = [APOPHIS[c] for c in ("epoch_jd_tdb", "e", "a_au", "i_deg", "node_deg", "peri_deg", "M_deg")]
    path = tmp_path / "x.csv"
    grades = []
    for shown in (cells, [cells[0], *(f"{float(c):.7f}" for c in cells[1:])]):
        path.write_text(",".join(("pdes", *columns)) + "\n" + ",".join(("99942", *shown)) + "\n")
        (a,) = catalogue(path)
        span = Time("2029-04-01", scale="tdb"), Time("2029-05-01", scale="tdb")
        row = fs.find_encounters(a.orbit, *span, within=0.05 * u.au, growth=True)[0]
        grades.append(str(row["predictability"]))
    assert grades[0] == "unknown"
    assert grades[1] in ("uncertain", "unknown")


def test_errors_of_a2_alone_say_nothing_of_the_elements(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(
        "pdes,epoch,e,a,i,om,w,ma,A2,A2_sigma\n99942,2461000.5,.1911,.9224,3.341,203.9,126.6,312.8,-2.9E-14,2E-16\n"
    )
    (a,) = catalogue(path)
    assert a.orbit.covariance.digits_alone
    assert np.isfinite(a.orbit.covariance.sigma).all()
