//! A target's shape between TOML and its type: keys, materials, parts that turn, and the files they name.

use std::path::Path;
use std::sync::Arc;

use toml::{Table as Plain, Value};

use super::field::{Field, Section, get, inner, put};
use super::instrument::Table;
use super::schema::nearest;
use super::types::{Brightness, MaterialKeys, PartKeys, Shaped, Target};
use crate::object::matter::{self, Material, Model, materials};
use crate::object::shape::{Choice, Hinge, Shape, ShapeError};
use crate::object::surface::files;
use glam::DVec3;

const TARGET: &str = "target[]";
const MATERIAL: &str = "target[].material";
const PART: &str = "target[].part.*";

impl Field for Option<[f64; 3]> {
    fn read(value: Option<&Value>) -> Option<Self> {
        match value {
            None => Some(None),
            some => <[f64; 3]>::read(some).map(Some),
        }
    }
    fn write(&self) -> Option<Value> {
        self.as_ref().and_then(Field::write)
    }
}

impl Section for MaterialKeys {
    fn read(t: &Plain) -> Result<Self, String> {
        Ok(Self {
            brdf: get(t, "brdf")?,
            diffuse: get(t, "diffuse")?,
            specular: get(t, "specular")?,
            exponent: get(t, "exponent")?,
            roughness: get(t, "roughness")?,
        })
    }

    fn write(&self, t: &mut Plain) {
        put(t, MATERIAL, "brdf", &self.brdf);
        for (name, value) in [
            ("diffuse", self.diffuse),
            ("specular", self.specular),
            ("exponent", self.exponent),
            ("roughness", self.roughness),
        ] {
            put(t, MATERIAL, name, &value);
        }
    }
}

impl Section for PartKeys {
    fn read(t: &Plain) -> Result<Self, String> {
        Ok(Self {
            hinge_m: get(t, "hinge_m")?,
            axis: get(t, "axis")?,
            face: get(t, "face")?,
            point_to: get(t, "point_to")?,
        })
    }

    fn write(&self, t: &mut Plain) {
        put(t, PART, "hinge_m", &self.hinge_m);
        put(t, PART, "axis", &self.axis);
        put(t, PART, "face", &self.face);
        put(t, PART, "point_to", &self.point_to);
    }
}

/// The tables of a table, by name.
fn named<T: Section>(table: Option<&Value>, path: &str) -> Result<Vec<(String, T)>, String> {
    let tables = table.and_then(Value::as_table).into_iter().flatten();
    tables
        .map(|(name, own)| {
            let own = own.as_table().ok_or_else(|| format!("{path}.{name}"))?;
            T::read(own).map(|read| (name.clone(), read)).map_err(|key| format!("{path}.{name}.{key}"))
        })
        .collect()
}

/// Tables by name as a table, if there are any.
fn tables<T: Section>(all: &[(String, T)]) -> Option<Value> {
    let table = |own: &T| {
        let mut table = Plain::new();
        own.write(&mut table);
        Value::Table(table)
    };
    (!all.is_empty()).then(|| Plain::from_iter(all.iter().map(|(name, own)| (name.clone(), table(own)))).into())
}

impl Brightness {
    pub(super) fn read(t: &Plain) -> Result<Self, String> {
        if !t.contains_key("shape") {
            return Ok(Self::MagV(get(inner(t, "brightness")?, "mag_v")?));
        }
        let material = t.get("material").and_then(Value::as_table);
        Ok(Self::Shape(Box::new(Shaped {
            shape: get(t, "shape")?,
            size_m: get(t, "shape_size_m")?,
            scale: get(t, "shape_scale")?,
            earthshine: get(t, "earthshine")?,
            material: material.map(MaterialKeys::read).transpose().map_err(|key| format!("material.{key}"))?,
            groups: named(material.and_then(|m| m.get("group")), "material.group")?,
            parts: named(t.get("part"), "part")?,
            built: Arc::default(),
        })))
    }

    pub(super) fn write(&self, t: &mut Plain) {
        match self {
            Self::MagV(mag_v) => {
                let own = Plain::from_iter([("mag_v".to_string(), Value::Float(*mag_v))]);
                t.insert("brightness".into(), own.into());
            }
            Self::Shape(shaped) => {
                put(t, TARGET, "shape", &shaped.shape);
                put(t, TARGET, "shape_size_m", &shaped.size_m);
                put(t, TARGET, "shape_scale", &shaped.scale);
                put(t, TARGET, "earthshine", &shaped.earthshine);
                let mut own = Plain::new();
                if let Some(material) = &shaped.material {
                    material.write(&mut own);
                }
                if let Some(groups) = tables(&shaped.groups) {
                    own.insert("group".into(), groups);
                }
                if !own.is_empty() {
                    t.insert("material".into(), own.into());
                }
                if let Some(parts) = tables(&shaped.parts) {
                    t.insert("part".into(), parts);
                }
            }
        }
    }
}

/// The word that may be the file of a key such as `target.0.shape`.
pub(super) fn table_of<'a>(targets: &'a mut [Target], key: &str) -> Option<&'a mut Table> {
    let (index, key) = key.strip_prefix("target.")?.split_once('.')?;
    let Brightness::Shape(shaped) = &mut targets.get_mut(index.parse::<usize>().ok()?)?.brightness else {
        return None;
    };
    match key {
        "shape" => Some(&mut shaped.shape),
        "material.brdf" => shaped.material.as_mut().map(|m| &mut m.brdf),
        _ => {
            let name = key.strip_prefix("material.group.")?.strip_suffix(".brdf")?;
            shaped.groups.iter_mut().find(|(own, _)| own == name).map(|(_, m)| &mut m.brdf)
        }
    }
}

impl MaterialKeys {
    /// The material that the keys tell of.
    ///
    /// # Errors
    /// Files that cannot be read, names and numbers that no material has, in words.
    pub fn material(&self) -> Result<Material, String> {
        let name = match &self.brdf {
            Table::File(path) => {
                let text = std::fs::read_to_string(path).map_err(|why| format!("{}: {why}", path.display()))?;
                let table = matter::Table::parse(&text).map_err(|why| format!("{}: {why}", path.display()))?;
                return Ok(Material { model: Model::Tabulated(Arc::new(table)), ..Material::lambert(0.0) });
            }
            Table::Named(name) => name,
        };
        let Some(model) = Model::from_name(name) else {
            return materials::preset(name).ok_or_else(|| format!("no BRDF has the name \"{name}\""));
        };
        let material = Material {
            model,
            diffuse: self.diffuse.unwrap_or(0.0),
            specular: self.specular.unwrap_or(0.0),
            exponent: self.exponent.unwrap_or(0.0),
            roughness: self.roughness.unwrap_or(1.0),
        };
        material.check().map_err(|why| why.to_string())?;
        Ok(material)
    }
}

/// A key of a target and what is wrong with it.
pub(super) type Wrong = (String, String);

/// The shape that the keys of a target tell of.
pub(super) fn build(shaped: &Shaped) -> Result<Shape, Wrong> {
    let of_shape = |why: String| ("shape".to_owned(), why);
    let read = match &shaped.shape {
        Table::File(path) => files::read(path).map_err(|why| of_shape(why.to_string()))?,
        Table::Named(name) => {
            let mesh = files::built_in_sized(name, shaped.size_m.map(DVec3::from_array));
            let mesh = mesh.ok_or_else(|| of_shape(format!("none is named \"{name}\"")))?;
            files::Read { mesh, ..files::Read::default() }
        }
    };
    let material = |key: String, own: &MaterialKeys| own.material().map_err(|why| (key, why));
    let default = shaped.material.as_ref().map(|own| material("material".into(), own)).transpose()?;
    let groups = shaped.groups.iter().map(|(name, own)| {
        let key = format!("material.group.{name}");
        Ok((name.clone(), material(key, own)?))
    });
    let groups = groups.collect::<Result<Vec<_>, Wrong>>()?;
    let hinges = shaped.parts.iter().map(|(name, part)| Hinge {
        group: name.clone(),
        point: DVec3::from_array(part.hinge_m) * shaped.scale,
        axis: part.axis.map(DVec3::from_array),
        face: DVec3::from_array(part.face),
        to: part.point_to,
    });
    let choice = Choice { default, groups, mtl: read.materials, hinges: hinges.collect() };
    let mut shape = Shape::new(&read.mesh.scaled(shaped.scale), &choice).map_err(|why| (why.key(), told(&why)))?;
    let missing = read.missing.iter().map(|name| format!("its file names {name}, which is not beside it"));
    shape.doubts.extend(missing);
    if let Some(own) = shaped.material.as_ref().filter(|own| own.brdf != Table::Named("lambert".into()))
        && let (Some(0.0), Table::Named(name)) = (own.specular, &own.brdf)
    {
        shape.doubts.push(format!("material.brdf = \"{name}\" with specular = 0 is diffuse alone"));
    }
    Ok(shape)
}

/// What is wrong with a shape, with the names that are meant perhaps.
fn told(why: &ShapeError) -> String {
    let ShapeError::Group { name, known, .. } = why else { return why.to_string() };
    let near = nearest(name, known.iter().map(String::as_str));
    let near = near.map_or_else(String::new, |near| format!("; nearest: {near}"));
    let known = if known.is_empty() { "it has none".to_owned() } else { format!("known: {}", known.join(", ")) };
    format!("{why}{near}; {known}")
}

/// Files that a shape's file names beside itself.
pub(super) fn beside(path: &Path) -> Result<Vec<std::path::PathBuf>, String> {
    files::read(path).map(|read| read.beside).map_err(|why| why.to_string())
}
