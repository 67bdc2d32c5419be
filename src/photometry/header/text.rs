//! Angles and sections of pixels as people and programs write them.

/// An angle as written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Written {
    /// In units of the first number: hours or degrees.
    pub value: f64,
    /// Written with minutes.
    pub sexagesimal: bool,
}

/// An angle like `-16 10 58.8`, `18:20:48.12`, `33d21m32sN` or `149.06`; S and W are negative. None: no such form.
pub(super) fn angle(text: &str) -> Option<Written> {
    let text = text.trim();
    let units = text.contains(|c: char| "dDhHmM°'\"".contains(c));
    let letter = |c: &char| "NSEWnsew".contains(*c);
    // an S at the end is south unless other unit letters make it a second
    let last = text.chars().last().filter(letter);
    let last = last.filter(|c| !units || !"sS".contains(*c) || text.ends_with(" S"));
    let hemisphere = last.or(text.chars().next().filter(letter)).map(|c| c.to_ascii_uppercase());
    let body = text.trim_matches(|c| letter(&c)).trim();
    let (negative, body) = match body.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, body.strip_prefix('+').unwrap_or(body)),
    };
    let separator = |c: char| c.is_whitespace() || ":dDhHmMsS°'\"′″".contains(c);
    let mut parts = Vec::new();
    for part in body.split(separator).filter(|p| !p.is_empty()) {
        if parts.len() == 3 || !part.bytes().all(|b| b.is_ascii_digit() || b == b'.') {
            return None;
        }
        parts.push(part.parse::<f64>().ok()?);
    }
    let (whole, rest) = parts.split_first()?;
    if rest.iter().any(|p| *p > 60.0) || (!rest.is_empty() && whole.fract() != 0.0) {
        return None;
    }
    let [minutes, seconds] = [0, 1].map(|k| rest.get(k).copied().unwrap_or(0.0));
    let size = whole + minutes / 60.0 + seconds / 3600.0;
    let south_or_west = hemisphere.is_some_and(|c| c == 'S' || c == 'W');
    let value = if negative != south_or_west { -size } else { size };
    value.is_finite().then_some(Written { value, sexagesimal: !rest.is_empty() })
}

/// A part of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Section {
    /// First column, from 0.
    pub x0: usize,
    /// First row, from 0.
    pub y0: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// A section like `[1:2048,1:2048]` (IRAF; from 1, ends included) that lies within `size`.
pub(super) fn section(text: &str, size: [usize; 2]) -> Option<Section> {
    let inner = text.trim().strip_prefix('[')?.strip_suffix(']')?;
    let (x, y) = inner.split_once(',')?;
    let range = |text: &str, limit: usize| {
        let (from, to) = text.split_once(':')?;
        let (from, to) = (from.trim().parse::<usize>().ok()?, to.trim().parse::<usize>().ok()?);
        (1 <= from && from <= to && to <= limit).then(|| (from - 1, to - from + 1))
    };
    let ((x0, width), (y0, height)) = (range(x, size[0])?, range(y, size[1])?);
    Some(Section { x0, y0, width, height })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_read_in_every_usual_form() {
        let degrees = |text: &str| angle(text).map(|w| (w.value * 3600.0).round() / 3600.0);
        let dms = |d: f64, m: f64, s: f64| Some(((d * 3600.0 + m * 60.0 + s).round()) / 3600.0);
        for text in ["33 21 32", "33:21:32", "33d21m32s", "+33 21 32.0", "33 21 32 N", "33d21m32sN", "33°21'32\""]
        {
            assert_eq!(degrees(text), dms(33.0, 21.0, 32.0), "{text}");
        }
        for text in ["-33 21 32", "33 21 32 S", "33 21 32S", "33d21m32s S", "S33 21 32", "-33:21:32.00"] {
            assert_eq!(degrees(text), dms(33.0, 21.0, 32.0).map(|x| -x), "{text}");
        }
        // the sign of a zero degree counts
        assert_eq!(degrees("-00 30 00"), Some(-0.5));
        assert_eq!(angle("70.75W"), Some(Written { value: -70.75, sexagesimal: false }));
        assert_eq!(angle("149.0642"), Some(Written { value: 149.0642, sexagesimal: false }));
        let none =
            ["", "N", "-", "abc", "12 61 00", "12.5 30 00", "1 2 3 4", "--3", "1e5", "NaN", "inf", "-22:57:08:99"];
        for text in none {
            assert_eq!(angle(text), None, "{text}");
        }
    }

    #[test]
    fn sections_must_lie_on_the_frame() {
        let found = section(" [3:10,1:8]", [10, 8]);
        assert_eq!(found, Some(Section { x0: 2, y0: 0, width: 8, height: 8 }));
        for text in ["[0:3,1:2]", "[1:11,1:8]", "[5:4,1:2]", "[1:3]", "1:3,1:2", "[a:b,c:d]", "[-1:3,1:2]"] {
            assert_eq!(section(text, [10, 8]), None, "{text}");
        }
    }
}
