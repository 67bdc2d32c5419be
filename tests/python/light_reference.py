"""Independent photometry: photon rates from the tables in catalogs/, with numpy alone.

Every rate is a photon-weighted integral over 280 to 1100 nm on a 0.25 nm grid (trapezoid;
tables linear between their points):

    N [1/s] = area [m2] * integral F(lambda) lambda/(h c) T_atm(lambda) T QE(lambda) dlambda

Tables are 0 outside their range, extinction is held at its end values. V is the Bessell
(1990) passband as a photon response, V = +0.03 for the CALSPEC spectrum of Vega; a magnitude
belongs to the light above the atmosphere.

    python light_reference.py            print the check numbers, compare with expected_light.json
    python light_reference.py --write    renew expected_light.json
"""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np

CATALOGS = Path(__file__).resolve().parents[2] / "catalogs"
EXPECTED = Path(__file__).with_name("expected_light.json")

H = 6.62607015e-34  # J s, Planck constant (SI 2019)
C = 299792458.0  # m/s, speed of light
VEGA_V = 0.03  # Bessell's V of Vega
ARCSEC2_PER_SR = (180 * 3600 / np.pi) ** 2
PIXEL_ARCSEC = 0.725447016  # plate scale of the Purdue Optical Ground Station
NET_AREA_M2 = np.pi / 4 * (0.3556**2 - 0.172466**2)  # the same telescope: 0.07595

GRID_NM = np.arange(280.0, 1100.0 + 0.125, 0.25)
PHOTON_PER_J = GRID_NM * 1e-9 / (H * C)


def integral(values):
    """Trapezoid over the wavelength grid; values per nm."""
    return float(np.trapezoid(values, GRID_NM))


@cache
def table(path):
    """Columns of a catalogue CSV: comments, one header line, rows of numbers."""
    lines = [
        line for line in (CATALOGS / path).read_text().splitlines() if not line.startswith("#")
    ]
    return np.array([[float(x) for x in line.split(",")] for line in lines[1:]]).T


@cache
def curve(path):
    """A spectrum, passband or quantum efficiency on the grid; 0 outside its table."""
    nm, value = table(path)
    return np.interp(GRID_NM, nm, value, left=0.0, right=0.0)


def sun():
    """Solar spectral irradiance at 1 au [W m^-2 nm^-1]."""
    return curve("spectra/solar_astm_e490.csv")


def vega():
    """Vega's spectral irradiance [W m^-2 nm^-1]."""
    return curve("spectra/vega_calspec.csv")


def transmission(extinction, airmass):
    """Share of light passing the atmosphere; extinction = "kpno", "ctio" or "krag2003"."""
    nm, mag = table(f"extinction/{extinction}.csv")
    return 10 ** (-0.4 * airmass * np.interp(GRID_NM, nm, mag))


def photon_rate(spectrum, response=1.0):
    """Photons s^-1 m^-2 of a spectrum [W m^-2 nm^-1] through a response."""
    return integral(spectrum * PHOTON_PER_J * response)


def magnitude(spectrum, band="V"):
    """Vega magnitude; Vega is +0.03 in every band."""
    response = curve(f"passbands/{band}.csv")
    return VEGA_V - 2.5 * np.log10(photon_rate(spectrum, response) / photon_rate(vega(), response))


def solar_source(mag_v):
    """Irradiance of a source with the Sun's spectrum and this V [W m^-2 nm^-1]."""
    return sun() * 10 ** (-0.4 * (mag_v - magnitude(sun())))


def electron_rate(mag_v, qe, extinction=None, airmass=0.0, area_m2=0.0760, throughput=1.0):
    """Electrons s^-1 of a solar-spectrum source; extinction None = above the atmosphere."""
    air = 1.0 if extinction is None else transmission(extinction, airmass)
    return area_m2 * throughput * photon_rate(solar_source(mag_v), curve(f"qe/{qe}.csv") * air)


def pickering(el_deg):
    """Airmass at an apparent elevation (Pickering 2002, DIO 12, 1)."""
    return 1 / np.sin(np.radians(el_deg + 244 / (165 + 47 * el_deg**1.1)))


def surface_rate(mag_arcsec2, qe):
    """Electrons s^-1 per pixel of a solar-coloured glow measured at the ground, 0.0760 m2."""
    return electron_rate(mag_arcsec2, qe) * PIXEL_ARCSEC**2


def airglow_rate(qe, extinction=None):
    """Electrons s^-1 per pixel of the zenith airglow, 0.0760 m2."""
    radiance = curve("airglow/zenith_krag.csv") * 1e-9  # W m^-2 nm^-1 sr^-1
    air = 1.0 if extinction is None else transmission(extinction, 1.0)
    response = curve(f"qe/{qe}.csv") * air / ARCSEC2_PER_SR * PIXEL_ARCSEC**2
    return 0.0760 * photon_rate(radiance, response)


def airglow_v():
    """V of the zenith airglow [mag arcsec^-2]."""
    return magnitude(curve("airglow/zenith_krag.csv") * 1e-9 / ARCSEC2_PER_SR)


def numbers():
    """The check numbers, each named by what it is and its unit."""
    at_45 = pickering(45.0)
    v_band = curve("passbands/V.csv")
    s10 = -2.5 * np.log10(1 / 3600**2) + 10  # one 10th-magnitude star per square degree
    result = {
        "net_area_pogs_m2": NET_AREA_M2,
        "airmass_pickering_45deg": at_45,
        "airmass_pickering_10deg": pickering(10.0),
        "s10_mag_arcsec2": s10,
        "sun_mag_v": magnitude(sun()),
        "sun_mag_b": magnitude(sun(), "B"),
        "sun_mag_r": magnitude(sun(), "R"),
        "sun_mag_i": magnitude(sun(), "I"),
        "sun_mag_g_vega_as_003": magnitude(sun(), "G"),
        "sun_irradiance_280_1100_w_m2": integral(sun()),
        "vega_photons_v_s_m2": photon_rate(vega(), v_band),
        "mag0_photons_v_s_m2": photon_rate(vega(), v_band) * 10 ** (0.4 * VEGA_V),
        "mag0_solar_photons_280_1100_s_m2": photon_rate(solar_source(0.0)),
        "v16_krag_kpno_zenith_e_s": electron_rate(16, "krag2003", "kpno", 1.0),
        "v16_krag_none_e_s": electron_rate(16, "krag2003"),
        "v16_krag_krag_zenith_e_s": electron_rate(16, "krag2003", "krag2003", 1.0),
        "ground_22mag_krag_e_px_s": surface_rate(22.0, "krag2003"),
        "s10_100_krag_above_e_px_s": 100 * surface_rate(s10, "krag2003"),
        "airglow_zenith_mag_arcsec2": airglow_v(),
        "airglow_zenith_krag_e_px_s": airglow_rate("krag2003"),
        "airglow_zenith_krag_kpno_e_px_s": airglow_rate("krag2003", "kpno"),
        "v8_kaf16803_kpno_45deg_e_s": electron_rate(8, "kaf16803", "kpno", at_45),
        "v16_kaf16803_kpno_45deg_e_s": electron_rate(16, "kaf16803", "kpno", at_45),
        "v16_kaf16803_kpno_zenith_e_s": electron_rate(16, "kaf16803", "kpno", 1.0),
        "v16_kaf16803_ctio_zenith_e_s": electron_rate(16, "kaf16803", "ctio", 1.0),
        "v16_kaf16803_none_e_s": electron_rate(16, "kaf16803"),
        "v16_e2v230_84_none_e_s": electron_rate(16, "e2v230_84"),
        "v16_andor_dw936_none_e_s": electron_rate(16, "andor_dw936"),
        "v16_thx7899m_none_e_s": electron_rate(16, "thx7899m"),
        "ground_22mag_kaf16803_e_px_s": surface_rate(22.0, "kaf16803"),
    }
    return {name: float(f"{value:.6g}") for name, value in result.items()}


def main():
    found = numbers()
    if "--write" in sys.argv[1:]:
        EXPECTED.write_text(json.dumps(found, indent=2) + "\n")
    expected = json.loads(EXPECTED.read_text())
    assert found.keys() == expected.keys(), "expected_light.json holds other names"
    for name, value in found.items():
        print(f"{name:36} {value:14.6g} {value / expected[name] - 1:+.1e}")


if __name__ == "__main__":
    main()
