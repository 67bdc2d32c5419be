//! Colours of the charts.

use plotters::style::RGBColor;

/// Colours that people with any colour vision tell apart (Okabe & Ito 2008).
pub(super) const COLOURS: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 94, 40),
    RGBColor(40, 40, 40),
];
