//! A shape as light sees it: its body, the material of every face, and parts that turn.

use super::matter::{Material, Model, materials, weight};
use super::shadow::body::Body;
use super::surface::fault::Severity;
use super::surface::mesh::Mesh;
use super::surface::mtl::Mtl;
use super::surface::{check, topology};
use crate::astro::attitude::{Surroundings, Towards};
use glam::{DMat3, DQuat, DVec3};

/// What cannot be made into a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A mesh that is no surface.
    #[error("{0}")]
    Mesh(String),
    /// A mesh without faces.
    #[error("it has no face: is it an OBJ or STL file?")]
    Empty,
    /// A mesh larger or smaller than anything.
    #[error("its extent of {extent_m:e} m is outside 1e-9 .. 1e9 m; see shape_scale")]
    Extent {
        /// The diagonal of the box about it \[m\].
        extent_m: f64,
    },
    /// A group that the mesh does not have.
    #[error("the shape has no group or material of this name")]
    Group {
        /// Table that names it: material.group or part.
        table: &'static str,
        /// The name.
        name: String,
        /// Names that there are.
        known: Vec<String>,
    },
    /// A direction of no length, or one that an axis cannot turn.
    #[error("{why}")]
    Direction {
        /// The part.
        group: String,
        /// The key.
        key: &'static str,
        /// What is wrong.
        why: &'static str,
    },
    /// A material of the shape's file that reflects too much, or nothing that is light.
    #[error("material {name} of its file: {why}")]
    Material {
        /// Its name.
        name: String,
        /// Why.
        why: String,
    },
}

impl ShapeError {
    /// The key of a target that is at fault, such as `part.panel.axis`.
    pub fn key(&self) -> String {
        match self {
            Self::Group { table, name, .. } => format!("{table}.{name}"),
            Self::Direction { group, key, .. } => format!("part.{group}.{key}"),
            _ => "shape".into(),
        }
    }
}

/// Which materials and hinges a mesh gets.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Material of faces for which nothing else is told.
    pub default: Option<Material>,
    /// Materials by the name of a group or of a material of the file; these win.
    pub groups: Vec<(String, Material)>,
    /// Materials of the file.
    pub mtl: Vec<Mtl>,
    /// Parts that turn.
    pub hinges: Vec<Hinge>,
}

/// A part that turns so that one of its directions follows something.
#[derive(Debug, Clone, PartialEq)]
pub struct Hinge {
    /// Group of its faces.
    pub group: String,
    /// A point that stays \[m\], body axes.
    pub point: DVec3,
    /// Axis it turns about, body axes; none: any.
    pub axis: Option<DVec3>,
    /// Direction of the part at rest, body axes.
    pub face: DVec3,
    /// What it follows.
    pub to: Towards,
}

impl Hinge {
    /// How far the part is turned, with what it may follow in body axes: as near to it as the axis allows.
    fn turn(&self, around: &Surroundings) -> DMat3 {
        let face = self.face.normalize_or_zero();
        let to = self.to.of(around);
        if !to.is_finite() {
            return DMat3::IDENTITY;
        }
        match self.axis {
            None => DMat3::from_quat(DQuat::from_rotation_arc(face, to.normalize())),
            Some(axis) => {
                let axis = axis.normalize_or_zero();
                let across = |v: DVec3| v - axis * v.dot(axis);
                let (from, to) = (across(face), across(to));
                // the angle from one to the other; 0 where there is no direction across the axis
                let angle = f64::atan2(axis.dot(from.cross(to)), from.dot(to));
                DMat3::from_axis_angle(axis, angle)
            }
        }
    }
}

/// A shape.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    /// The body at rest.
    pub body: Body,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// Group of each face.
    pub group_of: Vec<u16>,
    /// The materials in use.
    pub materials: Vec<Material>,
    /// Material of each face.
    pub material_of: Vec<u16>,
    /// Parts that turn, with their vertices.
    moving: Vec<(Hinge, Vec<u32>)>,
    /// What is doubtful about its mesh, in words.
    pub doubts: Vec<String>,
    /// Group, material of the file, and number of the material of each that has faces.
    painted: Vec<(String, String, u16)>,
    /// No face can hide another.
    convex: bool,
}

/// Faults of a mesh that are told one by one.
const TOLD: usize = 3;
/// Extents of shapes \[m\].
const EXTENTS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Sun and observer at a body, in its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// What its parts may follow, the Sun and the observer among them.
    pub around: Surroundings,
    /// Angular radius of the Sun \[rad\].
    pub sun_radius: f64,
}

impl Shape {
    /// The shape of a mesh in metres.
    ///
    /// # Errors
    /// [`ShapeError`] for meshes that are no surfaces, names that there are not, and materials that are none.
    pub fn new(mesh: &Mesh, choice: &Choice) -> Result<Self, ShapeError> {
        let faults = check::faults(mesh);
        if let Some(fault) = faults.iter().find(|fault| fault.severity() == Severity::Fatal) {
            return Err(ShapeError::Mesh(fault.to_string()));
        }
        if mesh.faces.is_empty() {
            return Err(ShapeError::Empty);
        }
        let extent_m = mesh.bounds().map_or(0.0, |(low, high)| (high - low).length());
        if !EXTENTS.contains(&extent_m) {
            return Err(ShapeError::Extent { extent_m });
        }
        let known = |name: &str| mesh.groups.iter().chain(&mesh.materials).any(|own| own == name);
        let names = || mesh.groups.iter().chain(&mesh.materials).filter(|n| !n.is_empty()).cloned().collect();
        let keys = choice.groups.iter().map(|(name, _)| ("material.group", name));
        for (table, name) in keys.chain(choice.hinges.iter().map(|hinge| ("part", &hinge.group))) {
            if !known(name) {
                return Err(ShapeError::Group { table, name: name.clone(), known: names() });
            }
        }
        let doubtful = faults.iter().filter(|fault| fault.severity() == Severity::Warning);
        let mut doubts = doubtful.clone().take(TOLD).map(ToString::to_string).collect::<Vec<_>>();
        if let more @ 1.. = doubtful.count().saturating_sub(TOLD) {
            doubts.push(format!("and {more} more faults of its mesh; `nightglass shape` tells them"));
        }
        let mut shape = Self { groups: mesh.groups.clone(), doubts, ..Self::default() };
        let (vertices, faces) = shape.part(mesh, &choice.hinges)?;
        let open = topology::open(mesh);
        let sheet =
            topology::components(mesh).iter().map(|k| open.get(*k as usize).copied().unwrap_or(true)).collect();
        shape.paint(mesh, choice)?;
        shape.group_of = mesh.faces.iter().map(|face| face.group).collect();
        shape.body = Body::new(vertices, faces, sheet);
        shape.convex = shape.moving.is_empty() && shape.body.is_convex();
        Ok(shape)
    }

    /// Vertices and faces with vertices of their own for each part that turns.
    fn part(&mut self, mesh: &Mesh, hinges: &[Hinge]) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), ShapeError> {
        let mut vertices = mesh.vertices.clone();
        let mut faces = mesh.faces.iter().map(|face| face.corners).collect::<Vec<_>>();
        for hinge in hinges {
            let fault = |key, why| Err(ShapeError::Direction { group: hinge.group.clone(), key, why });
            let face = hinge.face.normalize_or_zero();
            if face == DVec3::ZERO {
                return fault("face", "one of its numbers must differ from 0");
            }
            if let Some(axis) = hinge.axis.map(DVec3::normalize_or_zero) {
                if axis == DVec3::ZERO {
                    return fault("axis", "one of its numbers must differ from 0");
                }
                if axis.cross(face).length() < 1e-9 {
                    return fault("face", "must not be parallel to axis: no turn would move it");
                }
            }
            let mut own = Vec::new();
            let mut copies = std::collections::BTreeMap::new();
            for (face, corners) in mesh.faces.iter().zip(&mut faces) {
                if mesh.groups.get(usize::from(face.group)).is_none_or(|name| *name != hinge.group) {
                    continue;
                }
                for corner in corners {
                    *corner = *copies.entry(*corner).or_insert_with_key(|old| {
                        let new = vertices.len() as u32;
                        vertices.push(vertices[*old as usize]);
                        own.push(new);
                        new
                    });
                }
            }
            self.moving.push((hinge.clone(), own));
        }
        Ok((vertices, faces))
    }

    /// Choose each face's material.
    fn paint(&mut self, mesh: &Mesh, choice: &Choice) -> Result<(), ShapeError> {
        let mut numbers = std::collections::BTreeMap::new();
        for face in &mesh.faces {
            let key = (face.group, face.material);
            let number = match numbers.get(&key) {
                Some(number) => *number,
                None => {
                    let group = mesh.groups.get(usize::from(face.group)).map_or("", String::as_str);
                    let name = mesh.materials.get(usize::from(face.material)).map_or("", String::as_str);
                    let (material, known) = choice.material(group, name)?;
                    if !known && !name.is_empty() {
                        self.doubts.push(format!(
                            "nothing tells what its material {name} is: it is taken as the default"
                        ));
                    }
                    let number = self.materials.iter().position(|own| *own == material).unwrap_or_else(|| {
                        self.materials.push(material);
                        self.materials.len() - 1
                    });
                    self.painted.push((group.to_owned(), name.to_owned(), number as u16));
                    numbers.insert(key, number as u16);
                    number as u16
                }
            };
            self.material_of.push(number);
        }
        Ok(())
    }

    /// What its faces are made of: group, material of the file, and the material itself.
    pub fn painted(&self) -> impl Iterator<Item = (&str, &str, &Material)> + '_ {
        self.painted.iter().filter_map(|(group, name, number)| {
            Some((group.as_str(), name.as_str(), self.materials.get(usize::from(*number))?))
        })
    }

    /// Whether no face can hide another.
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// Whether a part of it turns.
    pub fn moves(&self) -> bool {
        !self.moving.is_empty()
    }

    /// Number of rigid parts: the body and what turns against it.
    pub fn rigid_parts(&self) -> usize {
        1 + self.moving.len()
    }

    /// Faces of rigid part number `part`; 0 is the body.
    pub fn faces_of(&self, part: usize) -> impl Iterator<Item = usize> + '_ {
        let of = |face: &[u32; 3]| {
            let own = |(_, vertices): &(Hinge, Vec<u32>)| vertices.binary_search(&face[0]).is_ok();
            self.moving.iter().position(own).map_or(0, |k| k + 1)
        };
        self.body.faces.iter().enumerate().filter(move |(_, face)| of(face) == part).map(|(k, _)| k)
    }

    /// A direction in body axes as rigid part number `part` sees it that would rest.
    pub fn in_part(&self, part: usize, around: &Surroundings, direction: DVec3) -> DVec3 {
        match part.checked_sub(1).and_then(|k| self.moving.get(k)) {
            Some((hinge, _)) => hinge.turn(around).transpose() * direction,
            None => direction,
        }
    }

    /// The body with its parts turned as they are in this light; `body` is a copy of the body at rest, used again and again.
    pub fn pose(&self, around: &Surroundings, body: &mut Body) {
        if self.moving.is_empty() {
            return;
        }
        let mut vertices = self.body.vertices.clone();
        for (hinge, own) in &self.moving {
            let turn = hinge.turn(around);
            for vertex in own {
                let vertex = &mut vertices[*vertex as usize];
                *vertex = hinge.point + turn * (*vertex - hinge.point);
            }
        }
        body.move_to(&vertices);
    }

    /// Light of each face of the posed `body` per unit area \[1/sr\], before shadows: f (n.s)+ (n.o)+, averaged over the Sun's disc.
    pub fn weights(&self, body: &Body, sun: DVec3, observer: DVec3, sun_radius: f64, out: &mut Vec<f64>) {
        out.clear();
        let faces = body.normals.iter().zip(&body.sheet).zip(&self.material_of);
        out.extend(faces.map(|((normal, sheet), material)| {
            let normal = if *sheet && normal.dot(sun) < 0.0 { -*normal } else { *normal };
            if normal.dot(observer) <= 0.0 {
                return 0.0;
            }
            match self.materials.get(usize::from(*material)) {
                Some(material) => weight(material, normal, sun, observer, sun_radius),
                None => 0.0,
            }
        }));
    }
}

impl Choice {
    /// The material of a group and a material's name, and whether anything tells of them.
    fn material(&self, group: &str, name: &str) -> Result<(Material, bool), ShapeError> {
        let told = |name: &str| self.groups.iter().find(|(own, _)| own == name).map(|(_, material)| material);
        if let Some(material) = told(group).or_else(|| told(name)) {
            return Ok((material.clone(), true));
        }
        if let Some(mtl) = self.mtl.iter().find(|own| own.name == name) {
            let material = of_mtl(mtl).map_err(|why| ShapeError::Material { name: name.to_owned(), why })?;
            return Ok((material, true));
        }
        if let Some(preset) = materials::preset(name) {
            return Ok((preset, true));
        }
        Ok((self.default.clone().unwrap_or_else(|| Material::lambert(0.6)), false))
    }
}

/// What an MTL material means: a preset or model by its `brdf`, else the modified Phong model where it shines (illum 2 and
/// above) and Lambert's law where it does not; colours as the means of red, green and blue.
fn of_mtl(mtl: &Mtl) -> Result<Material, String> {
    let mean = |colour: Option<[f64; 3]>, none: f64| colour.map_or(none, |c| c.iter().sum::<f64>() / 3.0);
    let diffuse = mean(mtl.kd, 0.6);
    let shiny = mtl.illum.is_none_or(|model| model >= 2);
    let specular = if shiny { mean(mtl.ks, 0.0) } else { 0.0 };
    let plain = Material::lambert(diffuse);
    let material = match &mtl.brdf {
        Some(name) => match (materials::preset(name), Model::from_name(name)) {
            (Some(preset), _) => preset,
            (None, Some(model)) => Material {
                model,
                specular,
                exponent: mtl.ns.unwrap_or(plain.exponent),
                roughness: mtl.roughness.unwrap_or(plain.roughness),
                ..plain
            },
            (None, None) => return Err(format!("no BRDF has the name \"{name}\"")),
        },
        None if specular > 0.0 => {
            Material { model: Model::Phong, specular, exponent: mtl.ns.unwrap_or(plain.exponent), ..plain }
        }
        None => plain,
    };
    material.check().map(|()| material).map_err(|why| why.to_string())
}
