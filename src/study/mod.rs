//! Studies of a scene.

pub mod accuracy;
mod astro_accuracy;
pub mod explain;
pub mod night_chart;
