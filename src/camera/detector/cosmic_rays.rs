//! Cosmic rays: straight tracks of charged particles through the chip's sensitive layer.
//!
//! Muons come with an intensity that falls as cos^2 of the zenith angle (Grieder 2001, Cosmic Rays at Earth, sect. 3.3); the
//! chip is taken to face the zenith, so that directions through it follow cos^3 sin: cos = u^(1/4). A track of length L leaves
//! L (55 + 5 m) electrons per micrometre, m a deviate of Moyal's distribution (Moyal 1955, Phil. Mag. 46, 263; m =
//! -ln z^2 for a normal z) that stands for Landau's: most probable loss 0.2 keV/um, width 18 eV/um, 3.65 eV a pair (Bichsel 1988,
//! Rev. Mod. Phys. 60, 663).

use crate::base::poisson::poisson;
use crate::base::random::{Address, Stage};
use crate::base::sample::{normal_quantile, uniform};
use crate::scene::Detector;
use std::f64::consts::TAU;

/// Thickness of the sensitive layer \[um\].
const LAYER_UM: f64 = 15.0;
/// Most probable charge and width along a track \[e-/um\].
const PROBABLE_E_UM: f64 = 55.0;
const WIDTH_E_UM: f64 = 5.0;
/// Parts of a pixel's side in which a track leaves its charge.
const PARTS: f64 = 8.0;

/// The charge of an exposure's cosmic rays.
#[derive(Debug, Clone, Default)]
pub struct CosmicRays {
    /// Row, column and charge \[e-\], in the order of rows.
    hits: Vec<(usize, usize, f64)>,
}

/// Rays expected on the whole chip.
pub fn expected(detector: &Detector, exposure_s: f64) -> f64 {
    let side_cm = detector.pixel_um * 1e-4;
    let pixels = detector.size_px[0] as f64 * detector.size_px[1] as f64;
    detector.cosmic_rays_per_cm2_s * pixels * side_cm * side_cm * exposure_s
}

impl CosmicRays {
    /// The rays of frame number `frame`.
    pub fn new(detector: &Detector, seed: u64, frame: u32, exposure_s: f64) -> Self {
        let mean = expected(detector, exposure_s);
        if mean <= 0.0 {
            return Self::default();
        }
        let address = Address { seed, frame, stage: Stage::CosmicRays };
        let [width, height] = detector.light_px();
        let pixel_um = detector.pixel_um * detector.binning as f64;
        let number = poisson(&address, 0, mean) as u64;
        let mut hits = Vec::new();
        for ray in 1..=number {
            let [a, b] = address.block(ray, 2).map(uniform);
            let [c, d] = address.block(ray, 3).map(uniform);
            let z = normal_quantile(uniform(address.block(ray, 4)[0]));
            let (x, y) = (a * width as f64, b * height as f64);
            let cos = c.sqrt().sqrt();
            let along = LAYER_UM * (1.0 - cos * cos).sqrt() / cos / pixel_um;
            let (sin, cosine) = (libm::sin(TAU * d), libm::cos(TAU * d));
            let charge = LAYER_UM / cos * (PROBABLE_E_UM - WIDTH_E_UM * libm::log(z * z)).max(0.0);
            // longer than the chip: what is left of it
            let parts = (along * PARTS).min(PARTS * (width + height) as f64).ceil().max(1.0);
            for part in 0..parts as usize {
                let t = (part as f64 + 0.5) / parts * along;
                let (px, py) = (x + t * cosine, y + t * sin);
                if px >= 0.0 && py >= 0.0 && px < width as f64 && py < height as f64 {
                    hits.push((py as usize, px as usize, charge / parts));
                }
            }
        }
        hits.sort_by_key(|hit| (hit.0, hit.1));
        hits.dedup_by(|next, kept| {
            let same = (next.0, next.1) == (kept.0, kept.1);
            if same {
                kept.2 += next.2;
            }
            same
        });
        hits.iter_mut().for_each(|hit| hit.2 = (hit.2 + 0.5).floor());
        Self { hits }
    }

    /// Add the charge \[e-\] of row `y` to its pixels from column `x0` on.
    pub fn add(&self, row: &mut [f64], y: usize, x0: usize) {
        let from = self.hits.partition_point(|hit| (hit.0, hit.1) < (y, x0));
        let end = x0 + row.len();
        for (_, x, charge) in self.hits[from..].iter().take_while(|hit| hit.0 == y && hit.1 < end) {
            row[x - x0] += charge;
        }
    }

    /// Pixels hit.
    pub fn pixels(&self) -> usize {
        self.hits.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load};

    /// Five rays per cm^2 and minute: number, charge and lengths.
    #[test]
    fn rays_come_at_their_rate_with_the_charge_of_muons() {
        let sets = [("detector.cosmic_rays_per_cm2_s".to_owned(), "0.05".to_owned())];
        let detector = load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene").detector;
        let mean = expected(&detector, 300.0);
        // 3.6864 cm a side
        assert!((mean - 0.05 * 3.6864f64.powi(2) * 300.0).abs() < 1e-9);
        let frames = (0..20).map(|frame| CosmicRays::new(&detector, 1, frame, 300.0)).collect::<Vec<_>>();
        let charge = frames.iter().flat_map(|f| &f.hits).map(|hit| hit.2).sum::<f64>() / (20.0 * mean);
        // E(1/cos) = 4/3, E(-ln z^2) = 1.2704
        let expected = LAYER_UM * 4.0 / 3.0 * (PROBABLE_E_UM + WIDTH_E_UM * 1.2704);
        assert!((charge / expected - 1.0).abs() < 0.06, "{charge} e- a ray, expected {expected}");
        let again = CosmicRays::new(&detector, 1, 3, 300.0);
        assert_eq!(again.hits, frames[3].hits);
        let (y, x, e) = again.hits[again.hits.len() / 2];
        let mut row = vec![0.0; 3];
        again.add(&mut row, y, x.saturating_sub(1));
        assert_eq!(row[x.min(1)], e);
    }
}
