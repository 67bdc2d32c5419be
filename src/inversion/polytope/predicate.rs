//! Exact signs of the two determinants on which the combinatorics of a polytope rest.
//!
//! A half-space n.x <= h is the row (n, h). Both determinants are first evaluated from differences of rows, which is accurate for
//! neighbouring normals, with a bound on the rounding error; where the bound does not decide, they are evaluated
//! exactly as sums of non-overlapping numbers (Shewchuk 1997, Discrete Comput. Geom. 18, 305, sections 2 and 4). Exactness holds for
//! components that are zero or between 1e-70 and 1e70, which the callers see to.

use glam::DVec3;

use super::plane::{Plane, exact_sum};

/// Bound on rounding per unit of permanent: some 20 roundings of half a unit in the last place, doubled.
const ROUNDING: f64 = 40.0 * f64::EPSILON / 2.0;

/// Relative error of a determinant from which it is evaluated exactly.
const CANCELLED: f64 = 1e-9;

/// det(a, b, c), taken from the two shorter differences: accurate to rounding also where two or all directions are close to each other.
#[inline(always)]
pub fn triple(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let (l, m, n) = (ab.length_squared(), bc.length_squared(), ca.length_squared());
    if m >= l && m >= n {
        a.dot(ca.cross(ab))
    } else if n >= l {
        b.dot(ab.cross(bc))
    } else {
        c.dot(bc.cross(ca))
    }
}

/// Whether det(a, b, c) >= 0, exactly.
#[inline(always)]
pub fn turns_left(a: DVec3, b: DVec3, c: DVec3) -> bool {
    let (b_a, c_a) = (b - a, c - a);
    let value = a.dot(b_a.cross(c_a));
    let bound = ROUNDING * span(a) * span(b_a) * span(c_a);
    if value.abs() > bound { value > 0.0 } else { exact_triple(a, b, c) >= 0.0 }
}

/// Determinant of the rows of four planes: negative when `d` cuts off the vertex where `a`, `b` and `c` (counter-clockwise) meet.
/// Evaluated in floating point from differences of rows, with a bound on its error.
#[inline(always)]
pub fn quadruple(a: &Plane, b: &Plane, c: &Plane, d: &Plane) -> (f64, f64) {
    let (b_n, c_n, d_n) = (b.normal - a.normal, c.normal - a.normal, d.normal - a.normal);
    let (b_h, c_h, d_h) = (b.above(a), c.above(a), d.above(a));
    let (cd, db, bc) = (c_n.cross(d_n), d_n.cross(b_n), b_n.cross(c_n));
    let value = a.normal.dot(cd * b_h + db * c_h + bc * d_h) - a.offset * b_n.dot(cd);
    let (b_s, c_s, d_s) = (span(b_n), span(c_n), span(d_n));
    let mixed = b_h.abs() * c_s * d_s + c_h.abs() * d_s * b_s + d_h.abs() * b_s * c_s;
    (value, ROUNDING * (span(a.normal) * mixed + a.offset.abs() * b_s * c_s * d_s))
}

/// The determinant of four rows, taken from differences from a row of the closest pair, accurate where two normals are nearly parallel, or
/// exactly where its digits cancel.
#[inline(always)]
pub fn fine_quadruple(mut rows: [&Plane; 4]) -> f64 {
    let distance = |p: usize, q: usize| (rows[p].normal - rows[q].normal).length_squared();
    let with = |p: usize| (p + 1..4).map(|q| distance(p, q)).fold(f64::INFINITY, f64::min);
    let nearest = [with(0), with(1), with(2)];
    let base = if nearest[0] <= nearest[1].min(nearest[2]) { 0 } else { 1 + usize::from(nearest[2] < nearest[1]) };
    rows.swap(0, base);
    let (mut value, bound) = quadruple(rows[0], rows[1], rows[2], rows[3]);
    if bound > CANCELLED * value.abs() {
        value = exact_quadruple(rows[0], rows[1], rows[2], rows[3]);
    }
    if base == 0 { value } else { -value }
}

/// Whether the half-space `d` cuts off the vertex where `a`, `b` and `c` (counter-clockwise) meet, exactly.
#[inline(always)]
pub fn cuts_off(a: &Plane, b: &Plane, c: &Plane, d: &Plane) -> bool {
    let (value, bound) = quadruple(a, b, c, d);
    if value.abs() > bound { value < 0.0 } else { exact_quadruple(a, b, c, d) < 0.0 }
}

/// Sum of magnitudes of the components.
#[inline(always)]
fn span(v: DVec3) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// det(a, b, c) to rounding, with its sign.
#[cold]
fn exact_triple(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let mut sum = Expansion::default();
    for (p, q, r) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let minor = minor([b[q], b[r]], [c[q], c[r]]);
        minor.terms().iter().for_each(|&term| sum.add_product(term, a[p]));
    }
    sum.value()
}

/// Determinant of four rows to rounding, with its sign, by Laplace's expansion along pairs of rows.
#[cold]
fn exact_quadruple(a: &Plane, b: &Plane, c: &Plane, d: &Plane) -> f64 {
    let mut sum = Expansion::default();
    let row = |plane: &Plane, h: f64| [plane.normal.x, plane.normal.y, plane.normal.z, h];
    let rows = [a, b, c, d];
    add_determinant(&mut sum, rows.map(|plane| row(plane, plane.offset)));
    if rows.iter().any(|plane| plane.tail != 0.0) {
        // linear in the column of offsets
        add_determinant(&mut sum, rows.map(|plane| row(plane, plane.tail)));
    }
    sum.value()
}

/// Adds the determinant of four rows.
fn add_determinant(sum: &mut Expansion, [a, b, c, d]: [[f64; 4]; 4]) {
    // pairs of columns, their complements, the sign of the permutation
    let pairs = [
        (0, 1, 2, 3, 1.0),
        (0, 2, 1, 3, -1.0),
        (0, 3, 1, 2, 1.0),
        (1, 2, 0, 3, 1.0),
        (1, 3, 0, 2, -1.0),
        (2, 3, 0, 1, 1.0),
    ];
    for (p, q, r, s, sign) in pairs {
        let upper = minor([a[p], a[q]], [b[p], b[q]]);
        let lower = minor([c[r], c[s]], [d[r], d[s]]);
        for &u in upper.terms() {
            lower.terms().iter().for_each(|&l| sum.add_product(sign * u, l));
        }
    }
}

/// u0 v1 - u1 v0, exactly.
fn minor(u: [f64; 2], v: [f64; 2]) -> Expansion {
    let mut sum = Expansion::default();
    sum.add_product(u[0], v[1]);
    sum.add_product(-u[1], v[0]);
    sum
}

/// Most numbers a sum needs: twice six products of two minors of four numbers each, two numbers a product.
const MOST: usize = 384;

/// A sum of numbers that do not overlap, smallest first, zeros left out.
struct Expansion {
    terms: [f64; MOST],
    len: usize,
}

impl Default for Expansion {
    fn default() -> Self {
        Self { terms: [0.0; MOST], len: 0 }
    }
}

impl Expansion {
    fn terms(&self) -> &[f64] {
        &self.terms[..self.len]
    }

    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        // exact: the rounding error of a product is representable
        self.add(a.mul_add(b, -product));
        self.add(product);
    }

    /// Shewchuk's GROW-EXPANSION with elimination of zeros.
    fn add(&mut self, value: f64) {
        let (mut carried, mut kept) = (value, 0);
        for k in 0..self.len {
            let term = self.terms[k];
            let (sum, error) = exact_sum(carried, term);
            carried = sum;
            if error != 0.0 {
                self.terms[kept] = error;
                kept += 1;
            }
        }
        if carried != 0.0 && kept < MOST {
            self.terms[kept] = carried;
            kept += 1;
        }
        self.len = kept;
    }

    /// The sum to rounding, with its sign.
    fn value(&self) -> f64 {
        self.terms().iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(x: f64, y: f64, z: f64, h: f64) -> Plane {
        Plane::new(DVec3::new(x, y, z), h)
    }

    #[test]
    fn one_unit_in_the_last_place_decides() {
        let (x, y, z) = (plane(1.0, 0.0, 0.0, 1.0), plane(0.0, 1.0, 0.0, 1.0), plane(0.0, 0.0, 1.0, 1.0));
        let slant = |h: f64| plane(0.5, 0.25, 0.125, h);
        let touching: f64 = 0.875;
        assert!(!cuts_off(&x, &y, &z, &slant(touching)));
        assert!(cuts_off(&x, &y, &z, &slant(touching.next_down())));
        assert!(!cuts_off(&x, &y, &z, &slant(touching.next_up())));
        assert!(cuts_off(&x, &y, &z, &slant(touching).moved(-1e-25)));
        assert!(!cuts_off(&x, &y, &z, &slant(touching).moved(1e-25)));
    }

    #[test]
    fn exact_and_filtered_signs_agree_with_integers() {
        // rows of small integers: i64 arithmetic is the independent reference
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 61) as i64) - 4
        };
        let mut zeros = 0;
        for _ in 0..20_000 {
            let rows: [[i64; 4]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| draw()));
            let minor = |skip: usize, r: [usize; 3]| {
                let c: Vec<usize> = (0..4).filter(|&k| k != skip).collect();
                let m = |i: usize, j: usize| rows[r[i]][c[j]];
                m(0, 0) * (m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1))
                    - m(0, 1) * (m(1, 0) * m(2, 2) - m(1, 2) * m(2, 0))
                    + m(0, 2) * (m(1, 0) * m(2, 1) - m(1, 1) * m(2, 0))
            };
            let four: i64 = (0..4).map(|c| [1, -1][c % 2] * rows[0][c] * minor(c, [1, 2, 3])).sum();
            let [a, b, c, d] = rows.map(|r| plane(r[0] as f64, r[1] as f64, r[2] as f64, r[3] as f64));
            assert_eq!(cuts_off(&a, &b, &c, &d), four < 0, "{rows:?}");
            assert_eq!(turns_left(a.normal, b.normal, c.normal), minor(3, [0, 1, 2]) >= 0, "{rows:?}");
            zeros += usize::from(four == 0);
        }
        assert!(zeros > 100, "degenerate rows were drawn");
    }
}
