"""Shapes from light curves that rays of an independent script made, through the command."""

import json

import numpy as np
import pytest
from astropy.coordinates import get_sun
from astropy.time import Time

import reference_rays as rays

MJD = 58137.0
# a box 1:2:3 alone, and the L of the reference
BODIES = {
    "box": [(np.zeros(3), np.array([0.5, 1.0, 1.5]))],
    "L": rays.BOXES,
}


def curve(body, count, seed):
    """A light curve of albedo 1 in random directions at phases of 50 and 90 deg, as CSV; from 1 m away at the Sun's zero point."""
    rng = np.random.default_rng(seed)
    sun_au = get_sun(Time(MJD, format="mjd")).distance.au
    rows = []
    for phase in np.repeat(np.radians([50.0, 90.0]), count // 2):
        sun, across = rng.normal(size=3), rng.normal(size=3)
        sun /= np.linalg.norm(sun)
        across = np.cross(sun, across)
        across /= np.linalg.norm(across)
        observer = np.cos(phase) * sun + np.sin(phase) * across
        rows.append((*sun, *observer, rays.flux(sun, observer, BODIES[body]) / rays.RHO))
    rows = np.array(rows)
    error = 2e-3 * rows[:, 6].mean()
    lines = ["mjd_utc,flux_e,flux_err_e,zeropoint_mag,range_km,sun_x,sun_y,sun_z,obs_x,obs_y,obs_z"]
    for k, row in enumerate(rows):
        flux, error_au = row[6] / sun_au**2, error / sun_au**2
        vectors = ",".join(f"{v:.15f}" for v in row[:6])
        lines.append(f"{MJD + 1e-6 * k:.9f},{flux:.12f},{error_au:.12f},-26.76,0.001,{vectors}")
    return "\n".join(lines) + "\n"


def mesh(body):
    """The boxes as OBJ."""
    lines = []
    for number, (centre, half) in enumerate(BODIES[body]):
        for k in range(8):
            signs = np.array([1 if k >> axis & 1 else -1 for axis in range(3)])
            lines.append("v " + " ".join(map(str, rays.AXES @ (centre + signs * half))))
        first = 8 * number + 1
        for quad in [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]:
            lines.append("f " + " ".join(str(first + corner) for corner in quad))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    "body, convex, parts, least", [("box", True, 1, 0.995), ("L", False, 2, 0.95)]
)
def test_bodies_come_back_from_their_rays(nightglass, tmp_path, body, convex, parts, least):
    """Errors of 0.2 % cover the grid of the rays. The box is convex and said to be; the L is found out and has two parts."""
    (tmp_path / "rays.csv").write_text(curve(body, 160, 20))
    (tmp_path / "true.obj").write_text(mesh(body))
    out = tmp_path / "shape"
    nightglass("invert", tmp_path / "rays.csv", "--truth", tmp_path / "true.obj", "-o", out, "-q")
    shape = json.loads((out / "shape.json").read_text())
    print(f"{body} by rays: IoU {shape['errors']['iou']:.4f}")
    assert shape["convex"] == convex and shape["n_parts"] == parts
    assert shape["errors"]["iou"] > least
