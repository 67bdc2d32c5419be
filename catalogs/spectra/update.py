"""Make star_colours.csv (needs numpy, scipy): inverse temperatures whose black bodies turn sunlight into starlight.

A star's spectrum is the Sun's times B(T_blue)/B(5772 K) below 550 nm and B(T_red)/B(5772 K) above, each 1 at 550 nm. T_blue
gives the star its B-V, T_red its V-I: those of dwarfs (Pecaut & Mamajek 2013, ApJS 208, 9, table 5, version 2022.04.16), moved
by the few thousandths of a magnitude that give the Sun its own spectrum at its own colour.
"""

from pathlib import Path

import numpy as np
from scipy.optimize import fsolve

CATALOGS = Path(__file__).parents[1]
C2 = 1.438776877e7  # nm K
BV = np.arange(-3, 18) / 10
VI = np.array([-0.354, -0.212, -0.097, 0.004, 0.108, 0.224, 0.346, 0.463, 0.579, 0.673, 0.758, 0.840, 0.934, 1.030,
               1.197, 1.354, 1.479, 1.699, 2.131, 2.680, 3.088])  # fmt: skip


def table(path):
    lines = [x for x in (CATALOGS / path).read_text().splitlines() if not x.startswith("#")]
    return np.array([[float(v) for v in x.split(",")] for x in lines[1:]]).T


NM = np.arange(300, 1100, 0.25)
SUN = np.interp(NM, *table("spectra/solar_astm_e490.csv"))
VEGA = np.interp(NM, *table("spectra/vega_calspec.csv"))
BANDS = {b: np.interp(NM, *table(f"passbands/{b}.csv"), left=0, right=0) for b in "BVI"}


def mag(spectrum, band):
    return -2.5 * np.log10(np.sum(spectrum * NM * BANDS[band]) / np.sum(VEGA * NM * BANDS[band]))


def tilt(inverse, nm):
    def body(i, x):
        # Planck without its constant; a negative inverse is a slope steeper than any black body's
        return 1 / np.expm1(C2 * i / x)

    return body(inverse, nm) / body(inverse, 550.0) * body(1 / 5772, 550.0) / body(1 / 5772, nm)


def star(blue, red):
    return SUN * np.where(NM < 550, tilt(blue, NM), tilt(red, NM))


sun_bv, sun_vi = mag(SUN, "B") - mag(SUN, "V"), mag(SUN, "V") - mag(SUN, "I")
shift = sun_vi - np.interp(sun_bv, BV, VI)
print(f"Sun: B-V {sun_bv:.4f}, V-I {sun_vi:.4f}; V-I of the dwarfs moved by {shift:+.4f}")
rows = []
for bv, vi in sorted([*zip(BV, VI + shift), (sun_bv, sun_vi)]):
    def wanted(p):
        s = star(p[0] * 1e-4, p[1] * 1e-4)
        return [mag(s, "B") - mag(s, "V") - bv, mag(s, "V") - mag(s, "I") - vi]

    solution, _, ok, message = fsolve(wanted, [1e4 / 5772] * 2, full_output=True)
    rows.append((bv, vi, *solution))
    print(f"B-V {bv:+.3f} V-I {vi:+.3f}: 1e4/T blue {solution[0]:.4f} red {solution[1]:.4f} {'' if ok == 1 else message}")
head = """# Black bodies that turn sunlight into starlight, against B-V: the Sun's spectrum times B(T)/B(5772 K), T_blue below 550 nm, T_red above.
# Source: this project (update.py), from V-I against B-V of dwarfs (Pecaut & Mamajek 2013, ApJS 208, 9, table 5, version 2022.04.16).
bv,vi,inverse_t_blue_1e-4_K-1,inverse_t_red_1e-4_K-1
"""
text = "\n".join(",".join(f"{v:.6g}" for v in row) for row in rows)
Path(__file__).with_name("star_colours.csv").write_text(head + text + "\n")
