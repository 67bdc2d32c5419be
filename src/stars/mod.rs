//! Stars: the catalogue, and which of its stars a frame can see.

pub mod catalogue;
pub mod import;
