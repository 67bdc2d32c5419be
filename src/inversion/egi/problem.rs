//! What is inverted: light curves with their errors and geometry.

use crate::object::convex::Epochs;
use crate::object::matter::Material;
use glam::DVec3;

/// Scale of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Known: the curve is this times the normalised irradiance \[m^2/sr\]; 1 for calibrated ones; 1e-30 to 1e30.
    Fixed(f64),
    /// Unknown: a relative curve.
    Free,
}

/// A light curve; NaN among `y` or `sigma` marks a gap, which is dropped and counted.
#[derive(Debug, Clone)]
pub struct Curve {
    /// Normalised irradiance \[m^2/sr\], times the scale.
    pub y: Vec<f64>,
    /// Standard deviation of each, > 0, in the same unit, NaN for a gap. For data without noise take 1e-9 of their mean.
    pub sigma: Vec<f64>,
    /// Unit vectors to the Sun and to the observer at each epoch, body axes.
    pub directions: Vec<(DVec3, DVec3)>,
    /// Scale.
    pub scale: Scale,
}

/// Why curves cannot be inverted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// Lists of different lengths.
    #[error("curve {curve}: {y} data, {sigma} errors and {directions} directions must be as many")]
    Lengths {
        /// Number of the curve.
        curve: usize,
        /// Data.
        y: usize,
        /// Errors.
        sigma: usize,
        /// Pairs of directions.
        directions: usize,
    },
    /// A number out of its range.
    #[error("curve {curve}, epoch {epoch}: {what} = {value} is outside {range}")]
    Value {
        /// Number of the curve.
        curve: usize,
        /// Number of the epoch in the curve; 0 for the scale.
        epoch: usize,
        /// Its name.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The range.
        range: &'static str,
    },
    /// Nothing left.
    #[error("no usable point: {dropped} have no flux, error or zero point, and there are no others")]
    Empty {
        /// Gaps dropped.
        dropped: usize,
    },
}

/// Light curves, checked, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Problem {
    /// Geometry of all data.
    pub(super) epochs: Epochs,
    pub(super) y: Vec<f64>,
    pub(super) sigma: Vec<f64>,
    /// Curve of each datum.
    pub(super) curve: Vec<usize>,
    /// Known scale of each curve, none where free.
    pub(super) scales: Vec<Option<f64>>,
    pub(super) dropped: usize,
    pub(super) calibrated: bool,
}

/// Greatest deviation of a direction's length from 1.
const UNIT: f64 = 1e-6;

impl Problem {
    /// Of curves. Where none has a fixed scale the first is held at 1, and areas are relative.
    ///
    /// # Errors
    /// Lengths that differ, numbers out of range with their place, no data.
    pub fn new(curves: &[Curve]) -> Result<Self, ProblemError> {
        let mut out = Self { calibrated: false, ..Self::default() };
        let mut directions = Vec::new();
        for (number, curve) in curves.iter().enumerate() {
            let (y, sigma) = (curve.y.len(), curve.sigma.len());
            if y != sigma || y != curve.directions.len() {
                return Err(ProblemError::Lengths { curve: number, y, sigma, directions: curve.directions.len() });
            }
            out.scales.push(match curve.scale {
                Scale::Free => None,
                Scale::Fixed(value) if (1e-30..=1e30).contains(&value) => Some(value),
                Scale::Fixed(value) => {
                    let (what, range) = ("scale", "1e-30 to 1e30");
                    return Err(ProblemError::Value { curve: number, epoch: 0, what, value, range });
                }
            });
            let data = curve.y.iter().zip(&curve.sigma).zip(&curve.directions);
            for (epoch, ((&y, &sigma), &(sun, observer))) in data.enumerate() {
                let error = |what, value, range| ProblemError::Value { curve: number, epoch, what, value, range };
                if y.is_nan() || sigma.is_nan() {
                    out.dropped += 1;
                    continue;
                }
                if y.abs() > 1e30 {
                    return Err(error("y", y, "-1e30 to 1e30 and NaN for a gap"));
                }
                if !(1e-30..=1e30).contains(&sigma) {
                    return Err(error("sigma", sigma, "1e-30 to 1e30"));
                }
                for (what, v) in
                    [("length of the vector to the Sun", sun), ("length of the vector to the observer", observer)]
                {
                    if !(1.0 - UNIT..=1.0 + UNIT).contains(&v.length()) {
                        return Err(error(what, v.length(), "1 within 1e-6"));
                    }
                }
                out.y.push(y);
                out.sigma.push(sigma);
                out.curve.push(number);
                directions.push((sun.normalize(), observer.normalize()));
            }
        }
        if out.y.is_empty() {
            return Err(ProblemError::Empty { dropped: out.dropped });
        }
        out.calibrated = out.scales.iter().any(Option::is_some);
        if let Some(first) = out.scales.first_mut().filter(|_| !out.calibrated) {
            *first = Some(1.0);
        }
        out.epochs = Epochs::new(directions);
        Ok(out)
    }

    /// Number of data.
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there are none: never, of a problem made by [`Problem::new`].
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Geometry of the data.
    pub fn epochs(&self) -> &Epochs {
        &self.epochs
    }

    /// Standard deviations.
    pub fn sigma(&self) -> &[f64] {
        &self.sigma
    }

    /// Curve of each datum.
    pub(in crate::inversion) fn curve_of(&self) -> &[usize] {
        &self.curve
    }

    /// Scale of each curve, none where it is free.
    pub(in crate::inversion) fn scales(&self) -> &[Option<f64>] {
        &self.scales
    }

    /// y/sigma.
    pub fn weighted_data(&self) -> Vec<f64> {
        self.y.iter().zip(&self.sigma).map(|(y, s)| y / s).collect()
    }

    /// Flux of 1 m^2 along a normal over sigma; free scales count as 1.
    pub fn weighted_column(&self, normal: DVec3, material: &Material) -> Vec<f64> {
        let column = self.epochs.column(normal, material, 0.0);
        let factor = |t: usize| self.scales[self.curve[t]].unwrap_or(1.0) / self.sigma[t];
        column.iter().enumerate().map(|(t, g)| g * factor(t)).collect()
    }

    /// Root mean square of y/sigma: the signal-to-noise ratio of the whole.
    pub fn snr(&self) -> f64 {
        let squares: f64 = self.y.iter().zip(&self.sigma).map(|(y, s)| (y / s).powi(2)).sum();
        (squares / self.len().max(1) as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve() -> Curve {
        let scale = Scale::Free;
        Curve {
            y: vec![1.0, f64::NAN, 0.0],
            sigma: vec![0.1; 3],
            directions: vec![(DVec3::X, DVec3::Y); 3],
            scale,
        }
    }

    #[test]
    fn gaps_are_dropped_and_counted_and_the_first_relative_curve_sets_the_scale() {
        let problem = Problem::new(&[curve(), curve()]).unwrap();
        assert_eq!((problem.len(), problem.dropped, problem.calibrated), (4, 2, false));
        assert_eq!(problem.scales, [Some(1.0), None]);
        let unknown = Curve { sigma: vec![f64::NAN, 0.1, 0.1], ..curve() };
        assert_eq!(Problem::new(&[unknown]).map(|p| (p.len(), p.dropped)).unwrap(), (1, 2));
        let fixed = Curve { scale: Scale::Fixed(2.0), ..curve() };
        assert_eq!(Problem::new(&[curve(), fixed]).unwrap().scales, [None, Some(2.0)]);
        assert!((problem.snr() - 50f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn bad_input_is_refused_with_value_place_and_range() {
        let tell = |c: Curve| Problem::new(&[curve(), c]).unwrap_err().to_string();
        assert_eq!(
            tell(Curve { sigma: vec![0.1, 0.1, 0.0], ..curve() }),
            "curve 1, epoch 2: sigma = 0 is outside 1e-30 to 1e30"
        );
        assert!(tell(Curve { y: vec![f64::INFINITY, 0.0, 0.0], ..curve() }).contains("epoch 0: y = inf"));
        assert!(tell(Curve { directions: vec![(DVec3::X, DVec3::NAN); 3], ..curve() }).contains("observer = NaN"));
        assert!(tell(Curve { scale: Scale::Fixed(-1.0), ..curve() }).contains("scale = -1"));
        assert!(tell(Curve { y: vec![], ..curve() }).contains("0 data, 3 errors"));
        let gaps = Curve { y: vec![f64::NAN; 3], ..curve() };
        assert_eq!(Problem::new(&[gaps]).unwrap_err(), ProblemError::Empty { dropped: 3 });
        assert_eq!(Problem::new(&[]).unwrap_err(), ProblemError::Empty { dropped: 0 });
    }
}
