"""Independent orbits: Kepler's elements, and the equations of motion integrated by scipy's DOP853.

Forces: Earth as a point and EGM2008 to degree and order 4, turned by IAU 2006/2000A and the
IERS; Sun (epv00) and Moon (JPL DE421) as point masses, direct less indirect. GCRS, km, s.
"""

from math import factorial, sqrt

import erfa
import numpy as np
from astropy.time import TimeDelta
from places_reference import EARTH_RATE, earth, orientation, polar_motion
from reference_sky import de421, sun_and_moon
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.special import lpmv

EARTH_GM = 398600.4415  # km^3/s^2
SUN_GM = 1.3271244e11
MOON_GM = 0.0123000371 * EARTH_GM
RADIUS_KM = 6378.1363
FIELD = {  # degree, order: normalized C, S of EGM2008
    (2, 0): (-4.84165143790815e-4, 0.0),
    (2, 1): (-2.06615509074176e-10, 1.38441389137979e-9),
    (2, 2): (2.43938357328313e-6, -1.40027370385934e-6),
    (3, 0): (9.57161207093473e-7, 0.0),
    (3, 1): (2.03046201047864e-6, 2.48200415856872e-7),
    (3, 2): (9.04787894809528e-7, -6.19005475177618e-7),
    (3, 3): (7.21321757121568e-7, 1.41434926192941e-6),
    (4, 0): (5.39965866638991e-7, 0.0),
    (4, 1): (-5.36157389388867e-7, -4.73567346518086e-7),
    (4, 2): (3.50501623962649e-7, 6.62480026275829e-7),
    (4, 3): (9.90856766672321e-7, -2.00956723567452e-7),
    (4, 4): (-1.88519633023033e-7, 3.08803882149194e-7),
}
RTOL = 1e-13
ATOL = 1e-12  # km, km/s
NODE_S = 3600.0


def state_of(a_km, e, i_deg, raan_deg, argp_deg, mean_anomaly_deg):
    """Position and velocity of osculating elements."""
    i, raan, argp, mean = np.radians([i_deg, raan_deg, argp_deg, mean_anomaly_deg])
    low, high = mean - e, mean + e
    for _ in range(200):  # bisection: E - e sin E grows with E
        middle = (low + high) / 2.0
        below = middle - e * np.sin(middle) < mean
        low, high = (middle, high) if below else (low, middle)
    cosine, sine, flat = np.cos(low), np.sin(low), np.sqrt(1.0 - e * e)
    speed = np.sqrt(EARTH_GM / a_km) / (1.0 - e * cosine)
    turn = erfa.rz(-raan, np.eye(3)) @ erfa.rx(-i, np.eye(3)) @ erfa.rz(-argp, np.eye(3))
    position = turn @ [a_km * (cosine - e), a_km * flat * sine, 0.0]
    return position, turn @ [-speed * sine, speed * flat * cosine, 0.0]


def unnormalized():
    """(degree, order, C, S)."""
    for (n, m), (c, s) in FIELD.items():
        norm = sqrt((2 - (m == 0)) * (2 * n + 1) * factorial(n - m) / factorial(n + m))
        yield n, m, c * norm, s * norm


TERMS = tuple(unnormalized())


def potential(position):
    """Of degrees 2 to 4 [km^2/s^2], by associated Legendre functions."""
    x, y, z = position
    r, longitude = np.sqrt(x * x + y * y + z * z), np.arctan2(y, x)
    return (EARTH_GM / r) * sum(
        (RADIUS_KM / r) ** n
        * (-1) ** m  # scipy has the phase of Condon and Shortley
        * lpmv(m, n, z / r)
        * (c * np.cos(m * longitude) + s * np.sin(m * longitude))
        for n, m, c, s in TERMS
    )


def field(position):
    """Acceleration [km/s^2] of degrees 2 to 4 at a place in the ITRF.

    Solid harmonics V + iW by the recursion of Cunningham (1970), derivatives as in Montenbruck
    and Gill, Satellite Orbits, section 3.2.
    """
    x, y, z = position.tolist()
    scale = RADIUS_KM / (x * x + y * y + z * z)
    along, across, shrink = z * scale, complex(x, y) * scale, RADIUS_KM * scale
    v = {(0, 0): complex(sqrt(shrink))}
    for m in range(6):
        if m > 0:
            v[m, m] = (2 * m - 1) * across * v[m - 1, m - 1]
        for n in range(m + 1, 6):
            older = (n + m - 1) * shrink * v[n - 2, m] if n > m + 1 else 0.0
            v[n, m] = ((2 * n - 1) * along * v[n - 1, m] - older) / (n - m)
    level, up = 0j, 0.0
    for n, m, c, s in TERMS:
        coefficient = complex(c, s)
        outer, inner = v[n + 1, m + 1], v[n + 1, abs(m - 1)]
        if m == 0:
            level -= c * outer
        else:
            # d/dx + i d/dy of Re((C - iS)(V + iW))
            level += 0.5 * (
                (n - m + 2) * (n - m + 1) * coefficient * inner.conjugate()
                - coefficient.conjugate() * outer
            )
        up -= (n - m + 1) * (coefficient.conjugate() * v[n + 1, m]).real
    return np.array([level.real, level.imag, up]) * EARTH_GM / RADIUS_KM**2


def third_body(position, body, gm):
    away = body - position
    return gm * (away / np.linalg.norm(away) ** 3 - body / np.linalg.norm(body) ** 3)


class Forces:
    """Tables of Earth orientation, Sun and Moon over [low_s, high_s] from an epoch."""

    def __init__(self, epoch, low_s, high_s):
        nodes = np.arange(low_s - 2.0 * NODE_S, high_s + 2.5 * NODE_S, NODE_S)
        t = epoch + TimeDelta(nodes, format="sec")
        _, _, dx, dy = orientation(t)
        x, y, s = erfa.xys06a(t.tt.jd1, t.tt.jd2)
        with de421() as kernel:
            moon = [sun_and_moon(kernel, *day)[1] for day in zip(t.tt.jd1, t.tt.jd2)]
        angle = np.unwrap(erfa.era00(t.ut1.jd1, t.ut1.jd2)) - EARTH_RATE * nodes
        columns = (
            erfa.c2ixys(x + dx, y + dy, s).reshape(-1, 9),
            polar_motion(t).reshape(-1, 9),
            -earth(t)[0],
            np.array(moon),
            angle[:, None],
        )
        self.table = CubicSpline(nodes, np.concatenate(columns, axis=1))

    def acceleration(self, seconds, position):
        row = self.table(seconds)
        celestial, polar = row[:9].reshape(3, 3), row[9:18].reshape(3, 3)
        angle = row[24] + EARTH_RATE * seconds
        to_itrf = polar @ erfa.rz(angle, celestial)
        return (
            -EARTH_GM * position / np.linalg.norm(position) ** 3
            + field(to_itrf @ position) @ to_itrf
            + third_body(position, row[18:21], SUN_GM)
            + third_body(position, row[21:24], MOON_GM)
        )


def trajectory(epoch, position, velocity, low_s, high_s):
    """Place [km] as a function of an array of seconds from the epoch, low_s <= 0 <= high_s."""
    forces = Forces(epoch, low_s, high_s)

    def motion(seconds, state):
        return np.concatenate([state[3:], forces.acceleration(seconds, state[:3])])

    start = np.concatenate([position, velocity])
    halves = [
        solve_ivp(motion, (0.0, end), start, "DOP853", dense_output=True, rtol=RTOL, atol=ATOL).sol
        for end in (low_s, high_s)
        if end != 0.0
    ]

    def place(seconds):
        backward, forward = halves[0], halves[-1]
        return np.where(seconds < 0.0, backward(seconds)[:3], forward(seconds)[:3]).T

    return place
