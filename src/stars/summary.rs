//! What a catalogue holds, in numbers.

use super::catalogue::Catalogue;
use super::cells::{BANDS, Bounds, cells_before};
use super::completeness::NOWHERE;
use crate::astro::direction;

/// Galactic latitudes that part the sky \[deg\].
pub const LATITUDES: [f64; 4] = [0.0, 20.0, 45.0, 90.0];

/// Stars of one magnitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Its bright edge; the faint one is 1 mag fainter.
    pub from_mag_v: i32,
    /// Stars of the whole sky.
    pub stars: usize,
    /// Per square degree of the whole sky.
    pub per_deg2: f64,
    /// Per square degree between the [`LATITUDES`], by the middles of cells.
    pub per_deg2_b: [f64; 3],
}

/// What a catalogue holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Stars by magnitude, from bright to faint.
    pub bins: Vec<Bin>,
    /// Least, median and greatest completeness over cells that were looked at \[mag\]; none: there are none.
    pub complete_to: Option<[f64; 3]>,
    /// Share of the sky that was looked at.
    pub covered: f64,
}

/// Count a catalogue's stars.
pub fn summary(catalogue: &Catalogue) -> Summary {
    let mut counts = std::collections::BTreeMap::<i32, [usize; 3]>::new();
    let mut areas = [0.0; 3];
    let (mut limits, mut covered, mut sky) = (Vec::new(), 0.0, 0.0);
    for cell in 0..cells_before(BANDS) {
        let [ra, dec] = Bounds::of(cell).place(0.5, 0.5);
        let (ra, dec) = crate::astro::angles(direction(ra, dec));
        let latitude = sofars::coords::icrs2g(ra, dec).1.to_degrees().abs();
        let zone = usize::from(latitude >= LATITUDES[1]) + usize::from(latitude >= LATITUDES[2]);
        let area = Bounds::of(cell).solid_angle().to_degrees().to_degrees();
        areas[zone] += area;
        sky += area;
        if catalogue.cell_complete_to(cell) > NOWHERE {
            covered += area;
            limits.push(catalogue.cell_complete_to(cell));
        }
        for mag in catalogue.cell_mags(cell) {
            counts.entry(mag.floor() as i32).or_default()[zone] += 1;
        }
    }
    limits.sort_by(f64::total_cmp);
    let bin = |(from_mag_v, counts): (&i32, &[usize; 3])| {
        let stars = counts.iter().sum::<usize>();
        let per_deg2_b = std::array::from_fn(|zone| counts[zone] as f64 / areas[zone]);
        Bin { from_mag_v: *from_mag_v, stars, per_deg2: stars as f64 / sky, per_deg2_b }
    };
    Summary {
        bins: counts.iter().map(bin).collect(),
        complete_to: (!limits.is_empty()).then(|| [limits[0], limits[limits.len() / 2], limits[limits.len() - 1]]),
        covered: covered / sky,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stars::encode::{StarRecord, encode};
    use std::borrow::Cow;

    /// One star of V = 5.2 at each of 400 places all over the sky, and one of 7.9 at the galactic pole.
    #[test]
    fn stars_are_counted_by_magnitude_and_latitude() {
        let star = |ra: f64, dec: f64, mag_v: f64| {
            let [ra, dec] = [ra, dec].map(f64::to_radians);
            StarRecord { ra, dec, mag_v, colour_bv: None, motion_mas_yr: None }
        };
        let mut stars = (0..400).map(|i| {
            let (u, v) = ((f64::from(i) * 0.618_034).fract(), (f64::from(i) + 0.5) / 200.0 - 1.0);
            star(360.0 * u, v.asin().to_degrees(), 5.2)
        });
        let mut stars = stars.by_ref().collect::<Vec<_>>();
        stars.push(star(192.859, 27.128, 7.9));
        let complete = |cell: usize| if cell < 20_672 { 8.0 } else { NOWHERE };
        let bytes = encode("test", 2000.0, &stars, complete);
        let found = summary(&Catalogue::from_bytes(Cow::Owned(bytes), "test").expect("whole"));
        assert_eq!(found.bins.iter().map(|b| (b.from_mag_v, b.stars)).collect::<Vec<_>>(), [(5, 400), (7, 1)]);
        let even = 400.0 / 41_252.96;
        assert!(found.bins[0].per_deg2_b.iter().all(|n| (n / even - 1.0).abs() < 0.1), "{:?}", found.bins[0]);
        assert!(found.bins[1].per_deg2_b[..2] == [0.0, 0.0] && found.bins[1].per_deg2_b[2] > 0.0);
        assert_eq!(found.complete_to, Some([8.0; 3]));
        assert!((found.covered - 0.5).abs() < 1e-3, "{}", found.covered);
    }
}
