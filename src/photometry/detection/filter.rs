//! The significance map of a frame, row by row.
//!
//! A row of pixels, less the background and divided by its scatter, is blurred by the Gaussian along the row, a band of
//! rows across; running sums along the digital line then need one row more and one less, however long the trail is. They
//! are formed anew once a trail's length, so that rounding does not add up. A missing pixel counts as background.
//! Where the trail leaves the frame the sum is divided by the root of the share inside.
//!
//! Trails longer along x than along y are filtered on the frame with columns and rows exchanged, which is read in strips.
//! No plane of the frame's size is kept: rows of one trail's length, and the maxima.

use super::Plane;
use super::background::Mesh;
use super::kernel::{Kernel, line};
use super::peak::{Peak, Peaks};
use crate::base::simd::Path;
use glam::DVec2;

/// Pixels worked on side by side.
const LANES: usize = 32;
/// Columns exchanged at a time.
const STRIP: usize = 32;
/// Rows exchanged at a time.
const TILE: usize = 16;
/// Beyond this a pixel is no measurement \[standard deviations\].
const ABSURD: f32 = 1e12;
/// Share of a trail that must be inside the frame.
const INSIDE: f64 = 0.1;
/// One sample of the map each so many pixels.
const SAMPLE: usize = 8;

/// Rows of a plane or of its transpose.
struct Rows<'a> {
    plane: Plane<'a>,
    transposed: bool,
    strip: Vec<f32>,
    first: usize,
}

impl Rows<'_> {
    fn size(&self) -> [usize; 2] {
        let Plane { width, height, .. } = self.plane;
        if self.transposed { [height, width] } else { [width, height] }
    }

    fn get(&mut self, y: usize) -> &[f32] {
        if !self.transposed {
            return self.plane.row(y);
        }
        // an odd number of cache lines apart, lest all rows fall on the same place of the cache
        let stride = self.plane.height + STRIP + 1;
        let first = y - y % STRIP;
        if self.strip.is_empty() || self.first != first {
            self.first = first;
            self.strip.resize(STRIP * stride, 0.0);
            let end = (first + STRIP).min(self.plane.width);
            for top in (0..self.plane.height).step_by(TILE) {
                let bottom = (top + TILE).min(self.plane.height);
                for (column, x) in (first..end).enumerate() {
                    let out = &mut self.strip[column * stride + top..column * stride + bottom];
                    for (y, out) in (top..bottom).zip(out) {
                        *out = self.plane.data[y * self.plane.width + x];
                    }
                }
            }
        }
        let start = (y - first) * stride;
        self.strip.get(start..start + self.plane.height).unwrap_or(&[])
    }
}

/// A row less background over scatter; what is missing is 0.
#[inline(always)]
fn normalise(row: &[f32], nodes: &[(f64, f64)], cell: f64, out: &mut [f32]) {
    let n = nodes.len();
    let middle = |i: usize| (i as f64 + 0.5) * cell - 0.5;
    for i in 0..n.saturating_sub(1).max(1) {
        let (a, b) = (nodes[i], nodes[(i + 1).min(n - 1)]);
        let from = if i == 0 { 0 } else { middle(i).ceil() as usize };
        let to = if i + 2 >= n { row.len() } else { (middle(i + 1).ceil() as usize).min(row.len()) };
        let slopes = [(b.0 - a.0) / cell, (b.1 - a.1) / cell];
        let at = from as f64 - middle(i);
        let start = [(a.0 + slopes[0] * at) as f32, (a.1 + slopes[1] * at) as f32];
        let slopes = slopes.map(|s| s as f32);
        let from = from.min(to);
        for (j, (value, out)) in row[from..to].iter().zip(&mut out[from..to]).enumerate() {
            let j = j as i32 as f32;
            let z = (value - (start[0] + slopes[0] * j)) * (start[1] + slopes[1] * j);
            *out = if z.abs() < ABSURD { z } else { 0.0 };
        }
    }
}

/// `out[i] = taps[0] middle[i] + sum_j taps[j] (a_j[i] + b_j[i])`, all of one length.
#[inline(always)]
fn blur(taps: &[f32], middle: &[f32], pairs: &[[&[f32]; 2]], out: &mut [f32]) {
    let (first, taps) = taps.split_first().unwrap_or((&1.0, &[]));
    let (chunks, rest) = out.as_chunks_mut::<LANES>();
    let done = chunks.len() * LANES;
    let middles = middle.as_chunks::<LANES>().0;
    for (c, (chunk, middle)) in chunks.iter_mut().zip(middles).enumerate() {
        let mut sum = [0f32; LANES];
        for i in 0..LANES {
            sum[i] = first * middle[i];
        }
        for (tap, [a, b]) in taps.iter().zip(pairs) {
            let at = c * LANES;
            let (Some(a), Some(b)) = (a[at..].first_chunk::<LANES>(), b[at..].first_chunk::<LANES>()) else {
                break;
            };
            for i in 0..LANES {
                sum[i] += tap * (a[i] + b[i]);
            }
        }
        *chunk = sum;
    }
    for (at, out) in (done..).zip(rest) {
        *out = taps.iter().zip(pairs).fold(first * middle[at], |sum, (tap, [a, b])| sum + tap * (a[at] + b[at]));
    }
}

#[inline(always)]
fn add(sum: &mut [f32], row: &[f32], sign: f32) {
    for (sum, value) in sum.iter_mut().zip(row) {
        *sum += sign * value;
    }
}

/// The rows of a map in a ring.
struct Ring {
    rows: Vec<f32>,
    width: usize,
    count: usize,
}

impl Ring {
    fn new(width: usize, count: usize) -> Self {
        Self { rows: vec![0.0; width * count], width, count }
    }

    fn start(&self, y: i64) -> usize {
        y.rem_euclid(self.count as i64) as usize * self.width
    }

    fn get(&self, y: i64) -> &[f32] {
        let start = self.start(y);
        &self.rows[start..start + self.width]
    }

    fn get_mut(&mut self, y: i64) -> &mut [f32] {
        let start = self.start(y);
        &mut self.rows[start..start + self.width]
    }
}

/// Maxima above `lowest` of the significance map of `plane`, and samples of the map.
pub(super) fn maxima(plane: Plane, mesh: &Mesh, kernel: &Kernel, lowest: f64) -> Peaks {
    let transposed = kernel.transposed;
    let rows = Rows { plane, transposed, strip: Vec::new(), first: 0 };
    let mesh = if transposed { mesh.transposed() } else { mesh.clone() };
    let mut peaks = Peaks::new(lowest as f32);
    if !plane.data.is_empty() {
        Path::best().run(
            #[inline(always)]
            || sweep(rows, &mesh, kernel, &mut peaks),
        );
    }
    peaks
}

#[inline(always)]
fn sweep(mut rows: Rows, mesh: &Mesh, kernel: &Kernel, peaks: &mut Peaks) {
    let [width, height] = rows.size();
    let (l, reach) = (kernel.l as i64, kernel.taps.len() as i64 - 1);
    let sideways = (kernel.slope.abs() * l as f64).ceil() as usize;
    let pad = sideways + reach as usize + 2;
    let padded = width + 2 * pad;
    // sums are of centres from `first` to `last`; the line's pixels reach `l` farther
    let (first, last) = (-l - 1, height as i64 + l);
    let shifts = Shifts::new(kernel.slope, first - l - 1, last + l);
    let mut blurred = Ring::new(padded, 2 * reach as usize + 1);
    let mut band = Ring::new(padded, 2 * l as usize + 2);
    let mut map = Ring::new(padded, 3);
    let mut sums = vec![0f32; padded + shifts.span];
    let mut pixels = vec![0f32; padded + 2 * reach as usize];
    let scale = (1.0 / kernel.norm) as f32;
    for newest in first - l - reach..=last + l + reach {
        // the row at `newest` along the row, the one `reach` before across
        match usize::try_from(newest).ok().filter(|y| *y < height) {
            Some(y) => {
                let start = reach as usize + pad;
                normalise(rows.get(y), &mesh.nodes(y), mesh.cell_width(), &mut pixels[start..start + width]);
                let shifted = |j: i64| &pixels[(reach + j) as usize..][..padded];
                let pairs = (1..=reach).map(|j| [shifted(-j), shifted(j)]).collect::<Vec<_>>();
                blur(&kernel.taps, shifted(0), &pairs, blurred.get_mut(newest));
            }
            None => blurred.get_mut(newest).fill(0.0),
        }
        let ready = newest - reach;
        if ready < first - l {
            continue;
        }
        let pairs = (1..=reach).map(|j| [blurred.get(ready - j), blurred.get(ready + j)]).collect::<Vec<_>>();
        blur(&kernel.taps, blurred.get(ready), &pairs, band.get_mut(ready));
        let centre = ready - l;
        if centre < first {
            continue;
        }
        if (centre - first) % (2 * l + 1) == 0 {
            sums.fill(0.0);
            for y in centre - l..=centre + l {
                add(&mut sums[shifts.at(y)..], band.get(y), 1.0);
            }
        } else {
            add(&mut sums[shifts.at(ready)..], band.get(ready), 1.0);
            let gone = centre - l - 1;
            add(&mut sums[shifts.at(gone)..], band.get(gone), -1.0);
        }
        let row = map.get_mut(centre);
        for (out, sum) in row.iter_mut().zip(&sums[shifts.at(centre)..]) {
            *out = scale * sum;
        }
        if l > 0 {
            edges(row, kernel, centre, [width, height], pad);
        }
        if centre >= first + 2 {
            let y = centre - 1;
            let around = [y - 1, y, y + 1].map(|at| (map.get(at), shifts.at(at) as i64 - shifts.at(y) as i64));
            let turn = |x: f64, y: f64| if kernel.transposed { DVec2::new(y, x) } else { DVec2::new(x, y) };
            let lean = shifts.lean(kernel, y) - pad as f64;
            peaks.search(around, |x, dx, dy| turn(x as f64 + lean + dx + kernel.slope * dy, y as f64 + dy));
            if (0..height as i64).contains(&y) && y as usize % SAMPLE == SAMPLE / 2 {
                let sampled = map.get(y)[pad..pad + width].iter().enumerate().skip(SAMPLE / 2).step_by(SAMPLE);
                peaks.samples.extend(sampled.map(|(x, s)| Peak::new(turn(x as f64, y as f64), *s, 0.0)));
            }
        }
    }
}

/// Columns by which the rows are moved for the trail to stand upright.
struct Shifts {
    first: i64,
    offsets: Vec<usize>,
    span: usize,
    /// Sums of the digital line's distances from the true one.
    errors: Vec<f64>,
}

impl Shifts {
    fn new(slope: f64, first: i64, last: i64) -> Self {
        let most = [first, last].map(|y| line(slope, y)).into_iter().max().unwrap_or(0);
        let offsets = (first..=last).map(|y| (most - line(slope, y)).max(0) as usize).collect::<Vec<_>>();
        let mut sum = 0.0;
        let errors = (first..=last).map(|y| {
            sum += line(slope, y) as f64 - slope * y as f64;
            sum
        });
        let errors = errors.collect();
        let span = offsets.iter().copied().max().unwrap_or(0);
        Self { first, offsets, span, errors }
    }

    fn index(&self, y: i64) -> usize {
        ((y - self.first).max(0) as usize).min(self.offsets.len() - 1)
    }

    fn at(&self, y: i64) -> usize {
        self.offsets[self.index(y)]
    }

    /// Where the middle of the line through pixel (0, `y`) truly is.
    fn lean(&self, kernel: &Kernel, y: i64) -> f64 {
        let l = kernel.l as i64;
        let sum = self.errors[self.index(y + l)] - self.errors[self.index(y - l - 1)];
        sum / (2 * l + 1) as f64 - (line(kernel.slope, y) as f64 - kernel.slope * y as f64)
    }
}

/// Bring the significances of trails that leave the frame to unit variance; nothing of those mostly outside.
fn edges(row: &mut [f32], kernel: &Kernel, y: i64, [width, height]: [usize; 2], pad: usize) {
    let l = kernel.l as f64;
    let (low, high) = ((-y as f64).max(-l), ((height as i64 - 1 - y) as f64).min(l));
    let weight = |low: f64, high: f64| {
        let share = (high - low + 1.0) / (2.0 * l + 1.0);
        if share < INSIDE { 0.0 } else { (1.0 / share.min(1.0).sqrt()) as f32 }
    };
    let plain = weight(low, high);
    if plain != 1.0 {
        row.iter_mut().for_each(|s| *s *= plain);
    }
    if kernel.slope == 0.0 || plain == 0.0 {
        return;
    }
    let margin = pad + (kernel.slope.abs() * l).ceil() as usize + 1;
    let n = row.len();
    for i in (0..margin.min(n)).chain(n.saturating_sub(margin).max(margin)..n) {
        let x = i as f64 - pad as f64;
        let ends = [-x / kernel.slope, (width as f64 - 1.0 - x) / kernel.slope];
        let (from, to) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        row[i] *= weight(low.max(from), high.min(to)) / plain;
    }
}
