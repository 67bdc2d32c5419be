//! The best exposure of a target: the shortest that reaches an SNR, and the one of most SNR in an hour.
//!
//! Light, sky and dark charge grow with the exposure, and so do the trails of a target that is not followed; read noise does not.
//! N frames of SNR s have the SNR s N^(1/2) together. No exposure is longer than fills the brightest pixel.

use super::ccd::{Estimator, Pixels};
use super::stage::{Exposed, Staged};
use crate::camera::path::Path;
use crate::camera::psf::Psf;

/// Shortest and longest exposure looked at \[s\].
const RANGE_S: [f64; 2] = [1e-3, 1e5];
/// Trails longer than this \[FWHM\] are not drawn: the SNR of a longer one grows with the root of its length.
const LONGEST: f64 = 40.0;
/// Exposures tried for the most SNR in an hour.
const TRIED: usize = 24;
/// Relative error of an exposure sought.
const RELATIVE: f64 = 1e-3;
/// Seconds of an hour.
const HOUR_S: f64 = 3600.0;

/// Best exposures \[s\]; NaN where none is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Best {
    /// The shortest that reaches the SNR wanted.
    pub wanted_s: f64,
    /// That of most SNR in an hour.
    pub fastest_s: f64,
    /// The SNR that an hour of such exposures has.
    pub snr_hour: f64,
    /// The exposure that fills the brightest pixel.
    pub saturation_s: f64,
}

struct Growing<'a> {
    pixels: &'a Pixels,
    psf: &'a Psf,
    path: Path,
    electrons: f64,
    exposure_s: f64,
    estimator: Estimator,
}

impl Growing<'_> {
    fn at(&self, exposure_s: f64) -> (Pixels, f64) {
        let factor = exposure_s / self.exposure_s;
        (self.pixels.scaled(self.psf, &self.path, factor, self.estimator), factor * self.electrons)
    }

    /// Exposure beyond which trails are not drawn.
    fn drawn_s(&self) -> f64 {
        let rate = self.path.length() / self.exposure_s;
        (LONGEST * self.pixels.fwhm() / rate).min(RANGE_S[1])
    }

    fn snr(&self, exposure_s: f64) -> f64 {
        let drawn_s = exposure_s.min(self.drawn_s());
        let (pixels, electrons) = self.at(drawn_s);
        pixels.measure(electrons, self.estimator).snr * (exposure_s / drawn_s).sqrt()
    }

    fn peak(&self, exposure_s: f64) -> f64 {
        let drawn_s = exposure_s.min(self.drawn_s());
        let (pixels, electrons) = self.at(drawn_s);
        pixels.peak(electrons)
    }
}

/// Where a growing function reaches a value, by halving in the logarithm; none within the range.
fn reached(value: f64, function: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = RANGE_S.map(f64::ln);
    if function(high.exp()) < value || function(high.exp()).is_nan() {
        return f64::NAN;
    }
    while high - low > RELATIVE {
        let middle = 0.5 * (low + high);
        if function(middle.exp()) < value { low = middle } else { high = middle }
    }
    high.exp()
}

impl Best {
    /// For a target of so many electrons; `dead_s` passes between two exposures.
    pub fn of(
        exposed: &Exposed,
        electrons: f64,
        staged: &Staged,
        estimator: Estimator,
        wanted: f64,
        dead_s: f64,
    ) -> Self {
        let none = Self { wanted_s: f64::NAN, fastest_s: f64::NAN, snr_hour: f64::NAN, saturation_s: f64::NAN };
        let (Some(pixels), Some(scenery)) = (&exposed.pixels, &exposed.scenery) else { return none };
        let Some(target) = scenery.targets.get(staged.target) else { return none };
        let (psf, path, exposure_s) = (&scenery.psf, target.path, staged.view.exposure_s);
        let growing = Growing { pixels, psf, path, electrons, exposure_s, estimator };
        let saturation_s = reached(exposed.full_e, |s| growing.peak(s));
        let longest = if saturation_s.is_nan() { RANGE_S[1] } else { saturation_s };
        let wanted_s = reached(wanted, |s| growing.snr(s));
        let wanted_s = if wanted_s <= longest { wanted_s } else { f64::NAN };
        let dead_s = dead_s.max(0.0);
        let hour = |s: f64| growing.snr(s) * (HOUR_S / (s + dead_s).max(RANGE_S[0])).sqrt();
        let longest = longest.min(HOUR_S);
        let step = (longest / RANGE_S[0]).ln() / (TRIED - 1) as f64;
        let tried = (0..TRIED).map(|k| RANGE_S[0] * (step * k as f64).exp()).map(|s| (s, hour(s)));
        let best = tried.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, snr)| *snr > 0.0);
        let (fastest_s, snr_hour) = best.unwrap_or((f64::NAN, f64::NAN));
        Self { wanted_s, fastest_s, snr_hour, saturation_s }
    }
}
