//! How many stars there are: counts against magnitude and galactic place.
//!
//! Bahcall & Soneira 1980, ApJS 44, 73, eq. B1 in V, stars per square degree brighter than m, fitted at |b| >= 20 deg:
//!
//! ```text
//! N = C1 10^(beta (m - m1)) / (1 + 10^(alpha (m - m1)))^delta / [sin|b| (1 - mu cot|b| cos l)]^(3 - 5 gamma)
//!   + C2 10^(eta (m - m2)) / (1 + 10^(kappa (m - m2)))^lambda / (1 - cos b cos l)^sigma
//! ```
//!
//! It falls short of the stars counted in Tycho-2 by a factor of 1.1 to 1.9 (`catalogs/starlight/bs80_bright_end.csv`). The
//! counts are corrected only where they were measured, V 6.9 to 11.4, by the measured ratio of cumulative counts; fainter,
//! the differential counts are the formula's. Below |b| = 20 deg the formula at 20 deg grows as a flat disc does that is
//! clamped within 10 deg of its plane: as (sin^2 b + sin^2 10 deg)^(-1/2). Beyond V = 21 the formula is extrapolated.
//! Uncertainty: 15 % of the formula's own fit, a factor of two in the plane.

use crate::base::nodes::bracket;
use crate::base::units::flux_from_mag;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Lowest latitude of the formula, and where the disc's growth is clamped \[deg\].
const FORMULA_DEG: f64 = 20.0;
const PLANE_DEG: f64 = 10.0;

/// Faintest magnitude of sums over all stars; what lies beyond adds less than 1e-3 of the light of V > 20.
const FAINTEST: f64 = 30.0;

/// Step of the sum of light \[mag\].
const STEP: f64 = 0.125;

/// V - VT of the measured counts.
const V_MINUS_VT: f64 = -0.07;

/// Ratio of the measured to the formula's cumulative counts.
struct BrightEnd {
    latitudes: Vec<f64>,
    mags: Vec<f64>,
    /// By latitude, then magnitude.
    ratio: Vec<f64>,
}

static BRIGHT_END: LazyLock<BrightEnd> = LazyLock::new(|| {
    let text = include_str!("../../catalogs/starlight/bs80_bright_end.csv");
    let mut table = BrightEnd { latitudes: vec![], mags: vec![], ratio: vec![] };
    for line in text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit())) {
        let v = line.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<_>>();
        let middle = 0.5 * (v[0] + v[1]);
        if table.latitudes.last() != Some(&middle) {
            table.latitudes.push(middle);
        }
        if table.latitudes.len() == 1 {
            table.mags.push(v[2] + V_MINUS_VT);
        }
        table.ratio.push(v[5]);
    }
    table
});

/// A place in galactic coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Galactic {
    /// Longitude \[rad\].
    pub l: f64,
    /// Latitude \[rad\].
    pub b: f64,
}

impl Galactic {
    /// Of an ICRS direction (Hipparcos catalogue 1997, sect. 1.5.3).
    pub fn of(icrs: glam::DVec3) -> Self {
        let (ra, dec) = crate::astro::angles(icrs);
        let (l, b) = sofars::coords::icrs2g(ra, dec);
        Self { l, b }
    }
}

/// Counts towards one place.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    cos_l: f64,
    sin_b: f64,
    cos_b: f64,
    /// Growth of the disc below the formula's latitudes.
    plane: f64,
    latitude_deg: f64,
    /// Cumulative count at the end of the measured magnitudes less the formula's there.
    excess: f64,
}

impl Counts {
    /// The counts at a place.
    pub fn at(place: Galactic) -> Self {
        let latitude_deg = place.b.abs().to_degrees();
        let (sin_b, cos_b) = latitude_deg.max(FORMULA_DEG).to_radians().sin_cos();
        let clamped = |deg: f64| deg.to_radians().sin().hypot(PLANE_DEG.to_radians().sin());
        let plane = clamped(FORMULA_DEG) / clamped(latitude_deg.min(FORMULA_DEG));
        let mut counts = Self { cos_l: place.l.cos(), sin_b, cos_b, plane, latitude_deg, excess: 0.0 };
        let last = BRIGHT_END.mags[BRIGHT_END.mags.len() - 1];
        counts.excess = (counts.ratio(last) - 1.0) * counts.formula(last);
        counts
    }

    /// Stars per square degree brighter than V = `mag`.
    pub fn brighter_than(&self, mag: f64) -> f64 {
        let measured = &BRIGHT_END.mags;
        if mag >= measured[measured.len() - 1] {
            self.formula(mag) + self.excess
        } else {
            self.formula(mag) * self.ratio(mag)
        }
    }

    /// S10 of the stars of V from `bright` to `faint`: tenth-magnitude stars per square degree that give as much light.
    pub fn s10(&self, bright: f64, faint: f64) -> f64 {
        let faint = faint.min(FAINTEST);
        if bright >= faint {
            return 0.0;
        }
        // steps on fixed magnitudes, so that sums over adjoining ranges add up
        let mut sum = 0.0;
        let (mut mag, mut count) = (bright, self.brighter_than(bright));
        while mag < faint {
            let next = (((mag / STEP).floor() + 1.0) * STEP).min(faint);
            let counted = self.brighter_than(next);
            sum += (counted - count) * flux_from_mag(0.5 * (mag + next) - 10.0);
            (mag, count) = (next, counted);
        }
        sum.max(0.0)
    }

    /// Eq. B1 with the disc's growth.
    fn formula(&self, mag: f64) -> f64 {
        let between = ((mag - 12.0) / 8.0).clamp(0.0, 1.0);
        let (mu, gamma) = (0.03 + 0.06 * between, 0.36 - 0.32 * between);
        let power = |x: f64| 10f64.powf(x);
        let disc = 925.0 * power(0.035 * (mag - 15.75))
            / (1.0 + power(-0.132 * (mag - 15.75))).powi(3)
            / (self.sin_b * (1.0 - mu * self.cos_b / self.sin_b * self.cos_l)).powf(3.0 - 5.0 * gamma);
        let cosines = self.cos_b * self.cos_l;
        let halo = 1050.0 * power(0.087 * (mag - 17.5))
            / (1.0 + power(-0.18 * (mag - 17.5))).powf(2.5)
            / (1.0 - cosines).powf(1.45 - 0.20 * cosines);
        (disc + halo) * self.plane
    }

    fn ratio(&self, mag: f64) -> f64 {
        let table = &*BRIGHT_END;
        let (i, fi) = bracket(&table.latitudes, self.latitude_deg);
        let (j, fj) = bracket(&table.mags, mag);
        let at = |i: usize, j: usize| table.ratio[i * table.mags.len() + j];
        (1.0 - fi) * ((1.0 - fj) * at(i, j) + fj * at(i, j + 1))
            + fi * ((1.0 - fj) * at(i + 1, j) + fj * at(i + 1, j + 1))
    }
}

/// Square degrees in a steradian.
pub const DEG2_PER_SR: f64 = (180.0 / PI) * (180.0 / PI);

#[cfg(test)]
mod tests {
    use super::*;

    fn at(b: f64, l: f64) -> Counts {
        Counts::at(Galactic { l: l.to_radians(), b: b.to_radians() })
    }

    /// `catalogs/starlight/bs80.csv`, worked out by others from the same equation.
    #[test]
    fn the_formula_is_the_published_one() {
        for (b, l, n12, n16, n20) in [
            (20.0, 0.0, 70.8135, 3558.98, 56165.9),
            (45.0, 90.0, 15.6696, 319.973, 2470.6),
            (90.0, 0.0, 10.6498, 188.038, 1439.84),
            (-30.0, 225.0, 21.8468, 484.432, 3650.8),
        ] {
            for (mag, known) in [(12.0, n12), (16.0, n16), (20.0, n20)] {
                let got = at(b, l).formula(mag);
                assert!((got / known - 1.0).abs() < 1e-4, "{b} {l} {mag}: {got} {known}");
            }
        }
    }

    #[test]
    fn corrected_where_measured_and_nowhere_else() {
        let c = at(75.0, 40.0);
        assert!((c.brighter_than(9.93) / c.formula(9.93) - 1.956).abs() < 1e-9);
        let faint = c.brighter_than(18.0) - c.brighter_than(14.0);
        assert!((faint / (c.formula(18.0) - c.formula(14.0)) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn counts_grow_with_magnitude_and_light_adds_up() {
        for (b, l) in [(0.0, 0.0), (5.0, 180.0), (20.0, 0.0), (60.0, 90.0), (90.0, 0.0), (-90.0, 0.0)] {
            let c = at(b, l);
            let mut before = 0.0;
            for k in 0..240 {
                let now = c.brighter_than(0.1 * f64::from(k));
                assert!(now.is_finite() && now >= before, "{b} {l} {k}");
                before = now;
            }
            let parts = c.s10(11.0, 14.3) + c.s10(14.3, 20.0) + c.s10(20.0, 99.0);
            assert!((parts / c.s10(11.0, 99.0) - 1.0).abs() < 2e-4, "{b} {l}");
        }
    }
}
