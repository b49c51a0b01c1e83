//! Tangents of meshes, for maps of normals. In flow a mesh with texture coordinates, out flow numbers for `shaders/texture.glsl`.
//!
//! Of each vertex the mean over the triangles around, weighted by their angles, as MikkTSpace has it. Vertices are those of the file,
//! which splits them where coordinates do not go on; where they are mirrored and it does not, the tangent is that of one side or none.

use glam::{DVec2, DVec3};

use crate::scene::Mesh;

/// Two numbers a vertex: the direction in which u grows on the surface, as an octahedron has it (Cigolle et al. 2014).
pub(super) fn tangents(mesh: &Mesh) -> Vec<[f32; 2]> {
    if mesh.uvs.is_empty() {
        return vec![[1.0, 0.0]; mesh.positions.len()];
    }
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let place = |vertex: u32| DVec3::from_array(mesh.positions[vertex as usize].map(f64::from));
    let uv = |vertex: u32| DVec2::from_array(mesh.uvs[vertex as usize].map(f64::from));
    for &triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(place);
        let [origin, right, up] = triangle.map(uv);
        let (right, up) = (right - origin, up - origin);
        let area = right.perp_dot(up);
        // Which way u grows; how fast does not matter.
        let along = ((b - a) * up.y - (c - a) * right.y) * area.signum();
        if area == 0.0 || along.length_squared() == 0.0 {
            continue;
        }
        for (vertex, edges) in triangle.into_iter().zip([(b - a, c - a), (c - b, a - b), (a - c, b - c)]) {
            let angle = edges.0.angle_between(edges.1);
            if angle.is_finite() {
                sums[vertex as usize] += angle * along.normalize();
            }
        }
    }
    sums.into_iter().map(|sum| octahedral(sum.normalize_or(DVec3::X)).map(|x| x as f32)).collect()
}

/// A direction as a place on an octahedron that is folded open.
fn octahedral(direction: DVec3) -> [f64; 2] {
    let DVec3 { x, y, z } = direction / direction.abs().element_sum();
    let fold = |own: f64, other: f64| (1.0 - other.abs()) * if own < 0.0 { -1.0 } else { 1.0 };
    if z < 0.0 { [fold(x, y), fold(y, x)] } else { [x, y] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::RawMesh;

    fn square(uvs: [[f32; 2]; 4]) -> Mesh {
        let raw = RawMesh {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
            uvs: uvs.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..RawMesh::default()
        };
        Mesh::new(raw).expect("a mesh")
    }

    #[test]
    fn tangents_go_where_u_grows() {
        let upright = square([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(tangents(&upright), [[1.0, 0.0]; 4]);
        let mirrored = square([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0], [1.0, 1.0]]);
        assert_eq!(tangents(&mirrored), [[-1.0, 0.0]; 4]);
        let turned = square([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]);
        assert_eq!(tangents(&turned), [[0.0, 1.0]; 4]);
        // Where coordinates stand still there is none, and any is taken.
        assert_eq!(tangents(&square([[0.5, 0.5]; 4])), [[1.0, 0.0]; 4]);
    }

    #[test]
    fn directions_come_back_from_the_octahedron() {
        for direction in [DVec3::X, DVec3::NEG_Z, DVec3::new(0.3, -0.5, -0.8), DVec3::new(-0.1, 0.2, 0.9)] {
            let [x, y] = octahedral(direction);
            let mut found = DVec3::new(x, y, 1.0 - x.abs() - y.abs());
            if found.z < 0.0 {
                let sign = |own: f64| if own < 0.0 { -1.0 } else { 1.0 };
                (found.x, found.y) = ((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y));
            }
            assert!((found.normalize() - direction.normalize()).length() < 1e-9, "{direction}");
        }
    }
}
