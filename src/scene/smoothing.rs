//! Normals of a mesh that has none. In flow its vertices and triangles and the angle up to which edges are smooth, out flows the same
//! with normals: a vertex is there once for each smooth piece of the surface around it.

use std::collections::HashMap;

use glam::DVec3;

use super::mesh::{FARTHEST, RawMesh, area_vector};
use super::topology::{place, weld};

/// Gives `raw` normals across edges where its faces meet at no more than `angle` radians, unless it has any.
pub fn smooth(raw: &mut RawMesh, angle: f64) {
    let has_normals = raw.normals.iter().flatten().any(|x| *x != 0.0);
    let is_sound = raw.triangles.iter().flatten().all(|&vertex| (vertex as usize) < raw.positions.len())
        && raw.positions.iter().flatten().all(|x| f64::from(x.abs()) <= FARTHEST);
    if has_normals || !is_sound || angle <= 0.0 {
        return;
    }
    let welded = weld(&raw.positions);
    let faces: Vec<DVec3> = raw.triangles.iter().map(|&t| area_vector(&raw.positions, t).normalize_or_zero()).collect();
    let mut corners = Corners { parent: (0..3 * raw.triangles.len() as u32).collect() };
    // Of each edge both triangles, each with its corner at the edge's start and at its end.
    let mut edges: Vec<([u32; 2], [u32; 2])> = Vec::with_capacity(3 * raw.triangles.len());
    for (number, triangle) in (0..).zip(&raw.triangles) {
        for side in 0..3 {
            let ends = [side, (side + 1) % 3];
            let [from, to] = ends.map(|corner| welded[triangle[corner] as usize]);
            let [start, end] = ends.map(|corner| 3 * number + corner as u32);
            edges.push(if from < to { ([from, to], [start, end]) } else { ([to, from], [end, start]) });
        }
    }
    edges.sort_unstable();
    let flattest = angle.min(std::f64::consts::PI).cos();
    for same in edges.chunk_by(|a, b| a.0 == b.0) {
        // Where three faces meet there is no telling which go on in which.
        let [(_, one), (_, other)] = same else { continue };
        let cosine = faces[one[0] as usize / 3].dot(faces[other[0] as usize / 3]);
        if cosine >= flattest - 1e-9 {
            corners.join(one[0], other[0]);
            corners.join(one[1], other[1]);
        }
    }
    let mut sums: HashMap<u32, DVec3> = HashMap::new();
    for (number, (&triangle, face)) in (0..).zip(raw.triangles.iter().zip(&faces)) {
        for (corner, angle) in (3 * number..).zip(angles(&raw.positions, triangle)) {
            *sums.entry(corners.piece(corner)).or_insert(DVec3::ZERO) += angle * *face;
        }
    }
    // A vertex of the file, for each piece around it.
    let mut places: HashMap<(u32, u32), u32> = HashMap::new();
    let mut smooth = RawMesh { name: std::mem::take(&mut raw.name), ..RawMesh::default() };
    for (number, triangle) in (0..).zip(&raw.triangles) {
        smooth.triangles.push(std::array::from_fn(|corner| {
            let (vertex, piece) = (triangle[corner], corners.piece(3 * number + corner as u32));
            *places.entry((vertex, piece)).or_insert_with(|| {
                smooth.positions.push(raw.positions[vertex as usize]);
                smooth.uvs.extend(raw.uvs.get(vertex as usize));
                smooth.normals.push(sums[&piece].normalize_or_zero().as_vec3().to_array());
                smooth.positions.len() as u32 - 1
            })
        }));
    }
    *raw = smooth;
}

/// Gives each vertex the mean normal of the faces around its place, weighted by their angles: of those that are in its group, whose
/// number stands where its normal should.
pub fn average(raw: &mut RawMesh) {
    let welded = weld(&raw.positions);
    let key = |vertex: usize| (welded[vertex], raw.normals[vertex][0].to_bits());
    let mut sums: HashMap<(u32, u32), DVec3> = HashMap::new();
    for &triangle in &raw.triangles {
        let face = area_vector(&raw.positions, triangle).normalize_or_zero();
        for (vertex, angle) in triangle.into_iter().zip(angles(&raw.positions, triangle)) {
            *sums.entry(key(vertex as usize)).or_insert(DVec3::ZERO) += angle * face;
        }
    }
    let normal = |vertex| sums.get(&key(vertex)).map_or(DVec3::ZERO, |sum| sum.normalize_or_zero());
    raw.normals = (0..raw.normals.len()).map(|vertex| normal(vertex).as_vec3().to_array()).collect();
}

/// The angles of a triangle at its corners, 0 where there is none.
fn angles(positions: &[[f32; 3]], triangle: [u32; 3]) -> [f64; 3] {
    let at = triangle.map(|vertex| place(positions, vertex));
    [0, 1, 2].map(|corner| {
        let [own, next, last] = [0, 1, 2].map(|i| at[(corner + i) % 3]);
        let angle = (next - own).angle_between(last - own);
        if angle.is_finite() { angle } else { 0.0 }
    })
}

/// Corners of triangles, three each, and which belong together.
struct Corners {
    parent: Vec<u32>,
}

impl Corners {
    fn piece(&mut self, mut corner: u32) -> u32 {
        while self.parent[corner as usize] != corner {
            let above = self.parent[self.parent[corner as usize] as usize];
            self.parent[corner as usize] = above;
            corner = above;
        }
        corner
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.piece(one), self.piece(other));
        self.parent[one.max(other) as usize] = one.min(other);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// Two squares that meet in the y axis, the second one bent back by `angle`, and a third one far away.
    fn bent(angle: f64) -> RawMesh {
        let (sine, cosine) = angle.sin_cos();
        let (x, z) = (cosine as f32, -sine as f32);
        RawMesh {
            positions: vec![
                [-1.0, 0.0, 0.0],
                [0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [-1.0, 1.0, 0.0],
                [x, 0.0, z],
                [x, 1.0, z],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
            ..RawMesh::default()
        }
    }

    #[test]
    fn edges_are_smooth_up_to_the_angle() {
        let normals_at_the_edge = |bend: f64, angle: f64| {
            let mut raw = bent(bend);
            smooth(&mut raw, angle);
            let at = |(position, _): &(&[f32; 3], &[f32; 3])| position[0] == 0.0 && position[1] == 0.0;
            raw.positions.iter().zip(&raw.normals).filter(at).map(|(_, normal)| *normal).collect::<Vec<_>>()
        };
        let smooth_one = normals_at_the_edge(0.5, 0.6);
        assert_eq!(smooth_one.len(), 1);
        assert!((f64::from(smooth_one[0][0]) - 0.25_f64.sin()).abs() < 1e-6, "{smooth_one:?}");
        let sharp = normals_at_the_edge(0.7, 0.6);
        assert_eq!(sharp.len(), 2, "{sharp:?}");
        assert!(sharp.contains(&[0.0, 0.0, 1.0]));
        assert_eq!(normals_at_the_edge(FRAC_PI_2, FRAC_PI_2).len(), 1, "an edge of just that angle is smooth");
    }

    #[test]
    fn what_has_normals_or_makes_no_sense_is_left_alone() {
        let mut raw = bent(0.1);
        raw.normals = vec![[0.0, 1.0, 0.0]; 6];
        let before = raw.normals.clone();
        smooth(&mut raw, 1.0);
        assert_eq!(raw.normals, before);
        let mut raw = bent(0.1);
        raw.triangles.push([0, 1, 99]);
        smooth(&mut raw, 1.0);
        assert!(raw.normals.is_empty());
        let mut raw = bent(0.1);
        smooth(&mut raw, 0.0);
        assert!(raw.normals.is_empty());
    }
}
