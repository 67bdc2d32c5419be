"""Make tests/reference/scattering.csv: light of the sky by discrete ordinates. Needs PythonicDISORT 1.8, numpy.

    python reference_scattering.py > ../reference/scattering.csv

The multiply scattered source of PythonicDISORT (64 streams, delta-M) is integrated along the line of sight at the direction
itself, for its interpolation between streams is off by up to 20 % near the zenith and the lamp; the first order is exact.
"""

import warnings
from pathlib import Path

import numpy as np
from PythonicDISORT.pydisort import pydisort

warnings.filterwarnings("ignore")
TABLE = Path(__file__).resolve().parents[2] / "catalogs" / "aerosol" / "remote_continental.csv"
ROWS = np.loadtxt([x for x in TABLE.read_text().splitlines() if x[0] not in "#a"], delimiter=",")
ANGLE, PHASE, LOG_NM = ROWS[:, 0], ROWS[:, 1:], np.log([350, 450, 550, 650, 800, 1000])
GAMMA = 0.0279 / (2 - 0.0279)
STREAMS, ALBEDO_AEROSOL, GROUND, PRESSURE = 64, 0.97, 0.15, 780.0
DEPTH_NODES, DEPTH_WEIGHTS = np.polynomial.legendre.leggauss(10)


def rayleigh_depth(nm):
    square = (nm * 1e-3) ** 2
    depth = 0.0021520 * (1.0455996 - 341.29061 / square - 0.90230850 * square)
    return depth / (1 + 0.0027059889 / square - 85.968563 * square) * PRESSURE / 1013.25


def rayleigh_phase(cosine):
    return 3 / (4 * (1 + 2 * GAMMA)) * ((1 + 3 * GAMMA) + (1 - GAMMA) * cosine**2)


def moments(phase, most):
    """Legendre moments of a table whose logarithm is linear in angle."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    low, width = np.radians(ANGLE[:-1, None]), np.radians(np.diff(ANGLE))[:, None]
    share, logs = (nodes + 1) / 2, np.log(phase)
    angle = low + width * share
    value = np.exp(logs[:-1, None] * (1 - share) + logs[1:, None] * share)
    weight, mu = (value * np.sin(angle) * width / 4 * weights).ravel(), np.cos(angle).ravel()
    out, before, now = np.empty(most + 1), np.ones_like(mu), mu
    out[0], out[1] = weight.sum(), weight @ mu
    for n in range(2, most + 1):
        before, now = now, ((2 * n - 1) * mu * now - (n - 1) * before) / n
        out[n] = weight @ now
    return out


def aerosol(nm):
    """Phase function at the table's angles and its moments, mean 1."""
    phase = np.exp([np.interp(np.log(nm), LOG_NM, np.log(row)) for row in PHASE])
    phase /= moments(phase, 1)[0]
    return phase, moments(phase, 600)


def separation(lamp, view, azimuth):
    a, b, c = np.radians(lamp), np.radians(view), np.radians(azimuth)
    h = np.sin((b - a) / 2) ** 2 + np.sin(a) * np.sin(b) * np.sin(c / 2) ** 2
    return np.degrees(2 * np.arcsin(np.sqrt(np.minimum(h, 1))))


def sky(nm, lamp, views, azimuths):
    """Radiance over irradiance, all orders and the first, by view and azimuth."""
    molecules, particles = rayleigh_depth(nm), 0.05 * (nm / 550) ** -1.3
    depth = molecules + particles
    scattered = molecules + ALBEDO_AEROSOL * particles
    share = np.array([molecules, ALBEDO_AEROSOL * particles]) / scattered
    phase, legendre = aerosol(nm)
    of_air = np.zeros_like(legendre)
    of_air[0], of_air[2] = 1, 0.1 * (1 - GAMMA) / (1 + 2 * GAMMA)
    omega = min(scattered / depth, 1 - 1e-7)
    mixed = share[0] * of_air + share[1] * legendre
    peak = mixed[STREAMS]
    mu0 = min(np.cos(np.radians(lamp)), 1 - 1e-9)
    result = pydisort(np.array([depth]), np.array([omega]), STREAMS, mixed[None, :], mu0, 1.0, 0.0, NLeg=STREAMS,
                      NFourier=STREAMS, f_arr=np.array([peak]), NT_cor=False, BDRF_Fourier_modes=[GROUND])  # fmt: skip
    mu, radiance = result[0], result[4]
    half = STREAMS // 2
    x, w = np.polynomial.legendre.leggauss(half)
    weights, sorted_weights = np.empty(STREAMS), w[np.argsort(x)] / 2
    weights[np.argsort(abs(mu[:half]))] = sorted_weights
    weights[half + np.argsort(abs(mu[half:]))] = sorted_weights

    # phase functions from every stream and azimuth to every direction looked at
    phi = 2 * np.pi * np.arange(2 * STREAMS) / (2 * STREAMS)
    down, turn = -np.cos(np.radians(views))[:, None, None, None], np.radians(azimuths)[None, :, None, None]
    m = mu[None, None, :, None]
    cosine = down * m + np.sqrt(np.maximum(1 - down**2, 0)) * np.sqrt(1 - m**2) * np.cos(turn - phi)

    def series(coefficients):
        return np.polynomial.legendre.legval(cosine, coefficients * (2 * np.arange(coefficients.size) + 1))

    kernel = share[0] * rayleigh_phase(cosine) + share[1] * series(legendre[:STREAMS])
    kernel = (kernel - peak * series(np.ones(STREAMS))) / (1 - peak)

    t = depth * (DEPTH_NODES + 1) / 2
    scale = 1 - omega * peak
    scaled, step = t * scale, DEPTH_WEIGHTS / 2 * depth * scale
    field = np.asarray(radiance(t, phi)).reshape(STREAMS, t.size, 2 * STREAMS)
    field = (field * weights[:, None, None] * np.pi / STREAMS).transpose(0, 2, 1).reshape(-1, t.size)
    source = kernel.reshape(len(views) * len(azimuths), -1) @ field
    source = omega * (1 - peak) / scale / (4 * np.pi) * source.reshape(len(views), len(azimuths), -1)
    airmass, lamp_airmass = 1 / np.cos(np.radians(views))[:, None], 1 / mu0
    kept = np.exp(-(depth * scale - scaled) * airmass[:, :, None]) * airmass[:, :, None]
    angle = separation(lamp, views[:, None], azimuths[None, :])
    of_particles = np.exp(np.interp(angle, ANGLE, np.log(phase)))
    both = share[0] * rayleigh_phase(np.cos(np.radians(angle))) + share[1] * of_particles
    first_source = omega / scale / (4 * np.pi) * both[:, :, None] * np.exp(-scaled * lamp_airmass)
    everything = ((source + first_source) * kept * step).sum(-1)
    difference = depth * (airmass - lamp_airmass)
    mean = np.where(abs(difference) < 1e-6, 1, -np.expm1(-difference) / np.where(difference == 0, 1, difference))
    once = scattered * both * airmass / (4 * np.pi) * np.exp(-depth * lamp_airmass) * mean
    return angle, everything, once


def main():
    views, azimuths = np.array([0, 15, 30, 45, 60, 75.0]), np.array([0, 45, 90, 135, 180.0])
    head = Path(__file__).resolve().parents[1] / "reference" / "scattering.csv"
    print("".join(x for x in head.read_text().splitlines(True) if x.startswith("#")), end="")
    print("wavelength_nm,tau_R,tau_A,z_moon,z,daz,rho,I_full_over_E,I_single_over_E")
    for nm in (400, 450, 550, 650, 800):
        for lamp in (0, 30, 60, 75.0):
            angle, everything, once = sky(nm, lamp, views, azimuths)
            for i, view in enumerate(views):
                for j, azimuth in enumerate(azimuths):
                    depths = f"{rayleigh_depth(nm):.5f},{0.05 * (nm / 550) ** -1.3:.5f}"
                    where = f"{lamp:g},{view:g},{azimuth:g},{angle[i, j]:.4f}"
                    print(f"{nm},{depths},{where},{everything[i, j]:.6e},{once[i, j]:.6e}")


if __name__ == "__main__":
    main()
