//! One exposure of the chip: light in, numbers out, step by step in the order in which light and charge meet them.
//!
//! ```text
//! light     what falls on the pixels, times the evenness of optics and shutter, times each pixel's response   (prnu)
//! mean      + smear of the frame transfer + dark charge                                          (smear, dark)
//! counted   one Poisson draw of the mean, + cosmic rays                                      (shot, cosmic_rays)
//! held      no more than the full well; the excess is lost or runs along its column                        (well)
//! moved     each transfer leaves some charge behind: rows, then columns                                     (cte)
//! read      bent by the output, + read noise                                           (nonlinearity, read_noise)
//! adu       / gain + bias + its structure, rounded, clipped                                       (bias, convert)
//! ```
//!
//! All is computed for any region of the stored frame. Only blooming reaches further than a trail: the columns in which a pixel may
//! be full are kept whole, and the others band by band.

use super::detector::bias::Structure;
use super::detector::convert::{Converter, Number};
use super::detector::cosmic_rays::CosmicRays;
use super::detector::cte::Transfer;
use super::detector::dark::Dark;
use super::detector::{nonlinearity, pattern, prnu, read_noise, shot, smear, well};
use super::evenness::Evenness;
use super::region::Region;
use crate::base::random::{Address, Stage};
use crate::base::simd::Path;
use crate::scene::{Chip as Kind, Detector, Scene};
use rayon::prelude::*;
use std::ops::Range;

/// What falls on the chip during an exposure.
pub trait Incident: Sync {
    /// Add the mean light \[e-\] of the pixels of `region`, by rows.
    fn add(&self, region: &Region, out: &mut [f64]);

    /// The columns in which the mean of some pixel may exceed `level_e`, in ascending order and apart from each other.
    fn bright_columns(&self, level_e: f64) -> Vec<Range<usize>>;
}

/// No light at all.
#[derive(Debug, Clone, Copy)]
pub struct Darkness;

impl Incident for Darkness {
    fn add(&self, _region: &Region, _out: &mut [f64]) {}

    fn bright_columns(&self, _level_e: f64) -> Vec<Range<usize>> {
        Vec::new()
    }
}

/// Rows of a band: about so many pixels, whose means fit the cache of one core.
const BAND_PIXELS: usize = 1 << 16;

/// Rows of a band of so many columns; even, so that a band's bytes are whole words of a checksum.
pub fn band_rows(width: usize) -> usize {
    (BAND_PIXELS / width.max(1)).clamp(2, 4096) & !1
}

/// An exposure of a chip.
pub struct Chip<'c> {
    detector: &'c Detector,
    light: &'c dyn Incident,
    evenness: Evenness,
    /// Pixels that see light: columns, rows.
    size: [usize; 2],
    /// Pixels stored, overscan included.
    stored: [usize; 2],
    address: Address,
    dark: Dark,
    rays: CosmicRays,
    full_well_e: f64,
    /// Charge of each column gained while it is moved; empty without.
    smear: Vec<f64>,
    transfer: Option<[Transfer; 2]>,
    structure: Option<Structure>,
    gains: Option<f64>,
    converter: Converter,
    /// Columns kept whole because charge runs along them.
    strips: Vec<Strip>,
}

/// Columns of a whole frame, after blooming.
struct Strip {
    columns: Range<usize>,
    /// Charge \[e-\], by rows.
    charge: Vec<u32>,
}

/// Working memory of one band.
#[derive(Default)]
pub struct Scratch {
    charge: Vec<f64>,
    moved: Vec<f64>,
    row: Vec<f64>,
    more: Vec<f64>,
}

impl<'c> Chip<'c> {
    /// Frame number `frame` of a scene's chip, `exposure_s` long, under `light`; ready for the pixels of `region`.
    pub fn new(scene: &'c Scene, light: &'c dyn Incident, frame: usize, exposure_s: f64, region: &Region) -> Self {
        let d = &scene.detector;
        let (size, stored) = (d.light_px(), d.stored_px());
        let ccd = d.kind == Kind::Ccd;
        let transfer =
            (ccd && d.cti > 0.0).then(|| [stored[1], stored[0]].map(|most| Transfer::new(d.cti, d.binning, most)));
        let mut chip = Self {
            detector: d,
            light,
            evenness: Evenness::of(scene, exposure_s),
            size,
            stored,
            address: Address { seed: scene.seed, frame: frame as u32, stage: Stage::Shot },
            dark: Dark::new(d, exposure_s),
            rays: CosmicRays::new(d, scene.seed, frame as u32, exposure_s),
            full_well_e: d.stored_full_well_e(),
            smear: Vec::new(),
            transfer,
            structure: (d.bias_structure_adu > 0.0)
                .then(|| Structure::new(d.pattern_seed, d.bias_structure_adu, stored[0])),
            gains: d.cmos_gain_spread.map(|spread| spread / d.binning as f64).filter(|spread| *spread > 0.0),
            converter: Converter::of(d),
            strips: Vec::new(),
        };
        if ccd && d.frame_transfer_s > 0.0 {
            let sums = chip.column_light(&chip.needed(region));
            chip.smear = smear::per_pixel(&sums, size[1], d.frame_transfer_s, exposure_s);
        }
        if ccd && d.blooming {
            chip.strips = chip.bloomed(region);
        }
        chip
    }

    /// The number of a pixel in the whole frame.
    fn number(&self, x: usize, y: usize) -> u64 {
        (y * self.stored[0] + x) as u64
    }

    /// The columns of light that the pixels of `region` depend on.
    fn needed(&self, region: &Region) -> Range<usize> {
        let trail = self.transfer.map_or(0, |[_, along]| along.trail());
        let end = (region.x0 + region.width).min(self.size[0]);
        region.x0.saturating_sub(trail).min(end)..end
    }

    /// Sums over whole columns of the light that falls on them \[e-\]; 0 for the others.
    fn column_light(&self, columns: &Range<usize>) -> Vec<f64> {
        /// Rows summed together: the same for every region, and so the sums.
        const ROWS: usize = 16;
        let (height, width) = (self.size[1], columns.len());
        let mut total = vec![0.0; self.size[0]];
        if width == 0 {
            return total;
        }
        let bands = (0..height).step_by(ROWS).collect::<Vec<_>>();
        let sums = bands.par_iter().map(|y0| {
            let region = Region { x0: columns.start, y0: *y0, width, height: ROWS.min(height - y0) };
            let mut light = vec![0.0; region.len()];
            self.light.add(&region, &mut light);
            self.evenness.apply(&region, &mut light);
            let mut sums = vec![0.0; width];
            for row in light.chunks_exact(width) {
                sums.iter_mut().zip(row).for_each(|(sum, light)| *sum += light);
            }
            sums
        });
        // in order, so that the sums do not depend on the number of threads
        for sums in sums.collect::<Vec<_>>() {
            total[columns.clone()].iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        }
        total
    }

    /// The strips of columns that `region` needs.
    fn bloomed(&self, region: &Region) -> Vec<Strip> {
        let safe = (self.full_well_e - 10.0 * self.full_well_e.sqrt() - 10.0).max(0.0);
        let needed = self.needed(region);
        // of a pixel that responds more than others, by five standard deviations
        let most = 1.0 + 5.0 * self.detector.prnu / self.detector.binning as f64;
        let level = (safe - self.dark.mean_e()) / most;
        let strips = if level <= 0.0 {
            std::iter::once(0..self.size[0]).collect()
        } else {
            self.light.bright_columns(level)
        };
        let touched = strips.into_iter().map(|s| s.start.max(needed.start)..s.end.min(needed.end));
        let full_well = self.full_well_e.min(f64::from(u32::MAX)) as u32;
        touched
            .filter(|columns| !columns.is_empty())
            .map(|columns| {
                let (width, height) = (columns.len(), self.size[1]);
                let mut charge = vec![0u32; width * height];
                let rows = band_rows(width);
                charge.par_chunks_mut(rows * width).enumerate().for_each_init(
                    Scratch::default,
                    |scratch, (band, out)| {
                        let y0 = band * rows;
                        let region = Region { x0: columns.start, y0, width, height: out.len() / width };
                        let mut counted = std::mem::take(&mut scratch.moved);
                        counted.resize(region.len(), 0.0);
                        self.counted(&region, &mut counted, &mut scratch.row);
                        out.iter_mut().zip(&counted).for_each(|(out, charge)| *out = *charge as u32);
                        scratch.moved = counted;
                    },
                );
                let mut column = vec![0; height];
                for x in 0..width {
                    column.iter_mut().zip(charge[x..].iter().step_by(width)).for_each(|(c, q)| *c = *q);
                    well::bloom(&mut column, full_well);
                    charge[x..].iter_mut().step_by(width).zip(&column).for_each(|(q, c)| *q = *c);
                }
                Strip { columns, charge }
            })
            .collect()
    }

    /// Mean charge \[e-\] of the pixels of `region`, which all see light.
    pub fn mean(&self, region: &Region, out: &mut [f64], scratch: &mut Vec<f64>) {
        out.fill(0.0);
        self.light.add(region, out);
        self.evenness.apply(region, out);
        scratch.resize(region.width, 0.0);
        let rms = self.detector.prnu / self.detector.binning as f64;
        for (y, row) in (region.y0..).zip(out.chunks_exact_mut(region.width)) {
            let first = pattern::number(region.x0, y);
            if rms > 0.0 {
                prnu::apply(row, first, self.detector.pattern_seed, rms, scratch);
            }
            if !self.smear.is_empty() {
                row.iter_mut().zip(&self.smear[region.x0..]).for_each(|(value, smear)| *value += smear);
            }
            self.dark.add(row, first, scratch);
        }
    }

    /// Charge \[e-\] of the pixels of `region` before any of it moves.
    fn counted(&self, region: &Region, out: &mut [f64], scratch: &mut Vec<f64>) {
        self.mean(region, out, scratch);
        for (y, row) in (region.y0..).zip(out.chunks_exact_mut(region.width)) {
            shot::apply(row, self.number(region.x0, y), &self.address);
            self.rays.add(row, y, region.x0);
        }
    }

    /// Charge \[e-\] that the pixels of `region` hold when the shutter closes.
    fn held(&self, region: &Region, out: &mut [f64], scratch: &mut Vec<f64>) {
        self.counted(region, out, scratch);
        well::clip(out, self.full_well_e);
        for strip in &self.strips {
            let columns = strip.columns.start.max(region.x0)..strip.columns.end.min(region.x0 + region.width);
            if columns.is_empty() {
                continue;
            }
            let width = strip.columns.len();
            for (y, row) in (region.y0..).zip(out.chunks_exact_mut(region.width)) {
                let from = y * width + columns.start - strip.columns.start;
                let bloomed = &strip.charge[from..from + columns.len()];
                let row = &mut row[columns.start - region.x0..][..columns.len()];
                row.iter_mut().zip(bloomed).for_each(|(value, charge)| *value = f64::from(*charge));
            }
        }
    }

    /// Charge \[e-\] that arrives at the amplifier for the stored pixels of `region`, overscan included; in `scratch.moved`.
    fn arrived(&self, region: &Region, scratch: &mut Scratch) {
        let right = (region.x0 + region.width).min(self.size[0]);
        scratch.moved.clear();
        scratch.moved.resize(region.len(), 0.0);
        let (trail_y, trail_x) = self
            .transfer
            .map_or((0, 0), |[down, along]| (down.trail().min(region.y0), along.trail().min(region.x0)));
        let x0 = (region.x0 - trail_x).min(right);
        let (y0, width) = (region.y0 - trail_y, right - x0);
        if width == 0 {
            return;
        }
        let Some([down, along]) = &self.transfer else {
            if width == region.width {
                return self.held(region, &mut scratch.moved, &mut scratch.row);
            }
            scratch.charge.resize(width * region.height, 0.0);
            self.held(&Region { width, ..*region }, &mut scratch.charge, &mut scratch.row);
            for (row, light) in
                scratch.moved.chunks_exact_mut(region.width).zip(scratch.charge.chunks_exact(width))
            {
                row[..width].copy_from_slice(light);
            }
            return;
        };
        let wide = Region { x0, y0, width, height: region.height + trail_y };
        scratch.charge.resize(wide.len(), 0.0);
        self.held(&wide, &mut scratch.charge, &mut scratch.row);
        scratch.more.resize(width * region.height, 0.0);
        down.rows(&scratch.charge, width, region.y0, trail_y, &mut scratch.more);
        along.columns(&scratch.more, x0, width, region, &mut scratch.moved);
    }

    /// Numbers \[ADU\] of the stored pixels of `region`, by rows.
    pub fn read<N: Number>(&self, region: &Region, out: &mut [N], scratch: &mut Scratch) {
        self.arrived(region, scratch);
        let d = self.detector;
        let read_at = Address { stage: Stage::Read, ..self.address };
        let sigma = d.stored_read_noise_e();
        scratch.row.resize(region.width, 0.0);
        scratch.more.resize(region.width, 0.0);
        let Scratch { moved, row: noise, more, .. } = scratch;
        for (y, (row, out)) in
            (region.y0..).zip(moved.chunks_exact_mut(region.width).zip(out.chunks_exact_mut(region.width)))
        {
            let first = self.number(region.x0, y);
            if d.nonlinearity != 0.0 && self.full_well_e > 0.0 {
                nonlinearity::apply(row, d.nonlinearity, self.full_well_e);
            }
            if let Some(spread) = d.stored_read_noise_spread() {
                let scratch = [&mut noise[..region.width], &mut more[..region.width]];
                read_noise::apply_uneven(
                    row,
                    [first, pattern::number(region.x0, y)],
                    &read_at,
                    sigma,
                    spread,
                    d.pattern_seed,
                    scratch,
                );
            } else {
                read_noise::apply(row, first, &read_at, sigma);
            }
            if self.structure.is_none() && self.gains.is_none() {
                Path::best().run(
                    #[inline(always)]
                    || self.converter.apply(row, out),
                );
                continue;
            }
            let (offsets, gains) = (&mut noise[..region.width], &mut more[..region.width]);
            offsets.fill(0.0);
            if let Some(structure) = &self.structure {
                structure.add(y, region.x0, offsets);
            }
            pattern::factors(
                d.pattern_seed,
                Stage::GainSpread,
                pattern::number(region.x0, y),
                self.gains.unwrap_or(0.0),
                gains,
            );
            self.converter.apply_uneven(row, offsets, gains, out);
        }
    }
}
