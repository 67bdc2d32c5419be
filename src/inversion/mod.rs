//! From light curves to shapes.
//!
//! ```text
//! egi        a light curve -> areas and normals (the extended Gaussian image), with errors and a certificate
//! minkowski  areas and normals -> the one convex body that has them
//! polytope   that body's planes, vertices, faces; how alike two bodies are
//! nonconvex  is the body convex at all; boxes and panels fitted through the exact renderer, and all that fit as well
//! inner      what an attitude is worth, quickly
//! refine     a motion and its facets together
//! tumble     how a body without torque may turn, experimental
//! pole       where a spinning body's axis may point
//! ```

pub mod baseline_resample;
pub mod cholesky;
pub mod egi;
mod inner;
pub mod minkowski;
pub mod nnls;
pub mod nonconvex;
pub mod observability;
pub mod pole;
pub mod polytope;
mod refine;
pub mod sphere;
pub mod synthetic;
pub mod tumble;
