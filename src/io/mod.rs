//! Files of frames and tables. The only room that knows of FITS' counting from 1.

pub mod atomic;
pub mod checksum;
pub mod ecsv;
pub mod exr_file;
pub mod fits;
pub mod fz;
pub mod header;
pub mod image;
pub mod labels;
pub mod preview;
pub mod regions;
