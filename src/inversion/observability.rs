//! What a set of attitudes can tell of any body.
//!
//! Singular values of the flux matrix over an even grid of normals: as many numbers as stand above the noise can be known
//! (Hansen 1998, Rank-Deficient and Discrete Ill-Posed Problems, sect. 3). At phase angle 0 the Lambert kernel is (n.s)+^2 =
//! (x^2 + x|x|)/2, whose even part has degrees 0 and 2 only: even harmonics of degree 4 and up cannot be seen at all.

use super::sphere::fibonacci;
use crate::object::convex::Epochs;
use crate::object::matter::Material;
use faer::{Mat, Side};

/// Singular values of the flux matrix over the greatest, falling, for `count` normals; those below 1e-7 are rounding, for they
/// are roots of eigenvalues of G'G. Empty where no light comes at all.
pub fn spectrum(epochs: &Epochs, material: &Material, count: usize) -> Vec<f64> {
    let columns: Vec<Vec<f64>> = fibonacci(count).map(|n| epochs.column(n, material, 0.0)).collect();
    let matrix = Mat::from_fn(epochs.len(), columns.len(), |t, j| columns[j][t]);
    let gram = match matrix.nrows() < matrix.ncols() {
        true => &matrix * matrix.transpose(),
        false => matrix.transpose() * &matrix,
    };
    let Ok(mut values) = gram.self_adjoint_eigenvalues(Side::Lower) else { return Vec::new() };
    values.reverse();
    let Some(greatest) = values.first().copied().filter(|v| *v > 0.0) else { return Vec::new() };
    values.iter().map(|v| (v.max(0.0) / greatest).sqrt()).collect()
}

/// Singular values above 1/snr of the greatest, of `count` normals; `snr` counts to 1e7.
pub fn effective_rank(epochs: &Epochs, material: &Material, count: usize, snr: f64) -> usize {
    let least = 1.0 / snr.clamp(1.0, 1e7);
    spectrum(epochs, material, count).iter().filter(|&&v| v > least).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inversion::synthetic::{Stream, fixed_phase};

    fn ranks(phase_deg: f64) -> [usize; 3] {
        let epochs = Epochs::new(fixed_phase(900, phase_deg.to_radians(), &mut Stream::new(1)));
        let spectrum = spectrum(&epochs, &Material::lambert(1.0), 600);
        [0.1, 0.03, 0.01].map(|least| spectrum.iter().filter(|&&v| v > least).count())
    }

    /// Degrees 0, 1, 2 and 3 have 1 + 3 + 5 + 7 = 16 harmonics, and (x|x|)'s coefficients of odd degree fall fast.
    #[test]
    fn at_phase_0_sixteen_numbers_can_be_known_at_3_per_cent_and_more_at_90_deg() {
        let [ten, three, one] = ranks(0.0);
        assert_eq!((ten, three), (16, 16));
        assert!((20..40).contains(&one), "{one}");
        let wide = ranks(90.0);
        assert!(wide[0] > 20 && wide[1] > 30 && wide[2] > 80, "{wide:?}");
    }

    #[test]
    fn no_epochs_and_no_light_have_rank_0() {
        assert_eq!(effective_rank(&Epochs::default(), &Material::lambert(1.0), 50, 30.0), 0);
        let behind = Epochs::new([(glam::DVec3::Z, -glam::DVec3::Z)]);
        assert_eq!(effective_rank(&behind, &Material::lambert(1.0), 50, f64::NAN), 0);
    }
}
