"""Independent places of a satellite: python-sgp4, pyerfa and astropy's Earth orientation.

In: two-line elements, a station, UTC. Out: the columns of plan.ecsv, by the definitions

* elements -> TEME (SGP4, WGS 72, AFSPC mode) -> PEF by GMST82 -> ITRF by polar motion ->
  GCRS by IAU 2006/2000A with UT1-UTC, xp, yp, dX, dY of the IERS;
* ra_deg, dec_deg: observer at t, satellite at t - tau, both barycentric; no aberration;
* ra_gcrs_deg, dec_gcrs_deg: the same with the light time of the geocentric frame;
* az_deg, el_deg: the geocentric direction, diurnal aberration, refraction (SOFA refco, applied
  as SOFA's atioq does);
* Sun: astropy's built-in ephemeris; Moon: JPL's DE421; airless and topocentric.
"""

from dataclasses import dataclass
from pathlib import Path

import astropy.units as u
import astropy_iers_data
import erfa
import numpy as np
import skyfield_data
from astropy.coordinates import (
    GCRS,
    AltAz,
    EarthLocation,
    get_body,
    solar_system_ephemeris,
)
from astropy.time import Time, TimeDelta
from astropy.utils import iers
from sgp4.api import WGS72, Satrec

C_KM_S = 299792.458
AU_KM = erfa.DAU / 1e3
EARTH_RATE = 7.292115855306589e-5  # rad/s of UT1: dERA/dt
SUN_RADIUS_KM = 695700.0
EARTH_RADIUS_KM = 6378.137

DE421 = str(Path(skyfield_data.get_skyfield_data_path()) / "de421.bsp")

iers.conf.auto_download = False
iers.conf.auto_max_age = None
IERS = iers.IERS_A.open(str(Path(astropy_iers_data.IERS_A_FILE)))
iers.earth_orientation_table.set(IERS)


@dataclass(frozen=True)
class Station:
    """Geodetic place (WGS 84) and the air at the ground."""

    latitude_deg: float = 32.9
    longitude_deg: float = -105.533333
    height_m: float = 2225.0
    pressure_hpa: float = 780.0
    temperature_c: float = 10.0
    humidity: float = 0.5

    @property
    def location(self):
        return EarthLocation.from_geodetic(
            self.longitude_deg * u.deg, self.latitude_deg * u.deg, self.height_m * u.m
        )

    @property
    def itrf_km(self):
        return self.location.get_itrs().cartesian.xyz.to_value(u.km)


def satellite(line1, line2):
    """SGP4 in AFSPC mode with WGS 72."""
    read = Satrec.twoline2rv(line1, line2, WGS72)
    made = Satrec()
    made.sgp4init(
        WGS72,
        "a",
        read.satnum,
        (read.jdsatepoch - 2433281.5) + read.jdsatepochF,
        read.bstar,
        read.ndot,
        read.nddot,
        read.ecco,
        read.argpo,
        read.inclo,
        read.mo,
        read.no_kozai,
        read.nodeo,
    )
    return made


def orientation(t):
    """(xp, yp [rad], dX, dY [rad]) of the IERS at a UTC time."""
    xp, yp = IERS.pm_xy(t)
    dx, dy = IERS.dcip_xy(t)
    return [q.to_value(u.rad) for q in (xp, yp, dx, dy)]


def polar_motion(t):
    xp, yp, _, _ = orientation(t)
    return erfa.pom00(xp, yp, erfa.sp00(t.tt.jd1, t.tt.jd2))


def gcrs_to_itrf(t):
    """Rotation matrix at a UTC time."""
    _, _, dx, dy = orientation(t)
    x, y, s = erfa.xys06a(t.tt.jd1, t.tt.jd2)
    celestial = erfa.c2ixys(x + dx, y + dy, s)
    return erfa.c2tcio(celestial, erfa.era00(t.ut1.jd1, t.ut1.jd2), polar_motion(t))


def satellite_gcrs(sat, t):
    """Geocentric position [km], GCRS."""
    # SI seconds since the epoch: quasi Julian dates of UTC stretch a day with a leap second
    epoch = Time(sat.jdsatepoch, sat.jdsatepochF, format="jd", scale="utc").tai
    days = (t.tai.jd1 - epoch.jd1) + (t.tai.jd2 - epoch.jd2)
    error, teme, _ = sat.sgp4_tsince(1440.0 * days)
    assert error == 0
    gmst = erfa.gmst82(t.ut1.jd1, t.ut1.jd2)
    xp, yp, _, _ = orientation(t)
    to_itrf = erfa.pom00(xp, yp, 0.0) @ erfa.rz(gmst, np.eye(3))
    return gcrs_to_itrf(t).T @ to_itrf @ np.array(teme)


def station_gcrs(station, t):
    """Geocentric position [km] and velocity [km/s] of the station, GCRS."""
    to_gcrs = gcrs_to_itrf(t).T
    position = to_gcrs @ station.itrf_km
    pole = to_gcrs @ polar_motion(t) @ [0.0, 0.0, 1.0]
    return position, EARTH_RATE * np.cross(pole, position)


def earth(t):
    """Heliocentric and barycentric position of the Earth [km], BCRS."""
    heliocentric, barycentric = erfa.epv00(t.tdb.jd1, t.tdb.jd2)
    return heliocentric["p"] * AU_KM, barycentric["p"] * AU_KM


def sun_apparent(t):
    """The Sun from the geocentre [km]: where its light, one light time old, comes from in the
    Earth's frame."""
    _, here = erfa.epv00(t.tdb.jd1, t.tdb.jd2)
    tau = np.linalg.norm(earth(t)[0]) / C_KM_S
    heliocentric, barycentric = earth(t - TimeDelta(tau, format="sec"))
    astrometric = (barycentric - heliocentric) - here["p"] * AU_KM
    away = np.linalg.norm(astrometric)
    beta = here["v"] * AU_KM / 86400.0 / C_KM_S
    return away * erfa.ab(astrometric / away, beta, away / AU_KM, np.sqrt(1.0 - beta @ beta))


def light_time(place, t, observer):
    """Vector from the observer at t to place(t - tau), and tau [s]."""
    tau = 0.0
    for _ in range(4):  # each gains a factor of 1e4
        vector = place(t - TimeDelta(tau, format="sec")) - observer
        tau = np.linalg.norm(vector) / C_KM_S
    return vector, tau


def direction_to_angles(vector):
    """Longitude in [0, 360) and latitude [deg]."""
    x, y, z = vector
    return np.degrees(np.arctan2(y, x)) % 360.0, np.degrees(np.arctan2(z, np.hypot(x, y)))


def angle_deg(a, b):
    """Angle between two vectors, good at every size."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def separation_arcsec(lon1, lat1, lon2, lat2):
    """Angle between two directions given in degrees."""
    return np.degrees(erfa.seps(*np.radians([lon1, lat1, lon2, lat2]))) * 3600.0


def refracted(enu, station):
    """Observed direction of an airless one in east, north, up: the formula of SOFA atioq."""
    if station.pressure_hpa == 0.0:
        return enu
    a, b = erfa.refco(station.pressure_hpa, station.temperature_c, station.humidity, 0.55)
    east, north, up = enu
    r = max(np.hypot(east, north), 1e-6)
    z = max(up, 0.05)
    tan_z = r / z
    w = b * tan_z**2
    bend = (a + w) * tan_z / (1.0 + (a + 3.0 * w) / z**2)
    cos_bend = 1.0 - bend**2 / 2.0
    f = cos_bend - bend * z / r
    return np.array([east * f, north * f, cos_bend * up + bend * r])


def east_north_up(station, t, direction):
    """GCRS direction -> local axes of the geodetic vertical."""
    lon, lat = np.radians([station.longitude_deg, station.latitude_deg])
    x, y, z = gcrs_to_itrf(t) @ direction
    east = -np.sin(lon) * x + np.cos(lon) * y
    out = np.cos(lon) * x + np.sin(lon) * y
    return np.array(
        [east, np.cos(lat) * z - np.sin(lat) * out, np.sin(lat) * z + np.cos(lat) * out]
    )


def astrometric(sat, station, t):
    """Unit vector to the satellite among the catalogue's stars."""
    observer = earth(t)[1] + station_gcrs(station, t)[0]
    vector, _ = light_time(lambda when: earth(when)[1] + satellite_gcrs(sat, when), t, observer)
    return vector / np.linalg.norm(vector)


def shadow(position, to_sun):
    """ "lit", "dark" or "near" the edge: cones of a spherical Earth, 100 km of doubt."""
    sun = to_sun / np.linalg.norm(to_sun)
    along = position @ sun
    if along > 0.0:
        return "lit"
    off = np.linalg.norm(position - along * sun)
    widening = -along / np.linalg.norm(to_sun)
    umbra = EARTH_RADIUS_KM - (SUN_RADIUS_KM - EARTH_RADIUS_KM) * widening
    penumbra = EARTH_RADIUS_KM + (SUN_RADIUS_KM + EARTH_RADIUS_KM) * widening
    if off > penumbra + 100.0:
        return "lit"
    return "dark" if off < umbra - 100.0 else "near"


def row(sat, station, t):
    """Every geometric column of plan.ecsv at one UTC time."""

    def place(when):
        return satellite_gcrs(sat, when)

    observer, velocity = station_gcrs(station, t)
    direction = astrometric(sat, station, t)
    ra, dec = direction_to_angles(direction)
    geocentric, tau = light_time(place, t, observer)
    ra_gcrs, dec_gcrs = direction_to_angles(geocentric)

    natural = geocentric / np.linalg.norm(geocentric)
    beta = velocity / C_KM_S
    proper = erfa.ab(natural, beta, 1.0, np.sqrt(1.0 - beta @ beta))
    airless = east_north_up(station, t, proper)
    east, north, up = refracted(airless, station)

    step = TimeDelta(0.1, format="sec")
    moved = astrometric(sat, station, t + step) - astrometric(sat, station, t - step)
    a, d = np.radians(ra), np.radians(dec)
    eastward = moved @ [-np.sin(a), np.cos(a), 0.0]
    northward = moved @ [-np.sin(d) * np.cos(a), -np.sin(d) * np.sin(a), np.cos(d)]

    at_emission = place(t - TimeDelta(tau, format="sec"))
    to_sun = -earth(t)[0]  # from the geocentre
    frame = AltAz(obstime=t, location=station.location, pressure=0 * u.hPa)
    here = GCRS(
        obstime=t,
        obsgeoloc=observer * u.km,
        obsgeovel=velocity * u.km / u.s,
    )
    # Earth and Moon from the same kernel, in the transformations too
    with solar_system_ephemeris.set(DE421):
        moon = get_body("moon", t, station.location)
        moon_here = moon.transform_to(here).cartesian.xyz.to_value(u.km)
        moon_el_deg = moon.transform_to(frame).alt.deg
    sun_here = get_body("sun", t, station.location, ephemeris="builtin")
    return {
        "ra_deg": ra,
        "dec_deg": dec,
        "ra_gcrs_deg": ra_gcrs,
        "dec_gcrs_deg": dec_gcrs,
        "az_deg": np.degrees(np.arctan2(east, north)) % 360.0,
        "el_deg": np.degrees(np.arctan2(up, np.hypot(east, north))),
        "el_airless_deg": np.degrees(np.arctan2(airless[2], np.hypot(airless[0], airless[1]))),
        "range_km": tau * C_KM_S,
        "ra_rate_arcsec_s": np.degrees(eastward) * 3600.0 / 0.2,
        "dec_rate_arcsec_s": np.degrees(northward) * 3600.0 / 0.2,
        "phase_deg": angle_deg(sun_apparent(t) - at_emission, observer - at_emission),
        "sun_el_deg": sun_here.transform_to(frame).alt.deg,
        "moon_el_deg": moon_el_deg,
        "moon_sep_deg": angle_deg(moon_here, geocentric),
        "moon_phase_deg": angle_deg(to_sun - moon_here - observer, -moon_here),
        "shadow": shadow(at_emission, to_sun - at_emission),
    }
