//! One spectrum through one instrument, made ready for many factors and many paths through the air.
//!
//! The integral of [`super`] with its wavelength nodes, weights and extinction worked out once: a further factor (a
//! star's colour, the reddening of zodiacal light) or airmass then costs one sum.

use super::tabulated::{AIRMASSES, Tabulated};

/// Nodes of wavelength with the electrons each contributes.
#[derive(Debug, Clone)]
pub struct Integrand {
    /// Wavelengths \[nm\].
    pub nm: Vec<f64>,
    /// Electrons per second of each node above the atmosphere (per steradian from a radiance).
    pub electrons: Vec<f64>,
    /// Optical depth of one airmass at each node.
    pub depth: Vec<f64>,
}

/// A share of the light of a spectrum, gathered in one band of wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Mean wavelength, weighted by the electrons \[nm\].
    pub nm: f64,
    /// Electrons per second (per steradian from a radiance).
    pub electrons: f64,
}

impl Integrand {
    /// Electrons per second through air that passes `transmission(nm)` of the light.
    pub fn through(&self, transmission: impl Fn(f64) -> f64) -> f64 {
        self.nm.iter().zip(&self.electrons).map(|(nm, e)| e * transmission(*nm)).sum()
    }

    /// The rate of the spectrum times each of `factors(nm)` against airmass.
    pub fn tabulate(&self, factors: &[&dyn Fn(f64) -> f64]) -> Vec<Tabulated> {
        let weighted = factors.iter().map(|f| self.nm.iter().zip(&self.electrons).map(|(nm, e)| e * f(*nm)));
        let weighted = weighted.map(Iterator::collect::<Vec<_>>).collect::<Vec<_>>();
        let mut values = vec![Vec::with_capacity(AIRMASSES.len()); factors.len()];
        for airmass in AIRMASSES {
            let kept = self.depth.iter().map(|tau| (-tau * airmass).exp()).collect::<Vec<_>>();
            for (value, weights) in values.iter_mut().zip(&weighted) {
                value.push(weights.iter().zip(&kept).map(|(w, k)| w * k).sum::<f64>());
            }
        }
        values.into_iter().map(|v| Tabulated::new(&AIRMASSES, v)).collect()
    }

    /// The electrons gathered in bands of `width` nm; bands without light are left out.
    pub fn bins(&self, width: f64) -> Vec<Bin> {
        let mut bins: Vec<(i64, f64, f64)> = Vec::new();
        for (nm, e) in self.nm.iter().zip(&self.electrons) {
            let number = (nm / width).floor() as i64;
            match bins.last_mut() {
                Some((last, sum, moment)) if *last == number => {
                    *sum += e;
                    *moment += e * nm;
                }
                _ => bins.push((number, *e, e * nm)),
            }
        }
        let lit = bins.into_iter().filter(|(_, sum, _)| *sum > 0.0);
        lit.map(|(_, sum, moment)| Bin { nm: moment / sum, electrons: sum }).collect()
    }
}
