//! Skies and frames of tests, from seeds.

use super::{Detection, FieldStar};
use crate::astro::direction;
use crate::base::units::ARCSEC;
use crate::plan::sip::Sip;
use crate::plan::wcs::{Wcs, east_north};
use glam::{DMat2, DVec2, DVec3};

/// SplitMix64 (Steele, Lea & Flood 2014, OOPSLA, fig. 16).
pub struct Dice(pub u64);

impl Dice {
    /// Uniform in \[0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    }

    /// Uniform between two numbers.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Standard normal in both components (Box & Muller 1958).
    pub fn normal(&mut self) -> DVec2 {
        let length = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        DVec2::from_angle(self.between(0.0, std::f64::consts::TAU)) * length
    }
}

/// What a test's frame is like.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub size: usize,
    /// \[arcsec/px\].
    pub scale: f64,
    /// Right ascension and declination \[deg\].
    pub at: [f64; 2],
    /// Stars in the frame that are detected.
    pub detected: usize,
    /// Catalogue stars in the frame, the brightest of which are detected.
    pub catalogue: usize,
    /// Share of the detections that are no stars.
    pub spurious: f64,
    /// Share of the detected stars that the catalogue lacks.
    pub missing: f64,
    /// Errors of the header: \[deg\], \[deg\], share.
    pub offset: f64,
    pub rotation: f64,
    pub stretch: f64,
    /// Radial distortion in a corner \[px\].
    pub bent: f64,
    /// Scatter of places \[px\].
    pub sigma: f64,
    /// Magnitudes' scatter between the frame's passband and V.
    pub colour: f64,
    /// Brightest stars that saturate and are not detected.
    pub saturated: usize,
    /// Share of the stars within a cluster of standard radius 1/30 of the frame.
    pub clustered: f64,
    /// Whether all stars lie on one line.
    pub collinear: bool,
    /// Quadratic distortion at an edge \[px\], and, a thousandth of it, shear.
    pub tilt: f64,
    pub mirrored: bool,
}

impl Default for Case {
    fn default() -> Self {
        Self {
            size: 4096,
            scale: 0.72,
            at: [83.0, 22.0],
            detected: 50,
            catalogue: 80,
            spurious: 0.5,
            missing: 0.0,
            offset: 0.3,
            rotation: 2.0,
            stretch: 0.01,
            bent: 3.0,
            sigma: 0.1,
            colour: 0.4,
            saturated: 0,
            clustered: 0.0,
            collinear: false,
            tilt: 0.0,
            mirrored: false,
        }
    }
}

/// A frame with its truth.
pub struct Made {
    pub detections: Vec<Detection>,
    pub stars: Vec<FieldStar>,
    pub header: Wcs,
    pub truth: Wcs,
    /// True places of the catalogue stars in the frame.
    pub places: Vec<(DVec2, DVec3)>,
}

/// World coordinates about a place with rotation \[deg\], scale \[arcsec\] and corner distortion \[px\].
pub fn world(centre: DVec3, size: usize, scale: f64, rotation: f64, bent: f64, mirrored: bool) -> Wcs {
    let (ra, dec) = crate::astro::angles(centre);
    let turn = DMat2::from_angle(rotation.to_radians());
    let parity = DMat2::from_diagonal(DVec2::new(if mirrored { 1.0 } else { -1.0 }, 1.0));
    let half = size as f64 / 2.0;
    let k = bent / (2.0 * half * half).powf(1.5);
    let mut sip = Sip::default();
    (sip.a[3], sip.a[5], sip.b[4], sip.b[6]) = (k, k, k, k);
    let crpix = DVec2::splat(half - 0.5);
    Wcs::new(ra, dec, crpix, turn * parity * (scale * ARCSEC), (bent != 0.0).then_some(sip))
}

impl Case {
    /// The place of a star in the frame.
    fn place(&self, dice: &mut Dice) -> DVec2 {
        let size = self.size as f64;
        let at = DVec2::new(dice.between(20.0, size - 20.0), dice.between(20.0, size - 20.0));
        if self.collinear {
            DVec2::new(at.x, 0.3 * at.x + 0.2 * size + 0.002 * at.y)
        } else if dice.uniform() < self.clustered {
            DVec2::new(0.6, 0.45) * size + size / 30.0 * dice.normal().clamp_length_max(3.0)
        } else {
            at
        }
    }

    /// The frame of a seed.
    pub fn make(&self, seed: u64) -> Made {
        let mut dice = Dice(seed.wrapping_mul(7919).wrapping_add(17));
        let size = self.size as f64;
        let centre = direction(self.at[0].to_radians(), self.at[1].to_radians());
        let mut truth = world(centre, self.size, self.scale, 31.0, self.bent, false);
        if self.tilt != 0.0 {
            let mut sip = truth.sip.unwrap_or_default();
            let k = self.tilt * (2.0 / size).powi(2);
            (sip.a[0], sip.a[1], sip.b[1], sip.b[2]) = (k, -0.5 * k, k, -0.5 * k);
            let shear = DMat2::from_cols_array(&[1.0, 1e-3 * self.tilt, 0.0, 1.0 - 1e-3 * self.tilt]);
            truth = super::fit::about(centre, truth.crpix, truth.cd * shear, Some(sip));
        }
        let (east, north) = east_north(centre);
        let side = size * self.scale * ARCSEC;
        let pointing = DVec2::from_angle(dice.between(0.0, std::f64::consts::TAU)) * self.offset.to_radians();
        let header_centre = (centre + east * pointing.x + north * pointing.y).normalize();
        // turned on the sphere, not against the meridian
        let plain = world(centre, self.size, self.scale * (1.0 + self.stretch), 31.0 + self.rotation, 0.0, false);
        let cd = super::fit::carried(plain.cd, centre, super::fit::arc(centre, header_centre));
        let header = super::fit::about(header_centre, plain.crpix, cd, None);
        let header = if self.mirrored {
            super::flipped(&header, DVec2::splat(size), DVec2::new(-1.0, 1.0))
        } else {
            header
        };
        // a cone about the header's place that holds the frame
        let reach = side * 0.7072 * 1.03 + 0.5_f64.to_radians();
        let number = (self.catalogue as f64 * (2.0 * reach / side).powi(2)) as usize;
        let (h_east, h_north) = east_north(header_centre);
        let mut stars = Vec::new();
        let mut inside = Vec::new();
        for _ in 0..number {
            let at = DVec2::new(dice.between(-reach, reach), dice.between(-reach, reach));
            let sky = (header_centre + h_east * at.x + h_north * at.y).normalize();
            let place = truth
                .pixel(sky)
                .filter(|p| p.cmpgt(DVec2::splat(20.0)).all() && p.cmplt(DVec2::splat(size - 20.0)).all());
            // stars of the frame are added below, so that their number is exact
            if place.is_none() && at.length() < reach {
                stars.push(FieldStar {
                    direction: sky,
                    mag_v: 9.0 + 7.0 * dice.uniform().powf(0.35),
                    colour_bv: f64::NAN,
                });
            }
        }
        for _ in 0..self.catalogue.max(self.detected + self.saturated) {
            let place = self.place(&mut dice);
            inside.push((place, truth.sky(place), 9.0 + 7.0 * dice.uniform().powf(0.35)));
        }
        // detected in order of another passband's brightness
        let mut seen: Vec<(f64, usize)> =
            inside.iter().enumerate().map(|(k, s)| (s.2 + self.colour * dice.normal().x, k)).collect();
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        seen.drain(..self.saturated.min(seen.len()));
        seen.truncate(self.detected);
        let mut detections: Vec<Detection> = seen
            .iter()
            .map(|&(mag, k)| Detection {
                at: inside[k].0 + self.sigma * dice.normal(),
                flux: 10f64.powf(-0.4 * mag),
                sigma: self.sigma,
            })
            .collect();
        let spurious = (self.detected as f64 * self.spurious / (1.0 - self.spurious)).round() as usize;
        for _ in 0..spurious {
            let like = seen[(dice.uniform() * seen.len() as f64) as usize].0;
            detections.push(Detection {
                at: DVec2::new(dice.between(0.0, size), dice.between(0.0, size)),
                flux: 10f64.powf(-0.4 * like),
                sigma: self.sigma,
            });
        }
        let lacks: Vec<usize> = seen.iter().filter(|_| dice.uniform() < self.missing).map(|s| s.1).collect();
        let kept = inside.iter().enumerate().filter(|(k, _)| !lacks.contains(k)).map(|(_, s)| *s);
        let places: Vec<(DVec2, DVec3, f64)> = kept.collect();
        stars.extend(places.iter().map(|s| FieldStar { direction: s.1, mag_v: s.2, colour_bv: f64::NAN }));
        let places = places.into_iter().map(|s| (s.0, s.1)).collect();
        Made { detections, stars, header, truth, places }
    }
}
