//! Stars: the catalogue and how one is made, the counts beyond it, and which stars a frame can see.

pub mod catalogue;
pub mod cells;
pub mod columns;
pub mod completeness;
pub mod counts;
pub mod drawn;
pub mod encode;
pub mod error;
pub mod field;
pub mod import;
pub mod index;
pub mod layout;
pub mod listing;
pub mod passbands;
pub mod summary;
pub mod supplement;
pub mod synthetic;
pub mod table;
