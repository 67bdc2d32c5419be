//! A page of SVG: escaped texts, numbers, ticks and rasters.

use crate::io::preview::rgb_png;
use base64::Engine;
use plotters::style::RGBColor;
use std::fmt::{Arguments, Write};

/// Width of a page \[px\].
pub(super) const WIDTH: f64 = 1200.0;
/// Margin at its left and right \[px\].
pub(super) const SIDE: f64 = 64.0;
/// Height of its title \[px\].
pub(super) const TITLE: f64 = 52.0;
/// Size of letters \[px\].
pub(super) const SMALL: f64 = 13.0;
/// Most characters of a title that are kept beside the page.
const MOST_TITLE: usize = 2000;

/// Where a text stands about its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// A page that grows.
pub(super) struct Page(String);

impl Page {
    /// A white page with a title; one that is too long is cut, and whole in the page's own name.
    pub fn new(height: f64, title: &str) -> Self {
        let name = escaped(&title.chars().take(MOST_TITLE).collect::<String>());
        let mut page = Self(format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" fill=\"#222\">\n<title>{name}</title>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"white\"/>\n"
        ));
        page.text([SIDE, 32.0], 20.0, Anchor::Start, &fitting(title, 20.0, WIDTH - 2.0 * SIDE));
        page
    }

    /// Elements as they are written.
    pub fn add(&mut self, elements: Arguments) {
        // writing to a string cannot fail
        let _ = self.0.write_fmt(elements);
        self.0.push('\n');
    }

    /// A line of text.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        self.add(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\">{text}</text>"
        ));
    }

    /// A line of text upwards around its middle.
    pub fn upward(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        let text = escaped(text);
        self.add(format_args!(
            "<text transform=\"translate({x:.1},{y:.1}) rotate(-90)\" font-size=\"{size}\" \
             text-anchor=\"middle\">{text}</text>"
        ));
    }

    /// A straight line.
    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], style: &str) {
        self.add(format_args!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>"));
    }

    /// A rectangle from its upper left corner.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], style: &str) {
        self.add(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" {style}/>"
        ));
    }

    /// A square raster of red, green and blue, by rows from the top, `pixels` a side.
    pub fn raster(&mut self, [x, y]: [f64; 2], side: f64, pixels: usize, rgb: &[u8], style: &str) {
        let png = rgb_png(pixels, pixels, rgb);
        // writing to memory fails only for sizes that no raster of ours has
        debug_assert!(png.is_ok(), "{png:?}");
        let data = base64::engine::general_purpose::STANDARD.encode(png.unwrap_or_default());
        self.add(format_args!(
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{side:.1}\" height=\"{side:.1}\" {style} \
             href=\"data:image/png;base64,{data}\"/>"
        ));
    }

    /// The whole.
    pub fn finish(mut self) -> String {
        self.0.push_str("</svg>\n");
        self.0
    }
}

/// A text as XML may hold it; characters that it may not hold become blanks.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Width of a text \[px\], as common fonts have it.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let of = |c: char| match c {
        'i' | 'j' | 'l' | '.' | ',' | ':' | ';' | '\'' | '|' | ' ' => 0.34,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.98,
        'A'..='Z' => 0.72,
        '\0'..='\u{24f}' => 0.62,
        _ => 1.05,
    };
    size * text.chars().map(of).sum::<f64>()
}

/// As much of a text as fits in a width \[px\].
pub(super) fn fitting(text: &str, size: f64, room: f64) -> String {
    let mut out = String::new();
    let mut used = width("…", size);
    for c in text.chars() {
        used += width(c.encode_utf8(&mut [0; 4]), size);
        if used > room {
            out.push('…');
            break;
        }
        out.push(c);
    }
    out
}

/// A colour as SVG writes it.
pub(super) fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A colour of the palette as SVG writes it.
pub(super) fn named(RGBColor(r, g, b): RGBColor) -> String {
    hex([r, g, b])
}

/// Greatest of 1, 2 and 5 times a power of ten that is not above a value; 0 for values that are not positive and finite.
pub(super) fn round_below(value: f64) -> f64 {
    let fits = |factor: &&f64| **factor <= value / power_below(value) * (1.0 + 1e-9);
    [5.0, 2.0, 1.0].iter().find(fits).map_or(0.0, |factor| factor * power_below(value))
}

/// Least of them that is not below the value.
fn round_above(value: f64) -> f64 {
    let fits = |factor: &&f64| **factor >= value / power_below(value) * (1.0 - 1e-9);
    [1.0, 2.0, 5.0, 10.0].iter().find(fits).map_or(0.0, |factor| factor * power_below(value))
}

/// Greatest power of ten not above a value; 0 for values that are not positive and finite, or next to nothing.
fn power_below(value: f64) -> f64 {
    let sound = value.is_finite() && value > 1e-290;
    if sound { 10f64.powi((value.log10() + 1e-10).floor() as i32) } else { 0.0 }
}

/// Round values between two ends, about `most` of them and not many more, and their labels.
pub(super) fn ticks(low: f64, high: f64, most: f64) -> Vec<(f64, String)> {
    let step = round_above((high - low) / most.max(1.0));
    let first = (low / step).ceil();
    // beyond this, neighbouring steps are one number
    if !(step > 0.0 && first.abs() < 1e15 && (high - low).is_finite()) {
        return Vec::new();
    }
    let decimals = (-step.log10()).ceil().max(0.0) as usize;
    let plain = decimals < 6 && low.abs().max(high.abs()) < 1e6;
    let label = |v: f64| if plain { format!("{v:.decimals$}") } else { format!("{:e}", rounded(v, step)) };
    let count = (high / step).floor() - first;
    // a zero without a sign
    let values = (0..=count.clamp(0.0, 100.0) as usize).map(|k| (first + k as f64) * step + 0.0);
    values.map(|v| (v, label(v))).collect()
}

/// A value without digits below a thousandth of a step.
fn rounded(value: f64, step: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let digits = (value.abs() / step).log10().ceil().clamp(0.0, 14.0) as usize + 1;
    format!("{value:.digits$e}").parse().unwrap_or(value)
}

/// A number of at most six digits.
pub(super) fn number(value: f64) -> String {
    let value = format!("{value:.5e}").parse().unwrap_or(value);
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_valid_xml_whatever_they_hold() {
        let text = "a & b < c > d \" \u{0}\u{1b}\u{ffff}\u{7f}";
        let page = format!("<svg a=\"{0}\">{0}</svg>", escaped(text));
        let read = roxmltree::Document::parse(&page).expect("XML");
        assert!(read.root_element().text().is_some_and(|t| t.starts_with("a & b < c > d \" ")));
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (low, high) in [(0.0, 1.0), (-3.2, 17.0), (1e6, 1.0001e6), (1e-9, 3e-9), (-1e300, 1e300), (5.0, 5.2)] {
            let ticks = ticks(low, high, 5.0);
            assert!((2..=10).contains(&ticks.len()), "{low} {high}: {ticks:?}");
            let size: f64 = f64::max(low.abs(), high.abs());
            assert!(ticks.iter().all(|(v, _)| *v >= low - 1e-9 * size && *v <= high + 1e-9 * size));
            let read = |label: &str| label.parse::<f64>().expect("a number");
            // labels say where the tick is, to a hundredth of the span
            assert!(ticks.iter().all(|(v, l)| (read(l) - v).abs() < 1e-2 * (high - low)), "{ticks:?}");
        }
        for (low, high) in
            [(f64::NAN, 1.0), (1.0, 1.0), (1.0, 0.0), (0.0, f64::INFINITY), (-1e308, 1.7e308), (1e20, 1.0001e20)]
        {
            assert!(ticks(low, high, 5.0).len() < 12, "{low} {high}");
        }
    }

    #[test]
    fn round_numbers_are_below() {
        for (value, round) in
            [(1.0, 1.0), (0.99, 0.5), (7.3, 5.0), (2e-12, 2e-12), (1.0e300, 1e300), (0.1 + 0.2, 0.2)]
        {
            assert!((round_below(value) / round - 1.0).abs() < 1e-9, "{value}");
        }
        for value in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(round_below(value), 0.0);
        }
    }

    #[test]
    fn long_texts_are_cut_to_the_room() {
        let cut = fitting(&"wide ".repeat(1000), 20.0, 500.0);
        assert!(cut.ends_with('…') && width(&cut, 20.0) <= 500.0);
        assert_eq!(fitting("short", 20.0, 500.0), "short");
    }
}
