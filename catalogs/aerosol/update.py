"""Make remote_continental.csv: the phase function of clear continental aerosol, by Mie theory (needs numpy, scipy, miepython).

Sizes: Jaenicke 1993, "Tropospheric aerosols", in Aerosol-Cloud-Climate Interactions, remote continental: three log-normal
modes, as Jones et al. 2013, A&A 560, A91, table 2 give them. Refractive index 1.5. Normalised to a mean of 1 over the
sphere. Each mode keeps the weight of Jones et al. (1, 0.45, 0.05), who fitted the sum to the extinction of Cerro Paranal.
"""

from pathlib import Path

import miepython
import numpy as np
from scipy.integrate import simpson

MODES = [(3200, 0.010, 0.161, 1.00), (2900, 0.058, 0.217, 0.45), (0.300, 0.900, 0.380, 0.05)]  # cm^-3, um, log10, weight
NM = [350, 450, 550, 650, 800, 1000]
DEG = np.array(
    [0, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12.5, 15, 17.5, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85]
    + list(range(90, 181, 5)),
    float,
)
FINE = np.concatenate([np.linspace(0, 10, 401), np.linspace(10, 180, 341)[1:]])


def phase(nm):
    """Phase function on FINE, not normalised, and the extinction."""
    radius = np.logspace(-3, 1.3, 300)  # um
    total, extinction = np.zeros(FINE.size), 0.0
    mu = np.cos(np.radians(FINE))
    number = sum(
        w * n / (np.sqrt(2 * np.pi) * s) * np.exp(-(np.log10(radius / r) ** 2) / (2 * s * s)) for n, r, s, w in MODES
    )
    x = 2 * np.pi * radius / (nm * 1e-3)
    rows, ext = [], []
    for size, r in zip(x, radius):
        qext, qsca, _, _ = miepython.efficiencies_mx(1.5 - 0j, size)
        # unpolarised intensity whose integral over the sphere is Qsca
        rows.append(miepython.i_unpolarized(1.5 - 0j, size, mu, norm="qsca") * np.pi * r * r)
        ext.append(qext * np.pi * r * r)
    logs = np.log10(radius)
    total = simpson(np.array(rows) * number[:, None], x=logs, axis=0)
    extinction = simpson(np.array(ext) * number, x=logs)
    return total, extinction


columns, extinction = [], []
for nm in NM:
    values, ext = phase(nm)
    extinction.append(ext)
    shown = np.interp(DEG, FINE, np.log(values))
    # the table is read with straight lines in the logarithm: it is that curve whose mean is 1
    fine = np.exp(np.interp(FINE, DEG, shown))
    mean = np.trapezoid(fine * np.sin(np.radians(FINE)), np.radians(FINE)) / 2
    columns.append(np.exp(shown) / mean)
    cosine = np.trapezoid(fine * np.sin(np.radians(FINE)) * np.cos(np.radians(FINE)), np.radians(FINE)) / 2 / mean
    print(f"{nm} nm: asymmetry {cosine:.3f}")
slope = np.polyfit(np.log(NM), np.log(extinction), 1)[0]
print(f"extinction goes as wavelength^{slope:.2f}")
head = """# Phase function of remote continental aerosol, mean 1 over the sphere, against the angle of scattering; columns: wavelength in nm.
# Source: Mie theory (miepython 3) for the size distribution of Jaenicke 1993 with the weights of Jones et al. 2013, A&A 560, A91;
# refractive index 1.5; made by update.py. Between angles the logarithm is linear.
angle_deg,"""
lines = [",".join([f"{a:g}"] + [f"{c[i]:.5g}" for c in columns]) for i, a in enumerate(DEG)]
Path(__file__).with_name("remote_continental.csv").write_text(
    head + ",".join(f"P{nm}" for nm in NM) + "\n" + "\n".join(lines) + "\n"
)
