//! The cheapest setting of each approximation that meets a wanted error, and the values of `[accuracy]` that bring it.

use crate::base::accuracy::{Accuracy, AccuracyRow};
use crate::study::accuracy::APPROXIMATIONS;

/// A setting in place of the present one must save this share of its time: less is the scatter of a measured time.
const WORTH: f64 = 0.2;

/// The errors that are wanted; of what nobody names, those of the scene's own `[accuracy]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wanted {
    /// Share of the noise of one exposure that each approximation may make.
    noise: Option<f64>,
    /// Names of keys of `[accuracy]` or of approximations, and their errors.
    named: Vec<(String, f64)>,
}

impl Wanted {
    /// From words as `sky=1e-3`, `psf.stamp=1e-4`, or a number alone: a share of the noise.
    ///
    /// # Errors
    /// All that cannot be understood, a line each.
    pub fn parse<'t>(words: impl IntoIterator<Item = &'t str>) -> Result<Self, String> {
        let (mut wanted, mut faults) = (Self::default(), Vec::new());
        for word in words {
            let (name, value) =
                word.split_once('=').map_or((None, word), |(name, value)| (Some(name.trim()), value));
            let value = value.trim().parse::<f64>().ok().filter(|v| *v > 0.0 && v.is_finite());
            let known = |name: &&str| Accuracy::KEYS.contains(name) || APPROXIMATIONS.contains(name);
            match (name, value) {
                (_, None) => faults.push(format!(
                    "--wanted {word}: must be NAME=ERROR, or one share of the noise, a number above 0"
                )),
                (None, Some(share)) => wanted.noise = Some(share),
                (Some(name), Some(error)) if known(&name) => wanted.named.push((name.to_owned(), error)),
                (Some(name), _) => {
                    let all = Accuracy::KEYS.iter().chain(&APPROXIMATIONS);
                    let near =
                        all.max_by(|a, b| strsim::jaro_winkler(a, name).total_cmp(&strsim::jaro_winkler(b, name)));
                    let near = near.map_or(String::new(), |near| format!("; nearest: {near}"));
                    faults.push(format!(
                        "--wanted {word}: no key of [accuracy] and no approximation is named {name}{near}; keys: {}",
                        Accuracy::KEYS.join(", ")
                    ));
                }
            }
        }
        if faults.is_empty() { Ok(wanted) } else { Err(faults.join("\n")) }
    }

    fn of(&self, name: &str) -> Option<f64> {
        self.named.iter().rev().find(|(known, _)| known == name).map(|(_, error)| *error)
    }
}

/// What is suggested.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Suggestion {
    /// Keys of `[accuracy]` and the values that bring the suggested settings; those that the scene does not use are left out.
    pub values: Vec<(&'static str, f64)>,
    /// What cannot be had, in words.
    pub unmet: Vec<String>,
}

/// A wanted error.
enum Limit {
    /// Of the measured error, in the row's unit.
    Error(f64),
    /// Of the key's value, whose unit is not that of the measured error.
    Key(f64),
    /// Of the measured error, as a share of the noise.
    Noise(f64),
}

impl Limit {
    fn is_met(&self, row: &AccuracyRow) -> bool {
        match self {
            Self::Error(limit) => row.error() <= *limit,
            Self::Key(limit) => row.by.is_some_and(|by| by.low <= *limit),
            Self::Noise(share) => row.noise.is_some_and(|noise| row.error() <= share * noise),
        }
    }

    fn told(&self, row: &AccuracyRow) -> String {
        match self {
            Self::Error(limit) => format!("{limit:e} {}", row.unit),
            Self::Key(limit) => format!("{limit:e}"),
            Self::Noise(share) => format!("{share:e} of the noise"),
        }
    }
}

/// Mark in `rows` the cheapest setting of each approximation that meets the wanted error, and tell the values of `[accuracy]` that bring
/// them. `own` are the scene's.
pub fn suggest(rows: &mut [AccuracyRow], wanted: &Wanted, own: &Accuracy) -> Suggestion {
    let mut suggestion = Suggestion::default();
    let mut families = Vec::new();
    for row in rows.iter() {
        if !families.contains(&row.family()) {
            families.push(row.family());
        }
    }
    for family in families {
        let members = (0..rows.len()).filter(|k| rows[*k].family() == family && rows[*k].error().is_finite());
        let members = members.collect::<Vec<_>>();
        let Some(limit) = limit(rows, &members, wanted, own) else { continue };
        let meeting = members.iter().copied().filter(|k| limit.is_met(&rows[*k])).collect::<Vec<_>>();
        let cheapest = meeting.iter().copied().min_by(|a, b| rows[*a].time_s.total_cmp(&rows[*b].time_s));
        let Some(cheapest) = cheapest else {
            let least = members.iter().copied().min_by(|a, b| rows[*a].error().total_cmp(&rows[*b].error()));
            if let Some(least) = least.map(|k| &rows[k]) {
                suggestion.unmet.push(format!(
                    "{family}: no setting tried has an error within {}; the least is {:.1e} {} ({})",
                    limit.told(least),
                    least.error(),
                    least.unit,
                    least.setting
                ));
            }
            continue;
        };
        let present = meeting.iter().copied().find(|k| rows[*k].default);
        // settings that give the very same do the same work
        let stays = |k: &usize| {
            let (own, other) = (&rows[*k], &rows[cheapest]);
            other.time_s >= (1.0 - WORTH) * own.time_s
                || own.max_err == other.max_err && own.rms_err == other.rms_err && own.bytes == other.bytes
        };
        let chosen = present.filter(stays);
        let chosen = chosen.unwrap_or(cheapest);
        rows[chosen].suggested = true;
        if let Some(by) = rows[chosen].by {
            let present = own.value(by.key).filter(|value| by.holds(*value) || rows[chosen].default);
            let asked = wanted.of(by.key).filter(|value| by.holds(*value));
            suggestion.values.push((by.key, asked.or(present).unwrap_or(by.low)));
        }
    }
    suggestion
}

/// The error wanted of one family: by its own name, by its key, by the noise, by the scene.
fn limit(rows: &[AccuracyRow], members: &[usize], wanted: &Wanted, own: &Accuracy) -> Option<Limit> {
    let named = members.iter().find_map(|k| wanted.of(&rows[*k].approximation));
    if let Some(limit) = named {
        return Some(Limit::Error(limit));
    }
    let key = members.iter().find_map(|k| rows[*k].by).map(|by| by.key);
    let of_key = |limit| if key == Some("trail_px") { Limit::Key(limit) } else { Limit::Error(limit) };
    if let Some(limit) = key.and_then(|key| wanted.of(key)) {
        return Some(of_key(limit));
    }
    if let Some(share) = wanted.noise {
        return members.iter().any(|k| rows[*k].noise.is_some()).then_some(Limit::Noise(share));
    }
    key.and_then(|key| own.value(key)).map(of_key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::accuracy::Tolerance;
    use crate::study::errors::{Errors, row};

    fn psf(outside: f64, time_s: f64) -> AccuracyRow {
        let errors = Errors { max: 0.6 * outside, rms: 0.6 * outside };
        let mut row = row("psf.stamp", format!("{outside:e}"), &errors, "share", time_s, 0);
        row.by = Some(Tolerance::exactly("psf", outside));
        row.noise = Some(1e-2);
        row.default = outside == 1e-4;
        row
    }

    fn rows() -> Vec<AccuracyRow> {
        vec![psf(1e-2, 1.0), psf(1e-3, 2.0), psf(1e-4, 4.0), psf(1e-5, 9.0)]
    }

    fn suggested(words: &[&str]) -> (Suggestion, Option<String>) {
        let mut rows = rows();
        let wanted = Wanted::parse(words.iter().copied()).expect("words");
        let suggestion = suggest(&mut rows, &wanted, &Accuracy::default());
        (suggestion, rows.iter().find(|r| r.suggested).map(|r| r.setting.clone()))
    }

    #[test]
    fn the_cheapest_that_is_exact_enough() {
        for (words, setting, value) in [
            (&[][..], "1e-4", 1e-4),
            (&["psf=1e-3"], "1e-3", 1e-3),
            (&["psf.stamp=7e-3"], "1e-2", 1e-2),
            // a hundredth of the noise of 1e-2 is 1e-4
            (&["0.01"], "1e-4", 1e-4),
            (&["0.1"], "1e-3", 1e-3),
            (&["psf=1e-5", "0.1"], "1e-5", 1e-5),
        ] {
            let (suggestion, found) = suggested(words);
            assert_eq!(found.as_deref(), Some(setting), "{words:?}");
            assert_eq!(suggestion.values, [("psf", value)], "{words:?}");
        }
    }

    #[test]
    fn what_cannot_be_had_is_told() {
        let (suggestion, found) = suggested(&["psf=1e-9"]);
        assert_eq!((found, suggestion.values.len()), (None, 0));
        assert!(suggestion.unmet[0].contains("within 1e-9 share; the least is 6.0e-6"), "{:?}", suggestion.unmet);
    }

    /// A setting that is cheaper by less than a fifth, or gives the very same, does not displace the present one.
    #[test]
    fn scatter_of_times_changes_nothing() {
        let mut rows = rows();
        rows[3].time_s = 3.3;
        // the same image in less time is chance
        rows.push(AccuracyRow { time_s: 1e-3, by: None, default: false, ..rows[2].clone() });
        let suggestion = suggest(&mut rows, &Wanted::default(), &Accuracy::default());
        assert!(rows[2].suggested && suggestion.values == [("psf", 1e-4)]);
    }

    #[test]
    fn words_that_mean_nothing_are_told_all_at_once() {
        let fault = Wanted::parse(["sky=x", "skies=1e-3", "-1", "0", "psf=1e-3"]).expect_err("faults");
        assert_eq!(fault.lines().count(), 4, "{fault}");
        assert!(fault.contains("nearest: sky"), "{fault}");
    }
}
