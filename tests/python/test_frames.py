"""Frames as files: noise and level of a flat patch, header, FITS conformance, other readers."""

import re
import subprocess
import tomllib

import astropy.units as u
import numpy as np
import pytest
from astropy.coordinates import EarthLocation
from astropy.io import fits
from astropy.time import Time
from astropy.wcs import WCS
from light_reference import pickering
from scenes import flat_patch, sidereal_field
from support import tool

# number: V mag arcsec^-2 at the ground, about 27 e-/px/s; the rest of the sky as it is
SKIES = {"dark": "", "bright": "airglow = 18.0", "brighter": "airglow = 16.5"}


@pytest.fixture(scope="module", params=SKIES)
def patch(request, produce):
    """Two equal exposures of sky and detector alone, and the resolved scene."""
    out = produce("render", flat_patch(sky=SKIES[request.param]))
    files = [out / "frames" / name for name in ("0000.fits", "0001.fits")]
    return files, tomllib.loads((out / "scene.toml").read_text()), request.param


def pixels(path):
    return fits.getdata(path).astype(float)


def test_variance_is_shot_noise_and_read_noise(patch):
    """Half the variance of the difference: fixed patterns and gradients cancel."""
    files, _, name = patch
    header = fits.getheader(files[0])
    gain, read_noise = header["GAIN"], header["RDNOISE"]
    first, second = map(pixels, files)
    variance = np.var(second - first) / 2
    mean_adu = (first.mean() + second.mean()) / 2 - header["BIASLVL"]
    expected = mean_adu / gain + (read_noise / gain) ** 2 + 1 / 12
    sigma = expected * np.sqrt(2 / (first.size - 1))
    print(
        f"{name}: variance {variance:.3f} adu2, expected {expected:.3f}, "
        f"{(variance - expected) / sigma:+.2f} sigma"
    )
    assert abs(variance - expected) < 4 * sigma


def test_level_is_the_sum_of_the_sky_cards(patch):
    files, _, name = patch
    for path in files:
        header = fits.getheader(path)
        mid = header["NAXIS1"] // 2
        centre = pixels(path)[mid - 128 : mid + 128, mid - 128 : mid + 128]
        level_e = (centre.mean() - header["BIASLVL"]) * header["GAIN"]
        noise = centre.std() * header["GAIN"] / np.sqrt(centre.size)
        print(f"{name}: {level_e:.3f} e-/px, SKYSUM {header['SKYSUM']:.3f}, noise {noise:.3f}")
        assert abs(level_e / header["SKYSUM"] - 1) < 0.005 + 3 * noise / level_e


def test_sky_cards_add_up(patch):
    files, _, _ = patch
    header = fits.getheader(files[0])
    parts = {k: v for k, v in header.items() if k.startswith("SKY") and k != "SKYSUM"}
    print(parts)
    assert sum(parts.values()) == pytest.approx(header["SKYSUM"], rel=1e-5)
    assert header["SKYDARK"] == pytest.approx(header["DARKCUR"] * header["EXPTIME"], rel=1e-6)


def test_neighbouring_pixels_are_independent(patch):
    """Read noise and photons are white: no correlation between neighbours or frames."""
    files, _, _ = patch
    first, second = map(pixels, files)
    noise = second - first
    noise -= noise.mean()
    limit = 4.5 * noise.var() / np.sqrt(noise.size)
    assert abs(np.mean(noise[:, 1:] * noise[:, :-1])) < limit
    assert abs(np.mean(noise[1:] * noise[:-1])) < limit


@pytest.fixture(scope="module")
def field(produce):
    """A frame of stars, its header, its directory."""
    out = produce("render", sidereal_field(size=1024))
    path = out / "frames" / "0000.fits"
    return path, fits.getheader(path), out


def seconds(header, key):
    return Time(header[key], scale="utc")


def test_structure(field):
    path, header, _ = field
    with fits.open(path) as hdus:
        assert len(hdus) == 1
    raw = fits.open(path, do_not_scale_image_data=True)[0].header
    assert (raw["BITPIX"], raw["BZERO"], raw["NAXIS"]) == (16, 32768, 2)
    assert (raw["NAXIS1"], raw["NAXIS2"]) == (1024, 1024)
    assert header["BUNIT"] == "adu"


def test_times(field):
    _, header, _ = field
    start, end = seconds(header, "DATE-OBS"), seconds(header, "DATE-END")
    assert header["TIMESYS"] == "UTC" and header["TREFPOS"].startswith("TOPOCEN")
    assert header["EXPTIME"] == header["XPOSURE"] == 2.0
    assert start == Time("2018-01-20T03:00:00", scale="utc")
    assert abs((end - start).to_value("s") - header["EXPTIME"]) < 1e-6
    assert abs((seconds(header, "DATE-BEG") - start).to_value("s")) < 1e-6
    middle = (seconds(header, "DATE-AVG") - start).to_value("s")
    assert abs(middle - header["EXPTIME"] / 2) < 1e-6
    assert abs(header["MJD-OBS"] - start.mjd) < 1e-10
    assert abs(header["MJD-AVG"] - seconds(header, "DATE-AVG").mjd) < 1e-10


def test_place(field):
    _, header, _ = field
    assert header["SITELAT"] == pytest.approx(32.9, abs=1e-9)
    assert header["SITELONG"] == pytest.approx(-105.533333, abs=1e-9)
    place = EarthLocation.from_geodetic(
        header["SITELONG"] * u.deg, header["SITELAT"] * u.deg, header["SITEELEV"] * u.m
    )
    for axis, value in zip("XYZ", place.geocentric):
        assert abs(header[f"OBSGEO-{axis}"] - value.to_value("m")) < 1.0
    assert "TELESCOP" in header and "INSTRUME" in header


def test_world_coordinates(field):
    _, header, _ = field
    assert re.fullmatch(r"RA---TAN(-SIP)?", header["CTYPE1"])
    assert re.fullmatch(r"DEC--TAN(-SIP)?", header["CTYPE2"])
    assert header["RADESYS"] == "ICRS"
    assert header["CRPIX1"] == (header["NAXIS1"] + 1) / 2
    assert header["CRPIX2"] == (header["NAXIS2"] + 1) / 2
    assert abs(header["CRVAL1"] - 60.0) < 1e-3 and abs(header["CRVAL2"] - 50.0) < 1e-3
    assert (header["RA"], header["DEC"]) == pytest.approx((60.0, 50.0), abs=1e-3)
    cd = np.array([[header["CD1_1"], header["CD1_2"]], [header["CD2_1"], header["CD2_2"]]])
    scale = np.sqrt(abs(np.linalg.det(cd))) * 3600
    assert scale == pytest.approx(2.0, rel=1e-3)
    assert header["PIXSCALE"] == pytest.approx(2.0, rel=1e-6)
    # north up, east to the left
    assert np.linalg.det(cd) < 0 and cd[1, 1] > 0
    assert not WCS(header).has_distortion or header["CTYPE1"].endswith("SIP")


def test_instrument(field):
    _, header, out = field
    scene = tomllib.loads((out / "scene.toml").read_text())
    detector, telescope = scene["detector"], scene["telescope"]
    assert header["GAIN"] == header["EGAIN"] == detector["gain_e_per_adu"]
    assert header["RDNOISE"] == detector["read_noise_e"]
    assert header["BIASLVL"] == detector["bias_adu"]
    assert header["XPIXSZ"] == detector["pixel_um"]
    assert header["CCD-TEMP"] == detector["temperature_c"]
    full = min(detector["full_well_e"] / detector["gain_e_per_adu"] + detector["bias_adu"], 65535)
    assert header["SATURATE"] == pytest.approx(full, rel=1e-3)
    assert header["APTDIA"] == pytest.approx(telescope["aperture_m"] * 1e3)
    area = np.pi / 4 * (telescope["aperture_m"] ** 2 - telescope["obstruction_m"] ** 2) * 1e6
    assert header["APTAREA"] == pytest.approx(area, rel=1e-6)
    focal_mm = detector["pixel_um"] * 1e-3 / np.radians(header["PIXSCALE"] / 3600)
    assert header["FOCALLEN"] == pytest.approx(focal_mm, rel=1e-5)
    assert "FILTER" in header


def test_seeing_grows_with_airmass(field):
    """As delivered: the station's 4.8 arcsec times airmass^0.6, optics (0.3 arcsec) on top."""
    _, header, _ = field
    seeing = 4.8 * header["AIRMASS"] ** 0.6
    assert seeing * 0.999 <= header["SEEING"] < seeing * 1.03


def test_pointing_and_sky(field):
    _, header, _ = field
    assert header["AIRMASS"] == pytest.approx(pickering(header["CENTALT"]), rel=1e-4)
    assert 65 < header["CENTALT"] < 75
    for key in ("CENTAZ", "SUNALT", "MOONALT", "MOONSEP", "MOONILL", "MAGZERO"):
        assert np.isfinite(header[key]), key
    assert header["SUNALT"] < -30 and 0 <= header["MOONILL"] <= 1


def test_simulation(field):
    _, header, _ = field
    assert header["SIMULATD"] is True
    assert header["CREATOR"].startswith("nightglass")
    assert header["SIMSEED"] == 20180120
    assert re.fullmatch("[0-9a-f]{64}", header["SCENESHA"])


def test_checksums_by_astropy(field):
    path, header, _ = field
    assert "CHECKSUM" in header and "DATASUM" in header
    for key in ("CHECKSUM", "DATASUM"):
        assert not re.search(r"\d{4}-\d{2}-\d{2}", header.comments[key]), "a time stamp"
    with fits.open(path, checksum=True) as hdus:
        assert hdus[0].verify_checksum() == 1
        assert hdus[0].verify_datasum() == 1


def test_fitsverify_has_nothing_to_say(field):
    path, _, _ = field
    done = subprocess.run([tool("fitsverify"), str(path)], capture_output=True, text=True)
    assert "found 0 warning(s) and 0 error(s)" in done.stdout, done.stdout[-3000:]


def test_sextractor_reads_the_frame(field, tmp_path):
    """Source Extractor detects the stars and places them by the frame's own WCS."""
    path, header, _ = field
    (tmp_path / "out.param").write_text("XWIN_IMAGE\nYWIN_IMAGE\nALPHAWIN_J2000\nDELTAWIN_J2000\n")
    command = [tool("source-extractor"), str(path), "-c", "/dev/null"]
    options = {
        "PARAMETERS_NAME": "out.param",
        "CATALOG_NAME": "out.cat",
        "FILTER": "N",
        "DETECT_THRESH": "10",
        "SATUR_KEY": "SATURATE",
        "GAIN_KEY": "GAIN",
        "VERBOSE_TYPE": "QUIET",
    }
    for key, value in options.items():
        command += [f"-{key}", value]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    x, y, ra, dec = np.loadtxt(tmp_path / "out.cat", ndmin=2).T
    assert len(x) >= 10
    ours = WCS(header).all_pix2world(x, y, 1)
    off = np.hypot((ours[0] - ra) * np.cos(np.radians(dec)), ours[1] - dec) * 3600
    print(f"{len(x)} sources; SExtractor's and astropy's places differ by {off.max():.2g} arcsec")
    assert off.max() < 0.02
