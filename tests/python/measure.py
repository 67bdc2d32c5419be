"""Measuring stars on a frame with sep: which stars, where, how bright."""

import numpy as np
import sep
from scipy.spatial import cKDTree

RING = (2.0, 3.0)  # background ring, in radii of the aperture


def subtracted(adu):
    """Frame less its background, and the background's rms [adu]."""
    data = np.ascontiguousarray(adu, dtype=np.float64)
    background = sep.Background(data, bw=64, bh=64)
    return data - background.back(), float(background.globalrms)


def isolated(x, y, electrons, radius_px, share=0.003):
    """Stars with nothing brighter than `share` of themselves within the radius."""
    points = np.column_stack([x, y])
    neighbours = cKDTree(points).query_ball_point(points, radius_px)
    return np.array(
        [
            sum(electrons[j] for j in near if j != i) < share * electrons[i]
            for i, near in enumerate(neighbours)
        ]
    )


def inside(x, y, shape, margin_px):
    """Places at least so far from every edge."""
    height, width = shape
    return (
        (x > margin_px)
        & (y > margin_px)
        & (x < width - 1 - margin_px)
        & (y < height - 1 - margin_px)
    )


def centroids(image, x, y, fwhm_px):
    """Windowed centroids (SExtractor's XWIN, YWIN), 0-based; started at the nearest pixel."""
    return sep.winpos(image, np.rint(x), np.rint(y), fwhm_px / 2.3548)[:2]


def aperture(image, x, y, radius_px, noise_adu, gain):
    """Flux above the local background [adu] and its one-sigma error."""
    ring = (RING[0] * radius_px, RING[1] * radius_px)
    flux, error, _ = sep.sum_circle(image, x, y, radius_px, err=noise_adu, gain=gain, bkgann=ring)
    area, ring_area = np.pi * radius_px**2, np.pi * (ring[1] ** 2 - ring[0] ** 2)
    return flux, np.sqrt(error**2 + (noise_adu * area) ** 2 / ring_area)


def moffat_share(radius_px, fwhm_px, beta):
    """Share of a Moffat star's light that aperture() returns, its own light in the ring off."""
    alpha = fwhm_px / (2 * np.sqrt(2 ** (1 / beta) - 1))

    def within(r):
        return 1 - (1 + (r / alpha) ** 2) ** (1 - beta)

    in_ring = within(RING[1] * radius_px) - within(RING[0] * radius_px)
    return within(radius_px) - in_ring / (RING[1] ** 2 - RING[0] ** 2)
