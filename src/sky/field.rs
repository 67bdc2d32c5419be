//! The summed sky over a frame: means at nodes, bilinear between them.
//!
//! The grid is refined until the midpoints of its cells agree with direct evaluation within `accuracy.sky`; the
//! reference twin evaluates every pixel ([`SkyField::reference`]).

use super::Source;
use super::context::toward;
use crate::base::simd::Path;
use crate::plan::view::View;
use crate::scene::Scene;
use glam::DVec2;

/// Cells along a side at most; beyond that the remaining error is told by [`SkyField::error`].
const MOST_CELLS: usize = 64;

/// Mean electrons per pixel of the sky over a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct SkyField {
    nodes: Vec<f64>,
    cells: usize,
    size: DVec2,
    /// Largest relative error found at the midpoints of the cells.
    pub error: f64,
    /// Time spent on each source \[s\], by the clock handed in.
    pub seconds: Vec<f64>,
}

impl SkyField {
    /// The sum of `sources` over the frame, to a relative error of `tolerance`. `clock` gives seconds since some moment.
    pub fn new(
        view: &View,
        scene: &Scene,
        sources: &[&dyn Source],
        tolerance: f64,
        clock: &dyn Fn() -> f64,
    ) -> Self {
        let [width, height] = scene.detector.light_px().map(|n| n as f64);
        let size = DVec2::new(width, height);
        let mut seconds = vec![0.0; sources.len()];
        let mut cells = 2;
        loop {
            let mut field = Self::with_cells(view, sources, size, cells, clock);
            seconds.iter_mut().zip(&field.seconds).for_each(|(all, level)| *all += level);
            if field.error <= tolerance || cells >= MOST_CELLS {
                field.seconds = seconds;
                return field;
            }
            cells *= 2;
        }
    }

    /// The field on a grid of `cells` by `cells`, its error measured at the midpoints.
    pub fn with_cells(
        view: &View,
        sources: &[&dyn Source],
        size: DVec2,
        cells: usize,
        clock: &dyn Fn() -> f64,
    ) -> Self {
        let place = |i: usize, j: usize, shift: f64| {
            (DVec2::new(i as f64, j as f64) + shift) / cells as f64 * (size - 1.0)
        };
        let grid = |count: usize| (0..count).flat_map(move |j| (0..count).map(move |i| (i, j)));
        let pixels = grid(cells + 1).map(|(i, j)| place(i, j, 0.0));
        let pixels = pixels.chain(grid(cells).map(|(i, j)| place(i, j, 0.5))).collect::<Vec<_>>();
        let toward = pixels.iter().map(|p| toward(view, *p)).collect::<Vec<_>>();
        let mut values = vec![0.0; pixels.len()];
        let mut seconds = Vec::with_capacity(sources.len());
        for source in sources {
            let began = clock();
            values.iter_mut().zip(&toward).for_each(|(value, t)| *value += source.mean(t));
            seconds.push(clock() - began);
        }
        let midpoints = values.split_off((cells + 1) * (cells + 1));
        let mut field = Self { nodes: values, cells, size, error: 0.0, seconds };
        for (pixel, exact) in pixels[field.nodes.len()..].iter().zip(midpoints) {
            field.error = field.error.max((field.at(*pixel) - exact).abs() / exact.max(1e-12));
        }
        field
    }

    /// The reference twin: the sources summed at a pixel.
    pub fn reference(view: &View, sources: &[&dyn Source], pixel: DVec2) -> f64 {
        let toward = toward(view, pixel);
        sources.iter().map(|s| s.mean(&toward)).sum()
    }

    /// Mean at a pixel \[e-/px\].
    pub fn at(&self, pixel: DVec2) -> f64 {
        let (j, fy) = self.cell(pixel.y, self.size.y);
        let (i, fx) = self.cell(pixel.x, self.size.x);
        let row = |j: usize| {
            let k = j * (self.cells + 1) + i;
            self.nodes[k] + fx * (self.nodes[k + 1] - self.nodes[k])
        };
        row(j) + fy * (row(j + 1) - row(j))
    }

    /// Means of the pixels from `x0` on in row `y`, and `more` \[e-/px\], added to `out`.
    pub fn add_row(&self, y: usize, x0: usize, more: f64, out: &mut [f64]) {
        let (j, fy) = self.cell(y as f64, self.size.y);
        let node = |i: usize| {
            let k = j * (self.cells + 1) + i;
            self.nodes[k] + fy * (self.nodes[k + self.cells + 1] - self.nodes[k])
        };
        let per_pixel = self.cells as f64 / (self.size.x - 1.0).max(1.0);
        // the first pixel beyond cell i
        let end = |i: usize| {
            if i + 1 < self.cells { ((i + 1) as f64 / per_pixel).ceil() as usize } else { usize::MAX }
        };
        let (mut x, mut left) = (x0, out);
        let mut i = self.cell(x as f64, self.size.x).0;
        while i > 0 && x < end(i - 1) {
            i -= 1;
        }
        while !left.is_empty() {
            while x >= end(i) {
                i += 1;
            }
            let (now, later) = left.split_at_mut((end(i) - x).min(left.len()));
            let (value, slope) = (node(i) + more, node(i + 1) - node(i));
            let (first, cell) = (x as i32, i as f64);
            Path::best().run(
                #[inline(always)]
                || {
                    for (k, pixel) in now.iter_mut().enumerate() {
                        let fx = f64::from(first + k as i32) * per_pixel - cell;
                        *pixel += value + fx * slope;
                    }
                },
            );
            x += now.len();
            left = later;
        }
    }

    /// The largest mean at a node \[e-/px\].
    pub fn largest(&self) -> f64 {
        self.nodes.iter().fold(0.0, |most, node| node.max(most))
    }

    /// Columns of the frame.
    pub fn width(&self) -> usize {
        self.size.x as usize
    }

    /// Size of the representation \[bytes\].
    pub fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<f64>()
    }

    fn cell(&self, coordinate: f64, size: f64) -> (usize, f64) {
        let scaled = (coordinate / (size - 1.0).max(1.0) * self.cells as f64).clamp(0.0, self.cells as f64);
        let i = (scaled as usize).min(self.cells - 1);
        (i, scaled - i as f64)
    }
}
