//! From a raw frame to one of light alone: bias, dark and flat, and the noise that their masters add.
//!
//! ```text
//! corrected = (raw - bias - s dark) / flat,   s = exposure / exposure of the dark
//! ```
//!
//! (Howell 2006, Handbook of CCD Astronomy, ch. 4.) The masters' own errors go into every frame in the same
//! way: they are independent between pixels, but the same from frame to frame, so they do not average out over a
//! series in which the target stays on its pixels. With sigma_B, sigma_D, sigma_F the masters' errors, and the
//! same master bias in frame and dark,
//!
//! ```text
//! variance = ((1 - s)^2 sigma_B^2 + s^2 sigma_D^2) / flat^2 + (signal sigma_F / flat)^2   [adu^2]
//! ```
//!
//! where (1 - s)^2 is 1 if the dark has no error of this bias in it. The frame's own noise is divided by flat^2 as
//! well; the gain of a corrected frame is that of the raw one times flat, on average the same.

use super::response::Response;
use std::ops::Range;

/// A flat at or below this gives no light that could be measured.
pub const DEAD_FLAT: f32 = 0.05;
/// Frame and dark may differ by this temperature \[K\]: dark current doubles every 6 K or so, which makes 12 %
/// here.
pub const TEMPERATURES_AGREE_K: f64 = 1.0;

/// Pixels looked at for a median over a frame.
const SAMPLE: usize = 200_000;

/// What keeps frames from being reduced.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// A frame or master has other dimensions than the rest, or another number of pixels than its dimensions say.
    #[error("{what}: {found:?} (columns, rows or pixels) instead of {wanted:?}")]
    Size {
        /// What it is.
        what: &'static str,
        /// What it has.
        found: Vec<usize>,
        /// What it should have.
        wanted: Vec<usize>,
    },
    /// A value out of its range.
    #[error("{what} = {value}: {allowed}")]
    Value {
        /// What it is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A band of rows could not be read.
    #[error("frame {frame}, rows {rows:?}: {reason}")]
    Read {
        /// Number of the frame, from 0.
        frame: usize,
        /// The rows.
        rows: Range<usize>,
        /// What the reader says.
        reason: String,
    },
}

/// A quantity of each pixel, or the same for all.
#[derive(Debug, Clone, PartialEq)]
pub enum Spread {
    /// The same for all.
    Same(f32),
    /// One value a pixel, row by row from y = 0.
    Each(Vec<f32>),
}

impl Spread {
    /// Value of the pixel with that index; NaN beyond the last.
    pub fn at(&self, index: usize) -> f64 {
        match self {
            Self::Same(value) => f64::from(*value),
            Self::Each(values) => values.get(index).map_or(f64::NAN, |v| f64::from(*v)),
        }
    }
}

/// A master frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Master {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Value of each pixel, row by row from y = 0: adu, or 1 for a flat of median 1. NaN: not known.
    pub value: Vec<f32>,
    /// Standard error of the values, in their unit.
    pub error: Spread,
}

impl Master {
    fn value(&self, index: usize) -> f64 {
        self.value.get(index).map_or(f64::NAN, |v| f64::from(*v))
    }

    fn check(&self, what: &'static str) -> Result<(), ReduceError> {
        let [width, height] = self.size;
        let wrong = |found: usize| {
            let wanted = vec![width, height];
            Err(ReduceError::Size { what, found: vec![found], wanted })
        };
        if Some(self.value.len()) != width.checked_mul(height) {
            return wrong(self.value.len());
        }
        match &self.error {
            Spread::Each(errors) if errors.len() != self.value.len() => wrong(errors.len()),
            _ => Ok(()),
        }
    }
}

/// The level of a pixel without light and time.
#[derive(Debug, Clone, PartialEq)]
pub enum Bias {
    /// The same for all pixels \[adu\], exact.
    Level(f64),
    /// A master bias \[adu\].
    Master(Master),
}

impl Bias {
    pub(super) fn value(&self, index: usize) -> f64 {
        match self {
            Self::Level(level) => *level,
            Self::Master(master) => master.value(index),
        }
    }

    fn error(&self, index: usize) -> f64 {
        match self {
            Self::Level(_) => 0.0,
            Self::Master(master) => master.error.at(index),
        }
    }
}

/// A master dark, its bias subtracted.
#[derive(Debug, Clone, PartialEq)]
pub struct Dark {
    /// Dark signal \[adu\] in `exptime_s`, and its error without that of the bias.
    pub master: Master,
    /// Exposure \[s\], above 0.
    pub exptime_s: f64,
    /// Temperature of the chip \[deg C\], if known.
    pub temperature_c: Option<f64>,
    /// The bias subtracted from it is that of the calibration: both errors are one.
    pub shares_bias: bool,
}

/// Masters for the frames of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    size: [usize; 2],
    bias: Bias,
    dark: Option<Dark>,
    flat: Option<Master>,
    response: Option<Response>,
}

/// What a calibration must know of a frame besides its pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure {
    /// Exposure time \[s\], 0 or more.
    pub exptime_s: f64,
    /// Temperature of the chip \[deg C\], if known.
    pub temperature_c: Option<f64>,
    /// Raw value at and above which a pixel is saturated \[adu\]; infinite if unknown.
    pub saturate_adu: f64,
}

/// What became of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Applied {
    /// Indices (y width + x) of the pixels that were saturated, ascending; their values are corrected like all
    /// others, so that no level tells them any more.
    pub saturated: Vec<usize>,
    /// Number of pixels that are NaN now: they were, a master is, or the flat is dead there.
    pub bad: usize,
    /// Temperature of the frame less that of the dark \[K\], where it is more than [`TEMPERATURES_AGREE_K`] either
    /// way.
    pub warmer_than_dark_k: Option<f64>,
}

impl Applied {
    /// True if the pixel with that index (y width + x) was saturated.
    pub fn is_saturated(&self, index: usize) -> bool {
        self.saturated.binary_search(&index).is_ok()
    }
}

/// How finely extra variance is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Medians over the frame: two numbers.
    Median,
    /// Each pixel: two planes.
    EachPixel,
}

/// The variance that masters add to a corrected frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    size: [usize; 2],
    /// Of bias and dark, over flat^2 \[adu^2\].
    fixed: Spread,
    /// Square of the flat's relative error.
    relative: Spread,
}

impl Extra {
    /// Variance \[adu^2\] of a pixel whose corrected signal (sky and source) is `signal_adu`; NaN off the frame
    /// and where a master is.
    pub fn variance(&self, x: usize, y: usize, signal_adu: f64) -> f64 {
        if x >= self.size[0] || y >= self.size[1] {
            return f64::NAN;
        }
        let index = y * self.size[0] + x;
        self.fixed.at(index) + signal_adu * signal_adu * self.relative.at(index)
    }
}

impl Calibration {
    /// A calibration of frames of `size` (columns, rows); without dark or flat, none is applied. The flat has
    /// median 1.
    ///
    /// # Errors
    /// [`ReduceError`] for masters of other dimensions, a bias level that is not finite, or a dark whose exposure
    /// is not above 0.
    pub fn new(
        size: [usize; 2],
        bias: Bias,
        dark: Option<Dark>,
        flat: Option<Master>,
    ) -> Result<Self, ReduceError> {
        let fits = |what: &'static str, master: &Master| {
            master.check(what)?;
            if master.size == size {
                return Ok(());
            }
            Err(ReduceError::Size { what, found: master.size.to_vec(), wanted: size.to_vec() })
        };
        match &bias {
            Bias::Level(level) if !level.is_finite() => {
                return Err(ReduceError::Value { what: "bias level", value: *level, allowed: "finite" });
            }
            Bias::Level(_) => {}
            Bias::Master(master) => fits("master bias", master)?,
        }
        if let Some(dark) = &dark {
            fits("master dark", &dark.master)?;
            dark_exposure(dark.exptime_s)?;
        }
        if let Some(flat) = &flat {
            fits("master flat", flat)?;
        }
        let response = flat.as_ref().map(|flat| Response::of(size[0], &flat.value));
        Ok(Self { size, bias, dark, flat, response })
    }

    /// How the chip responds over its area; none without a flat.
    pub fn response(&self) -> Option<&Response> {
        self.response.as_ref()
    }

    /// Exposure over that of the dark; 0 without a dark.
    fn scale(&self, exptime_s: f64) -> Result<f64, ReduceError> {
        exposure(exptime_s)?;
        Ok(self.dark.as_ref().map_or(0.0, |dark| exptime_s / dark.exptime_s))
    }

    fn flat(&self, index: usize) -> f64 {
        self.flat.as_ref().map_or(1.0, |flat| {
            let value = flat.value(index);
            if value > f64::from(DEAD_FLAT) { value } else { f64::NAN }
        })
    }

    /// Correct a raw frame \[adu\] in place.
    ///
    /// # Errors
    /// [`ReduceError`] for another number of pixels, or an exposure that is negative or not finite; the frame is
    /// as it was.
    pub fn apply(&self, data: &mut [f32], exposure: &Exposure) -> Result<Applied, ReduceError> {
        let pixels = self.size[0] * self.size[1];
        if data.len() != pixels {
            let (found, wanted) = (vec![data.len()], self.size.to_vec());
            return Err(ReduceError::Size { what: "frame", found, wanted });
        }
        let scale = self.scale(exposure.exptime_s)?;
        let (mut saturated, mut bad) = (Vec::new(), 0);
        for (index, pixel) in data.iter_mut().enumerate() {
            let raw = f64::from(*pixel);
            if raw >= exposure.saturate_adu {
                saturated.push(index);
            }
            let dark = self.dark.as_ref().map_or(0.0, |dark| scale * dark.master.value(index));
            let corrected = (raw - self.bias.value(index) - dark) / self.flat(index);
            bad += usize::from(corrected.is_nan());
            *pixel = corrected as f32;
        }
        let dark_temperature = self.dark.as_ref().and_then(|dark| dark.temperature_c);
        let warmer = exposure.temperature_c.zip(dark_temperature).map(|(frame, dark)| frame - dark);
        let warmer_than_dark_k = warmer.filter(|k| k.abs() > TEMPERATURES_AGREE_K);
        Ok(Applied { saturated, bad, warmer_than_dark_k })
    }

    /// What the masters add to the variance of a corrected frame of `exptime_s`.
    ///
    /// # Errors
    /// [`ReduceError::Value`] for an exposure that is negative or not finite.
    pub fn extra(&self, exptime_s: f64, detail: Detail) -> Result<Extra, ReduceError> {
        let scale = self.scale(exptime_s)?;
        let shared = self.dark.as_ref().is_some_and(|dark| dark.shares_bias);
        let bias_share = if shared { 1.0 - scale } else { 1.0 };
        let fixed = |index: usize| {
            let dark = self.dark.as_ref().map_or(0.0, |dark| scale * dark.master.error.at(index));
            let bias = bias_share * self.bias.error(index);
            (bias * bias + dark * dark) / self.flat(index).powi(2)
        };
        let relative = |index: usize| {
            let error = self.flat.as_ref().map_or(0.0, |flat| flat.error.at(index));
            (error / self.flat(index)).powi(2)
        };
        let pixels = self.size[0] * self.size[1];
        let spread = |of: &dyn Fn(usize) -> f64| match detail {
            Detail::EachPixel => Spread::Each((0..pixels).map(|index| of(index) as f32).collect()),
            Detail::Median => Spread::Same(sampled_median(pixels, of) as f32),
        };
        Ok(Extra { size: self.size, fixed: spread(&fixed), relative: spread(&relative) })
    }
}

pub(super) fn exposure(exptime_s: f64) -> Result<(), ReduceError> {
    if exptime_s.is_finite() && exptime_s >= 0.0 {
        return Ok(());
    }
    Err(ReduceError::Value { what: "exposure [s]", value: exptime_s, allowed: "0 or more" })
}

pub(super) fn dark_exposure(exptime_s: f64) -> Result<(), ReduceError> {
    if exptime_s.is_finite() && exptime_s > 0.0 {
        return Ok(());
    }
    Err(ReduceError::Value { what: "exposure of the dark [s]", value: exptime_s, allowed: "above 0" })
}

/// Step through a frame's pixels that looks at no more than [`SAMPLE`] of them, at all columns in turn.
pub(super) fn sample_step(pixels: usize) -> usize {
    // odd, so that no even period of a chip's structure is hit at one phase only
    (pixels / SAMPLE) | 1
}

/// Median of finite values of the frame's pixels, of a sample of them; NaN if there are none.
pub(super) fn sampled_median(pixels: usize, of: impl Fn(usize) -> f64) -> f64 {
    let mut values: Vec<f64> =
        (0..pixels).step_by(sample_step(pixels)).map(of).filter(|v| v.is_finite()).collect();
    median(&mut values)
}

/// Median of numbers, which it sorts in part; NaN of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    let n = values.len();
    if n == 0 {
        return f64::NAN;
    }
    let (below, upper, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return *upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    0.5 * (lower + *upper)
}
