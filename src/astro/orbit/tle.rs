//! Two-line element sets: found in a text, checked, read.
//!
//! Columns as in Hoots & Roehrich 1980, Spacetrack Report 3, and Vallado & Cefola 2012, IAC-12-A6.6.11; catalogue numbers
//! above 99,999 in Alpha-5 (a letter without I and O for the first two digits). Lower case, trailing blanks and either
//! kind of line end are taken as what they mean; a wrong length, line number, checksum or character is a fault.

use super::super::Error;
use super::super::scales::Scale;
use super::super::time::{DAY_NS, Instant};
use super::elements::MeanElements;

/// One set: a name line if there was one, and the two lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tle {
    /// The name line.
    pub name: Option<String>,
    /// Lines 1 and 2.
    pub lines: [String; 2],
}

/// Letters of Alpha-5 for 10, 11, ...
const ALPHA_5: &str = "ABCDEFGHJKLMNPQRSTUVWXYZ";

impl Tle {
    /// The set of two lines, tidied: no blanks around, capitals.
    pub fn new(name: Option<&str>, line1: &str, line2: &str) -> Self {
        let clean = |line: &str| line.trim().to_uppercase();
        Self { name: name.map(title).filter(|n| !n.is_empty()), lines: [clean(line1), clean(line2)] }
    }

    /// The one set that two or three lines make.
    ///
    /// # Errors
    /// How many lines there are instead.
    pub fn from_lines(lines: &[&str]) -> Result<Self, String> {
        match lines {
            [one, two] => Ok(Self::new(None, one, two)),
            [name, one, two] => Ok(Self::new(Some(name), one, two)),
            _ => Err(format!("an element set has 2 lines, or 3 with its name; here are {}", lines.len())),
        }
    }

    /// All sets of a text, in its order; lines that belong to none are passed over.
    pub fn all(text: &str) -> Vec<Self> {
        let lines: Vec<&str> =
            text.trim_start_matches('\u{feff}').lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let mut sets = Vec::new();
        for (i, pair) in lines.windows(2).enumerate() {
            if pair[0].starts_with("1 ") && pair[1].starts_with("2 ") {
                let before = i.checked_sub(1).and_then(|at| lines.get(at));
                let name = before.filter(|line| !["1 ", "2 ", "#"].iter().any(|no| line.starts_with(no)));
                sets.push(Self::new(name.copied(), pair[0], pair[1]));
            }
        }
        sets
    }

    /// Everything wrong with the two lines as a pair of lines; what they hold is checked by [`Self::elements`].
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        for (line, number) in self.lines.iter().zip(1u32..) {
            let length = line.chars().count();
            if let Some((column, odd)) = line.chars().enumerate().find(|(_, c)| !c.is_ascii()) {
                faults.push(format!(
                    "line {number} of the element set, column {}: {odd:?} is not ASCII",
                    column + 1
                ));
            } else if length != 69 {
                faults.push(format!("line {number} of the element set has {length} characters; it must have 69"));
            } else if !line.starts_with(&format!("{number} ")) {
                faults.push(format!("line {number} of the element set must begin with \"{number} \""));
            } else if line[68..] != checksum(line).to_string() {
                faults.push(format!(
                    "line {number} of the element set: checksum is {}, expected {}",
                    &line[68..],
                    checksum(line)
                ));
            }
        }
        let catalogue = |line: &String| line.get(2..7).map(str::to_string);
        if faults.is_empty() && catalogue(&self.lines[0]) != catalogue(&self.lines[1]) {
            faults.push("lines 1 and 2 of the element set have different catalogue numbers".into());
        }
        faults
    }

    /// The elements in the lines.
    ///
    /// # Errors
    /// [`Error::Elements`] with every fault of the lines, or the columns that hold no number.
    pub fn elements(&self) -> Result<MeanElements, Error> {
        let name = self.name.clone().unwrap_or_else(|| self.lines[0].get(2..7).unwrap_or("?").trim().to_owned());
        let fault = |reason: String| Error::Elements { name: name.clone(), reason };
        let faults = self.faults();
        if !faults.is_empty() {
            return Err(fault(faults.join("; ")));
        }
        let mut wrong = Vec::new();
        let mut field = |line: usize, from: usize, to: usize, what: &str, read: fn(&str) -> Option<f64>| {
            let text = &self.lines[line - 1][from - 1..to];
            read(text.trim()).filter(|x| x.is_finite()).unwrap_or_else(|| {
                wrong.push(format!("line {line}, columns {from}-{to}: {what} {text:?} is no number"));
                f64::NAN
            })
        };
        let year = field(1, 19, 20, "epoch year", decimal);
        let day = field(1, 21, 32, "epoch day", decimal);
        let bstar = field(1, 54, 61, "B*", exponential);
        let inclination_deg = field(2, 9, 16, "inclination", decimal);
        let raan_deg = field(2, 18, 25, "right ascension of the node", decimal);
        let eccentricity = field(2, 27, 33, "eccentricity", behind_the_point);
        let argp_deg = field(2, 35, 42, "argument of perigee", decimal);
        let mean_anomaly_deg = field(2, 44, 51, "mean anomaly", decimal);
        let mean_motion_rev_day = field(2, 53, 63, "mean motion", decimal);
        let number = catalog_number(&self.lines[0][2..7]);
        if number.is_none() {
            wrong.push(format!("line 1, columns 3-7: catalogue number {:?} is none", &self.lines[0][2..7]));
        }
        let epoch = epoch(year, &self.lines[0][20..32]);
        if epoch.is_none() && year.is_finite() && day.is_finite() {
            wrong.push(format!("line 1, columns 21-32: epoch day {day} must lie in 1..367"));
        }
        let (Some(catalog_number), Some(epoch), true) = (number, epoch, wrong.is_empty()) else {
            return Err(fault(wrong.join("; ")));
        };
        MeanElements {
            name: self.name.clone(),
            catalog_number,
            designator: designator(&self.lines[0][9..17]),
            epoch,
            mean_motion_rev_day,
            eccentricity,
            inclination_deg,
            raan_deg,
            argp_deg,
            mean_anomaly_deg,
            bstar,
        }
        .checked()
    }
}

/// Sum of the digits of the first 68 columns, a minus sign counting 1, modulo 10.
pub fn checksum(line: &str) -> u32 {
    let worth = |c: char| if c == '-' { 1 } else { c.to_digit(10).unwrap_or(0) };
    line.chars().take(68).map(worth).sum::<u32>() % 10
}

/// A name line without its optional leading `0 `.
fn title(line: &str) -> String {
    let line = line.trim();
    line.strip_prefix("0 ").unwrap_or(line).trim().to_string()
}

/// Catalogue number: digits, or Alpha-5.
pub fn catalog_number(field: &str) -> Option<u64> {
    let field = field.trim();
    let first = field.chars().next()?;
    match ALPHA_5.find(first) {
        Some(letter) if field.len() == 5 => {
            let rest =
                field[1..].bytes().all(|b| b.is_ascii_digit()).then(|| field[1..].parse::<u64>().ok())??;
            Some((letter as u64 + 10) * 10_000 + rest)
        }
        _ => field.bytes().all(|b| b.is_ascii_digit()).then(|| field.parse().ok())?,
    }
}

/// `09033A` as `2009-033A`; empty if blank.
fn designator(field: &str) -> String {
    let field = field.trim();
    match (field.get(..2).and_then(|y| y.parse::<u32>().ok()), field.get(2..)) {
        (Some(year), Some(rest)) => format!("{}-{}", full_year(year), rest.trim()),
        _ => field.to_owned(),
    }
}

/// Two-digit years from 57 on are of the 20th century.
fn full_year(two_digits: u32) -> u32 {
    two_digits + if two_digits < 57 { 2000 } else { 1900 }
}

/// The epoch: year and day of the year, days of 86,400 s, read digit by digit.
fn epoch(year: f64, day: &str) -> Option<Instant> {
    let (whole, fraction) = day.trim().split_once('.').unwrap_or((day.trim(), ""));
    let days = whole.parse::<i64>().ok().filter(|d| (1..=366).contains(d))?;
    let digits = format!("{fraction:0<14}");
    let e14 = digits.get(..14)?.parse::<i128>().ok()?;
    let ns = (e14 * i128::from(DAY_NS) + 50_000_000_000_000) / 100_000_000_000_000;
    let first = Instant::from_iso(&format!("{}-01-01", full_year(year as u32)), Scale::Utc).ok()?;
    let mjd = first.utc_reading().mjd + days - 1;
    Some(Instant::from_utc_reading(mjd, i64::try_from(ns).ok()?))
}

fn decimal(text: &str) -> Option<f64> {
    let plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit() || b".+-".contains(&b));
    plain.then(|| text.parse().ok())?
}

/// Digits behind an implied decimal point; blanks stand for zeros.
fn behind_the_point(text: &str) -> Option<f64> {
    let digits = text.replace(' ', "0");
    (!digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()))
        .then(|| format!("0.{digits}").parse().ok())?
}

/// `-46919-2` is -0.46919e-2; blank is 0.
fn exponential(text: &str) -> Option<f64> {
    if text.is_empty() {
        return Some(0.0);
    }
    let (sign, text) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    // the sign of the exponent ends the mantissa; without one the exponent is 0
    let at = text.rfind(['+', '-', ' ']).unwrap_or(text.len());
    let (mantissa, exponent) = text.split_at(at);
    let exponent = exponent.trim().trim_start_matches('+');
    let exponent = if exponent.is_empty() { 0 } else { exponent.parse::<i32>().ok()? };
    let mantissa = mantissa.trim().trim_start_matches('.');
    Some(sign * behind_the_point(mantissa)? * 10f64.powi(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "1 35491U 09033A   18019.95817924 -.00000090  00000-0  00000-0 0  9991";
    const TWO: &str = "2 35491   0.0698 263.4367 0009544 339.3413 117.1094  1.00271818 31371";

    fn renewed(line: &str) -> String {
        format!("{}{}", &line[..68], checksum(line))
    }

    #[test]
    fn a_good_set_has_no_faults_and_a_changed_digit_is_found() {
        assert_eq!(Tle::from_lines(&[ONE, TWO]).unwrap().faults(), Vec::<String>::new());
        let wrong = TWO.replace("263.4367", "263.4368");
        let faults = Tle::from_lines(&[ONE, &wrong]).unwrap().faults();
        assert_eq!(faults, ["line 2 of the element set: checksum is 1, expected 2"]);
        assert_eq!(Tle::from_lines(&[&ONE[..60], "é"]).unwrap().faults().len(), 2);
    }

    /// Hand-read: every field of the set of GOES 14.
    #[test]
    fn the_fields_of_a_set() {
        let e = Tle::from_lines(&["0 GOES 14", ONE, TWO]).unwrap().elements().unwrap();
        assert_eq!(
            (e.title().as_str(), e.catalog_number, e.designator.as_str()),
            ("GOES 14", 35_491, "2009-033A")
        );
        // 0.95817924 d = 22:59:46.686336
        assert_eq!(e.epoch.iso_utc(), "2018-01-19T22:59:46.686336");
        let read = [e.inclination_deg, e.raan_deg, e.eccentricity, e.argp_deg, e.mean_anomaly_deg];
        assert_eq!(read, [0.0698, 263.4367, 0.000_954_4, 339.3413, 117.1094]);
        assert_eq!((e.mean_motion_rev_day, e.bstar), (1.002_718_18, 0.0));
    }

    #[test]
    fn numbers_with_an_exponent_behind() {
        for (text, value) in [("-46919-2", -0.004_691_9), ("38550-4", 3.855e-5), ("+12345+1", 1.2345), ("", 0.0)] {
            assert!((exponential(text).unwrap() - value).abs() < 1e-15, "{text}");
        }
        assert_eq!(exponential("1234x-3"), None);
    }

    #[test]
    fn alpha_5_reaches_339_999_and_leaves_out_i_and_o() {
        for (field, number) in
            [("A0000", 100_000), ("J2931", 182_931), ("Z9999", 339_999), ("    5", 5), ("99999", 99_999)]
        {
            assert_eq!(catalog_number(field), Some(number), "{field}");
        }
        for field in ["I0000", "O1234", "A12", "12 45", "-1234", "AAAAA"] {
            assert_eq!(catalog_number(field), None, "{field}");
        }
        let (one, two) = (renewed(&ONE.replace("35491", "T0001")), renewed(&TWO.replace("35491", "t0001")));
        assert_eq!(Tle::from_lines(&[&one, &two]).unwrap().elements().unwrap().catalog_number, 270_001);
    }

    #[test]
    fn lower_case_line_ends_and_blanks_mean_what_they_mean() {
        let plain = Tle::from_lines(&[ONE, TWO]).unwrap().elements().unwrap();
        let odd = format!("{}  \r\n  {}\t\r\n", ONE.to_lowercase(), TWO.to_lowercase());
        let sets = Tle::all(&odd);
        assert_eq!((sets.len(), sets[0].elements().unwrap()), (1, plain));
    }

    #[test]
    fn columns_without_numbers_and_values_out_of_range_are_named() {
        let fault = |line1: &str, line2: &str| {
            Tle::from_lines(&[&renewed(line1), &renewed(line2)]).unwrap().elements().unwrap_err().to_string()
        };
        assert!(fault(ONE, &TWO.replace("263.4367", "263.x367")).contains("columns 18-25: right ascension"));
        assert!(
            fault(&ONE.replace("18019.9", "18400.9"), TWO).contains("epoch day 400.95817924 must lie in 1..367")
        );
        let both = fault(ONE, &TWO.replace("  0.0698", "190.0698").replace(" 1.00271818", "99.00271818"));
        assert!(both.contains("inclination 190.0698 must lie in 0..180 deg"), "{both}");
        assert!(both.contains("mean motion 99.00271818 must lie in 0..18 rev/d, 0 excluded"), "{both}");
        assert!(fault(ONE, &TWO.replace(" 0.0698", "    NaN")).contains("inclination"));
    }

    #[test]
    fn a_text_of_many_sets() {
        let file = format!("OTHER\r\n{ONE}\r\n{TWO}\r\n0 GOES 14\n{ONE}\n{TWO}\n# end\n");
        let names = Tle::all(&file).into_iter().map(|set| set.name).collect::<Vec<_>>();
        assert_eq!(names, [Some("OTHER".to_owned()), Some("GOES 14".to_owned())]);
        assert_eq!(Tle::all(&format!("{ONE}\n{TWO}\n{ONE}\n{TWO}"))[1].name, None);
        assert!(Tle::all("").is_empty());
    }
}
