//! The triangles of a surface by where they are. In flow a mesh and its place, out flow the triangles near a box.

use std::time::Duration;

use glam::{DAffine3, DVec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::{Bounds, Mesh};

/// The triangles of a mesh in a space, and a hierarchy over them.
pub struct Walls {
    /// As the mesh numbers them.
    pub triangles: Vec<[DVec3; 3]>,
    bvh: Bvh2,
}

impl Walls {
    /// Of `mesh` where `transform` puts it.
    pub fn new(mesh: &Mesh, transform: &DAffine3) -> Self {
        let place =
            |vertex: u32| transform.transform_point3(DVec3::from_array(mesh.positions[vertex as usize].map(f64::from)));
        let triangles: Vec<_> = mesh.triangles.iter().map(|triangle| triangle.map(place)).collect();
        let boxes: Vec<_> = triangles.iter().map(|corners| wide(bounds(corners), 0.0)).collect();
        Self { triangles, bvh: build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default()) }
    }

    /// Calls `visit` with triangles until it returns false: all that come as close to `bounds` as `room`, and some
    /// others.
    pub fn near(&self, bounds: Bounds, room: f64, mut visit: impl FnMut(usize) -> bool) {
        self.bvh.aabb_traverse(wide(bounds, room), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            let held = node.first_index as usize..(node.first_index + node.prim_count) as usize;
            bvh.primitive_indices[held].iter().all(|&number| visit(number as usize))
        });
    }
}

/// The box around a triangle.
pub fn bounds(corners: &[DVec3; 3]) -> Bounds {
    Bounds::around(corners.iter().copied())
}

/// The middle of a triangle.
pub fn middle([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (*a + *b + *c) / 3.0
}

/// The unit normal on the side from which a triangle is counter-clockwise; zero where it has no area.
pub fn normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

/// Whether `point` is within `near` of the plane of the triangle, and above or below it.
pub fn lies_on(point: DVec3, corners: &[DVec3; 3], near: f64) -> bool {
    let normal = normal(corners);
    let is_inside = |i: usize| {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        (to - from).cross(point - from).dot(normal) >= -near * (to - from).length()
    };
    normal.dot(point - corners[0]).abs() <= near && (0..3).all(is_inside)
}

/// `bounds` with `room` on all sides, and as much as 32-bit numbers lose.
fn wide(bounds: Bounds, room: f64) -> Aabb {
    let room = DVec3::splat(room + 1e-6 * bounds.reach());
    Aabb::new((bounds.min - room).as_vec3().into(), (bounds.max + room).as_vec3().into())
}
