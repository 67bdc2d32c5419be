//! Fitted fluxes and places against the information limit, on frames drawn by another road.

use super::extract::{Choice, extract};
use super::frame::Frame;
use super::growth::Psf;
use super::profile::Shape;
use super::segment::Segment;
use super::synthetic::{self, Camera, Source};
use super::zeropoint::ZeroPoint;
use glam::DVec2;

/// Side of the frames, which is what the bound's background is known from \[px\].
const MARGIN: f64 = 24.0;

struct Case {
    camera: Camera,
    source: Segment,
    width: usize,
    height: usize,
    /// Share of the light in each pixel.
    share: Vec<f64>,
}

impl Case {
    fn new(camera: Camera, half: DVec2, place: DVec2) -> Self {
        let size = 2.0 * (half.abs() + MARGIN) + 1.0;
        let (width, height) = (size.x as usize, size.y as usize);
        let centre = DVec2::new(width as f64, height as f64) * 0.5 - 0.5;
        let source = Segment { centre: centre.round() + place, half };
        let dark = Camera { sky_e: 0.0, ..camera.clone() };
        let share = synthetic::mean_electrons(&dark, width, height, &[Source { segment: source, flux_e: 1.0 }]);
        Self { camera, source, width, height, share }
    }

    fn variance(&self, flux: f64) -> impl Iterator<Item = f64> {
        let c = &self.camera;
        let floor = c.sky_e + c.read_noise_e.powi(2) + c.gain * c.gain / 12.0;
        self.share.iter().map(move |p| p * flux + floor)
    }

    /// Cramer-Rao bound of the flux's standard deviation, flux and level unknown \[e\].
    fn bound(&self, flux: f64) -> f64 {
        let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
        for (p, v) in self.share.iter().zip(self.variance(flux)) {
            (a, b, c) = (a + p * p / v, b + 1.0 / v, c + p / v);
        }
        (a - c * c / b).sqrt().recip()
    }

    /// Bound of the place along x and y, which a symmetric image leaves uncorrelated with flux and level \[px\].
    fn place_bound(&self, flux: f64) -> DVec2 {
        let moved = |offset: DVec2| {
            let dark = Camera { sky_e: 0.0, ..self.camera.clone() };
            let segment = self.source.at(self.source.centre + offset);
            synthetic::mean_electrons(&dark, self.width, self.height, &[Source { segment, flux_e: flux }])
        };
        let slope = |axis: DVec2| {
            let (a, b) = (moved(axis * 0.05), moved(axis * -0.05));
            a.into_iter().zip(b).map(|(a, b)| (a - b) / 0.1).collect::<Vec<_>>()
        };
        let (x, y) = (slope(DVec2::X), slope(DVec2::Y));
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for ((x, y), v) in x.iter().zip(&y).zip(self.variance(flux)) {
            (xx, xy, yy) = (xx + x * x / v, xy + x * y / v, yy + y * y / v);
        }
        let det = xx * yy - xy * xy;
        DVec2::new(yy / det, xx / det).map(f64::sqrt)
    }

    fn flux_of(&self, snr: f64) -> f64 {
        let (mut low, mut high) = (0.0, 1e9);
        for _ in 0..80 {
            let middle: f64 = 0.5 * (low + high);
            if middle / self.bound(middle) < snr { low = middle } else { high = middle }
        }
        high
    }

    fn frames(&self, flux: f64, count: u64) -> impl Iterator<Item = Frame> {
        let mean = self.share.iter().map(|p| p * flux + self.camera.sky_e).collect::<Vec<_>>();
        (0..count).map(move |seed| synthetic::develop(&self.camera, self.width, self.height, 77 + seed, &mean))
    }
}

fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

struct Outcome {
    /// Mean error over the bound.
    bias: f64,
    relative_bias: f64,
    /// Variance over that of the bound.
    variance: f64,
    /// Told variance over the true one.
    told: f64,
    /// Variance of the place over its bound, x and y.
    place: DVec2,
}

fn outcome(case: &Case, snr: f64, count: u64, free: bool) -> Outcome {
    let psf = Psf::known(case.camera.shape, case.camera.fwhm);
    let flux = case.flux_of(snr);
    let bound = case.bound(flux);
    let choice = Choice { free, joint: false, flat_rms: 0.0 };
    let (mut fluxes, mut told, mut xs, mut ys) = (vec![], vec![], vec![], vec![]);
    for frame in case.frames(flux, count) {
        let e = extract(&frame, &psf, &case.source, &[], &ZeroPoint::NONE, &choice).expect("a flux");
        fluxes.push(e.flux_e);
        told.push((e.budget.total().powi(2) - e.budget.share.powi(2)).sqrt());
        xs.push(e.centre.x);
        ys.push(e.centre.y);
    }
    let (mean, sigma) = moments(&fluxes);
    let place = if free {
        let bound = case.place_bound(flux);
        DVec2::new((moments(&xs).1 / bound.x).powi(2), (moments(&ys).1 / bound.y).powi(2))
    } else {
        DVec2::NAN
    };
    Outcome {
        bias: (mean - flux) / bound,
        relative_bias: mean / flux - 1.0,
        variance: (sigma / bound).powi(2),
        told: (moments(&told).0 / sigma).powi(2),
        place,
    }
}

#[test]
#[ignore = "minutes: the table against the bound"]
fn table_against_the_bound() {
    for (name, shape) in [("gauss", Shape::Moffat { inverse_beta: 0.0 }), ("kolmo", Shape::Kolmogorov)] {
        for fwhm in [2.0, 3.5] {
            for half in [DVec2::ZERO, DVec2::new(2.5, 0.4), DVec2::new(12.0, 5.0)] {
                let camera = Camera { shape, fwhm, ..Camera::default() };
                let case = Case::new(camera, half, DVec2::new(0.31, -0.17));
                for snr in [5.0, 30.0, 1000.0] {
                    for free in [false, true] {
                        let o = outcome(&case, snr, 600, free);
                        println!(
                            "{name} {fwhm} {:5.1} px snr {snr:5} free {free:5}: bias {:+.3} sigma {:+.5}, variance {:.3}, told {:.3}, place {:.3} {:.3}",
                            2.0 * half.length(),
                            o.bias,
                            o.relative_bias,
                            o.variance,
                            o.told,
                            o.place.x,
                            o.place.y
                        );
                    }
                }
            }
        }
    }
}
