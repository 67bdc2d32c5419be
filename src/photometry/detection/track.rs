//! Motion fitted to places: linear or quadratic in time, by least squares with the largest acceleration as prior.
//!
//! With weights 1 / sigma^2 and the basis (1, u, u^2 / 2), u the time from the first detection in units of the whole span,
//! the normal matrix is the same along both axes. The acceleration's prior is a Gaussian about 0 of the largest
//! acceleration as standard deviation, so that two detections already predict others with an error that holds.

use glam::{DMat3, DVec2, DVec3};

/// A quadratic must lower chi-square by this, which chance does once in 1000 (2 degrees of freedom).
const BETTER: f64 = 13.8;
/// Weight of what is held at zero, against that of all detections.
const HELD: f64 = 1e12;

/// A detection of a track.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Member {
    /// Number of the frame, as given.
    pub frame: usize,
    /// Number of the detection in its frame, as given.
    pub detection: usize,
}

/// Detections that move as one object.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// Its detections in the order of time.
    pub members: Vec<Member>,
    /// Weighted mean time of the members \[s\]; place and rate are at this time.
    pub epoch_s: f64,
    /// Place in the tangent plane \[arcsec\].
    pub place: DVec2,
    /// Standard deviation of the place along each axis \[arcsec\].
    pub place_sigma: f64,
    /// Rate \[arcsec/s\].
    pub rate: DVec2,
    /// Standard deviation of the rate along each axis \[arcsec/s\].
    pub rate_sigma: f64,
    /// Acceleration \[arcsec/s^2\]; zero if a straight and steady motion does.
    pub acceleration: DVec2,
    /// Standard deviation of the acceleration along each axis \[arcsec/s^2\]; 0 if it is held at zero.
    pub acceleration_sigma: f64,
    /// Sum of squared deviations over variances.
    pub chi_square: f64,
    /// Degrees of freedom of chi-square.
    pub freedom: usize,
    /// Logarithm (base 10) of the expected number of tracks as good as this among false detections alone.
    pub log_false: f64,
}

/// One measured place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub member: Member,
    pub time_s: f64,
    pub place: DVec2,
    pub sigma: f64,
}

/// Sums of a fit that grows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fit {
    origin_s: f64,
    span_s: f64,
    normal: DMat3,
    right: [DVec3; 2],
}

impl Fit {
    /// About the time `origin_s`, in units of `span_s`, with an acceleration of up to `largest` \[arcsec/s^2\].
    pub fn new(origin_s: f64, span_s: f64, largest: f64) -> Self {
        let prior = (largest * span_s * span_s).powi(-2).min(f64::MAX.sqrt());
        let normal = DMat3::from_diagonal(DVec3::new(0.0, 0.0, prior));
        Self { origin_s, span_s, normal, right: [DVec3::ZERO; 2] }
    }

    fn basis(&self, time_s: f64) -> DVec3 {
        let u = (time_s - self.origin_s) / self.span_s;
        DVec3::new(1.0, u, 0.5 * u * u)
    }

    pub fn add(&mut self, point: &Point) {
        let basis = self.basis(point.time_s);
        let weight = point.sigma.powi(-2);
        self.normal += DMat3::from_cols(basis * basis.x, basis * basis.y, basis * basis.z) * weight;
        self.right[0] += basis * (point.place.x * weight);
        self.right[1] += basis * (point.place.y * weight);
    }

    /// The motion: coefficients of both axes and their covariance.
    pub fn solve(&self) -> Motion {
        let mut normal = self.normal;
        // a prior much stronger than the detections leaves no digits to them
        normal.z_axis.z = normal.z_axis.z.min(HELD * normal.x_axis.x);
        let covariance = normal.inverse();
        Motion { fit: *self, covariance, coefficients: self.right.map(|r| covariance * r) }
    }
}

/// A fitted motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    fit: Fit,
    covariance: DMat3,
    coefficients: [DVec3; 2],
}

impl Motion {
    /// Place at a time and its variance along each axis; none if the fit is singular.
    pub fn at(&self, time_s: f64) -> Option<(DVec2, f64)> {
        let basis = self.fit.basis(time_s);
        let place = DVec2::new(self.coefficients[0].dot(basis), self.coefficients[1].dot(basis));
        let variance = basis.dot(self.covariance * basis);
        (place.is_finite() && variance.is_finite()).then_some((place, variance.max(0.0)))
    }

    fn chi_square(&self, points: &[Point]) -> f64 {
        let deviation =
            |p: &Point| self.at(p.time_s).map_or(f64::NAN, |(at, _)| (p.place - at).length() / p.sigma);
        points.iter().map(|p| deviation(p).powi(2)).sum()
    }
}

impl Track {
    /// The motion through points: steady, or accelerated if that is clearly better; none if it cannot be told.
    pub(super) fn through(points: &[Point], log_false: f64) -> Option<Self> {
        let (first, last) = (points.first()?.time_s, points.last()?.time_s);
        let weight = points.iter().map(|p| p.sigma.powi(-2)).sum::<f64>();
        let mean = points.iter().map(|p| (p.time_s - first) * p.sigma.powi(-2)).sum::<f64>() / weight;
        let (epoch_s, span_s) = (first + mean, last - first);
        let motion = |largest: f64| {
            let mut fit = Fit::new(epoch_s, span_s, largest);
            points.iter().for_each(|p| fit.add(p));
            fit.solve()
        };
        let (steady, bent) = (motion(0.0), motion(f64::INFINITY));
        let chi = [steady.chi_square(points), bent.chi_square(points)];
        let quadratic = points.len() > 3 && chi[0] - chi[1] > BETTER;
        let chosen = if quadratic { bent } else { steady };
        let along = |i: usize| DVec2::new(chosen.coefficients[0][i], chosen.coefficients[1][i]);
        let sigma = |i: usize| chosen.covariance.col(i)[i].max(0.0).sqrt();
        let bend = if quadratic { span_s.powi(-2) } else { 0.0 };
        let chi_square = chi[usize::from(quadratic)];
        let track = Self {
            members: points.iter().map(|p| p.member).collect(),
            epoch_s,
            place: along(0),
            place_sigma: sigma(0),
            rate: along(1) / span_s,
            rate_sigma: sigma(1) / span_s,
            acceleration: along(2) * bend,
            acceleration_sigma: sigma(2) * bend,
            chi_square,
            freedom: 2 * (points.len() - if quadratic { 3 } else { 2 }),
            log_false,
        };
        (track.rate.is_finite() && chi_square.is_finite()).then_some(track)
    }
}
