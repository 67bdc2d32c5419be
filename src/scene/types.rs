//! The scene as the program sees it: every default filled in, every value checked.
//!
//! A field bears the name of its key and keeps the key's unit, which ends the name. Angles are in degrees,
//! east and north positive; pixels are 0-based with (0, 0) the centre of the first stored pixel.

use std::path::PathBuf;
use std::sync::Arc;

use super::instrument::{Detector, Station, Table, Telescope};
use crate::astro::attitude::Towards;
use crate::astro::orbit::elements::MeanElements;
use crate::astro::orbit::oem::Ephemeris;
use crate::astro::rotation::Quaternion;
use crate::astro::time::Instant;
use crate::base::accuracy::Accuracy;
use crate::object::shape::Shape;

/// One scene: who looks, with what, at which objects, when, and what is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Version of the scene format; 1.
    pub schema_version: i64,
    /// Name of the scene; the file's stem unless given.
    pub name: String,
    /// Seed of every random number, 0 to 2^63 - 1.
    pub seed: u64,
    /// The site.
    pub station: Station,
    /// The optics.
    pub telescope: Telescope,
    /// The camera.
    pub detector: Detector,
    /// Where the frame's centre is at mid-exposure.
    pub pointing: Pointing,
    /// When the shutter opens, and how the mount moves meanwhile.
    pub exposures: Exposures,
    /// What `observable` means.
    pub plan: PlanLimits,
    /// The objects, in the order written; names are unique.
    pub target: Vec<Target>,
    /// Diffuse light of the sky.
    pub sky: Sky,
    /// Stars drawn into the frame.
    pub stars: Stars,
    /// How light curves are measured from frames.
    pub photometry: Photometry,
    /// How shapes are sought in light curves.
    pub inversion: Inversion,
    /// Tolerances of every approximation.
    pub accuracy: Accuracy,
    /// What is written; changes no pixel.
    pub output: Output,
    pub(super) resolved: toml::Table,
    pub(super) inputs: Vec<InputFile>,
}

impl Scene {
    /// Arcseconds per stored pixel at the centre.
    pub fn stored_scale_arcsec(&self) -> f64 {
        self.telescope.plate_scale_arcsec * self.detector.binning as f64
    }
}

/// A file the scene names. Its content is part of the scene: the hash enters SCENESHA.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputFile {
    /// Key path that names it, such as `detector.qe`.
    pub key: String,
    /// Where it was found.
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
    /// Its name in the directory `inputs/` beside a resolved scene; unique within the scene.
    pub name: String,
}

/// `[pointing]`: where the frame's centre is at every mid-exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct Pointing {
    /// The place pointed at.
    pub at: At,
    /// Offset of that place from the frame's centre, pixels in x and y.
    pub offset_px: [f64; 2],
}

/// A place to point at.
#[derive(Clone, Debug, PartialEq)]
pub enum At {
    /// A target by name; none = the first.
    Target(Option<String>),
    /// A place among the catalogue stars, ICRS.
    RaDec {
        /// Right ascension, degrees.
        ra_deg: f64,
        /// Declination, degrees.
        dec_deg: f64,
    },
    /// A place above the horizon, apparent.
    AzEl {
        /// Azimuth, degrees from north through east.
        az_deg: f64,
        /// Apparent elevation, degrees.
        el_deg: f64,
    },
}

/// `[exposures]`: times and tracking. Frame k opens at `start + k cadence_s`.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposures {
    /// When the shutter opens for frame 0.
    pub start: Instant,
    /// The same as RFC 3339 text in UTC, ending in Z; this text is what a resolved scene holds.
    pub start_text: String,
    /// Number of exposures.
    pub count: usize,
    /// SI seconds from opening to opening, at least `duration_s`.
    pub cadence_s: f64,
    /// Open shutter, seconds; 0 = instantaneous (no frame, geometry and light curve only).
    pub duration_s: f64,
    /// Motion while the shutter is open.
    pub track: Track,
    /// Whether exposures that `[plan]` refuses are skipped.
    pub only_observable: bool,
}

/// Motion of the mount while the shutter is open.
#[derive(Clone, Debug, PartialEq)]
pub enum Track {
    /// Follows the target pointed at, or the first one.
    Target,
    /// Follows the stars.
    Sidereal,
    /// Stands still on the Earth.
    Fixed,
    /// (d RA/dt) cos Dec and d Dec/dt, arcseconds per second.
    Rates([f64; 2]),
}

/// `[plan]`: what `observable` means.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanLimits {
    /// Lowest apparent elevation of the target, degrees.
    pub min_el_deg: f64,
    /// Highest elevation of the Sun, degrees.
    pub max_sun_el_deg: f64,
    /// Least distance from the Moon, degrees.
    pub min_moon_sep_deg: f64,
    /// Whether the target must be lit.
    pub sunlit: bool,
    /// Faintest V magnitude; none = no limit.
    pub limit_mag_v: Option<f64>,
    /// Least signal-to-noise ratio; none = no limit.
    pub min_snr: Option<f64>,
}

/// `[[target]]`: an object in orbit.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Name, unique in the scene.
    pub name: String,
    /// Where it is.
    pub orbit: Orbit,
    /// How bright it is.
    pub brightness: Brightness,
    /// How it turns, if that is said.
    pub attitude: Option<Attitude>,
}

/// How bright a target is.
#[derive(Clone, Debug, PartialEq)]
pub enum Brightness {
    /// V magnitude outside the atmosphere while lit, at any range and phase (key `brightness.mag_v`).
    MagV(f64),
    /// As its shape makes it.
    Shape(Box<Shaped>),
}

/// `[[target]]` keys of a shape, and what they give.
#[derive(Clone, Debug, PartialEq)]
pub struct Shaped {
    /// A built-in shape or a file.
    pub shape: Table,
    /// Extent of a built-in shape, metres.
    pub size_m: Option<[f64; 3]>,
    /// Factor on the size.
    pub scale: f64,
    /// Whether the Earth lights it.
    pub earthshine: bool,
    /// Material of faces for which nothing else is told.
    pub material: Option<MaterialKeys>,
    /// Materials of groups.
    pub groups: Vec<(String, MaterialKeys)>,
    /// Parts that turn, by their group.
    pub parts: Vec<(String, PartKeys)>,
    /// The shape itself.
    pub built: Arc<Shape>,
}

/// `[target.material]`; numbers that its BRDF does not have are none.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialKeys {
    /// A model, a preset or a file.
    pub brdf: Table,
    /// Diffuse share.
    pub diffuse: Option<f64>,
    /// Specular share.
    pub specular: Option<f64>,
    /// Exponent of the lobe.
    pub exponent: Option<f64>,
    /// Roughness.
    pub roughness: Option<f64>,
}

/// `[target.part.GROUP]`: a part that turns.
#[derive(Clone, Debug, PartialEq)]
pub struct PartKeys {
    /// A point that stays, metres, body axes.
    pub hinge_m: [f64; 3],
    /// Axis, body axes; none: any.
    pub axis: Option<[f64; 3]>,
    /// Direction of the part that follows.
    pub face: [f64; 3],
    /// What it follows.
    pub point_to: Towards,
}

/// A time of the scene: the instant, and the RFC 3339 text in UTC that a resolved scene holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// The instant.
    pub instant: Instant,
    pub(super) text: String,
}

/// How a target turns; field names and units are those of the keys in `[target.attitude]`.
#[derive(Clone, Debug, PartialEq)]
pub enum Attitude {
    /// Fixed among the stars.
    Inertial {
        /// Scalar first, body to ICRS components.
        quaternion: [f64; 4],
    },
    /// Turning uniformly about an axis.
    Spin {
        /// At the epoch.
        quaternion: [f64; 4],
        /// ICRS components.
        axis: [f64; 3],
        /// Of one turn, seconds.
        period_s: f64,
        /// Turn already made at the epoch, degrees.
        phase_deg: f64,
        /// The epoch.
        epoch: Moment,
    },
    /// +z to the Earth's centre, +x forwards.
    Nadir,
    /// +z to the Sun, +x forwards.
    Sun,
    /// One body axis to a direction, another as near to a second as it goes.
    Aligned {
        /// Body axis that points.
        point_body: [f64; 3],
        /// Where to.
        point_to: Towards,
        /// Body axis that follows.
        turn_body: [f64; 3],
        /// Where to.
        turn_to: Towards,
    },
    /// A rigid body without torque.
    Tumble {
        /// At the epoch.
        quaternion: [f64; 4],
        /// Principal moments.
        inertia_kg_m2: [f64; 3],
        /// In body axes, at the epoch, degrees per second.
        rate_deg_s: [f64; 3],
        /// The epoch.
        epoch: Moment,
    },
    /// Attitudes at times.
    Table {
        /// The file.
        file: PathBuf,
        /// Its rows.
        rows: Vec<(Instant, Quaternion)>,
    },
}

/// Where a target is.
#[derive(Clone, Debug, PartialEq)]
pub enum Orbit {
    /// A two-line element set; lengths and checksums are right.
    Tle {
        /// The name line, if there was one.
        name: Option<String>,
        /// Line 1, 69 characters.
        line1: String,
        /// Line 2, 69 characters.
        line2: String,
    },
    /// Mean elements of a message.
    Omm {
        /// The file.
        file: PathBuf,
        /// The elements for this target in it.
        elements: Box<MeanElements>,
    },
    /// An ephemeris.
    Oem {
        /// The file.
        file: PathBuf,
        /// What it holds.
        ephemeris: Box<Ephemeris>,
    },
    /// A state vector in GCRS.
    State {
        /// When it holds.
        epoch: Moment,
        /// Position, kilometres.
        position_km: [f64; 3],
        /// Velocity, kilometres per second.
        velocity_km_s: [f64; 3],
    },
    /// Osculating elements in GCRS.
    Kepler {
        /// When they hold.
        epoch: Moment,
        /// Semi-major axis, kilometres.
        a_km: f64,
        /// Eccentricity, below 1.
        e: f64,
        /// Inclination, degrees.
        i_deg: f64,
        /// Right ascension of the ascending node, degrees.
        raan_deg: f64,
        /// Argument of perigee, degrees.
        argp_deg: f64,
        /// Mean anomaly, degrees.
        mean_anomaly_deg: f64,
    },
    /// A fixed place, topocentric astrometric ICRS.
    Fixed {
        /// Right ascension, degrees.
        ra_deg: f64,
        /// Declination, degrees.
        dec_deg: f64,
        /// Distance from the station, kilometres; without it the target is never in shadow.
        range_km: Option<f64>,
    },
}

/// `[sky]`: diffuse light, one model a source.
#[derive(Clone, Debug, PartialEq)]
pub struct Sky {
    /// Light of the upper atmosphere.
    pub airglow: SkyModel,
    /// Scattered artificial light.
    pub pollution: SkyModel,
    /// Scattered sunlight.
    pub twilight: SkyModel,
    /// Stars fainter than those drawn.
    pub starlight: SkyModel,
    /// Scattered moonlight.
    pub moonlight: SkyModel,
    /// Sunlight from interplanetary dust.
    pub zodiacal: SkyModel,
    /// Solar radio flux at 10.7 cm, solar flux units.
    pub f107_sfu: f64,
    /// Relative half-amplitude across x and y of sources given as numbers.
    pub tilt: [f64; 2],
}

/// How one source of sky light is modelled.
#[derive(Clone, Debug, PartialEq)]
pub enum SkyModel {
    /// The default model, left out where negligible.
    Auto,
    /// Not simulated.
    Off,
    /// A model by name.
    Named(String),
    /// V magnitudes per square arcsecond of solar colour at the ground, the same over the frame.
    Surface(f64),
}

/// `[stars]`: stars drawn one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct Stars {
    /// False: none are drawn.
    pub enabled: bool,
    /// Catalogue they come from.
    pub catalog: Table,
    /// Whether counts fill the field beyond the catalogue.
    pub synthetic: bool,
    /// Faintest V magnitude drawn; none = follows `accuracy.omit`.
    pub limit_mag_v: Option<f64>,
    /// Stars at random places instead of catalogue and counts; 0 = none.
    pub random_count: usize,
    /// Brightest and faintest V magnitude of the random stars.
    pub random_mag_v: [f64; 2],
    /// Seed of the random stars.
    pub random_seed: u64,
}

/// `[photometry]`: how light curves are measured from frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Photometry {
    /// The estimator of the flux.
    pub method: Method,
    /// Radius of the aperture, pixels, which makes the estimator a sum; none = chosen from the image.
    pub aperture_px: Option<f64>,
    /// Search radius about the place predicted, or the frame's centre, pixels.
    pub search_px: f64,
    /// Mesh of the background, pixels.
    pub background_px: usize,
    /// Fewer stars than this borrow the zero point from neighbours in time.
    pub min_stars: usize,
}

/// Estimator of a flux.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The fit of an image to the pixels: the least variance there can be.
    Optimal,
    /// Sum within an aperture.
    Aperture,
    /// The fit of the target's image and those of the stars beside it.
    Joint,
}

/// `[inversion]`: how shapes are sought in light curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Inversion {
    /// Whether `run` goes on to the shape.
    pub enabled: bool,
    /// Method.
    pub model: String,
    /// What the faces are made of.
    pub brdf: Law,
    /// How the object turns.
    pub attitude: Turning,
    /// A mesh that the shape is compared with, and nothing else.
    pub truth: Option<PathBuf>,
    /// Share of epochs kept back to test the shape.
    pub held_out: f64,
}

/// What an inversion takes the faces to be made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Law {
    /// As the target is said to be.
    AsTarget,
    /// Specular share and exponent are found together with the shape.
    Fit,
    /// Made of this.
    Given(Box<MaterialKeys>),
}

/// How an inversion takes the object to turn.
#[derive(Clone, Debug, PartialEq)]
pub enum Turning {
    /// As the target is said to.
    AsTarget,
    /// Uniformly, about a pole that is sought over the whole sphere.
    ScanPole,
    /// As a body without torque, whose motion is sought.
    ScanTumble,
    /// In this way.
    Given(Box<Attitude>),
}

/// `[output]`: what is written. None of this changes a pixel or SCENESHA.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// File formats of the frames.
    pub format: Vec<String>,
    /// Planes of mean and variance written beside the frames.
    pub planes: Vec<String>,
    /// Whether a table of drawn stars is written for every frame.
    pub star_table: bool,
    /// The part of each frame that is written.
    pub crop: Crop,
    /// Side of a crop about the target, pixels.
    pub crop_px: usize,
    /// With crops: every n-th frame whole; 0 = none.
    pub full_every: usize,
    /// Whether a report is written.
    pub report: bool,
}

/// The part of a frame that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crop {
    /// The whole frame.
    None,
    /// A square of side `crop_px` about the target.
    Target,
    /// x0, y0, width and height, pixels.
    Rect([usize; 4]),
}
