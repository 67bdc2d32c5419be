//! The light of the stars: catalogue, synthetic stars and diffuse remainder together.

use nightglass::astro::{direction, separation};
use nightglass::base::units::flux_from_mag;
use nightglass::stars::catalogue::Catalogue;
use nightglass::stars::cells::{BANDS, Bounds, cells_before};
use nightglass::stars::counts::{Counts, DEG2_PER_SR, Galactic};
use nightglass::stars::drawn::Drawn;
use nightglass::stars::field::{self, Cone};
use nightglass::stars::synthetic;

/// One cell of the sky in so many is looked at.
const EVERY: usize = 23;

/// Bands of galactic latitude \[deg\].
const LATITUDES: [(f64, f64); 7] =
    [(0.0, 5.0), (5.0, 10.0), (10.0, 20.0), (20.0, 30.0), (30.0, 45.0), (45.0, 60.0), (60.0, 90.0)];

struct Cell {
    number: usize,
    place: Galactic,
    deg2: f64,
}

fn cells(low: f64, high: f64) -> impl Iterator<Item = Cell> {
    (0..cells_before(BANDS)).step_by(EVERY).filter_map(move |number| {
        let bounds = Bounds::of(number);
        let [ra, dec] = bounds.place(0.5, 0.5);
        let place = Galactic::of(direction(ra, dec));
        let b = place.b.abs().to_degrees();
        (low..high).contains(&b).then(|| Cell { number, place, deg2: bounds.solid_angle() * DEG2_PER_SR })
    })
}

fn s10(mags: impl Iterator<Item = f64>) -> f64 {
    mags.map(|m| flux_from_mag(m - 10.0)).sum()
}

/// S10 of a band of latitude with stars drawn down to `limit`: catalogue, synthetic, remainder.
fn light(catalogue: &Catalogue, (low, high): (f64, f64), limit: f64) -> [f64; 3] {
    let (mut sum, mut area) = ([0.0; 3], 0.0);
    for cell in cells(low, high) {
        sum[0] += s10(catalogue.cell_mags(cell.number).filter(|m| *m < limit));
        sum[1] += s10(synthetic::stars(catalogue, cell.number, limit).iter().map(|s| s.mag_v));
        sum[2] += Counts::at(cell.place).s10(limit, f64::INFINITY) * cell.deg2;
        area += cell.deg2;
    }
    sum.map(|s| s / area)
}

/// What is not drawn is diffuse: from a limit of 14 to one of 20 the sum stays within 1 %.
#[test]
fn the_drawing_limit_moves_light_and_makes_none() {
    let catalogue = Catalogue::built_in();
    for band in LATITUDES {
        let [shallow, deep] = [14.0, 20.0].map(|limit| light(&catalogue, band, limit));
        let [a, b] = [shallow, deep].map(|parts| parts.iter().sum::<f64>());
        println!(
            "|b| {:2}-{:2}: S10 of catalogue, synthetic, rest at 14: {:6.1} {:6.1} {:6.1}; at 20: {:6.1} {:6.1} {:6.2}; \
             together {a:.1} {b:.1}",
            band.0, band.1, shallow[0], shallow[1], shallow[2], deep[0], deep[1], deep[2]
        );
        assert!((b / a - 1.0).abs() < 0.01, "{band:?}: {a} {b}");
    }
}

/// Stars per square degree against the counts of Tycho-2 that `catalogs/starlight/bs80_bright_end.csv` lists, |b| > 20 deg.
#[test]
fn stars_are_as_many_as_counted() {
    let catalogue = Catalogue::built_in();
    let text = include_str!("../catalogs/starlight/bs80_bright_end.csv");
    for line in text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit())) {
        let v = line.split(',').map(|v| v.parse::<f64>().expect("a number")).collect::<Vec<_>>();
        let (limit, known) = (v[2] - 0.07, v[3]);
        let (mut found, mut area) = (0.0, 0.0);
        for cell in cells(v[0], v[1]) {
            let drawn = catalogue.cell_mags(cell.number).filter(|m| *m < limit).count()
                + synthetic::stars(&catalogue, cell.number, limit).len();
            found += drawn as f64;
            area += cell.deg2;
        }
        // 15 %, and three standard deviations of the stars in the cells looked at
        let allowed = 0.15 + 3.0 / found.sqrt();
        assert!((found / area / known - 1.0).abs() < allowed, "{line}: {}", found / area);
    }
}

/// The counts alone, where the catalogue is complete, against the catalogue: 15 %.
#[test]
fn corrected_counts_agree_with_the_catalogue() {
    let catalogue = Catalogue::built_in();
    for band in &LATITUDES[3..] {
        let (mut listed, mut counted) = (0.0, 0.0);
        for cell in cells(band.0, band.1) {
            let limit = catalogue.cell_complete_to(cell.number).min(11.0);
            listed += catalogue.cell_mags(cell.number).filter(|m| *m < limit).count() as f64;
            counted += Counts::at(cell.place).brighter_than(limit) * cell.deg2;
        }
        println!("|b| {}-{}: {listed} listed, {counted:.0} by the counts", band.0, band.1);
        assert!((counted / listed - 1.0).abs() < 0.15, "{band:?}");
    }
}

/// Beyond its completeness the thinned catalogue is a lower limit, which the uncorrected counts must not fall short of by more
/// than 15 %; what is drawn makes up the counts.
#[test]
fn counts_beyond_the_correction_are_not_far_below_the_catalogue() {
    let catalogue = Catalogue::built_in();
    for band in &LATITUDES[3..] {
        for limit in [11.93, 12.43] {
            let (mut listed, mut counted, mut drawn) = (0.0, 0.0, 0.0);
            for cell in cells(band.0, band.1) {
                let own = catalogue.cell_mags(cell.number).filter(|m| *m < limit).count() as f64;
                listed += own;
                drawn += own + synthetic::stars(&catalogue, cell.number, limit).len() as f64;
                counted += Counts::at(cell.place).brighter_than(limit) * cell.deg2;
            }
            println!(
                "|b| {}-{} V < {limit}: {listed} listed, {drawn} drawn, {counted:.0} by the counts",
                band.0, band.1
            );
            assert!(counted > 0.85 * listed && drawn > 0.97 * counted, "{band:?} {limit}");
        }
    }
}

#[test]
fn the_same_sky_is_there_whatever_the_cone() {
    let catalogue = Catalogue::built_in();
    let drawn = Drawn::All { limit: 16.0 };
    for (ra, dec) in [(0.0, 0.0), (359.9, 10.0), (83.0, 89.7), (266.4, -28.9)] {
        let centre = direction(f64::to_radians(ra), f64::to_radians(dec));
        let cone = |radius: f64| Cone { centre, radius, year: 2020.0 };
        let wide = field::stars(&catalogue, &drawn, &cone(0.03));
        let narrow = field::stars(&catalogue, &drawn, &cone(0.01));
        let inside = wide.iter().filter(|s| separation(s.direction, centre) <= 0.01).count();
        assert_eq!(inside, narrow.len(), "{ra} {dec}");
        let mut ids = wide.iter().map(|s| s.id).collect::<Vec<_>>();
        ids.sort_unstable();
        ids.dedup();
        assert_eq!(ids.len(), wide.len(), "a star twice at {ra} {dec}");
    }
}
