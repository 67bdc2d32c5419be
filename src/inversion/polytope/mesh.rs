//! A polytope's surface as polygons and triangles with outward orientation.

use glam::DVec3;

use super::Polytope;

/// Vertices closer than this fraction of the diagonal along an edge are one.
const MERGE: f64 = 1e-12;

/// A closed surface of convex polygons.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// Vertices of each polygon, counter-clockwise from outside.
    pub polygons: Vec<Vec<u32>>,
    /// The polytope's facet of each polygon.
    pub facets: Vec<u32>,
}

impl Mesh {
    /// The polygons cut into triangles.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let fan = |polygon: &Vec<u32>| {
            let first = polygon.first().copied().unwrap_or(0);
            polygon.windows(2).skip(1).map(move |pair| [first, pair[0], pair[1]]).collect::<Vec<_>>()
        };
        self.polygons.iter().flat_map(fan).collect()
    }
}

impl Polytope {
    /// The surface, with vertices at one place merged. Facets smaller than 1e-12 of the diagonal across vanish.
    pub fn mesh(&self) -> Mesh {
        let least = MERGE * self.diagonal();
        let mut leaders: Vec<u32> = (0..self.vertices.len() as u32).collect();
        for edge in self.edges().iter().filter(|edge| edge.length <= least) {
            let [a, b] = edge.vertices.map(|v| leader(&mut leaders, v));
            leaders[a.max(b) as usize] = a.min(b);
        }
        let mut mesh = Mesh::default();
        let mut places = vec![u32::MAX; leaders.len()];
        for facet in 0..self.half_spaces() {
            let mut polygon: Vec<u32> = self.corners_of(facet).iter().map(|&v| leader(&mut leaders, v)).collect();
            polygon.dedup();
            while polygon.len() > 1 && polygon.first() == polygon.last() {
                polygon.pop();
            }
            if polygon.len() < 3 {
                continue;
            }
            for v in &mut polygon {
                let place = &mut places[*v as usize];
                if *place == u32::MAX {
                    *place = mesh.vertices.len() as u32;
                    mesh.vertices.push(self.vertices[*v as usize]);
                }
                *v = *place;
            }
            mesh.polygons.push(polygon);
            mesh.facets.push(facet as u32);
        }
        mesh
    }
}

/// The vertex that stands for `v`, with halved paths.
fn leader(leaders: &mut [u32], mut v: u32) -> u32 {
    while leaders[v as usize] != v {
        leaders[v as usize] = leaders[leaders[v as usize] as usize];
        v = leaders[v as usize];
    }
    v
}
