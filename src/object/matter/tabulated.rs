//! A measured BRDF: values on a grid of angles, linear between them.
//!
//! The file is CSV with the columns theta_s_deg, theta_o_deg, phi_deg, f_sr in any order, named by the first line
//! that is no comment (#): angles of the Sun and of the observer from the normal, 0 to 90, and the azimuth
//! between them, 0 back towards the Sun to 180 on the mirror's side; f in 1/sr. The rows, in any order, fill a
//! rectilinear grid; beyond it the nearest value holds.
//!
//! Measurements are reciprocal to their error only. The table made from them is exactly so: on the union of both
//! grids of theta it holds (f(s, o) + f(o, s))/2, which trilinear interpolation reproduces at all angles.

use super::{Material, Model, Real, directional_albedo};
use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Columns of the file.
const COLUMNS: [&str; 4] = ["theta_s_deg", "theta_o_deg", "phi_deg", "f_sr"];
/// Greatest f accepted \[1/sr\]: the peak of a lobe 1e-4 rad wide is 1e8.
const BRIGHTEST: f64 = 1e9;
/// Most values held.
const MOST: usize = 10_000_000;
/// Error of the quadrature of the albedo.
const ALBEDO_TOLERANCE: f64 = 1e-4;

/// A reciprocal table of f.
#[derive(Clone, PartialEq)]
pub struct Table {
    /// Angles from the normal \[rad\], rising.
    theta: Vec<f64>,
    /// Azimuth differences \[rad\], rising.
    phi: Vec<f64>,
    /// f \[1/sr\] by theta, theta, phi, the last running fastest.
    f: Vec<f64>,
}

/// Why a file is no BRDF.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TableError {
    /// The heading lacks a column.
    #[error("line {line}: no column {column} (the columns are theta_s_deg, theta_o_deg, phi_deg, f_sr)")]
    Column {
        /// Line of the heading, 1 the first; 0 if there is none.
        line: usize,
        /// Its missing column.
        column: &'static str,
    },
    /// Not a number, or outside the range.
    #[error("line {line}: {column} = {value:?} is not a number from {low} to {high}")]
    Value {
        /// Line, 1 the first.
        line: usize,
        /// Column.
        column: &'static str,
        /// What stands there.
        value: String,
        /// Least allowed.
        low: f64,
        /// Greatest allowed.
        high: f64,
    },
    /// The same three angles twice.
    #[error(
        "line {line}: theta_s {theta_s_deg} deg, theta_o {theta_o_deg} deg, phi {phi_deg} deg stand above too"
    )]
    Twice {
        /// Line of the second.
        line: usize,
        /// Angle of the Sun \[deg\].
        theta_s_deg: f64,
        /// Angle of the observer \[deg\].
        theta_o_deg: f64,
        /// Azimuth \[deg\].
        phi_deg: f64,
    },
    /// A point of the grid without a row.
    #[error("no row for theta_s {theta_s_deg} deg, theta_o {theta_o_deg} deg, phi {phi_deg} deg: not a full grid")]
    Missing {
        /// Angle of the Sun \[deg\].
        theta_s_deg: f64,
        /// Angle of the observer \[deg\].
        theta_o_deg: f64,
        /// Azimuth \[deg\].
        phi_deg: f64,
    },
    /// No value at all, or too many.
    #[error("{values} values of f on the union of both grids of theta: not 1 to 10 million")]
    Size {
        /// How many.
        values: usize,
    },
    /// More light leaves than arrives.
    #[error("directional albedo {albedo:.4} > 1 at theta = {theta_deg} deg")]
    Albedo {
        /// Angle of incidence \[deg\].
        theta_deg: f64,
        /// Share reflected.
        albedo: f64,
    },
}

/// A row of the file: its line, the three angles \[deg\], f \[1/sr\].
struct Row {
    line: usize,
    cell: [f64; 4],
}

impl Row {
    fn angles(&self) -> [f64; 3] {
        [self.cell[0], self.cell[1], self.cell[2]]
    }
}

/// The size of the grid only.
impl std::fmt::Debug for Table {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(out, "Table({0} x {0} x {1})", self.theta.len(), self.phi.len())
    }
}

impl Table {
    /// Reads the text of a file.
    pub fn parse(text: &str) -> Result<Table, TableError> {
        let rows = read(text)?;
        let axes = [0, 1, 2].map(|k| {
            let mut axis: Vec<f64> = rows.iter().map(|row| row.cell[k]).collect();
            axis.sort_by(f64::total_cmp);
            axis.dedup();
            axis
        });
        let table = symmetric(&axes, &fill(rows, &axes)?)?;
        table.conserves()?;
        Ok(table)
    }

    /// Is the directional albedo ≤ 1 at every theta of the grid, half-way between, and at 0 and 89.9 deg?
    fn conserves(&self) -> Result<(), TableError> {
        let material = Material { model: Model::Tabulated(Arc::new(self.clone())), ..Material::lambert(0.0) };
        let between = self.theta.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
        let angles = self.theta.iter().copied().chain(between).chain([0.0, 89.9f64.to_radians()]);
        for theta in angles.filter(|&theta| theta < FRAC_PI_2 - 1e-6) {
            let albedo = directional_albedo(&material, theta);
            if albedo > 1.0 + ALBEDO_TOLERANCE {
                return Err(TableError::Albedo { theta_deg: theta.to_degrees(), albedo });
            }
        }
        Ok(())
    }
}

/// f \[1/sr\] of a table; cs and co in 0..1.
pub(super) fn reflectance<T: Real>(table: &Table, cs: T, co: T, c: T) -> T {
    // along the normal the azimuth is undefined: any will do, here 90 deg
    let sines = (-cs.square() + 1.0).max0() * (-co.square() + 1.0).max0();
    let phi = if sines.value() > 1e-24 { ((c - cs * co) / sines.sqrt()).acos() } else { T::from(FRAC_PI_2) };
    let (theta, phis) = (&table.theta, &table.phi);
    let [s, o, p] = [place(theta, cs.acos()), place(theta, co.acos()), place(phis, phi)];
    let mut sum = T::from(0.0);
    for (i, ws) in s {
        for (j, wo) in o {
            for (k, wp) in p {
                let value = table.f.get((i * theta.len() + j) * phis.len() + k).copied().unwrap_or(0.0);
                // ws wo first: swapping Sun and observer then changes no bit of a term
                sum = sum + ws * wo * wp * value;
            }
        }
    }
    sum
}

/// The two neighbours of x on an axis and their weights; beyond the ends, the end.
fn place<T: Real>(axis: &[f64], x: T) -> [(usize, T); 2] {
    let above = axis.partition_point(|&a| a <= x.value());
    match (axis.get(above.wrapping_sub(1)), axis.get(above)) {
        (Some(&low), Some(&high)) => {
            let share = (x - low) / (high - low);
            [(above - 1, -share + 1.0), (above, share)]
        }
        (None, _) => [(0, T::from(1.0)), (0, T::from(0.0))],
        (_, None) => [(above - 1, T::from(1.0)), (above - 1, T::from(0.0))],
    }
}

fn read(text: &str) -> Result<Vec<Row>, TableError> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (line, heading) = lines.next().unwrap_or((0, ""));
    let names: Vec<&str> = heading.split(',').map(str::trim).collect();
    let mut places = [0; 4];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        *place = names.iter().position(|name| *name == column).ok_or(TableError::Column { line, column })?;
    }
    lines.map(|(line, text)| row(line, text, &places)).collect()
}

fn row(line: usize, text: &str, places: &[usize; 4]) -> Result<Row, TableError> {
    let cells: Vec<&str> = text.split(',').map(str::trim).collect();
    let mut cell = [0.0; 4];
    for (k, column) in COLUMNS.into_iter().enumerate() {
        let value = cells.get(places[k]).copied().unwrap_or("");
        let (low, high) = (0.0, [90.0, 90.0, 180.0, BRIGHTEST][k]);
        let number =
            value.parse().ok().filter(|number| (low..=high).contains(number)).map(|number: f64| number + 0.0); // no -0
        cell[k] = number.ok_or_else(|| TableError::Value { line, column, value: value.into(), low, high })?;
    }
    Ok(Row { line, cell })
}

/// Values on the grid of three axes \[deg\], the last running fastest. Rows sorted by angle must be its points in turn.
fn fill(mut rows: Vec<Row>, [s, o, p]: &[Vec<f64>; 3]) -> Result<Vec<f64>, TableError> {
    rows.sort_by(|a, b| a.angles().partial_cmp(&b.angles()).unwrap_or(Ordering::Equal));
    if let Some([_, twice]) = rows.array_windows().find(|[a, b]| a.angles() == b.angles()) {
        let [theta_s_deg, theta_o_deg, phi_deg] = twice.angles();
        return Err(TableError::Twice { line: twice.line, theta_s_deg, theta_o_deg, phi_deg });
    }
    let mut values = Vec::with_capacity(rows.len());
    let mut sorted = rows.iter();
    for &theta_s_deg in s {
        for &theta_o_deg in o {
            for &phi_deg in p {
                match sorted.next() {
                    Some(row) if row.angles() == [theta_s_deg, theta_o_deg, phi_deg] => values.push(row.cell[3]),
                    _ => return Err(TableError::Missing { theta_s_deg, theta_o_deg, phi_deg }),
                }
            }
        }
    }
    Ok(values)
}

/// The mean of both orders of the arguments, on the union of the grids of theta.
fn symmetric(axes: &[Vec<f64>; 3], grid: &[f64]) -> Result<Table, TableError> {
    let [s, o, p] = axes;
    let mut theta = [s.as_slice(), o.as_slice()].concat();
    theta.sort_by(f64::total_cmp);
    theta.dedup();
    let values = theta.len().saturating_mul(theta.len()).saturating_mul(p.len());
    if !(1..=MOST).contains(&values) {
        return Err(TableError::Size { values });
    }
    let value = |a: f64, b: f64, k: usize| {
        let terms = place(s, a).into_iter().flat_map(|i| place(o, b).map(|j| (i, j)));
        terms
            .map(|((i, wi), (j, wj))| wi * wj * grid.get((i * o.len() + j) * p.len() + k).unwrap_or(&0.0))
            .sum::<f64>()
    };
    let mut f = Vec::with_capacity(values);
    for &a in &theta {
        for &b in &theta {
            f.extend((0..p.len()).map(|k| 0.5 * (value(a, b, k) + value(b, a, k))));
        }
    }
    let radians = |axis: &[f64]| axis.iter().map(|degrees| degrees * (PI / 180.0)).collect();
    Ok(Table { theta: radians(&theta), phi: radians(p), f })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A file of f over grids of 15, 30 and 45 deg.
    fn file(f: impl Fn(f64, f64, f64) -> f64) -> String {
        let mut text = String::from("# a test\nphi_deg, theta_s_deg, theta_o_deg, f_sr\n");
        for phi in [0, 45, 90, 135, 180] {
            for s in (0..=90).step_by(30) {
                for o in (0..=90).step_by(15) {
                    let value = f(f64::from(s), f64::from(o), f64::from(phi));
                    text += &format!("{phi},{s},{o},{value}\n");
                }
            }
        }
        text
    }

    fn material(text: &str) -> Material {
        Material { model: Model::Tabulated(Arc::new(Table::parse(text).unwrap())), ..Material::lambert(0.0) }
    }

    /// The three cosines of directions given in degrees.
    fn cosines(s: f64, o: f64, phi: f64) -> (f64, f64, f64) {
        let (s, o, phi) = (s.to_radians(), o.to_radians(), phi.to_radians());
        (s.cos(), o.cos(), s.sin() * o.sin() * phi.cos() + s.cos() * o.cos())
    }

    #[test]
    fn linear_functions_come_back_and_both_orders_are_averaged() {
        let m = material(&file(|s, o, phi| 0.1 + 1e-3 * s + 3e-4 * o + 1e-4 * phi));
        for (s, o, phi) in [(10.0, 70.0, 20.0), (33.0, 5.0, 170.0), (61.0, 59.0, 91.0)] {
            let (cs, co, c) = cosines(s, o, phi);
            assert!((m.f(cs, co, c) - (0.1 + 6.5e-4 * (s + o) + 1e-4 * phi)).abs() < 1e-12);
            assert!((m.f(cs, co, c) - m.f(co, cs, c)).abs() < 1e-15);
        }
    }

    #[test]
    fn beyond_the_grid_the_nearest_value_holds() {
        let m = material("theta_s_deg,theta_o_deg,phi_deg,f_sr\n20,20,90,0.1\n20,40,90,0.2\n");
        for (s, o, f) in [(5.0, 5.0, 0.1), (80.0, 80.0, 0.2), (80.0, 10.0, 0.15)] {
            let (cs, co, c) = cosines(s, o, 10.0);
            assert!((m.f(cs, co, c) - f).abs() < 1e-12, "{}", m.f(cs, co, c));
        }
    }

    #[test]
    fn errors_tell_line_and_value() {
        let error = |text: &str| Table::parse(text).unwrap_err().to_string();
        let head = "theta_s_deg,theta_o_deg,phi_deg,f_sr\n";
        assert!(error(head).starts_with("0 values of f"));
        assert!(error("").starts_with("line 0: no column theta_s_deg"));
        assert!(error("# a\ntheta_s_deg,phi_deg").starts_with("line 2: no column theta_o_deg"));
        assert!(error(&format!("{head}0,0,0,x")).starts_with("line 2: f_sr = \"x\""));
        assert!(error(&format!("{head}0,0,0,-0.1")).starts_with("line 2: f_sr = \"-0.1\""));
        assert!(error(&format!("{head}0,95,0,0.1")).contains("theta_o_deg = \"95\" is not a number from 0 to 90"));
        assert!(error(&format!("{head}0,0,0,0.1\n0,0,0,0.2")).starts_with("line 3: theta_s 0 deg"));
        assert!(
            error(&format!("{head}0,0,0,0.1\n10,20,0,0.2")).starts_with("no row for theta_s 0 deg, theta_o 20")
        );
        assert_eq!(error(&format!("{head}0,0,0,0.4")), "directional albedo 1.2566 > 1 at theta = 0 deg");
        let bright = error(&file(|s, o, _| 0.3 + 1e-5 * s * o));
        assert!(bright.starts_with("directional albedo 1.") && bright.contains("theta = "), "{bright}");
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "(theta_s_deg,theta_o_deg,phi_deg,f_sr\n)?([0-9.,#\n-]|nan|inf){0,60}") {
            let _ = Table::parse(&text);
        }
    }
}
