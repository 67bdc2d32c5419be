//! What every other room stands on: constants, unit conversions, tolerances, the ledger of what a frame
//! holds and leaves out, and random numbers that are functions of their address.

pub mod accuracy;
pub mod constants;
pub mod cubic_grid;
pub mod elementary;
pub mod ledger;
pub mod nodes;
pub mod poisson;
pub mod poisson_cdf;
pub mod quadrature;
pub mod random;
pub mod sample;
pub mod simd;
pub mod surface_brightness;
pub mod table;
pub mod units;
