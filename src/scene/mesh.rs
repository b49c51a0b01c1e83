//! Triangle meshes and what is wrong with them. In flow the vertices and triangles of a file, out flows a [`Mesh`]
//! that a renderer can rely on: finite vertices, indices in range, no triangle without an area, unit normals.
//!
//! What can be repaired is repaired and counted in [`MeshFaults`], the rest is refused with a [`Refusal`].

use std::fmt;

use glam::{DAffine3, DVec3, Vec3};

use super::{Bounds, topology};

/// The farthest a vertex, light or camera may lie from the origin. The renderer's 32-bit arithmetic squares areas:
/// (1e9)^4 = 1e36 is still finite.
pub const FARTHEST: f64 = 1e9;

/// Triangles in their own space; counter-clockwise seen from outside.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// File name and, where a file holds several, the part's name.
    pub name: String,
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one a vertex, or empty where the file has none.
    pub normals: Vec<[f32; 3]>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// What was wrong.
    pub faults: MeshFaults,
}

/// What was wrong with a mesh, as counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshFaults {
    /// Edges of one triangle only.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose triangles do not agree on where the outside is.
    pub inconsistent_edges: usize,
    /// Closed shells that are turned inside out and are no cavity of another.
    pub inverted_shells: usize,
    /// Triangles without an area, which were removed.
    pub degenerate_triangles: usize,
    /// Vertices of no triangle.
    pub unused_vertices: usize,
    /// Normals that were zero, missing or not finite, replaced by those of the faces around.
    pub replaced_normals: usize,
    /// Normals that point to the inside of a face around them.
    pub opposed_normals: usize,
}

/// Why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Nothing to see.
    NoTriangles {
        /// How many there were before those without an area were removed.
        degenerate: usize,
    },
    /// Vertices that are NaN, infinite or farther away than [`FARTHEST`].
    BadVertices {
        /// How many.
        count: usize,
        /// The first one, from 0.
        first: usize,
    },
    /// Triangles that name vertices that do not exist.
    BadIndices {
        /// How many.
        count: usize,
        /// The first one, from 0.
        first: usize,
        /// How many vertices there are.
        vertices: usize,
    },
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoTriangles { degenerate: 0 } => f.write_str("holds no triangles; export faces, not only points"),
            Self::NoTriangles { degenerate } => {
                write!(f, "holds no triangles but {degenerate} without an area; check the scale of the export")
            }
            Self::BadVertices { count, first } => {
                write!(
                    f,
                    "{count} vertices are not finite or lie beyond {FARTHEST:e}, the first is number {}",
                    first + 1
                )
            }
            Self::BadIndices { count, first, vertices } => write!(
                f,
                "{count} triangles name vertices that do not exist (there are {vertices}), the first is number {}",
                first + 1
            ),
        }
    }
}

impl MeshFaults {
    /// Whether the surface bounds a medium: every edge joins as many triangles of one direction as of the other.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0 && self.inconsistent_edges == 0
    }

    /// Whether there is nothing to tell.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// One line, what is not zero: `12 open edges, 1 degenerate triangle removed`.
impl fmt::Display for MeshFaults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [
            (self.open_edges, "open edge", "open edges"),
            (self.non_manifold_edges, "non-manifold edge", "non-manifold edges"),
            (self.inconsistent_edges, "edge of inconsistent orientation", "edges of inconsistent orientation"),
            (self.inverted_shells, "shell inside out", "shells inside out"),
            (self.degenerate_triangles, "degenerate triangle removed", "degenerate triangles removed"),
            (self.unused_vertices, "unused vertex", "unused vertices"),
            (self.replaced_normals, "normal replaced", "normals replaced"),
            (self.opposed_normals, "normal against its face", "normals against their faces"),
        ];
        let mut separator = "";
        for (count, one, many) in counts.into_iter().filter(|&(count, ..)| count > 0) {
            write!(f, "{separator}{count} {}", if count == 1 { one } else { many })?;
            separator = ", ";
        }
        if separator.is_empty() {
            return f.write_str("no faults");
        }
        if !self.is_closed() {
            f.write_str("; the surface is not closed, so it bounds no medium")?;
        }
        Ok(())
    }
}

impl Mesh {
    /// A mesh from what a file holds. `normals` is empty or has one normal a vertex, of any length.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<[f32; 3]>,
        normals: Vec<[f32; 3]>,
        mut triangles: Vec<[u32; 3]>,
    ) -> Result<Self, Refusal> {
        let mut faults = MeshFaults::default();
        let bad = |position: &[f32; 3]| !position.iter().all(|x| f64::from(x.abs()) <= FARTHEST);
        if let Some(first) = positions.iter().position(bad) {
            return Err(Refusal::BadVertices { count: positions.iter().filter(|p| bad(p)).count(), first });
        }
        let vertices = positions.len();
        let bad = |triangle: &[u32; 3]| triangle.iter().any(|&vertex| vertex as usize >= vertices);
        if let Some(first) = triangles.iter().position(bad) {
            return Err(Refusal::BadIndices { count: triangles.iter().filter(|t| bad(t)).count(), first, vertices });
        }
        topology::analyse(&positions, &triangles, &mut faults);
        let all = triangles.len();
        // As 32-bit numbers: what underflows there has no normal.
        triangles.retain(|&triangle| area_vector(&positions, triangle).as_vec3() != Vec3::ZERO);
        faults.degenerate_triangles = all - triangles.len();
        if triangles.is_empty() {
            return Err(Refusal::NoTriangles { degenerate: all });
        }
        let mut used = vec![false; vertices];
        triangles.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
        faults.unused_vertices = used.iter().filter(|used| !**used).count();
        let mut mesh = Self { name: name.into(), positions, normals, triangles, faults };
        if mesh.normals.len() != vertices {
            mesh.normals.clear();
        }
        mesh.mend_normals(&used);
        Ok(mesh)
    }

    /// The box around the mesh in its own space.
    pub fn bounds(&self) -> Bounds {
        Bounds::around_positions(&self.positions, &DAffine3::IDENTITY)
    }

    fn mend_normals(&mut self, used: &[bool]) {
        let unit = |&[x, y, z]: &[f32; 3]| DVec3::new(x.into(), y.into(), z.into()).try_normalize();
        if !self.normals.iter().zip(used).any(|(normal, used)| *used && unit(normal).is_some()) {
            self.normals.clear();
            return;
        }
        let mut mean = Vec::new();
        for vertex in 0..self.normals.len() {
            let normal = unit(&self.normals[vertex]).unwrap_or_else(|| {
                self.faults.replaced_normals += usize::from(used[vertex]);
                if mean.is_empty() {
                    mean = mean_normals(&self.positions, &self.triangles);
                }
                mean[vertex]
            });
            self.normals[vertex] = normal.as_vec3().to_array();
        }
        let mut opposed = vec![false; self.normals.len()];
        for &triangle in &self.triangles {
            let outward = area_vector(&self.positions, triangle);
            for vertex in triangle.map(|vertex| vertex as usize) {
                let [x, y, z] = self.normals[vertex];
                opposed[vertex] |= outward.dot(DVec3::new(x.into(), y.into(), z.into())) < 0.0;
            }
        }
        self.faults.opposed_normals = opposed.into_iter().filter(|opposed| *opposed).count();
    }
}

/// The normal with the length of twice the area.
fn area_vector(positions: &[[f32; 3]], triangle: [u32; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|vertex| {
        let [x, y, z] = positions[vertex as usize];
        DVec3::new(x.into(), y.into(), z.into())
    });
    (b - a).cross(c - a)
}

/// Of each vertex the mean normal of the faces around, weighted by their areas; of one that they cancel out at, the
/// normal of one of them.
fn mean_normals(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    let mut any = vec![DVec3::Y; positions.len()];
    for &triangle in triangles {
        let area = area_vector(positions, triangle);
        for vertex in triangle.map(|vertex| vertex as usize) {
            sums[vertex] += area;
            any[vertex] = area;
        }
    }
    sums.into_iter()
        .zip(any)
        .map(|(sum, any)| sum.try_normalize().unwrap_or_else(|| any.normalize_or(DVec3::Y)))
        .collect()
}
