//! Pictures of light curves: what stands where in the SVG.

use super::curve_picture::*;
use crate::astro::time::Instant;

fn at(seconds: f64) -> Instant {
    Instant::from_utc("2024-05-06T22:00:00").unwrap().plus(seconds)
}

fn point(seconds: f64, mag: f64) -> Point {
    Point { time: at(seconds), mag, mag_err: 0.0, flags: 0 }
}

fn picture(points: Vec<Point>) -> Picture {
    Picture {
        title: "T".into(),
        ordinate: "V, mag".into(),
        series: vec![Series { name: "A".into(), points, model: Vec::new() }],
        abscissa: Abscissa::Time,
        panels: false,
        residuals: false,
    }
}

/// Centres and radii of circles \[px\].
fn circles(svg: &str) -> Vec<(f64, f64, f64)> {
    let number = |tag: &str, name: &str| -> f64 {
        let (_, rest) = tag.split_once(&format!(" {name}=\"")).unwrap();
        rest.split_once('"').unwrap().0.parse().unwrap()
    };
    svg.split("<circle").skip(1).map(|tag| (number(tag, "cx"), number(tag, "cy"), number(tag, "r"))).collect()
}

/// Circles of points: those of the legend are larger.
fn marks(svg: &str) -> Vec<(f64, f64)> {
    circles(svg).into_iter().filter(|c| c.2 <= 4.0).map(|c| (c.0, c.1)).collect()
}

#[test]
fn bright_is_up_and_later_is_right_in_proportion() {
    let text = svg(&picture(vec![point(0.0, 10.0), point(50.0, 11.0), point(100.0, 14.0)])).unwrap();
    let [a, b, c] = marks(&text)[..] else { panic!("{text}") };
    assert!(a.1 < b.1 && b.1 < c.1 && a.0 < b.0);
    // to a pixel, to which places are rounded
    assert!(((c.0 - b.0) - (b.0 - a.0)).abs() <= 1.0, "{a:?} {b:?} {c:?}");
    assert!(((c.1 - b.1) - 3.0 * (b.1 - a.1)).abs() <= 3.0, "{a:?} {b:?} {c:?}");
    assert!(text.contains("fill=\"#FFFFFF\"") && text.contains("UTC, 2024-05-06"));
}

#[test]
fn the_legend_stands_below_every_point() {
    let mut points = (0..200).map(|k| point(f64::from(k), 10.0 + (f64::from(k) * 0.7).sin())).collect::<Vec<_>>();
    points.iter_mut().for_each(|p| p.mag_err = 5.0);
    let text = svg(&picture(points)).unwrap();
    let legend = circles(&text).into_iter().filter(|c| c.2 > 4.0).map(|c| c.1).fold(f64::MAX, f64::min);
    let lines =
        text.split("<polyline").skip(1).flat_map(|t| t.split_once("points=\"").unwrap().1.split('"').next());
    let lowest = lines.flat_map(str::split_whitespace).filter_map(|p| p.split_once(',')?.1.parse::<f64>().ok());
    let lowest = lowest.fold(0.0, f64::max);
    assert!(legend < 1e9 && lowest > 100.0 && lowest < legend - 20.0, "{lowest} {legend}");
    assert!(marks(&text).iter().all(|p| p.1 < legend - 20.0));
}

#[test]
fn flags_have_marks_of_their_own_and_words() {
    let plain = svg(&picture(vec![point(0.0, 10.0), point(1.0, 11.0)])).unwrap();
    assert!(!plain.contains("saturated") && !plain.contains("not detected"));
    for (flags, words) in [
        (1, "saturated"),
        (2, "saturated"),
        (4, "cosmic ray"),
        (256, "bad pixel"),
        (64, "borrowed"),
        (129, "not detected"),
    ] {
        let flagged = Point { flags, ..point(1.0, 11.0) };
        let text = svg(&picture(vec![point(0.0, 10.0), flagged])).unwrap();
        let tags = text.split("<circle").skip(1).filter_map(|t| t.split('>').next());
        let filled = tags.filter(|t| t.contains("r=\"4\"") && !t.contains("fill=\"none\""));
        assert_eq!((filled.count(), text.contains(words)), (1, true), "{flags}");
    }
}

#[test]
fn a_phase_has_two_turns() {
    let abscissa = Abscissa::Phase { period_s: 40.0, epoch: at(-10.0) };
    let text = svg(&Picture { abscissa, ..picture(vec![point(0.0, 10.0), point(80.0, 11.0)]) }).unwrap();
    let marks = marks(&text);
    // phase 0.25 of both, and a turn later
    assert_eq!(marks.len(), 4);
    assert!((marks[0].0 - marks[2].0).abs() < 1e-9 && (marks[1].0 - marks[3].0).abs() < 1e-9);
    let width = marks[1].0 - marks[0].0;
    assert!(width > 500.0 && text.contains(">\n0.25\n"), "{width}");
    for period_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let abscissa = Abscissa::Phase { period_s, epoch: at(0.0) };
        assert!(svg(&Picture { abscissa, ..picture(vec![point(0.0, 10.0)]) }).is_err());
    }
}

#[test]
fn residuals_are_magnitudes_minus_the_model_between_its_epochs() {
    let mut shown = picture(vec![point(25.0, 10.5), point(50.0, 10.5), point(75.0, 10.5), point(200.0, 10.5)]);
    shown.series[0].model = vec![(at(0.0), 10.0), (at(100.0), 11.0)];
    shown.residuals = true;
    let all = marks(&svg(&shown).unwrap());
    // four magnitudes, then three residuals: +0.25, 0, -0.25; the model says nothing of the fourth
    assert_eq!(all.len(), 7);
    let [up, zero, down] = all[4..] else { panic!() };
    assert!(up.1 > zero.1 && zero.1 > down.1 && ((up.1 - zero.1) - (zero.1 - down.1)).abs() <= 1.0, "{all:?}");
    assert_eq!(zero.0, all[1].0);
}

#[test]
fn panels_and_more_curves_than_colours() {
    let one = picture(vec![point(0.0, 10.0)]).series[0].clone();
    let named = |k: usize| Series { name: format!("target {k}"), ..one.clone() };
    let many = Picture { series: (0..11).map(named).collect(), panels: true, ..picture(Vec::new()) };
    let text = svg(&many).unwrap();
    assert!(text.contains("3 more are not shown") && text.contains("target 7, mag") && !text.contains("target 8"));
    assert_eq!(marks(&text).len(), 8);
}

#[test]
fn any_numbers_and_names_make_a_picture() {
    let nan = f64::NAN;
    let odd = [nan, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 1e-300, 0.0, -0.0, 1e17];
    for mag in odd {
        for err in odd {
            let odd_point = Point { mag_err: err, flags: u32::MAX, ..point(0.0, mag) };
            let mut shown = picture(vec![odd_point, point(1e300, 3.0), point(1.0, mag)]);
            shown.series[0].model = vec![(at(0.0), mag), (at(0.0), err), (at(1e9), 1.0)];
            shown.residuals = true;
            shown.series[0].name = "<b>&\"\0é".into();
            let text = svg(&shown).unwrap();
            assert!(text.ends_with("</svg>\n") && !text.contains("<b>"), "{mag} {err}");
        }
    }
    let empty = Picture { series: Vec::new(), ..picture(Vec::new()) };
    assert!(svg(&empty).unwrap().contains("no finite magnitude"));
    assert_eq!(svg(&empty), svg(&empty));
}
