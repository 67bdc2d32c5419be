//! What an object looks like: its mesh, what it is made of, and the light that it sends to an observer.
//!
//! ```text
//! surface   mesh files, built-in shapes -> checks -> triangles
//! matter    materials -> weight of a face (BRDF, both cosines, the Sun's disc)
//! shadow    weights, triangles -> light: exact clipping | rays | shadow maps
//! shape     triangles with a material each, parts that turn
//! light     of a shape at an instant, by the cheapest way that is exact enough
//! integral  over an exposure, glints foreseen
//! ```

pub mod convex;
pub mod earthshine;
pub mod glint;
pub mod integral;
pub mod light;
pub mod matter;
pub mod picture;
pub mod shadow;
pub mod shape;
pub mod surface;
pub mod way;
