"""The analytic SNR against the CCD equation worked by hand on the planes that a frame is drawn from."""

import json

import numpy as np
import pytest
from astropy.io import fits

COMMON = ["--set", "station.scintillation=false", "--set", "exposures.count=1", "--set", "stars.enabled=false"]
CROP = (1968, 1968, 160, 160)


def planes(nightglass, folder, mag_v, seconds):
    """Mean electrons of a crop about the target, and the header of its frame."""
    crop = ",".join(map(str, CROP))
    sets = ["--set", f"target.0.brightness.mag_v={mag_v}", "--set", f"exposures.duration_s={seconds}"]
    out = folder / f"{mag_v}-{seconds}"
    asked = ["--set", 'output.planes=["mean"]', "--crop", crop, "-q", "-o", out]
    nightglass("render", "pogs-geo", *COMMON, *sets, *asked)
    mean = fits.getdata(out / "planes" / "mean_0000.fits").astype(float)
    return mean, fits.getheader(out / "frames" / "0000.fits")


def ccd_equation(light, sky, noise2, radius, ring, centre):
    """Signal over noise of an aperture: Merline & Howell 1995, with the weights of cut pixels squared."""
    y, x = np.indices(light.shape)
    part = (np.arange(40) + 0.5) / 40 - 0.5  # a pixel in 1600 parts
    near = np.hypot(x - centre[0], y - centre[1]) < radius + 1
    weights = np.zeros(light.shape)
    for row, column in zip(y[near], x[near]):
        dx, dy = np.meshgrid(column + part - centre[0], row + part - centre[1])
        weights[row, column] = (np.hypot(dx, dy) < radius).mean()
    distance = np.hypot(x - centre[0], y - centre[1])
    inside = (distance >= ring[0]) & (distance <= ring[1])
    area, n = weights.sum(), inside.sum()
    signal = (weights * light).sum() - area * light[inside].mean()
    variance = (weights**2 * (light + sky + noise2)).sum() + area**2 * (sky[inside] + noise2).mean() / n
    return signal / np.sqrt(variance)


@pytest.mark.parametrize("mag_v, seconds", [(9.0, 1.0), (12.0, 5.0), (15.0, 5.0), (14.0, 20.0)])
def test_aperture_by_hand(nightglass, tmp_path, mag_v, seconds):
    """Within 0.5 %: both cut pixels exactly, this model along ten lines a pixel; planes are 32-bit floats."""
    with_target, header = planes(nightglass, tmp_path, mag_v, seconds)
    sky, _ = planes(nightglass, tmp_path, 40.0, seconds)
    light = with_target - sky
    y, x = np.indices(light.shape)
    near = light > 1e-3 * light.max()
    centre = [(axis * light)[near].sum() / light[near].sum() for axis in (x, y)]
    radius = 4.0
    sets = ["--set", f"photometry.aperture_px={radius}", "--set", f"exposures.duration_s={seconds}"]
    told = json.loads(nightglass("snr", "pogs-geo", *COMMON, *sets, "--sweep", f"mag_v={mag_v}", "--json"))
    row = told["rows"][0]
    # the ring of the photometry: from 4 image widths, 3 wide
    fwhm = np.hypot(header["SEEING"] / header["PIXSCALE"], 0.68)
    ring = (4 * fwhm, 4 * fwhm + max(2 * radius, 3 * fwhm, 8.0))
    noise2 = header["RDNOISE"] ** 2 + header["GAIN"] ** 2 / 12
    expected = ccd_equation(light, sky, noise2, radius, ring, centre)
    assert row["snr"] == pytest.approx(expected, rel=5e-3)
    # and the row's own columns
    per_px = row["sky_e_px"] + row["dark_e_px"] + row["read_noise_e"] ** 2 + header["GAIN"] ** 2 / 12
    own = row["signal_e"] / np.sqrt(row["signal_e"] + row["n_px"] * per_px)
    assert own == pytest.approx(row["snr"], rel=5e-3)


def test_matched_filter_by_hand(nightglass, tmp_path):
    """The Cramer-Rao bound of flux and level from the planes, by the inverse of the Fisher matrix."""
    with_target, header = planes(nightglass, tmp_path, 13.0, 5.0)
    sky, _ = planes(nightglass, tmp_path, 40.0, 5.0)
    told = json.loads(nightglass("snr", "pogs-geo", *COMMON, "--sweep", "mag_v=13", "--json"))
    row = told["rows"][0]
    share = (with_target - sky) / row["signal_e"]
    noise2 = header["RDNOISE"] ** 2 + header["GAIN"] ** 2 / 12
    weights = 1 / (with_target + noise2)
    design = np.stack([share.ravel(), np.ones(share.size)])
    fisher = design * weights.ravel() @ design.T
    bound = np.sqrt(np.linalg.inv(fisher)[0, 0])
    # a wider stamp knows the level better: 1 % of the variance
    assert row["snr"] == pytest.approx(row["signal_e"] / bound, rel=1e-2)
