//! Studies of a scene.

pub mod accuracy;
mod astro_accuracy;
mod errors;
pub mod explain;
pub mod night_chart;
mod palette;
pub mod sky;
pub mod sky_maps;
pub mod sky_night;
