"""catalogs/: every file is the one its README and checksum list name, and is well-formed."""

import hashlib
import re

import astropy.units as u
import numpy as np
import pytest
from light_reference import CATALOGS
from places_reference import IERS

FIRST_MJD = 41684
LINE = 56


def checksums():
    lines = (CATALOGS / "checksums.sha256").read_text().splitlines()
    return {path: digest for digest, path in (line.split("  ") for line in lines)}


def test_checksums_and_readme_agree_with_the_files():
    readme = re.findall(
        r"\* `([^`]+)`:.*?SHA-256 `([0-9a-f]{64})`", (CATALOGS / "README.md").read_text(), re.S
    )
    listed = checksums()
    assert dict(readme).items() <= listed.items()
    for path, digest in listed.items():
        assert hashlib.sha256((CATALOGS / path).read_bytes()).hexdigest() == digest, path


def test_every_table_is_listed():
    listed = checksums()
    tables = {str(p.relative_to(CATALOGS)) for p in CATALOGS.rglob("*.csv")}
    assert tables <= listed.keys()


@pytest.mark.parametrize(
    "path", sorted(str(p.relative_to(CATALOGS)) for p in CATALOGS.rglob("*.csv"))
)
def test_csv_is_well_formed(path):
    lines = (CATALOGS / path).read_text().splitlines()
    body = [line.split(",") for line in lines if not line.startswith("#")]
    assert lines[0].startswith("# ")
    assert {len(cells) for cells in body} == {len(body[0])}
    if body[0][0] == "wavelength_nm":
        nm, *values = np.array(body[1:], float).T
        assert np.all(np.diff(nm) > 0) and np.all(np.isfinite(values)) and np.min(values) >= 0
        assert 250 < nm[0] and nm[-1] <= 1124
    if path.startswith(("qe/", "passbands/")):
        assert np.max(values) <= 1.0


def test_earth_orientation_against_astropy():
    text = (CATALOGS / "eop" / "finals2000A.txt").read_bytes()
    assert len(text) % LINE == 0
    table = np.array([line.split() for line in text.decode().splitlines()], float)
    assert np.array_equal(table[:, 0], FIRST_MJD + np.arange(len(table)))
    for mjd in (FIRST_MJD, 44000, 51544, 57753, 57754, 58138, 61000):
        index = (mjd - FIRST_MJD) * LINE
        row = np.array(text[index : index + LINE].split(), float)
        source = IERS[IERS["MJD"] == mjd * u.d]
        # astropy's own choice: Bulletin B where it is there, else A
        names = ("MJD", "PM_x", "PM_y", "UT1_UTC", "dX_2000A", "dY_2000A")
        units = (u.d, u.arcsec, u.arcsec, u.s, u.mas, u.mas)
        assert row == pytest.approx(
            [source[n][0].to_value(x) for n, x in zip(names, units)], abs=5e-7
        )
