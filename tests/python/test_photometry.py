"""nightglass photometry on frames that others drew: GalSim, and numpy alone; against the truth and against sep."""

import json

import galsim
import numpy as np
import pytest
import sep
from astropy import units as u
from astropy.coordinates import SkyCoord
from astropy.io import fits
from astropy.table import Table
from astropy.wcs import WCS
from scenes import geostationary_night
from scipy.special import erf

SIZE, SCALE, GAIN, READ_NOISE, BIAS, SKY = 1024, 0.72, 1.4, 8.0, 300.0, 40.0
ZERO_POINT = 22.4
FWHM = 3.2
SATURATED, NOT_DETECTED = 1, 128


@pytest.fixture(scope="module")
def field(nightglass, tmp_path_factory):
    """(world coordinates, stars, catalogue file): 60 stars that stand apart, and a hole in the middle."""
    random = np.random.default_rng(11)
    wcs = WCS(naxis=2)
    wcs.wcs.ctype = ["RA---TAN", "DEC--TAN"]
    wcs.wcs.crval, wcs.wcs.crpix = [123.4, 21.7], [(SIZE + 1) / 2] * 2
    angle = np.radians(3.0)
    turn = np.array([[-np.cos(angle), np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    wcs.wcs.cd = turn * SCALE / 3600
    places = []
    while len(places) < 60:
        place = random.uniform(60, SIZE - 60, 2)
        away = [np.hypot(*(place - other)) for other in [*places, (SIZE / 2, SIZE / 2)]]
        if min(away) > 55:
            places.append(place)
    places = np.array(places)
    sky = wcs.pixel_to_world(places[:, 0], places[:, 1])
    mag = random.uniform(9.5, 14.0, 60)
    stars = Table({"ra": sky.ra.deg * u.deg, "dec": sky.dec.deg * u.deg, "V": mag * u.mag})
    stars["B-V"] = np.full(60, 0.653) * u.mag
    base = tmp_path_factory.mktemp("field")
    stars.write(base / "stars.ecsv", format="ascii.ecsv")
    nightglass(
        *("catalog", "import", base / "stars.ecsv", "-o", base / "stars.ngc"),
        *("--ra", "ra", "--dec", "dec", "--mag", "V", "--bv", "B-V", "--epoch", "2026.0", "-q"),
    )
    return wcs, places, mag, base


def galsim_image(places, electrons, trail=(0.0, 0.0)):
    """Moffat profiles, beta 3, integrated over pixels; drawn along a trail if there is one."""
    image = galsim.ImageD(SIZE, SIZE, scale=1.0)
    psf = galsim.Moffat(beta=3.0, fwhm=FWHM)
    length = np.hypot(*trail)
    if length > 0:
        line = galsim.Box(length, 1e-3).rotate(np.arctan2(trail[1], trail[0]) * galsim.radians)
        psf = galsim.Convolve(psf, line)
    for (x, y), flux in zip(places, electrons):
        at = galsim.PositionD(x + 1, y + 1)
        size = 160 + 2 * int(length)
        stamp = psf.withFlux(flux).drawImage(nx=size, ny=size, scale=1.0, center=at, dtype=float)
        common = stamp.bounds & image.bounds
        image[common] += stamp[common]
    return image.array.copy()


def numpy_image(places, electrons, trail=(0.0, 0.0)):
    """Gaussians integrated over pixels by erf; a trail is 2 of them a pixel."""
    image = np.zeros((SIZE, SIZE))
    sigma = FWHM / 2.3548200450309493
    count = max(1, int(2 * np.hypot(*trail)))
    steps = ((np.arange(count) + 0.5) / count - 0.5)[:, None] * np.array(trail)
    edges = np.arange(SIZE + 1) - 0.5
    for place, flux in zip(places, electrons):
        for x, y in place + steps:
            low = np.clip([int(x) - 30, int(y) - 30], 0, SIZE)
            high = np.clip([int(x) + 31, int(y) + 31], 0, SIZE)
            ex = np.diff(erf((edges[low[0] : high[0] + 1] - x) / (np.sqrt(2) * sigma))) / 2
            ey = np.diff(erf((edges[low[1] : high[1] + 1] - y) / (np.sqrt(2) * sigma))) / 2
            image[low[1] : high[1], low[0] : high[0]] += flux / count * ey[:, None] * ex
    return image


def develop(mean, seed):
    random = np.random.default_rng(seed)
    electrons = random.poisson(mean + SKY) + random.normal(0, READ_NOISE, mean.shape)
    return np.clip(np.rint(electrons / GAIN + BIAS), 0, 65535).astype(np.uint16)


def write(path, adu, wcs, trail=(0.0, 0.0), exptime=5.0, **cards):
    """A frame as a common camera program writes it."""
    header = wcs.to_header()
    header["EXPTIME"], header["DATE-OBS"] = exptime, "2026-01-20T03:00:00"
    header["EGAIN"], header["RDNOISE"], header["BIASLVL"] = GAIN, READ_NOISE, BIAS
    header["OBJECT"] = "TEST"
    if np.hypot(*trail) > 0:
        # the frame moves against its stars: sky places of both ends of a trail tell the rate
        half = np.array(trail) / 2
        middle = np.array([SIZE / 2 - 0.5] * 2)
        a, b = (wcs.pixel_to_world(*(middle + sign * half)) for sign in (1, -1))
        rate = [(b.ra - a.ra).arcsec * np.cos(a.dec.radian) / exptime, (b.dec - a.dec).arcsec / exptime]
        header["TRKRA"], header["TRKDEC"] = rate
    header.update(cards)
    fits.PrimaryHDU(adu, header).writeto(path, overwrite=True)


def measured(nightglass, base, frames, *options):
    text = nightglass(
        *("photometry", *frames, "--catalog", base / "stars.ngc", "--errors", "--json", *options)
    )
    return Table(rows=json.loads(text)["rows"])


@pytest.mark.parametrize("draw", [galsim_image, numpy_image], ids=["galsim", "numpy"])
@pytest.mark.parametrize("trail", [(0.0, 0.0), (38.0, 9.0)], ids=["points", "trails"])
@pytest.mark.parametrize("target_e", [2500.0, 60000.0])
def test_frames_drawn_by_others(nightglass, field, tmp_path, draw, trail, target_e):
    """12 exposures: flux, zero point and magnitude are the truth's within their errors (mean pull within 4 / sqrt(12), no
    pull above 4.5), and no worse than those of sep's aperture of 4 px, calibrated by the same stars."""
    wcs, places, mag, base = field
    flux = 10 ** (0.4 * (ZERO_POINT - mag))
    target = np.array([SIZE / 2 - 0.3, SIZE / 2 + 0.2])
    mean = draw(places, flux, trail) + draw([target], [target_e])
    frames = []
    for seed in range(12):
        frames.append(tmp_path / f"frame_{seed:04d}.fits")
        write(frames[-1], develop(mean, seed), wcs, trail)
    xy = f"{target[0]},{target[1]}"
    rows = measured(nightglass, base, frames, "--xy", xy)
    assert not np.any(np.array(rows["flags"]) & (SATURATED | NOT_DETECTED))
    true_mag = ZERO_POINT - 2.5 * np.log10(target_e)
    pulls = {
        "flux": (rows["flux_e"] - target_e) / rows["flux_err_e"],
        "zero point": (rows["zeropoint_mag"] - ZERO_POINT) / rows["err_zeropoint_mag"],
        "magnitude": (rows["mag_v"] - true_mag) / rows["mag_err"],
    }
    for name, pull in pulls.items():
        pull = np.asarray(pull, float)
        print(f"{draw.__name__} {trail} {target_e:.0f} e {name}: {pull.mean():+.2f} +- {pull.std(ddof=1):.2f}")
        assert abs(pull.mean()) < 4 / np.sqrt(12) and np.abs(pull).max() < 4.5, name
        # 11 degrees of freedom: chance alone leaves this range once in 5000 times
        assert pull.std(ddof=1) < 1.75, name
    if trail != (0.0, 0.0):
        return  # sep has no aperture for trails: its zero point would have another aperture's losses
    by_sep = []
    for path in frames:
        adu = fits.getdata(path).astype(np.float32)
        background = sep.Background(adu, bw=64, bh=64)
        x, y = np.append(places[:, 0], target[0]), np.append(places[:, 1], target[1])
        light, error, _ = sep.sum_circle(adu - background, x, y, 4.0, err=background.globalrms, gain=GAIN)
        bright = light[:-1] > 20 * error[:-1]
        zero = np.median(mag[bright] + 2.5 * np.log10(light[:-1][bright]))
        by_sep.append(zero - 2.5 * np.log10(light[-1]))
    ours, theirs = np.asarray(rows["mag_v"], float), np.array(by_sep)
    scatter = np.std(ours - true_mag, ddof=1), np.std(theirs - true_mag, ddof=1)
    print(f"scatter {scatter[0]:.4f} mag, sep {scatter[1]:.4f} mag, mean difference {np.mean(ours - theirs):+.4f}")
    assert abs(np.mean(ours - theirs)) < 4 * np.hypot(*scatter) / np.sqrt(12) + 0.003
    # the same noise in both: ours may exceed theirs by chance only
    assert scatter[0] < 1.3 * scatter[1]


def test_the_pointing_is_wrong(nightglass, field, tmp_path):
    """0.1 deg and 3 deg of rotation off, more than half of this field: the stars tell."""
    wcs, places, mag, base = field
    target = np.array([SIZE / 2, SIZE / 2 + 0.2])
    flux = 10 ** (0.4 * (ZERO_POINT - mag))
    adu = develop(numpy_image(places, flux) + numpy_image([target], [30000.0]), 5)
    wrong = wcs.deepcopy()
    wrong.wcs.crval = wcs.wcs.crval + np.array([0.07, -0.06])
    a = np.radians(3.0)
    wrong.wcs.cd = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]) @ wcs.wcs.cd
    write(tmp_path / "a_0001.fits", adu, wrong)
    row = measured(nightglass, base, [tmp_path / "a_0001.fits"], "--xy", f"{target[0]},{target[1]}")[0]
    there = wcs.pixel_to_world(row["x_px"], row["y_px"])
    found = SkyCoord(row["ra_deg"] * u.deg, row["dec_deg"] * u.deg)
    print(f"{there.separation(found).arcsec:.3f} arcsec off")
    assert there.separation(found).arcsec < 0.1 * SCALE
    assert abs(row["zeropoint_mag"] - ZERO_POINT) < 5 * row["err_zeropoint_mag"]


def test_calibration_frames(nightglass, field, tmp_path):
    """Vignetting of 30 % in the corner, 2 % of pixel-to-pixel scatter, a bias with structure, dark current: flattened."""
    wcs, places, mag, base = field
    random = np.random.default_rng(3)
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE - 0.5
    flat = (1 - 0.6 * (x**2 + y**2)) * random.normal(1, 0.02, (SIZE, SIZE))
    flat /= np.median(flat)
    bias = BIAS + 4 * np.sin(np.arange(SIZE) / 9.0)
    dark_rate = random.gamma(2.0, 0.5, (SIZE, SIZE))
    flux = 10 ** (0.4 * (ZERO_POINT - mag))
    target = np.array([860.2, 180.4])
    clear = np.hypot(*(places - target).T) > 50
    scene = numpy_image(places[clear], flux[clear]) + numpy_image([target], [20000.0])

    def expose(light, seconds):
        electrons = random.poisson(light * flat + dark_rate * seconds) + random.normal(0, READ_NOISE, flat.shape)
        return np.clip(np.rint(electrons / GAIN + bias), 0, 65535).astype(np.uint16)

    def several(name, count, light, seconds):
        paths = [tmp_path / f"{name}_{k}.fits" for k in range(count)]
        for path in paths:
            fits.PrimaryHDU(expose(light, seconds), fits.Header({"EXPTIME": seconds})).writeto(path)
        return paths

    biases, darks = several("bias", 9, 0.0, 0.0), several("dark", 9, 0.0, 20.0)
    flats = several("flat", 9, 30000.0, 3.0)
    lights = [tmp_path / f"light_{k:04d}.fits" for k in range(6)]
    for path in lights:
        write(path, expose(scene + SKY, 5.0), wcs)
    options = ["--xy", "860.2,180.4", "--biases", *biases, "--darks", *darks, "--flats", *flats]
    rows = measured(nightglass, base, lights, *options)
    pull = np.asarray((rows["flux_e"] - 20000.0) / rows["flux_err_e"], float)
    print(f"calibrated: {pull.mean():+.2f} +- {pull.std(ddof=1):.2f}")
    assert abs(pull.mean()) < 4 / np.sqrt(6) and np.abs(pull).max() < 4.5
    plain = measured(nightglass, base, lights, "--xy", "860.2,180.4")
    off = np.mean(np.asarray(plain["flux_e"], float)) / 20000.0 - 1
    print(f"not calibrated: {100 * off:+.1f} %")
    assert off < -0.02


@pytest.fixture(scope="module")
def night(produce, nightglass, tmp_path_factory):
    """Five frames of a geostationary satellite, run; and measured again with no hint where it is."""
    sets = ["--set", "detector.size_px=1536", "--set", "exposures.cadence_s=60.0"]
    out = produce("run", geostationary_night(5, 12.0), *sets)
    found = tmp_path_factory.mktemp("found")
    frames = sorted((out / "frames").glob("*.fits"))
    nightglass("photometry", *frames, "--find", "-o", found, "--also", "csv,alcdef", "-q")
    return out, found


def test_unknown_objects_are_found(night):
    """The satellite is found among the trails, alone, where it is, and as bright as with its place known."""
    out, found = night
    known = Table.read(out / "lightcurve.ecsv", format="ascii.ecsv")
    rows = Table.read(found / "lightcurve.ecsv", format="ascii.ecsv")
    assert set(rows["target"]) == {"object-1"} and len(rows) == 5
    for name, allowed in (("x_px", 0.02), ("ra_deg", 1e-5), ("mag_v", 0.005)):
        assert np.max(np.abs(rows[name] - known[name])) < allowed, name
    text = Table.read(found / "lightcurve.csv", format="csv")
    assert np.all(text["flux_e"] == rows["flux_e"])


def test_tracking_data_messages(night):
    """An independent reader finds the light curve's places and magnitudes."""
    from ccsds_ndm import Tdm

    out, _ = night
    text = (out / "lightcurve.tdm").read_text()
    rows = Table.read(out / "lightcurve.ecsv", format="ascii.ecsv")
    message = Tdm.from_str(text)
    segments = message.segments if hasattr(message, "segments") else message.body.segments
    values = [float(o.value) for s in segments for o in s.data.observations]
    expected = np.array([rows["ra_deg"], rows["dec_deg"], rows["mag_v"]]).T.ravel()
    assert len(values) == 15 and np.max(np.abs(np.array(values) - expected)) < 1e-9
    assert str(segments[0].metadata.reference_frame).endswith("ICRF")


def test_parquet_holds_the_table(night, nightglass, tmp_path):
    """An independent reader finds the columns, their units and every number of the table."""
    if "parquet" not in nightglass("photometry", "--help"):
        pytest.skip("built without the feature parquet")
    import pyarrow.parquet

    out, _ = night
    frames = sorted((out / "frames").glob("*.fits"))
    nightglass("photometry", *frames, "-o", tmp_path, "--also", "parquet", "-q")
    rows = Table.read(tmp_path / "lightcurve.ecsv", format="ascii.ecsv")
    found = pyarrow.parquet.read_table(tmp_path / "lightcurve.parquet")
    assert found.column_names == rows.colnames
    for name in rows.colnames:
        own, theirs = np.asarray(rows[name]), found[name].to_pylist()
        same = [a == b or (a != a and b != b) for a, b in zip(own.tolist(), theirs)]
        assert all(same) and len(same) == 5, name
