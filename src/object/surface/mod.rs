//! Surfaces as triangles: files, built-in shapes, checks and repair.

pub mod check;
pub mod error;
pub mod fault;
pub mod files;
pub mod mesh;
pub mod mtl;
pub mod obj;
pub mod observatory;
pub mod primitives;
pub mod repair;
pub mod revolve;
pub mod stl;
mod text;
pub mod topology;
mod triangulate;
