//! The light of a shape at one instant, by whichever way is cheap and exact enough.
//!
//! Normalised irradiance y \[m^2/sr\]: a shape lit by the irradiance E_sun sends E_sun y / r^2 to an observer at the distance r
//! (draft Eq. 8.1 with its shadow terms in the area).

use super::shadow::body::Body;
use super::shadow::bvh::Bvh;
use super::shadow::card::Card;
use super::shadow::exact::Exact;
use super::shadow::raster::{self, Buffers};
use super::shadow::rays;
use super::shape::{Lighting, Shape};
use super::way::{SIGMAS, Way, map_error};
use glam::DVec3;

/// The light of a shape, and how exactly it is known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Light {
    /// Normalised irradiance \[m^2/sr\].
    pub value: f64,
    /// A bound of its error \[m^2/sr\]: three standard errors of rays, the largest error measured of maps; 0 where round-off alone
    /// limits it.
    pub error: f64,
}

/// Most rays at an instant.
const MOST_RAYS: usize = 1 << 22;

/// Finds the light of one shape again and again.
#[derive(Debug)]
pub struct Lamp<'a> {
    shape: &'a Shape,
    way: Way,
    body: Body,
    weight: Vec<f64>,
    exact: Exact,
    bvh: Option<Bvh>,
    maps: Buffers,
    card: Option<Card>,
}

impl<'a> Lamp<'a> {
    /// For `shape`, by `way`; a graphics processor that fails, or is not there, gives way to its twin on the processor.
    pub fn new(shape: &'a Shape, way: Way, card: Option<&Card>) -> Self {
        let bvh = matches!(way, Way::Rays { .. }).then(|| Bvh::new(&shape.body));
        let (weight, exact, maps) = Default::default();
        Self { shape, way, body: shape.body.clone(), weight, exact, bvh, maps, card: card.cloned() }
    }

    /// The light towards the observer.
    pub fn light(&mut self, lighting: &Lighting) -> Light {
        self.light_from(lighting, lighting.around.sun)
    }

    /// The lights at many instants: on a graphics processor all are drawn together.
    pub fn lights(&mut self, all: &[Lighting]) -> Vec<Light> {
        let (Way::Device { side }, Some(card), false) = (self.way, self.card.clone(), self.shape.moves()) else {
            return all.iter().map(|lighting| self.light(lighting)).collect();
        };
        let weights = all.iter().map(|lighting| {
            let (around, mut weight) = (&lighting.around, Vec::new());
            self.shape.weights(&self.body, around.sun, around.observer, lighting.sun_radius, &mut weight);
            weight
        });
        let weights = weights.collect::<Vec<_>>();
        let epochs = all.iter().zip(&weights);
        let epochs = epochs.map(|(l, weight)| (l.around.sun, l.around.observer, weight.as_slice()));
        match card.flux(&self.body, &epochs.collect::<Vec<_>>(), side) {
            Ok(values) => {
                let light = |(value, weight): (f64, &Vec<f64>)| Light {
                    value,
                    error: map_error(side) * unshadowed(&self.body, weight),
                };
                values.into_iter().zip(&weights).map(light).collect()
            }
            Err(_) => {
                self.card = None;
                all.iter().map(|lighting| self.light(lighting)).collect()
            }
        }
    }

    /// The light of a source of the Sun's size in direction `from`, as if it were the Sun.
    pub fn light_from(&mut self, lighting: &Lighting, from: DVec3) -> Light {
        let observer = lighting.around.observer;
        self.pose(lighting);
        self.shape.weights(&self.body, from, observer, lighting.sun_radius, &mut self.weight);
        let (body, weight) = (&self.body, &self.weight);
        match self.way {
            Way::Convex => Light { value: unshadowed(body, weight), error: 0.0 },
            Way::Exact => Light { value: self.exact.flux(body, from, observer, weight), error: 0.0 },
            Way::Rays { tolerance } => match &self.bvh {
                Some(bvh) => {
                    let view = rays::View::new(body, bvh, from, observer, weight);
                    let (estimate, _) = view.flux_to(tolerance / SIGMAS, MOST_RAYS, 0);
                    Light { value: estimate.value, error: SIGMAS * estimate.error }
                }
                None => Light::default(),
            },
            Way::Device { side } => {
                let drawn = self.card.as_ref().map(|card| card.flux(body, &[(from, observer, weight)], side));
                let value = match drawn {
                    Some(Ok(values)) => values.first().copied().unwrap_or(0.0),
                    Some(Err(_)) | None => {
                        self.card = None;
                        raster::flux(body, from, observer, weight, side, &mut self.maps)
                    }
                };
                Light { value, error: map_error(side) * unshadowed(body, weight) }
            }
        }
    }

    fn pose(&mut self, lighting: &Lighting) {
        if self.shape.moves() {
            self.shape.pose(&lighting.around, &mut self.body);
            if let Some(bvh) = &mut self.bvh {
                bvh.refit(&self.body);
            }
        }
    }
}

/// Light of a body without shadows.
fn unshadowed(body: &Body, weight: &[f64]) -> f64 {
    weight.iter().zip(&body.areas).map(|(w, a)| w * a).sum()
}
