//! Studies of a scene.

pub mod accuracy;
pub mod accuracy_chart;
mod astro_accuracy;
mod curve_axis;
pub mod curve_chart;
mod curve_marks;
pub mod curve_picture;
#[cfg(test)]
mod curve_picture_tests;
mod errors;
pub mod explain;
pub mod finder;
mod fit_histogram;
pub mod fit_picture;
#[cfg(test)]
mod fit_picture_tests;
mod fit_plan;
mod inversion_accuracy;
pub mod measured_picture;
pub mod night_chart;
mod noise_accuracy;
pub mod object_accuracy;
mod page;
mod palette;
mod photometry_accuracy;
mod poisson_accuracy;
pub mod pole_picture;
pub mod report;
pub mod sensitivity;
pub mod shadow_chart;
pub mod shape_picture;
#[cfg(test)]
mod shape_picture_tests;
mod shape_raster;
pub mod sky;
pub mod sky_maps;
pub mod sky_night;
pub mod snr;
pub mod sphere_picture;
#[cfg(test)]
mod sphere_picture_tests;
pub mod suggest;
mod tolerance_accuracy;
