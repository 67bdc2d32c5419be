//! The camera by a header's keywords and its pixels.

use super::list::{List, digits};
use super::{Origin, Source};
use crate::photometry::header::{Quantity, is_active_pixel};

/// Read noise where none is told \[e\]: CCDs and CMOS of astronomical cameras.
const READ_NOISE_E: [f64; 2] = [10.0, 2.0];
/// Highest bias as a share of the converter's range.
const MOST_BIAS: f64 = 0.9;
/// Variance of a unit normal deviate within three standard deviations.
const WITHIN_THREE: f64 = 0.973_34;
/// Scatter at most taken from so many pixels.
const SAMPLE: usize = 400_000;
impl List<'_, '_> {
    pub fn detector(&mut self) {
        let facts = self.source.facts;
        let binning = self.binning();
        let [columns, rows] = self.source.size;
        let trim =
            facts.trim.filter(|t| t.x0 + t.width <= columns && t.y0 + t.height <= rows && t.width * t.height > 0);
        let [width, height] = trim.map_or([columns, rows], |t| [t.width, t.height]);
        let unbinned = |n: usize| toml::Value::Integer(((n.max(1) as f64 * binning) as i64).clamp(1, 65_536));
        let words = if trim.is_some() { "TRIMSEC" } else { "NAXIS1, NAXIS2" };
        let times = if binning > 1.0 { format!(" times a binning of {binning}") } else { String::new() };
        let size = toml::Value::Array(vec![unbinned(width), unbinned(height)]);
        self.push("detector.size_px", size, Origin::Keyword, format!("{words}{times}"));
        match self.first(&["XPIXSZ", "PIXSIZE1", "PIXSIZE"], 1e-3, 1000.0 * binning) {
            Some((keyword, um)) => {
                let why = if binning > 1.0 {
                    format!("{keyword} = {um}, which includes the binning of {binning}")
                } else {
                    format!("{keyword} = {um}")
                };
                self.push("detector.pixel_um", digits(um / binning, 5), Origin::Keyword, why);
            }
            None => self.push("detector.pixel_um", 9.0, Origin::FillIn, "no XPIXSZ"),
        }
        let cmos = is_active_pixel(self.source.header);
        let camera = self.source.header.text("INSTRUME").unwrap_or_default().trim().replace(char::is_control, " ");
        if cmos {
            self.push("detector.kind", "cmos", Origin::Keyword, format!("INSTRUME = {camera}"));
        } else {
            self.push("detector.kind", "ccd", Origin::Assumed, "\"cmos\" for an active-pixel chip");
        }
        if binning > 1.0 {
            let why = format!("XBINNING = {binning}; 1 for unbinned frames");
            self.push("detector.binning", binning as i64, Origin::Keyword, why);
        }
        self.quantum_efficiency(&camera, cmos);
        self.levels(cmos, binning);
        let overscan = trim.map_or(0, |t| if t.x0 == 0 { columns - t.width } else { 0 });
        if (1..=4096).contains(&overscan) {
            self.push("detector.overscan_px", overscan as i64, Origin::Keyword, "columns beyond TRIMSEC");
        }
    }

    fn quantum_efficiency(&mut self, camera: &str, cmos: bool) {
        let name = camera.to_ascii_lowercase();
        let chips = [
            ("kaf16803", &["16803"][..]),
            ("e2v230_84", &["e2v230", "230-84"]),
            ("andor_dw936", &["dw936", "ikon-l"]),
            ("thx7899m", &["thx7899"]),
            ("krag2003", &["krag2003"]),
        ];
        match chips.iter().find(|(_, marks)| marks.iter().any(|mark| name.contains(mark))) {
            Some((chip, _)) => self.push("detector.qe", *chip, Origin::Keyword, format!("INSTRUME = {camera}")),
            None => {
                let (chip, like) = if cmos {
                    ("e2v230_84", "a back-illuminated chip")
                } else {
                    ("kaf16803", "a front-illuminated CCD")
                };
                self.push(
                    "detector.qe",
                    chip,
                    Origin::FillIn,
                    format!("no keyword tells it; {like} stands in: a CSV of nm, QE"),
                );
            }
        }
    }

    /// Gain, noise, dark current, bias, full well and bits.
    fn levels(&mut self, cmos: bool, binning: f64) {
        let facts = self.source.facts;
        let top = self.fact(facts.saturate_adu, [0.0, 4.3e9], Quantity::Saturation);
        let bits = bits(self.number("BITPIX"), top.as_ref().map(|t| t.0));
        let gain = self.fact(facts.gain_e_adu, [0.0, 1e6], Quantity::Gain);
        match &gain {
            Some((g, told)) => self.push("detector.gain_e_per_adu", *g, Origin::Keyword, told.clone()),
            None => self.push(
                "detector.gain_e_per_adu",
                1.0,
                Origin::FillIn,
                "no EGAIN; GAIN is a driver's setting in many programs",
            ),
        }
        let g = gain.as_ref().map_or(1.0, |(g, _)| *g);
        let scatter = scatter(self.source);
        let read = self.fact(facts.read_noise_e, [-1e-9, 1e6], Quantity::ReadNoise);
        let typical = READ_NOISE_E[usize::from(cmos)];
        let limit = scatter.map_or(f64::INFINITY, |(_, variance)| variance.sqrt() * g);
        let read_e = match &read {
            Some((r, told)) => {
                self.push(
                    "detector.read_noise_e",
                    *r / if cmos { binning } else { 1.0 },
                    Origin::Keyword,
                    told.clone(),
                );
                *r
            }
            None => {
                let r = typical.min(limit);
                let most = if limit.is_finite() {
                    format!("; the pixels scatter by {limit:.1} e- with the sky, so no more")
                } else {
                    String::new()
                };
                self.push(
                    "detector.read_noise_e",
                    digits(r, 2),
                    Origin::Assumed,
                    format!("no RDNOISE; usual{most}"),
                );
                r
            }
        };
        match self.first(&["DARKCUR"], 0.0, 1e9) {
            Some((keyword, rate)) => {
                self.push(
                    "detector.dark_e_per_s",
                    digits(rate / (binning * binning), 9),
                    Origin::Keyword,
                    format!("{keyword} = {rate}"),
                );
            }
            None => self.push(
                "detector.dark_e_per_s",
                0.05,
                Origin::Assumed,
                "no keyword tells it; e- a second and pixel at this temperature",
            ),
        }
        let chip = self.fact(facts.ccd_temp_c, [-273.15, 100.0], Quantity::Temperature);
        let (temperature, origin, why) = match chip {
            Some((t, told)) => (digits(t, 2), Origin::Keyword, told),
            None => (-10.0, Origin::Assumed, "no CCD-TEMP".into()),
        };
        self.push("detector.dark_temperature_c", temperature, origin, format!("{why}: where dark_e_per_s holds"));
        self.push("detector.temperature_c", temperature, origin, why);
        let bias = self.bias(g, gain.is_some(), read_e, MOST_BIAS * (libm::exp2(f64::from(bits)) - 1.0));
        let full = (libm::exp2(f64::from(bits)) - 1.0).min(top.as_ref().map_or(f64::INFINITY, |t| t.0));
        let well = ((full - bias).max(1.0) * g).min(1e12);
        let (level, told) = top.map_or((full, format!("the top of {bits} bits")), |(level, told)| (level, told));
        let why = format!("saturation at {level} adu ({told}) less the bias, times the gain");
        self.push("detector.full_well_e", digits(well, 0), Origin::Keyword, why);
        self.push("detector.bits", i64::from(bits), Origin::Keyword, "BITPIX and the saturation");
    }

    /// Bias level \[adu\], `most` at most.
    fn bias(&mut self, gain: f64, known: bool, read_e: f64, most: f64) -> f64 {
        let facts = self.source.facts;
        if let Some((level, told)) = self.fact(facts.bias_adu, [-1e-9, most], Quantity::Bias) {
            self.push("detector.bias_adu", level, Origin::Keyword, told);
            return level;
        }
        let Some((background, variance)) = scatter(self.source) else {
            let level = digits((0.1 * most).min(1000.0), 0);
            self.push("detector.bias_adu", level, Origin::FillIn, "no BIASLVL and no pixels that tell it");
            return level;
        };
        let level = digits(
            (background - gain * variance + read_e * read_e / gain).clamp(0.0, background.clamp(0.0, most)),
            1,
        );
        let gain_known = if known { "" } else { " and a gain of 1" };
        let why = format!(
            "no BIASLVL; the background of {background:.1} adu scatters by {:.2} adu, which is sky above this level with the read noise above{gain_known}: bias and sky \
             cannot be told apart otherwise",
            variance.sqrt()
        );
        self.push("detector.bias_adu", level, Origin::Pixels, why);
        level
    }
}

/// Bits of the converter.
fn bits(bitpix: Option<f64>, saturate: Option<f64>) -> u32 {
    let converter = |level: f64| {
        [8u32, 10, 12, 14, 16].into_iter().find(|n| ((level + 1.0) / libm::exp2(f64::from(*n)) - 1.0).abs() < 0.02)
    };
    match (bitpix, saturate.and_then(converter)) {
        (Some(8.0), _) => 8,
        (_, Some(bits)) => bits,
        (Some(32.0), None) if saturate.is_some_and(|s| s > 70_000.0) => 32,
        _ => 16,
    }
}

/// Median of the pixels \[adu\], and the variance of one by the differences of neighbours \[adu^2\]; none where they do not tell it.
fn scatter(source: &Source) -> Option<(f64, f64)> {
    let width = source.size[0];
    let step = (source.data.len() / SAMPLE).max(1) | 1;
    let mut values = Vec::new();
    let mut differences: Vec<f64> = Vec::new();
    for at in (0..source.data.len().saturating_sub(1)).step_by(step) {
        let (a, b) = (f64::from(source.data[at]), f64::from(source.data[at + 1]));
        if (at + 1) % width.max(1) != 0 && a.is_finite() && b.is_finite() {
            values.push(a);
            differences.push((a - b).abs());
        }
    }
    let median = |list: &mut Vec<f64>| {
        let middle = list.len() / 2;
        (list.len() > 100).then(|| *list.select_nth_unstable_by(middle, f64::total_cmp).1)
    };
    let (level, off) = (median(&mut values)?, median(&mut differences)?);
    // the median size of a normal deviate; whole numbers make it coarse, so that the rms within three deviations follows
    let mut deviation = off.max(0.5) / 0.674_489_75;
    for _ in 0..4 {
        let near = differences.iter().filter(|d| **d <= 3.0 * deviation);
        let (sum, count) = near.fold((0.0, 0.0f64), |(sum, count), d| (sum + d * d, count + 1.0));
        deviation = (sum / count.max(1.0) / WITHIN_THREE).sqrt();
    }
    // two pixels make a difference, and each was rounded
    let variance = 0.5 * deviation * deviation - 1.0 / 12.0;
    (variance > 0.0).then_some((level, variance))
}
