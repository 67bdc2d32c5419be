"""A night of a geostationary satellite: do measurement and truth agree within the errors?"""

import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table
from scenes import geostationary_night
from scipy.stats import norm
from support import assert_units

UNITS = {
    "frame": None,
    "time_utc": None,
    "mjd_utc": "d",
    "exptime_s": "s",
    "target": None,
    "x_px": "pix",
    "y_px": "pix",
    "ra_deg": "deg",
    "dec_deg": "deg",
    "flux_e": "electron",
    "flux_err_e": "electron",
    "mag_v": "mag",
    "mag_err": "mag",
    "mag_v_norm": "mag",
    "zeropoint_mag": "mag",
    "background_e_px": "electron / pix",
    "airmass": None,
    "phase_deg": "deg",
    "range_km": "km",
    **{f"{who}_{axis}": None for who in ("sun", "obs") for axis in "xyz"},
    "flags": None,
}
NOT_DETECTED, BORROWED = 128, 64
SPOILT = 1 | 2 | 4 | 8 | 16 | 32 | 256  # saturated, bloomed, ray, edge, trail, neighbour, bad pixel


@pytest.fixture(scope="module")
def night(produce):
    """(measured, truth, directory), one row per exposure; stars of the catalogue alone, which photometry knows."""
    out = produce("run", geostationary_night(), "--set", "stars.synthetic=false")
    measured = Table.read(out / "lightcurve.ecsv", format="ascii.ecsv")
    truth = Table.read(out / "truth.ecsv", format="ascii.ecsv")
    assert list(measured["frame"]) == list(truth["frame"]) == list(range(120))
    return measured, truth, out


def pulls(name, difference, error, usable):
    """Mean and standard deviation of (measured - true)/error, printed."""
    z = np.asarray(difference / error, float)[usable]
    assert np.all(np.isfinite(z))
    print(
        f"{name}: {len(z)} points, mean {z.mean():+.3f}, std {z.std(ddof=1):.3f}, "
        f"largest {np.abs(z).max():.2f}"
    )
    assert np.abs(z).max() < norm.isf(1e-7), "an outlier without a flag"
    return z.mean(), z.std(ddof=1)


def clean(measured):
    usable = (np.asarray(measured["flags"]) & (SPOILT | NOT_DETECTED | BORROWED)) == 0
    print(f"{usable.sum()} of {len(measured)} points without a flag")
    assert usable.sum() >= 80
    return usable


def test_columns_and_units(night):
    measured, _, _ = night
    assert_units(measured, UNITS)
    assert measured.meta["origin"] == "measured"
    for who in ("sun", "obs"):
        length = np.sqrt(sum(np.asarray(measured[f"{who}_{axis}"]) ** 2 for axis in "xyz"))
        assert np.max(np.abs(length - 1)) < 1e-9


def test_electrons(night):
    measured, truth, _ = night
    difference = measured["flux_e"] - truth["electrons"]
    mean, std = pulls("flux", difference, measured["flux_err_e"], clean(measured))
    assert abs(mean) < 0.2 and 0.8 < std < 1.25


def test_magnitudes(night):
    measured, truth, _ = night
    difference = measured["mag_v"] - truth["mag_v"]
    mean, std = pulls("mag_v", difference, measured["mag_err"], clean(measured))
    assert abs(mean) < 0.25 and 0.7 < std < 1.35


def test_zero_point_is_the_frames(night):
    """zeropoint_mag counts electrons, MAGZERO adu; both for the whole exposure."""
    measured, _, out = night
    usable = clean(measured)
    header = [fits.getheader(out / "frames" / f"{k:04d}.fits") for k in range(120)]
    true = np.array([h["MAGZERO"] + 2.5 * np.log10(h["GAIN"]) for h in header])
    off = (np.asarray(measured["zeropoint_mag"]) - true)[usable]
    print(
        f"zero point: mean error {off.mean() * 1e3:+.2f} mmag, scatter {off.std() * 1e3:.2f} mmag"
    )
    assert abs(off.mean()) < 0.01 and off.std() < 0.05
    flux = np.asarray(measured["flux_e"])[usable]
    again = np.asarray(measured["zeropoint_mag"])[usable] - 2.5 * np.log10(flux)
    assert np.allclose(again, np.asarray(measured["mag_v"])[usable], atol=1e-6)


def test_places(night):
    """The measured place is the true one within 0.1 px; the plan's place within 0.3 arcsec."""
    measured, truth, out = night
    usable = clean(measured)
    off = np.hypot(measured["x_px"] - truth["x_px"], measured["y_px"] - truth["y_px"])[usable]
    print(f"place on the frame: median error {np.median(off):.4f} px")
    assert np.median(off) < 0.1
    plan = Table.read(out / "plan.ecsv", format="ascii.ecsv")
    d_ra = (measured["ra_deg"] - plan["ra_deg"]) * np.cos(np.radians(plan["dec_deg"])) * 3600
    d_dec = (measured["dec_deg"] - plan["dec_deg"]) * 3600
    off = np.hypot(d_ra, d_dec)[usable]
    print(f"place on the sky: median error {np.median(off):.3f} arcsec (pixel 3 arcsec)")
    assert np.median(off) < 0.3


def test_background(night):
    measured, truth, _ = night
    share = np.asarray(measured["background_e_px"] / truth["background_e_px"], float)
    print(f"background: measured over true, median {np.median(share):.4f}")
    assert abs(np.median(share) - 1) < 0.05


def test_stars_that_no_catalogue_lists(produce):
    """Stars fainter than the catalogue cross the target too: they spoil few points, and by no more than their own light."""
    out = produce("run", geostationary_night(), "--set", "output.star_table=true")
    measured = Table.read(out / "lightcurve.ecsv", format="ascii.ecsv")
    truth = Table.read(out / "truth.ecsv", format="ascii.ecsv")
    usable = (np.asarray(measured["flags"]) & (SPOILT | NOT_DETECTED)) == 0
    z = np.asarray((measured["flux_e"] - truth["electrons"]) / measured["flux_err_e"], float)
    off = usable & (np.abs(z) > norm.isf(1e-7))
    print(f"hidden stars: {off.sum()} of {usable.sum()} points off by more than 5.2 sigma, median {np.median(z[usable]):+.3f}")
    assert off.sum() <= 0.03 * usable.sum() and abs(np.median(z[usable])) < 0.5
    for frame in np.flatnonzero(off):
        stars = Table.read(out / "stars" / f"stars_{frame:04d}.ecsv", format="ascii.ecsv")
        away = np.hypot(stars["x_px"] - truth["x_px"][frame], stars["y_px"] - truth["y_px"][frame])
        near = stars["electrons"][away < 15.0]
        excess = measured["flux_e"][frame] - truth["electrons"][frame]
        assert abs(excess) < np.sum(near) + 5 * measured["flux_err_e"][frame]
