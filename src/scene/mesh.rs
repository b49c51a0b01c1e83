//! Triangle meshes and what is wrong with them. In flow the vertices and triangles of a file, out flows a [`Mesh`]
//! that a renderer can rely on: finite vertices, indices in range, no triangle without an area, unit normals, finite
//! texture coordinates.
//!
//! What can be repaired is repaired and counted in [`MeshFaults`], the rest is refused with a [`Refusal`].

use std::fmt;

use glam::{DAffine3, DVec3, Vec3};
use serde::Serialize;

use super::Bounds;
use super::doctor::{Mending, close_hairlines, mend};
use super::smoothing::smooth;
use super::topology::{self, Topology};

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
    /// Texture coordinates u and v, finite, one a vertex, or empty where the file has none. As OBJ has them: u grows to
    /// the right, v upwards; (0, 0) is the bottom left corner of the image, (1, 1) the top right one, and the image
    /// repeats beyond. Row 0 of a [`super::Texture`] is the top one, so its rows are counted by 1 - v.
    pub uvs: Vec<[f32; 2]>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
    /// What was wrong.
    pub faults: MeshFaults,
    /// Where it was.
    pub sites: FaultSites,
    /// What was mended before that.
    pub mending: Mending,
    /// Whether it may hold bodies that overlap.
    pub overlaps: bool,
    /// The area of its holes over its own.
    pub holes: f64,
}

/// A mesh as a file holds it, nothing of it checked.
#[derive(Clone, Debug, Default)]
pub struct RawMesh {
    /// What messages call it.
    pub name: String,
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Empty, or one normal a vertex, of any length; one that has none, zero for instance, is replaced.
    pub normals: Vec<[f32; 3]>,
    /// Empty, or texture coordinates of each vertex with v upwards, as in [`Mesh::uvs`]; NaN where one has none.
    pub uvs: Vec<[f32; 2]>,
    /// Indices of vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// What is done to a mesh beyond what [`Mesh::new`] does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Preparation {
    /// It is mended.
    pub repair: bool,
    /// Normals that it lacks are made across edges of at most so many radians, whatever smoothing groups say.
    pub smooth_angle: Option<f64>,
}

/// What was wrong with a mesh, as counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeshFaults {
    /// Edges of one triangle only.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges whose triangles do not agree on where the outside is.
    pub inconsistent_edges: usize,
    /// Closed shells that were inside out and no cavity of another; they were turned.
    pub inverted_shells: usize,
    /// Triangles without an area, which were removed.
    pub degenerate_triangles: usize,
    /// Vertices of no triangle.
    pub unused_vertices: usize,
    /// Normals that were zero, missing or not finite, replaced by those of the faces around.
    pub replaced_normals: usize,
    /// Texture coordinates that were missing, not finite or beyond 1e9, replaced by (0, 0).
    pub replaced_uvs: usize,
    /// Normals that point to the inside of a face around them.
    pub opposed_normals: usize,
}

/// The first place of each fault, in the mesh's space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaultSites {
    /// The middle of an edge of one triangle only.
    pub open_edge: Option<DVec3>,
    /// The middle of an edge of more than two triangles.
    pub non_manifold_edge: Option<DVec3>,
    /// The middle of an edge whose triangles do not agree.
    pub inconsistent_edge: Option<DVec3>,
    /// A vertex of a shell that was inside out.
    pub inverted_shell: Option<DVec3>,
}

/// Why a mesh cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Refusal {
    /// Nothing to see.
    NoTriangles {
        /// How many there were before those without an area were removed.
        degenerate: usize,
    },
    /// Vertices that are NaN, infinite or farther away than 1e9.
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
            (self.inverted_shells, "shell inside out turned", "shells inside out turned"),
            (self.degenerate_triangles, "degenerate triangle removed", "degenerate triangles removed"),
            (self.unused_vertices, "unused vertex", "unused vertices"),
            (self.replaced_normals, "normal replaced", "normals replaced"),
            (self.replaced_uvs, "texture coordinate replaced by 0", "texture coordinates replaced by 0"),
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
        Ok(())
    }
}

impl Mesh {
    /// A mesh from what a file holds.
    pub fn new(raw: RawMesh) -> Result<Self, Refusal> {
        let RawMesh { name, mut positions, normals, uvs, mut triangles } = raw;
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
        let mut topology = topology::analyse(&positions, &triangles, &mut faults);
        if close_hairlines(&mut positions, &topology.rims) {
            faults = MeshFaults::default();
            topology = topology::analyse(&positions, &triangles, &mut faults);
        }
        let Topology { inverted: turned, overlaps, sites, holes, .. } = topology;
        let mut inverted = vec![false; if turned.is_empty() { 0 } else { vertices }];
        for number in turned {
            let triangle = &mut triangles[number as usize];
            triangle.swap(1, 2);
            triangle.iter().for_each(|&vertex| inverted[vertex as usize] = true);
        }
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
        let mut mesh = Self {
            name,
            positions,
            normals,
            uvs,
            triangles,
            faults,
            sites,
            mending: Mending::default(),
            overlaps,
            holes,
        };
        if mesh.normals.len() != vertices {
            mesh.normals.clear();
        }
        if mesh.uvs.len() != vertices {
            mesh.uvs.clear();
        }
        mesh.turn_normals(&inverted);
        mesh.mend_normals(&used);
        mesh.mend_uvs(&used);
        Ok(mesh)
    }

    /// The same of what is prepared first.
    pub fn prepared(mut raw: RawMesh, preparation: Preparation) -> Result<Self, Refusal> {
        let mending = if preparation.repair { mend(&mut raw) } else { Mending::default() };
        if let Some(angle) = preparation.smooth_angle {
            smooth(&mut raw, angle);
        }
        Ok(Self { mending, ..Self::new(raw)? })
    }

    /// The box around the mesh in its own space.
    pub fn bounds(&self) -> Bounds {
        Bounds::around_positions(&self.positions, &DAffine3::IDENTITY)
    }

    /// Normals of vertices in `which` follow the faces around, should they point the other way.
    fn turn_normals(&mut self, which: &[bool]) {
        if self.normals.is_empty() || which.is_empty() {
            return;
        }
        let mean = mean_normals(&self.positions, &self.triangles);
        for ((normal, mean), _) in self.normals.iter_mut().zip(mean).zip(which).filter(|(_, which)| **which) {
            if DVec3::from_array(normal.map(f64::from)).dot(mean) < 0.0 {
                *normal = normal.map(|x| -x);
            }
        }
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

    fn mend_uvs(&mut self, used: &[bool]) {
        // Beyond that, 32 bits leave nothing of where in the image it is.
        let good = |uv: &[f32; 2]| uv.iter().all(|x| f64::from(x.abs()) <= FARTHEST);
        if !self.uvs.iter().zip(used).any(|(uv, used)| *used && good(uv)) {
            self.uvs.clear();
        }
        for (uv, used) in self.uvs.iter_mut().zip(used).filter(|(uv, _)| !good(uv)) {
            self.faults.replaced_uvs += usize::from(*used);
            *uv = [0.0; 2];
        }
    }
}

/// The normal with the length of twice the area.
pub fn area_vector(positions: &[[f32; 3]], triangle: [u32; 3]) -> DVec3 {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], normals: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<Mesh, Refusal> {
        let [positions, normals] = [positions, normals].map(<[_]>::to_vec);
        Mesh::new(RawMesh { positions, normals, triangles: triangles.to_vec(), ..RawMesh::default() })
    }

    const TETRAHEDRON: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const OUTWARD: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn faults(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> MeshFaults {
        mesh(positions, &[], triangles).unwrap().faults
    }

    /// Scaled by `size` and moved by `shift` along x, with indices behind those of `positions`.
    fn add(positions: &mut Vec<[f32; 3]>, triangles: &mut Vec<[u32; 3]>, size: f32, shift: f32, inward: bool) {
        let first = positions.len() as u32;
        positions.extend(TETRAHEDRON.map(|[x, y, z]| [x * size + shift, y * size + shift, z * size + shift]));
        triangles
            .extend(OUTWARD.map(|[a, b, c]| if inward { [c, b, a] } else { [a, b, c] }.map(|vertex| vertex + first)));
    }

    #[test]
    fn a_closed_body_has_no_faults() {
        assert!(faults(&TETRAHEDRON, &OUTWARD).is_empty());
        assert_eq!(faults(&TETRAHEDRON, &OUTWARD).to_string(), "no faults");
        // Split vertices are welded, minus zero is zero.
        let split: Vec<_> = OUTWARD
            .iter()
            .flatten()
            .map(|&vertex| TETRAHEDRON[vertex as usize].map(|x| if x == 0.0 { -x } else { x }))
            .collect();
        assert!(faults(&split, &[[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]]).is_empty());
    }

    /// A ball as programs make them: its last meridian is nearly where its first one is, and so are the vertices at a pole.
    #[test]
    fn cracks_of_a_rounding_are_none() {
        let (around, down) = (16_u32, 8_u32);
        let ball = |gap: f32| {
            let mut positions = Vec::new();
            for row in 0..=down {
                for column in 0..=around {
                    let (theta, phi) = (
                        std::f32::consts::PI * row as f32 / down as f32,
                        std::f32::consts::TAU * column as f32 / around as f32,
                    );
                    let lifted = if column == around { gap } else { 0.0 };
                    positions.push([theta.sin() * phi.cos(), theta.cos() + lifted, -theta.sin() * phi.sin()]);
                }
            }
            let mut triangles = Vec::new();
            for row in 0..down {
                for a in row * (around + 1)..row * (around + 1) + around {
                    let (b, c, d) = (a + 1, a + around + 1, a + around + 2);
                    triangles.extend((row > 0).then_some([a, d, b]));
                    triangles.extend((row + 1 < down).then_some([a, c, d]));
                }
            }
            faults(&positions, &triangles)
        };
        let unused = MeshFaults { unused_vertices: 2, ..MeshFaults::default() };
        assert_eq!(ball(0.0), unused);
        // Far from the origin a rounding is wider than things are, and nothing of it is a crack.
        let far = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| [6.4e6 + x, y, 0.0]);
        let sheet = mesh(&far, &[], &[[0, 1, 3], [0, 3, 2]]).unwrap();
        assert_eq!((sheet.positions[1], sheet.faults.open_edges), ([6.4e6 + 1.0, 0.0, 0.0], 4));
        let torn = ball(1e-5);
        assert!(torn.open_edges >= 2 * down as usize - 2, "{torn}");
    }

    #[test]
    fn open_edges_are_counted() {
        let faults = faults(&TETRAHEDRON, &OUTWARD[..3]);
        assert_eq!(faults, MeshFaults { open_edges: 3, ..MeshFaults::default() });
        assert!(!faults.is_closed());
        assert_eq!(faults.to_string(), "3 open edges");
    }

    #[test]
    fn a_flipped_triangle_is_inconsistent_along_its_edges() {
        let mut triangles = OUTWARD;
        triangles[3].swap(0, 1);
        assert_eq!(faults(&TETRAHEDRON, &triangles), MeshFaults { inconsistent_edges: 3, ..MeshFaults::default() });
    }

    #[test]
    fn a_fin_makes_an_edge_non_manifold() {
        let mut positions = TETRAHEDRON.to_vec();
        positions.push([-1.0, -1.0, 0.0]);
        let mut triangles = OUTWARD.to_vec();
        triangles.push([0, 1, 4]);
        let faults = faults(&positions, &triangles);
        assert_eq!((faults.non_manifold_edges, faults.inconsistent_edges, faults.open_edges), (1, 1, 2));
        assert!(!faults.is_closed());
    }

    #[test]
    fn bodies_inside_out_are_told_from_cavities() {
        let shells = |shells: &[(f32, f32, bool)]| {
            let (mut positions, mut triangles) = (Vec::new(), Vec::new());
            for &(size, shift, inward) in shells {
                add(&mut positions, &mut triangles, size, shift, inward);
            }
            faults(&positions, &triangles)
        };
        assert_eq!(shells(&[(1.0, 0.0, true)]).inverted_shells, 1);
        assert!(shells(&[(1.0, 0.0, false), (0.25, 0.125, true)]).is_empty());
        // Beside the body, though inside its box.
        assert_eq!(shells(&[(1.0, 0.0, false), (0.25, 0.625, true)]).inverted_shells, 1);
        // A body with a cavity, all of it inside out.
        assert_eq!(shells(&[(1.0, 0.0, true), (0.25, 0.125, false)]).inverted_shells, 2);
        assert_eq!(shells(&[(1.0, 0.0, true), (1.0, 5.0, true)]).to_string(), "2 shells inside out turned");
    }

    #[test]
    fn bodies_inside_out_are_turned_and_their_normals_with_them() {
        let inward = OUTWARD.map(|[a, b, c]| [a, c, b]);
        let away = |sign: f32| TETRAHEDRON.map(|p| p.map(|x| sign * (x - 0.25)));
        for normals in [away(1.0), away(-1.0)] {
            let turned = mesh(&TETRAHEDRON, &normals, &inward).unwrap();
            assert_eq!(turned.faults, MeshFaults { inverted_shells: 1, ..MeshFaults::default() });
            let volume: f64 = turned.triangles.iter().map(|&t| area_vector(&TETRAHEDRON, t).dot(center(t))).sum();
            assert!(volume > 0.0);
            assert!(turned.normals.iter().zip(away(1.0)).all(|(n, away)| Vec3::from(*n).dot(away.into()) > 0.0));
        }
    }

    fn center(triangle: [u32; 3]) -> DVec3 {
        triangle.iter().map(|&i| DVec3::from_array(TETRAHEDRON[i as usize].map(|x| f64::from(x) - 0.25))).sum()
    }

    #[test]
    fn triangles_without_area_are_removed_and_do_not_open_the_surface() {
        let mut positions = TETRAHEDRON.to_vec();
        positions.extend([[0.5, 0.0, 0.0], [9.0, 9.0, 9.0]]);
        // The middle of an edge joined by a sliver, and a triangle that names one vertex twice.
        let triangles = [[0, 2, 4], [4, 2, 1], [0, 4, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3], [1, 1, 3]];
        let mesh = mesh(&positions, &[], &triangles).unwrap();
        assert_eq!(mesh.faults, MeshFaults { degenerate_triangles: 2, unused_vertices: 1, ..MeshFaults::default() });
        assert_eq!(mesh.triangles.len(), 5);
        assert_eq!(mesh.faults.to_string(), "2 degenerate triangles removed, 1 unused vertex");
    }

    #[test]
    fn what_cannot_be_used_is_refused_with_counts() {
        let mut positions = TETRAHEDRON.to_vec();
        positions[1][2] = f32::NAN;
        positions[3][0] = f32::NEG_INFINITY;
        assert_eq!(mesh(&positions, &[], &OUTWARD).unwrap_err(), Refusal::BadVertices { count: 2, first: 1 });
        positions[1][2] = 1e30;
        assert_eq!(mesh(&positions, &[], &OUTWARD).unwrap_err(), Refusal::BadVertices { count: 2, first: 1 });
        let refusal = mesh(&TETRAHEDRON, &[], &[[0, 1, 2], [0, 1, 4], [u32::MAX, 0, 1]]).unwrap_err();
        assert_eq!(refusal, Refusal::BadIndices { count: 2, first: 1, vertices: 4 });
        assert_eq!(mesh(&TETRAHEDRON, &[], &[]).unwrap_err(), Refusal::NoTriangles { degenerate: 0 });
        let refusal = mesh(&TETRAHEDRON, &[], &[[0, 0, 1]]).unwrap_err();
        assert_eq!(refusal.to_string(), "holds no triangles but 1 without an area; check the scale of the export");
        assert!(mesh(&[], &[], &[]).is_err());
    }

    #[test]
    fn normals_become_unit_vectors_and_bad_ones_those_of_the_faces() {
        // Two triangles over the edge 0 - 1: one of area 1/2 facing +z, one of area 1 facing -y.
        let positions = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        let triangles = [[0, 1, 2], [0, 1, 3]];
        let normals = [[0.0; 3], [f32::NAN, 0.0, 0.0], [0.0, 0.0, 1e-30], [0.0, f32::NEG_INFINITY, 0.0]];
        let mended = mesh(&positions, &normals, &triangles).unwrap();
        assert_eq!(mended.faults.replaced_normals, 3);
        let expected = DVec3::new(0.0, -2.0, 1.0).normalize().as_vec3().to_array();
        assert_eq!(mended.normals, [expected, expected, [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]);
    }

    #[test]
    fn normals_against_their_faces_are_counted() {
        let inward = [[0.0, 0.0, 1.0], [0.0, 0.0, -3.0], [0.0, 0.0, 1.0]];
        let triangle = mesh(&TETRAHEDRON[..3], &inward, &[[0, 1, 2]]).unwrap();
        assert_eq!(triangle.faults.opposed_normals, 1);
        assert_eq!(triangle.normals[1], [0.0, 0.0, -1.0]);
    }

    #[test]
    fn no_usable_normal_means_no_normals() {
        let none = mesh(&TETRAHEDRON, &[[0.0; 3]; 4], &OUTWARD).unwrap();
        assert!(none.normals.is_empty() && none.faults.is_empty());
        assert!(mesh(&TETRAHEDRON, &[[0.0, 0.0, 1.0]; 3], &OUTWARD).unwrap().normals.is_empty());
    }

    #[test]
    fn texture_coordinates_are_kept_mended_or_dropped() {
        let with = |uvs: &[[f32; 2]]| {
            let (positions, triangles) = (TETRAHEDRON.to_vec(), OUTWARD[..1].to_vec());
            Mesh::new(RawMesh { positions, triangles, uvs: uvs.to_vec(), ..RawMesh::default() }).unwrap()
        };
        let good = [[0.0, 1.0], [-3.5, 7.25], [1e9, 0.0], [0.5, 0.5]];
        assert_eq!((with(&good).uvs.as_slice(), with(&good).faults.replaced_uvs), (good.as_slice(), 0));
        // The last vertex is of no triangle: mended, but not worth telling.
        let (nan, infinite) = (f32::NAN, f32::INFINITY);
        let mended = with(&[[0.25, nan], [0.5, 0.75], [-infinite, 0.0], [nan, nan]]);
        assert_eq!(mended.uvs, [[0.0, 0.0], [0.5, 0.75], [0.0, 0.0], [0.0, 0.0]]);
        assert_eq!(mended.faults.replaced_uvs, 2);
        assert!(mended.faults.to_string().contains(", 2 texture coordinates replaced by 0"), "{}", mended.faults);
        assert_eq!(with(&[[2e9, 0.0], [0.5, 0.5], [0.5, 0.5], [0.5, 0.5]]).faults.replaced_uvs, 1);
        for none in [&[[nan; 2], [nan; 2], [nan; 2], [0.5; 2]][..], &[[0.5; 2]; 3], &[]] {
            assert!(with(none).uvs.is_empty() && with(none).faults.replaced_uvs == 0);
        }
    }
}
