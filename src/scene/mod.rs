//! What the user writes: the scene file, checked and complete.
//!
//! ```text
//! text -> tree (every node knows its line) -> --set -> station preset -> one-of siblings
//!      -> check against the table of keys (all faults at once, defaults) -> Scene
//! ```
//!
//! The table of keys (`keys.rs`) is the one place that knows paths, units, ranges, defaults and meanings; the
//! commented template and the JSON Schema follow from it. Angles are in degrees east and north positive, times
//! UTC, directions ICRS; the unit ends a key's name and the field that holds it.
//!
//! ```
//! use nightglass::scene::{self, Options};
//! let brighter = [("target.0.brightness.mag_v".to_string(), "10.5".to_string())];
//! let scene = scene::load("pogs-geo", &Options { sets: &brighter, seed: Some(7) })?;
//! assert_eq!(scene.target[0].brightness, scene::Brightness::MagV(10.5));
//! assert_eq!(scene.detector.size_px, [4096, 4096]);
//! # Ok::<(), scene::SceneError>(())
//! ```

mod builtin;
mod check;
mod consistency;
mod cross;
mod edit;
mod fault;
mod field;
mod instrument;
mod jsonschema;
mod keys;
mod numeric;
mod resolve;
mod schema;
mod shaped;
mod target;
mod template;
mod tree;
mod typed;
mod types;
mod value;

pub use builtin::{SCENES, STATIONS};
pub use consistency::contradictions;
pub use edit::{Change, with_accuracy};
pub use fault::{Fault, SceneError};
pub use instrument::*;
pub use jsonschema::json_schema;
pub use numeric::{Numeric, numeric};
pub use resolve::{Options, load, load_station, load_str, template};
pub use template::station as station_template;
pub use types::*;
