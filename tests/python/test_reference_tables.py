"""The tables in tests/reference hold what their generators give."""

import math

import numpy as np
import pytest
from astropy.time import Time
from reference_motion import vallado_elements
from reference_tables import DIRECTORY, TABLES, comment, text

RELATIVE = 1e-9
TINY = 1e-13
ABSOLUTE = {  # other than TINY: differences that lose digits
    "ra_rate_arcsec_s": 1e-4,
    "dec_rate_arcsec_s": 1e-4,
    "range_rate_km_s": 1e-9,
}
CONTACT_S = 1e-4

pytestmark = pytest.mark.filterwarnings("ignore:ERFA function.*dubious year")


def numbers(cells):
    """A column as floats, None if it holds text."""
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return None


def split(table):
    """(comment lines, header, columns of texts)."""
    lines = table.splitlines()
    comments = [line for line in lines if line.startswith("#")]
    header, *rows = (line.split(",") for line in lines[len(comments) :])
    assert {len(row) for row in rows} == {len(header)}
    return comments, header, dict(zip(header, zip(*rows)))


def committed(name):
    return split((DIRECTORY / f"{name}.csv").read_text())


@pytest.mark.parametrize("name", TABLES)
def test_table_is_reproduced(name):
    comments, header, columns = committed(name)
    _, header_now, columns_now = split(text(name))
    assert comments == comment(name)
    assert header == header_now
    for column in header:
        old, new = columns[column], columns_now[column]
        assert len(old) == len(new), column
        if name == "eclipses" and column == "utc":
            apart = (Time(list(old), scale="utc") - Time(list(new), scale="utc")).to_value("s")
            assert np.abs(apart).max() < CONTACT_S
        elif numbers(old) is None:
            assert old == new, column
        else:
            np.testing.assert_allclose(
                numbers(new),
                numbers(old),
                rtol=RELATIVE if name != "tumble" else TINY,
                atol=ABSOLUTE.get(column, TINY),
                err_msg=column,
            )


def test_verification_elements_are_reproduced():
    assert (DIRECTORY / "sgp4_vallado.tle").read_text() == vallado_elements()


def test_tumbling_conserves_energy_and_momentum():
    """The momentum turned to inertial axes stays, and so do the energy and the unit norm."""
    _, _, columns = committed("tumble")
    values = {name: numbers(cells) for name, cells in columns.items()}

    def stack(*names):
        return np.stack([values[name] for name in names], axis=-1)

    moments = stack("i1", "i2", "i3")
    before, after = stack("w1", "w2", "w3"), stack("w1_t", "w2_t", "w3_t")
    scalar, vector = stack("q0"), stack("q1", "q2", "q3")
    momentum = moments * after
    crossed = 2.0 * np.cross(vector, momentum)
    inertial = momentum + scalar * crossed + np.cross(vector, crossed)
    size = np.linalg.norm(moments * before, axis=-1, keepdims=True)

    assert np.abs(scalar[:, 0] ** 2 + np.sum(vector**2, axis=-1) - 1.0).max() < TINY
    assert np.abs((inertial - moments * before) / size).max() < TINY
    energy = np.sum(moments * before**2, axis=-1)
    assert np.abs(np.sum(moments * after**2, axis=-1) / energy - 1.0).max() < TINY


def test_orientation_runs_on_over_leap_seconds():
    """UT1-TAI changes by less than 3 ms a day over the end of 2016, rows half a day apart."""
    _, _, columns = committed("orientation")
    ut1_minus_tai = dict(zip(columns["utc"], numbers(columns["ut1_minus_tai_s"])))
    values = [value for utc, value in ut1_minus_tai.items() if utc[:7] in ("2016-12", "2017-01")]
    assert len(values) == 4
    assert all(math.isclose(a, b, abs_tol=0.0015) for a, b in zip(values, values[1:]))
