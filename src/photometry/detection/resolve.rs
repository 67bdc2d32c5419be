//! Which maxima are sources: the strongest one explains what all filters answer to its light, and so on.
//!
//! A source of significance S lets another filter answer S c(d) at the distance d, c from the model of both
//! ([`Kernel::answer`]). A maximum is a source of its own if it is above the threshold after the answers to all
//! stronger sources are taken off, 20 % larger than modelled or with the wings of real images. So a point does not
//! appear along a trail, nor a trail about a point; and a faint point beside or on a faint trail does.
//!
//! Two more rules keep stars out of the others. A star of significance S answers a point's filter S c more or less
//! sqrt(2 (1 - c)): a point must be the stronger by [`DOUBT`] of these deviations less the mean difference. And a
//! star's trail without a maximum of its own, beside a brighter one, is looked for in pieces: the mean answer m of a
//! point's filter along it, less what is explained, makes a star of significance m / c, which the other must exceed.
//!
//! Saturated images are flat, and their wings begin at the border of what is flat.

use super::kernel::Kernel;
use super::peak::Peak;
use glam::DVec2;

/// Error allowed of modelled answers: images are no Gaussians.
const TOLERANCE: f64 = 1.2;
/// Deviations by which a target must differ from a star.
const DOUBT: f64 = 4.0;
/// Answers below this are of no account \[standard deviations\].
const LEAST: f64 = 0.3;
/// Cells in which sources are looked up \[px\].
const CELL: f64 = 32.0;
/// Answers farther off are not looked for \[px\].
const FARTHEST: f64 = 300.0;
/// Share of the light that is others' at which a source is blended.
const BLENDED: f64 = 0.1;
/// Answer of a point's filter to a star, above which its trail is not looked at in pieces.
const SHORT: f64 = 0.6;
/// Distance of pieces of a trail \[standard deviations of the image\].
const APART: f64 = 2.5;
/// A point's filter answers that much more to a saturated blob than to a trail that gives its significance.
const BLOB: f64 = 1.2;
/// Pieces of a trail at most.
const PIECES: f64 = 32.0;

/// What is asked of the frame.
pub(super) trait Pixels {
    /// Significance that a point's filter, as wide as a star's images, answers at a place.
    fn point(&self, place: DVec2) -> f64;

    /// Radius to which the frame is saturated about a place \[px\]; 0 if it is not.
    fn saturated(&self, place: DVec2) -> f64;
}

/// A source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Claim {
    /// Its kernel.
    pub kind: usize,
    pub place: DVec2,
    /// Significance without others' light.
    pub own: f64,
    /// Significance of others' light.
    pub light: f64,
    /// Radius to which it is saturated \[px\].
    radius: f64,
    /// Significance that it would have if all of its trail were on the frame.
    whole: f64,
    pub blended: bool,
}

/// The maxima of one kernel's map, and the least significance of a source.
pub(super) struct Kind<'a> {
    pub kernel: &'a Kernel,
    pub maxima: &'a [Peak],
    pub threshold: f64,
}

/// The sources among maxima of a frame of `size` (columns, rows); the first kind are the stars. `pixels` are
/// the frame's.
pub(super) fn sources(kinds: &[Kind], size: [usize; 2], pixels: &impl Pixels) -> Vec<Claim> {
    let mut order = Vec::new();
    for (kind, of) in kinds.iter().enumerate() {
        let likeness =
            if kind == 0 { 1.0 } else { kinds[0].kernel.answer(of.kernel, DVec2::ZERO).clamp(0.0, 1.0) };
        let doubt = |s: f64| (DOUBT * (2.0 * (1.0 - likeness)).sqrt() - s * (1.0 - likeness)).max(0.0);
        let strong = of.maxima.iter().filter(|p| f64::from(p.s) >= of.threshold);
        order.extend(strong.map(|p| (f64::from(p.s) - doubt(f64::from(p.s)), kind, *p)));
    }
    let place = |a: &Peak, b: &Peak| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x));
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(place(&a.2, &b.2)));
    let mut field = Field::new(kinds, size);
    for (_, kind, peak) in order {
        field.consider(kind, peak, pixels);
    }
    field.claims
}

/// The filter of a point as wide as a star's images, and what it answers to a star.
fn with_answer(star: &Kernel) -> (Kernel, f64) {
    let point = star.point();
    let answer = star.answer(&point, DVec2::ZERO);
    (point, answer)
}

/// The sources found so far.
struct Field<'a> {
    kinds: &'a [Kind<'a>],
    size: [usize; 2],
    columns: usize,
    rows: usize,
    /// Sources that matter in each cell, the strongest first.
    cells: Vec<Vec<u32>>,
    claims: Vec<Claim>,
    /// The longest trail along each axis.
    longest: DVec2,
    /// Answers of each kind's filter in the middle of each kind's source.
    centres: Vec<Vec<f64>>,
    /// A point's filter, and its answer to a star.
    point: Option<(Kernel, f64)>,
}

impl<'a> Field<'a> {
    fn new(kinds: &'a [Kind<'a>], size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(|n| (n as f64 / CELL) as usize + 1);
        let longest = kinds.iter().fold(DVec2::ZERO, |h, k| h.max(k.kernel.half().abs()));
        let centres = |of: &Kind| kinds.iter().map(|k| of.kernel.answer(k.kernel, DVec2::ZERO)).collect();
        Self {
            kinds,
            size,
            columns,
            rows,
            cells: vec![Vec::new(); columns * rows],
            claims: Vec::new(),
            longest,
            centres: kinds.iter().map(centres).collect(),
            point: kinds.first().map(|star| with_answer(star.kernel)),
        }
    }

    /// The cell of a coordinate; what is outside belongs to the border.
    fn index(x: f64, n: usize) -> usize {
        ((x / CELL).max(0.0) as usize).min(n - 1)
    }

    fn near(&self, place: DVec2) -> usize {
        Self::index(place.y, self.rows) * self.columns + Self::index(place.x, self.columns)
    }

    fn consider(&mut self, kind: usize, peak: Peak, pixels: &impl Pixels) {
        let (place, raw, of) = (peak.place(), f64::from(peak.s), &self.kinds[kind]);
        let cell = self.near(place);
        let mut most = 0.0;
        // most maxima are explained by wings at once, which cost little
        for other in self.cells[cell].iter().map(|i| &self.claims[*i as usize]) {
            most += self.wings(other, kind, place);
            if raw - most < of.threshold {
                return;
            }
        }
        let (mut light, mut most) = (0.0, 0.0);
        for other in self.cells[cell].iter().map(|i| &self.claims[*i as usize]) {
            let kernel = self.kinds[other.kind].kernel;
            let mean = kernel.answer(of.kernel, place - other.place);
            light += other.whole * mean;
            most += self.wings(other, kind, place).max(other.whole * TOLERANCE * mean);
        }
        let own = raw + f64::from(peak.rise) - light;
        let radius = pixels.saturated(place);
        if raw - most < of.threshold || (kind > 0 && self.is_star(of.kernel, place, own, radius, pixels)) {
            return;
        }
        let whole = own / of.kernel.share_inside(place, self.size).max(0.1).sqrt();
        for i in &self.cells[cell] {
            let other = &mut self.claims[*i as usize];
            let mean = of.kernel.answer(self.kinds[other.kind].kernel, other.place - place);
            other.blended |= whole * mean > BLENDED * other.own;
        }
        self.claims.push(Claim { kind, place, own, light, radius, whole, blended: light > BLENDED * raw });
        self.enter();
    }

    /// The most that the wings of a source may give to the filter of a kind. The answer to a saturated one is anyone's.
    fn wings(&self, source: &Claim, kind: usize, place: DVec2) -> f64 {
        let centre = self.centres[source.kind][kind];
        let centre = if source.radius > 0.0 { TOLERANCE * centre.max(1.0) } else { centre };
        let kernel = self.kinds[source.kind].kernel;
        source.whole * centre * kernel.wing(self.kinds[kind].kernel, place - source.place, source.radius)
    }

    /// Whether what another kernel found is rather a star: a piece of its trail, or saturated and as wide as long.
    fn is_star(&self, kernel: &Kernel, place: DVec2, own: f64, radius: f64, pixels: &impl Pixels) -> bool {
        let Some((point, _)) = &self.point else { return false };
        let blob = radius > 0.0 && kernel.half().length() > self.kinds[0].kernel.half().length();
        (blob && pixels.point(place) > BLOB * own * kernel.answer(point, DVec2::ZERO))
            || self.is_piece(place, own, pixels)
    }

    /// Whether a star's trail through `place`, of light that is not explained, is more significant than `own`.
    fn is_piece(&self, place: DVec2, own: f64, pixels: &impl Pixels) -> bool {
        let Some((filter, answer)) = self.point.as_ref().filter(|(_, answer)| *answer < SHORT) else {
            return false;
        };
        let trail = self.kinds[0].kernel.half() * 2.0;
        let count = (trail.length() / (APART * filter.sigma)).clamp(2.0, PIECES).round() as i64;
        let rest = |j: i64| {
            let beside = place + trail * (j as f64 / count as f64);
            let others = self.cells[self.near(beside)].iter().map(|i| &self.claims[*i as usize]);
            let known = others.map(|o| o.whole * self.kinds[o.kind].kernel.answer(filter, beside - o.place));
            pixels.point(beside) - known.sum::<f64>()
        };
        let rest = (1 - count..count).map(rest).collect::<Vec<_>>();
        rest.windows(count as usize).any(|w| w.iter().sum::<f64>() > own * answer * count as f64)
    }

    /// Enter the last source in the cells where it matters.
    fn enter(&mut self) {
        let Some(claim) = self.claims.last() else { return };
        let kernel = self.kinds[claim.kind].kernel;
        let reach = (claim.radius + kernel.wing_reach(LEAST / claim.whole)).max(6.0 * kernel.sigma).min(FARTHEST);
        let extent = kernel.half().abs() + self.longest + reach;
        let (from, to) = (claim.place - extent, claim.place + extent);
        let number = (self.claims.len() - 1) as u32;
        for row in Self::index(from.y, self.rows)..=Self::index(to.y, self.rows) {
            for column in Self::index(from.x, self.columns)..=Self::index(to.x, self.columns) {
                let middle = (DVec2::new(column as f64, row as f64) + 0.5) * CELL;
                let border = row == 0 || column == 0 || row + 1 == self.rows || column + 1 == self.columns;
                if border || kernel.touches(self.longest, middle - claim.place, reach + CELL) {
                    self.cells[row * self.columns + column].push(number);
                }
            }
        }
    }
}
