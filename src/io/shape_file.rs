//! A shape as Wavefront OBJ and MTL, one material per class of uncertainty and one group per part.
//!
//! The classes are of the standard deviation of a facet's normal. Colours are told apart by people with any colour vision
//! (Okabe & Ito 2008); they mark uncertainty, not reflectance.

use glam::DVec3;
use std::fmt::Write;

/// Name of the MTL file that the OBJ file names; they lie beside each other.
pub const MTL_NAME: &str = "shape.mtl";
/// Greatest number of a part with a group of its own: readers number groups with 16 bits.
const MOST_PARTS: usize = 65_000;

/// How sure a facet is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// Claimed, with errors.
    Known {
        /// Standard deviation of the direction of its normal \[deg\], 0 or more; others count as unclaimed.
        sd_deg: f64,
        /// Standard deviation of its area over the area; NaN if unknown.
        relative_area_sd: f64,
    },
    /// Part of a shape that explains the data, but not proven by them.
    Unclaimed,
    /// Turned where the data do not reach: it closes the shape only.
    Unobserved,
}

/// A facet.
#[derive(Debug, Clone, PartialEq)]
pub struct Face {
    /// Numbers of its vertices, counter-clockwise from outside; a planar polygon.
    pub corners: Vec<usize>,
    /// Number of the part it belongs to, from 0.
    pub part: usize,
    /// How sure it is.
    pub uncertainty: Uncertainty,
}

/// A shape of one or more parts, which may reach into each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Body {
    /// Positions in body axes \[m\], or of unknown scale.
    pub vertices: Vec<DVec3>,
    /// The facets. One with fewer than 3 corners, or with a corner that is not finite or out of range, is left out of files and
    /// pictures, which say so.
    pub faces: Vec<Face>,
    /// Whether the scale is unknown: lengths are then not in metres.
    pub relative: bool,
}

/// Classes of uncertainty, the surest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Standard deviation of the normal below 0.5 deg.
    Below05,
    /// Below 1 deg.
    Below1,
    /// Below 2 deg.
    Below2,
    /// Below 5 deg.
    Below5,
    /// 5 deg or more.
    From5,
    /// Not claimed.
    Unclaimed,
    /// Not observed.
    Unobserved,
}

impl Class {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Below05, Self::Below1, Self::Below2, Self::Below5, Self::From5, Self::Unclaimed, Self::Unobserved];

    /// The class of a facet.
    pub fn of(uncertainty: Uncertainty) -> Self {
        match uncertainty {
            Uncertainty::Unobserved => Self::Unobserved,
            Uncertainty::Known { sd_deg, .. } if sd_deg.is_finite() && sd_deg >= 0.0 => match sd_deg {
                ..0.5 => Self::Below05,
                ..1.0 => Self::Below1,
                ..2.0 => Self::Below2,
                ..5.0 => Self::Below5,
                _ => Self::From5,
            },
            _ => Self::Unclaimed,
        }
    }

    /// Name of its material.
    pub fn name(self) -> &'static str {
        match self {
            Self::Below05 => "sd_below_0.5_deg",
            Self::Below1 => "sd_below_1_deg",
            Self::Below2 => "sd_below_2_deg",
            Self::Below5 => "sd_below_5_deg",
            Self::From5 => "sd_from_5_deg",
            Self::Unclaimed => "unclaimed",
            Self::Unobserved => "unobserved",
        }
    }

    /// What it means.
    pub fn words(self) -> &'static str {
        match self {
            Self::Below05 => "normal known to better than 0.5 deg",
            Self::Below1 => "normal known to 0.5 to 1 deg",
            Self::Below2 => "normal known to 1 to 2 deg",
            Self::Below5 => "normal known to 2 to 5 deg",
            Self::From5 => "normal known to 5 deg or worse",
            Self::Unclaimed => "not claimed",
            Self::Unobserved => "not observed",
        }
    }

    /// Its colour: red, green and blue.
    pub fn colour(self) -> [u8; 3] {
        match self {
            Self::Below05 => [0, 114, 178],
            Self::Below1 => [86, 180, 233],
            Self::Below2 => [0, 158, 115],
            Self::Below5 => [240, 200, 40],
            Self::From5 => [213, 94, 0],
            Self::Unclaimed => [225, 225, 225],
            Self::Unobserved => [204, 121, 167],
        }
    }
}

/// What a class holds of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Share {
    /// The class.
    pub class: Class,
    /// Its facets.
    pub faces: usize,
    /// Its share of the surface, 0 to 1.
    pub surface: f64,
    /// Median standard deviation of its normals \[deg\]; NaN if none is known.
    pub sd_deg: f64,
    /// Median relative standard deviation of its areas; NaN if none is known.
    pub relative_area_sd: f64,
}

impl Share {
    /// In words, without the class's own.
    pub fn words(&self) -> String {
        let mut words = format!(
            "{} facet{}, {:.1} % of the surface",
            self.faces,
            if self.faces == 1 { "" } else { "s" },
            100.0 * self.surface
        );
        if self.sd_deg.is_finite() {
            let _ = write!(words, "; median sd {:.2} deg", self.sd_deg);
        }
        if self.relative_area_sd.is_finite() {
            let _ = write!(words, ", of areas {:.2} %", 100.0 * self.relative_area_sd);
        }
        words
    }
}

impl Body {
    /// Positions of a facet's corners; none for one that is left out.
    pub fn corners(&self, face: &Face) -> Option<Vec<DVec3>> {
        let at = |corner: &usize| self.vertices.get(*corner).copied().filter(|v| v.is_finite());
        let corners = face.corners.iter().map(at).collect::<Option<Vec<_>>>()?;
        (corners.len() > 2).then_some(corners)
    }

    /// Middle of the facets, and half of their greatest extent along an axis; none without an extent.
    pub fn frame(&self) -> Option<(DVec3, f64)> {
        let corners = self.faces.iter().filter_map(|face| self.corners(face)).flatten();
        let ends = (DVec3::splat(f64::INFINITY), DVec3::splat(f64::NEG_INFINITY));
        let (low, high) = corners.fold(ends, |(low, high), v| (low.min(v), high.max(v)));
        // halves first: the difference of the greatest numbers is not finite
        let half = (0.5 * high - 0.5 * low).max_element();
        (half > 0.0 && half.is_finite()).then(|| (0.5 * low + 0.5 * high, half))
    }

    /// Every facet that is not left out, in units of half the extent around the middle.
    pub fn scaled(&self) -> Vec<(&Face, Vec<DVec3>)> {
        let Some((middle, half)) = self.frame() else { return Vec::new() };
        // halves again
        let scaled = |v: DVec3| (0.5 * v - 0.5 * middle) / (0.5 * half);
        let corners = |face| Some((face, self.corners(face)?.into_iter().map(scaled).collect()));
        self.faces.iter().filter_map(corners).collect()
    }

    /// Facets that are left out.
    pub fn left_out(&self) -> usize {
        self.faces.iter().filter(|face| self.corners(face).is_none()).count()
    }

    /// What each of [`Class::ALL`] holds.
    pub fn shares(&self) -> [Share; 7] {
        let faces = self.scaled();
        let total = faces.iter().map(|(_, corners)| vector_area(corners).length()).sum::<f64>();
        Class::ALL.map(|class| {
            let own = || faces.iter().filter(|(face, _)| Class::of(face.uncertainty) == class);
            let area = own().map(|(_, corners)| vector_area(corners).length()).fold(0.0, |sum, a| sum + a);
            let known = own().filter_map(|(face, _)| match face.uncertainty {
                Uncertainty::Known { sd_deg, relative_area_sd } => Some((sd_deg, relative_area_sd)),
                _ => None,
            });
            let (sd, area_sd): (Vec<_>, Vec<_>) = known.unzip();
            let surface = if total > 0.0 { area / total } else { 0.0 };
            Share { class, faces: own().count(), surface, sd_deg: median(sd), relative_area_sd: median(area_sd) }
        })
    }
}

/// Normal of a planar polygon times its area, by Newell's formula.
pub fn vector_area(corners: &[DVec3]) -> DVec3 {
    let first = corners.first().copied().unwrap_or_default();
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| (a - first).cross(b - first)).sum::<DVec3>()
}

/// The median of the finite ones; NaN for none.
fn median(mut values: Vec<f64>) -> f64 {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The texts of the OBJ file and of [`MTL_NAME`] beside it, with the shortest numbers that read back the same. Vertices and
/// facets keep their order; those that are not finite are left out, and a comment says so.
pub fn obj(body: &Body) -> (String, String) {
    (mesh(body), materials(body))
}

fn mesh(body: &Body) -> String {
    let mut text = String::from("# Shape from a light curve; materials tell how sure a facet's normal is.\n");
    text += match body.relative {
        true => "# Lengths are relative: the scale is unknown.\n",
        false => "# Lengths in metres.\n",
    };
    let unfit = body.vertices.iter().filter(|v| !v.is_finite()).count();
    let left_out = body.left_out();
    if unfit + left_out > 0 {
        // writing to a string cannot fail
        let _ = writeln!(text, "# Left out: vertices that are not finite: {unfit}; faulty facets: {left_out}.");
    }
    let _ = writeln!(text, "mtllib {MTL_NAME}");
    let mut numbers = Vec::with_capacity(body.vertices.len());
    let mut last = 0usize;
    for v in &body.vertices {
        if v.is_finite() {
            last += 1;
            let _ = writeln!(text, "v {:?} {:?} {:?}", v.x, v.y, v.z);
        }
        numbers.push(last);
    }
    let (mut part, mut class) = (None, None);
    for face in body.faces.iter().filter(|face| body.corners(face).is_some()) {
        let own = (face.part.min(MOST_PARTS), Class::of(face.uncertainty));
        if part != Some(own.0) {
            let _ = writeln!(text, "g part_{}", own.0);
            part = Some(own.0);
        }
        if class != Some(own.1) {
            let _ = writeln!(text, "usemtl {}", own.1.name());
            class = Some(own.1);
        }
        text.push('f');
        for number in face.corners.iter().filter_map(|corner| numbers.get(*corner)) {
            let _ = write!(text, " {number}");
        }
        text.push('\n');
    }
    text
}

fn materials(body: &Body) -> String {
    let mut text = String::from("# How sure the normals of facets are; colours are not reflectances.\n");
    for share in body.shares() {
        let [r, g, b] = share.class.colour().map(|v| (f64::from(v) / 255.0 * 1e3).round() / 1e3);
        let (meaning, held) = (share.class.words(), share.words());
        let name = share.class.name();
        // illumination model 1: diffuse light alone
        let _ = writeln!(text, "\n# {meaning}: {held}\nnewmtl {name}\nKd {r:?} {g:?} {b:?}\nillum 1");
    }
    text
}
