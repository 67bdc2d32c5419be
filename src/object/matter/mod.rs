//! What surfaces are made of: how much light they send where.

pub mod albedo;
pub mod brdf;
pub mod materials;
pub mod real;
pub mod sun_disc;
pub mod tabulated;

#[cfg(test)]
mod laws;

pub use albedo::directional_albedo;
pub use brdf::{Material, MaterialError, Model, Parameters, gradient, reflect};
pub use real::{Dual, Real};
pub use sun_disc::{lobe_width, mirror_weight, weight};
pub use tabulated::{Table, TableError};
