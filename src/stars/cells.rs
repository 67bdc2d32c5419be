//! Cells of the sky: bands of one degree of declination, cut into equal cells of about one degree.

use crate::astro::angles;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Number of declination bands.
pub const BANDS: usize = 180;

/// The band of a declination \[rad\].
pub fn band_of(dec: f64) -> usize {
    ((dec / PI + 0.5) * BANDS as f64).floor().clamp(0.0, BANDS as f64 - 1.0) as usize
}

/// Cells of a band: about one degree wide at its middle.
pub fn cells_in(band: usize) -> usize {
    let middle = ((band as f64 + 0.5) / BANDS as f64 - 0.5) * PI;
    (360.0 * middle.cos()).ceil().max(1.0) as usize
}

/// Cells in the bands before `band`.
pub fn cells_before(band: usize) -> usize {
    (0..band).map(cells_in).sum()
}

/// The cell of a place.
pub fn cell_of(ra: f64, dec: f64) -> usize {
    let band = band_of(dec);
    let count = cells_in(band);
    let within = (ra.rem_euclid(TAU) / TAU * count as f64) as usize;
    cells_before(band) + within.min(count - 1)
}

/// The part of the sky that a cell covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Right ascension, from and to \[rad\].
    pub ra: [f64; 2],
    /// Declination, from and to \[rad\].
    pub dec: [f64; 2],
}

impl Bounds {
    /// Of a cell; the last one's for a number beyond it.
    pub fn of(cell: usize) -> Self {
        let mut first = 0;
        let mut band = 0;
        while band + 1 < BANDS && first + cells_in(band) <= cell {
            first += cells_in(band);
            band += 1;
        }
        let count = cells_in(band);
        let within = (cell - first).min(count - 1) as f64;
        let ra = [within, within + 1.0].map(|k| k / count as f64 * TAU);
        let dec = [band, band + 1].map(|b| (b as f64 / BANDS as f64 - 0.5) * PI);
        Self { ra, dec }
    }

    /// Solid angle \[sr\].
    pub fn solid_angle(&self) -> f64 {
        (self.ra[1] - self.ra[0]) * (self.dec[1].sin() - self.dec[0].sin())
    }

    /// The place at shares `u` of its width and `v` of its area from south to north.
    pub fn place(&self, u: f64, v: f64) -> [f64; 2] {
        let [low, high] = self.dec.map(f64::sin);
        let ra = self.ra[0] + u * (self.ra[1] - self.ra[0]);
        [ra, (low + v * (high - low)).clamp(-1.0, 1.0).asin()]
    }
}

/// The cells that a cone of half-angle `radius` \[rad\] about `centre` can touch.
pub fn cells_near(centre: DVec3, radius: f64) -> impl Iterator<Item = usize> {
    let (ra, dec) = angles(centre);
    let (low, high) = (dec - radius, dec + radius);
    // half-width in right ascension of a cone that holds no pole (Meeus 1998, ch. 17)
    let half = if low <= -PI / 2.0 || high >= PI / 2.0 {
        PI
    } else {
        (radius.sin() / dec.cos()).clamp(-1.0, 1.0).asin().abs()
    };
    (band_of(low)..=band_of(high)).flat_map(move |band| {
        let (first, count) = (cells_before(band), cells_in(band));
        let width = TAU / count as f64;
        let start = ((ra - half) / width).floor() as i64;
        let stop = ((ra + half) / width).floor() as i64;
        let number = ((stop - start + 1) as usize).min(count);
        (0..number).map(move |k| first + (start + k as i64).rem_euclid(count as i64) as usize)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_cover_the_sphere_once() {
        let total = cells_before(BANDS);
        let area: f64 = (0..total).map(|cell| Bounds::of(cell).solid_angle()).sum();
        assert!((area / (4.0 * PI) - 1.0).abs() < 1e-12, "{area}");
        for cell in [0, 3, 4, 1000, 20_672, total - 1] {
            for (u, v) in [(0.01, 0.01), (0.5, 0.5), (0.99, 0.99)] {
                let [ra, dec] = Bounds::of(cell).place(u, v);
                assert_eq!(cell_of(ra, dec), cell);
            }
        }
    }

    #[test]
    fn a_place_lies_within_the_bounds_of_its_cell() {
        let mut state = 1u64;
        let mut share = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..2000 {
            let (ra, dec) = (TAU * share(), (2.0 * share() - 1.0).asin());
            let Bounds { ra: [west, east], dec: [south, north] } = Bounds::of(cell_of(ra, dec));
            assert!((west..=east).contains(&ra) && (south..=north).contains(&dec), "{ra} {dec}");
        }
        let area: f64 = (0..cells_before(BANDS)).map(|cell| Bounds::of(cell).solid_angle()).sum();
        assert!((area - 4.0 * PI).abs() < 1e-10);
    }
}
