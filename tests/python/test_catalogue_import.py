"""catalog import: tables that astropy writes, text and FITS, come back with the stars that are in them."""

import json
import struct

import numpy as np
import pytest
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.table import MaskedColumn, Table

HEAD = 64
BANDS, CELLS = 180, 41344


def stars_of(path):
    """The stars of a catalogue file, read as src/stars/catalogue.rs lays it down."""
    data = path.read_bytes()
    magic, bands, cells, stars, bits, epoch = struct.unpack_from("<8s4Id", data)
    assert (magic, bands, cells) == (b"NGSTARS1", BANDS, CELLS)
    (listed,) = struct.unpack_from("<I", data, 56)
    at = HEAD + 4 * (bands + 1) + 4 * (cells + 1)
    found = {"complete": np.frombuffer(data, "<i2", cells, at) / 1000, "epoch": epoch}
    at += 2 * cells
    for name, kind, unit in (("ra", "<u4", 360 / 2**32), ("dec", "<i4", 180 / 2**32), ("V", "<i2", 1e-3)):
        found[name] = np.frombuffer(data, kind, stars, at) * unit
        at += stars * int(kind[2])
    found["B-V"], found["motion"] = np.full(stars, np.nan), np.full((stars, 2), np.nan)
    if bits & 1:
        colour = np.frombuffer(data, "<i2", stars, at)
        found["B-V"] = np.where(colour == -32768, np.nan, colour / 1000)
        at += 2 * stars
    if bits & 2:
        motion = np.frombuffer(data, "<i4", 2 * stars, at).reshape(-1, 2)
        found["motion"] = np.where(motion == -(2**31), np.nan, motion / 100)
        at += 8 * stars
    if bits & 4:
        entries = np.frombuffer(data, "<u4, <i4, <i4", listed, at)
        found["motion"][entries["f0"]] = np.c_[entries["f1"], entries["f2"]] / 100
        at += 12 * listed
    assert at == len(data)
    return found


def table(number=500, seed=5):
    """A field of 3 degrees like Gaia's, with gaps in colours and motions."""
    random = np.random.default_rng(seed)
    t = Table()
    t["source_id"] = np.arange(number)
    t["ra"] = random.uniform(118.0, 121.0, number) * u.deg
    t["dec"] = random.uniform(-21.0, -18.0, number) * u.deg
    t["phot_g_mean_mag"] = (random.power(3, number) * 6 + 10).astype("f4") * u.mag
    t["bp_rp"] = MaskedColumn(random.uniform(0.0, 2.0, number), mask=random.random(number) < 0.2)
    gaps = random.random(number) < 0.5
    for name in ("pmra", "pmdec"):
        t[name] = MaskedColumn(random.normal(0, 20, number), mask=gaps, unit="mas / yr")
    return t


@pytest.mark.parametrize(
    "name, options",
    [
        ("stars.fits", {}),
        ("stars.ecsv", {}),
        ("stars.csv", {"format": "ascii.csv"}),
        ("stars.tsv", {"format": "ascii.tab"}),
    ],
)
def test_tables_of_astropy_come_back(execute, tmp_path, name, options):
    source = table()
    source.write(tmp_path / name, **options)
    execute(0, "catalog", "import", tmp_path / name, "-o", tmp_path / "stars.ngc")
    found = stars_of(tmp_path / "stars.ngc")
    assert found["epoch"] == 2016.0
    places = SkyCoord(found["ra"] * u.deg, found["dec"] * u.deg)
    index, apart, _ = SkyCoord(source["ra"], source["dec"]).match_to_catalog_sky(places)
    assert len(set(index)) == len(source) == len(places)
    assert apart.max() < 0.5 * u.mas
    x = np.ma.filled(source["bp_rp"], 0.82)
    v = source["phot_g_mean_mag"] + 0.02704 - 0.01424 * x + 0.2156 * x**2 - 0.01426 * x**3
    assert np.max(np.abs(found["V"][index] - v)) < 1e-3
    assert np.array_equal(np.isnan(found["B-V"][index]), source["bp_rp"].mask)
    assert np.nanmax(np.abs(found["B-V"][index] - 0.8 * x)) < 0.25
    for k, motion in enumerate(("pmra", "pmdec")):
        told = found["motion"][index, k]
        assert np.array_equal(np.isnan(told), source[motion].mask)
        assert np.nanmax(np.abs(told - source[motion].filled(np.nan))) < 0.006


def test_the_field_is_complete_to_where_its_counts_turn_over(nightglass, tmp_path):
    source = table(20_000)
    source.write(tmp_path / "stars.fits")
    nightglass("catalog", "import", tmp_path / "stars.fits", "-o", tmp_path / "stars.ngc")
    row = json.loads(nightglass("catalog", "info", tmp_path / "stars.ngc", "--json"))["rows"][0]
    faintest = stars_of(tmp_path / "stars.ngc")["V"].max()
    assert faintest - 1.5 < row["complete_to_median_mag_v"] < faintest
    # 3 x 3 square degrees, with the cells on its edges
    assert 9 < row["sky_share"] * 41253 < 20
    assert row["stars"] == 20_000 == sum(b["stars"] for b in row["counts"])
    inside = row["counts"][-2]
    assert inside["per_deg2"] == pytest.approx(inside["stars"] / 41252.96, rel=1e-6)


def test_colours_of_tycho_and_units(nightglass, refused, tmp_path):
    t = Table({"RAmdeg": [10.0], "DEmdeg": [-5.0], "BTmag": [9.2], "VTmag": [8.2]})
    t.write(tmp_path / "tycho.fits")
    nightglass("catalog", "import", tmp_path / "tycho.fits", "-o", tmp_path / "tycho.ngc")
    found = stars_of(tmp_path / "tycho.ngc")
    assert (found["V"][0], found["B-V"][0], found["epoch"]) == pytest.approx((8.11, 0.85, 2000.0))
    t["RAmdeg"].unit = "rad"
    t.write(tmp_path / "radians.fits")
    told = refused("catalog", "import", tmp_path / "radians.fits", "-o", tmp_path / "radians.ngc")
    assert 'RAmdeg is in "rad"' in told


def test_a_supplement_moves_to_the_epoch_of_the_table(nightglass, tmp_path):
    (tmp_path / "base.csv").write_text("ra,dec,Vmag,ref_epoch\n30,10,5.0,2016\n40,10,6.0,2016\n")
    (tmp_path / "more.csv").write_text("ra_deg,dec_deg,mag_v,colour_bv,pmra,pmdec\n30,9.9955556,5.1,0.4,0,1000\n")
    supplement = ("--supplement", tmp_path / "more.csv")
    nightglass("catalog", "import", tmp_path / "base.csv", "-o", tmp_path / "x.ngc", *supplement)
    found = stars_of(tmp_path / "x.ngc")
    assert sorted(found["V"]) == pytest.approx([5.1, 6.0])
    assert np.nansum(found["B-V"]) == pytest.approx(0.4) and np.isnan(found["motion"]).sum() == 2
