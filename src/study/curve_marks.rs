//! The marks of points of light curves, by the flags of their measurement, and the samples of a legend.

use crate::photometry::flag;
use plotters::coord::Shift;
use plotters::prelude::*;

pub(super) type Drawn = Result<(), Box<dyn std::error::Error>>;
pub(super) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Kinds of points: flags, and what they mean, the gravest first.
pub(super) const KINDS: [(u32, &str); 4] = [
    (flag::NOT_DETECTED, "not detected"),
    (flag::SATURATED | flag::BLOOMED, "saturated or bloomed"),
    (
        flag::COSMIC_RAY | flag::EDGE | flag::TRAIL_CROSSING | flag::NEIGHBOUR | flag::BAD_PIXEL,
        "cosmic ray, edge, trail, neighbour or bad pixel",
    ),
    (flag::BORROWED_ZERO_POINT, "borrowed zero point"),
];

/// Number of the kind of a point in [`KINDS`]; none if it has no flag of theirs.
pub(super) fn kind(flags: u32) -> Option<usize> {
    KINDS.iter().position(|(mask, _)| flags & mask != 0)
}

/// A sample of the legend.
#[derive(Clone, Copy)]
pub(super) enum Mark {
    /// A point of that colour.
    Colour(RGBColor),
    /// The line of a model.
    Line,
    /// A point of a kind of [`KINDS`].
    Kind(usize),
    /// Words alone.
    None,
}

/// The mark of a point of that kind at a pixel of the area.
pub(super) fn symbol(area: &Area, kind: Option<usize>, (x, y): (i32, i32), r: i32, colour: RGBColor) -> Drawn {
    let thin = colour.stroke_width(1);
    match kind {
        None => area.draw(&Circle::new((x, y), r, colour.filled()))?,
        Some(0) => {
            area.draw(&PathElement::new(vec![(x - r, y - r), (x + r, y - r), (x, y + r), (x - r, y - r)], thin))?
        }
        Some(1) => {
            let corners = vec![(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r), (x - r, y - r)];
            area.draw(&PathElement::new(corners, thin))?;
        }
        Some(2) => {
            area.draw(&PathElement::new(vec![(x - r, y - r), (x + r, y + r)], colour.stroke_width(2)))?;
            area.draw(&PathElement::new(vec![(x - r, y + r), (x + r, y - r)], colour.stroke_width(2)))?;
        }
        Some(_) => area.draw(&Circle::new((x, y), r, thin))?,
    }
    Ok(())
}

/// The sample of a legend's entry around a pixel.
pub(super) fn sample(area: &Area, mark: Mark, (x, y): (i32, i32)) -> Drawn {
    match mark {
        Mark::Colour(colour) => symbol(area, None, (x, y), 6, colour),
        Mark::Line => Ok(area.draw(&PathElement::new(vec![(x - 10, y), (x + 10, y)], BLACK.stroke_width(2)))?),
        Mark::Kind(number) => symbol(area, Some(number), (x, y), 5, RGBColor(70, 70, 70)),
        Mark::None => Ok(()),
    }
}
