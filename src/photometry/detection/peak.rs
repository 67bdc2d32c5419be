//! Local maxima of a significance map, placed by a quadratic through 3 x 3 of its values.
//!
//! Along a long trail neighbours differ little, and across it much; in the map's coordinates, upright along the trail, the
//! quadratic's mixed term is what leans.

use glam::DVec2;

/// More maxima are not kept: the weakest go.
const MOST: usize = 400_000;
/// Pixels looked at together.
const LANES: usize = 32;

/// A maximum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peak {
    /// Place on the frame \[px\].
    pub x: f32,
    /// Place on the frame \[px\].
    pub y: f32,
    /// Significance at the highest place of the lattice.
    pub s: f32,
    /// How much higher it is between.
    pub rise: f32,
}

impl Peak {
    pub fn place(&self) -> DVec2 {
        DVec2::new(f64::from(self.x), f64::from(self.y))
    }

    pub fn new(place: DVec2, s: f32, rise: f64) -> Self {
        Self { x: place.x as f32, y: place.y as f32, s, rise: rise as f32 }
    }
}

/// Maxima and samples of a map.
#[derive(Debug, Clone)]
pub(super) struct Peaks {
    /// Maxima, in the order of rows.
    pub maxima: Vec<Peak>,
    /// The map at a lattice of places.
    pub samples: Vec<Peak>,
    /// The least significance kept.
    pub lowest: f32,
}

impl Peaks {
    pub fn new(lowest: f32) -> Self {
        Self { maxima: Vec::new(), samples: Vec::new(), lowest }
    }

    /// Add the maxima of the middle one of three rows, each with the columns by which it is moved against it. `place`
    /// tells where on the frame a column is, moved by a share of a column and of a row.
    #[inline(always)]
    pub fn search(&mut self, rows: [(&[f32], i64); 3], place: impl Fn(usize, f64, f64) -> DVec2) {
        let row = rows[1].0;
        for (c, chunk) in row.chunks(LANES).enumerate() {
            let mut any = false;
            for value in chunk {
                any |= *value > self.lowest;
            }
            if !any {
                continue;
            }
            for (i, value) in chunk.iter().enumerate().filter(|(_, v)| **v > self.lowest) {
                let x = c * LANES + i;
                if let Some(around) = summit(&rows, x, *value) {
                    let (dx, dy, rise) = quadratic(&around);
                    self.maxima.push(Peak::new(place(x, dx, dy), *value, rise));
                }
            }
        }
        if self.maxima.len() > MOST {
            let keep = MOST / 2;
            self.maxima.select_nth_unstable_by(keep, |a, b| b.s.total_cmp(&a.s));
            self.maxima.truncate(keep);
            self.lowest = self.maxima.iter().map(|p| p.s).fold(f32::INFINITY, f32::min);
        }
    }
}

/// The 3 x 3 values about column `x`, if the middle is their highest.
#[inline(always)]
fn summit(rows: &[(&[f32], i64); 3], x: usize, value: f32) -> Option<[[f64; 3]; 3]> {
    let mut around = [[0.0; 3]; 3];
    for (j, (row, moved)) in rows.iter().enumerate() {
        for (i, out) in around[j].iter_mut().enumerate() {
            let at = usize::try_from(x as i64 + i as i64 - 1 - moved).ok()?;
            let other = *row.get(at)?;
            // of equal ones the last counts
            let before = j > 1 || (j == 1 && i > 1);
            if other > value || (before && other == value) {
                return None;
            }
            *out = f64::from(other);
        }
    }
    Some(around)
}

/// Summit of the least squares quadratic through 3 x 3 values: offsets of column and row, and height above the middle.
fn quadratic(v: &[[f64; 3]; 3]) -> (f64, f64, f64) {
    let column = |i: usize| v[0][i] + v[1][i] + v[2][i];
    let row = |j: usize| v[j][0] + v[j][1] + v[j][2];
    let (fx, fy) = ((column(2) - column(0)) / 6.0, (row(2) - row(0)) / 6.0);
    let (fxx, fyy) = ((column(2) + column(0) - 2.0 * column(1)) / 3.0, (row(2) + row(0) - 2.0 * row(1)) / 3.0);
    let fxy = 0.25 * (v[2][2] + v[0][0] - v[2][0] - v[0][2]);
    let determinant = fxx * fyy - fxy * fxy;
    let (mut dx, mut dy) = ((fxy * fy - fyy * fx) / determinant, (fxy * fx - fxx * fy) / determinant);
    if !(fxx < 0.0 && determinant > 0.0 && dx.abs() <= 1.0 && dy.abs() <= 1.0) {
        let alone = |f: f64, ff: f64| if ff < 0.0 { (-f / ff).clamp(-0.5, 0.5) } else { 0.0 };
        (dx, dy) = (alone(fx, fxx), alone(fy, fyy));
    }
    (dx, dy, (0.5 * (fx * dx + fy * dy)).max(0.0))
}
