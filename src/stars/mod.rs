//! Stars: the catalogue, the counts beyond it, and which stars a frame can see.

pub mod catalogue;
pub mod cells;
pub mod counts;
pub mod drawn;
pub mod encode;
pub mod field;
pub mod import;
pub mod layout;
pub mod synthetic;
