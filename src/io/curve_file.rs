//! Reading light curves of any origin.
//!
//! - `lightcurve.ecsv` as this project writes it, or astropy; CSV with the same names in its first line. The columns
//!   may be in any order. Needed are a time (`time_utc` or `mjd_utc`) and a brightness (`flux_e` or `mag_v`); what is
//!   missing besides is NaN, or zero flags. Where a column has a unit it must be the contract's.
//! - DAMIT's `lc.txt` (Durech, Sidorin & Kaasalainen 2010, A&A 513, A46): the number of curves; for each its number of
//!   points and 1 if calibrated, 0 if relative; rows of a Julian date, the brightness as intensity, and the vectors from
//!   the body to the Sun and to the observer \[au\], ecliptic of J2000.0, here turned by the obliquity to ICRS axes (the
//!   frame bias, 23 mas, is left out). Its dates are light-time corrected and taken as UTC; its intensities are reduced
//!   to unit distances already.
//! - ALCDEF, which has no vectors: they are NaN.
//!
//! Without fluxes a row gets those of its magnitude, 10^(-0.4 m), which a zero point of 0 turns back; likewise errors,
//! to first order.

use super::alcdef::{self, AlcdefError};
use super::ecsv_read::{TableFault, TextTable, is_ecsv, parse_csv, parse_ecsv};
use crate::astro::time::Instant;
use glam::{DMat3, DVec3};

/// Kilometres in an astronomical unit (IAU 2012 B2).
const AU_KM: f64 = 149_597_870.7;
/// Obliquity of the ecliptic at J2000.0 \[arcsec\] (IAU 2006, Hilton et al. 2006, Celest. Mech. 94, 351).
const OBLIQUITY_ARCSEC: f64 = 84_381.406;
/// Relative error of a flux for an error of one magnitude.
const LN10_BY_2_5: f64 = std::f64::consts::LN_10 / 2.5;

/// A point of a light curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Number of the frame, if the file tells.
    pub frame: Option<i64>,
    /// Middle of the exposure.
    pub time: Instant,
    /// Exposure \[s\].
    pub exptime_s: f64,
    /// Name of the target.
    pub target: String,
    /// Flux in the whole exposure \[electron\]; of other files an intensity, see the module.
    pub flux: f64,
    /// Its standard error.
    pub flux_err: f64,
    /// Magnitude of unit flux \[mag\].
    pub zeropoint_mag: f64,
    /// Magnitude; NaN without light.
    pub mag: f64,
    /// Its standard error \[mag\].
    pub mag_err: f64,
    /// From the observer to the target \[km\].
    pub range_km: f64,
    /// Unit vector from the target to the Sun, ICRS.
    pub sun: DVec3,
    /// Unit vector from the target to the observer, ICRS.
    pub obs: DVec3,
    /// Flags of the measurement.
    pub flags: u32,
    /// Number of its curve in [`CurveFile::curves`].
    pub curve: usize,
}

/// What is known of a whole curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Its name: the target, or the session or number in its file.
    pub name: String,
    /// Whether its level means something: false for curves known up to a factor.
    pub calibrated: bool,
    /// Whether its brightness is reduced to unit distances, so that the range must not be applied again.
    pub reduced: bool,
    /// Whether it is a session of one object, as all curves of DAMIT's files are, and those of ALCDEF's.
    pub session: bool,
}

/// Light curves of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurveFile {
    /// The points, in the file's order.
    pub rows: Vec<Row>,
    /// The curves: targets, or sessions, or curves of DAMIT.
    pub curves: Vec<Curve>,
    /// Metadata; what is no text is JSON.
    pub meta: Vec<(String, String)>,
}

impl CurveFile {
    /// Whether the level of every curve means something.
    pub fn calibrated(&self) -> bool {
        self.curves.iter().all(|c| c.calibrated)
    }
}

/// Why a light curve cannot be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}: line {line}{}: {value:?}; allowed: {allowed}", in_column(.column))]
pub struct CurveError {
    /// Name of the file.
    pub file: String,
    /// Number of the line, from 1.
    pub line: usize,
    /// Name of the column, if one is at fault.
    pub column: Option<String>,
    /// What is there.
    pub value: String,
    /// What is allowed there.
    pub allowed: String,
}

fn in_column(column: &Option<String>) -> String {
    column.as_ref().map_or_else(String::new, |c| format!(", column {c}"))
}

/// The light curves in `text`; `file` is the name that errors tell. The form is told by the first lines.
///
/// # Errors
/// [`CurveError`] with the first place that cannot be read.
pub fn read(file: &str, text: &str) -> Result<CurveFile, CurveError> {
    let first = text.lines().map(str::trim).find(|l| !l.is_empty()).unwrap_or("");
    let result = if is_ecsv(text) {
        parse_ecsv(text).map_err(Fault::from).and_then(|t| from_table(&t))
    } else if first.trim_matches(['<', '>']).eq_ignore_ascii_case("STARTMETADATA") {
        from_alcdef(text)
    } else if first.parse::<u64>().is_ok() {
        from_damit(text)
    } else {
        parse_csv(text).map_err(Fault::from).and_then(|t| from_table(&t))
    };
    result.map_err(|Fault { column, fault: TableFault { line, value, allowed } }| CurveError {
        file: file.to_owned(),
        line,
        column,
        value,
        allowed,
    })
}

struct Fault {
    column: Option<String>,
    fault: TableFault,
}

impl From<TableFault> for Fault {
    fn from(fault: TableFault) -> Self {
        Self { column: None, fault }
    }
}

fn fault<T>(line: usize, column: Option<&str>, value: &str, allowed: impl Into<String>) -> Result<T, Fault> {
    let fault = TableFault { line, value: value.to_owned(), allowed: allowed.into() };
    Err(Fault { column: column.map(str::to_owned), fault })
}

/// Columns that are read, and their units.
const COLUMNS: [(&str, &str); 18] = [
    ("frame", ""),
    ("time_utc", ""),
    ("mjd_utc", "d"),
    ("exptime_s", "s"),
    ("target", ""),
    ("flux_e", "electron"),
    ("flux_err_e", "electron"),
    ("mag_v", "mag"),
    ("mag_err", "mag"),
    ("zeropoint_mag", "mag"),
    ("range_km", "km"),
    ("sun_x", ""),
    ("sun_y", ""),
    ("sun_z", ""),
    ("obs_x", ""),
    ("obs_y", ""),
    ("obs_z", ""),
    ("flags", ""),
];

/// Cells of a row by the names of their columns.
struct Cells<'a> {
    table: &'a TextTable,
    line: usize,
    cells: &'a [String],
}

impl<'a> Cells<'a> {
    fn text(&self, name: &str) -> Option<&'a str> {
        let place = self.table.columns.iter().position(|c| c.name == name)?;
        self.cells.get(place).map(|c| c.trim()).filter(|c| !c.is_empty())
    }

    fn number(&self, name: &str) -> Result<f64, Fault> {
        let Some(text) = self.text(name) else { return Ok(f64::NAN) };
        match text.parse::<f64>() {
            Ok(value) if !value.is_infinite() => Ok(value),
            _ => fault(self.line, Some(name), text, "a finite number, nan or nothing"),
        }
    }

    /// A magnitude, infinite where there is no light.
    fn magnitude(&self, name: &str) -> Result<f64, Fault> {
        let no_light = self.text(name).and_then(|t| t.parse::<f64>().ok()) == Some(f64::INFINITY);
        if no_light { Ok(f64::INFINITY) } else { self.number(name) }
    }

    fn integer(&self, name: &str) -> Result<Option<i64>, Fault> {
        let Some(text) = self.text(name) else { return Ok(None) };
        text.parse().map(Some).or_else(|_| fault(self.line, Some(name), text, "an integer"))
    }

    fn flags(&self) -> Result<u32, Fault> {
        let value = self.integer("flags")?.unwrap_or(0);
        let range = format!("an integer from 0 to {}", u32::MAX);
        u32::try_from(value).or_else(|_| fault(self.line, Some("flags"), &value.to_string(), range))
    }

    fn direction(&self, names: [&str; 3]) -> Result<DVec3, Fault> {
        let [x, y, z] = names;
        Ok(unit(DVec3::new(self.number(x)?, self.number(y)?, self.number(z)?)))
    }

    fn time(&self) -> Result<Instant, Fault> {
        if let Some(text) = self.text("time_utc") {
            return Instant::from_utc(text).or_else(|why| fault(self.line, Some("time_utc"), text, why));
        }
        match self.text("mjd_utc") {
            Some(text) => Instant::parse(&format!("MJD {text}"))
                .or_else(|why| fault(self.line, Some("mjd_utc"), text, why.to_string())),
            None => fault(self.line, Some("time_utc"), "", "a time in time_utc or mjd_utc"),
        }
    }
}

/// A vector of length 1, or NaN.
fn unit(v: DVec3) -> DVec3 {
    v.try_normalize().unwrap_or(DVec3::NAN)
}

fn from_table(table: &TextTable) -> Result<CurveFile, Fault> {
    let has = |name: &str| table.columns.iter().any(|c| c.name == name);
    let names = table.columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ");
    for needed in [["time_utc", "mjd_utc"], ["flux_e", "mag_v"]] {
        if !needed.iter().any(|name| has(name)) {
            return fault(1, None, &names, format!("a column {}", needed.join(" or ")));
        }
    }
    for column in &table.columns {
        let contract = COLUMNS.iter().find(|(name, _)| *name == column.name);
        let dimensionless = matches!(column.unit.as_str(), "" | "1" | "dimensionless");
        if let Some((name, unit)) = contract.filter(|(_, unit)| !dimensionless && column.unit != *unit) {
            let allowed = if unit.is_empty() { "no unit".to_owned() } else { format!("unit: {unit}") };
            return fault(1, Some(name), &column.unit, allowed);
        }
    }
    let mut file = CurveFile::default();
    for (key, value) in &table.meta {
        file.meta.push((key.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned)));
    }
    for (line, cells) in &table.rows {
        let cells = Cells { table, line: *line, cells };
        let target = cells.text("target").unwrap_or("").to_owned();
        let mut row = Row {
            frame: cells.integer("frame")?,
            time: cells.time()?,
            exptime_s: cells.number("exptime_s")?,
            curve: curve(&mut file.curves, &target),
            target,
            flux: cells.number("flux_e")?,
            flux_err: cells.number("flux_err_e")?,
            zeropoint_mag: cells.number("zeropoint_mag")?,
            mag: cells.magnitude("mag_v")?,
            mag_err: cells.magnitude("mag_err")?,
            range_km: cells.number("range_km")?,
            sun: cells.direction(["sun_x", "sun_y", "sun_z"])?,
            obs: cells.direction(["obs_x", "obs_y", "obs_z"])?,
            flags: cells.flags()?,
        };
        if !has("flux_e") {
            fluxes_of_magnitude(&mut row);
        }
        for mag in [&mut row.mag, &mut row.mag_err].into_iter().filter(|m| m.is_infinite()) {
            *mag = f64::NAN;
        }
        file.rows.push(row);
    }
    Ok(file)
}

/// Number of the curve of that name, which is added if it is new.
fn curve(curves: &mut Vec<Curve>, name: &str) -> usize {
    curves.iter().position(|c| c.name == name).unwrap_or_else(|| {
        curves.push(Curve { name: name.to_owned(), calibrated: true, reduced: false, session: false });
        curves.len() - 1
    })
}

fn fluxes_of_magnitude(row: &mut Row) {
    row.flux = 10f64.powf(-0.4 * row.mag);
    row.flux_err = row.flux * row.mag_err * LN10_BY_2_5;
    row.zeropoint_mag = 0.0;
}

/// A row of which only the time and the curve are known.
fn unknown(time: Instant, target: &str, curve: usize) -> Row {
    let nan = f64::NAN;
    Row {
        frame: None,
        time,
        exptime_s: nan,
        target: target.to_owned(),
        flux: nan,
        flux_err: nan,
        zeropoint_mag: nan,
        mag: nan,
        mag_err: nan,
        range_km: nan,
        sun: DVec3::NAN,
        obs: DVec3::NAN,
        flags: 0,
        curve,
    }
}

fn from_alcdef(text: &str) -> Result<CurveFile, Fault> {
    let sessions = match alcdef::parse_alcdef(text) {
        Ok(sessions) => sessions,
        Err(AlcdefError::Line { line, text, fault: allowed }) => return fault(line, None, &text, allowed),
        Err(other) => return fault(1, None, "", other.to_string()),
    };
    let mut file = CurveFile::default();
    for (number, session) in sessions.iter().enumerate() {
        let says = |keyword, word: &str| session.get(keyword).is_some_and(|v| v.eq_ignore_ascii_case(word));
        let date = session.get("SESSIONDATE").unwrap_or("");
        file.curves.push(Curve {
            name: format!("{} {date} {}", session.object(), session.get("FILTER").unwrap_or("")),
            calibrated: !says("DIFFERMAGS", "TRUE"),
            reduced: session.get("REDUCEDMAGS").is_some() && !says("REDUCEDMAGS", "NONE"),
            session: true,
        });
        let metadata = session.metadata.iter().map(|(k, v)| (format!("{number}.{k}"), v.clone()));
        file.meta.extend(metadata);
        let exposure = session.get("EXPOSURE").and_then(|v| v.parse().ok()).filter(|v| *v > 0.0);
        for sample in &session.samples {
            let mut row = unknown(sample.time, session.object(), number);
            (row.mag, row.mag_err, row.exptime_s) = (sample.mag, sample.mag_err, exposure.unwrap_or(f64::NAN));
            fluxes_of_magnitude(&mut row);
            file.rows.push(row);
        }
    }
    Ok(file)
}

fn from_damit(text: &str) -> Result<CurveFile, Fault> {
    let lines = text.lines().enumerate().map(|(k, l)| (k + 1, l.trim()));
    let mut lines = lines.filter(|(_, l)| !l.is_empty());
    let end = text.lines().count();
    let mut next = |what: &str| lines.next().map_or_else(|| fault(end, None, "end of file", what), Ok);
    let whole = |(line, text): (usize, &str), what: &str, count: usize| {
        let numbers = text.split_whitespace().map(str::parse::<u64>).collect::<Result<Vec<_>, _>>();
        numbers.ok().filter(|n| n.len() == count).map_or_else(|| fault(line, None, text, what), Ok)
    };
    let ecliptic = DMat3::from_rotation_x((OBLIQUITY_ARCSEC / 3600.0).to_radians());
    let mut file = CurveFile::default();
    let curves = whole(next("the number of curves")?, "the number of curves", 1)?;
    for number in 0..curves.first().copied().unwrap_or(0) {
        let form = "the number of points, and 1 if calibrated or 0 if not";
        let head = next(form)?;
        let (points, calibrated) = match whole(head, form, 2)?.as_slice() {
            [points, flag @ (0 | 1)] => (*points, *flag == 1),
            _ => return fault(head.0, None, head.1, form),
        };
        let name = (number + 1).to_string();
        file.curves.push(Curve { name: name.clone(), calibrated, reduced: true, session: true });
        for _ in 0..points {
            let (line, text) = next("8 numbers: JD, brightness, Sun x y z, observer x y z")?;
            let words = text.split_whitespace().collect::<Vec<_>>();
            let numbers = words.iter().map(|w| w.parse::<f64>().ok().filter(|v| v.is_finite()));
            let numbers = numbers.collect::<Option<Vec<_>>>();
            let Some([_, flux, sx, sy, sz, ox, oy, oz]) = numbers.as_deref() else {
                return fault(line, None, text, "8 finite numbers: JD, brightness, Sun x y z, observer x y z");
            };
            let jd = words.first().copied().unwrap_or("");
            let time = Instant::parse(&format!("JD {jd}"));
            let time = time.or_else(|why| fault(line, Some("JD"), jd, why.to_string()))?;
            let mut row = unknown(time, &name, file.curves.len() - 1);
            row.flux = *flux;
            (row.zeropoint_mag, row.mag) = (0.0, if *flux > 0.0 { -2.5 * flux.log10() } else { f64::NAN });
            let obs = DVec3::new(*ox, *oy, *oz);
            row.range_km = obs.length() * AU_KM;
            (row.sun, row.obs) = (unit(ecliptic * DVec3::new(*sx, *sy, *sz)), unit(ecliptic * obs));
            file.rows.push(row);
        }
    }
    match lines.next() {
        Some((line, text)) => fault(line, None, text, "the end of the file after the last curve"),
        None => Ok(file),
    }
}
