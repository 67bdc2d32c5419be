//! Stars: the catalogue, how one is made, and which of its stars a frame can see.

pub mod catalogue;
pub mod cells;
pub mod columns;
pub mod completeness;
pub mod encode;
pub mod error;
pub mod import;
pub mod index;
pub mod layout;
pub mod listing;
pub mod passbands;
pub mod summary;
pub mod supplement;
pub mod table;
