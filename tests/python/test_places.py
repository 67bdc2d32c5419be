"""plan.ecsv against python-sgp4, pyerfa and astropy: places, rates, Sun, Moon, airmass."""

import erfa
import numpy as np
import pytest
from astropy.table import Table
from astropy.time import Time, TimeDelta
from light_reference import pickering
from places_reference import Station, orientation, row, satellite, separation_arcsec
from scenes import GOES_14, ISS, MOLNIYA_3_50, scene, target
from support import assert_units

PLACE_ARCSEC = 0.002
REFRACTION_FROM_DEG = 3.0  # lower, SOFA's refraction formula holds no more
UNITS = {
    "ra_deg": "deg",
    "dec_deg": "deg",
    "ra_gcrs_deg": "deg",
    "dec_gcrs_deg": "deg",
    "az_deg": "deg",
    "el_deg": "deg",
    "range_km": "km",
    "ra_rate_arcsec_s": "arcsec / s",
    "dec_rate_arcsec_s": "arcsec / s",
    "phase_deg": "deg",
    "sun_el_deg": "deg",
    "moon_el_deg": "deg",
    "moon_sep_deg": "deg",
    "moon_phase_deg": "deg",
    "mjd_utc": "d",
}
CASES = {
    # name: elements, first opening, exposures, cadence [s]
    "goes14": (GOES_14, "2018-01-20T03:00:00", 12, 2700.0),
    "iss": (ISS, "2018-01-21T01:50:00", 40, 180.0),
    "iss-pass": (ISS, "2018-01-21T03:33:00", 30, 22.0),
    "molniya": (MOLNIYA_3_50, "2018-01-20T00:00:00", 24, 3600.0),
    # the last second of 2016 is a leap second
    "leap-second": (GOES_14, "2016-12-31T23:59:30", 4, 20.0),
}
DURATION_S = 5.0


@pytest.fixture(scope="module", params=CASES)
def plan(request, produce):
    """(plan table, reference rows, times) of one case."""
    tle, start, count, cadence_s = CASES[request.param]
    text = scene(
        exposures=f"""start = {start}Z
count = {count}
cadence_s = {cadence_s}
duration_s = {DURATION_S}""",
        pointing='at = "target"',
        targets=target(tle),
    )
    table = Table.read(produce("plan", text) / "plan.ecsv", format="ascii.ecsv")
    opening = Time(start, scale="utc")
    times = [
        opening + TimeDelta(cadence_s * k + DURATION_S / 2, format="sec") for k in range(count)
    ]
    sat = satellite(*tle)
    rows = [row(sat, Station(), t) for t in times]
    reference = {name: np.array([r[name] for r in rows]) for name in rows[0]}
    return request.param, table, reference, times


def largest(name, what, difference, unit):
    worst = float(np.max(np.abs(difference), initial=0.0))
    print(f"{name}: {what}: largest difference {worst:.3g} {unit}")
    return worst


def test_rows_are_mid_exposures(plan):
    name, table, _, times = plan
    assert list(table["frame"]) == list(range(len(times)))
    for text, mjd, t in zip(table["time_utc"], table["mjd_utc"], times):
        assert "Z" not in text and len(text.split(".")[1]) == 6
        assert abs((Time(text, scale="utc") - t).to_value("s")) < 1e-6
        assert abs(mjd - t.utc.mjd) * 86400 < 2e-6 or name == "leap-second"


def test_units_are_declared(plan):
    _, table, _, _ = plan
    assert_units(table, UNITS)


@pytest.mark.parametrize("lon, lat", [("ra_deg", "dec_deg"), ("ra_gcrs_deg", "dec_gcrs_deg")])
def test_right_ascension_and_declination(plan, lon, lat):
    name, table, ref, _ = plan
    off = separation_arcsec(table[lon], table[lat], ref[lon], ref[lat])
    assert largest(name, lon, off, "arcsec") < PLACE_ARCSEC


def test_azimuth_and_elevation(plan):
    name, table, ref, _ = plan
    high = ref["el_deg"] > REFRACTION_FROM_DEG
    off = separation_arcsec(table["az_deg"], table["el_deg"], ref["az_deg"], ref["el_deg"])
    assert largest(name, "az, el", off[high], "arcsec") < PLACE_ARCSEC
    below = ref["el_airless_deg"] < -1.0
    assert np.all(table["el_deg"][below] < 0.0)
    assert np.all(np.abs(table["el_deg"] - ref["el_airless_deg"])[below] < 1.0)
    turn = (table["az_deg"] - ref["az_deg"] + 180.0) % 360.0 - 180.0
    across = turn * np.cos(np.radians(ref["el_deg"])) * 3600.0
    assert largest(name, "az at every elevation", across, "arcsec") < PLACE_ARCSEC


def test_range(plan):
    name, table, ref, _ = plan
    assert largest(name, "range", (table["range_km"] - ref["range_km"]) * 1e3, "m") < 1.0


@pytest.mark.parametrize("column", ["ra_rate_arcsec_s", "dec_rate_arcsec_s"])
def test_rates(plan, column):
    name, table, ref, _ = plan
    speed = np.hypot(ref["ra_rate_arcsec_s"], ref["dec_rate_arcsec_s"])
    off = (table[column] - ref[column]) / speed
    assert largest(name, column, off, "of the motion") < 2e-5


def test_phase_angle(plan):
    # the Sun that lights it is the apparent one: the geometric one would be 20 arcsec off
    name, table, ref, _ = plan
    off = (table["phase_deg"] - ref["phase_deg"]) * 3600.0
    assert largest(name, "phase angle", off, "arcsec") < 0.1


@pytest.mark.parametrize(
    "column, limit_deg",
    [("sun_el_deg", 1e-4), ("moon_el_deg", 1e-4), ("moon_sep_deg", 5e-4), ("moon_phase_deg", 5e-4)],
)
def test_sun_and_moon(plan, column, limit_deg):
    name, table, ref, _ = plan
    assert largest(name, column, table[column] - ref[column], "deg") < limit_deg


def test_airmass_is_pickerings(plan):
    name, table, _, _ = plan
    up = table["el_deg"] > 0.0
    expected = pickering(np.array(table["el_deg"][up]))
    assert largest(name, "airmass", table["airmass"][up] / expected - 1, "(relative)") < 1e-9


def test_sunlit(plan):
    _, table, ref, _ = plan
    assert np.all(table["sunlit"][ref["shadow"] == "lit"] == 1.0)
    assert np.all(table["sunlit"][ref["shadow"] == "dark"] == 0.0)
    assert np.all((table["sunlit"] >= 0.0) & (table["sunlit"] <= 1.0))


def test_observable_and_why(plan):
    _, table, ref, _ = plan
    expected = (
        (table["el_deg"] >= 10.0)
        & (table["sun_el_deg"] <= -12.0)
        & (table["moon_sep_deg"] >= 10.0)
        & (table["sunlit"] > 0.5)
    )
    sure = ref["shadow"] != "near"
    assert np.array_equal(np.asarray(table["observable"], bool)[sure], np.asarray(expected)[sure])
    for observable, why in zip(table["observable"], table["why"]):
        # a reason stands where something is refused, and only there
        assert bool(observable) == (str(why).strip() in ("", "--")), why


def test_the_reference_itself_by_sofas_star_routine():
    """The astrometric place, taken as a star's, through SOFA's atco13: the same azimuth, elevation.

    atco13 adds annual and diurnal aberration, light deflection (4 mas here) and refraction in
    one go; the reference never uses annual aberration. Agreement shows that ra_deg lies among
    the catalogue's places on the frame.
    """
    station = Station()
    sat = satellite(*GOES_14)
    for hours in (0.0, 5.0, 10.0):
        t = Time("2018-01-20T03:00:00", scale="utc") + TimeDelta(hours * 3600.0, format="sec")
        found = row(sat, station, t)
        xp, yp, _, _ = orientation(t)
        az, zenith_distance, *_ = erfa.atco13(
            *np.radians([found["ra_deg"], found["dec_deg"]]),
            *(0.0, 0.0, 0.0, 0.0),  # no proper motion, parallax, radial velocity
            *(t.utc.jd1, t.utc.jd2, t.delta_ut1_utc),
            *np.radians([station.longitude_deg, station.latitude_deg]),
            station.height_m,
            *(xp, yp, station.pressure_hpa, station.temperature_c, station.humidity, 0.55),
        )
        off = separation_arcsec(
            np.degrees(az), 90.0 - np.degrees(zenith_distance), found["az_deg"], found["el_deg"]
        )
        print(f"reference against atco13 at {t.isot}: {off:.4f} arcsec")
        assert off < 0.02
