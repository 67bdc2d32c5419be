"""The sky over a span of time, tabulated: what brute force over thousands of instants needs.

Arrays of SI seconds from the start of the span go in. The definitions are those of
places_reference.py; only the slow series are interpolated (cubic splines through hourly values:
nutation to 1e-13 rad, Sun and Moon to a centimetre). Geocentric, GCRS, km.
"""

import erfa
import numpy as np
from astropy.time import Time, TimeDelta
from places_reference import (
    C_KM_S,
    EARTH_RATE,
    SUN_RADIUS_KM,
    earth,
    orientation,
    polar_motion,
    satellite,
)
from reference_motion import EQUATOR_KM, FLATTENING, extremum
from reference_sky import de421, sun_and_moon
from scipy.interpolate import CubicSpline

NODE_S = 3600.0
DAY_S = 86400.0


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def dot(a, b):
    return np.sum(a * b, axis=-1)


def angles_deg(a, b):
    """Angles between rows of vectors, good at every size."""
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), dot(a, b)))


class Sky:
    """Earth orientation, Sun and Moon from `start` over `length_s`, two hours more each way."""

    def __init__(self, start, length_s):
        self.start = start
        nodes = np.arange(-2.0 * NODE_S, length_s + 2.5 * NODE_S, NODE_S)
        t = self.time(nodes)
        self._pole = CubicSpline(nodes, np.stack(erfa.xys06a(t.tt.jd1, t.tt.jd2), -1))
        with de421() as kernel:
            moon = [sun_and_moon(kernel, *day)[1] for day in zip(t.tt.jd1, t.tt.jd2)]
        self.moon = CubicSpline(nodes, np.array(moon))
        heliocentric, barycentric = earth(t)
        self.sun = CubicSpline(nodes, -heliocentric)
        self._earth = CubicSpline(nodes, barycentric)

    def time(self, seconds):
        return self.start + TimeDelta(seconds, format="sec")

    def to_itrf(self, seconds):
        """Matrices GCRS -> ITRF."""
        t = self.time(seconds)
        _, _, dx, dy = orientation(t)
        x, y, s = np.moveaxis(self._pole(seconds), -1, 0)
        celestial = erfa.c2ixys(x + dx, y + dy, s)
        return erfa.c2tcio(celestial, erfa.era00(t.ut1.jd1, t.ut1.jd2), polar_motion(t))

    def teme_to_gcrs(self, seconds, vectors):
        t = self.time(seconds)
        xp, yp, _, _ = orientation(t)
        gmst = erfa.gmst82(t.ut1.jd1, t.ut1.jd2)
        turn = erfa.pom00(xp, yp, 0.0) @ erfa.rz(gmst, np.eye(3))
        return erfa.trxp(self.to_itrf(seconds), erfa.rxp(turn, vectors))

    def satellite(self, sat):
        """Place of a satellite of SGP4 as a function of seconds."""

        def place(seconds):
            t = self.time(seconds)
            errors, teme, _ = sat.sgp4_array(t.utc.jd1, t.utc.jd2)
            assert not errors.any()
            return self.teme_to_gcrs(seconds, teme)

        return place

    def station(self, station, seconds):
        """Position and velocity."""
        to_gcrs = np.swapaxes(self.to_itrf(seconds), -1, -2)
        position = to_gcrs @ station.itrf_km
        pole = to_gcrs @ polar_motion(self.time(seconds)) @ [0.0, 0.0, 1.0]
        return position, EARTH_RATE * np.cross(pole, position)

    def apparent_sun(self, seconds):
        """The Sun with its light time in the Earth's frame, annual aberration in other words."""
        return self.sun(seconds - np.linalg.norm(self.sun(seconds), axis=-1) / C_KM_S)

    def seen(self, place, observer, seconds):
        """(vectors from observers to place(t - tau), tau)."""
        tau = np.zeros_like(seconds)
        for _ in range(3):  # each gains a factor of 4e4, or more
            vectors = place(seconds - tau) - observer
            tau = np.linalg.norm(vectors, axis=-1) / C_KM_S
        return vectors, tau

    def astrometric(self, place, observer, seconds):
        """Vectors to place(t - tau) in the barycentric frame, those among the stars."""
        here = self._earth(seconds) + observer
        return self.seen(lambda when: self._earth(when) + place(when), here, seconds)[0]

    def east_north_up(self, station, directions, velocity, seconds):
        """Airless directions with diurnal aberration on the axes of the geodetic vertical."""
        proper = unit(unit(directions) + velocity / C_KM_S)
        x, y, z = np.moveaxis(erfa.rxp(self.to_itrf(seconds), proper), -1, 0)
        lon, lat = np.radians([station.longitude_deg, station.latitude_deg])
        east = -np.sin(lon) * x + np.cos(lon) * y
        out = np.cos(lon) * x + np.sin(lon) * y
        north, up = np.cos(lat) * z - np.sin(lat) * out, np.sin(lat) * z + np.cos(lat) * out
        return np.stack([east, north, up], -1)


class Ephemeris:
    """States of a two-line set at equal steps, in any frame."""

    def __init__(self, tle, first, step_s, count):
        self.seconds = step_s * np.arange(count)
        self.sky = Sky(Time(first, scale="utc", precision=9), self.seconds[-1])
        self.sat = satellite(*tle)

    def place(self, frame):
        gcrs = self.sky.satellite(self.sat)
        if frame == "TEME":
            return lambda seconds: self.teme(self.sky.time(seconds))
        if frame == "EME2000":
            bias, _, _ = erfa.bp06(erfa.DJ00, 0.0)
            return lambda seconds: gcrs(seconds) @ bias.T
        if frame == "ITRF2014":
            return lambda seconds: erfa.rxp(self.sky.to_itrf(seconds), gcrs(seconds))
        return gcrs

    def teme(self, t):
        return self.sat.sgp4_array(t.utc.jd1, t.utc.jd2)[1]

    def states(self, frame):
        """Positions, and velocities by five-point differences of 1 s."""
        place = self.place(frame)
        near, far = (place(self.seconds + h) - place(self.seconds - h) for h in (1.0, 2.0))
        return np.concatenate([place(self.seconds), (8.0 * near - far) / 12.0], axis=1)

    def epochs(self, scale):
        t = self.sky.time(self.seconds)
        if scale == "GPS":
            return (t.tai - TimeDelta(19.0, format="sec")).isot
        return getattr(t, scale.lower()).isot


def elevation_deg(east_north_up, station=None):
    """Elevations; with a station, those refracted by its air (SOFA refco, atioq)."""
    east, north, up = np.moveaxis(east_north_up, -1, 0)
    flat = np.hypot(east, north)
    if station is None or station.pressure_hpa == 0.0:
        return np.degrees(np.arctan2(up, flat))
    a, b = erfa.refco(station.pressure_hpa, station.temperature_c, station.humidity, 0.55)
    r, z = np.maximum(flat, 1e-6), np.maximum(up, 0.05)
    w = b * (r / z) ** 2
    bend = (a + w) * (r / z) / (1.0 + (a + 3.0 * w) / z**2)
    cosine = 1.0 - bend**2 / 2.0
    return np.degrees(np.arctan2(cosine * up + bend * r, flat * (cosine - bend * z / r)))


def azimuth_deg(east_north_up):
    return np.degrees(np.arctan2(east_north_up[..., 0], east_north_up[..., 1])) % 360.0


def sunlit_margin(position, sun, to_itrf, points=360):
    """Least angle of the Sun's limb above the WGS 84 ellipsoid's, in the space where the Earth is
    the unit sphere: positive where the whole disc is seen."""
    position, sun = erfa.rxp(to_itrf, position), erfa.rxp(to_itrf, sun)
    to_sun = sun - position
    distance = np.linalg.norm(to_sun, axis=-1, keepdims=True)
    axis = to_sun / distance
    across = unit(np.cross(axis, [0.0, 0.0, 1.0]))
    radius = np.arcsin(SUN_RADIUS_KM / distance)[..., None]
    turn = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)[:, None]
    rim = np.cos(turn) * across[:, None] + np.sin(turn) * np.cross(axis, across)[:, None]
    to_sphere = np.array([1.0, 1.0, 1.0 / (1.0 - FLATTENING)]) / EQUATOR_KM
    rays = (np.cos(radius) * axis[:, None] + np.sin(radius) * rim) * to_sphere
    down = -(position * to_sphere)[:, None]
    angle = np.arctan2(np.linalg.norm(np.cross(rays, down), axis=-1), dot(rays, down))
    return extremum(angle - np.arcsin(1.0 / np.linalg.norm(down, axis=-1)))
