//! The matched filter of a point or a trail: a Gaussian summed along a line of pixels.
//!
//! The image of a source is a Gaussian of the seeing (its variance 1/12 px^2 larger for the pixels) spread evenly over the
//! segment. Along the axis on which the segment is longer the filter sums 2 L + 1 pixels of the image blurred by the
//! Gaussian, along the other one it follows to the nearest pixel.
//!
//! Normalised to unit variance, the filtered noise is a Gaussian field. Its lattice maxima above t are told as by
//! Taylor, Worsley & Gosselin 2007 (Biometrika 94, 1): a value z exceeds both neighbours on an axis with correlations r1
//! and r2 one and two steps apart with the probability of a bivariate normal orthant, `Q(z) = Phi(a) - 2 T(a, b)`,
//! `a = z sqrt((1 - r1) / (1 + r1))`, `b = sqrt((1 - r) / (1 + r))`, `r = (r2 - r1^2) / (1 - r1^2)`, T of Owen (1956, Ann.
//! Math. Stat. 27, 1075); maxima a pixel: `int_t^inf phi(z) Qx(z) Qy(z) dz`.
//!
//! The curvature of the filtered source along an axis gives the error of its place: `1 / (S sqrt(int k'^2 / int k^2))`.

use super::measure::Normal;
use super::{DetectionError, within};
use glam::DVec2;
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

/// Standard deviations to which the Gaussian reaches.
const REACH: f64 = 3.2;
/// Exponent of the wings of images: of a Moffat profile of beta 2.5 summed along a trail.
const WING: i32 = 2;
/// The profile's scale for that exponent \[FWHM\].
const WING_SCALE: f64 = 0.885;
/// Pixels of the digital line, in pieces of a trail's length, over which norm and response are averaged.
const AVERAGED: i64 = 400;

/// A kind of source: its width and its trail.
#[derive(Debug, Clone)]
pub struct Kernel {
    /// Standard deviation of the Gaussian \[px\].
    pub(super) sigma: f64,
    /// Half of the trail \[px\].
    pub(super) half: DVec2,
    /// Half of the trail that the filter sums: whole pixels along the longer axis.
    summed: DVec2,
    /// The longer axis is x.
    pub(super) transposed: bool,
    /// Step along the shorter axis for one along the longer.
    pub(super) slope: f64,
    /// Pixels summed to each side along the longer axis.
    pub(super) l: usize,
    /// The Gaussian from its middle, of unit sum over both sides.
    pub(super) taps: Vec<f32>,
    /// Root of the sum of squares of the filter.
    pub(super) norm: f64,
    /// What the filter answers to its source of unit flux.
    response: f64,
    pub(super) normal: Normal,
    /// Correlations of filtered noise one and two steps across and along the line.
    correlations: [[f64; 2]; 2],
}

pub(super) fn phi(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

pub(super) fn gauss(x: f64, sigma: f64) -> f64 {
    (-0.5 * (x / sigma).powi(2)).exp() / (sigma * (2.0 * PI).sqrt())
}

/// Density along a segment of half length `l` blurred by a Gaussian.
fn blurred_box(s: f64, l: f64, sigma: f64) -> f64 {
    if l < 0.02 * sigma {
        return gauss(s, sigma);
    }
    (phi((s + l) / sigma) - phi((s - l) / sigma)) / (2.0 * l)
}

/// Split `d` into its parts along and across `half`.
fn axes(d: DVec2, half: DVec2) -> (f64, f64) {
    let e = half.try_normalize().unwrap_or(DVec2::X);
    (d.dot(e), d.perp_dot(e))
}

/// Light at `d` from the middle of a source of unit flux over a segment, blurred by `sigma` \[1/px^2\].
fn light(d: DVec2, half: DVec2, sigma: f64) -> f64 {
    let (s, a) = axes(d, half);
    if a.abs() > 8.0 * sigma {
        return 0.0;
    }
    blurred_box(s, half.length(), sigma) * gauss(a, sigma)
}

impl Kernel {
    /// The filter for images of `fwhm_px` (1 to 50) trailed from -`half` to `half` (1000 px at most along an axis).
    ///
    /// # Errors
    /// If a number is beyond its range.
    pub fn new(fwhm_px: f64, half: DVec2) -> Result<Self, DetectionError> {
        let fwhm = within("fwhm_px", fwhm_px, 1.0, 50.0)?;
        within("half.x", half.x, -1000.0, 1000.0)?;
        within("half.y", half.y, -1000.0, 1000.0)?;
        let sigma = (fwhm * fwhm / (8.0 * 2f64.ln()) + 1.0 / 12.0).sqrt();
        let transposed = half.x.abs() > half.y.abs();
        let (short, long) = if transposed { (half.y, half.x) } else { (half.x, half.y) };
        let slope = if long == 0.0 { 0.0 } else { short / long };
        let l = (long.abs() - 0.5).round().max(0.0) as usize;
        let reach = (REACH * sigma).ceil() as usize;
        let raw = (0..=reach).map(|i| (-0.5 * (i as f64 / sigma).powi(2)).exp()).collect::<Vec<_>>();
        let total = 2.0 * raw.iter().sum::<f64>() - 1.0;
        let taps = raw.iter().map(|t| (t / total) as f32).collect::<Vec<_>>();
        let mut kernel = Self {
            sigma,
            half,
            summed: if l == 0 { DVec2::ZERO } else { half * ((l as f64 + 0.5) / long.abs()) },
            transposed,
            slope,
            l,
            taps,
            norm: 1.0,
            response: 1.0,
            normal: Normal::new(),
            correlations: [[0.0; 2]; 2],
        };
        kernel.normalise(DVec2::new(short, long));
        Ok(kernel)
    }

    /// Norm, response and correlations. `half` is the trail with the longer axis as y.
    fn normalise(&mut self, half: DVec2) {
        let reach = self.taps.len() as i64 - 1;
        let tap = |i: i64| self.taps.get(i.unsigned_abs() as usize).map_or(0.0, |t| f64::from(*t));
        let product = |lag: i64| (-reach..=reach).map(|i| tap(i) * tap(i + lag)).sum::<f64>();
        let products = (0..=2 * reach).map(product).collect::<Vec<_>>();
        let product = |lag: i64| products.get(lag.unsigned_abs() as usize).copied().unwrap_or(0.0);
        let l = self.l as i64;
        let phases = (AVERAGED / (2 * l + 1)).clamp(1, 16);
        // pairs of line pixels within reach of each other, the second line shifted
        let square = |across: i64, along: i64| {
            let mut sum = 0.0;
            for phase in 0..phases {
                let place = |k: i64| line(self.slope, phase * (2 * l + 7) + k);
                for i in -l..=l {
                    let first = (i - along - 2 * reach).max(-l);
                    for j in first..=(i - along + 2 * reach).min(l) {
                        sum += product(j + along - i) * product(place(j + along) - place(i) + across);
                    }
                }
            }
            sum / phases as f64
        };
        let norm2 = square(0, 0);
        self.norm = norm2.sqrt();
        self.correlations =
            [[square(1, 0), square(2, 0)], [square(0, 1), square(0, 2)]].map(|p| p.map(|s| s / norm2));
        let mut response = 0.0;
        for phase in 0..phases {
            let origin = phase * (2 * l + 7);
            let offset = |k: i64| line(self.slope, origin + k) as f64 - self.slope * origin as f64;
            let mean = (-l..=l).map(|k| offset(k) - self.slope * k as f64).sum::<f64>() / (2 * l + 1) as f64;
            let place = |k: i64| DVec2::new(offset(k) - mean, k as f64);
            response += (-l..=l).map(|k| light(place(k), half, SQRT_2 * self.sigma)).sum::<f64>();
        }
        self.response = response / phases as f64;
    }

    /// The trail's half vector \[px\].
    pub fn half(&self) -> DVec2 {
        self.half
    }

    /// Flux of a source of significance 1 over noise of unit standard deviation a pixel.
    pub fn unit_flux(&self) -> f64 {
        self.norm / self.response
    }

    /// Light in the brightest pixel of a source of significance 1, against the noise of a pixel.
    pub(super) fn unit_peak(&self) -> f64 {
        self.unit_flux() * light(DVec2::ZERO, self.half, self.sigma)
    }

    /// Significance that a background higher by one standard deviation of a pixel gives.
    pub(super) fn background_gain(&self) -> f64 {
        (2 * self.l + 1) as f64 / self.norm
    }

    /// Standard deviations of a place along and across the trail at significance 1 \[px\].
    pub fn unit_place_sigma(&self) -> [f64; 2] {
        let (s, d) = (self.sigma, 2.0 * self.half.length());
        let across = SQRT_2 * s;
        if d < 0.02 * s {
            return [across; 2];
        }
        let slope = (1.0 - (-0.25 * (d / s).powi(2)).exp()) / (s * PI.sqrt());
        let square = d * libm::erf(0.5 * d / s) - 2.0 * s / PI.sqrt() * (1.0 - (-0.25 * (d / s).powi(2)).exp());
        [(square / slope).max(0.0).sqrt().max(across), across]
    }

    /// False maxima expected a pixel above each significance from 2 to 10 by 0.05.
    fn maxima(&self) -> Vec<(f64, f64)> {
        let higher = |[r1, r2]: [f64; 2], z: f64| {
            let r1 = r1.clamp(0.0, 0.999_999);
            let r = ((r2 - r1 * r1) / (1.0 - r1 * r1)).clamp(-0.999, 0.999);
            let (a, b) = (z * ((1.0 - r1) / (1.0 + r1)).sqrt(), ((1.0 - r) / (1.0 + r)).sqrt());
            (phi(a) - 2.0 * owen(a, b)).max(0.0)
        };
        const STEP: f64 = 0.05;
        let density = |z: f64| gauss(z, 1.0) * higher(self.correlations[0], z) * higher(self.correlations[1], z);
        let mut table = Vec::new();
        let mut above = 0.0;
        for i in (40..=200).rev() {
            let z = f64::from(i) * STEP;
            above += STEP / 6.0 * (density(z) + 4.0 * density(z + 0.5 * STEP) + density(z + STEP));
            table.push((z, above));
        }
        table
    }

    /// The significance that `expected` maxima of noise exceed among `pixels` filtered, from 2 to 10.
    pub fn threshold(&self, expected: f64, pixels: f64) -> f64 {
        let table = self.maxima();
        let wanted = (expected / pixels).ln();
        for pair in table.windows(2) {
            let [(high, few), (low, many)] = [pair[0], pair[1]].map(|(z, n)| (z, n.ln()));
            if many >= wanted {
                let t = ((wanted - few) / (many - few)).clamp(0.0, 1.0);
                return high + (low - high) * t;
            }
        }
        2.0
    }

    /// Significance that the other kernel answers at `d` from a source of this one, against its own.
    pub(super) fn answer(&self, other: &Self, d: DVec2) -> f64 {
        let scale = self.norm / self.response / other.norm;
        self.heard(other, d, SQRT_2 * self.sigma) * (2 * other.l + 1) as f64 * scale
    }

    /// The share of the answer in the middle that the wings of real images, `radius` wide in the middle, may give at `d`.
    pub(super) fn wing(&self, other: &Self, d: DVec2, radius: f64) -> f64 {
        // the distance from all places at which the segments touch
        let apart = (distance_from_sum(d, self.half, other.half) - radius).max(0.0);
        let alpha = WING_SCALE * 2.354_82 * self.sigma;
        (1.0 + apart * apart / (alpha * alpha)).powi(-WING)
    }

    /// The filter of a point of the same width.
    pub(super) fn point(&self) -> Self {
        let none = DVec2::ZERO;
        let mut point = Self { half: none, summed: none, transposed: false, slope: 0.0, l: 0, ..self.clone() };
        point.normalise(none);
        point
    }

    /// Share of the trail of a source at `place` on a frame of `size`; 1 for a point.
    pub(super) fn share_inside(&self, place: DVec2, size: [usize; 2]) -> f64 {
        let (mut from, mut to) = (-1.0f64, 1.0f64);
        for (x, h, n) in [(place.x, self.half.x, size[0]), (place.y, self.half.y, size[1])] {
            if h != 0.0 && self.l > 0 {
                let ends = [(-0.5 - x) / h, (n as f64 - 0.5 - x) / h];
                (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
            }
        }
        (0.5 * (to - from)).clamp(0.0, 1.0)
    }

    /// Whether `d` is within `reach` of a place where this trail and one of half lengths `longest` touch.
    pub(super) fn touches(&self, longest: DVec2, d: DVec2, reach: f64) -> bool {
        let e = self.half.try_normalize().unwrap_or(DVec2::X);
        let (along, across) = (d.dot(e).abs(), d.perp_dot(e).abs());
        // a box of half lengths `longest`, seen along and across the trail
        let side = longest.dot(e.abs());
        let width = longest.x * e.y.abs() + longest.y * e.x.abs();
        along <= self.half.length() + side + reach && across <= width + reach
    }

    /// Light of a source of this kernel's, blurred by `s`, averaged over what the other's filter sums at `d`.
    fn heard(&self, other: &Self, d: DVec2, s: f64) -> f64 {
        let (l, m) = (self.half.length(), other.summed.length());
        let parallel =
            l < 0.02 * s || m < 0.02 * s || self.half.perp_dot(other.summed).abs() < 0.02 * s * l.max(m);
        if parallel {
            let axis = if l >= m { self.half } else { other.summed };
            let (along, across) = axes(d, axis);
            if across.abs() > 8.0 * s || along.abs() > l + m + 8.0 * s {
                return 0.0;
            }
            return gauss(across, s) * blurred_trapezium(along, l.max(m), l.min(m), s);
        }
        let samples = ((2.0 * m / self.sigma).ceil()).clamp(3.0, 200.0) as usize;
        let step = |i: usize| other.summed * ((2 * i + 1) as f64 / samples as f64 - 1.0);
        (0..samples).map(|i| light(d + step(i), self.half, s)).sum::<f64>() / samples as f64
    }

    /// Distance from a source of this kernel at which the wings of its images fall to a share of the middle \[px\].
    pub(super) fn wing_reach(&self, share: f64) -> f64 {
        let alpha = WING_SCALE * 2.354_82 * self.sigma;
        alpha * (share.clamp(1e-12, 1.0).powf(-1.0 / f64::from(WING)) - 1.0).max(0.0).sqrt()
    }
}

/// The digital line of a slope: its pixel at `y`.
pub(super) fn line(slope: f64, y: i64) -> i64 {
    (slope * y as f64).round() as i64
}

/// The mean of a blurred box of half length `l` over a box of half length `m <= l` at `s`.
fn blurred_trapezium(s: f64, l: f64, m: f64, sigma: f64) -> f64 {
    if m < 0.02 * sigma {
        return blurred_box(s, l, sigma);
    }
    // integral of Phi
    let ramp = |x: f64| x * phi(x / sigma) + sigma * sigma * gauss(x, sigma);
    (ramp(s + l + m) - ramp(s + l - m) - ramp(s - l + m) + ramp(s - l - m)) / (4.0 * l * m)
}

/// Distance of `d` from the parallelogram of all sums of a point of either segment.
fn distance_from_sum(d: DVec2, a: DVec2, b: DVec2) -> f64 {
    let cross = a.perp_dot(b);
    let within = cross != 0.0 && (d.perp_dot(b) / cross).abs() <= 1.0 && (a.perp_dot(d) / cross).abs() <= 1.0;
    if within {
        return 0.0;
    }
    let side = |middle: DVec2, half: DVec2| {
        let v = d - middle;
        let square = half.length_squared();
        let t = if square > 0.0 { (v.dot(half) / square).clamp(-1.0, 1.0) } else { 0.0 };
        (v - half * t).length()
    };
    side(a, b).min(side(-a, b)).min(side(b, a)).min(side(-b, a))
}

/// Owen's T by Simpson's rule.
fn owen(h: f64, a: f64) -> f64 {
    const N: usize = 32;
    let f = |x: f64| (-0.5 * h * h * (1.0 + x * x)).exp() / (1.0 + x * x);
    let step = a / N as f64;
    let inner = (1..N).map(|i| if i % 2 == 1 { 4.0 } else { 2.0 } * f(i as f64 * step)).sum::<f64>();
    step / 3.0 * (f(0.0) + inner + f(a)) / (2.0 * PI)
}
