"""Make remote_continental.csv: the phase function of clear continental aerosol, by Mie theory (needs numpy).

Sizes: Jaenicke 1993, "Tropospheric aerosols", in Aerosol-Cloud-Climate Interactions (ed. Hobbs), remote continental: three
log-normal modes in diameter, as Jones et al. 2013, A&A 560, A91 take them. Spheres of refractive index 1.5, diameters of
0.004 to 100 um. Mie series after Bohren & Huffman 1983, ch. 4; Qext agrees with miepython to 8 digits.

    python update.py
"""

from pathlib import Path

import numpy as np

NUMBER = np.array([3200.0, 2900.0, 0.3])  # cm^-3
DIAMETER = np.array([0.020, 0.116, 1.8])  # um, median of the number
SIGMA = np.array([0.161, 0.217, 0.380])  # of log10 diameter
SMALLEST, LARGEST = 0.004, 100.0  # um
NM = np.array([350, 450, 550, 650, 800, 1000])
INDEX = 1.5
NEAR = [0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.125, 0.15, 0.175, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.6, 0.7, 0.8, 0.9, 1]
WIDE = [1.25, 1.5, 1.75, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 10, 12.5, 17.5, 22.5, 162.5, 167.5, 172.5, 176, 177, 177.5, 178, 178.5, 179, 179.5]  # fmt: skip
ANGLE = np.unique(np.concatenate([NEAR, WIDE, np.arange(15, 180.1, 5)]))


def coefficients(x):
    """Mie coefficients a_n, b_n of a sphere of size parameter x."""
    count = int(x + 4.05 * x ** (1 / 3) + 2) if x > 0.02 else 3
    z = INDEX * x
    above = int(max(count, z + 6 * z ** (1 / 3))) + 20
    d = np.zeros(above + 1, complex)
    ratio = np.zeros(above + 2)
    for n in range(above, 0, -1):
        d[n - 1] = n / z - 1 / (d[n] + n / z)
        ratio[n] = 1 / ((2 * n + 1) / x - ratio[n + 1])
    psi, chi = np.empty(count + 1), np.empty(count + 1)
    psi[0], chi[0] = np.sin(x), np.cos(x)
    psi[1] = psi[0] * ratio[1] if x < 1 else np.sin(x) / x - np.cos(x)
    chi[1] = np.cos(x) / x + np.sin(x)
    for n in range(2, count + 1):
        # upward where that is stable
        psi[n] = (2 * n - 1) / x * psi[n - 1] - psi[n - 2] if n < x else psi[n - 1] * ratio[n]
        chi[n] = (2 * n - 1) / x * chi[n - 1] - chi[n - 2]
    n = np.arange(1, count + 1)
    xi = psi - 1j * chi
    electric, magnetic = d[1 : count + 1] / INDEX + n / x, d[1 : count + 1] * INDEX + n / x
    a = (electric * psi[1:] - psi[:-1]) / (electric * xi[1:] - xi[:-1])
    b = (magnetic * psi[1:] - psi[:-1]) / (magnetic * xi[1:] - xi[:-1])
    return a, b


def spheres(mu, number=6000):
    """Size parameters, Qext, Qsca and the unpolarised intensity at the cosines mu."""
    sizes = np.geomspace(np.pi * SMALLEST / 1.0, np.pi * LARGEST / 0.35, number)
    most = int(sizes[-1] + 4.05 * sizes[-1] ** (1 / 3) + 4)
    pi_n, tau_n = np.zeros((most + 1, mu.size)), np.zeros((most + 1, mu.size))
    pi_n[1], tau_n[1] = 1, mu
    for n in range(2, most + 1):
        pi_n[n] = ((2 * n - 1) * mu * pi_n[n - 1] - n * pi_n[n - 2]) / (n - 1)
        tau_n[n] = n * mu * pi_n[n] - (n + 1) * pi_n[n - 1]
    extinction, scattering, intensity = [], [], []
    for x in sizes:
        a, b = coefficients(x)
        n = np.arange(1, a.size + 1)
        extinction.append(2 / x**2 * np.sum((2 * n + 1) * (a + b).real))
        scattering.append(2 / x**2 * np.sum((2 * n + 1) * (abs(a) ** 2 + abs(b) ** 2)))
        weight = (2 * n + 1) / (n * (n + 1))
        p, t = pi_n[1 : a.size + 1], tau_n[1 : a.size + 1]
        s1, s2 = (weight * a) @ p + (weight * b) @ t, (weight * a) @ t + (weight * b) @ p
        intensity.append(0.5 * (abs(s1) ** 2 + abs(s2) ** 2))
    return sizes, np.array(extinction), np.array(scattering), np.array(intensity)


def mean(phase):
    """Mean over the sphere of a table whose logarithm is linear in angle."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    low, width = np.radians(ANGLE[:-1, None]), np.radians(np.diff(ANGLE))[:, None]
    share = (nodes + 1) / 2
    logs = np.log(phase)
    value = np.exp(logs[:-1, None] * (1 - share) + logs[1:, None] * share)
    return np.sum(value * np.sin(low + width * share) * width / 2 * weights) / 2


sizes, extinction, scattering, intensity = spheres(np.cos(np.radians(ANGLE)))
columns, total = [], []
for nm in NM:
    diameter = sizes * nm * 1e-3 / np.pi
    logs = np.log10(diameter)
    number = sum(
        n / (np.sqrt(2 * np.pi) * s) * np.exp(-0.5 * ((logs - np.log10(d)) / s) ** 2)
        for n, d, s in zip(NUMBER, DIAMETER, SIGMA)
    )
    weight = number * (logs[1] - logs[0]) * ((diameter >= SMALLEST) & (diameter <= LARGEST))
    total.append(np.sum(weight * diameter**2 * extinction))
    phase = weight @ intensity
    columns.append(phase / mean(phase))
slope = np.polyfit(np.log(NM), np.log(total), 1)[0]
print(f"extinction goes as wavelength^{slope:.2f}; means", [f"{mean(np.round(c, 6)):.5f}" for c in columns])
head = """# Phase function of remote continental aerosol, mean 1 over the sphere, against the angle of scattering; columns: wavelength in nm.
# Source: Mie theory for the sizes of Jaenicke 1993, refractive index 1.5; made by update.py. The logarithm is linear in the angle and
# in the logarithm of the wavelength.
"""
lines = [",".join([f"{a:g}"] + [f"{c[i]:.5g}" for c in columns]) for i, a in enumerate(ANGLE)]
Path(__file__).with_name("remote_continental.csv").write_text(
    head + "angle_deg," + ",".join(f"P{nm}" for nm in NM) + "\n" + "\n".join(lines) + "\n"
)
