"""Light of shapes against renderers that share nothing with ours: boxes by rays to slabs, a sphere by its formula."""

import numpy as np
import pytest
from astropy.coordinates import get_sun
from astropy.io import ascii as table_reader
from astropy.time import Time

SCENE = """
[station]
preset = "pogs"
[exposures]
start = 2018-01-20T03:00:00Z
count = {count}
cadence_s = {cadence}
duration_s = 0.0
[[target]]
name = "T"
{shape}
[target.orbit]
tle = ["1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991",
       "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371"]
{more}
"""

# centre and half size of the boxes of the built-in box-wing [m], with their albedos
BOXES = [
    ((0.0, 0.0, 0.0), (0.8, 0.8, 1.0), 0.5),
    ((0.0, 3.6, 0.0), (0.015, 2.5, 0.8), 0.2),
    ((0.0, -3.6, 0.0), (0.015, 2.5, 0.8), 0.2),
]
MATERIALS = """
[target.material.group.bus]
diffuse = 0.5
[target.material.group.panel]
diffuse = 0.2
"""
SUN_W_M2, V_SUN = 1361.0, -26.76


@pytest.fixture(scope="module")
def curve(nightglass, tmp_path_factory):
    """Call as curve(shape, more, count, cadence): the rows of the light curve."""

    def call(shape, more="", count=40, cadence=1100.0):
        scene = tmp_path_factory.mktemp("object") / "scene.toml"
        scene.write_text(SCENE.format(shape=shape, more=more, count=count, cadence=cadence))
        return table_reader.read(nightglass("lightcurve", scene), format="ecsv")

    return call


def directions(rows):
    def unit(name):
        return np.stack([rows[f"{name}_{axis}"] for axis in "xyz"], axis=1)

    return unit("sun"), unit("obs")


def turned(vectors, times, period_s):
    """Vectors in the axes of a body that turns about the ICRS z axis."""
    angle = 2 * np.pi * np.asarray(times) / period_s
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors.T
    return np.stack([c * x + s * y, c * y - s * x, z], axis=1)


def blocked(points, direction):
    """Whether a ray from each point along a direction enters a box ahead (slab method)."""
    out = np.zeros(len(points), bool)
    for centre, half, _ in BOXES:
        with np.errstate(divide="ignore", invalid="ignore"):
            first = (np.array(centre) - np.array(half) - points) / direction
            last = (np.array(centre) + np.array(half) - points) / direction
        near = np.minimum(first, last).max(axis=1)
        far = np.maximum(first, last).min(axis=1)
        out |= (far > np.maximum(near, 0.0) + 1e-9) & (far > 1e-9)
    return out


def box_wing(sun, observer, n=240):
    """Normalised irradiance [m2/sr] by n x n points on each side of each box."""
    u, v = np.meshgrid((np.arange(n) + 0.5) / n * 2 - 1, (np.arange(n) + 0.5) / n * 2 - 1)
    total = 0.0
    for centre, half, albedo in BOXES:
        for axis in range(3):
            for side in (-1.0, 1.0):
                cs, co = side * sun[axis], side * observer[axis]
                if cs <= 0 or co <= 0:
                    continue
                b, c = (axis + 1) % 3, (axis + 2) % 3
                points = np.empty((n * n, 3))
                points[:, axis] = centre[axis] + side * half[axis]
                points[:, b] = centre[b] + half[b] * u.ravel()
                points[:, c] = centre[c] + half[c] * v.ravel()
                points[:, axis] += side * 1e-7
                free = ~(blocked(points, sun) | blocked(points, observer))
                total += albedo / np.pi * cs * co * 4 * half[b] * half[c] * free.mean()
    return total


def sun_distance_au(rows):
    times = Time(list(rows["time_utc"]), scale="utc")
    return get_sun(times).distance.au


def test_a_box_wing_with_shadows_is_that_of_rays_to_slabs(curve):
    """0.2 % of the brightest: the grid of 240 points a side errs by that at shadow edges."""
    spin = '[target.attitude]\nmode = "spin"\nperiod_s = 9700.0\naxis = [0.0, 0.0, 1.0]'
    rows = curve('shape = "box-wing"', MATERIALS + spin)
    seconds = np.arange(len(rows)) * 1100.0
    sun, observer = (turned(v, seconds, 9700.0) for v in directions(rows))
    expected = np.array([box_wing(s, o) for s, o in zip(sun, observer)])
    # the satellite is at most 42,000 km, 2.8e-4 au, nearer to the Sun than the Earth or farther
    found = rows["radiant_intensity_w_sr"] / SUN_W_M2 * sun_distance_au(rows) ** 2
    assert np.ptp(expected) > 0.5 * expected.max()
    assert np.abs(found - expected).max() < 2e-3 * expected.max()


def test_a_lambert_sphere_has_the_magnitude_of_its_formula(curve):
    rows = curve('shape = "sphere"\nshape_size_m = [2.0, 2.0, 2.0]', "[target.material]\ndiffuse = 0.7\n")
    phase = np.radians(rows["phase_deg"])
    y = 2 / 3 * 0.7 * (np.sin(phase) + (np.pi - phase) * np.cos(phase)) / np.pi
    range_m = rows["range_km"] * 1e3
    expected = V_SUN - 2.5 * np.log10(y / range_m**2) + 5 * np.log10(sun_distance_au(rows))
    # the satellite's distance from the Sun differs from the Earth's by up to 2.8e-4 au, 6e-4 mag
    assert np.abs(rows["mag_v"] - expected).max() < 1e-3
    assert np.allclose(
        rows["mag_v"], rows["zeropoint_mag"] - 2.5 * np.log10(rows["flux_e"]), atol=1e-9
    )
    irradiance = 1361 * 10 ** (-0.4 * (rows["mag_v"] - V_SUN))
    assert np.allclose(rows["irradiance_w_m2"], irradiance, rtol=1e-9)
    assert np.allclose(rows["radiant_intensity_w_sr"], irradiance * range_m**2, rtol=1e-9)


def test_an_eclipsed_shape_is_exactly_dark(nightglass, tmp_path):
    """A geostationary orbit at the equinox: 67 to 70 minutes in the shadow, the penumbra's 2 minutes beside."""
    text = SCENE.format(shape='shape = "box"', more="", count=1440, cadence=60.0)
    start = text.index("tle = ")
    end = text.index("\n", text.index("31371"))
    kepler = (
        "kepler = { epoch = 2018-03-20T00:00:00Z, a_km = 42164.0, e = 0.0, i_deg = 0.0, "
        "raan_deg = 0.0, argp_deg = 0.0, mean_anomaly_deg = 50.0 }"
    )
    text = text[:start] + kepler + text[end:]
    scene = tmp_path / "scene.toml"
    scene.write_text(text.replace("2018-01-20T03", "2018-03-20T00"))
    rows = table_reader.read(nightglass("lightcurve", scene), format="ecsv")
    dark = np.asarray(rows["radiant_intensity_w_sr"]) == 0.0
    assert 66 <= dark.sum() <= 71
    assert np.isnan(rows["mag_v"][dark]).all() and (rows["flux_e"][dark] == 0).all()


def test_magnitudes_go_with_the_square_of_the_size(curve):
    one = curve('shape = "box-wing"', MATERIALS, count=10)
    half = curve('shape = "box-wing"\nshape_scale = 0.5', MATERIALS, count=10)
    assert np.allclose(half["mag_v"] - one["mag_v"], 5 * np.log10(2.0), atol=1e-9)
