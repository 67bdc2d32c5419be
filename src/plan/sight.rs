//! What the light of a target in one exposure depends on.

use super::place::Motion;
use super::view::{Horizontal, Sighting};
use crate::astro::Error;
use crate::astro::observer::{Observer, Site, airmass};
use crate::astro::time::Instant;

/// Midpoints of the mean share of sunlight over an exposure in which the share changes: 1e-4 of the exposure.
const SHADOW_STEPS: usize = 256;

/// A target that moves as told, from the shutter's opening over mid-exposure to its closing; `observer` is that of the middle.
///
/// # Errors
/// Whatever the propagation says.
pub fn sight(
    site: &Site,
    motion: &Motion,
    observer: &Observer,
    [start, mid, end]: [&Instant; 3],
) -> Result<Sighting, Error> {
    let place = motion.place_from(observer, mid)?;
    let light = place.illumination(observer);
    let apparent = Horizontal::of(observer.refracted(observer.airless_geocentric(place.geocentric)));
    let exposure_s = end.since(start);
    Ok(Sighting {
        start: *start,
        mid: *mid,
        exposure_s,
        observer: *observer,
        place,
        light,
        sunlit_mean: sunlit_mean(site, motion, light.sunlit, (start, exposure_s))?,
        apparent,
        airmass: airmass(apparent.elevation),
    })
}

/// Mean share of sunlight over an exposure in whose middle it is `middle`.
fn sunlit_mean(
    site: &Site,
    motion: &Motion,
    middle: f64,
    (start, exposure_s): (&Instant, f64),
) -> Result<f64, Error> {
    if exposure_s == 0.0 {
        return Ok(middle);
    }
    let sunlit = |share: f64| -> Result<f64, Error> {
        let t = start.plus(share * exposure_s);
        let observer = Observer::at(site, &t)?;
        Ok(motion.place_from(&observer, &t)?.illumination(&observer).sunlit)
    };
    if sunlit(0.0)? == middle && sunlit(1.0)? == middle {
        return Ok(middle);
    }
    // the share has kinks at the contacts: many midpoints instead of a rule for smooth functions
    let shares = (0..SHADOW_STEPS).map(|k| sunlit((k as f64 + 0.5) / SHADOW_STEPS as f64));
    Ok(shares.sum::<Result<f64, _>>()? / SHADOW_STEPS as f64)
}
