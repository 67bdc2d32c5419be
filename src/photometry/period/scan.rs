//! Power on an even grid of frequencies, in bands: the sums of [`super::harmonic`] come from [`super::nufft`], harmonic h of
//! a band from frequencies h times as far apart. A band turns the data by its middle frequency first, so memory is that
//! of one band, and no precision is lost at high frequencies.

use super::harmonic::Fit;
use super::nufft::Nufft;
use super::sample::Sample;
use super::turn::{Complex, turn};

/// Largest band: 2^15 frequencies, whose grids stay within a processor's cache.
const LARGEST_BAND: u32 = 15;

/// An even grid of frequencies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// The lowest \[Hz\].
    pub first_hz: f64,
    /// Distance \[Hz\].
    pub step_hz: f64,
    /// How many.
    pub count: usize,
}

impl Grid {
    /// Frequency number i.
    pub fn frequency(&self, i: usize) -> f64 {
        self.step_hz.mul_add(i as f64, self.first_hz)
    }

    /// The highest \[Hz\].
    pub fn last_hz(&self) -> f64 {
        self.frequency(self.count.saturating_sub(1))
    }
}

/// Powers on a grid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectrum {
    /// Of one harmonic.
    pub single: Vec<f64>,
    /// Of all harmonics.
    pub multi: Vec<f64>,
    /// Spectral window |C_1|^2.
    pub window: Vec<f64>,
}

/// Powers of one and of `harmonics` harmonics at all frequencies of a grid. They differ from those of direct sums by less than
/// 1e-8, and by less than 1e-3 where the functions depend on each other: with gaps, at periods longer than the pieces.
pub fn scan(sample: &Sample, grid: &Grid, harmonics: usize) -> Spectrum {
    let bits = usize::BITS - grid.count.max(1).leading_zeros();
    let nufft = Nufft::new(bits.min(LARGEST_BAND));
    let band = nufft.size();
    let mut fit = Fit::new(harmonics);
    let (mut grid_w, mut grid_y) = (nufft.grid(), nufft.grid());
    let mut c = vec![Vec::new(); 2 * harmonics + 1];
    let mut y = vec![Vec::new(); harmonics + 1];
    let mut spectrum = Spectrum::default();
    for start in (0..grid.count).step_by(band) {
        let middle_hz = grid.frequency(start + band / 2);
        let steps = sample.t.iter().map(|t| turn(middle_hz * t)).collect::<Vec<_>>();
        let mut turned = sample.w.iter().map(|w| Complex { re: *w, im: 0.0 }).collect::<Vec<_>>();
        for h in 1..=2 * harmonics {
            grid_w.fill(Complex::default());
            grid_y.fill(Complex::default());
            let points = turned.iter_mut().zip(&steps).zip(sample.t.iter().zip(&sample.y));
            for ((z, step), (t, value)) in points {
                *z *= *step;
                let at = nufft.footprint(h as f64 * grid.step_hz * t);
                nufft.spread(&mut grid_w, &at, *z);
                if h <= harmonics {
                    nufft.spread(&mut grid_y, &at, z.scale(*value));
                }
            }
            nufft.finish(&mut grid_w, &mut c[h]);
            if h <= harmonics {
                nufft.finish(&mut grid_y, &mut y[h]);
            }
        }
        for k in 0..band.min(grid.count - start) {
            fit.c[0] = Complex { re: 1.0, im: 0.0 };
            fit.c.iter_mut().zip(&c).skip(1).for_each(|(to, from)| *to = from[k]);
            fit.y.iter_mut().zip(&y).skip(1).for_each(|(to, from)| *to = from[k]);
            fit.solve();
            spectrum.single.push(fit.power(1, sample));
            spectrum.multi.push(fit.power(harmonics, sample));
            spectrum.window.push(fit.c[1].norm_sqr());
        }
    }
    spectrum
}
