//! Stars: the catalogue, and which of its stars a frame can see.

pub mod catalogue;
pub mod cells;
pub mod encode;
pub mod error;
pub mod import;
pub mod layout;
