"""The reader of reference states: centres, units and non-gravitational parameters."""

import astropy.units as u
import pytest

from flybystab.bench.reference_states import reference_orbits

TABLE = """id,object,epoch_jd_tdb,center,frame,units,x,y,z,vx,vy,vz,A1_au_d2,A2_au_d2,A3_au_d2,solution,source
one,433 Eros,2459957.0,Sun,ICRF,au_au/d,0.5,-1.0,0.25,-0.01,0.005,0.002,0,-1e-14,0,,
same,433 Eros,2459957.0,Sun,ICRF,m_m/s,{x},{y},{z},{vx},{vy},{vz},0,-1e-14,0,,
other,433 Eros,2459957.0,SSB,ICRF,au_au/d,0.5,-1.0,0.25,-0.01,0.005,0.002,0,0,0,,
"""


def test_states_in_both_units_are_the_same_orbit(tmp_path):
    au, day = 149597870700.0, 86400.0
    lengths = {c: repr(v * au) for c, v in zip("xyz", (0.5, -1.0, 0.25), strict=True)}
    speeds = {f"v{c}": repr(v * au / day) for c, v in zip("xyz", (-0.01, 0.005, 0.002), strict=True)}
    path = tmp_path / "states.csv"
    path.write_text(TABLE.format(**lengths, **speeds))
    found = reference_orbits(path)
    one, same, other = found["one"], found["same"], found["other"]
    assert one.position.to_value(u.m) == pytest.approx(same.position.to_value(u.m), rel=1e-14)
    assert one.velocity.to_value(u.m / u.s) == pytest.approx(same.velocity.to_value(u.m / u.s), rel=1e-14)
    assert (one.centre, other.centre, one.name) == ("sun", "ssb", "433 Eros")
    assert one.epoch.tdb.jd == 2459957.0
    assert one.nongrav.a[1] == pytest.approx(-1e-14 * au / day**2)
    assert not other.nongrav.active
