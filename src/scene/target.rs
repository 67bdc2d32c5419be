//! `[[target]]` between TOML and its type: orbit, brightness, attitude, and the files they name.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::{Value as Json, json};
use toml::{Table as Plain, Value};

use super::field::{Field, Section, get, inner, put};
use super::shaped;
use super::types::{Attitude, Brightness, Moment, Orbit, Target};
use super::value::{epoch, message_for, text_of};
use crate::astro::attitude::{Profile, Towards};
use crate::astro::orbit::oem::Ephemeris;
use crate::object::matter::Material;

const ORBIT: &str = "target[].orbit";
const ATTITUDE: &str = "target[].attitude";

impl Field for Moment {
    fn read(value: Option<&Value>) -> Option<Self> {
        let time = value?.as_datetime()?;
        Some(Self { instant: epoch(time)?, text: time.to_string() })
    }
    fn write(&self) -> Option<Value> {
        self.text.parse().ok().map(Value::Datetime)
    }
}

impl Field for PathBuf {
    fn read(value: Option<&Value>) -> Option<Self> {
        value?.as_str().map(Self::from)
    }
    fn write(&self) -> Option<Value> {
        Some(self.to_string_lossy().into_owned().into())
    }
}

impl Field for Towards {
    fn read(value: Option<&Value>) -> Option<Self> {
        match value?.as_str()? {
            "earth" => Some(Self::Earth),
            "sun" => Some(Self::Sun),
            "velocity" => Some(Self::Velocity),
            "observer" => Some(Self::Observer),
            _ => None,
        }
    }
    fn write(&self) -> Option<Value> {
        Some(self.name().into())
    }
}

/// Puts several fields of a table, each under its own name.
macro_rules! puts {
    ($table:expr, $form:expr; $($field:ident)+) => {
        $(put($table, $form, stringify!($field), $field);)+
    };
}

impl Section for Orbit {
    fn read(orbit: &Plain) -> Result<Self, String> {
        let form = |name: &str| orbit.get(name).and_then(Value::as_table);
        if let Some(t) = form("fixed") {
            return Ok(Self::Fixed {
                ra_deg: get(t, "ra_deg")?,
                dec_deg: get(t, "dec_deg")?,
                range_km: get(t, "range_km")?,
            });
        }
        if let Some(t) = form("state") {
            return Ok(Self::State {
                epoch: get(t, "epoch")?,
                position_km: get(t, "position_km")?,
                velocity_km_s: get(t, "velocity_km_s")?,
            });
        }
        if let Some(t) = form("kepler") {
            return Ok(Self::Kepler {
                epoch: get(t, "epoch")?,
                a_km: get(t, "a_km")?,
                e: get(t, "e")?,
                i_deg: get(t, "i_deg")?,
                raan_deg: get(t, "raan_deg")?,
                argp_deg: get(t, "argp_deg")?,
                mean_anomaly_deg: get(t, "mean_anomaly_deg")?,
            });
        }
        if let Some(file) = PathBuf::read(orbit.get("omm")) {
            return Ok(Self::Omm { file, elements: Box::default() });
        }
        if let Some(file) = PathBuf::read(orbit.get("oem")) {
            return Ok(Self::Oem { file, ephemeris: Box::default() });
        }
        match get::<Vec<String>>(orbit, "tle")?.as_slice() {
            [line1, line2] => Ok(Self::Tle { name: None, line1: line1.clone(), line2: line2.clone() }),
            [name, line1, line2] => {
                Ok(Self::Tle { name: Some(name.clone()), line1: line1.clone(), line2: line2.clone() })
            }
            _ => Err("tle".into()),
        }
    }

    fn write(&self, orbit: &mut Plain) {
        let mut own = Plain::new();
        match self {
            Self::Tle { name, line1, line2 } => {
                let lines: Vec<String> = name.iter().chain([line1, line2]).cloned().collect();
                put(orbit, ORBIT, "tle", &lines);
            }
            Self::Omm { file, .. } => put(orbit, ORBIT, "omm", file),
            Self::Oem { file, .. } => put(orbit, ORBIT, "oem", file),
            Self::Fixed { ra_deg, dec_deg, range_km } => {
                puts!(&mut own, "target[].orbit.fixed"; ra_deg dec_deg range_km);
                orbit.insert("fixed".into(), own.into());
            }
            Self::State { epoch, position_km, velocity_km_s } => {
                let frame = &"gcrs".to_string();
                puts!(&mut own, "target[].orbit.state"; epoch frame position_km velocity_km_s);
                orbit.insert("state".into(), own.into());
            }
            Self::Kepler { epoch, a_km, e, i_deg, raan_deg, argp_deg, mean_anomaly_deg } => {
                let frame = &"gcrs".to_string();
                puts!(&mut own, "target[].orbit.kepler"; epoch frame a_km e i_deg raan_deg argp_deg mean_anomaly_deg);
                orbit.insert("kepler".into(), own.into());
            }
        }
    }
}

impl Section for Attitude {
    fn read(t: &Plain) -> Result<Self, String> {
        Ok(match get::<String>(t, "mode")?.as_str() {
            "inertial" => Self::Inertial { quaternion: get(t, "quaternion")? },
            "spin" => Self::Spin {
                quaternion: get(t, "quaternion")?,
                axis: get(t, "axis")?,
                period_s: get(t, "period_s")?,
                phase_deg: get(t, "phase_deg")?,
                epoch: get(t, "epoch")?,
            },
            "nadir" => Self::Nadir,
            "sun" => Self::Sun,
            "aligned" => Self::Aligned {
                point_body: get(t, "point_body")?,
                point_to: get(t, "point_to")?,
                turn_body: get(t, "turn_body")?,
                turn_to: get(t, "turn_to")?,
            },
            "tumble" => Self::Tumble {
                quaternion: get(t, "quaternion")?,
                inertia_kg_m2: get(t, "inertia_kg_m2")?,
                rate_deg_s: get(t, "rate_deg_s")?,
                epoch: get(t, "epoch")?,
            },
            _ => Self::Table { file: get(t, "file")?, rows: Vec::new() },
        })
    }

    fn write(&self, t: &mut Plain) {
        let mut mode = |name: &str| put(t, ATTITUDE, "mode", &name.to_string());
        match self {
            Self::Inertial { quaternion } => {
                mode("inertial");
                puts!(t, ATTITUDE; quaternion);
            }
            Self::Spin { quaternion, axis, period_s, phase_deg, epoch } => {
                mode("spin");
                puts!(t, ATTITUDE; quaternion axis period_s phase_deg epoch);
            }
            Self::Nadir => mode("nadir"),
            Self::Sun => mode("sun"),
            Self::Aligned { point_body, point_to, turn_body, turn_to } => {
                mode("aligned");
                puts!(t, ATTITUDE; point_body point_to turn_body turn_to);
            }
            Self::Tumble { quaternion, inertia_kg_m2, rate_deg_s, epoch } => {
                mode("tumble");
                puts!(t, ATTITUDE; quaternion epoch inertia_kg_m2 rate_deg_s);
            }
            Self::Table { file, .. } => {
                mode("table");
                puts!(t, ATTITUDE; file);
            }
        }
    }
}

impl Section for Target {
    fn read(table: &Plain) -> Result<Self, String> {
        let attitude = table.get("attitude").and_then(Value::as_table);
        Ok(Self {
            name: get(table, "name")?,
            orbit: Orbit::read(inner(table, "orbit")?).map_err(|key| format!("orbit.{key}"))?,
            brightness: Brightness::read(table)?,
            attitude: attitude.map(Attitude::read).transpose().map_err(|key| format!("attitude.{key}"))?,
        })
    }

    fn write(&self, table: &mut Plain) {
        let (mut orbit, mut attitude) = (Plain::new(), Plain::new());
        self.orbit.write(&mut orbit);
        put(table, "target[]", "name", &self.name);
        table.insert("orbit".into(), orbit.into());
        self.brightness.write(table);
        if let Some(own) = &self.attitude {
            own.write(&mut attitude);
            table.insert("attitude".into(), attitude.into());
        }
    }
}

impl Target {
    /// The keys of its attitude as they stand in a scene; none if nothing is said.
    pub fn attitude_keys(&self) -> Option<Json> {
        let mut table = Plain::new();
        self.attitude.as_ref()?.write(&mut table);
        Some(plain_json(&table.into()))
    }

    /// What its faces are made of: keys as those of `[target.material]`, by group; by group/material where a group has several.
    /// None if it has no shape.
    pub fn material_keys(&self) -> Option<Json> {
        let Brightness::Shape(shaped) = &self.brightness else { return None };
        let painted = shaped.built.painted().collect::<Vec<_>>();
        let entry = |(group, name, material): &(&str, &str, &Material)| {
            let several = painted.iter().filter(|(other, ..)| other == group).count() > 1;
            let key = if several { format!("{group}/{name}") } else { (*group).to_owned() };
            let keys = json!({
                "brdf": material.model.name(), "diffuse": material.diffuse, "specular": material.specular,
                "exponent": material.exponent, "roughness": material.roughness,
            });
            (key, keys)
        };
        Some(painted.iter().map(entry).collect())
    }
}

fn plain_json(value: &Value) -> Json {
    match value {
        Value::Table(table) => table.iter().map(|(key, value)| (key.clone(), plain_json(value))).collect(),
        Value::Array(items) => items.iter().map(plain_json).collect(),
        Value::Float(x) => serde_json::Number::from_f64(*x).map_or(Json::Null, Json::Number),
        Value::Integer(n) => (*n).into(),
        Value::Boolean(flag) => (*flag).into(),
        Value::String(text) => text.as_str().into(),
        Value::Datetime(time) => time.to_string().into(),
    }
}

/// The file that a key such as `target.0.orbit.omm` names.
pub(super) fn path_of<'a>(targets: &'a mut [Target], key: &str) -> Option<&'a mut PathBuf> {
    let (index, key) = key.strip_prefix("target.")?.split_once('.')?;
    let target = targets.get_mut(index.parse::<usize>().ok()?)?;
    match (key, &mut target.orbit, &mut target.attitude) {
        ("orbit.omm", Orbit::Omm { file, .. }, _) | ("orbit.oem", Orbit::Oem { file, .. }, _) => Some(file),
        ("attitude.file", _, Some(Attitude::Table { file, .. })) => Some(file),
        _ => None,
    }
}

/// Builds the shapes of targets; what is wrong with them, by key.
pub(super) fn build_shapes(targets: &mut [Target]) -> Vec<shaped::Wrong> {
    let mut wrong = Vec::new();
    for (index, target) in targets.iter_mut().enumerate() {
        if let Brightness::Shape(own) = &mut target.brightness {
            match shaped::build(own) {
                Ok(shape) => own.built = Arc::new(shape),
                Err((key, why)) => wrong.push((format!("target.{index}.{key}"), why)),
            }
        }
    }
    wrong
}

/// Reads the files that targets name; they were read once before, when the scene was checked.
pub(super) fn load_files(targets: &mut [Target]) -> Result<(), String> {
    let read = |path: &Path| text_of(path).map_err(|_| path.display().to_string());
    for target in targets {
        match &mut target.orbit {
            Orbit::Omm { file, elements } => **elements = message_for(&read(file)?, &target.name)?,
            Orbit::Oem { file, ephemeris } => {
                **ephemeris = Ephemeris::parse(&read(file)?, &target.name).map_err(|e| e.to_string())?;
            }
            _ => {}
        }
        target.attitude.as_mut().map_or(Ok(()), load_attitude)?;
    }
    Ok(())
}

/// Reads the rows of a table of attitudes; the error is its file, or what is wrong with it.
pub(super) fn load_attitude(attitude: &mut Attitude) -> Result<(), String> {
    if let Attitude::Table { file, rows } = attitude
        && let Profile::Table(own) =
            Profile::table(&text_of(file).map_err(|_| file.display().to_string())?).map_err(|e| e.to_string())?
    {
        *rows = own;
    }
    Ok(())
}
