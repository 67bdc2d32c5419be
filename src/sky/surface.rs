//! A source given as a number: V mag/arcsec^2 of solar colour at the ground, tilted across the frame.

use super::{Context, Field, Source, Toward};
use crate::base::ledger::Why;
use crate::base::surface_brightness::MagArcsec2;

/// A uniform or tilted surface brightness.
pub struct Surface {
    name: &'static str,
    keyword: &'static str,
    electrons: f64,
    brightness: Option<MagArcsec2>,
    tilt: [f64; 2],
}

impl Surface {
    /// The source `name` as a surface brightness in V.
    pub fn new(context: &Context, name: &'static str, keyword: &'static str, brightness: MagArcsec2) -> Self {
        let electrons = context.electrons_at_ground(brightness);
        Self { name, keyword, electrons, brightness: Some(brightness), tilt: context.scene.sky.tilt }
    }

    /// The source `name`, switched off.
    pub fn off(name: &'static str, keyword: &'static str) -> Self {
        Self { name, keyword, electrons: 0.0, brightness: None, tilt: [0.0; 2] }
    }
}

impl Source for Surface {
    fn name(&self) -> &'static str {
        self.name
    }

    fn keyword(&self) -> &'static str {
        self.keyword
    }

    fn basis(&self) -> String {
        self.brightness
            .map_or_else(String::new, |MagArcsec2(mag)| format!("given: V {mag} mag/arcsec^2 at the ground"))
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        self.brightness.is_none().then_some(Why::NotAsked)
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let share = 1.0 + self.tilt[0] * toward.in_frame.x + self.tilt[1] * toward.in_frame.y;
        self.electrons * share.max(0.0)
    }

    fn uncertainty(&self) -> f64 {
        0.0
    }
}
