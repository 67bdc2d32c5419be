"""Trim the IERS table finals2000A.all to catalogs/eop/finals2000A.txt.

    pip install astropy-iers-data
    python catalogs/eop/update.py [finals2000A.all]

Without an argument the table inside the package astropy-iers-data is read. In: the
fixed-width IERS format (readme.finals2000A). Out: one line a day as catalogs/README.md lays
it down: the final values of Bulletin B where the table has them, else Bulletin A with its
predictions, as astropy takes them. A day without UT1-UTC ends the table; celestial-pole
offsets that are not predicted any more become 0.000. Run `sha256sum` afterwards and renew
catalogs/checksums.sha256.
"""

import sys
from pathlib import Path

FIRST_MJD = 41684  # 1973-01-02
# columns of xp, yp, UT1-UTC, dX, dY
BULLETIN_A = ((18, 27), (37, 46), (58, 68), (97, 106), (116, 125))
BULLETIN_B = ((134, 144), (144, 154), (154, 165), (165, 175), (175, 185))


def rows(text):
    """(mjd, xp arcsec, yp arcsec, UT1-UTC s, dX mas, dY mas) of every day with UT1-UTC."""
    for line in text.splitlines():
        if not line[58:68].strip():
            break
        mjd = float(line[7:15])
        assert mjd == int(mjd), line
        values = [float(line[a:b].strip() or 0) for a, b in BULLETIN_A]
        final = [line[a:b].strip() for a, b in BULLETIN_B]
        if all(final):
            values = [float(value) for value in final]
        yield int(mjd), *values


def main():
    if len(sys.argv) > 1:
        source = Path(sys.argv[1])
    else:
        import astropy_iers_data

        source = Path(astropy_iers_data.IERS_A_FILE)
    table = list(rows(source.read_text()))
    assert [row[0] for row in table] == list(range(FIRST_MJD, FIRST_MJD + len(table))), (
        "a day is missing"
    )
    lines = ["%5d %9.6f %9.6f %11.7f %8.3f %8.3f\n" % row for row in table]
    assert {len(line) for line in lines} == {56}
    target = Path(__file__).with_name("finals2000A.txt")
    target.write_text("".join(lines), newline="\n")
    print(f"{target}: {len(lines)} days, MJD {table[0][0]} to {table[-1][0]}")


if __name__ == "__main__":
    main()
