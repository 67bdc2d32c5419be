//! The background of a whole frame: a mesh of clipped means, interpolated bilinearly.
//!
//! A cell is the mean of its pixels within 4 standard deviations of itself, iterated from the median and the lower
//! quartile, which is free of stars, of 256 of them. Of all pixels, not of a sample: an error of d standard deviations
//! of a pixel in the background moves a trail's significance by d times the root of the pixels it covers.
//! Cells lifted by stars are levelled by the median of 3 x 3 cells (Bertin & Arnouts 1996, A&AS 117, 393, sect. 3), each
//! first brought to the middle along the gradient, which is the median of the differences between these cells: so a
//! gradient is left as it is, at the borders too. What bends over the whole frame is taken off before and put back after:
//! the quadratic in x and y through all cells, outliers cut at 3 standard deviations. Beyond the outermost middles
//! the mesh goes on straight.
//!
//! Faint stars below the clipping lift a mean: give the stars found as masks to have them taken out.

use super::{DetectionError, Plane, within};
use crate::base::simd::Path;
use crate::photometry::segment::Segment;
use glam::DVec2;

/// Width of the clipping \[standard deviations\].
const CLIP_SIGMA: f32 = 4.0;
/// Numbers summed side by side.
const LANES: usize = 16;
/// Pixels of a cell that give its median and quartile at first.
const SAMPLE: usize = 256;
/// Steps of clipping at most.
const STEPS: usize = 12;

/// Pixels to leave out: all within `radius_px` of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mask {
    /// The source's middle and trail \[px\].
    pub segment: Segment,
    /// Distance up to which pixels are left out \[px\].
    pub radius_px: f64,
}

impl Mask {
    /// Columns of the row at height `y` that are masked: from and to, empty if from > to.
    pub(super) fn chord(&self, y: f64) -> (f64, f64) {
        let (centre, half, r) = (self.segment.centre, self.segment.half, self.radius_px);
        let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
        let mut add = |from: f64, to: f64| {
            if from <= to {
                ends = (ends.0.min(from), ends.1.max(to));
            }
        };
        for end in [centre - half, centre + half] {
            let square = r * r - (y - end.y) * (y - end.y);
            if square >= 0.0 {
                add(end.x - square.sqrt(), end.x + square.sqrt());
            }
        }
        // the band beside the segment, between the perpendiculars through its ends
        let length = half.length();
        if length > 0.0 {
            let e = half / length;
            let dy = y - centre.y;
            let solve = |slope: f64, offset: f64, limit: f64| {
                if slope.abs() < 1e-9 {
                    let all = (f64::NEG_INFINITY, f64::INFINITY);
                    return if offset.abs() <= limit { all } else { (0.0, -1.0) };
                }
                let (a, b) = ((-limit - offset) / slope, (limit - offset) / slope);
                (a.min(b), a.max(b))
            };
            let (across, along) = (solve(e.y, -dy * e.x, r), solve(e.x, dy * e.y, length));
            let (from, to) = (across.0.max(along.0), across.1.min(along.1));
            add(centre.x + from, centre.x + to);
        }
        ends
    }
}

/// Mean, scatter and count of a cell's clipped pixels.
#[derive(Debug, Clone, Copy)]
struct Cell {
    mean: f64,
    sigma: f64,
    n: f64,
}

const NO_CELL: Cell = Cell { mean: f64::NAN, sigma: f64::NAN, n: 0.0 };

/// Background, scatter and error of the background over a frame.
#[derive(Debug, Clone)]
pub struct Mesh {
    columns: usize,
    rows: usize,
    /// Columns and rows of pixels a cell.
    cell: DVec2,
    mean: Vec<f64>,
    sigma: Vec<f64>,
    error: Vec<f64>,
}

/// The background of a frame in cells of about `cell_px` \[px\], 8 to 4096, without the pixels of `masks`. Pixel values
/// are multiples of `step` (1 for adu, 0 if they are not quantised), at least 0: neither the clipping nor the
/// scatter is narrower than the quantisation.
///
/// # Errors
/// If a number is beyond its range.
pub fn background(plane: Plane, cell_px: usize, step: f64, masks: &[Mask]) -> Result<Mesh, DetectionError> {
    let cell_px = within("cell_px", cell_px as f64, 8.0, 4096.0)?;
    let step = within("step", step, 0.0, f64::from(f32::MAX))?;
    let count = |size: usize| ((size as f64 / cell_px).round() as usize).max(1);
    let (columns, rows) = (count(plane.width), count(plane.height));
    let cell = DVec2::new(plane.width as f64 / columns as f64, plane.height as f64 / rows as f64);
    let edge = |i: usize, n: usize, size: usize| i * size / n;
    let buckets = buckets(plane, columns, rows, cell, masks);
    let mut cells = Vec::with_capacity(columns * rows);
    let mut values = Vec::new();
    for row in 0..rows {
        let (top, bottom) = (edge(row, rows, plane.height), edge(row + 1, rows, plane.height));
        for column in 0..columns {
            let (left, right) = (edge(column, columns, plane.width), edge(column + 1, columns, plane.width));
            values.clear();
            for y in top..bottom {
                values.extend_from_slice(plane.row(y).get(left..right).unwrap_or(&[]));
            }
            for mask in buckets[row * columns + column].iter().map(|i| &masks[*i as usize]) {
                blank(&mut values, mask, [left, right], [top, bottom]);
            }
            cells.push(Path::best().run(
                #[inline(always)]
                || clipped(&values, step as f32),
            ));
        }
    }
    let raw = |of: fn(&Cell) -> f64| cells.iter().map(of).collect::<Vec<_>>();
    let mean = raw(|c| c.mean);
    let trend = trend(&mean, columns, rows);
    let flat = mean.iter().zip(&trend).map(|(m, t)| m - t).collect::<Vec<_>>();
    let mean = levelled(&flat, columns, rows).0.iter().zip(&trend).map(|(m, t)| m + t).collect();
    let (sigma, _) = levelled(&raw(|c| c.sigma), columns, rows);
    let (square, used) = levelled(&raw(|c| c.sigma * c.sigma / c.n), columns, rows);
    // variance of the median of n, against that of one: exact for one and for many, within 2 % between
    let shrink = |n: usize| std::f64::consts::PI / (2.0 * n as f64 + std::f64::consts::PI - 2.0);
    let error = square.iter().zip(used).map(|(s, n)| (s * shrink(n.max(1))).sqrt()).collect();
    Ok(Mesh {
        columns,
        rows,
        cell,
        mean,
        sigma: sigma.iter().map(|s| if *s < step / 12f64.sqrt() { step / 12f64.sqrt() } else { *s }).collect(),
        error,
    })
}

/// For each cell the masks that may reach into it.
fn buckets(plane: Plane, columns: usize, rows: usize, cell: DVec2, masks: &[Mask]) -> Vec<Vec<u32>> {
    let mut buckets = vec![Vec::new(); columns * rows];
    let span = |middle: f64, reach: f64, cell: f64, n: usize, size: usize| {
        // `as` maps NaN to 0 and clamps what overflows
        let first = ((middle - reach).floor().max(0.0) / cell) as usize;
        let last = ((middle + reach).ceil().min(size as f64) / cell + 1.0).max(0.0) as usize;
        first.min(n)..last.min(n)
    };
    for (i, mask) in masks.iter().enumerate() {
        let reach = mask.segment.half.abs() + mask.radius_px + 1.0;
        if !(reach.is_finite() && mask.segment.centre.is_finite()) {
            continue;
        }
        for row in span(mask.segment.centre.y, reach.y, cell.y, rows, plane.height) {
            for column in span(mask.segment.centre.x, reach.x, cell.x, columns, plane.width) {
                buckets[row * columns + column].push(i as u32);
            }
        }
    }
    buckets
}

/// Make the pixels of a cell within a mask missing.
fn blank(values: &mut [f32], mask: &Mask, [left, right]: [usize; 2], [top, bottom]: [usize; 2]) {
    let reach = mask.segment.half.y.abs() + mask.radius_px;
    let first = (mask.segment.centre.y - reach).ceil().max(top as f64) as usize;
    let last = ((mask.segment.centre.y + reach).floor() + 1.0).clamp(0.0, bottom as f64) as usize;
    for y in first..last {
        let (from, to) = mask.chord(y as f64);
        let from = (from.ceil().max(left as f64) as usize).min(right);
        let to = ((to.floor() + 1.0).max(0.0) as usize).min(right);
        if let Some(row) = values.get_mut((y - top) * (right - left)..(y + 1 - top) * (right - left)) {
            row.get_mut(from - left..to.max(from) - left).unwrap_or(&mut []).fill(f32::NAN);
        }
    }
}

/// Mean and scatter of the pixels of a cell, clipped.
#[inline(always)]
fn clipped(values: &[f32], step: f32) -> Cell {
    let mut sample = [0f32; SAMPLE];
    let mut count = 0;
    // an odd stride takes all columns in turn
    let stride = (values.len() / SAMPLE) | 1;
    for value in values.iter().step_by(stride).filter(|v| v.is_finite()).take(SAMPLE) {
        sample[count] = *value;
        count += 1;
    }
    // most of the cell is missing: look at all of it
    if count < SAMPLE / 4 && stride > 1 {
        count = 0;
        for value in values.iter().filter(|v| v.is_finite()).take(SAMPLE) {
            sample[count] = *value;
            count += 1;
        }
    }
    if count < 8 {
        return NO_CELL;
    }
    let sample = &mut sample[..count];
    let median = *sample.select_nth_unstable_by(count / 2, f32::total_cmp).1;
    let quarter = *sample.select_nth_unstable_by(count / 4, f32::total_cmp).1;
    let spread = ((median - quarter) / 0.6745).max(step);
    let (mut shift, mut width) = (0.0, 6.0 * spread);
    let mut cell = NO_CELL;
    for _ in 0..STEPS {
        let [n, first, second] = moments(values, median, shift, width);
        if n < 8.0 || n == cell.n {
            break;
        }
        let mean = first / n;
        let sigma = ((second - first * mean) / (n - 1.0)).max(0.0).sqrt();
        cell = Cell { mean: f64::from(median) + mean, sigma, n };
        (shift, width) = (mean as f32, (CLIP_SIGMA * sigma as f32).max(step));
    }
    cell
}

/// Count, sum and sum of squares of `value - origin` where it is within `width` of `shift`.
#[inline(always)]
fn moments(values: &[f32], origin: f32, shift: f32, width: f32) -> [f64; 3] {
    let (mut n, mut first, mut second) = ([0f32; LANES], [0f32; LANES], [0f32; LANES]);
    let (chunks, rest) = values.as_chunks::<LANES>();
    for chunk in chunks {
        for i in 0..LANES {
            let d = chunk[i] - origin;
            let inside = (d - shift).abs() <= width;
            let d = if inside { d } else { 0.0 };
            n[i] += if inside { 1.0 } else { 0.0 };
            first[i] += d;
            second[i] += d * d;
        }
    }
    for value in rest {
        let d = value - origin;
        if (d - shift).abs() <= width {
            n[0] += 1.0;
            first[0] += d;
            second[0] += d * d;
        }
    }
    [n, first, second].map(|lanes| lanes.iter().map(|v| f64::from(*v)).sum())
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// The quadratic through cells, by projections on polynomials that are orthogonal on the grid; outliers are cut.
fn trend(cells: &[f64], columns: usize, rows: usize) -> Vec<f64> {
    const ROUNDS: usize = 8;
    let centred = |i: usize, n: usize| i as f64 - 0.5 * (n - 1) as f64;
    let square = |n: usize| (0..n).map(|i| centred(i, n).powi(2)).sum::<f64>() / n as f64;
    let (x2, y2) = (square(columns), square(rows));
    let basis = |i: usize| {
        let (x, y) = (centred(i % columns, columns), centred(i / columns, rows));
        [1.0, x, y, x * y, x * x - x2, y * y - y2]
    };
    let mut norm = [0.0; 6];
    for i in 0..cells.len() {
        norm.iter_mut().zip(basis(i)).for_each(|(n, b)| *n += b * b);
    }
    let middle = median(&mut cells.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>());
    let mut trend = vec![middle; cells.len()];
    for _ in 0..ROUNDS {
        let rest = cells.iter().zip(&trend).map(|(v, t)| v - t).collect::<Vec<_>>();
        let mut sizes = rest.iter().map(|r| r.abs()).filter(|r| r.is_finite()).collect::<Vec<_>>();
        let limit = 3.0 * 1.4826 * median(&mut sizes);
        let mut sum = [0.0; 6];
        for (i, rest) in rest.iter().enumerate().filter(|(_, r)| r.is_finite() && limit.is_finite()) {
            let rest = rest.clamp(-limit, limit);
            sum.iter_mut().zip(basis(i)).for_each(|(s, b)| *s += rest * b);
        }
        for (i, trend) in trend.iter_mut().enumerate() {
            let term = |k: usize| if norm[k] > 0.0 { sum[k] / norm[k] } else { 0.0 };
            *trend += basis(i).iter().enumerate().map(|(k, b)| b * term(k)).sum::<f64>();
        }
    }
    trend
}

/// Each cell's median over itself and its neighbours along the gradient, and how many they are; cells without value
/// take the median of all.
fn levelled(cells: &[f64], columns: usize, rows: usize) -> (Vec<f64>, Vec<usize>) {
    let all = median(&mut cells.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>());
    let (mut levels, mut counts) = (Vec::with_capacity(cells.len()), Vec::with_capacity(cells.len()));
    let (mut near, mut dx, mut dy) = (Vec::new(), Vec::new(), Vec::new());
    for row in 0..rows {
        for column in 0..columns {
            near.clear();
            dx.clear();
            dy.clear();
            let (r1, c1) = ((row + 2).min(rows), (column + 2).min(columns));
            for r in row.saturating_sub(1)..r1 {
                for c in column.saturating_sub(1)..c1 {
                    let value = cells[r * columns + c];
                    near.push((value, c as f64 - column as f64, r as f64 - row as f64));
                    if c + 1 < c1 {
                        dx.push(cells[r * columns + c + 1] - value);
                    }
                    if r + 1 < r1 {
                        dy.push(cells[(r + 1) * columns + c] - value);
                    }
                }
            }
            let slope = |differences: &mut Vec<f64>| {
                differences.retain(|d| d.is_finite());
                if differences.is_empty() { 0.0 } else { median(differences) }
            };
            let (gx, gy) = (slope(&mut dx), slope(&mut dy));
            let flat = near.iter().map(|(v, x, y)| v - gx * x - gy * y).filter(|v| v.is_finite());
            let mut flat = flat.collect::<Vec<_>>();
            counts.push(flat.len());
            levels.push(if flat.is_empty() { all } else { median(&mut flat) });
        }
    }
    (levels, counts)
}

impl Mesh {
    /// Cells: columns and rows.
    pub fn cells(&self) -> [usize; 2] {
        [self.columns, self.rows]
    }

    /// Background at a place \[px\], in units of the pixels; NaN if no pixel was usable.
    pub fn mean(&self, place: DVec2) -> f64 {
        self.interpolate(&self.mean, place)
    }

    /// Standard deviation of a pixel at a place.
    pub fn sigma(&self, place: DVec2) -> f64 {
        self.interpolate(&self.sigma, place)
    }

    /// Standard error of [`Self::mean`] in the cell of a place \[px\], from the pixels' scatter alone: unresolved light
    /// and what bends within a cell come on top.
    pub fn error(&self, place: DVec2) -> f64 {
        let index = |x: f64, cell: f64, n: usize| (((x + 0.5) / cell).max(0.0) as usize).min(n - 1);
        let column = index(place.x, self.cell.x, self.columns);
        self.error[index(place.y, self.cell.y, self.rows) * self.columns + column]
    }

    /// The same mesh with the scatter of a pixel as a function of the background.
    #[must_use]
    pub(super) fn with_sigma(mut self, sigma: impl Fn(f64) -> f64) -> Self {
        self.sigma = self.mean.iter().map(|m| sigma(*m)).collect();
        self
    }

    /// The mesh of the frame with columns and rows exchanged.
    pub(super) fn transposed(&self) -> Self {
        let turn = |cells: &[f64]| {
            (0..self.columns).flat_map(|c| (0..self.rows).map(move |r| cells[r * self.columns + c])).collect()
        };
        let (mean, sigma, error) = (turn(&self.mean), turn(&self.sigma), turn(&self.error));
        let cell = DVec2::new(self.cell.y, self.cell.x);
        Self { columns: self.rows, rows: self.columns, cell, mean, sigma, error }
    }

    /// The nodes below and above a coordinate, and its share of the way between them.
    fn split(x: f64, cell: f64, n: usize) -> (usize, usize, f64) {
        let x = ((x + 0.5) / cell - 0.5).clamp(-0.5, n as f64 - 0.5);
        let i = (x.max(0.0) as usize).min(n.saturating_sub(2));
        if n < 2 { (0, 0, 0.0) } else { (i, i + 1, x - i as f64) }
    }

    fn interpolate(&self, cells: &[f64], place: DVec2) -> f64 {
        let (x0, x1, fx) = Self::split(place.x, self.cell.x, self.columns);
        let (y0, y1, fy) = Self::split(place.y, self.cell.y, self.rows);
        let at = |x: usize, y: usize| cells[y * self.columns + x];
        let line = |y: usize| at(x0, y) * (1.0 - fx) + at(x1, y) * fx;
        line(y0) * (1.0 - fy) + line(y1) * fy
    }

    /// Background and 1 / scatter at the nodes' columns in row `y`.
    pub(super) fn nodes(&self, y: usize) -> Vec<(f64, f64)> {
        let (y0, y1, fy) = Self::split(y as f64, self.cell.y, self.rows);
        let at = |cells: &[f64], x: usize| {
            cells[y0 * self.columns + x] * (1.0 - fy) + cells[y1 * self.columns + x] * fy
        };
        (0..self.columns).map(|x| (at(&self.mean, x), 1.0 / at(&self.sigma, x))).collect()
    }

    /// Columns of pixels a cell.
    pub(super) fn cell_width(&self) -> f64 {
        self.cell.x
    }
}
