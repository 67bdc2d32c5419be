"""Frames in other forms, of other chips, and point images, against readers and code of others."""

import subprocess

import galsim
import numpy as np
import OpenEXR
import pytest
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS
from scenes import scene, sidereal_field
from support import tool

DARK = "\n".join(
    f'{source} = "off"'
    for source in ("airglow", "pollution", "twilight", "starlight", "moonlight", "zodiacal")
)


@pytest.fixture(scope="module")
def forms(produce):
    """A frame of a worn chip in every form."""
    text = sidereal_field(
        size=256,
        rest="""[output]
format = ["fits", "fits.fz", "exr", "png", "reg"]
planes = ["mean", "variance"]
""",
    ).replace("[output]\nstar_table = true\n", "")
    return produce(
        "render",
        text,
        *"--set detector.overscan_px=20 --set detector.prnu=0.02 --set detector.blooming=true".split(),
        *"--set detector.full_well_e=30000 --set telescope.vignetting=0.2".split(),
    )


def test_compressed_and_plain_frames_are_equal(forms):
    plain = forms / "frames" / "0000.fits"
    with fits.open(forms / "frames" / "0000.fits.fz", checksum=True) as packed, fits.open(plain) as whole:
        packed.verify("exception")
        assert packed[1].data.dtype == whole[0].data.dtype == np.uint16
        np.testing.assert_array_equal(packed[1].data, whole[0].data)
        for key in ("SCENESHA", "CRVAL1", "A_2_0", "TRIMSEC", "GAIN", "MAGZERO"):
            assert packed[1].header.get(key) == whole[0].header.get(key), key
        assert str(packed[1].header["HISTORY"]) == str(whole[0].header["HISTORY"])
    size = [(forms / "frames" / f"0000.{ending}").stat().st_size for ending in ("fits.fz", "fits")]
    print(f"Rice: {size[0] / size[1]:.2f} of the size")


@pytest.mark.filterwarnings("ignore")
def test_fitsverify_has_nothing_to_say_of_compressed_frames(forms):
    done = subprocess.run(
        [tool("fitsverify"), "-q", forms / "frames" / "0000.fits.fz"], capture_output=True, text=True
    )
    assert "verification OK" in done.stdout, done.stdout


def test_exr_channels_are_what_was_put_in(forms):
    with OpenEXR.File(str(forms / "frames" / "0000.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        header = dict(file.header())
    plain = fits.open(forms / "frames" / "0000.fits")[0]
    gain, bias = plain.header["GAIN"], plain.header["BIASLVL"]
    np.testing.assert_allclose(channels["electrons"], (plain.data - bias) * gain, rtol=1e-6, atol=1e-3)
    names = [name for name in channels if name.startswith("mean.")]
    assert {"mean.stars", "mean.dark", "mean.airglow"} <= set(names)
    total = sum(channels[name].astype(float) for name in names)
    mean = fits.getdata(forms / "planes" / "mean_0000.fits").astype(float)
    # the plane has the pixels' uneven response, 2 %; the channels do not
    lit = mean[:, :256] / total[:, :256]
    assert abs(lit.mean() - 1) < 1e-3 and abs(lit.std() - 0.02) < 1e-3
    assert (total[:, 256:] == 0).all() and (mean[:, 256:] == 0).all()
    assert header["SCENESHA"] == plain.header["SCENESHA"]
    assert float(np.ravel(header["EXPTIME"])[0]) == plain.header["EXPTIME"]


def test_sections_tell_light_from_overscan(forms):
    plain = fits.open(forms / "frames" / "0000.fits")[0]
    assert plain.data.shape == (256, 276)
    assert plain.header["TRIMSEC"] == plain.header["DATASEC"] == "[1:256,1:256]"
    assert plain.header["BIASSEC"] == "[257:276,1:256]"
    assert abs(plain.data[:, 256:].mean() - plain.header["BIASLVL"]) < 5 * 7 / np.sqrt(256 * 20)


def test_regions_name_places_that_ds9_counts_from_one(forms):
    lines = (forms / "regions" / "0000.reg").read_text().splitlines()
    assert lines[0].startswith("# Region file format: DS9") and lines[2] == "image"
    circles = [line for line in lines if line.startswith("circle(") and "text={" in line]
    x, y = np.array([line[7:].split(")")[0].split(",")[:2] for line in circles], float).T
    mag = np.array([line.split("text={")[1].rstrip("}") for line in circles], float)
    mean = fits.getdata(forms / "planes" / "mean_0000.fits")
    bright = (x > 8) & (x < 249) & (y > 8) & (y < 249) & (mag < 14)
    assert bright.sum() >= 3
    for u, v in zip(x[bright], y[bright]):
        # the centroid of what is above the surroundings, counted from 1
        rows, columns = slice(round(v) - 5, round(v) + 4), slice(round(u) - 5, round(u) + 4)
        light = mean[rows, columns] - np.median(mean[rows, columns])
        light[light < 0.2 * light.max()] = 0
        j, i = np.mgrid[rows, columns] + 1
        place = [(light * k).sum() / light.sum() for k in (i, j)]
        assert np.hypot(place[0] - u, place[1] - v) < 0.3, (place, u, v)


@pytest.mark.parametrize("bits", [8, 10, 12, 14, 16, 32])
def test_converters_of_any_width_read_back(produce, bits):
    out = produce("render", sidereal_field(size=64), "--set", f"detector.bits={bits}", "--set", "detector.bias_adu=200")
    with fits.open(out / "frames" / "0000.fits", checksum=True) as hdus:
        hdus.verify("exception")
        assert hdus[0].data.dtype == (np.uint32 if bits == 32 else np.uint16)
        assert hdus[0].data.max() < 2**bits and abs(np.median(hdus[0].data) - 210) < 20


def test_distorted_and_tilted_fields_against_astropy(produce, tmp_path):
    sip = tmp_path / "field.sip"
    sip.write_text("A_2_0 = 2e-6\nA_1_1 = -1e-6\nB_0_3 = -5e-10\nA_4_1 = 1e-16\n")
    out = produce(
        "render",
        sidereal_field(size=1024),
        *("--set", f"telescope.sip={sip}", "--set", "telescope.tilt_deg=[1.5,-0.7]"),
    )
    header = fits.getheader(out / "frames" / "0000.fits")
    assert header["CTYPE1"] == "RA---TAN-SIP" and header["A_ORDER"] == 5
    stars = Table.read(out / "stars" / "stars_0000.ecsv")
    x, y = WCS(header).all_world2pix(stars["ra_deg"], stars["dec_deg"], 0, tolerance=1e-9)
    worst = max(np.abs(x - stars["x_px"]).max(), np.abs(y - stars["y_px"]).max())
    straight, _ = WCS(header).wcs_world2pix(stars["ra_deg"], stars["dec_deg"], 0)
    print(f"distortion up to {np.abs(straight - x).max():.2f} px; astropy against star table {worst:.1e} px")
    assert worst < 1e-5 and np.abs(straight - x).max() > 0.3


POINT = scene(
    exposures="start = 2018-01-20T03:00:00Z\ncount = 1\nduration_s = 1.0\ntrack = \"sidereal\"",
    pointing='at = "target"\noffset_px = [0.3, -0.2]',
    station="scintillation = false\nseeing_arcsec = 1.8",
    detector="size_px = 256",
    rest=f"[sky]\n{DARK}\n[stars]\nenabled = false\n[output]\nplanes = [\"mean\"]\n",
    targets="""
[[target]]
name = "point"
orbit.fixed = { ra_deg = 60.0, dec_deg = 20.0 }
brightness.mag_v = 8.0
""",
)


@pytest.mark.parametrize("psf", ["gaussian", "moffat", "kolmogorov", "airy"])
def test_point_images_against_galsim(produce, psf):
    """The same point by GalSim, pixel by pixel: shares of the light."""
    telescope = ["--set", f"telescope.psf={psf}"]
    if psf == "airy":
        # rings that pixels resolve, and one wavelength
        telescope += ["--set", "telescope.plate_scale_arcsec=0.1", "--set", "telescope.filter=V"]
    out = produce("render", POINT, *telescope, "--set", "detector.dark_e_per_s=0")
    mean = fits.getdata(out / "planes" / "mean_0000.fits").astype(float)
    truth = Table.read(out / "truth.ecsv")[0]
    header = fits.getheader(out / "frames" / "0000.fits")
    scale = header["PIXSCALE"]
    seeing = 1.8 * header["AIRMASS"] ** 0.6
    fwhm = header["SEEING"]
    obscuration = 0.172466 / 0.3556
    lam_over_d = 550e-9 / 0.3556 * 206264.806
    image = {
        "gaussian": lambda: galsim.Gaussian(fwhm=fwhm),
        "moffat": lambda: galsim.Moffat(beta=3, fwhm=fwhm),
        "kolmogorov": lambda: galsim.Convolve(
            galsim.Kolmogorov(fwhm=seeing), galsim.Airy(lam_over_diam=lam_over_d, obscuration=obscuration)
        ),
        "airy": lambda: galsim.Airy(lam_over_diam=lam_over_d, obscuration=obscuration),
    }[psf]()
    if psf == "kolmogorov":
        image = image.withGSParams(folding_threshold=1e-3)
    drawn = galsim.ImageD(256, 256, xmin=0, ymin=0)
    image.drawImage(drawn, scale=scale, center=(truth["x_px"], truth["y_px"]))
    share = mean / truth["electrons"]
    worst = np.abs(share - drawn.array).max()
    half = np.hypot(*np.meshgrid(np.arange(256) - truth["x_px"], np.arange(256) - truth["y_px"])) < 12
    inside = [float(a[half].sum()) for a in (share, drawn.array)]
    print(f"{psf}: most {worst:.1e} of the light in a pixel, peak {drawn.array.max():.3f}; within 12 px {inside[0]:.4f} and {inside[1]:.4f}")
    # the filter's band, 90 nm wide, against its middle: per cents of the peak
    allowed = 0.02 * drawn.array.max() if psf == "airy" else 2e-4
    assert worst < allowed and abs(inside[0] - inside[1]) < (5e-3 if psf == "airy" else 1e-3)


def test_calibration_frames_calibrate(nightglass, tmp_path):
    sets = "--set detector.size_px=300 --set detector.prnu=0.03 --set detector.dark_e_per_s=2 --set telescope.vignetting=0.3".split()
    nightglass("calibrate", "pogs", "--count", "8", "--dark", "100", "-o", tmp_path / "c", "-q", *sets)

    def stack(kind):
        files = sorted((tmp_path / "c").glob(f"{kind}_*.fits"))
        assert len(files) == 8
        return np.mean([fits.getdata(path).astype(float) for path in files], axis=0), fits.getheader(files[0])

    (bias, _), (dark, header), (flat, of_flat) = map(stack, ("bias", "dark", "flat"))
    assert header["IMAGETYP"] == "Dark Frame" and header["EXPTIME"] == 100
    rate = (dark - bias).mean() * header["GAIN"] / 100
    assert abs(rate / header["DARKCUR"] - 1) < 0.01, rate
    flat = (flat - bias) * of_flat["GAIN"] / of_flat["LIGHT"]
    y, x = np.mgrid[:300, :300] - 149.5
    expected = 1 - 0.3 * (x**2 + y**2) / (2 * 150**2)
    ratio = flat / expected
    shot = 1 / np.sqrt(8 * of_flat["LIGHT"] * 0.85)
    assert abs(ratio.mean() - 1) < 2e-3 and abs(ratio.std() - np.hypot(0.03, shot)) < 1e-3
