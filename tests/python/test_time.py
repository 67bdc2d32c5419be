"""`nightglass time` against astropy: ISO 8601, JD and MJD in and out, six scales."""

import json
from fractions import Fraction

import astropy.units as u
import numpy as np
import places_reference  # noqa: F401  astropy's Earth orientation: the IERS table at hand
import pytest
from astropy.time import Time, TimeDelta

SCALES = ("UTC", "UT1", "TAI", "TT", "TDB", "GPS")
LIMITS_NS = {"UTC": 1, "TAI": 1, "TT": 1, "GPS": 1, "UT1": 1000, "TDB": 10000}
GPS_MINUS_TAI = TimeDelta(-19.0, format="sec")
JD_OF_MJD = Fraction("2400000.5")
DAY_NS = 86400 * 10**9
EPOCHS = {
    # UTC: whether astropy knows UT1 from the table of the IERS
    "1965-07-01T12:00:00": False,  # UTC seconds were longer than those of TAI
    "1972-06-30T23:59:60.25": False,  # the first leap second
    "1980-01-06T00:00:00": True,  # GPS time begins
    "1998-12-31T23:59:60.999999999": False,  # to astropy's table it is the next day already
    "1998-12-31T23:59:60.75": True,
    "2008-12-31T23:59:59.999999999": True,  # the second before a leap second
    "2012-07-01T00:00:00": True,  # the second after one
    "2016-12-31T12:00:00.000000001": True,  # half of a day of 86401 s
    "2016-12-31T23:59:60.5": True,
    "2018-01-20T03:00:00.123456789": True,
    "2026-11-20T18:30:15.5": True,
    "2030-06-01T21:10:47.25": False,
}
NONSENSE = (
    "",
    "yesterday",
    "2018-13-01T00:00:00",
    "2018-02-29T00:00:00",
    "2018-01-20T24:00:01",
    "2018-01-20T03:60:00",
    "2018-01-20T03:00:60",  # no leap second
    "2017-12-31T23:59:60",
    "2016-12-31T23:59:61",
    "2016-12-31T23:59:60 TAI",
    "2018-01-20T03:00:00Z TAI",
    "2018-01-20T03:00:00 XYZ",
    "JD",
    "JD nan",
    "JD 1e300",
    "MJD 58138,5",
    "MJD 58138.0.0",
    "UTC",
)

pytestmark = pytest.mark.filterwarnings("ignore:ERFA function.*dubious year")


def in_scale(t, scale):
    """The reading of a clock: a Time of that scale; GPS as TAI of 19 s before."""
    return t.tai + GPS_MINUS_TAI if scale == "GPS" else getattr(t, scale.lower())


def exact_jd(t):
    return Fraction(float(t.jd1)) + Fraction(float(t.jd2))


def decimal(days):
    """An exact number of days, positive, with 15 decimals."""
    scaled = round(days * 10**15)
    return f"{scaled // 10**15}.{scaled % 10**15:015d}"


def difference_ns(t, other):
    """Of two instants."""
    return float(np.abs((t.tai - other.tai).to_value(u.ns)))


def read_iso(text, scale):
    """A reading as an instant."""
    if scale == "GPS":
        return Time(text, scale="tai") - GPS_MINUS_TAI
    return Time(text, scale=scale.lower())


@pytest.fixture(scope="module")
def rows(nightglass):
    """Call as rows(epoch text): rows of the JSON by scale."""

    def call(text):
        found = json.loads(nightglass("time", text, "--json"))
        assert found["command"] == "time"
        return {row["scale"]: row for row in found["rows"]}

    return call


def scales_of(utc):
    return [scale for scale in SCALES if scale != "UT1" or EPOCHS[utc]]


@pytest.mark.parametrize("utc", EPOCHS)
def test_every_scale(rows, utc):
    t = Time(utc, scale="utc", precision=9)
    found = rows(f"{utc}Z")
    off = {}
    for scale in scales_of(utc):
        row, expected = found[scale], in_scale(t, scale)
        jd = Fraction(row["jd"])
        off[scale] = float(abs(jd - exact_jd(expected)) * DAY_NS)
        assert off[scale] <= LIMITS_NS[scale], row
        assert Fraction(row["mjd"]) == jd - JD_OF_MJD, row
        assert difference_ns(read_iso(row["iso"], scale), t) <= LIMITS_NS[scale] + 0.01, row
        if scale != "UTC":
            minus_tai_s = float((exact_jd(expected) - exact_jd(t.tai)) * 86400)
            assert abs(row["minus_tai_s"] - minus_tai_s) * 1e9 <= LIMITS_NS[scale] + 0.1, row
    print(f"time {utc}: " + ", ".join(f"{scale} {ns:.1f} ns" for scale, ns in off.items()))


@pytest.mark.parametrize("utc", EPOCHS)
def test_every_form_of_input_in_every_scale_is_the_same_instant(rows, utc):
    t = Time(utc, scale="utc", precision=9)
    for scale in scales_of(utc):
        clock = in_scale(t, scale)
        jd = exact_jd(clock)
        for text, rounding_ns in (
            (f"{clock.isot} {scale}", 0.51),
            (f"JD {decimal(jd)} {scale}", 1.0),
            (f"MJD {decimal(jd - JD_OF_MJD)} {scale}", 1.0),
        ):
            off = difference_ns(Time(rows(text)["TAI"]["iso"], scale="tai"), t)
            assert off <= LIMITS_NS[scale] + rounding_ns, (text, off)


@pytest.mark.parametrize("text", ["MJD -1", "MJD -54741.25 TT", "1858-11-17T00:00:00"])
def test_modified_julian_dates_below_zero(rows, text):
    for row in rows(text).values():
        assert Fraction(row["mjd"]) == Fraction(row["jd"]) - JD_OF_MJD, row


@pytest.mark.parametrize("text", NONSENSE)
def test_nonsense_is_refused_by_name(refused, text):
    assert f'"{text}"' in refused("time", text, "--json")
