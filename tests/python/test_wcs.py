"""Stars of a rendered frame, found with sep, against their catalogue places and magnitudes."""

import tomllib

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS
from measure import aperture, centroids, inside, isolated, moffat_share, subtracted
from scenes import sidereal_field
from support import assert_units

COLUMNS = {
    "frame": None,
    "star": None,
    "ra_deg": "deg",
    "dec_deg": "deg",
    "mag_v": "mag",
    "x_px": "pix",
    "y_px": "pix",
    "x_start_px": "pix",
    "y_start_px": "pix",
    "x_end_px": "pix",
    "y_end_px": "pix",
    "electrons": "electron",
}


@pytest.fixture(scope="module")
def field(produce):
    """(image less background, rms, header, chosen stars, all stars, resolved scene)."""
    # faint stars would leave none alone
    alone = ("--set", "station.scintillation=false", "--set", "stars.synthetic=false")
    out = produce("render", sidereal_field(), *alone)
    with fits.open(out / "frames" / "0000.fits") as hdus:
        header, adu = hdus[0].header, hdus[0].data.astype(float)
    stars = Table.read(out / "stars" / "stars_0000.ecsv", format="ascii.ecsv")
    scene = tomllib.loads((out / "scene.toml").read_text())
    image, rms = subtracted(adu)
    fwhm = header["SEEING"] / header["PIXSCALE"]
    x, y, electrons = (np.asarray(stars[c], float) for c in ("x_px", "y_px", "electrons"))
    peak = adu[np.clip(np.rint(y).astype(int), 0, 2047), np.clip(np.rint(x).astype(int), 0, 2047)]
    sky_e = rms * header["GAIN"]
    chosen = (
        inside(x, y, adu.shape, 60)
        & isolated(x, y, electrons, 10 * fwhm)
        & (electrons > 60 * sky_e * fwhm * 2)  # signal to noise of 60 and more
        & (peak < 0.8 * header["SATURATE"])
    )
    print(f"{len(stars)} stars drawn, {chosen.sum()} measured, FWHM {fwhm:.2f} px")
    assert chosen.sum() >= 40
    return image, rms, header, stars[chosen], stars, scene


def test_star_table(field):
    _, _, header, _, stars, _ = field
    assert_units(stars, COLUMNS)
    assert len(set(stars["star"])) == len(stars)
    # sidereal tracking: stars are points
    trail = np.hypot(
        stars["x_end_px"] - stars["x_start_px"], stars["y_end_px"] - stars["y_start_px"]
    )
    assert np.max(trail) < 0.05


def test_wcs_gives_the_pixels_drawn(field):
    _, _, header, _, stars, _ = field
    x, y = WCS(header).all_world2pix(stars["ra_deg"], stars["dec_deg"], 0)
    off = np.hypot(x - stars["x_px"], y - stars["y_px"])[inside(x, y, (2048, 2048), 0)]
    print(f"WCS against star table: median {np.median(off):.4f} px, largest {off.max():.4f} px")
    assert off.max() < 0.03


def test_centroids_lie_where_the_wcs_says(field):
    image, _, header, chosen, _, _ = field
    x, y = WCS(header).all_world2pix(chosen["ra_deg"], chosen["dec_deg"], 0)
    found_x, found_y = centroids(image, x, y, header["SEEING"] / header["PIXSCALE"])
    dx, dy = found_x - x, found_y - y
    off = np.hypot(dx, dy)
    print(
        f"centroids: median offset {np.median(off):.4f} px, "
        f"mean shift {dx.mean():+.4f}, {dy.mean():+.4f} px"
    )
    assert np.median(off) < 0.05
    assert abs(dx.mean()) < 0.02 and abs(dy.mean()) < 0.02
    # no turn, no scale: the shift does not depend on the place
    for shift in (dx, dy):
        slope = np.polyfit(x - 1024, shift, 1)[0], np.polyfit(y - 1024, shift, 1)[0]
        assert np.max(np.abs(slope)) * 1024 < 0.03


def test_one_zero_point_and_noise_as_predicted(field):
    image, rms, header, chosen, _, scene = field
    gain, fwhm = header["GAIN"], header["SEEING"] / header["PIXSCALE"]
    x, y = np.asarray(chosen["x_px"]), np.asarray(chosen["y_px"])
    radius = 3.0 * fwhm
    flux, error = aperture(image, x, y, radius, rms, gain)
    # unequal response of the pixels under a star, where the scene has it
    response = scene["detector"].get("prnu", 0.0) / np.sqrt(4 * np.pi * (fwhm / 2.3548) ** 2)
    error = np.hypot(error, response * flux)
    zero = np.asarray(chosen["mag_v"]) + 2.5 * np.log10(flux)
    sigma = 2.5 / np.log(10) * error / flux
    mean = np.average(zero, weights=sigma**-2)
    chi2 = np.sum(((zero - mean) / sigma) ** 2) / (len(zero) - 1)

    total = mean - 2.5 * np.log10(moffat_share(radius, fwhm, scene["telescope"]["moffat_beta"]))
    print(
        f"zero point {total:.4f} mag ({mean:.4f} in the aperture), "
        f"MAGZERO {header['MAGZERO']:.4f}; reduced chi2 {chi2:.3f} of {len(zero)} stars"
    )
    assert 0.6 < chi2 < 1.6
    assert abs(total - header["MAGZERO"]) < 0.02


def test_star_table_electrons_are_the_magnitudes(field):
    _, _, header, chosen, _, _ = field
    zero = np.asarray(chosen["mag_v"]) + 2.5 * np.log10(
        np.asarray(chosen["electrons"]) / header["GAIN"]
    )
    # extinction differs across the field by a few mmag
    assert np.median(zero) == pytest.approx(header["MAGZERO"], abs=0.005)


def test_low_elevation_needs_and_gets_distortion_terms(produce):
    """10 deg above the horizon refraction bends a field of 0.8 deg by half a pixel: SIP tells of it."""
    options = ["pointing.at=azel", "pointing.az_deg=137.0", "pointing.el_deg=10.0", "detector.size_px=4096"]
    options += ["telescope.plate_scale_arcsec=0.725447016", "exposures.duration_s=0.1"]
    text = sidereal_field().replace("ra_deg = 60.0\n", "").replace("dec_deg = 50.0", "")
    out = produce("render", text, *[word for option in options for word in ("--set", option)])
    header = fits.getheader(out / "frames" / "0000.fits")
    stars = Table.read(out / "stars" / "stars_0000.ecsv", format="ascii.ecsv")
    assert header["CTYPE1"] == "RA---TAN-SIP" and len(stars) >= 5
    x, y = WCS(header).all_world2pix(stars["ra_deg"], stars["dec_deg"], 0)
    off = np.hypot(x - stars["x_px"], y - stars["y_px"])
    print(f"10 deg elevation: astropy against star table {off.max():.1e} px")
    assert off.max() < 1e-3
