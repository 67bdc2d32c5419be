use super::fit_picture::{FitPoint, fit};
use super::fit_plan::Plan;

/// A light curve with residuals that alternate between `z` and `-z`.
fn curve(count: usize, curve: usize, start_s: f64, z: f64) -> Vec<FitPoint> {
    let point = |k: usize| {
        let model = 10.0 + (0.01 * k as f64).sin();
        let z = if k.is_multiple_of(2) { z } else { -z };
        let time_s = start_s + 8.0 * k as f64;
        FitPoint { time_s, flux: model + 0.1 * z, sigma: 0.1, model, held_out: k.is_multiple_of(5), curve }
    };
    (0..count).map(point).collect()
}

/// The texts of a picture, which must be XML of less than 3 MB without a number that is none.
fn texts(svg: &str) -> String {
    assert!(svg.len() < 3_000_000, "{} bytes", svg.len());
    let page = roxmltree::Document::parse(svg).expect("XML");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    page.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect::<Vec<_>>().join("\n")
}

#[test]
fn nights_and_curves_have_panels_of_their_own() {
    let mut points = curve(100, 0, 0.0, 1.0);
    points.extend(curve(100, 0, 86_400.0, 1.0));
    points.extend(curve(50, 7, 0.0, 1.0));
    points.reverse();
    let plan = Plan::of(&points);
    let panels = plan.panels.iter().map(|p| (p.curve, p.data.len(), p.ends().0)).collect::<Vec<_>>();
    assert_eq!(panels, [(0, 100, 0.0), (0, 100, 86_400.0), (7, 50, 0.0)]);
    let words = texts(&fit(&points, "nights"));
    assert!(words.contains("curve 0, +24 h") && words.contains("curve 7, +0 s"), "{words}");
}

#[test]
fn figures_of_residuals_are_those_of_all_points() {
    let words = texts(&fit(&curve(1000, 0, 0.0, 2.0), "figures"));
    assert!(words.contains("fitted: 800 points") && words.contains("held out: 200 points"), "{words}");
    assert!(words.contains("rms 2.00") && words.contains("beyond 3 sigma: 0 (normal: 2.2)"), "{words}");
}

/// Height of the first text with these words \[px\].
fn label(svg: &str, words: &str) -> f64 {
    let page = roxmltree::Document::parse(svg).expect("XML");
    let node = page.descendants().find(|n| n.has_tag_name("text") && n.text() == Some(words)).expect(words);
    node.attribute("y").and_then(|y| y.parse().ok()).expect("a place")
}

#[test]
fn marks_lie_where_the_axes_say() {
    let point = |time_s: f64, flux: f64, model: f64| FitPoint {
        time_s,
        flux,
        sigma: 0.001,
        model,
        held_out: false,
        curve: 0,
    };
    let svg = fit(&[point(0.0, 20.0, 20.0), point(1.0, 80.0, 80.3), point(2.0, 50.0, 50.1)], "axes");
    let squares = svg.split("<path d=\"").filter(|path| path.contains("h3v3h-3z"));
    let middles = |path: &str| {
        let ends = path.split("h3v3h-3z").filter_map(|mark| mark.rsplit_once(' '));
        ends.filter_map(|(_, y)| y.parse::<f64>().ok()).map(|y| y + 1.5).collect::<Vec<_>>()
    };
    let rows = squares.map(middles).collect::<Vec<_>>();
    // a label stands 4 px below its tick; places are rounded to 0.1 px
    let at = |words| label(&svg, words) - 4.0;
    assert!(at("80") < at("20") && at("-1") < at("-3"), "upwards is more");
    for (place, words) in rows[0].iter().zip(["20", "80", "50"]) {
        assert!((place - at(words)).abs() < 0.2, "{words}: {place} {}", at(words));
    }
    for (place, words) in rows[1][1..].iter().zip(["-3", "-1"]) {
        assert!((place - at(words)).abs() < 0.2, "{words}: {place} {}", at(words));
    }
}

#[test]
fn empty_single_and_bad_points_have_pictures() {
    assert!(texts(&fit(&[], "a & <b>")).contains("no point with finite flux"));
    texts(&fit(&curve(1, 0, 1e9, 0.0), "one"));
    let mut points = curve(8, 0, 0.0, 1.0);
    points[0].flux = f64::NAN;
    points[1].sigma = 0.0;
    points[2].time_s = f64::INFINITY;
    points[3].model = f64::NAN;
    points[4].sigma = 1e-300;
    points[5].time_s = 1e300;
    let words = texts(&fit(&points, "bad"));
    assert!(words.contains("2 points; 6 left out"), "{words}");
    // times at one place, zero flux
    let still = FitPoint { time_s: 0.0, flux: 0.0, sigma: 1e-3, model: 0.0, held_out: false, curve: 0 };
    texts(&fit(&[still; 5], "still"));
}

#[test]
fn many_epochs_are_thinned_and_outliers_kept() {
    let mut points = curve(10_000, 0, 0.0, 0.5);
    points[4321].flux += 1.0;
    let plan = Plan::of(&points);
    let drawn = plan.data().filter(|d| d.drawn).count();
    assert!((2400..=3001).contains(&drawn), "{drawn}");
    assert!(plan.data().any(|d| d.z > 9.0 && d.drawn));
    let words = texts(&fit(&points, &"title < & >".repeat(500)));
    assert!(words.contains("10000 points; one of 4 is drawn"), "{words}");
    assert!(words.contains("beyond 3 sigma: 1 "), "{words}");
}

#[test]
fn a_model_far_off_does_not_make_a_large_picture() {
    let points = curve(100_000, 0, 0.0, 50.0);
    let plan = Plan::of(&points);
    assert!(plan.data().filter(|d| d.drawn).count() <= 3500);
    texts(&fit(&points, "off"));
}

#[test]
fn more_panels_than_fit_are_counted() {
    let points = (0..300).flat_map(|c| curve(4, c, 0.0, 1.0)).collect::<Vec<_>>();
    assert!(texts(&fit(&points, "panels")).contains("of 300 panels the first 48 are drawn"));
}

#[test]
fn curves_of_unequal_flux_are_drawn_in_units_of_their_own() {
    let mut points = curve(100, 0, 0.0, 1.0);
    let faint = curve(100, 1, 0.0, 1.0).into_iter();
    points.extend(faint.map(|p| FitPoint {
        flux: p.flux * 1e-3,
        sigma: p.sigma * 1e-3,
        model: p.model * 1e-3,
        ..p
    }));
    let plan = Plan::of(&points);
    assert!(plan.own_units);
    assert!(plan.data().all(|d| (d.flux - 1.0).abs() < 0.15 && (d.z.abs() - 1.0).abs() < 1e-9));
    assert!(!Plan::of(&curve(100, 0, 0.0, 1.0)).own_units);
}
