//! What a frame's stars tell before its target is measured: pointing offset, point spread function, zero point.

use super::Settings;
use super::centroid;
use super::detect;
use super::elongation;
use super::field::{self, Track};
use super::frame::Frame;
use super::growth::Psf;
use super::psf_fit;
use super::rings::{self, Rings};
use super::segment::Segment;
use super::single::{self, Aperture};
use super::trend::Trend;
use super::zeropoint::{self, StarFlux, ZeroPoint};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Most sources used for the point spread function.
const PSF_SOURCES: usize = 24;
/// So many without a neighbour in their wings make the others unneeded.
const PSF_CLEAR: usize = 12;
/// Light of neighbours beside a star, as a share of its own, above which there is a neighbour in its wings.
const PSF_SPOILT: f64 = 5e-4;
/// Signal-to-noise ratio above which a source tells of the point spread function.
const PSF_SNR: f64 = 40.0;
/// Sources that are looked at together.
const BLOCK: usize = 16;
/// Stars that fix the common pointing offset.
const SHIFT_STARS: usize = 12;

/// Stars at their places on the frame, and the common offset applied to them.
pub fn shifted(frame: &Frame, mut tracks: Vec<Track>, fwhm: f64, settings: &Settings) -> (Vec<Track>, DVec2) {
    if frame.solved {
        return (tracks, DVec2::ZERO);
    }
    let whole = tracks.iter().filter(|t| {
        let (s, margin) = (t.segment, 2.0 * fwhm);
        frame.holds(s.centre - s.half, margin) && frame.holds(s.centre + s.half, margin)
    });
    let brightest = whole.take(SHIFT_STARS).map(|t| t.segment).collect::<Vec<_>>();
    let shift = detect::common_shift(frame, &brightest, fwhm, settings.search_px, settings.background_px);
    for track in &mut tracks {
        track.segment.centre += shift;
    }
    (tracks, shift)
}

/// Bright lonely stars and a bright target, centred: segment, background variance, stars beside.
pub fn bright_sources(
    frame: &Frame,
    tracks: &[Track],
    lonely: &[usize],
    target: Option<Segment>,
    fwhm: f64,
) -> Vec<(Segment, f64, Vec<Track>)> {
    // the wings of a neighbour beyond its mask would pass for background: the loneliest come first
    let spoilt = |i: &usize| (*i, field::spoilt(tracks, *i, fwhm));
    let (clear, mut crowded): (Vec<_>, Vec<_>) = lonely.iter().map(spoilt).partition(|(_, s)| *s < PSF_SPOILT);
    crowded.sort_by(|a, b| a.1.total_cmp(&b.1));
    let enough = clear.len();
    let stars = clear.into_iter().chain(crowded).map(|(i, _)| (tracks[i].segment, Some(i)));
    let candidates = target.map(|t| (t, None)).into_iter().chain(stars).collect::<Vec<_>>();
    let bright = |(segment, index): &(Segment, Option<usize>)| {
        let beside = field::around(tracks, segment, 10.0 * fwhm, *index);
        let crossed = beside.iter().any(|t| t.segment.gap(segment) < 3.0 * fwhm);
        let look = single::look(frame, segment, fwhm, &beside);
        if look.saturated || look.cut || crossed || look.snr.is_nan() || look.snr < PSF_SNR {
            return None;
        }
        let place = centroid::windowed(frame, segment, fwhm, look.background_adu, 0.75 * fwhm)?;
        Some((segment.at(place), look.sky_variance, beside))
    };
    let mut sources = Vec::new();
    for (block, some) in candidates.chunks(BLOCK).enumerate() {
        let looked = some.par_iter().map(bright).collect::<Vec<_>>();
        for (tried, source) in (BLOCK * block..).zip(looked) {
            if sources.len() > PSF_SOURCES || (sources.len() > PSF_CLEAR && tried > enough) {
                return sources;
            }
            sources.extend(source);
        }
    }
    sources
}

/// The point spread function, from rings of its own size: they are gathered again if the expected width was far off.
pub fn point_spread(frame: &Frame, sources: &[(Segment, f64, Vec<Track>)], expected: f64) -> Psf {
    const WIDTH_UNKNOWN: f64 = 0.25;
    let mut fwhm = expected;
    for _ in 0..3 {
        let edges = rings::ring_edges(fwhm);
        let rings = sources.par_iter().map(|(segment, variance, beside)| {
            Rings::gather(frame, segment, &edges, *variance, |p| field::covered(beside, p))
        });
        let rings = rings.collect::<Vec<_>>();
        let fit = psf_fit::Fit::new(&rings, &edges, (fwhm, WIDTH_UNKNOWN), 60.0 * fwhm);
        let ratio = fit.fwhm_px() / fwhm;
        if (0.8..1.25).contains(&ratio) || sources.is_empty() || !ratio.is_finite() {
            let (mut psf, own) = fit.posterior();
            let widths = own.iter().map(|w| (frame.relative(w.centre), *w)).collect::<Vec<_>>();
            psf.trend = Trend::of(&widths);
            let points = sources.iter().map(|(segment, variance, _)| (*segment, *variance)).collect::<Vec<_>>();
            psf.lens = elongation::lens(frame, &psf, &points);
            return psf;
        }
        fwhm = fit.fwhm_px().clamp(0.7, 40.0);
    }
    psf_fit::Fit::new(&[], &rings::ring_edges(fwhm), (fwhm, WIDTH_UNKNOWN), 60.0 * fwhm).posterior().0
}

/// The zero point from lonely stars, and the aperture of a typical one.
pub fn stars_zero_point(
    frame: &Frame,
    tracks: &[Track],
    lonely: &[usize],
    psf: &Psf,
    scintillation: f64,
    settings: &Settings,
) -> (ZeroPoint, Option<Aperture>) {
    /// Stars whose widths differ by less share their apertures.
    const ALIKE: f64 = 0.005;
    let Some(first) = lonely.first() else { return (ZeroPoint::NONE, None) };
    let kind = |place: DVec2| (psf.trend.factor(frame.relative(place)).ln() / ALIKE).round() as i64;
    let kinds = lonely.iter().map(|i| kind(tracks[*i].segment.centre)).collect::<BTreeSet<_>>();
    let of_kind = |k: i64| {
        let psf = psf.wider((k as f64 * ALIKE).exp());
        (k, single::ladder(&psf, &tracks[*first].segment, settings.aperture_px, false))
    };
    let ladders = kinds.into_iter().map(of_kind).collect::<BTreeMap<_, _>>();
    let of_star = |index: &usize| {
        let mut segment = tracks[*index].segment;
        let beside = field::around(tracks, &segment, 10.0 * psf.fwhm_px, Some(*index));
        let look = single::look(frame, &segment, psf.fwhm_px, &beside);
        if look.saturated {
            return None;
        }
        if look.snr > 20.0 {
            let centred =
                centroid::windowed(frame, &segment, psf.fwhm_px, look.background_adu, 0.75 * psf.fwhm_px);
            segment = centred.map_or(segment, |p| segment.at(p));
        }
        let ladder = ladders.get(&kind(tracks[*index].segment.centre))?;
        let (flux, aperture) = single::best_flux(frame, &segment, ladder, &beside, settings.flat_rms);
        if flux.flags != 0 || !flux.flux_e.is_finite() {
            return None;
        }
        // the share's uncertainty is common to all stars: it is added once, below
        let own = (flux.err_e.powi(2) - (flux.flux_e * aperture.doubt / aperture.share).powi(2)).max(0.0).sqrt();
        let Track { mag_v, colour_bv, .. } = tracks[*index];
        let place = frame.relative(segment.centre);
        Some((StarFlux { mag_v, colour_bv, place, flux_e: flux.flux_e, flux_err_e: own }, aperture))
    };
    let (fluxes, mut used): (Vec<_>, Vec<_>) = lonely.par_iter().filter_map(of_star).unzip();
    used.sort_by(|a, b| a.radius.total_cmp(&b.radius));
    let typical = used.get(used.len() / 2).map(|a| (*a).clone());
    let common = typical.as_ref().map_or(0.0, |a| a.doubt / a.share);
    let fit = zeropoint::fit(&fluxes, scintillation);
    (fit.with_common_error(common), typical)
}
