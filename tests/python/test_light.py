"""Photon rates: the check numbers of expected_light.json, and headers of rendered frames."""

import json

import light_reference as light
import numpy as np
import pytest
from astropy.io import fits
from scenes import flat_patch, sidereal_field

PLAUSIBLE = {
    # published or independently known, and how far off they may be (relative, or mag)
    "sun_mag_v": (-26.746, 0.002),
    "v16_krag_kpno_zenith_e_s": (331.0, 0.5),
    "ground_22mag_krag_e_px_s": (0.75, 0.005),
    "airglow_zenith_mag_arcsec2": (22.29, 0.01),
    "airglow_zenith_krag_e_px_s": (0.75, 0.005),
    "airglow_zenith_krag_kpno_e_px_s": (0.70, 0.01),
    "v8_kaf16803_kpno_45deg_e_s": (8.7e5, 0.01e5),
    "s10_mag_arcsec2": (27.78, 0.005),
}


def test_expected_numbers_are_what_the_tables_give():
    expected = json.loads(light.EXPECTED.read_text())
    assert light.numbers() == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("name", PLAUSIBLE)
def test_expected_numbers_are_plausible(name):
    value, allowed = PLAUSIBLE[name]
    assert light.numbers()[name] == pytest.approx(value, abs=allowed)


@pytest.fixture(scope="module", params=["kpno", "ctio", "krag2003"])
def field(request, produce):
    """Header of a frame, and the extinction it was made with."""
    text = sidereal_field(size=256, duration_s=3.0, station=f'extinction = "{request.param}"')
    out = produce("render", text, "--set", "telescope.throughput=0.5")
    return fits.getheader(out / "frames" / "0000.fits"), request.param


def zero_point(qe, extinction, header, throughput=0.5):
    """mag_v of 1 adu, by our own integral."""
    rate = light.electron_rate(
        0.0, qe, extinction, header["AIRMASS"], header["APTAREA"] * 1e-6, throughput
    )
    return 2.5 * np.log10(rate * header["EXPTIME"] / header["GAIN"])


def test_zero_point(field):
    header, extinction = field
    expected = zero_point("kaf16803", extinction, header)
    share = 10 ** (0.4 * (header["MAGZERO"] - expected)) - 1
    print(f"{extinction}: MAGZERO {header['MAGZERO']:.4f}, numpy {expected:.4f}, {share:+.2e}")
    assert abs(share) < 1e-5


@pytest.mark.parametrize("qe", ["krag2003", "e2v230_84", "andor_dw936", "thx7899m"])
def test_zero_point_of_other_chips(produce, qe):
    text = sidereal_field(size=64, duration_s=3.0)
    options = ("--set", "telescope.throughput=0.4", "--set", f'detector.qe="{qe}"')
    header = fits.getheader(produce("render", text, *options) / "frames" / "0000.fits")
    expected = zero_point(qe, "kpno", header, throughput=0.4)
    print(f"{qe}: MAGZERO {header['MAGZERO']:.4f}, numpy {expected:.4f}")
    assert abs(10 ** (0.4 * (header["MAGZERO"] - expected)) - 1) < 1e-4


@pytest.mark.parametrize("band", ["B", "V", "R", "I", "G"])
def test_zero_point_through_a_filter(produce, band):
    text = sidereal_field(size=64, duration_s=3.0)
    options = ("--set", "telescope.throughput=0.5", "--set", f'telescope.filter="{band}"')
    header = fits.getheader(produce("render", text, *options) / "frames" / "0000.fits")
    response = light.curve("qe/kaf16803.csv") * light.curve(f"passbands/{band}.csv")
    air = light.transmission("kpno", header["AIRMASS"])
    photons = light.photon_rate(light.solar_source(0.0), response * air)
    rate = 0.5 * header["APTAREA"] * 1e-6 * photons
    expected = 2.5 * np.log10(rate * header["EXPTIME"] / header["GAIN"])
    share = 10 ** (0.4 * (header["MAGZERO"] - expected)) - 1
    print(f"filter {band}: MAGZERO {header['MAGZERO']:.4f}, numpy {expected:.4f}, {share:+.2e}")
    assert header["FILTER"] == band
    assert abs(share) < 2e-4


def test_net_area(field):
    header, _ = field
    assert header["APTAREA"] == pytest.approx(light.NET_AREA_M2 * 1e6, rel=1e-6)


def test_glow_given_as_a_magnitude(produce):
    """A sky source given as V at the ground, solar colour: no extinction."""
    text = flat_patch(count=1, size=64, duration_s=30.0, sky="airglow = 18.5")
    header = fits.getheader(
        produce("render", text, "--set", "telescope.throughput=0.5") / "frames" / "0000.fits"
    )
    rate = light.electron_rate(18.5, "kaf16803", area_m2=header["APTAREA"] * 1e-6, throughput=0.5)
    expected = rate * header["PIXSCALE"] ** 2 * header["EXPTIME"]
    print(f"SKYAIRG {header['SKYAIRG']:.3f} e-/px, numpy {expected:.3f} e-/px")
    assert header["SKYAIRG"] == pytest.approx(expected, rel=0.005)
