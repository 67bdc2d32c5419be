//! Pieces of HTML: escaped texts, short numbers, templates.

pub(super) use crate::study::page::escaped;

/// A cell of a table: a number shortened by what its column holds, whole in its `value`; else the text.
pub(super) fn cell(text: &str, column: &str) -> String {
    let number = if super::sheet::TEXTS.contains(&column) { None } else { text.parse::<f64>().ok() };
    match number {
        Some(value) if value.is_nan() => "<td class=\"n\"><data value=\"nan\">&ndash;</data></td>".into(),
        Some(value) => {
            format!("<td class=\"n\"><data value=\"{}\">{}</data></td>", escaped(text), short(value, column))
        }
        None => format!("<td>{}</td>", escaped(text)),
    }
}

/// A number as short as its column needs it; the true minus sign.
pub(super) fn short(value: f64, column: &str) -> String {
    let ends = |endings: &[&str]| endings.iter().any(|e| column.ends_with(e));
    let plain = value.abs() < 1e6;
    let text = if ends(&["frame", "flags", "bytes"]) {
        format!("{value}")
    } else if ends(&["mag_v", "mag_v_norm", "mag_err", "_mag"]) && plain {
        format!("{value:.3}")
    } else if ends(&["_deg", "_px"]) && !ends(&["e_px"]) && plain {
        format!("{value:.2}")
    } else if ends(&["_km"]) && plain {
        format!("{value:.0}")
    } else {
        digits(value, 4)
    };
    text.replacen('-', "\u{2212}", if text.contains('e') { 2 } else { 1 })
}

/// A number of so many significant digits.
pub(super) fn digits(value: f64, count: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let power = value.abs().log10().floor();
    if !(-3.0..7.0).contains(&power) {
        return format!("{value:.*e}", count - 1);
    }
    let decimals = (count as f64 - 1.0 - power).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A template in which every `{{name}}` gives way to what `value` says; what is filled in is not looked at again.
pub(super) fn fill(template: &str, value: impl Fn(&str) -> String) -> String {
    let mut out = String::new();
    let mut rest = template;
    let next = |text: &str| {
        let open = text.find("{{")?;
        Some([open, open + text[open..].find("}}")?])
    };
    while let Some([open, close]) = next(rest) {
        out.push_str(&rest[..open]);
        out.push_str(&value(&rest[open + 2..close]));
        rest = &rest[close + 2..];
    }
    out + rest
}

/// JSON that may stand inside a script element, whatever its texts hold.
pub(super) fn data(value: &serde_json::Value) -> String {
    let text = value.to_string();
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => out.push(c),
        }
    }
    out
}

/// A note in words.
pub(super) fn note(text: &str) -> String {
    format!("<p class=\"note\">{}</p>", escaped(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_true() {
        for (value, column, shown) in [
            (11.793044564109222, "mag_v", "11.793"),
            (-32.81483523387756, "sun_el_deg", "\u{2212}32.81"),
            (66512.70843676035, "flux_e", "66513"),
            (0.25, "mean_e_px", "0.25"),
            (1.942e-7, "max_err", "1.942e\u{2212}7"),
            (37001.86, "range_km", "37002"),
            (12.0, "frame", "12"),
            (0.0, "bound", "0"),
            (9.999999, "x", "10"),
            (1e300, "x_deg", "1.000e300"),
            (f64::INFINITY, "x", "inf"),
        ] {
            assert_eq!(short(value, column), shown, "{value} {column}");
        }
    }

    #[test]
    fn templates_are_filled_once() {
        let filled =
            fill("a {{x}} b {{y}} {{", |name| if name == "x" { "{{y}}".into() } else { name.to_uppercase() });
        assert_eq!(filled, "a {{y}} b Y {{");
    }

    #[test]
    fn data_cannot_end_its_script() {
        let text = "</script><!--\u{2028} & \"é\"";
        let out = data(&serde_json::json!([text]));
        assert!(!out.contains('<') && !out.contains('>') && !out.contains('\u{2028}'));
        assert_eq!(serde_json::from_str::<Vec<String>>(&out).expect("JSON"), [text]);
    }
}
