//! How bright a target is in an exposure: constant, or as its shape, attitude, Sun and Earth's shadow make it.
//!
//! A shape of normalised irradiance y at the distance d from the Sun and r from the observer has the irradiance
//! E = E_sun (1 au / d)^2 y / r^2, and V = V_sun - 2.5 log10(E / E_sun). Over an exposure y, the distances and the share of the
//! Sun that the Earth leaves free are integrated together.

use super::PlanError;
use super::place::{Motion, Place};
use super::view::Sighting;
use crate::astro;
use crate::astro::attitude::{Profile, Surroundings};
use crate::astro::observer::{Observer, Site};
use crate::astro::rotation::Quaternion;
use crate::astro::time::Instant;
use crate::base::constants::{AU_M, EARTH_RADIUS_M, LIGHT_M_S, SUN_RADIUS_M};
use crate::base::ledger::{Row, Verdict, Why};
use crate::base::units::{flux_from_mag, mag_from_flux};
use crate::object::earthshine;
use crate::object::glint::{self, Points};
use crate::object::integral::integrate;
use crate::object::light::{Lamp, Light};
use crate::object::shadow::card::Graphics;
use crate::object::shape::Lighting;
use crate::object::way::Way;
use crate::scene::{Brightness, Shaped};
use glam::DVec3;

/// Johnson V of the Sun at 1 au, the scale of all magnitudes of targets.
pub const SUN_V_MAG: f64 = -26.76;
/// Irradiance of the Sun at 1 au \[W/m^2\], bolometric.
pub const SUN_W_M2: f64 = 1361.0;
/// Evaluations of an integral, at most.
const MOST: usize = 200_000;
/// An object that turns uniformly more often than this in an exposure is integrated turn by turn.
const FEW_TURNS: f64 = 12.0;
/// Turns looked at beyond the first 15 of each piece, at most.
const MOST_TURNS: usize = 600;
/// Pieces into which its turns are parted, at most.
const MOST_PIECES: usize = 256;
/// Light that stays within this share of its largest is even.
const EVEN: f64 = 0.999;
/// Stretches of equal time into which a streak of uneven light is parted.
const STRETCHES: usize = 256;

/// The light of a target in an exposure.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetLight {
    /// Mean irradiance outside the atmosphere, as a share of that of V = 0.
    pub v_flux: f64,
    /// Error of it \[same\].
    pub error: f64,
    /// Times it was evaluated.
    pub evaluations: usize,
    /// Light in stretches of equal time, as shares of the whole; empty if it is even.
    pub shares: Vec<f64>,
    /// How its shadows were found, if it has a shape, with the reason where no graphics processor was.
    pub means: Option<(Means, String)>,
}

impl TargetLight {
    /// The ledger's row of the shadows of the shape of a target of that name.
    pub fn row(&self, name: &str) -> Option<Row> {
        let (means, why) = self.means.as_ref()?;
        let verdict = match means.way {
            Way::Convex => Verdict::Absent(Why::NotVisible("the shape is convex: nothing hides any of it".into())),
            _ if self.v_flux == 0.0 => Verdict::Absent(Why::NotVisible("the shape has no light".into())),
            _ => Verdict::Needed { bound: means.time },
        };
        let note = if why.is_empty() { String::new() } else { format!("; no graphics processor: {why}") };
        let told = self.inexact().map_or_else(String::new, |share| {
            format!("; WARNING: its error of {share:.1e} of the light is more than accuracy.brightness allows")
        });
        Some(Row::new(&format!("shadows.{name}"), &verdict, &format!("{}{note}{told}", means.way.describe())))
    }

    /// The estimated error as a share of the light, where it is more than `accuracy.brightness` allows.
    pub fn inexact(&self) -> Option<f64> {
        let allowed = 2.0 * self.means.as_ref()?.0.time;
        (self.error > allowed * self.v_flux).then(|| self.error / self.v_flux)
    }

    /// Johnson V; NaN for no light.
    pub fn mag_v(&self) -> f64 {
        mag_from_flux(self.v_flux)
    }

    /// Mean irradiance outside the atmosphere, bolometric \[W/m^2\].
    pub fn irradiance_w_m2(&self) -> f64 {
        self.v_flux * SUN_W_M2 * flux_from_mag(-SUN_V_MAG)
    }

    /// No light at all.
    pub fn dark() -> Self {
        Self { v_flux: 0.0, error: 0.0, evaluations: 0, shares: Vec::new(), means: None }
    }
}

/// How the shadows of a target with a shape are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Means {
    /// The way of its shadows.
    pub way: Way,
    /// Relative error allowed of the integral over time.
    pub time: f64,
}

impl Means {
    /// For a shape, to within a relative error of the whole.
    pub fn of(shaped: &Shaped, relative: f64, graphics: &Graphics) -> Self {
        Self { way: Way::cheapest(&shaped.built, 0.5 * relative, graphics), time: 0.5 * relative }
    }
}

/// One target's light, again and again.
#[derive(Debug)]
pub struct Glow<'a> {
    site: &'a Site,
    motion: &'a Motion,
    profile: Profile,
    shaped: Option<(&'a Shaped, Means, Lamp<'a>)>,
    mag_v: f64,
    /// Why there is no graphics processor, if one was looked for.
    why: String,
}

/// The mean light over a span of time.
struct Span {
    mean: f64,
    error: f64,
    evaluations: usize,
    /// Shares of the span and the light there; none where it turns too fast to be told.
    samples: Vec<(f64, f64)>,
}

/// A target's surroundings at an instant.
struct Moment {
    lighting: Lighting,
    /// Irradiance of V = 0 that 1 m^2/sr makes.
    per_y: f64,
    /// Share of the Sun that the Earth leaves free.
    sunlit: f64,
    /// Distance of the Earth's centre \[Earth radii\].
    earth_radii: f64,
}

impl<'a> Glow<'a> {
    /// Of a target of such brightness, that moves and turns as told and is seen from `site`; to within a relative error.
    pub fn new(
        brightness: &'a Brightness,
        site: &'a Site,
        (motion, profile): (&'a Motion, Option<&Profile>),
        relative: f64,
        graphics: &Graphics,
    ) -> Self {
        let (mag_v, shaped) = match brightness {
            Brightness::MagV(mag_v) => (*mag_v, None),
            Brightness::Shape(shaped) => {
                let means = Means::of(shaped, relative, graphics);
                (f64::NAN, Some((&**shaped, means, Lamp::new(&shaped.built, means.way, graphics.card.as_ref()))))
            }
        };
        // body axes are those of the ICRS where nothing is said
        let profile = profile.cloned().unwrap_or(Profile::Inertial(Quaternion::IDENTITY));
        Self { site, motion, profile, shaped, mag_v, why: graphics.why.clone() }
    }

    /// How its shadows are found, if it has a shape.
    pub fn means(&self) -> Option<Means> {
        self.shaped.as_ref().map(|(_, means, _)| *means)
    }

    /// Its light in an exposure.
    ///
    /// # Errors
    /// [`PlanError`] where its place or attitude is not known.
    pub fn over(&mut self, seen: &Sighting) -> Result<TargetLight, PlanError> {
        let Some((shaped, means, _)) = &self.shaped else {
            let v_flux = flux_from_mag(self.mag_v) * seen.sunlit_mean;
            return Ok(TargetLight { v_flux, ..TargetLight::dark() });
        };
        let (time, told) = (means.time, Some((*means, self.why.clone())));
        if seen.sunlit_mean == 0.0 && !shaped.earthshine {
            return Ok(TargetLight { means: told, ..TargetLight::dark() });
        }
        if seen.exposure_s == 0.0 {
            let (v_flux, error) = self.at_place(&seen.mid, &seen.place, &seen.observer)?;
            return Ok(TargetLight { v_flux, error, evaluations: 1, shares: Vec::new(), means: told });
        }
        let period_s = self.profile.period_s().filter(|period| seen.exposure_s > FEW_TURNS * period);
        let span = match period_s {
            Some(period_s) => self.turns(&seen.start, seen.exposure_s, period_s, time)?,
            None => self.span(&seen.start, seen.exposure_s, time)?,
        };
        let Span { mean, error, evaluations, samples } = span;
        Ok(TargetLight { v_flux: mean, error, evaluations, shares: stretches(samples), means: told })
    }

    /// Mean light over `length_s` from `start` on, to within `relative` of it.
    fn span(&mut self, start: &Instant, length_s: f64, relative: f64) -> Result<Span, PlanError> {
        let points = self.points(start, length_s)?;
        let mut error: f64 = 0.0;
        let mut samples = Vec::new();
        let integral = integrate(&points.at, relative, MOST, &mut |at, out| {
            let places = at.iter().map(|share| self.place(&start.plus(share * length_s)));
            let places = places.collect::<Result<Vec<_>, _>>()?;
            for ((share, out), (value, own)) in at.iter().zip(out).zip(self.at_places(&places)?) {
                *out = value;
                samples.push((*share, value));
                error = error.max(own);
            }
            Ok::<(), PlanError>(())
        })?;
        // of flashes that were not looked for nothing is known
        let error = if points.complete { error + integral.error } else { f64::INFINITY };
        Ok(Span { mean: integral.value, error, evaluations: integral.evaluations, samples })
    }

    /// The same of an object that comes round every `period_s`, many times.
    ///
    /// The light of a turn changes slowly from turn to turn, with Sun, observer and distances: the sum over n turns is the integral
    /// over their number from -1/2 to n - 1/2, which errs by 1/(24 n^2) of the change. What is left of a turn is added.
    fn turns(&mut self, start: &Instant, length_s: f64, period_s: f64, relative: f64) -> Result<Span, PlanError> {
        let count = (length_s / period_s).floor();
        let pieces = self.slow_pieces(start, length_s)?;
        let points = (0..=pieces).map(|k| count * k as f64 / pieces as f64 - 0.5).collect::<Vec<_>>();
        let (mut error, mut evaluations, mut middle) = (0.0f64, 0, (f64::INFINITY, Vec::new()));
        // the errors of single turns are noise to the integral over turns: they must be well below what it looks for
        let most = 15 * pieces + MOST_TURNS;
        let whole = integrate(&points, 0.5 * relative, most, &mut |at, out| {
            for (turn, out) in at.iter().zip(out) {
                let span = self.span(&start.plus(turn * period_s), period_s, 0.05 * relative)?;
                *out = span.mean;
                error = error.max(span.error);
                evaluations += span.evaluations;
                let off = (turn - 0.5 * count).abs();
                if off < middle.0 {
                    middle = (off, span.samples);
                }
            }
            Ok::<(), PlanError>(())
        })?;
        let rest_s = (length_s - count * period_s).max(0.0);
        let rest = self.span(&start.plus(count * period_s), rest_s, 0.25 * relative)?;
        // a streak shows its turns one by one, as long as there are not more than it has stretches for
        let mut samples = Vec::new();
        if count <= STRETCHES as f64 / 4.0 {
            let turn =
                |k: usize| middle.1.iter().map(move |(at, light)| ((k as f64 + at) * period_s / length_s, *light));
            samples = (0..count as usize).flat_map(turn).collect();
            let end = count * period_s / length_s;
            samples.extend(rest.samples.iter().map(|(at, light)| (end + at * rest_s / length_s, *light)));
        }
        Ok(Span {
            mean: (whole.value * period_s + rest.mean * rest_s) / length_s,
            error: error + rest.error + whole.error * period_s / length_s,
            evaluations: evaluations + rest.evaluations,
            samples,
        })
    }

    /// Into how many pieces the turns of an exposure are parted: in each of them Sun and observer move by less than the
    /// narrowest lobe.
    fn slow_pieces(&self, start: &Instant, length_s: f64) -> Result<usize, PlanError> {
        let Some((shaped, ..)) = &self.shaped else { return Ok(1) };
        let half = |at: f64| -> Result<(DVec3, f64), PlanError> {
            let (t, place, observer) = self.place(&start.plus(at * length_s))?;
            let light = place.illumination(&observer);
            let sun_radius = self.moment(&t, &place, &observer)?.lighting.sun_radius;
            Ok(((light.to_sun + light.to_observer).normalize_or_zero(), sun_radius))
        };
        let ((first, sun_radius), (last, _)) = (half(0.0)?, half(1.0)?);
        let width = glint::narrowest(&shaped.built, sun_radius);
        Ok(((first.distance(last) / width).ceil() as usize).clamp(1, MOST_PIECES))
    }

    /// Irradiance as a share of that of V = 0 at an instant, and its error.
    ///
    /// # Errors
    /// [`PlanError`] where its place or attitude is not known.
    pub fn at(&mut self, t: &Instant) -> Result<(f64, f64), PlanError> {
        let (t, place, observer) = self.place(t)?;
        self.at_place(&t, &place, &observer)
    }

    /// Its place at an instant, and the observer's.
    fn place(&self, t: &Instant) -> Result<(Instant, Place, Observer), PlanError> {
        let observer = Observer::at(self.site, t)?;
        Ok((*t, self.motion.place_from(&observer, t)?, observer))
    }

    /// Its light in many exposures.
    ///
    /// # Errors
    /// [`PlanError`] where its place or attitude is not known.
    pub fn over_all(&mut self, all: &[Sighting]) -> Result<Vec<TargetLight>, PlanError> {
        let (Some((_, means, _)), true) = (&self.shaped, all.iter().all(|seen| seen.exposure_s == 0.0)) else {
            return all.iter().map(|seen| self.over(seen)).collect();
        };
        let told = Some((*means, self.why.clone()));
        let places = all.iter().map(|seen| (seen.mid, seen.place, seen.observer)).collect::<Vec<_>>();
        let lights = self.at_places(&places)?.into_iter();
        let light = |(v_flux, error)| TargetLight {
            v_flux,
            error,
            evaluations: 1,
            shares: Vec::new(),
            means: told.clone(),
        };
        Ok(lights.map(light).collect())
    }

    /// The same of a known place.
    ///
    /// # Errors
    /// [`PlanError`] where its attitude is not known.
    pub fn at_place(&mut self, t: &Instant, place: &Place, observer: &Observer) -> Result<(f64, f64), PlanError> {
        Ok(self.at_places(&[(*t, *place, *observer)])?.first().copied().unwrap_or((0.0, 0.0)))
    }

    /// The same of many: a graphics processor draws them together.
    fn at_places(&mut self, all: &[(Instant, Place, Observer)]) -> Result<Vec<(f64, f64)>, PlanError> {
        if self.shaped.is_none() {
            let constant = flux_from_mag(self.mag_v);
            return Ok(all
                .iter()
                .map(|(_, p, observer)| (constant * p.illumination(observer).sunlit, 0.0))
                .collect());
        }
        let moments = all.iter().map(|(t, place, observer)| self.moment(t, place, observer));
        let moments = moments.collect::<Result<Vec<_>, _>>()?;
        let Some((shaped, _, lamp)) = &mut self.shaped else { return Ok(Vec::new()) };
        let lit = moments.iter().filter(|m| m.sunlit > 0.0).map(|m| m.lighting).collect::<Vec<_>>();
        let mut lights = lamp.lights(&lit).into_iter();
        let one = |m: &Moment| {
            let light = if m.sunlit > 0.0 { lights.next().unwrap_or_default() } else { Light::default() };
            let (mut y, error) = (light.value * m.sunlit, light.error * m.sunlit);
            if shaped.earthshine {
                let around = &m.lighting.around;
                for (from, share) in earthshine::patches(around.earth, m.earth_radii, around.sun) {
                    y += share * lamp.light_from(&m.lighting, from).value;
                }
            }
            (y * m.per_y, error * m.per_y)
        };
        Ok(moments.iter().map(one).collect())
    }

    /// Sun, observer and what else is around, in body axes, when the light left that arrives at `t`.
    fn moment(&self, t: &Instant, place: &Place, observer: &Observer) -> Result<Moment, astro::Error> {
        let light = place.illumination(observer);
        let around = place.surroundings(&light);
        let attitude = self.profile.at(&t.plus(-place.range_m / LIGHT_M_S), &around)?;
        let body = |v: DVec3| attitude.to_body(v);
        let state = place.state.map_or(DVec3::NAN, |s| s.position);
        let sun_m = (place.sun(observer) - state).length();
        let lighting = Lighting {
            around: Surroundings {
                earth: body(around.earth),
                sun: body(around.sun),
                velocity: body(around.velocity),
                observer: body(around.observer),
            },
            sun_radius: (SUN_RADIUS_M / sun_m).min(1.0).asin(),
        };
        let per_y = flux_from_mag(SUN_V_MAG) * (AU_M / sun_m / place.range_m).powi(2);
        Ok(Moment { lighting, per_y, sunlit: light.sunlit, earth_radii: state.length() / EARTH_RADIUS_M })
    }

    /// Shares of a span of time from which the integral starts: turns are followed, flashes known, and the contacts with the
    /// Earth's shadow left to bisection.
    fn points(&self, start: &Instant, length_s: f64) -> Result<Points, PlanError> {
        let mut all = Points { at: vec![0.0, 1.0], complete: true };
        let Some((shaped, ..)) = &self.shaped else { return Ok(all) };
        let lighting = |share: f64| -> Result<Lighting, PlanError> {
            let (t, place, observer) = self.place(&start.plus(share * length_s))?;
            Ok(self.moment(&t, &place, &observer)?.lighting)
        };
        let (first, last) = (lighting(0.0)?, lighting(1.0)?);
        let drift = (half(&first) - half(&last)).length();
        let turn = self.profile.fastest() * length_s + drift;
        let shape = &shaped.built;
        for part in 0..shape.rigid_parts() {
            let shiny = glint::shiny(shape, part, first.sun_radius);
            let points = glint::points(&shiny, turn, &mut |share| {
                let own = lighting(share)?;
                Ok::<_, PlanError>(shape.in_part(part, &own.around, half(&own)))
            })?;
            all.at.extend(points.at);
            all.complete &= points.complete;
        }
        all.at.sort_by(f64::total_cmp);
        all.at.dedup();
        Ok(all)
    }
}

/// The direction halfway between Sun and observer.
fn half(lighting: &Lighting) -> DVec3 {
    (lighting.around.sun + lighting.around.observer).normalize_or_zero()
}

/// The light in stretches of equal time, as shares of the whole, if it is uneven: straight lines between `samples` of \[0, 1\].
fn stretches(mut samples: Vec<(f64, f64)>) -> Vec<f64> {
    let (low, high) = samples.iter().fold((f64::INFINITY, 0.0f64), |(l, h), s| (l.min(s.1), h.max(s.1)));
    if low >= EVEN * high {
        return Vec::new();
    }
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = samples.first().zip(samples.last()).map(|(first, last)| ((0.0, first.1), (1.0, last.1)));
    let Some((start, end)) = ends else { return Vec::new() };
    let line = std::iter::once(start).chain(samples).chain([end]).collect::<Vec<_>>();
    let mut shares = vec![0.0; STRETCHES];
    for pair in line.windows(2) {
        let [(from, a), (to, b)] = [pair[0], pair[1]];
        let first = ((from * STRETCHES as f64) as usize).min(STRETCHES - 1);
        for (k, share) in shares.iter_mut().enumerate().skip(first) {
            let (low, high) = (k as f64 / STRETCHES as f64, (k + 1) as f64 / STRETCHES as f64);
            if low >= to {
                break;
            }
            let (low, high) = (low.max(from), high.min(to));
            let middle = (0.5 * (low + high) - from) / (to - from).max(f64::MIN_POSITIVE);
            *share += (high - low).max(0.0) * (a + (b - a) * middle);
        }
    }
    let total: f64 = shares.iter().sum();
    shares.iter_mut().for_each(|share| *share /= total);
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_streak_follows_its_samples() {
        assert!(stretches(vec![(0.2, 1.0), (0.5, 1.0005), (0.9, 1.0)]).is_empty());
        assert!(stretches(Vec::new()).is_empty() && stretches(vec![(0.5, 0.0)]).is_empty());
        let shares = stretches((0..=100).map(|k| (f64::from(k) / 100.0, f64::from(k))).collect());
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        for (k, share) in shares.iter().enumerate() {
            let n = STRETCHES as f64;
            assert!((share - (2.0 * k as f64 + 1.0) / (n * n)).abs() < 1e-12, "{k}: {share}");
        }
    }
}
