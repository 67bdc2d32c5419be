"""Reference tables of motion: SGP4, places and eclipses of satellites, torque-free tumbling."""

from datetime import datetime, timedelta
from pathlib import Path

import erfa
import numpy as np
import sgp4
from astropy.time import Time, TimeDelta
from mpmath import mp
from places_reference import (
    C_KM_S,
    SUN_RADIUS_KM,
    astrometric,
    direction_to_angles,
    earth,
    east_north_up,
    gcrs_to_itrf,
    light_time,
    orientation,
    satellite,
    satellite_gcrs,
    station_gcrs,
)
from reference_sky import STATIONS
from sgp4.api import SGP4_ERRORS, WGS72, Satrec

PACKAGE = Path(sgp4.__file__).parent
ELEMENTS = Path(__file__).resolve().parents[1] / "reference" / "satellites.tle"
AXES = ("x_km", "y_km", "z_km", "vx_km_s", "vy_km_s", "vz_km_s")

SATELLITES_UTC = datetime(2018, 1, 20)
STEP_S = 1.0  # of the central differences

EQUATOR_KM = 6378.137
FLATTENING = 1 / 298.257223563
ECLIPSES = {  # name: start of 24 h, UTC
    "ISS (ZARYA)": "2018-01-20T00:00:00",
    "CRYOSAT 2": "2018-01-20T00:00:00",
    "GPS BIIR-9  (PRN 21)": "2018-01-20T00:00:00",
    "GOES 14": "2018-03-10T00:00:00",
    "HIMAWARI-8": "2018-03-11T00:00:00",
    "MOLNIYA 1-86": "2018-01-20T00:00:00",
}
SCAN_S = 20.0
BISECTIONS = 24  # of SCAN_S: 1.2 us

DIGITS = 60
TUMBLES = (  # principal moments, body rates [rad/s]
    ((1.0, 2.0, 3.0), (0.01, 0.7, 0.02)),
    ((1.0, 1000.0, 1000.0001), (0.1, 0.001, 0.0005)),
    ((1.0, 1.0001, 2.0), (0.3, 0.2, 0.1)),
    ((1.0, 1.0001, 2.0), (0.001, 0.002, 6.2831853)),
    ((1.0, 2.0, 3.0), (0.1, 0.0, 0.0)),
    ((2.0, 2.0, 2.0), (0.1, 0.2, -0.3)),
    ((1.0, 2.0, 3.0), (0.5196152427902784, 0.4, 0.3)),
)
TIMES_S = (1.0, 10.0, 100.0, 1e4, 1e6)
FAST_END_S = 6e5  # 1e5 revolutions of the fourth case


def verification_cases():
    """(line 1, line 2, (start, stop, step) in minutes) of SGP4-VER.TLE."""
    lines = (PACKAGE / "SGP4-VER.TLE").read_text().splitlines()
    for line1, line2 in zip(lines, lines[1:]):
        if line1.startswith("1 "):
            yield line1[:69], line2[:69], [float(word) for word in line2[69:].split()]


def vallado_elements():
    """The element lines of the verification cases, 69 columns each."""
    return "".join(f"{line1}\n{line2}\n" for line1, line2, _ in verification_cases())


def sgp4_vallado():
    """Published SGP4 vectors: tcppver.out of Vallado et al. (AIAA 2006-6753), from python-sgp4.

    Elements: sgp4_vallado.tle, in the order of the published file (33 cases, catalogue number
    20413 twice with the same elements; checksums of 33333, 33334 and 33335 are wrong as published).
    TEME, km and km/s, as printed there (8 and 9 decimals); minutes from the epoch of the elements.
    Left out: second copies (20413 and 25954 at 0 min), and the one line of 33334, where the
    propagation fails and the published program printed the vector of the case before.
    python-sgp4 with WGS 72 in its improved mode ("i", what twoline2rv makes) gives every number to
    half a unit of the last printed digit (5.1e-9 km, 5e-10 km/s), except 20413 after 1844000 min
    (1.2e-7 km). In AFSPC mode ("a") 23599 differs by up to 0.97 km and 3.9e-4 km/s, 23333 by
    4.2e-6 km, 20413 by 4.7e-7 km, and the rest by 6e-9 km at most.
    """
    rows = {}
    number = None
    for line in (PACKAGE / "tcppver.out").read_text().splitlines():
        words = line.split()
        if words[1] == "xx":
            number = int(words[0])
        elif number != 33334:
            minutes, *vector = (float(word) for word in words[:7])
            rows.setdefault(
                (number, minutes),
                {"catalog_number": number, "minutes": minutes, **dict(zip(AXES, vector))},
            )
    return list(rows.values())


def sgp4_vallado_errors():
    """The first minute at which a verification case of SGP4 fails.

    Each case of sgp4_vallado.tle stepped from its start to its stop by its step (columns past 69
    of SGP4-VER.TLE) by python-sgp4, WGS 72, improved mode ("i"); AFSPC mode gives the same.
    Cases that do not fail are not listed.
    """
    rows = []
    for line1, line2, (start, stop, step) in verification_cases():
        sat = Satrec.twoline2rv(line1, line2, WGS72)
        for minutes in start + step * np.arange(round((stop - start) // step) + 1):
            error, _, _ = sat.sgp4_tsince(float(minutes))
            if error:
                rows.append(
                    {
                        "catalog_number": sat.satnum,
                        "minutes": minutes,
                        "error_code": error,
                        "meaning": SGP4_ERRORS[error],
                    }
                )
                break
    return rows


def elements():
    """Name -> the two lines."""
    lines = ELEMENTS.read_text().splitlines()
    return dict(zip(lines[::3], zip(lines[1::3], lines[2::3])))


def derivative(function):
    """Five-point central difference at 0, per second."""
    near = function(STEP_S) - function(-STEP_S)
    far = function(2.0 * STEP_S) - function(-2.0 * STEP_S)
    return (8.0 * near - far) / (12.0 * STEP_S)


def satellite_row(sat, station, t):
    def seen(seconds):
        """Astrometric direction, and range [km], joined."""
        when = t + TimeDelta(seconds, format="sec")
        observer = station_gcrs(station, when)[0]
        _, tau = light_time(lambda then: satellite_gcrs(sat, then), when, observer)
        return np.append(astrometric(sat, station, when), tau * C_KM_S)

    *direction, distance = seen(0.0)
    *moved, range_rate = derivative(seen)
    ra, dec = direction_to_angles(direction)
    a, d = np.radians([ra, dec])
    eastward = np.dot(moved, [-np.sin(a), np.cos(a), 0.0])
    northward = np.dot(moved, [-np.sin(d) * np.cos(a), -np.sin(d) * np.sin(a), np.cos(d)])

    observer, velocity = station_gcrs(station, t)
    geocentric, _ = light_time(lambda when: satellite_gcrs(sat, when), t, observer)
    ra_gcrs, dec_gcrs = direction_to_angles(geocentric)
    beta = velocity / C_KM_S
    natural = geocentric / np.linalg.norm(geocentric)
    proper = erfa.ab(natural, beta, 1.0, np.sqrt(1.0 - beta @ beta))
    east, north, up = east_north_up(station, t, proper)
    azimuth, elevation = direction_to_angles([north, east, up])
    return {
        "ra_deg": ra,
        "dec_deg": dec,
        "ra_gcrs_deg": ra_gcrs,
        "dec_gcrs_deg": dec_gcrs,
        "range_km": distance,
        "ra_rate_arcsec_s": np.degrees(eastward) * 3600.0,
        "dec_rate_arcsec_s": np.degrees(northward) * 3600.0,
        "range_rate_km_s": range_rate,
        "az_deg": azimuth,
        "el_airless_deg": elevation,
    }


def satellites():
    """Places of satellites by places_reference.py: python-sgp4, pyerfa, IERS.

    8 LEO, 4 MEO, 5 GEO, 3 HEO of satellites.tle; SGP4: WGS 72, AFSPC mode ("a"), TEME -> ITRF by
    GMST82 and polar motion, ITRF -> GCRS by IAU 2006/2000A with the EOP of the IERS.
    ra, dec: topocentric astrometric place, ICRS (barycentric light time, no aberration); ra_gcrs,
    dec_gcrs, range: light time of the geocentric frame, no aberration; az (from north through
    east), el: with diurnal aberration, no refraction; negative elevations are places too.
    Rates: five-point central differences of 1 s; ra_rate = dRA/dt cos(Dec). Rounding of the
    Earth's place limits ra, dec to 1e-5 arcsec and their rates to 5e-5 arcsec/s in low orbits.
    """
    rows = []
    for i, (name, lines) in enumerate(elements().items()):
        sat = satellite(*lines)
        for j in range(10):
            station = STATIONS[(i + j) % len(STATIONS)]
            seconds = 17280 * j + 787.375 * i
            utc = (SATELLITES_UTC + timedelta(seconds=seconds)).isoformat("T", "milliseconds")
            rows.append(
                {
                    "name": name,
                    "line1": lines[0],
                    "line2": lines[1],
                    "utc": utc,
                    "latitude_deg": station.latitude_deg,
                    "longitude_deg": station.longitude_deg,
                    "height_m": station.height_m,
                    **satellite_row(sat, station, Time(utc, scale="utc")),
                }
            )
    return rows


def satellite_and_sun(sat, t):
    """Geocentric ITRF positions [km] at an array of times, geometric."""
    errors, teme, _ = sat.sgp4_array(t.utc.jd1, t.utc.jd2)
    assert not errors.any()
    xp, yp, _, _ = orientation(t)
    gmst = erfa.gmst82(t.ut1.jd1, t.ut1.jd2)
    turn = erfa.pom00(xp, yp, 0.0) @ erfa.rz(gmst, np.eye(3))
    return erfa.rxp(turn, teme), erfa.rxp(gcrs_to_itrf(t), -earth(t)[0])


def extremum(values):
    """Least of periodic samples along the last axis, refined by a parabola."""
    least = np.argmin(values, axis=-1)[..., None]
    before, at, after = (
        np.take_along_axis(values, (least + step) % values.shape[-1], -1)[..., 0]
        for step in (-1, 0, 1)
    )
    return at - (after - before) ** 2 / (8.0 * (after - 2.0 * at + before))


def clearances(sat, t, points):
    """Least and greatest angle of the Sun's limb above the Earth's, in the space where the Earth
    is the unit sphere: the lines of sight stay straight, and so do the signs."""
    position, sun = satellite_and_sun(sat, t)
    to_sun = sun - position
    distance = np.linalg.norm(to_sun, axis=-1, keepdims=True)
    axis = to_sun / distance
    across = np.cross(axis, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    radius = np.arcsin(SUN_RADIUS_KM / distance)[..., None]
    turn = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)[:, None]
    rim = np.cos(turn) * across[:, None] + np.sin(turn) * np.cross(axis, across)[:, None]
    rays = np.cos(radius) * axis[:, None] + np.sin(radius) * rim

    to_sphere = np.array([1.0, 1.0, 1.0 / (1.0 - FLATTENING)]) / EQUATOR_KM
    rays = rays * to_sphere
    down = -(position * to_sphere)[:, None]
    angle = np.arctan2(np.linalg.norm(np.cross(rays, down), axis=-1), np.sum(rays * down, axis=-1))
    above = angle - np.arcsin(1.0 / np.linalg.norm(down, axis=-1))
    return extremum(above), -extremum(-above)


def contacts(sat, start):
    """(seconds from start, contact) over 24 h, in order of time."""

    def limbs(seconds, points):
        return clearances(sat, start + TimeDelta(seconds, format="sec"), points)

    scan = np.arange(0.0, 86400.0 + SCAN_S, SCAN_S)
    found = []
    for which, shadow in enumerate(("penumbra", "umbra")):
        hidden = limbs(scan, 72)[which] < 0.0
        at = np.flatnonzero(hidden[1:] != hidden[:-1])
        if not at.size:
            continue
        low, high, starts = scan[at], scan[at + 1], hidden[at + 1]
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            later = (limbs(middle, 720)[which] < 0.0) != starts
            low, high = np.where(later, middle, low), np.where(later, high, middle)
        names = np.where(starts, f"{shadow}_start", f"{shadow}_end")
        found += zip((low + high) / 2.0, names)
    return sorted(found)


def eclipses():
    """Contacts of satellites with the Earth's shadow over 24 h.

    At the satellite's own time, no light time, no atmosphere. Satellite: python-sgp4 (WGS 72,
    AFSPC mode, TEME -> ITRF as in places_reference.py). Sun: epv00, geometric, radius 695700 km.
    Earth: ellipsoid of WGS 84 about the z axis of the ITRF. penumbra_start, penumbra_end: the
    lines of sight to the Sun's limb (720 points and a parabola) begin or cease to meet the
    ellipsoid; umbra_start, umbra_end: from here, up to here all of them do. Bisection to 1.2 us.
    Windows of 24 h start at 2018-01-20T00:00:00 (GOES 14: 2018-03-10, HIMAWARI-8: 2018-03-11).
    """
    rows = []
    for name, start in ECLIPSES.items():
        lines = elements()[name]
        begin = Time(start, scale="utc", precision=6)
        for seconds, contact in contacts(satellite(*lines), begin):
            rows.append(
                {
                    "name": name,
                    "line1": lines[0],
                    "line2": lines[1],
                    "contact": str(contact),
                    "utc": (begin + TimeDelta(seconds, format="sec")).isot,
                }
            )
    return rows


def fixed_axis(rates, t):
    """Matrix of a turn about rates that do not change."""
    speed = mp.norm(rates)
    x, y, z = rates / speed
    wedge = mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return mp.eye(3) + mp.sin(speed * t) * wedge + (1 - mp.cos(speed * t)) * wedge**2


def cross(a, b):
    return mp.matrix(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def triad(momentum):
    """Columns: the third body axis square to the momentum, its partner, the momentum's unit."""
    up = momentum / mp.norm(momentum)
    out = mp.matrix([0, 0, 1]) - up[2] * up
    out /= mp.norm(out)
    side = cross(up, out)
    return mp.matrix([[out[i], side[i], up[i]] for i in range(3)])


def tumble_about_third(moments, rates, t):
    """(matrix body -> inertial, body rates) where the third body axis keeps its side.

    Rates by Jacobi's functions, the angle about the momentum by the elliptic integral of the
    third kind (Landau and Lifshitz, Mechanics, section 37).
    """
    i1, i2, i3 = moments
    momentum = mp.matrix([i * w for i, w in zip(moments, rates)])
    square = mp.fdot(momentum, momentum)
    energy = mp.fdot(momentum, rates)  # twice
    a1 = mp.sqrt((energy * i3 - square) / (i1 * (i3 - i1)))
    a2 = mp.sqrt((energy * i3 - square) / (i2 * (i3 - i2)))
    a3 = mp.sqrt((square - energy * i1) / (i3 * (i3 - i1))) * mp.sign(rates[2])
    a2 *= mp.sign(i3 - i1) * mp.sign(rates[2])
    pace = mp.sqrt((i3 - i2) * (square - energy * i1) / (i1 * i2 * i3))
    m = (i2 - i1) * (energy * i3 - square) / ((i3 - i2) * (square - energy * i1))
    least = square - (i3 * a3) ** 2
    n = -((i3 * a3) ** 2) * m / least

    start = mp.atan2(rates[1] / a2, rates[0] / a1)
    period = 4 * mp.ellipk(m)
    phase = mp.ellipf(start, m) + pace * t
    periods = mp.nint(phase / period)
    phase -= periods * period
    sn, cn, dn = (mp.ellipfun(kind, phase, m=m) for kind in ("sn", "cn", "dn"))
    third_kind = (
        mp.ellippi(n, mp.atan2(sn, cn), m)
        - mp.ellippi(n, start, m)
        + 4 * periods * mp.ellippi(n, m)
    )
    norm = mp.sqrt(square)
    angle = norm / i3 * t + norm * (energy - square / i3) / (least * pace) * third_kind

    moved = mp.matrix([a1 * cn, a2 * sn, a3 * dn])
    turn = mp.matrix(
        [[mp.cos(angle), -mp.sin(angle), 0], [mp.sin(angle), mp.cos(angle), 0], [0, 0, 1]]
    )
    body = triad(mp.matrix([i * w for i, w in zip(moments, moved)]))
    return triad(momentum) * turn * body.T, moved


def tumbled(moments, rates, t):
    """(matrix body -> inertial, body rates) after t from the identity, any body."""
    moments, rates = mp.matrix(moments), mp.matrix(rates)
    momentum = mp.matrix([i * w for i, w in zip(moments, rates)])
    if mp.norm(cross(momentum, rates)) == 0:
        return fixed_axis(rates, t), rates
    if mp.fdot(momentum, momentum) > mp.fdot(momentum, rates) * moments[1]:
        return tumble_about_third(moments, rates, t)
    swap = mp.matrix([[0, 0, 1], [0, -1, 0], [1, 0, 0]])  # the first axis keeps its side
    matrix, moved = tumble_about_third(moments[::-1], swap * rates, t)
    return swap * matrix * swap, swap * moved


def quaternion(matrix):
    """Scalar first, scalar not negative."""
    trace = matrix[0, 0] + matrix[1, 1] + matrix[2, 2]
    squares = [1 + trace] + [1 - trace + 2 * matrix[i, i] for i in range(3)]  # 4 q^2
    products = mp.matrix(4)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        products[0, 1 + i] = products[1 + i, 0] = matrix[k, j] - matrix[j, k]
        products[1 + j, 1 + k] = products[1 + k, 1 + j] = matrix[k, j] + matrix[j, k]
        products[1 + i, 1 + i] = squares[1 + i]
    products[0, 0] = squares[0]
    largest = max(range(4), key=lambda i: squares[i])
    q = [products[largest, i] / (2 * mp.sqrt(squares[largest])) for i in range(4)]
    return [value if q[0] >= 0 else -value for value in q]


def tumble():
    """Torque-free rigid bodies, by mpmath with 60 digits; every number rounded once.

    Principal moments i1..i3, body rates w1..w3 [rad/s] at t = 0, attitude identity; the inputs are
    the exact doubles. q0..q3: scalar first, takes body components to inertial components,
    dq/dt = q (0, w) / 2, q0 >= 0; w1_t..w3_t: body rates at t_s.
    Body rates by Jacobi's elliptic functions, precession by the integral of the third kind. The
    last case is a relative 1e-9 from the separatrix (i1 (i2 - i1) w1^2 = i3 (i3 - i2) w3^2).
    """
    rows = []
    with mp.workdps(DIGITS):
        for moments, rates in TUMBLES:
            fast = rates[2] > 1.0
            for t in TIMES_S[:-1] + (FAST_END_S,) if fast else TIMES_S:
                matrix, moved = tumbled(moments, rates, t)
                rows.append(
                    {
                        **dict(zip(("i1", "i2", "i3"), moments)),
                        **dict(zip(("w1", "w2", "w3"), rates)),
                        "t_s": t,
                        **{f"q{i}": float(q) for i, q in enumerate(quaternion(matrix))},
                        **{f"w{i + 1}_t": float(moved[i]) for i in range(3)},
                    }
                )
    return rows
