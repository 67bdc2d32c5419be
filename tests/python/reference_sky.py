"""Reference tables of the sky: Earth orientation, places of stars, Sun and Moon."""

import warnings
from datetime import datetime, timedelta
from fractions import Fraction
from pathlib import Path

import ephem
import erfa
import numpy as np
import skyfield_data
from astropy.time import Time
from jplephem.spk import SPK
from places_reference import C_KM_S, IERS, Station, direction_to_angles, orientation as pole

# leap seconds are not known that far ahead: the tables take TAI-UTC of today
warnings.filterwarnings("ignore", "ERFA function .*dubious year", erfa.ErfaWarning)

DAY_S = 86400
DUBLIN_JD = 2415020.0  # day 0 of PyEphem
TT_MINUS_TAI_S = Fraction("32.184")

ORIENTATION_UTC = (
    "2000-01-01T12:00:00",
    "2001-09-09T01:46:40",
    "2003-02-28T23:59:59.999999",
    "2004-04-06T07:51:28.386009",
    "2005-12-31T23:59:60.5",
    "2008-02-29T18:30:00.125",
    "2010-07-11T19:33:31",
    "2012-06-30T23:59:60",
    "2015-03-14T09:26:53.589793",
    "2016-12-31T12:00:00",
    "2016-12-31T23:59:59.5",
    "2016-12-31T23:59:60.25",
    "2017-01-01T00:00:00",
    "2018-01-20T03:00:00",
    "2019-11-11T15:20:00",
    "2021-08-02T04:05:06.789",
    "2023-10-14T17:59:29",
    "2025-05-05T05:05:05.5",
    "2026-12-25T06:00:00",
    "2027-10-15T21:45:12",
)
MADE_UP_UTC = "2030-06-01T00:00:00"
MADE_UP_EOP = {
    "ut1_minus_utc_s": 0.1,
    "xp_arcsec": 0.1,
    "yp_arcsec": 0.3,
    "dx_mas": 0.0,
    "dy_mas": 0.0,
}

STATIONS = (
    Station(90.0, 0.0, 12.0, 1008.0, -28.0, 0.8),
    Station(-90.0, -45.0, 2835.0, 680.0, -48.5, 0.6),
    Station(-16.75, 180.0, 310.0, 975.0, 24.0, 0.75),
    Station(32.9, -105.533333, 2225.0, 780.0, 10.0, 0.5),
    Station(-24.627222, -70.404167, 2635.43, 743.0, 12.5, 0.15),
)
STAR_UTC = (
    "2000-06-21T04:30:00",
    "2006-11-03T19:12:47.5",
    "2012-03-20T11:00:00",
    "2018-01-20T06:45:00.25",
    "2026-06-15T23:15:30",
)
# RA, Dec [deg], proper motion [mas/yr], parallax [mas], radial velocity [km/s]
NAMED_STARS = (
    (269.45207696, 4.69336497, -802.803, 10362.542, 546.976, -110.11),  # Barnard
    (77.91909, -45.01841, 6491.474, -5709.217, 254.226, 245.19),  # Kapteyn
    (178.24487, 37.71868, 4002.567, -5817.856, 109.030, -98.35),  # Groombridge 1830
    (101.28715533, -16.71611586, -546.01, -1223.07, 379.21, -5.5),  # Sirius
    (37.95456067, 89.26410897, 44.48, -11.85, 7.54, -16.42),  # Polaris
    (317.19515, -88.95650, 26.7, 5.3, 11.08, 11.9),  # sigma Octantis
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (359.999999, -0.000001, 10000.0, -10000.0, 500.0, 300.0),
)
STAR_COUNT = 50
MIN_ELEVATION_DEG = 5.0

LUNAR_AXES = (  # WGCCRE 2009: argument [deg, deg/day], amplitudes in RA, Dec, W [deg]
    (125.045, -0.0529921, -3.8787, 1.5419, 3.5610),
    (250.089, -0.1059842, -0.1204, 0.0239, 0.1208),
    (260.008, 13.0120009, 0.0700, -0.0278, -0.0642),
    (176.625, 13.3407154, -0.0172, 0.0068, 0.0158),
    (357.529, 0.9856003, 0.0, 0.0, 0.0252),
    (311.589, 26.4057084, 0.0072, -0.0029, -0.0066),
    (134.963, 13.0649930, 0.0, 0.0009, -0.0047),
    (276.617, 0.3287146, 0.0, 0.0, -0.0046),
    (34.226, 1.7484877, 0.0, 0.0, 0.0028),
    (15.134, -0.1589763, -0.0052, 0.0008, 0.0052),
    (119.743, 0.0036096, 0.0, 0.0, 0.0040),
    (239.961, 0.1643573, 0.0, 0.0, 0.0019),
    (25.053, 12.9590088, 0.0043, -0.0009, -0.0044),
)


def interpolated_eop(utc):
    """The IERS table at a UTC time, columns as in the CSV; no dX, dY predicted: 0."""
    t = Time(utc, scale="utc")
    xp, yp = IERS.pm_xy(t)
    dx, dy = IERS.dcip_xy(t)
    return {
        "ut1_minus_utc_s": IERS.ut1_utc(t).to_value("s"),
        "xp_arcsec": xp.to_value("arcsec"),
        "yp_arcsec": yp.to_value("arcsec"),
        "dx_mas": np.nan_to_num(dx.to_value("mas")),
        "dy_mas": np.nan_to_num(dy.to_value("mas")),
    }


def julian(midnight, seconds):
    """Two-part JD of exact seconds after a midnight: a midnight and a fraction in [0, 1)."""
    days, rest = divmod(seconds, DAY_S)
    return float(midnight + days), float(rest / DAY_S)


def orientation_row(utc, eop):
    date, clock = utc.split("T")
    year, month, day = (int(part) for part in date.split("-"))
    hours, minutes, seconds = clock.split(":")
    since = 3600 * int(hours) + 60 * int(minutes) + Fraction(seconds)
    midnight = int(2 * sum(erfa.cal2jd(year, month, day))) / Fraction(2)
    tai_minus_utc = float(erfa.dat(year, month, day, 0.0))
    ut1_minus_tai = float(eop["ut1_minus_utc_s"] - tai_minus_utc)

    tai = since + Fraction(tai_minus_utc)
    tt = julian(midnight, tai + TT_MINUS_TAI_S)
    ut1 = julian(midnight, tai + Fraction(ut1_minus_tai))

    xp, yp = eop["xp_arcsec"] * erfa.DAS2R, eop["yp_arcsec"] * erfa.DAS2R
    dx, dy = eop["dx_mas"] * erfa.DMAS2R, eop["dy_mas"] * erfa.DMAS2R
    x, y, s = erfa.xys06a(*tt)
    era = erfa.era00(*ut1)
    matrix = erfa.c2tcio(erfa.c2ixys(x + dx, y + dy, s), era, erfa.pom00(xp, yp, erfa.sp00(*tt)))
    return {
        "utc": utc,
        "tai_minus_utc_s": tai_minus_utc,
        "tt_jd1": tt[0],
        "tt_jd2": tt[1],
        "tdb_minus_tt_s": erfa.dtdb(*tt, ut1[1], 0.0, 0.0, 0.0),
        "ut1_minus_tai_s": ut1_minus_tai,
        "xp_arcsec": eop["xp_arcsec"],
        "yp_arcsec": eop["yp_arcsec"],
        "dx_mas": eop["dx_mas"],
        "dy_mas": eop["dy_mas"],
        "era_rad": era,
        "gmst06_rad": erfa.gmst06(*ut1, *tt),
        "gmst82_rad": erfa.gmst82(*ut1),
        **{f"m{i + 1}{j + 1}": matrix[i, j] for i in range(3) for j in range(3)},
    }


def orientation():
    """Time scales and the orientation of the Earth, by pyerfa (SOFA).

    EOP: IERS_A of astropy-iers-data, linear between days as astropy does, UT1-TAI continuous
    over leap seconds, a UTC day with a leap second 86401 s long; dX = dY = 0 where the IERS
    predicts none (2027-10-15). The last row has made-up EOP (UT1-UTC = 0.1 s, TAI-UTC = 37 s).
    tt_jd1 + tt_jd2: midnight and fraction of the day, rounded once from exact arithmetic.
    tdb_minus_tt_s: dtdb at the geocentre. gmst06: IAU 2006, gmst82: IAU 1982.
    m11..m33: rows of the matrix GCRS -> ITRF (IAU 2006/2000A CIO based, dX, dY, polar motion, s').
    """
    rows = [orientation_row(utc, interpolated_eop(utc)) for utc in ORIENTATION_UTC]
    return rows + [orientation_row(MADE_UP_UTC, MADE_UP_EOP)]


def catalogue():
    """Named stars, then a spiral over the sphere with motions from irrational steps."""
    yield from NAMED_STARS
    count = STAR_COUNT - len(NAMED_STARS)
    for i in range(count):
        along, across, near, radial = ((i + 1) * np.sqrt([2.0, 3.0, 5.0, 7.0])) % 1.0
        yield (
            round((i * 137.50776405) % 360.0, 6),
            round(float(np.degrees(np.arcsin(1.0 - (2 * i + 1) / count))), 6),
            round(2000.0 * (2.0 * along - 1.0) ** 3, 3),
            round(2000.0 * (2.0 * across - 1.0) ** 3, 3),
            round(400.0 * near**4 + 0.5, 3),
            round(150.0 * (2.0 * radial - 1.0), 2),
        )


def star_parameters(star):
    """Arguments of SOFA's star functions: RA, Dec, dRA/dt, dDec/dt, parallax, velocity."""
    ra, dec, pm_ra, pm_dec, parallax, rv = star
    return (
        *np.radians([ra, dec]),
        pm_ra * erfa.DMAS2R / np.cos(np.radians(dec)),
        pm_dec * erfa.DMAS2R,
        parallax / 1e3,
        rv,
    )


def observed(star, station, t, refraction):
    """Azimuth and elevation [deg]."""
    tdb, tt, ut1 = t.tdb, t.tt, t.ut1
    xp, yp, dx, dy = pole(t)
    heliocentric, barycentric = erfa.epv00(tdb.jd1, tdb.jd2)
    x, y, s = erfa.xys06a(tt.jd1, tt.jd2)
    astrom = erfa.apco(
        tdb.jd1,
        tdb.jd2,
        barycentric,
        heliocentric["p"],
        x + dx,
        y + dy,
        s,
        erfa.era00(ut1.jd1, ut1.jd2),
        *np.radians([station.longitude_deg, station.latitude_deg]),
        station.height_m,
        xp,
        yp,
        erfa.sp00(tt.jd1, tt.jd2),
        *refraction,
    )
    azimuth, zenith_distance, *_ = erfa.atioq(*erfa.atciq(*star_parameters(star), astrom), astrom)
    return np.degrees(azimuth), 90.0 - np.degrees(zenith_distance)


def astrometric(star, t):
    """ICRS place of date [deg] from the geocentre: space motion and parallax alone."""
    tdb = t.tdb
    heliocentric, barycentric = erfa.epv00(tdb.jd1, tdb.jd2)
    astrom = erfa.apcg(tdb.jd1, tdb.jd2, barycentric, heliocentric["p"])
    return np.degrees(erfa.atccq(*star_parameters(star), astrom))


def sighting(first, star):
    """Station, UTC, airless azimuth and elevation: the first that is high enough, in rotation."""
    combinations = [(station, utc) for utc in STAR_UTC for station in STATIONS]
    for step in range(len(combinations)):
        station, utc = combinations[(7 * first + step) % len(combinations)]
        azimuth, elevation = observed(star, station, Time(utc, scale="utc"), (0.0, 0.0))
        if elevation > MIN_ELEVATION_DEG:
            return station, utc, azimuth, elevation
    raise AssertionError("a star that no station sees")


def stars():
    """Places of stars by pyerfa (SOFA): apco, atciq, atioq; refco at 0.55 um.

    Catalogue: ICRS, epoch J2000.0 (TDB), pm_ra_cosdec = dRA/dt cos(Dec). Earth: epv00;
    orientation: IAU 2006/2000A with UT1, xp, yp, dX, dY of the IERS. Space motion includes the
    light time across the Earth's orbit (SOFA pmpx).
    az (from north through east) and el contain parallax, deflection by the Sun, annual and diurnal
    aberration; airless: no refraction. astrometric: ICRS place of date, space motion and parallax
    as seen from the geocentre, no deflection, no aberration.
    """
    rows = []
    for i, star in enumerate(catalogue()):
        station, utc, azimuth, elevation = sighting(i, star)
        t = Time(utc, scale="utc")
        air = station.pressure_hpa, station.temperature_c, station.humidity
        refracted = observed(star, station, t, erfa.refco(*air, 0.55))
        ra, dec = astrometric(star, t)
        rows.append(
            {
                "ra_deg": star[0],
                "dec_deg": star[1],
                "pm_ra_cosdec_mas_yr": star[2],
                "pm_dec_mas_yr": star[3],
                "parallax_mas": star[4],
                "rv_km_s": star[5],
                "utc": utc,
                "latitude_deg": station.latitude_deg,
                "longitude_deg": station.longitude_deg,
                "height_m": station.height_m,
                "pressure_hpa": station.pressure_hpa,
                "temperature_c": station.temperature_c,
                "humidity": station.humidity,
                "az_airless_deg": azimuth,
                "el_airless_deg": elevation,
                "az_refracted_deg": refracted[0],
                "el_refracted_deg": refracted[1],
                "astrometric_ra_deg": ra,
                "astrometric_dec_deg": dec,
            }
        )
    return rows


def sun_and_moon(kernel, tt_jd1, tt_jd2=0.0):
    """Geocentric geometric vectors [km] at a TT."""
    tdb_jd2 = tt_jd2 + erfa.dtdb(tt_jd1, tt_jd2, 0.0, 0.0, 0.0, 0.0) / DAY_S

    def vector(centre, target):
        return kernel[centre, target].compute(tt_jd1, tdb_jd2)

    earth = vector(3, 399)  # from the barycentre of Earth and Moon
    return vector(0, 10) - vector(0, 3) - earth, vector(3, 301) - earth


def de421():
    return SPK.open(str(Path(skyfield_data.__file__).parent / "data" / "de421.bsp"))


def bodies():
    """Sun and Moon from the geocentre, JPL DE421 (skyfield-data) read by jplephem.

    Geometric vectors (no light time, no aberration), km, axes of DE421 = ICRS to 1 mas.
    Times are exact doubles of JD (TT); TDB-TT by SOFA's dtdb at the geocentre.
    """
    rows = []
    with de421() as kernel:
        for i in range(60):
            tt_jd = 2451545.0 + 185.734375 * i
            sun, moon = sun_and_moon(kernel, tt_jd)
            rows.append(
                {
                    "tt_jd": tt_jd,
                    **{f"sun_{axis}_km": value for axis, value in zip("xyz", sun)},
                    **{f"moon_{axis}_km": value for axis, value in zip("xyz", moon)},
                }
            )
    return rows


def libration_times():
    """(UTC, TT) of 40 epochs, 2000 to 2030."""
    for i in range(40):
        utc = (datetime(2000, 1, 7, 3, 21) + timedelta(days=280.8125 * i)).isoformat()
        yield utc, Time(utc, scale="utc").tt


def signed(angle_deg):
    """Angle in [-180, 180)."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def libration():
    """Librations of the Moon and the subsolar point from the geocentre, by PyEphem.

    Selenographic, degrees, east (Mare Crisium) and north positive; subsolar longitude =
    90 - colongitude. PyEphem feeds its series the date as it is, so it is given TT.
    lib_*: series of S. L. Moshier fitted to JPL DE403, optical and physical, within 2.6 arcsec,
    on the PRINCIPAL AXES of the Moon: for the mean Earth/polar axes of maps add 0.0178 deg to
    lib_lon_deg and subtract 0.0213 deg from lib_lat_deg.
    subsolar_*: low-precision formulas (Bruning and Talcott 1995, optical only, mean axes):
    errors up to 0.35 deg in longitude, 0.05 deg in latitude; libration_iau.csv is better there.
    """
    rows = []
    for utc, tt in libration_times():
        moon = ephem.Moon()
        moon.compute(ephem.Date((tt.jd1 - DUBLIN_JD) + tt.jd2))
        rows.append(
            {
                "utc": utc,
                "lib_lon_deg": signed(np.degrees(float(moon.libration_long))),
                "lib_lat_deg": signed(np.degrees(float(moon.libration_lat))),
                "subsolar_lon_deg": signed(90.0 - np.degrees(float(moon.colong))),
                "subsolar_lat_deg": signed(np.degrees(float(moon.subsolar_lat))),
            }
        )
    return rows


def lunar_axes(days):
    """Matrix ICRS -> mean Earth/polar axes of the Moon, days (TDB) from J2000.0."""
    start, rate, in_ra, in_dec, in_w = np.array(LUNAR_AXES).T
    argument = np.radians(start + rate * days)
    centuries = days / erfa.DJC
    ra = 269.9949 + 0.0031 * centuries + in_ra @ np.sin(argument)
    dec = 66.5392 + 0.0130 * centuries + in_dec @ np.cos(argument)
    w = 38.3213 + 13.17635815 * days - 1.4e-12 * days**2 + in_w @ np.sin(argument)
    node, tilt, turn = np.radians([90.0 + ra, 90.0 - dec, w])
    return erfa.rz(turn, erfa.rx(tilt, erfa.rz(node, np.eye(3))))


def libration_iau():
    """Librations of the Moon and the subsolar point: DE421 and the axes of IAU WGCCRE 2009.

    Columns as in libration.csv, on the mean Earth/polar axes of maps; good to 0.005 deg.
    lib_*: direction Moon -> geocentre, Moon and axes one light time earlier. subsolar_*: direction
    Moon -> Sun at that instant, apparent on the Moon (light time and aberration).
    """
    rows = []
    with de421() as kernel:
        for utc, tt in libration_times():
            jd1, jd2 = tt.jd1, tt.jd2
            jd2 -= np.linalg.norm(sun_and_moon(kernel, jd1, jd2)[1]) / C_KM_S / DAY_S
            to_moon = lunar_axes(jd1 - erfa.DJ00 + jd2)
            sun, moon = sun_and_moon(kernel, jd1, jd2)
            lon, lat = direction_to_angles(to_moon @ -moon)
            sun_light = np.linalg.norm(sun - moon) / C_KM_S / DAY_S
            sun, moon = sun_and_moon(kernel, jd1, jd2 - sun_light)  # both: aberration too
            sun_lon, sun_lat = direction_to_angles(to_moon @ (sun - moon))
            rows.append(
                {
                    "utc": utc,
                    "lib_lon_deg": signed(lon),
                    "lib_lat_deg": lat,
                    "subsolar_lon_deg": signed(sun_lon),
                    "subsolar_lat_deg": sun_lat,
                }
            )
    return rows
