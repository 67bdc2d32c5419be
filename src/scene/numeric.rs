//! Which keys of a scene hold a number: those that a sweep may vary.

use super::keys::KEYS;
use super::schema::{Key, Kind, nearest};

/// A key that holds a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numeric {
    /// Its unit, as the scene's documentation writes it; empty for none.
    pub unit: &'static str,
    /// True if only whole numbers are allowed.
    pub whole: bool,
}

/// What a path of `--set` holds, if that is a number; `others` are further names that may have been meant.
///
/// # Errors
/// In words why it holds none, with the nearest name that does.
pub fn numeric(path: &str, others: &[&'static str]) -> Result<Numeric, String> {
    let parts = path.split('.').collect::<Vec<_>>();
    let own = |key: &&Key| matches(key.path, &parts);
    if let Some(key) = KEYS.iter().find(own) {
        return match key.kind {
            Kind::Int(..) | Kind::IntOf(..) | Kind::Size => Ok(Numeric { unit: key.unit, whole: true }),
            Kind::Real(..) | Kind::Above(..) | Kind::WordOrReal(..) => {
                Ok(Numeric { unit: key.unit, whole: false })
            }
            Kind::Reals(count, ..) => Err(format!(
                "{path} holds {count} numbers; sweep one of them: {path}.0{}",
                if count > 1 { format!(" .. {path}.{}", count - 1) } else { String::new() }
            )),
            _ => Err(format!("{path} holds no number: it must {}", key.allowed())),
        };
    }
    if let Some((last, above)) = parts.split_last()
        && last.parse::<usize>().is_ok()
        && let Some(key) = KEYS.iter().find(|key| matches(key.path, above))
    {
        match key.kind {
            Kind::Reals(..) => return Ok(Numeric { unit: key.unit, whole: false }),
            Kind::Size => return Ok(Numeric { unit: key.unit, whole: true }),
            _ => {}
        }
    }
    let swept = |key: &&Key| {
        matches!(
            key.kind,
            Kind::Int(..) | Kind::IntOf(..) | Kind::Real(..) | Kind::Above(..) | Kind::WordOrReal(..)
        )
    };
    let paths = KEYS.iter().filter(swept).filter(|key| !key.path.contains('*'));
    let paths = paths.map(|key| key.path.replace("[]", ".0")).collect::<Vec<_>>();
    // a name without its table, or one that is misspelt
    let name = path.rsplit('.').next().unwrap_or(path);
    let elsewhere = paths.iter().find(|p| p.rsplit('.').next() == Some(name)).map(String::as_str);
    let near = elsewhere.or_else(|| nearest(path, paths.iter().map(String::as_str).chain(others.iter().copied())));
    Err(format!("unknown key \"{path}\"{}", near.map_or(String::new(), |near| format!("; nearest: {near}"))))
}

/// Whether a key's path, with `[]` for an index and `*` for a name, is this one.
fn matches(pattern: &str, parts: &[&str]) -> bool {
    let mut parts = parts.iter();
    for piece in pattern.split('.') {
        let (name, many) = piece.strip_suffix("[]").map_or((piece, false), |name| (name, true));
        let found = parts.next();
        if name != "*" && found != Some(&name) || found.is_none() {
            return false;
        }
        if many && parts.next().is_none_or(|index| index.parse::<usize>().is_err()) {
            return false;
        }
    }
    parts.next().is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_from_words_tables_and_lists() {
        let of = |path: &str| numeric(path, &["mag_v"]);
        assert_eq!(of("exposures.duration_s"), Ok(Numeric { unit: "s", whole: false }));
        assert!(of("detector.binning").is_ok_and(|n| n.whole));
        assert!(of("target.0.brightness.mag_v").is_ok() && of("sky.airglow").is_ok());
        assert!(of("pointing.offset_px.1").is_ok() && of("detector.size_px").is_ok());
        for (path, part) in [
            ("exposures.start", "no number"),
            ("telescope.psf", "no number"),
            ("pointing.offset_px", "pointing.offset_px.0"),
            ("exposures.duration", "nearest: exposures.duration_s"),
            ("duration_s", "nearest: exposures.duration_s"),
            ("target.brightness.mag_v", "nearest: target.0.brightness.mag_v"),
            ("mag", "nearest: mag_v"),
            ("", "unknown key"),
            ("station", "no number"),
        ] {
            let why = of(path).expect_err(path);
            assert!(why.contains(part), "{path}: {why}");
        }
    }
}
