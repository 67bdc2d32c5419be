"""Windows, crossings and the chart of the night against brute force over every ten seconds."""

import json
import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field, replace

import erfa
import numpy as np
import pytest
from astropy.io import fits
from astropy.table import Table
from astropy.time import Time, TimeDelta
from astropy.wcs import WCS
from messages import oem_kvn
from night_reference import (
    DAY_S,
    Ephemeris,
    Sky,
    angles_deg,
    azimuth_deg,
    elevation_deg,
    sunlit_margin,
)
from places_reference import Station, satellite, separation_arcsec
from reference_motion import elements
from scenes import scene, target
from sgp4.io import compute_checksum
from support import assert_units

SCAN_S = 10.0
BISECTIONS = 20  # of SCAN_S: 10 us
EDGE_S = 0.2
REASONS = ("elevation", "horizon", "Sun", "Moon", "shadow")  # asked in this order, told by name


@dataclass(frozen=True)
class Case:
    """A satellite of satellites.tle, the opening of the first exposure, a station, limits."""

    name: str
    start: str
    station: Station = field(default_factory=Station)
    min_el_deg: float = 10.0
    max_sun_el_deg: float = -12.0
    min_moon_sep_deg: float = 10.0
    horizon_deg: tuple = ((0.0, 0.0), (360.0, 0.0))

    @property
    def tle(self):
        return elements()[self.name]

    @property
    def noon(self):
        """Local mean solar noon before the first exposure."""
        opening = Time(self.start, scale="utc", precision=9)
        midnight = Time(self.start[:10], scale="utc", precision=9)
        hours = (12.0 - self.station.longitude_deg / 15.0) % 24.0
        noon = midnight + TimeDelta(3600.0 * hours, format="sec")
        return noon if noon <= opening else noon - TimeDelta(DAY_S, format="sec")

    def scene(self, targets=None, exposures=(1, 60.0, 2.0)):
        count, cadence_s, duration_s = exposures
        s = self.station
        return scene(
            exposures=f"""start = {self.start}Z
count = {count}
cadence_s = {cadence_s}
duration_s = {duration_s}""",
            pointing='at = "target"',
            targets=target(self.tle) if targets is None else targets,
            station=f"""latitude_deg = {s.latitude_deg}
longitude_deg = {s.longitude_deg}
height_m = {s.height_m}
horizon_deg = {[list(pair) for pair in self.horizon_deg]}""",
            rest=f"""[plan]
min_el_deg = {self.min_el_deg}
max_sun_el_deg = {self.max_sun_el_deg}
min_moon_sep_deg = {self.min_moon_sep_deg}""",
        )


def at(latitude_deg, longitude_deg, height_m=0.0):
    return Station(latitude_deg, longitude_deg, height_m)


CASES = {
    "iss, mornings": Case("ISS (ZARYA)", "2018-01-16T03:00:00", max_sun_el_deg=5.0),
    "iss, evenings": Case("ISS (ZARYA)", "2018-01-25T03:00:00", max_sun_el_deg=5.0),
    "gps": Case("GPS BIIR-9  (PRN 21)", "2018-01-20T03:00:00"),
    "molniya": Case("MOLNIYA 3-50", "2018-01-20T03:00:00", at(55.0, 37.0), max_sun_el_deg=5.0),
    "goes 14, eclipsed": Case("GOES 14", "2018-03-10T03:00:00"),
    "goes 14, near the Moon": Case("GOES 14", "2018-01-25T03:00:00", min_moon_sep_deg=60.0),
    "polar": Case(
        "METOP-A",
        "2018-01-18T03:00:00",
        at(65.0, 25.0, 100.0),
        max_sun_el_deg=-3.0,
        horizon_deg=((0.0, 40.0), (90.0, 0.0), (200.0, 25.0), (360.0, 40.0)),
    ),
    "north pole": Case("IRIDIUM 7 [+]", "2018-01-20T03:00:00", at(90.0, 0.0, 12.0)),
    "south pole": Case("METOP-A", "2018-06-20T03:00:00", at(-90.0, -45.0, 2835.0)),
    "longitude 180": Case(
        "AJISAI (EGS)", "2018-01-20T03:00:00", at(-16.75, 180.0, 310.0), max_sun_el_deg=5.0
    ),
}


class Night:
    """Every criterion over a night: positive where it allows.

    The Sun that sets and the Sun that is eclipsed are the apparent ones: in the Earth's frame the
    light comes from where the Sun was seen, and so does the shadow lie.
    """

    def __init__(self, case):
        self.case = case
        self.sky = Sky(case.noon, DAY_S)
        self.place = self.sky.satellite(satellite(*case.tle))

    def look(self, seconds):
        """(reason -> margin of all but the shadow, emission, apparent elevation)."""
        case, sky = self.case, self.sky
        observer, velocity = sky.station(case.station, seconds)
        away, tau = sky.seen(self.place, observer, seconds)
        moon, _ = sky.seen(sky.moon, observer, seconds)
        local = sky.east_north_up(case.station, away, velocity, seconds)
        sun = sky.east_north_up(
            case.station, sky.apparent_sun(seconds) - observer, velocity, seconds
        )
        elevation = elevation_deg(local, case.station)
        mask = np.interp(azimuth_deg(local), *np.transpose(case.horizon_deg))
        margins = {
            "elevation": elevation - case.min_el_deg,
            "horizon": elevation - mask,
            "Sun": case.max_sun_el_deg - elevation_deg(sun),
            "Moon": angles_deg(moon, away) - case.min_moon_sep_deg,
        }
        return margins, seconds - tau, elevation

    def refusals(self, seconds):
        """Index into REASONS of the first criterion that refuses, -1 where none does."""
        margins, emitted, _ = self.look(seconds)
        refused = np.stack([margins[name] < 0.0 for name in REASONS[:-1]])
        result = np.where(refused.any(axis=0), refused.argmax(axis=0), -1)
        free = np.flatnonzero(result == -1)
        if free.size:
            when = emitted[free]
            lit = sunlit_margin(
                self.place(when), self.sky.apparent_sun(when), self.sky.to_itrf(when), points=72
            )
            result[free[lit < 0.0]] = len(REASONS) - 1
        return result

    def scan(self):
        """(edges between allowed and refused [s], refusals at every SCAN_S)."""
        seconds = np.arange(0.0, DAY_S + SCAN_S / 2.0, SCAN_S)
        refusals = self.refusals(seconds)
        allowed = refusals == -1
        at_edge = np.flatnonzero(allowed[1:] != allowed[:-1])
        low, high, starts = seconds[at_edge], seconds[at_edge + 1], allowed[at_edge]
        for _ in range(BISECTIONS if at_edge.size else 0):
            middle = (low + high) / 2.0
            early = (self.refusals(middle) == -1) == starts
            low, high = np.where(early, middle, low), np.where(early, high, middle)
        return low, refusals

    def highest(self, low, high):
        """Greatest apparent elevation within an interval."""
        for _ in range(3):
            seconds = np.linspace(low, high, 201)
            elevation = self.look(seconds)[2]
            best = elevation.argmax()
            low, high = seconds[max(best - 1, 0)], seconds[min(best + 1, 200)]
        return elevation.max()


def criterion(text):
    """Index of the reason that a text tells."""
    (index,) = (index for index, word in enumerate(REASONS) if word in text)
    return index


def seconds_after(start, texts):
    return (Time(list(texts), scale="utc") - start).to_value("s")


@pytest.fixture(scope="module", params=CASES)
def windows(request, nightglass, tmp_path_factory):
    """(name, rows of windows, night, edges, refusals)."""
    case = CASES[request.param]
    path = tmp_path_factory.mktemp("windows") / "scene.toml"
    path.write_text(case.scene())
    rows = json.loads(nightglass("plan", path, "--json", "-q"))["windows"]
    night = Night(case)
    return request.param, rows, night, *night.scan()


def test_rows_tile_the_night(windows):
    _, rows, night, _, _ = windows
    starts = seconds_after(night.sky.start, [row["start_utc"] for row in rows])
    ends = seconds_after(night.sky.start, [row["end_utc"] for row in rows])
    assert abs(starts[0]) < 2e-6 and abs(ends[-1] - DAY_S) < 2e-6
    assert [row["start_utc"] for row in rows[1:]] == [row["end_utc"] for row in rows[:-1]]
    np.testing.assert_allclose(ends - starts, [row["duration_s"] for row in rows], atol=2e-6)
    observable = [row["observable"] for row in rows]
    assert all(a != b for a, b in zip(observable, observable[1:]))


def test_edges(windows):
    name, rows, night, edges, _ = windows
    found = seconds_after(night.sky.start, [row["end_utc"] for row in rows[:-1]])
    assert len(found) == len(edges), (found, edges)
    worst = np.abs(found - edges).max(initial=0.0)
    print(f"windows, {name}: {len(edges)} edges, {worst:.2g} s off")
    assert worst < EDGE_S


def test_reasons(windows):
    """Of a refused row: shares of time, each instant counted to the first criterion that refuses;
    of an allowed one: what refuses just outside."""
    _, rows, night, edges, refusals = windows
    bounds = [0.0, *edges, DAY_S]
    for row, low, high in zip(rows, bounds[:-1], bounds[1:], strict=True):
        if row["observable"]:
            outside = night.refusals(np.array([low - EDGE_S, high + EDGE_S]))
            told = [part.split(": ")[1] for part in row["why"].split("; ")]
            assert [criterion(text) for text in told] == outside.tolist(), row["why"]
            continue
        within = refusals[int(np.ceil(low / SCAN_S)) : int(np.floor(high / SCAN_S)) + 1]
        shares = [100.0 * np.mean(within == index) for index in range(len(REASONS))]
        told = np.zeros(len(REASONS))
        for text in row["why"].split("; "):
            percent = re.search(r"\(([0-9.]+) %\)", text)
            told[criterion(text)] = float(percent[1]) if percent else 100.0
        np.testing.assert_allclose(told, shares, rtol=0.0, atol=0.1 + 200.0 / len(within))


def test_highest(windows):
    _, rows, night, _, _ = windows
    for row in rows:
        if not row["observable"]:
            assert row["max_el_deg"] is None and row["max_el_utc"] == ""
            continue
        low, high, peak = seconds_after(
            night.sky.start, [row["start_utc"], row["end_utc"], row["max_el_utc"]]
        )
        assert low <= peak <= high
        assert abs(night.look(np.array([peak]))[2][0] - row["max_el_deg"]) < 1e-4
        assert abs(night.highest(low, high) - row["max_el_deg"]) < 1e-3


def resembling(tle, number, ahead_deg):
    """Elements of another object on the same orbit."""
    line1, line2 = tle
    anomaly = (float(line2[43:51]) + ahead_deg) % 360.0
    changed = (
        f"1 {number:05d}{line1[7:68]}",
        f"2 {number:05d}{line2[7:43]}{anomaly:8.4f}{line2[51:68]}",
    )
    return tuple(f"{line}{compute_checksum(line)}" for line in changed)


def catalogue(base, shifts_deg):
    """Number -> (name, elements): objects along an orbit, and those of satellites.tle."""
    found = {int(tle[0][2:7]): (name, tle) for name, tle in elements().items()}
    for step, shift in enumerate(shifts_deg):
        number = 90000 + step
        found[number] = (f"OBJECT {step}", resembling(base, number, shift))
    return found


def three_line_sets(objects):
    return "".join(f"{name}\n{tle[0]}\n{tle[1]}\n" for name, tle in objects.values())


FENGYUN_4A = (
    "1 41882U 16077A   18020.54120315 -.00000327  00000-0  00000-0 0  9999",
    "2 41882   0.0145  44.5627 0009553  80.5691 294.1905  1.00275283  4208",
)
FENGYUN_2G = (  # 0.2 deg from it
    "1 40367U 14090A   18020.54120315 -.00000328  00000-0  00000-0 0  9990",
    "2 40367   0.1874 167.7753 0001582 179.6776  72.0413  1.00276298 11269",
)


@dataclass(frozen=True)
class Field:
    """Exposures of a field of one degree, fixed among the stars, and what may cross it."""

    station: Station
    start: str
    exposures: tuple  # count, cadence [s], duration [s]
    radec_deg: tuple
    objects: dict
    samples: int  # of an exposure: nothing crosses between two

    @property
    def scene(self):
        count, cadence_s, duration_s = self.exposures
        s = self.station
        return scene(
            exposures=f"""start = {self.start}Z
count = {count}
cadence_s = {cadence_s}
duration_s = {duration_s}
track = "sidereal\"""",
            pointing=f'at = "radec"\nra_deg = {self.radec_deg[0]}\ndec_deg = {self.radec_deg[1]}',
            station=f"""latitude_deg = {s.latitude_deg}
longitude_deg = {s.longitude_deg}
height_m = {s.height_m}""",
            telescope="plate_scale_arcsec = 0.87890625",
            rest="[stars]\nenabled = false",
        )


FIELDS = {
    "geostationary": Field(
        station=at(25.0, 103.0, 2000.0),
        start="2018-01-20T18:02:00",
        exposures=(4, 200.0, 120.0),
        radec_deg=(136.52, -4.1),
        objects=catalogue(FENGYUN_4A, np.arange(-2.0, 2.0, 0.3))
        | {41882: ("FENGYUN 4A", FENGYUN_4A), 40367: ("FENGYUN 2G", FENGYUN_2G)},
        samples=61,
    ),
    "low": Field(
        station=Station(),
        start="2018-01-25T01:44:30",
        exposures=(25, 6.0, 5.0),
        radec_deg=(22.22, 46.79),
        objects=catalogue(elements()["ISS (ZARYA)"], np.arange(-5.0, 5.0, 0.13)),
        samples=101,
    ),
}
CROSSING_UNITS = {
    "x_enter_px": "pix",
    "y_leave_px": "pix",
    "ra_deg": "deg",
    "dec_deg": "deg",
    "range_km": "km",
    "rate_arcsec_s": "arcsec / s",
    "phase_deg": "deg",
    "element_age_d": "d",
}
CROSSING_S = 0.05
PLACE_PX = 0.05
PLACE_ARCSEC = 0.01


SIDE_PX = 4096
FIELD_RAD = np.radians(1.0)  # more than half its diagonal


class Crossings:
    """Who is inside which frame when, by brute force."""

    def __init__(self, field, directory):
        count, cadence_s, duration_s = field.exposures
        self.field = field
        self.sky = Sky(Time(field.start, scale="utc", precision=9), count * cadence_s)
        shutter_s = np.linspace(0.0, duration_s, field.samples)
        self.seconds = (cadence_s * np.arange(count)[:, None] + shutter_s).ravel()
        headers = [fits.getheader(path) for path in sorted((directory / "frames").glob("*.fits"))]
        assert len(headers) == count
        for header in headers:  # of a piece of the frame
            header["CRPIX1"] += header["CROPX0"]
            header["CRPIX2"] += header["CROPY0"]
        self.frames = [WCS(header) for header in headers]

    def places_deg(self, tle, seconds):
        observer, _ = self.sky.station(self.field.station, seconds)
        place = self.sky.satellite(satellite(*tle))
        x, y, z = self.sky.astrometric(place, observer, seconds).T
        return np.degrees([np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))])

    def crossings(self, tle):
        """Frame -> (opening or entry, closing or exit) [s]."""
        lon, lat = self.places_deg(tle, self.seconds)
        off = erfa.seps(*np.radians([lon, lat]), *np.radians(self.field.radec_deg))
        found = {}
        for frame, wcs in enumerate(self.frames):
            part = np.arange(self.field.samples) + frame * self.field.samples
            if off[part].min() > FIELD_RAD:
                continue
            pixels = wcs.wcs_world2pix(lon[part], lat[part], 0)
            # of the nearest edge, positive inside
            margin = SIDE_PX / 2.0 - np.abs(np.array(pixels) - (SIDE_PX - 1) / 2.0).max(axis=0)
            inside = np.flatnonzero(margin > 0.0)
            if inside.size:
                first, last = inside[[0, -1]]
                assert inside.size == last - first + 1
                seconds = self.seconds[part]
                found[frame] = [
                    (
                        np.interp(0.0, margin[[out, within]], seconds[[out, within]])
                        if 0 <= out < part.size
                        else seconds[within]
                    )
                    for out, within in ((first - 1, first), (last + 1, last))
                ]
        return found


@pytest.mark.filterwarnings("ignore:'obsfix' made the change")
@pytest.mark.parametrize("name", FIELDS)
def test_crossings(nightglass, tmp_path, name):
    field = FIELDS[name]
    path, sets = tmp_path / "scene.toml", tmp_path / "objects.tle"
    path.write_text(field.scene)
    sets.write_text(three_line_sets(field.objects))
    nightglass("render", path, "-o", tmp_path / "out", "--crop", "2000,2000,8,8", "-q")
    command = ("plan", path, "--catalog", sets, "--crossings", "-q")
    rows = json.loads(nightglass(*command, "--json"))["rows"]
    nightglass(*command, "-o", tmp_path / "crossings")
    table = Table.read(tmp_path / "crossings" / "crossings.ecsv", format="ascii.ecsv")
    assert_units(table, CROSSING_UNITS)
    assert [dict(zip(table.colnames, row)) for row in table] == rows
    found = {(row["frame"], row["catalog_number"]): row for row in rows}

    brute = Crossings(field, tmp_path / "out")
    expected = {
        (frame, number): times
        for number, (_, tle) in field.objects.items()
        for frame, times in brute.crossings(tle).items()
    }
    assert found.keys() == expected.keys()
    assert len(found) == len(rows) > 10
    worst = 0.0
    for (frame, number), times in expected.items():
        row = found[frame, number]
        label, tle = field.objects[number]
        assert row["target"] == label
        told = seconds_after(brute.sky.start, [row["enter_utc"], row["leave_utc"]])
        worst = max(worst, np.abs(told - times).max())
        lon, lat = brute.places_deg(tle, np.append(told, told.mean()))
        pixels = brute.frames[frame].wcs_world2pix(lon[:2], lat[:2], 0)
        told_px = [[row[f"{axis}_{end}_px"] for end in ("enter", "leave")] for axis in "xy"]
        np.testing.assert_allclose(told_px, pixels, rtol=0.0, atol=PLACE_PX)
        assert separation_arcsec(lon[2], lat[2], row["ra_deg"], row["dec_deg"]) < PLACE_ARCSEC
    print(f"crossings, {name}: {len(rows)}, {worst:.2g} s off")
    assert worst < CROSSING_S


def whole_night(case):
    """The same case with an exposure of 50 s in every minute from noon to noon."""
    return replace(case, start=case.noon.isot), (1440, 60.0, 50.0)


@pytest.mark.parametrize("name", ["goes 14, eclipsed", "longitude 180", "polar"])
def test_frames_of_the_rows(nightglass, tmp_path, name):
    """first and last: exposures wholly within a row; cut: those across its ends; an exposure is
    observable where its middle is."""
    case, exposures = whole_night(CASES[name])
    path = tmp_path / "scene.toml"
    path.write_text(case.scene(exposures=exposures))
    plan = json.loads(nightglass("plan", path, "--json", "-q"))
    count, cadence_s, duration_s = exposures
    opens = cadence_s * np.arange(count)
    middle, closes = opens + duration_s / 2.0, opens + duration_s
    observable = np.zeros(count, dtype=bool)
    for row in plan["windows"]:
        low, high = seconds_after(case.noon, [row["start_utc"], row["end_utc"]])
        within = np.flatnonzero((opens >= low) & (closes <= high))
        assert [row["first_frame"], row["last_frame"]] == (
            within[[0, -1]].tolist() if within.size else [-1, -1]
        )
        cut = sum((opens < edge) & (closes > edge) for edge in (low, high)) > 0
        assert row["cut_frames"] == cut.sum()
        observable[(middle > low) & (middle < high)] = row["observable"]
    assert [row["observable"] for row in plan["rows"]] == observable.tolist()


def test_nights_follow_each_other(nightglass, tmp_path):
    """Exposures on three days: rows from the noon before to the noon after."""
    case = CASES["goes 14, eclipsed"]
    path = tmp_path / "scene.toml"
    path.write_text(case.scene(exposures=(3, DAY_S, 5.0)))
    rows = json.loads(nightglass("plan", path, "--json", "-q"))["windows"]
    starts = seconds_after(case.noon, [row["start_utc"] for row in rows])
    assert abs(starts[0]) < 2e-6
    assert abs(seconds_after(case.noon, [rows[-1]["end_utc"]])[0] - 3.0 * DAY_S) < 2e-6
    assert [row["start_utc"] for row in rows[1:]] == [row["end_utc"] for row in rows[:-1]]
    assert sum(row["observable"] for row in rows) == 6


def targets_of(objects):
    return "".join(
        target(tle).replace('"satellite"', json.dumps(name, ensure_ascii=False))
        for name, tle in objects.values()
    )


def test_a_catalogue_has_the_windows_of_targets(nightglass, produce, tmp_path):
    case = replace(CASES["gps"], max_sun_el_deg=5.0)
    objects = catalogue(elements()["MOLNIYA 1-86"], np.arange(0.0, 360.0, 36.0))
    assert len(objects) == 30
    scene_text = case.scene(targets_of(objects))
    table = Table.read(produce("plan", scene_text) / "windows.ecsv", format="ascii.ecsv")
    assert_units(table, {"duration_s": "s", "max_el_deg": "deg"})

    path, sets = tmp_path / "scene.toml", tmp_path / "objects.tle"
    path.write_text(scene_text)
    sets.write_text(three_line_sets(objects))
    plan = json.loads(nightglass("plan", path, "--json", "-q"))
    rows = json.loads(nightglass("plan", path, "--catalog", sets, "--json", "-q"))["rows"]
    numbers = [row.pop("catalog_number") for row in rows]  # names need not be unique
    assert set(numbers) == set(objects)
    assert rows == plan["windows"]
    names = [name for name, _ in objects.values()]
    assert list(dict.fromkeys(row["target"] for row in rows)) == names
    for row, other in zip(table, rows, strict=True):
        told = {name: row[name] for name in table.colnames}
        if not other["observable"]:
            assert np.isnan(told.pop("max_el_deg")) and other["max_el_deg"] is None
            assert np.ma.is_masked(told.pop("max_el_utc")) and other["max_el_utc"] == ""
        assert told == {name: other[name] for name in told}


def chart_texts(directory):
    chart = ET.parse(directory / "night.svg").getroot()
    assert chart.tag == "{http://www.w3.org/2000/svg}svg"
    return " ".join(chart.itertext())


def test_a_chart_names_its_targets(produce):
    """Names that XML must not take for its own."""
    case = CASES["gps"]
    names = ("A & B", "<C>", 'D "E"', "Z\u00e9ta")
    objects = {number: (name, case.tle) for number, name in enumerate(names)}
    told = chart_texts(produce("plan", case.scene(targets_of(objects))))
    assert all(name in told for name in names)


def test_a_chart_tells_how_many_targets_it_leaves_out(produce):
    case = CASES["gps"]
    objects = catalogue(case.tle, [])
    told = chart_texts(produce("plan", case.scene(targets_of(objects))))
    left_out = [name for name, _ in objects.values() if name not in told]
    said = re.search(rf"(?<![\d:]){len(left_out)}(?![\d:])", told)  # no hour of the axis
    assert not left_out or said, f"left out without a word: {left_out}"


def test_windows_end_with_the_ephemeris(nightglass, tmp_path):
    """An ephemeris of three hours in a night in which GOES 14 never sets."""
    case = replace(CASES["goes 14, eclipsed"], start="2018-01-20T05:00:00")
    ephemeris = Ephemeris(case.tle, "2018-01-20T04:00:00", 600.0, 20)
    segment = list(zip(ephemeris.epochs("UTC"), ephemeris.states("GCRF").tolist()))
    path, message = tmp_path / "scene.toml", tmp_path / "goes.oem"
    message.write_text(oem_kvn([segment], "GCRF", "UTC", "LAGRANGE", 9))
    tle = f'tle = ["{case.tle[0]}", "{case.tle[1]}"]'
    path.write_text(case.scene(target(case.tle).replace(tle, f'oem = "{message}"')))
    rows = json.loads(nightglass("plan", path, "--json", "-q"))["windows"]
    assert [row["observable"] for row in rows] == [False, True, False]
    start = Time("2018-01-20T04:10:00", scale="utc", precision=9)  # and the light time
    edges = seconds_after(start, [rows[1]["start_utc"], rows[1]["end_utc"]])
    np.testing.assert_allclose(edges, [0.12, 10200.12], rtol=0.0, atol=EDGE_S)
    assert all("elevation" not in row["why"] for row in rows)
