//! Files of frames and tables. The only room that knows of FITS' counting from 1.

pub mod alcdef;
pub mod atomic;
pub mod checksum;
pub mod curve_file;
#[cfg(test)]
mod curve_file_tests;
pub mod ecsv;
pub(crate) mod ecsv_read;
pub mod exr_file;
pub mod fits;
pub mod fz;
pub mod header;
pub mod image;
pub mod labels;
#[cfg(feature = "parquet")]
pub mod parquet;
mod plain;
pub mod preview;
pub mod regions;
pub mod shape_file;
#[cfg(test)]
mod shape_file_tests;
pub mod tdm;
mod yaml;
