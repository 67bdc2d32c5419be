//! Studies of a scene.

pub mod accuracy;
pub mod explain;
