//! Scintillation: the twinkling that an exposure has not averaged out.
//!
//! Standard deviation of the relative intensity: 0.09 D^(-2/3) X^1.75 exp(-h / 8000 m) / (2 t)^(1/2) with the aperture D
//! in cm and the exposure t in s (Young 1967, AJ 72, 747; Osborn et al. 2015, MNRAS 452, 1707, find medians 1.5
//! times larger at good sites: `station.scintillation_factor`). Log-normal with mean 1, one factor for each (seed, frame, object).

use crate::base::random::{Address, Stage};
use crate::base::sample::normal;
use crate::scene::Scene;

/// Relative standard deviation at `airmass`; 0 if switched off or instantaneous.
pub fn sigma(scene: &Scene, exposure_s: f64, airmass: f64) -> f64 {
    if !scene.station.scintillation || exposure_s <= 0.0 {
        return 0.0;
    }
    let diameter_cm = scene.telescope.aperture_m * 100.0;
    let height = libm::exp(-scene.station.height_m / 8000.0);
    let young =
        0.09 * libm::pow(diameter_cm, -2.0 / 3.0) * libm::pow(airmass, 1.75) * height / (2.0 * exposure_s).sqrt();
    scene.station.scintillation_factor * young
}

/// The factor of one object in one frame.
pub fn factor(seed: u64, frame: usize, object: u64, sigma: f64) -> f64 {
    if sigma <= 0.0 {
        return 1.0;
    }
    let address = Address { seed, frame: frame as u32, stage: Stage::Scintillation };
    // the logarithm's variance that gives the intensity this relative variance
    let log_variance = libm::log1p(sigma * sigma);
    libm::exp(log_variance.sqrt() * normal(&address, object) - 0.5 * log_variance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load};

    #[test]
    fn the_factor_has_mean_one_and_the_stated_width() {
        let n = 100_000u64;
        let factors = (0..n).map(|object| factor(5, 0, object, 0.1)).collect::<Vec<_>>();
        let mean = factors.iter().sum::<f64>() / n as f64;
        let variance = factors.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / n as f64;
        // 4.5 standard errors
        assert!((mean - 1.0).abs() < 4.5 * 0.1 / (n as f64).sqrt(), "{mean}");
        assert!((variance.sqrt() - 0.1).abs() < 4.5 * 0.1 / (2.0 * n as f64).sqrt() * 1.1, "{variance}");
        assert_eq!(factor(5, 0, 1, 0.0), 1.0);
    }

    /// Young's formula worked by hand: 35.56 cm, 2225 m, 1 s, at the zenith 0.446 %, at 1.3 airmasses 0.71 %; times the site's factor.
    #[test]
    fn the_width_is_youngs_times_the_sites() {
        let of = |sets: &[(&str, &str)], airmass: f64| {
            let sets = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect::<Vec<_>>();
            let scene = load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene");
            sigma(&scene, 1.0, airmass)
        };
        assert!((of(&[], 1.0) - 0.004_457).abs() < 2e-5, "{}", of(&[], 1.0));
        assert!((of(&[], 1.3) - 0.007_054).abs() < 3e-5, "{}", of(&[], 1.3));
        let site = of(&[("station.scintillation_factor", "1.5")], 1.0);
        assert!((site / of(&[], 1.0) - 1.5).abs() < 1e-12);
        assert_eq!(of(&[("station.scintillation", "false")], 1.0), 0.0);
    }
}
