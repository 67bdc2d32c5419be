//! Mean elements of SGP4, whatever message they came in.

use super::super::Error;
use super::super::time::Instant;

/// Mean elements of an object, as two-line sets and orbit mean-elements messages carry them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeanElements {
    /// Name, if known.
    pub name: Option<String>,
    /// Catalogue number.
    pub catalog_number: u64,
    /// International designator, such as `2009-033A`; empty if unknown.
    pub designator: String,
    /// When they hold.
    pub epoch: Instant,
    /// Mean motion (Kozai) \[revolutions per day\].
    pub mean_motion_rev_day: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination \[deg\].
    pub inclination_deg: f64,
    /// Right ascension of the ascending node \[deg\].
    pub raan_deg: f64,
    /// Argument of perigee \[deg\].
    pub argp_deg: f64,
    /// Mean anomaly \[deg\].
    pub mean_anomaly_deg: f64,
    /// Drag term B* \[1/Earth radii\].
    pub bstar: f64,
}

impl MeanElements {
    /// A name to show: the object's, else its catalogue number.
    pub fn title(&self) -> String {
        self.name.clone().unwrap_or_else(|| format!("object {}", self.catalog_number))
    }

    /// The elements, if SGP4 can use them.
    ///
    /// # Errors
    /// [`Error::Elements`] naming each value outside its range.
    pub fn checked(self) -> Result<Self, Error> {
        let ranges = [
            ("mean motion", self.mean_motion_rev_day, 0.0, 18.0, "rev/d"),
            ("eccentricity", self.eccentricity, 0.0, 1.0, ""),
            ("inclination", self.inclination_deg, 0.0, 180.0, "deg"),
            ("right ascension of the node", self.raan_deg, -360.0, 360.0, "deg"),
            ("argument of perigee", self.argp_deg, -360.0, 360.0, "deg"),
            ("mean anomaly", self.mean_anomaly_deg, -360.0, 360.0, "deg"),
            ("B*", self.bstar, -10.0, 10.0, "1/Earth radii"),
        ];
        let wrong = ranges.iter().filter(|(name, value, low, high, _)| {
            let open_low = *name == "mean motion" && *value == 0.0;
            let open_high = *name == "eccentricity" && *value == 1.0;
            !(low..=high).contains(&value) || open_low || open_high
        });
        let reasons = wrong
            .map(|(name, value, low, high, unit)| {
                let excluded = match *name {
                    "mean motion" => ", 0 excluded",
                    "eccentricity" => ", 1 excluded (a hyperbola is no orbit of SGP4)",
                    _ => "",
                };
                format!("{name} {value} must lie in {low}..{high} {unit}{excluded}").replace(" ,", ",")
            })
            .collect::<Vec<_>>();
        if reasons.is_empty() {
            Ok(self)
        } else {
            Err(Error::Elements { name: self.title(), reason: reasons.join("; ") })
        }
    }
}
