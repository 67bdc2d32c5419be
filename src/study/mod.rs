//! Studies of a scene.

pub mod accuracy;
mod astro_accuracy;
pub mod curve_chart;
mod errors;
pub mod explain;
pub mod night_chart;
pub mod object_accuracy;
mod palette;
pub mod shadow_chart;
pub mod sky;
pub mod sky_maps;
pub mod sky_night;
