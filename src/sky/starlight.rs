//! Integrated starlight: the stars that are not drawn one by one.
//!
//! S10 of all stars fainter than the drawing limit, from the counts of [`crate::stars::counts`]: no star counts twice. Where
//! only the catalogue is drawn, its thinned-out stars beyond its completeness are taken off. Solar colour, extinguished
//! once; starlight scattered into the line of sight is left out. Uncertainty: 0.2, in the plane of the Milky Way a factor
//! of two.

use super::{Context, Field, Source, Toward};
use crate::base::ledger::Why;
use crate::base::units::flux_from_mag;
use crate::stars::counts::{Counts, DEG2_PER_SR, Galactic};
use crate::stars::drawn::Drawn;

/// Starlight of a frame.
pub struct Starlight<'a> {
    context: &'a Context<'a>,
    drawn: Drawn,
}

impl<'a> Starlight<'a> {
    /// The starlight of a frame that draws `drawn`.
    pub fn new(context: &'a Context<'a>, drawn: &Drawn) -> Self {
        Self { context, drawn: *drawn }
    }

    fn latitude_deg(&self) -> f64 {
        Galactic::of(self.context.field.centre().icrs).b.abs().to_degrees()
    }
}

impl Source for Starlight<'_> {
    fn name(&self) -> &'static str {
        "sky.starlight"
    }

    fn keyword(&self) -> &'static str {
        "SKYSTAR"
    }

    fn basis(&self) -> String {
        let extrapolated = if self.latitude_deg() < 20.0 { ", extrapolated below |b| = 20 deg" } else { "" };
        format!("stars fainter than V {:.2} (Bahcall & Soneira 1980{extrapolated})", self.drawn.limit())
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        None
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let counts = Counts::at(Galactic::of(toward.icrs));
        let taken = if let Drawn::Catalogue { fainter_s10, .. } = self.drawn { fainter_s10 } else { 0.0 };
        let s10 = (counts.s10(self.drawn.limit(), f64::INFINITY) - taken).max(0.0);
        let rate = s10 * flux_from_mag(10.0) * self.context.response.stars.solar().at(toward.airmass);
        rate * DEG2_PER_SR * self.context.per_steradian()
    }

    fn uncertainty(&self) -> f64 {
        if self.latitude_deg() < 20.0 { 1.0 } else { 0.2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The galactic centre (Sgr A*) and the north galactic pole.
    #[test]
    fn galactic_coordinates_of_known_places() {
        let at = |ra: f64, dec: f64| Galactic::of(crate::astro::direction(ra.to_radians(), dec.to_radians()));
        let centre = at(266.4051, -28.93617);
        assert!(centre.b.abs() < 2e-5 && centre.l.sin().abs() < 2e-5, "{centre:?}");
        assert!((at(192.85948, 27.12825).b.to_degrees() - 90.0).abs() < 1e-4);
    }
}
