//! Studies of a scene.

pub mod explain;
