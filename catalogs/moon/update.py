"""Make catalogs/moon/de421_minus_moon98.txt: what SOFA's moon98 lacks against JPL's DE421.

    pip install jplephem skyfield-data pyerfa numpy
    python catalogs/moon/update.py

Out: one line a day (0 h TT) as catalogs/README.md lays it down: DE421 - moon98, the geocentric
geometric Moon in ICRS axes, kilometres. TDB is taken for TT (2 m). Run `sha256sum` afterwards
and renew catalogs/checksums.sha256.
"""

import os
from pathlib import Path

import erfa
import numpy as np
import skyfield_data
from jplephem.spk import SPK

FIRST_MJD, LAST_MJD = 41650, 70990  # 1972-11-29 to 2053-03-31


def main():
    kernel = SPK.open(os.path.join(skyfield_data.get_skyfield_data_path(), "de421.bsp"))
    jd = np.arange(FIRST_MJD, LAST_MJD + 1) + 2400000.5
    exact = (kernel[3, 301].compute(jd) - kernel[3, 399].compute(jd)).T
    series = erfa.moon98(jd, 0.0)["p"] * erfa.DAU / 1e3
    lines = ["%7.2f%7.2f%7.2f\n" % tuple(row) for row in exact - series]
    assert {len(line) for line in lines} == {22}
    target = Path(__file__).with_name("de421_minus_moon98.txt")
    target.write_text("".join(lines), newline="\n")
    print(f"{target}: {len(lines)} days, MJD {FIRST_MJD} to {LAST_MJD}")


if __name__ == "__main__":
    main()
