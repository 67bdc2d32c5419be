//! Frames drawn for tests: images of closed form, and noise from a seed.
//!
//! Images are Gaussians or Moffat profiles of beta 2.5, whose integral along a line is
//! `t / (3 c^2 (c^2 + t^2)^(3/2)) + 2 t / (3 c^4 (c^2 + t^2)^(1/2))` with c^2 = alpha^2 + a^2 at the distance a of the line.

use glam::DVec2;
use std::f64::consts::PI;

/// Steele, Lea & Flood 2014 (OOPSLA, 453).
pub struct SplitMix(pub u64);

impl SplitMix {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// From 0 to 1, without them.
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / 9_007_199_254_740_992.0
    }

    pub fn normals(&mut self) -> [f64; 2] {
        let (r, angle) = ((-2.0 * self.uniform().ln()).sqrt(), 2.0 * PI * self.uniform());
        [r * angle.cos(), r * angle.sin()]
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    Gauss,
    Moffat,
}

/// Mean electrons of a frame.
pub struct Sky {
    pub width: usize,
    pub height: usize,
    pub mean: Vec<f64>,
    pub read: f64,
    pub fwhm: f64,
    pub shape: Shape,
}

impl Sky {
    pub fn flat(width: usize, height: usize, level: f64) -> Self {
        let mean = vec![level; width * height];
        Self { width, height, mean, read: 5.0, fwhm: 3.0, shape: Shape::Gauss }
    }

    /// Scatter of a pixel of `level`.
    pub fn noise(&self, level: f64) -> f64 {
        (level + self.read * self.read).sqrt()
    }

    /// Add a source of `flux` from `place - half` to `place + half`.
    pub fn add(&mut self, place: DVec2, half: DVec2, flux: f64) {
        let l = half.length();
        let e = half.try_normalize().unwrap_or(DVec2::X);
        let sigma = (self.fwhm.powi(2) / (8.0 * 2f64.ln()) + 1.0 / 12.0).sqrt();
        let alpha = 0.5 * self.fwhm / (2f64.powf(0.4) - 1.0).sqrt();
        let peak = flux / (2.0 * PI * sigma * sigma + 5.0 * sigma * l);
        let reach = match self.shape {
            Shape::Gauss => 5.0 * sigma,
            Shape::Moffat => (alpha * (peak / 0.1).max(1.0).powf(0.25)).clamp(5.0 * sigma, 150.0),
        };
        let gauss = |x: f64| (-0.5 * (x / sigma).powi(2)).exp() / (sigma * (2.0 * PI).sqrt());
        let phi = |x: f64| 0.5 * libm::erfc(-x / (sigma * 2f64.sqrt()));
        let light = |s: f64, a: f64| match (self.shape, l > 0.01) {
            (Shape::Gauss, false) => gauss(s) * gauss(a),
            (Shape::Gauss, true) => gauss(a) * (phi(s + l) - phi(s - l)) / (2.0 * l),
            (Shape::Moffat, false) => {
                1.5 / (PI * alpha * alpha) * (1.0 + (s * s + a * a) / (alpha * alpha)).powf(-2.5)
            }
            (Shape::Moffat, true) => {
                let c2 = alpha * alpha + a * a;
                let part = |t: f64| {
                    let h = (c2 + t * t).sqrt();
                    t / (3.0 * c2 * h.powi(3)) + 2.0 * t / (3.0 * c2 * c2 * h)
                };
                1.5 / PI * alpha.powi(3) * (part(s + l) - part(s - l)) / (2.0 * l)
            }
        };
        let extent = half.abs() + reach;
        let range = |x: f64, r: f64, n: usize| {
            ((x - r).ceil().max(0.0) as usize)..((x + r + 1.0).max(0.0) as usize).min(n)
        };
        for y in range(place.y, extent.y, self.height) {
            for x in range(place.x, extent.x, self.width) {
                let d = DVec2::new(x as f64, y as f64) - place;
                let (s, a) = (d.dot(e), d.perp_dot(e));
                if a.abs() < reach {
                    self.mean[y * self.width + x] += flux * light(s, a);
                }
            }
        }
    }

    /// Root of the sum of squares of a source of unit flux: its significance in noise of 1.
    pub fn norm(&self, half: DVec2) -> f64 {
        let reach = half.abs() + 40.0;
        let (width, height) = (2 * reach.x as usize, 2 * reach.y as usize);
        let mut alone = Self { width, height, mean: vec![0.0; width * height], ..*self };
        alone.add(DVec2::new(width as f64, height as f64) * 0.5, half, 1.0);
        alone.mean.iter().map(|m| m * m).sum::<f64>().sqrt()
    }

    /// One exposure: mean, its Poisson noise taken as Gaussian, and read noise.
    pub fn expose(&self, seed: u64) -> Vec<f32> {
        let mut random = SplitMix(seed);
        let mut out = Vec::with_capacity(self.mean.len() + 1);
        for pair in self.mean.chunks(2) {
            for (mean, normal) in pair.iter().zip(random.normals()) {
                out.push((mean + (mean.max(0.0) + self.read * self.read).sqrt() * normal) as f32);
            }
        }
        out
    }
}
