//! The stars that a frame can see, moved to its epoch.

use super::catalogue::{Catalogue, CatalogueStar, moved};
use super::cells::Bounds;
use super::counts::DEG2_PER_SR;
use super::drawn::{Drawn, NAKED_EYE};
use super::synthetic;
use crate::base::units::flux_from_mag;
use glam::DVec3;
use rayon::prelude::*;

/// Radius of the cone in which drawn stars fainter than the completeness are averaged \[rad\]: 2 degrees.
const AVERAGING: f64 = 2.0 / 180.0 * std::f64::consts::PI;

/// Largest proper motion that a catalogue takes \[rad/yr\]: 20 arcsec, twice Barnard's star's.
const FASTEST: f64 = 20.0 * crate::base::units::ARCSEC;

/// The cone of the sky a frame needs, and its epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// Its axis, ICRS.
    pub centre: DVec3,
    /// Its half-angle \[rad\].
    pub radius: f64,
    /// Julian year of the places.
    pub year: f64,
}

/// The stars of `drawn` in a cone: of the catalogue first, then synthetic ones by cell.
pub fn stars(catalogue: &Catalogue, drawn: &Drawn, cone: &Cone) -> Vec<CatalogueStar> {
    let limit = match drawn {
        Drawn::None => return Vec::new(),
        Drawn::All { limit } => *limit,
        Drawn::Catalogue { faintest, .. } => *faintest,
    };
    let years = cone.year - catalogue.epoch();
    let near = |s: &CatalogueStar| crate::astro::separation(s.direction, cone.centre) <= cone.radius;
    let mut stars = catalogue.cone(cone.centre, cone.radius + FASTEST * years.abs(), limit);
    stars.iter_mut().for_each(|star| star.direction = moved(star, years));
    stars.retain(near);
    if matches!(drawn, Drawn::All { .. }) {
        let cells = catalogue.cells_near(cone.centre, cone.radius).collect::<Vec<_>>();
        let of_cell = |cell: &usize| synthetic::stars(catalogue, *cell, limit).into_iter().filter(near).collect();
        let by_cell: Vec<Vec<CatalogueStar>> = cells.par_iter().map(of_cell).collect();
        stars.extend(by_cell.into_iter().flatten());
    }
    stars
}

/// What is drawn of the catalogue alone, down to V = `faintest`, about `centre`. Cells that the catalogue does not cover do not
/// count: their stars are not diffuse light of the field.
pub fn catalogue_alone(catalogue: &Catalogue, centre: DVec3, faintest: f64) -> Drawn {
    let covered = || {
        let cells = catalogue.cells_near(centre, AVERAGING);
        cells.filter(|cell| catalogue.cell_complete_to(*cell) >= NAKED_EYE)
    };
    let limit = covered().map(|cell| catalogue.cell_complete_to(cell)).fold(faintest, f64::min).max(NAKED_EYE);
    let limit = if covered().next().is_none() { NAKED_EYE } else { limit };
    let (mut light, mut deg2) = (0.0, 0.0);
    for cell in covered() {
        let fainter = catalogue.cell_mags(cell).filter(|m| *m >= limit && *m < faintest);
        light += fainter.map(|m| flux_from_mag(m - 10.0)).sum::<f64>();
        deg2 += Bounds::of(cell).solid_angle() * DEG2_PER_SR;
    }
    Drawn::Catalogue { limit, faintest, fainter_s10: if deg2 > 0.0 { light / deg2 } else { 0.0 } }
}
