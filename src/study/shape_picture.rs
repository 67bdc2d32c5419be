//! A shape seen from +x, +y and +z at one scale, with the uncertainty of its facets as tints.
//!
//! Orthographic; hidden parts are found sample by sample, so that parts may reach into each other.

use super::page::{Anchor, Page, SIDE, SMALL, TITLE, hex, number, round_below, ticks};
use super::shape_raster::{Scene, View};
use crate::io::shape_file::{Body, Class, Share};
use glam::DVec3;

/// Side of a view on the page \[px\].
const PANEL: f64 = 318.0;
/// From one view to the next \[px\].
const PITCH: f64 = 378.0;
/// Side of a view as a raster.
const PIXELS: usize = 530;
/// Halves of the extent that a view reaches from its middle.
const REACH: f64 = 1.12;
/// Top of the views \[px\].
const TOP: f64 = TITLE + 26.0;
/// Top of the legend \[px\].
const LEGEND: f64 = TOP + PANEL + 86.0;
/// Height of a row of the legend \[px\].
const ROW: f64 = 23.0;
/// Right ends of the columns of the legend \[px\].
const COLUMNS: [f64; 4] = [400.0, 530.0, 710.0, 880.0];
/// Names of the views: of the direction to the observer, to the right and upwards, and the sign of the one to the right.
pub(super) const VIEWS: [(&str, &str, &str, View); 3] = [
    ("+x", "y", "z", View { right: DVec3::Y, up: DVec3::Z, towards: DVec3::X }),
    ("+y", "x", "z", View { right: DVec3::NEG_X, up: DVec3::Z, towards: DVec3::Y }),
    ("+z", "x", "y", View { right: DVec3::X, up: DVec3::Y, towards: DVec3::Z }),
];

/// The picture as SVG.
pub fn three_sides(body: &Body, title: &str) -> String {
    let shares = body.shares();
    let shown = shares.iter().filter(|share| share.class != Class::From5 || share.faces > 0).collect::<Vec<_>>();
    let mut page = Page::new(LEGEND + ROW * (shown.len() + 1) as f64 + 48.0, title);
    let scene = Scene::of(body);
    match body.frame() {
        Some(frame) => {
            for (place, (from, right, up, view)) in VIEWS.iter().enumerate() {
                let corner = [SIDE + PITCH * place as f64, TOP];
                let heading = format!("seen from {from}");
                page.text([corner[0], corner[1] - 9.0], 15.0, Anchor::Start, &heading);
                page.raster(corner, PANEL, PIXELS, &scene.seen(view, REACH, PIXELS), "");
                axes(&mut page, corner, frame, view, [right, up], body.relative);
            }
            scale_bar(&mut page, frame.1, body.relative);
        }
        None => page.text([SIDE, TOP + 40.0], 16.0, Anchor::Start, "no facet with an extent"),
    }
    legend(&mut page, &shown);
    let y = LEGEND + ROW * (shown.len() + 1) as f64 + 22.0;
    page.text([SIDE, y], SMALL, Anchor::Start, &remarks(body, &scene));
    page.finish()
}

/// Frame, ticks and names of the axes of a view.
fn axes(
    page: &mut Page,
    [x, y]: [f64; 2],
    (middle, half): (DVec3, f64),
    view: &View,
    names: [&str; 2],
    relative: bool,
) {
    page.rectangle([x, y], [PANEL; 2], "fill=\"none\" stroke=\"#777\"");
    let unit = if relative { "" } else { ", m" };
    let scale = 0.5 * PANEL / REACH;
    let grey = "stroke=\"#777\"";
    for (upward, direction) in [(false, view.right), (true, view.up)] {
        // ticks are of the axis itself, which may run to the left
        let sign = (direction.x + direction.y + direction.z).signum();
        let centre = sign * middle.dot(direction);
        for (value, label) in ticks(centre - REACH * half, centre + REACH * half, 6.0) {
            let along = sign * (value - centre) / half * scale;
            if upward {
                let at = y + 0.5 * PANEL - along;
                page.line([x - 4.0, at], [x, at], grey);
                page.text([x - 7.0, at + 4.0], 12.0, Anchor::End, &label);
            } else {
                let at = x + 0.5 * PANEL + along;
                page.line([at, y + PANEL], [at, y + PANEL + 4.0], grey);
                page.text([at, y + PANEL + 17.0], 12.0, Anchor::Middle, &label);
            }
        }
    }
    let [right, up] = names;
    page.text([x + 0.5 * PANEL, y + PANEL + 35.0], SMALL, Anchor::Middle, &format!("{right}{unit}"));
    page.upward([x - 40.0, y + 0.5 * PANEL], SMALL, &format!("{up}{unit}"));
}

fn scale_bar(page: &mut Page, half: f64, relative: bool) {
    let length = round_below(0.8 * half);
    let pixels = length / half * 0.5 * PANEL / REACH;
    let y = TOP + PANEL + 58.0;
    let ends = [SIDE, SIDE + pixels];
    let dark = "stroke=\"#222\" stroke-width=\"2\"";
    page.line([ends[0], y], [ends[1], y], dark);
    for x in ends {
        page.line([x, y - 5.0], [x, y + 5.0], dark);
    }
    let unit = if relative { "in relative units: the scale is unknown" } else { "m" };
    page.text([ends[1] + 10.0, y + 4.5], SMALL, Anchor::Start, &format!("{} {unit}", number(length)));
}

/// The classes as a table: what they mean, and what they hold.
fn legend(page: &mut Page, shares: &[&Share]) {
    let pattern = hex(Class::Unobserved.colour());
    page.add(format_args!(
        "<defs><pattern id=\"stripes\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" \
         patternTransform=\"rotate(-45)\"><rect width=\"6\" height=\"6\" fill=\"#e6bcd3\"/>\
         <rect width=\"6\" height=\"3\" fill=\"{pattern}\"/></pattern></defs>"
    ));
    let mut row = |y: f64, cells: [String; 4]| {
        for (x, cell) in COLUMNS.into_iter().zip(cells) {
            page.text([x, y], SMALL, Anchor::End, &cell);
        }
    };
    row(
        LEGEND + 12.0,
        ["facets", "of the surface", "median sd of normals", "median sd of areas"].map(str::to_owned),
    );
    for (k, share) in shares.iter().enumerate() {
        let known = |value: f64, words: String| if value.is_finite() { words } else { String::new() };
        let cells = [
            share.faces.to_string(),
            format!("{:.1} %", 100.0 * share.surface),
            known(share.sd_deg, format!("{:.2} deg", share.sd_deg)),
            known(share.relative_area_sd, format!("{:.2} %", 100.0 * share.relative_area_sd)),
        ];
        row(LEGEND + ROW * (k + 1) as f64 + 12.0, cells);
    }
    for (k, share) in shares.iter().enumerate() {
        let y = LEGEND + ROW * (k + 1) as f64;
        let fill = match share.class {
            Class::Unobserved => "url(#stripes)".to_owned(),
            class => hex(class.colour()),
        };
        page.rectangle([SIDE, y], [20.0, 14.0], &format!("fill=\"{fill}\" stroke=\"#222\" stroke-width=\"0.7\""));
        page.text([SIDE + 28.0, y + 12.0], SMALL, Anchor::Start, share.class.words());
    }
}

fn remarks(body: &Body, scene: &Scene) -> String {
    let mut words = String::from("Orthographic, one scale; shaded by a light over the observer's shoulder.");
    if !scene.has_all_edges() {
        words += " Only outlines are drawn as edges: the facets are too many.";
    }
    match body.left_out() {
        0 => {}
        1 => words += " 1 facet is left out: its corners are not finite, missing or fewer than 3.",
        more => {
            words +=
                &format!(" {more} facets are left out: their corners are not finite, missing or fewer than 3.")
        }
    }
    words
}
