//! Studies of a scene.

pub mod accuracy;
mod astro_accuracy;
mod errors;
pub mod explain;
pub mod night_chart;
