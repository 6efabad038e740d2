"""Objects of astroquery and sbpy in Python: the very classes, with stored answers in place of the network."""

import os
import warnings
from pathlib import Path

import astropy.units as u
import numpy as np
import pytest
from astropy.time import Time

import flybystab as fs
from flybystab.catalogues.catalogue import catalogue
from flybystab.catalogues.objects import asteroids_of
from flybystab.catalogues.readers.sbdb_answer import physical
from flybystab.errors import InvalidInput

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    jplsbdb = pytest.importorskip("astroquery.jplsbdb")
    jplhorizons = pytest.importorskip("astroquery.jplhorizons")
    mocks = pytest.importorskip("astroquery.utils.mocks")


def stored(module, name):
    """A stored answer that astroquery is itself tested with."""
    path = os.path.join(os.path.dirname(module.__file__), "tests", "data", name)
    if not os.path.isfile(path):
        pytest.skip("astroquery is installed without its test data")
    with open(path, "rb") as file:
        return file.read()


@pytest.fixture
def sbdb(monkeypatch):
    def query(name):
        content = stored(jplsbdb, name)
        monkeypatch.setattr(
            jplsbdb.SBDBClass,
            "_request",
            lambda self, method, url, **k: mocks.MockResponse(content=content, url=url),
        )
        return jplsbdb.SBDB.query("any", phys=True, full_precision=True, covariance="mat")

    return query


@pytest.fixture
def horizons(monkeypatch):
    def query(name):
        content = stored(jplhorizons, name)
        monkeypatch.setattr(
            jplhorizons.HorizonsClass,
            "_request",
            lambda self, method, url, **k: mocks.MockResponse(content=content, url=url),
        )
        return jplhorizons.Horizons(id="Ceres", location="500@10", epochs=2451544.5)

    return query


def test_an_answer_of_sbdb(tmp_path, sbdb):
    """The mapping of astroquery gives the orbit and the covariance of the document that it was made of."""
    (a,) = catalogue(sbdb("apophis.dat"))
    (tmp_path / "x.json").write_bytes(stored(jplsbdb, "apophis.dat"))
    (b,) = catalogue(tmp_path / "x.json")
    assert (a.number, a.name) == (99942, "Apophis")
    assert np.linalg.norm((a.orbit.position - b.orbit.position).to_value(u.m)) < 1e-3
    assert a.orbit.nongrav == b.orbit.nongrav
    assert a.orbit.covariance.names == b.orbit.covariance.names
    np.testing.assert_allclose(a.orbit.covariance.matrix, b.orbit.covariance.matrix, rtol=1e-12)
    assert a.row["diameter_m"] == "325"
    assert "T. Mueller" in a.row["diameter_source"]


def test_physical_parameters_of_sbdb(sbdb):
    """Ceres of JPL: extent 964.4 x 964.2 x 891.8 km, 2.162 g/cm3, pole 291.421/66.758 (equatorial)."""
    (a,) = catalogue(sbdb("ceres.dat"))
    assert a.semi_axes.to_value(u.km) == pytest.approx([482.2, 482.1, 445.9])
    assert a.quantity("density_kg_m3").value == pytest.approx(2162.0)
    ra, dec = np.radians([291.421, 66.758])
    pole = [np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
    np.testing.assert_allclose(a.pole, pole, atol=1e-5)


def test_density_by_gm_and_extent():
    """Ceres: GM 62.6284 km3/s2 and its extents give the 2.162 g/cm3 that JPL has."""
    items = [{"name": "GM", "value": "62.6284"}, {"name": "extent", "value": "964.4 x 964.2 x 891.8"}]
    assert float(physical(items, "x")["density_kg_m3"]) == pytest.approx(2162.0, rel=2e-3)
    items[1] = {"name": "diameter", "value": "939.4"}
    assert float(physical(items, "x")["density_kg_m3"]) == pytest.approx(2162.0, rel=2e-3)
    assert "density_kg_m3" not in physical(items[:1], "x")


def test_the_delay_of_a_comet(sbdb):
    """In the units that astroquery gives its parameters, against the file of the same solution."""
    (a,) = catalogue(sbdb("67P.dat"))
    (b,) = catalogue(Path(__file__).parents[1] / "cases" / "files" / "67P.json")
    assert a.orbit.nongrav == b.orbit.nongrav
    assert a.orbit.nongrav.delay > 0.0


def test_elements_of_horizons(horizons):
    table = horizons("ceres_elements_single.txt").elements()
    (a,) = catalogue(table)
    assert (a.number, a.epoch.jd) == (1, 2451544.5)
    state = [-2.377530298472460, 0.8007772252240262, 0.4628376138999674]  # ecliptic, of Horizons itself
    c, s = np.cos(np.radians(84381.448 / 3600)), np.sin(np.radians(84381.448 / 3600))
    x, y, z = a.orbit.position.to_value(u.au)
    np.testing.assert_allclose([x, c * y + s * z, c * z - s * y], state, atol=1e-11)
    table["n"][:] *= 2.0
    with pytest.raises(InvalidInput, match="heliocentric"):
        catalogue(table)


def test_vectors_of_horizons_name_no_centre(horizons):
    with pytest.raises(InvalidInput, match="from_state"):
        catalogue(horizons("ceres_vectors_single.txt").vectors())


def test_comets_of_the_mpc_are_refused_for_their_law():
    mpc = pytest.importorskip("astroquery.mpc")
    import json

    answer = json.loads(stored(mpc, "comet_object_C2012S1.json"))
    with pytest.raises(InvalidInput, match="A1"):
        catalogue(answer)
    for row in answer:
        row["non_grav_a1"] = row["non_grav_a2"] = None
    (a,) = catalogue(answer)
    assert a.designation == "C/2012 S1"
    assert float(a.row["q_au"] if a.row.get("q_au") else 0.0128562) == pytest.approx(0.0128562)


def test_orbit_and_body_of_sbpy():
    data = pytest.importorskip("sbpy.data")
    apophis = fs.Asteroid.from_catalogue("Apophis")
    row = apophis.row
    orbit = data.Orbit.from_dict(
        {
            "targetname": ["99942 Apophis (2004 MN4)"],
            "epoch": Time([float(row["epoch_jd_tdb"])], format="jd", scale="tdb"),
            "a": [float(row["a_au"])] * u.au,
            "e": [float(row["e"])],
            "i": [float(row["i_deg"])] * u.deg,
            "Omega": [float(row["node_deg"])] * u.deg,
            "w": [float(row["peri_deg"])] * u.deg,
            "M": [float(row["M_deg"])] * u.deg,
        }
    )
    (a,) = catalogue(orbit)
    assert a.number == 99942
    assert np.linalg.norm((a.orbit.position - apophis.orbit.position).to_value(u.m)) < 1e-3
    phys = data.Phys.from_dict(
        {"targetname": ["Apophis"], "diameter": [340] * u.m, "density": [2200] * u.kg / u.m**3}
    )
    (b,) = asteroids_of(orbit, phys)
    assert b.quantity("diameter_m").value == pytest.approx(340.0)
    assert b.quantity("density_kg_m3").value == pytest.approx(2200.0)


def test_other_objects_are_refused():
    with pytest.raises(InvalidInput, match="astroquery or sbpy"):
        catalogue(3.0)
