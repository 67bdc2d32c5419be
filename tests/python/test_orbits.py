"""Orbits from states, elements, mean elements and ephemerides; attitudes.

Integrated orbits against scipy's DOP853 with forces of its own; messages made from two-line sets
against the two-line sets.
"""

import json
import shutil

import numpy as np
import pytest
from astropy.table import Table
from astropy.time import Time, TimeDelta
from messages import (
    mean_elements,
    oem_kvn,
    oem_xml,
    omm_celestrak,
    omm_kvn,
    omm_space_track,
    omm_xml,
)
from night_reference import Ephemeris, Sky, angles_deg, dot, unit
from orbit_reference import field, potential, state_of, trajectory
from places_reference import Station, satellite
from scenes import GOES_14, ISS, MOLNIYA_3_50, scene
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation, Slerp

START = Time("2018-01-19T00:00:00", scale="utc")
DAY_S = 86400.0
KEPLER = ("a_km", "e", "i_deg", "raan_deg", "argp_deg", "mean_anomaly_deg")
ORBITS = {
    # name: elements, first exposure [s from their epoch], limit [m]
    "leo": ((7078.137, 0.01, 98.2, 40.0, 30.0, 10.0), 0.0, 1e-4),
    "gps": ((26560.0, 0.01, 55.0, 120.0, 60.0, 200.0), 0.0, 1e-3),
    "geo": ((42164.2, 0.0003, 0.05, 10.0, 20.0, 320.0), -DAY_S, 0.01),
    "gto": ((24400.0, 0.73, 7.0, 80.0, 178.0, 0.0), 0.0, 0.01),
    "e=0.95": ((150000.0, 0.95, 40.0, 200.0, 270.0, 10.0), -DAY_S, 0.02),
}
ORBIT_COUNT = 97
ORBIT_CADENCE_S = 1800.0

# satellite: elements, first epoch of the ephemeris, its step [s], number of epochs
EPHEMERIDES = {
    "iss": (ISS, "2018-01-21T01:00:00", 60.0, 181),
    "goes14": (GOES_14, "2018-01-20T00:00:00", 600.0, 145),
}
FRAMES = ("GCRF", "EME2000", "TEME", "ITRF2014")
SCALES = ("UTC", "TAI", "GPS", "TT")
INTERPOLATIONS = (("LAGRANGE", 9), ("HERMITE", 7), ("HERMITE", 11))
OEM_LIMIT_M = 1e-3


def target_toml(orbit, attitude="", name="satellite"):
    """A target; `orbit` is the body of its table, `attitude` all of its table or nothing."""
    return f"""
[[target]]
name = "{name}"
[target.brightness]
mag_v = 12.5
[target.orbit]
{orbit}
{attitude}
"""


def watching(targets, start, count, cadence_s, duration_s=0.0):
    return scene(
        exposures=f"""start = {start}Z
count = {count}
cadence_s = {cadence_s!r}
duration_s = {duration_s!r}""",
        pointing='at = "target"',
        targets=targets,
    )


def orbit_scene(orbit, *exposures):
    return watching(target_toml(orbit), *exposures)


@pytest.fixture(scope="module")
def planned(nightglass, tmp_path_factory):
    """Call as planned(scene text): the JSON of plan."""

    def call(text):
        path = tmp_path_factory.mktemp("plan") / "scene.toml"
        path.write_text(text)
        return json.loads(nightglass("plan", path, "--json", "-q"))

    return call


def column(rows, name):
    return np.array([row[name] for row in rows])


def vectors(rows):
    """From observer to satellite [km], light time in the geocentric frame."""
    ra, dec = np.radians([column(rows, "ra_gcrs_deg"), column(rows, "dec_gcrs_deg")])
    direction = [np.cos(dec) * np.cos(ra), np.cos(dec) * np.sin(ra), np.sin(dec)]
    return column(rows, "range_km")[:, None] * np.stack(direction, -1)


def apart_m(a, b):
    return 1e3 * float(np.linalg.norm(a - b, axis=-1).max())


def test_the_reference_field_is_the_gradient_of_its_potential():
    for place in ([7000.0, 1000.0, 2000.0], [-3000.0, 5000.0, -4000.0], [100.0, -200.0, 7000.0]):
        near, far = (
            [potential(place + h * axis) - potential(place - h * axis) for axis in np.eye(3)]
            for h in (20.0, 40.0)
        )
        slope = (8.0 * np.array(near) - far) / 240.0
        np.testing.assert_allclose(field(np.array(place)), slope, rtol=0.0, atol=1e-13)


def state_toml(epoch, position, velocity):
    return f"""[target.orbit.state]
epoch = {epoch}Z
frame = "gcrs"
position_km = {position.tolist()}
velocity_km_s = {velocity.tolist()}"""


@pytest.fixture(scope="module", params=ORBITS)
def integrated(request, planned):
    """(name, exposures [s from the epoch], rows of plan from the state)."""
    elements, first_s, _ = ORBITS[request.param]
    opening = START + TimeDelta(first_s, format="sec")
    state = state_toml(START.isot, *state_of(*elements))
    text = orbit_scene(state, opening.isot, ORBIT_COUNT, ORBIT_CADENCE_S)
    return request.param, first_s + ORBIT_CADENCE_S * np.arange(ORBIT_COUNT), planned(text)


def test_an_integrated_orbit(integrated):
    name, seconds, plan = integrated
    elements, _, limit_m = ORBITS[name]
    place = trajectory(START, *state_of(*elements), min(seconds[0] - 1.0, 0.0), seconds[-1])
    sky = Sky(START, seconds[-1])
    expected, _ = sky.seen(place, sky.station(Station(), seconds)[0], seconds)
    off = apart_m(vectors(plan["rows"]), expected)
    print(f"{name}: integrated over 2 days: {off:.2g} m off")
    assert off < limit_m


def test_elements_are_the_state_they_stand_for(integrated, planned):
    name, seconds, plan = integrated
    keys = "\n".join(f"{key} = {value!r}" for key, value in zip(KEPLER, ORBITS[name][0]))
    kepler = f'[target.orbit.kepler]\nepoch = {START.isot}Z\nframe = "gcrs"\n{keys}'
    opening = START + TimeDelta(seconds[0], format="sec")
    other = planned(orbit_scene(kepler, opening.isot, ORBIT_COUNT, ORBIT_CADENCE_S))
    off = apart_m(vectors(plan["rows"]), vectors(other["rows"]))
    print(f"{name}: elements against state: {off:.2g} m")
    assert off < 1e-4


def tle_toml(tle):
    return f'tle = ["{tle[0]}", "{tle[1]}"]'


def nightly(orbit):
    """Ten exposures in whose columns much changes."""
    return orbit_scene(orbit, "2018-01-21T00:00:00", 10, 1717.0, 3.0)


@pytest.mark.parametrize("tle", [ISS, GOES_14, MOLNIYA_3_50], ids=["iss", "goes14", "molniya"])
@pytest.mark.parametrize("write", [omm_kvn, omm_xml, omm_space_track, omm_celestrak])
def test_mean_elements_are_the_two_line_set(planned, tmp_path, tle, write):
    path = tmp_path / "elements.omm"
    path.write_text(write(mean_elements("SATELLITE & CO", *tle)))
    expected, found = planned(nightly(tle_toml(tle))), planned(nightly(f'omm = "{path}"'))
    for row, other in zip(expected["rows"], found["rows"], strict=True):
        assert row.keys() == other.keys()
        for name, value in row.items():
            if isinstance(value, float):
                assert abs(other[name] - value) < 1e-9, name
            else:
                assert other[name] == value, name


@pytest.fixture(scope="module", params=EPHEMERIDES)
def ephemeris(request, planned):
    """(name, its states, rows of plan from the two-line set)."""
    tle, *steps = EPHEMERIDES[request.param]
    made = Ephemeris(tle, *steps)
    return request.param, made, planned(exposures_of(made, tle_toml(tle)))["rows"]


def exposures_of(made, orbit, count=60):
    """Instantaneous exposures across all that is usable."""
    low, high = made.seconds[1] + 1.0, made.seconds[-2] - 1.0
    return orbit_scene(orbit, made.sky.time(low).isot, count, float(high - low) / (count - 1))


def halves(epochs, states):
    """Two segments; the first ends where the second begins, usable but for the outermost steps."""
    rows = list(zip(epochs, states.tolist()))
    half = len(rows) // 2
    return rows[: half + 2], rows[half - 1 :]


@pytest.mark.parametrize("frame", FRAMES)
def test_an_ephemeris_is_the_two_line_set_it_is_made_from(ephemeris, planned, tmp_path, frame):
    name, made, expected = ephemeris
    states, index = made.states(frame), FRAMES.index(frame)
    for number, interpolation in enumerate(INTERPOLATIONS):
        scale = SCALES[(index + number) % len(SCALES)]
        write = (oem_kvn, oem_xml)[(index // 2 + number) % 2]
        path = tmp_path / f"{number}.oem"
        path.write_text(write(halves(made.epochs(scale), states), frame, scale, *interpolation))
        rows = planned(exposures_of(made, f'oem = "{path}"'))["rows"]
        off = apart_m(vectors(rows), vectors(expected))
        kind = f"{write.__name__}, {frame}, {scale}, {interpolation[0]} {interpolation[1]}"
        print(f"{name}: {kind}: {off:.2g} m")
        assert off < OEM_LIMIT_M
        for row, other in zip(rows, expected, strict=True):
            for angle in ("ra_deg", "dec_deg", "az_deg", "el_deg", "phase_deg"):
                assert abs(row[angle] - other[angle]) < 1e-6, angle


class Watched:
    """Exposures of a two-line set: instants of emission, and the directions an attitude needs."""

    def __init__(self, tle, start, count, cadence_s, duration_s):
        self.exposures = (start, count, cadence_s, duration_s)
        self.orbit = tle_toml(tle)
        self.sky = Sky(Time(start, scale="utc"), cadence_s * count)
        received_s = cadence_s * np.arange(count) + duration_s / 2.0
        sat = satellite(*tle)
        observer, _ = self.sky.station(Station(), received_s)
        away, tau = self.sky.seen(self.sky.satellite(sat), observer, received_s)
        self.emitted_s = received_s - tau
        t = self.sky.time(self.emitted_s)
        position, velocity = (
            self.sky.teme_to_gcrs(self.emitted_s, teme)
            for teme in sat.sgp4_array(t.utc.jd1, t.utc.jd2)[1:]
        )
        self.directions = {
            "earth": unit(-position),
            "sun": unit(self.sky.apparent_sun(self.emitted_s) - position),
            "velocity": unit(velocity),  # of SGP4; the derivative of its place is 2 arcsec off
            "observer": unit(-away),
        }

    def scene(self, attitude):
        target = target_toml(self.orbit, f"[target.attitude]\n{attitude}")
        return watching(target, *self.exposures)


def triads(first, second):
    """Matrices whose columns are the first, the second as far as it is square to it, the third."""
    first = unit(first)
    second = unit(second - dot(first, second)[..., None] * first)
    return np.stack([first, second, np.cross(first, second)], -1)


def aligned(watched, point_body, point_to, turn_body, turn_to):
    to = triads(watched.directions[point_to], watched.directions[turn_to])
    return Rotation.from_matrix(to @ triads(np.array(point_body), np.array(turn_body)).T)


def inertial(watched, quaternion):
    turn = Rotation.from_quat(quaternion, scalar_first=True)
    return Rotation.concatenate([turn] * len(watched.emitted_s))


def spin(watched, quaternion, axis, period_s, phase_deg, epoch_s):
    angle = 2.0 * np.pi * (watched.emitted_s - epoch_s) / period_s + np.radians(phase_deg)
    turns = Rotation.from_rotvec(angle[:, None] * unit(np.array(axis)))
    return turns * inertial(watched, quaternion)


def tumble(watched, quaternion, inertia, rate_deg_s, epoch_s):
    """Euler's equations with dq/dt = q (0, w) / 2, by DOP853."""
    inertia = np.array(inertia)

    def motion(_, state):
        q, w = state[:4], state[4:]
        turning = 0.5 * np.append(-q[1:] @ w, q[0] * w + np.cross(q[1:], w))
        return np.append(turning, np.cross(inertia * w, w) / inertia)

    start = np.append(unit(np.array(quaternion)), np.radians(rate_deg_s))
    span = (epoch_s, watched.emitted_s[-1])
    found = solve_ivp(
        motion, span, start, "DOP853", t_eval=watched.emitted_s, rtol=1e-12, atol=1e-13
    )
    return Rotation.from_quat(found.y[:4].T, scalar_first=True)


def table_csv(watched, turns, step_s):
    """Attitudes at equal steps from the first exposure, every other one with its sign turned."""
    lines = ["time_utc,q0,q1,q2,q3"]
    for number, turn in enumerate(turns.as_quat(scalar_first=True)):
        sign = -1.0 if number % 2 else 1.0
        time = watched.sky.time(step_s * (number - 1)).isot
        lines.append(",".join([time, *(repr(float(sign * q)) for q in turn)]))
    return "\n".join(lines) + "\n"


GEO_WATCH = (GOES_14, "2018-01-20T03:00:00", 12, 2700.0, 5.0)
LEO_WATCH = (ISS, "2018-01-21T01:30:00", 20, 301.0, 1.0)
TILTED = [0.5, -0.1, 0.7, 0.5]  # of norm 1
AXES = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])
X, Y, Z = AXES
ATTITUDES = {
    # name: exposures, lines of the scene, reference, limit [deg]
    "inertial": (
        LEO_WATCH,
        f'mode = "inertial"\nquaternion = {TILTED}',
        lambda watched: inertial(watched, TILTED),
        1e-9,
    ),
    "spin": (
        GEO_WATCH,
        """mode = "spin"
axis = [3.0, -4.0, 12.0]
period_s = 97.0
phase_deg = 60.0""",
        lambda watched: spin(watched, [1.0, 0.0, 0.0, 0.0], [3.0, -4.0, 12.0], 97.0, 60.0, 0.0),
        1e-4,
    ),
    "spin from an epoch": (
        LEO_WATCH,
        f"""mode = "spin"
quaternion = {TILTED}
axis = [0.0, 1.0, -1.0]
period_s = 3.0
phase_deg = -45.0
epoch = 2018-01-21T00:30:00Z""",
        lambda watched: spin(watched, TILTED, [0.0, 1.0, -1.0], 3.0, -45.0, -3600.0),
        1e-3,
    ),
    "nadir of a low orbit": (
        LEO_WATCH,
        'mode = "nadir"',
        lambda watched: aligned(watched, Z, "earth", X, "velocity"),
        1e-6,
    ),
    "nadir of a high orbit": (
        GEO_WATCH,
        'mode = "nadir"',
        lambda watched: aligned(watched, Z, "earth", X, "velocity"),
        1e-6,
    ),
    "sun": (
        GEO_WATCH,
        'mode = "sun"',
        lambda watched: aligned(watched, Z, "sun", X, "velocity"),
        1e-5,
    ),
    "aligned to the observer": (
        LEO_WATCH,
        """mode = "aligned"
point_body = [1.0, 2.0, 2.0]
point_to = "observer"
turn_body = [0.0, 0.0, -1.0]
turn_to = "sun\"""",
        lambda watched: aligned(watched, [1.0, 2.0, 2.0], "observer", [0.0, 0.0, -1.0], "sun"),
        1e-6,
    ),
    "aligned to the velocity": (
        GEO_WATCH,
        """mode = "aligned"
point_body = [0.0, -5.0, 0.0]
point_to = "velocity"
turn_body = [0.0, 1.0, 1.0]
turn_to = "earth\"""",
        lambda watched: aligned(watched, [0.0, -5.0, 0.0], "velocity", [0.0, 1.0, 1.0], "earth"),
        1e-6,
    ),
    "tumble": (
        LEO_WATCH,
        f"""mode = "tumble"
quaternion = {TILTED}
inertia_kg_m2 = [1.0, 2.0, 2.5]
rate_deg_s = [0.1, 2.0, 0.3]""",
        lambda watched: tumble(watched, TILTED, [1.0, 2.0, 2.5], [0.1, 2.0, 0.3], 0.0),
        1e-4,
    ),
    "tumble from an epoch": (
        GEO_WATCH,
        """mode = "tumble"
inertia_kg_m2 = [500.0, 120.0, 480.0]
rate_deg_s = [0.02, -0.1, 0.05]
epoch = 2018-01-20T02:00:00Z""",
        lambda watched: tumble(
            watched, [1.0, 0.0, 0.0, 0.0], [500.0, 120.0, 480.0], [0.02, -0.1, 0.05], -3600.0
        ),
        1e-4,
    ),
}


def assert_attitudes(name, watched, rows, expected, limit_deg):
    quaternions = np.stack([column(rows, f"q{i}") for i in range(4)], -1)
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, rtol=0.0, atol=1e-12)
    found = Rotation.from_quat(quaternions, scalar_first=True)
    off = np.degrees((found * expected.inv()).magnitude().max())
    print(f"attitude, {name}: {off:.2g} deg off")
    assert off < limit_deg
    for body, direction in (("sun", "sun"), ("obs", "observer")):
        seen = np.stack([column(rows, f"{body}_body_{axis}") for axis in "xyz"], -1)
        assert angles_deg(found.apply(seen), watched.directions[direction]).max() < 1e-5


@pytest.mark.parametrize("name", ATTITUDES)
def test_attitude(produce, planned, name):
    exposures, lines, reference, limit_deg = ATTITUDES[name]
    watched = Watched(*exposures)
    text = watched.scene(lines)
    rows = planned(text)["attitudes"]
    assert_attitudes(name, watched, rows, reference(watched), limit_deg)
    table = Table.read(produce("plan", text) / "attitude.ecsv", format="ascii.ecsv")
    for row, other in zip(table, rows, strict=True):
        assert {key: row[key] for key in table.colnames} == other


def test_attitudes_of_a_table(planned, tmp_path):
    watched = Watched(*LEO_WATCH)
    step_s, count = 400.0, 20
    turns = Rotation.random(count, np.random.default_rng(1))
    path = tmp_path / "attitude.csv"
    path.write_text(table_csv(watched, turns, step_s))
    rows = planned(watched.scene(f'mode = "table"\nfile = "{path}"'))["attitudes"]
    between = Slerp(step_s * (np.arange(count) - 1.0), turns)
    assert_attitudes("table", watched, rows, between(watched.emitted_s), 1e-5)


def test_a_resolved_scene_is_complete(nightglass, tmp_path):
    """Messages and attitudes travel with it, files of the same name too."""
    watched, count = Watched(*GEO_WATCH), 25
    made = Ephemeris(*EPHEMERIDES["goes14"])
    segments = halves(made.epochs("TAI"), made.states("TEME"))
    contents = {
        "a/orbit.dat": omm_celestrak(mean_elements("GOES 14", *GOES_14)),
        "b/orbit.dat": oem_xml(segments, "TEME", "TAI", "HERMITE", 7),
        "c/orbit.dat": "\n".join(["GOES 14", *GOES_14]) + "\n",
    }
    for seed, folder in enumerate("ab"):
        turns = Rotation.random(count, np.random.default_rng(seed))
        contents[f"{folder}/attitude.csv"] = table_csv(watched, turns, 1800.0)
    for path, content in contents.items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(content)
    tables = {
        "a": 'mode = "table"\nfile = "a/attitude.csv"',
        "b": 'mode = "table"\nfile = "b/attitude.csv"',
        "c": 'mode = "spin"\naxis = [1.0, 2.0, 3.0]\nperiod_s = 77.0',  # from exposures.start
    }
    targets = "".join(
        target_toml(f'{kind} = "{name}/orbit.dat"', f"[target.attitude]\n{tables[name]}", name)
        for name, kind in zip("abc", ("omm", "oem", "tle"))
    )
    (tmp_path / "scene.toml").write_text(watching(targets, *watched.exposures))
    part = ("--crop", "1800,1800,64,64", "--frames", "0..1", "-q")

    first, again = tmp_path / "first", tmp_path / "again"
    plan = nightglass("plan", tmp_path / "scene.toml", "--json", "-q")
    nightglass("render", tmp_path / "scene.toml", "-o", first, *part)
    for folder in "abc":
        shutil.rmtree(tmp_path / folder)
    assert nightglass("plan", first / "scene.toml", "--json", "-q") == plan
    nightglass("render", first / "scene.toml", "-o", again, *part)
    for name in ("scene.toml", "plan.ecsv", "truth.ecsv", "frames/0000.fits"):
        assert (again / name).read_bytes() == (first / name).read_bytes(), name
