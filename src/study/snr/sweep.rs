//! Sweeps: `KEY=A..B:log:N`, `KEY=A..B:lin:N`, `KEY=A,B,C`; what they vary, and the points they make.

use super::setting::{OWN, Setting};
use crate::scene::numeric;

/// Most points of a sweep.
pub const MOST_POINTS: usize = 100_000;

/// What a sweep varies.
#[derive(Debug, Clone, PartialEq)]
pub enum Key {
    /// A key of the scene, as `--set` writes it, and its unit.
    Scene(String, &'static str),
    /// One of the study's own parameters, by its number.
    Own(usize),
}

impl Key {
    /// Its name.
    pub fn name(&self) -> &str {
        match self {
            Self::Scene(path, _) => path,
            Self::Own(number) => OWN.get(*number).map_or("", |own| own.name),
        }
    }

    /// Its unit as tables write it; empty for none.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::Own(number) => OWN.get(*number).map_or("", |own| own.unit),
            Self::Scene(_, unit) => match *unit {
                "arcsec/px" => "arcsec / pix",
                "e-/ADU" => "electron / adu",
                "e-" => "electron",
                "px" => "pix",
                "um" => "um",
                "m" | "s" | "deg" | "arcsec" | "mag" | "km" | "hPa" => unit,
                _ => "",
            },
        }
    }
}

/// A parameter and its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// What is varied.
    pub key: Key,
    /// Its values, in order.
    pub values: Vec<f64>,
    /// Whether they are evenly spaced in the logarithm.
    pub log: bool,
}

impl Sweep {
    /// Reads one.
    ///
    /// # Errors
    /// In words what is wrong, with the place and the allowed form.
    pub fn parse(text: &str) -> Result<Self, String> {
        let fault = |why: &str| format!("--sweep {text}: {why}");
        let Some((name, range)) = text.split_once('=') else {
            return Err(fault("write KEY=A..B:log:N, KEY=A..B:lin:N or KEY=A,B,C"));
        };
        let (name, range) = (name.trim(), range.trim());
        let own = OWN.iter().position(|own| own.name == name);
        let (key, whole) = match own {
            Some(number) => (Key::Own(number), false),
            None => {
                let names = OWN.map(|own| own.name);
                let found = numeric(name, &names).map_err(|why| fault(&why))?;
                (Key::Scene(name.to_owned(), found.unit), found.whole)
            }
        };
        let (values, log) = values(range).map_err(|why| fault(&why))?;
        if let Some(number) = own {
            let [low, high] = OWN[number].range;
            if let Some(bad) = values.iter().find(|v| !(low..=high).contains(*v)) {
                return Err(fault(&format!("{name} = {bad}: must lie in {low}..{high} {}", OWN[number].unit)));
            }
        }
        if let Some(bad) = values.iter().find(|v| whole && v.fract() != 0.0) {
            return Err(fault(&format!("{name} = {bad}: must be an integer; give whole numbers as a list")));
        }
        Ok(Self { key, values, log })
    }

    /// The sweep in one form, whatever way it was written: two of the same points are the same text.
    pub fn text(&self) -> String {
        let values = self.values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>();
        format!("{}={}", self.key.name(), values.join(","))
    }
}

fn values(range: &str) -> Result<(Vec<f64>, bool), String> {
    let number = |text: &str| match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("\"{}\" is no finite number", text.trim())),
    };
    let Some((from, rest)) = range.split_once("..") else {
        if range.contains(':') {
            return Err(format!("\"{range}\" is no range; write A..B:log:N, A..B:lin:N or a list A,B,C"));
        }
        if range.is_empty() {
            return Err("no values; write A..B:log:N, A..B:lin:N or a list A,B,C".into());
        }
        let values = range.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
        if let Some(twice) = values.iter().enumerate().find(|(i, v)| values[..*i].contains(v)) {
            return Err(format!("{} is there twice", twice.1));
        }
        return Ok((values, false));
    };
    let parts = rest.split(':').collect::<Vec<_>>();
    let &[to, kind, count] = parts.as_slice() else {
        return Err("a range needs its spacing and number: A..B:log:N or A..B:lin:N".into());
    };
    let (from, to) = (number(from)?, number(to)?);
    let count = match count.trim().parse::<usize>() {
        Ok(count) if (1..=MOST_POINTS).contains(&count) => count,
        _ => return Err(format!("\"{}\" points: must be an integer in 1..{MOST_POINTS}", count.trim())),
    };
    if from > to {
        return Err(format!("the range {from}..{to} is reversed; write {to}..{from}"));
    }
    if from == to && count > 1 {
        return Err(format!("the range {from}..{to} is empty: {count} points at one value"));
    }
    let log = match kind.trim() {
        "log" if from <= 0.0 => {
            return Err(format!("{from}..{to}: a logarithmic range must lie above 0; use lin, or begin above 0"));
        }
        "log" => true,
        "lin" => false,
        other => return Err(format!("\"{other}\": the spacing is log or lin")),
    };
    let place = |k: usize| match k {
        0 => from,
        k if k + 1 == count => to,
        k => {
            let t = k as f64 / (count - 1) as f64;
            if log { from * libm::pow(to / from, t) } else { from + t * (to - from) }
        }
    };
    Ok(((0..count).map(place).collect(), log))
}

/// All sweeps of a command line: none, one or two.
///
/// # Errors
/// All that is wrong, a line each.
pub fn parse_all(texts: &[String]) -> Result<Vec<Sweep>, String> {
    let (good, bad): (Vec<_>, Vec<_>) = texts.iter().map(|t| Sweep::parse(t)).partition(Result::is_ok);
    let mut faults = bad.into_iter().filter_map(Result::err).collect::<Vec<_>>();
    let sweeps = good.into_iter().flatten().collect::<Vec<_>>();
    if texts.len() > 2 {
        faults.push(format!("--sweep: {} of them; one or two parameters can be varied", texts.len()));
    }
    if let [one, other] = sweeps.as_slice() {
        if one.key == other.key {
            faults.push(format!("--sweep {}: twice", one.key.name()));
        }
        let points = one.values.len().saturating_mul(other.values.len());
        if points > MOST_POINTS {
            faults.push(format!("--sweep: {points} points; at most {MOST_POINTS}"));
        }
    }
    if faults.is_empty() { Ok(sweeps) } else { Err(faults.join("\n")) }
}

/// A point of a study: replacements of the scene's keys, and the study's own parameters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Point {
    /// Values of the sweeps, in their order.
    pub values: Vec<f64>,
    /// Keys and values as `--set` takes them.
    pub sets: Vec<(String, String)>,
    /// The study's own parameters.
    pub setting: Setting,
}

/// The points of the sweeps, the first varied slowest.
pub fn points(sweeps: &[Sweep]) -> Vec<Point> {
    let mut points = vec![Point::default()];
    for sweep in sweeps {
        let with = |point: &Point, value: f64| {
            let mut point = point.clone();
            point.values.push(value);
            match &sweep.key {
                // a whole number is written without a point, as integers are
                Key::Scene(path, _) => point.sets.push((path.clone(), toml_number(value))),
                Key::Own(number) => {
                    if let Some(slot) = point.setting.slot(*number) {
                        *slot = Some(value);
                    }
                }
            }
            point
        };
        points = points.iter().flat_map(|point| sweep.values.iter().map(|v| with(point, *v))).collect();
    }
    points
}

/// A number as TOML reads it.
fn toml_number(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_and_lists_make_their_values() {
        let of = |text: &str| Sweep::parse(text).expect(text).values;
        let decades = of("exposures.duration_s=1..100:log:3");
        assert!(decades.iter().zip([1.0, 10.0, 100.0]).all(|(v, w)| (v - w).abs() < 1e-13 * w), "{decades:?}");
        assert_eq!(of("mag_v=-1..1:lin:5"), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(of("detector.binning = 1, 2,4"), [1.0, 2.0, 4.0]);
        assert_eq!(of("mag_v=3..3:lin:1"), [3.0]);
    }

    #[test]
    fn faults_say_what_is_wrong_and_what_is_allowed() {
        for (text, parts) in [
            ("mag_v", &["KEY=A..B:log:N"][..]),
            ("mag_v=", &["no values"]),
            ("mag_v=1..2", &["spacing and number"]),
            ("mag_v=1..2:log", &["spacing and number"]),
            ("mag_v=1..2:cube:3", &["cube", "log or lin"]),
            ("mag_v=1..2:lin:0", &["1..100000"]),
            ("mag_v=1..2:lin:x", &["\"x\" points"]),
            ("mag_v=2..1:lin:3", &["reversed", "1..2"]),
            ("mag_v=2..2:lin:3", &["empty"]),
            ("mag_v=0..2:log:3", &["above 0"]),
            ("mag_v=-1..2:log:3", &["above 0"]),
            ("mag_v=1,x", &["\"x\" is no finite number"]),
            ("mag_v=1,nan", &["nan"]),
            ("mag_v=1,1", &["twice"]),
            ("elevation_deg=10..95:lin:3", &["95", "-90..90"]),
            ("mag=1..2:lin:3", &["nearest: mag_v"]),
            ("detector.gian_e_per_adu=1,2", &["detector.gain_e_per_adu"]),
            ("telescope.psf=1,2", &["no number", "kolmogorov"]),
            ("detector.binning=1..2:lin:3", &["1.5", "integer"]),
        ] {
            let why = Sweep::parse(text).expect_err(text);
            assert!(why.starts_with(&format!("--sweep {text}")), "{why}");
            assert!(parts.iter().all(|part| why.contains(part)), "{why}");
        }
        let three = ["mag_v=1,2", "sun_el_deg=1", "moon_sep_deg=1"].map(str::to_owned);
        assert!(parse_all(&three).expect_err("three").contains("one or two"));
        let twice = ["mag_v=1,2", "mag_v=3"].map(str::to_owned);
        assert!(parse_all(&twice).expect_err("twice").contains("twice"));
        let both = ["mag_v=2..1:lin:2", "oops=1"].map(str::to_owned);
        assert_eq!(parse_all(&both).expect_err("two faults").lines().count(), 2);
    }

    #[test]
    fn two_sweeps_make_a_grid_with_the_first_varied_slowest() {
        let sweeps = parse_all(&["exposures.duration_s=1,2.5".into(), "mag_v=10,11".into()]).expect("good");
        let points = points(&sweeps);
        let values = points.iter().map(|p| p.values.clone()).collect::<Vec<_>>();
        assert_eq!(values, [[1.0, 10.0], [1.0, 11.0], [2.5, 10.0], [2.5, 11.0]]);
        assert_eq!(points[0].sets, [("exposures.duration_s".to_owned(), "1".to_owned())]);
        assert_eq!(points[2].sets[0].1, "2.5");
        assert_eq!(points[3].setting.mag_v, Some(11.0));
    }
}
