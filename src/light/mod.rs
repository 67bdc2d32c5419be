//! Light as photons through a passband.
//!
//! The rate of electrons from a spectrum S (lambda) is
//!
//! ```text
//! A int S(lambda) T(lambda) QE(lambda) F(lambda) 10^(-0.4 k(lambda) X) lambda / (h c) dlambda
//! ```
//!
//! with the net collecting area A, the optics' throughput T, the quantum efficiency QE, the filter F, the
//! extinction k \[mag/airmass\] and the airmass X. The sum is weighted by photons, on the union of all
//! wavelength grids. There is no scalar zero point: a magnitude means a spectrum scaled to that magnitude in
//! Johnson V, where Vega has V = +0.03.

pub mod atlas;
pub mod atmosphere;
pub mod colour;
pub mod curve;
pub mod integrand;
pub mod quantities;
pub mod tables;
pub mod tabulated;
pub mod throughput;
