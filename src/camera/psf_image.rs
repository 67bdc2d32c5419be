//! A point's image as the user gives it: the first image of a FITS file.
//!
//! Its values are surface densities, bilinear between the centres of its pixels; they are scaled to unit sum and centred on
//! their centroid. The keyword OVERSAMP tells how many of its pixels lie along one of the camera's (1 without it). A measured
//! image should be sampled four times finer than the camera's pixels, for it is integrated over these.

use fitsy::FitsFile;
use fitsy::hdu::Hdu;
use fitsy::header::Value;
use glam::DVec2;
use std::f64::consts::PI;
use std::path::Path;

/// Largest image \[px\].
const LARGEST: u64 = 4_194_304;

/// A point's image.
#[derive(Debug, Clone, PartialEq)]
pub struct PsfImage {
    size: [usize; 2],
    /// Densities of unit sum \[1/px^2 of the camera\], by rows.
    values: Vec<f64>,
    /// Its pixels along one of the camera's.
    oversampling: f64,
    /// Its centroid \[its px\].
    centre: DVec2,
    fwhm: f64,
}

impl PsfImage {
    /// Read an image.
    ///
    /// # Errors
    /// What is wrong with the file, with its path.
    pub fn read(path: &Path) -> Result<Self, String> {
        let told = |what: String| format!("{}: {what}", path.display());
        let file = FitsFile::open(path).map_err(|e| told(e.to_string()))?;
        for hdu in file.iter_decompressed() {
            let Hdu::Image(image) = hdu.map_err(|e| told(e.to_string()))? else { continue };
            let &[width, height] = image.axes() else { continue };
            if width.saturating_mul(height) > LARGEST {
                return Err(told(format!("{width} x {height} pixels; at most {LARGEST} are allowed")));
            }
            let oversampling = match image.header().first("OVERSAMP") {
                Some(Value::Integer(n)) => n as f64,
                Some(Value::Real(x)) => x,
                _ => 1.0,
            };
            let values = image.read_physical().map_err(|e| told(e.to_string()))?.into_vec();
            return Self::new([width as usize, height as usize], values, oversampling).map_err(told);
        }
        Err(told("no two-dimensional image in this file".into()))
    }

    /// The point's image of `size` pixels, `oversampling` of them along one of the camera's.
    ///
    /// # Errors
    /// What is wrong with the values.
    pub fn new(size: [usize; 2], mut values: Vec<f64>, oversampling: f64) -> Result<Self, String> {
        if !(oversampling.is_finite() && (0.01..=1000.0).contains(&oversampling)) {
            return Err(format!("OVERSAMP = {oversampling}: must lie in 0.01..1000"));
        }
        if let Some(bad) = values.iter().find(|v| !v.is_finite()) {
            return Err(format!("a pixel of {bad}; all must be numbers"));
        }
        let sum = values.iter().sum::<f64>();
        if sum.is_nan() || sum <= 0.0 {
            return Err(format!("the pixels' sum is {sum}; it must be positive"));
        }
        let place = |k: usize| DVec2::new((k % size[0]) as f64, (k / size[0]) as f64);
        let centre = values.iter().enumerate().map(|(k, v)| place(k) * *v).sum::<DVec2>() / sum;
        let scale = oversampling * oversampling / sum;
        values.iter_mut().for_each(|v| *v *= scale);
        let half = 0.5 * values.iter().fold(0.0f64, |most, v| most.max(*v));
        let above = values.iter().filter(|v| **v > half).count() as f64;
        let fwhm = 2.0 * (above / PI).sqrt() / oversampling;
        Ok(Self { size, values, oversampling, centre, fwhm })
    }

    /// Surface density at an offset from the centroid \[1/px^2\]; 0 beyond the image.
    pub fn density(&self, offset: DVec2) -> f64 {
        let at = self.centre + offset * self.oversampling;
        let low = at.floor();
        let t = at - low;
        let value = |dx: f64, dy: f64| {
            let (x, y) = (low.x + dx, low.y + dy);
            let inside = x >= 0.0 && y >= 0.0 && x < self.size[0] as f64 && y < self.size[1] as f64;
            if inside { self.values[y as usize * self.size[0] + x as usize] } else { 0.0 }
        };
        let row = |dy: f64| value(0.0, dy) * (1.0 - t.x) + value(1.0, dy) * t.x;
        row(0.0) * (1.0 - t.y) + row(1.0) * t.y
    }

    /// Distance of the farthest corner from the centroid along an axis \[px\].
    pub fn radius(&self) -> f64 {
        let size = DVec2::new(self.size[0] as f64, self.size[1] as f64);
        self.centre.max(size - self.centre).max_element() / self.oversampling
    }

    /// Full width at half maximum of a circle of the same area \[px\].
    pub fn fwhm(&self) -> f64 {
        self.fwhm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_centred_and_of_unit_sum() {
        let image = PsfImage::new([3, 1], vec![1.0, 2.0, 1.0], 2.0).expect("an image");
        assert_eq!(image.density(DVec2::ZERO), 2.0);
        assert_eq!(image.density(DVec2::new(0.25, 0.0)), 1.5);
        assert_eq!(image.density(DVec2::new(9.0, 0.0)), 0.0);
        for (values, oversampling) in [(vec![0.0; 3], 1.0), (vec![1.0, f64::NAN, 0.0], 1.0), (vec![1.0; 3], 0.0)] {
            assert!(PsfImage::new([3, 1], values, oversampling).is_err());
        }
    }
}
