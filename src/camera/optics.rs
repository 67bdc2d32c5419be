//! What the telescope and the air make of a point, for any exposure of a scene.

use super::profile::Profile;
use super::psf;
use super::psf_image::PsfImage;
use super::radial::Radial;
use crate::base::units::ARCSEC_PER_RAD;
use crate::light::tables;
use crate::light::throughput::Throughput;
use crate::scene::{Psf, Scene};
use std::sync::Arc;

/// Wavelength of the seeing and of the diffraction added to it \[m\].
const SEEING_M: f64 = 550e-9;
/// Seeing and lambda / D below this are taken as this \[px\]: no pixel tells it from a point.
const NARROWEST: f64 = 1e-3;
/// Width of the bands in which the rings of diffraction are added up \[nm\].
const BAND_NM: f64 = 50.0;

/// What all exposures of a scene share.
#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    image: Option<Arc<PsfImage>>,
    /// Wavelength \[m\] and share of the electrons of sunlight.
    bands: Vec<[f64; 2]>,
}

impl Optics {
    /// The optics of a scene, which `throughput` passes light through.
    ///
    /// # Errors
    /// What is wrong with the image of a point that the scene names.
    pub fn new(scene: &Scene, throughput: &Throughput) -> Result<Self, String> {
        let image = match &scene.telescope.psf {
            Psf::Image(path) => Some(Arc::new(PsfImage::read(path)?)),
            _ => None,
        };
        let bins = throughput.integrand(&tables::sun()).bins(BAND_NM);
        let sum: f64 = bins.iter().map(|bin| bin.electrons).sum();
        let bands = bins.iter().map(|bin| [bin.nm * 1e-9, bin.electrons / sum]).collect();
        Ok(Self { image, bands })
    }

    /// The image of a point at `airmass`, no narrower than a thousandth of a pixel.
    pub fn profile(&self, scene: &Scene, airmass: f64) -> Profile {
        let t = &scene.telescope;
        let per_px = 1.0 / scene.stored_scale_arcsec();
        let diffraction =
            |wavelength_m: f64| (wavelength_m / t.aperture_m * ARCSEC_PER_RAD * per_px).max(NARROWEST);
        let seeing = (scene.station.seeing_arcsec * libm::pow(airmass, 0.6) * per_px).max(NARROWEST);
        let obstruction = (t.obstruction_m / t.aperture_m).min(0.99);
        // FWHM of an unobstructed aperture
        let fwhm = seeing.hypot(1.029 * diffraction(SEEING_M));
        match &t.psf {
            Psf::Gaussian => Profile::gaussian(fwhm),
            Psf::Moffat => Profile::moffat(fwhm, t.moffat_beta),
            Psf::Airy => {
                let bands = self.bands.iter().map(|[m, share]| [diffraction(*m), *share]).collect::<Vec<_>>();
                let narrowest = bands.iter().fold(f64::INFINITY, |least, band| least.min(band[0]));
                Profile::Radial(Arc::new(Radial::airy(&bands, obstruction, psf::farthest(narrowest))))
            }
            Psf::Kolmogorov => {
                let reach = psf::farthest(fwhm);
                Profile::Radial(Arc::new(Radial::kolmogorov(seeing, diffraction(SEEING_M), obstruction, reach)))
            }
            Psf::Image(_) => match &self.image {
                Some(image) => Profile::Image(image.clone()),
                None => Profile::gaussian(fwhm),
            },
        }
    }
}
