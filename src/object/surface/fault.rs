//! What can be wrong with a mesh, in words.

use glam::DVec3;

/// How much a fault matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing to be done if it is meant so.
    Note,
    /// The mesh can be used, but what comes out may be wrong.
    Warning,
    /// The mesh cannot be used.
    Fatal,
}

/// One thing wrong with a mesh. Faces, vertices and components are numbered from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// A face with a number that no vertex, group or material has.
    #[error("face {face} has {what} {number}, but there are {count}, numbered from 0: correct the number")]
    OutOfRange {
        /// The face.
        face: usize,
        /// Vertex, group or material.
        what: &'static str,
        /// The number.
        number: u32,
        /// How many there are.
        count: usize,
    },
    /// A vertex that is nowhere.
    #[error("vertex {vertex} is at {at}: its coordinates must be finite")]
    NonFinite {
        /// The vertex.
        vertex: usize,
        /// Where it is said to be \[m\].
        at: DVec3,
    },
    /// A face without area, or so thin that its normal is chance.
    #[error(
        "face {face} has no area to speak of: {area_m2:e} m² along an edge of {edge_m} m; drop it or repair the mesh"
    )]
    ZeroArea {
        /// The face.
        face: usize,
        /// Its area \[m²\].
        area_m2: f64,
        /// Its longest edge \[m\].
        edge_m: f64,
    },
    /// A vertex exactly at the place of another. Files with normals often have such; they count as one.
    #[error("vertex {vertex} is at exactly the same place as vertex {first}; they count as one")]
    SamePlace {
        /// The vertex.
        vertex: usize,
        /// The first at this place.
        first: usize,
    },
    /// A vertex so near another that they are meant to be the same.
    #[error("vertex {vertex} is only {distance_m:e} m from vertex {first}: a crack; weld them or repair the mesh")]
    NearlySamePlace {
        /// The vertex.
        vertex: usize,
        /// The one it is near to.
        first: usize,
        /// How far apart they are \[m\].
        distance_m: f64,
    },
    /// A face with the same three vertices as another.
    #[error("face {face} has the same three vertices as face {first}, wound {}; drop one of them or repair the mesh",
        if *.alike { "alike" } else { "the other way" })]
    SameFace {
        /// The face.
        face: usize,
        /// The first with these vertices.
        first: usize,
        /// Whether both are wound alike.
        alike: bool,
    },
    /// An edge of more than two faces.
    #[error("{} faces meet at the edge between vertices {} and {}: {faces:?}; {}", .faces.len(), .edge[0], .edge[1],
        if *.balanced { "they are taken as bodies that touch" }
        else { "no side of it is inside: part the bodies or drop the faces within" })]
    NonManifold {
        /// Its vertices.
        edge: [u32; 2],
        /// The faces.
        faces: Vec<usize>,
        /// Whether as many faces use it in each direction.
        balanced: bool,
    },
    /// An edge of one face.
    #[error("face {face} has an open edge between vertices {} and {}: a sheet, lit from both sides", .edge[0], .edge[1])]
    OpenEdge {
        /// The face.
        face: usize,
        /// The vertices of the edge.
        edge: [u32; 2],
    },
    /// Two neighbours of which one is turned over.
    #[error("faces {} and {} run the same way along the edge between vertices {} and {}: flip one of them or repair the mesh",
        .faces[0], .faces[1], .edge[0], .edge[1])]
    Winding {
        /// The faces.
        faces: [usize; 2],
        /// The vertices of the edge.
        edge: [u32; 2],
    },
    /// A closed component whose faces look inwards.
    #[error(
        "the closed body {component} from face {face} on is inside out: its volume is {volume_m3:e} m³; flip its faces or repair the mesh (unless it is a cavity)"
    )]
    InsideOut {
        /// The component.
        component: usize,
        /// Its first face.
        face: usize,
        /// Its volume, below 0 \[m³\].
        volume_m3: f64,
    },
    /// A mesh of odd size.
    #[error(
        "the mesh is {diagonal_m} m across: is its unit of length another than the metre? If so, set shape_scale = {suggested}"
    )]
    Scale {
        /// Diagonal of its bounding box \[m\].
        diagonal_m: f64,
        /// A factor that may be right.
        suggested: f64,
    },
    /// A vertex of no face.
    #[error("vertex {vertex} belongs to no face; drop it, or ignore this")]
    Unused {
        /// The vertex.
        vertex: usize,
    },
}

impl Fault {
    /// How much it matters.
    pub fn severity(&self) -> Severity {
        match self {
            Self::OutOfRange { .. } | Self::NonFinite { .. } => Severity::Fatal,
            Self::OpenEdge { .. } | Self::SamePlace { .. } | Self::Unused { .. } => Severity::Note,
            Self::NonManifold { balanced: true, .. } => Severity::Note,
            _ => Severity::Warning,
        }
    }
}
