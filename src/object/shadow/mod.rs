//! Shadows: of every face the part that the Sun lights and the observer sees.

pub mod body;
pub mod bvh;
pub mod card;
pub mod cells;
pub mod exact;
mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "gpu")]
mod gpu_device;
#[cfg(feature = "gpu")]
mod gpu_pipelines;
pub mod polygon;
pub mod raster;
pub mod rays;
pub mod triangle;

#[cfg(test)]
mod bvh_tests;
#[cfg(test)]
mod fixtures;
#[cfg(all(test, feature = "gpu"))]
mod gpu_tests;
#[cfg(test)]
mod raster_tests;
#[cfg(test)]
mod ray_shapes;
#[cfg(test)]
mod rays_tests;
