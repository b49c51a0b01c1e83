//! Bounding volume hierarchies for `shaders/trace_software.glsl`. In flow triangles or boxes, out flow nodes and the order in
//! which their leaves name what they hold.
//!
//! Compressed wide nodes: Ylitie, Karras & Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide
//! BVHs", HPG 2017, built by the crate `obvhs`.

use std::time::Duration;

use glam::Vec3A;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::{build_cwbvh, build_cwbvh_from_tris};
use obvhs::{BvhBuildParams, aabb::Aabb, triangle::Triangle};

use crate::scene::Bounds;

/// A node as the shader reads it: 80 bytes.
pub(super) type Node = [u32; 20];

/// A hierarchy over some primitives.
pub(super) struct Bvh {
    /// Nodes, the root first.
    pub(super) nodes: Vec<Node>,
    /// The primitives in the order of the leaves: a permutation.
    pub(super) order: Vec<u32>,
    /// Nodes on the longest way down.
    pub(super) depth: u32,
}

impl Bvh {
    /// Over triangles, of which there is at least one.
    pub(super) fn of_triangles(corners: impl Iterator<Item = [[f32; 3]; 3]>) -> Self {
        let triangles: Vec<_> =
            corners.map(|[a, b, c]| Triangle { v0: Vec3A::from(a), v1: Vec3A::from(b), v2: Vec3A::from(c) }).collect();
        Self::new(build_cwbvh_from_tris(&triangles, BvhBuildParams::medium_build(), &mut Duration::default()))
    }

    /// Over boxes; of none, a root without children.
    pub(super) fn of_boxes(boxes: impl Iterator<Item = Bounds>) -> Self {
        let boxes: Vec<_> = boxes.map(|bounds| Aabb::new(lower(bounds), upper(bounds))).collect();
        if boxes.is_empty() {
            return Self { nodes: vec![[0; 20]], order: Vec::new(), depth: 1 };
        }
        Self::new(build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default()))
    }

    fn new(built: CwBvh) -> Self {
        let nodes: Vec<Node> = built.nodes.iter().map(|node| bytemuck::cast(*node)).collect();
        let depth = depth(&nodes);
        Self { nodes, order: built.primitive_indices, depth }
    }
}

/// Nodes on the longest way down.
fn depth(nodes: &[Node]) -> u32 {
    // Children come after their parents.
    let mut depths = vec![1; nodes.len()];
    for (number, node) in nodes.iter().enumerate() {
        let inner = (node[3] >> 24).count_ones();
        for child in node[4]..node[4] + inner {
            depths[child as usize] = depths[number] + 1;
        }
    }
    depths.into_iter().max().unwrap_or(0)
}

/// The corner of `bounds` as 32-bit numbers, rounded outwards.
fn lower(bounds: Bounds) -> Vec3A {
    let round = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
    Vec3A::new(round(bounds.min.x), round(bounds.min.y), round(bounds.min.z))
}

fn upper(bounds: Bounds) -> Vec3A {
    -lower(Bounds { min: -bounds.max, max: -bounds.min })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a leaf holds lies in the box that the node above gives it, but for the rounding that the traversal allows for.
    #[test]
    fn boxes_hold_their_triangles() {
        let mut random = fastrand::Rng::with_seed(7);
        for (count, size) in [(1, 0.1), (2, 1.0), (5000, 0.02), (300, 1e-6)] {
            let mut point = |scale: f32| [0; 3].map(|_| scale * (random.f32() - 0.5));
            let triangles: Vec<[[f32; 3]; 3]> = (0..count)
                .map(|_| {
                    let center = point(2.0);
                    [0; 3].map(|_| {
                        let offset = point(size);
                        std::array::from_fn(|axis| center[axis] + offset[axis])
                    })
                })
                .collect();
            let bvh = Bvh::of_triangles(triangles.iter().copied());
            let mut seen = bvh.order.clone();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..count), "not a permutation");
            let mut found = 0;
            for node in &bvh.nodes {
                let byte = |word: usize, child: usize| (node[word + child / 4] >> (8 * (child % 4))) & 0xff;
                for child in 0..8 {
                    let meta = byte(6, child);
                    if meta == 0 || node[3] >> (24 + child) & 1 == 1 {
                        continue;
                    }
                    for primitive in 0..(meta >> 5).count_ones() {
                        let triangle = triangles[bvh.order[(node[5] + (meta & 31) + primitive) as usize] as usize];
                        found += 1;
                        for axis in 0..3 {
                            let step = f32::from_bits((node[3] >> (8 * axis) & 0xff) << 23);
                            let at = |word| f32::from_bits(node[axis]) + step * byte(word, child) as f32;
                            let slack = 2e-7 * (f32::from_bits(node[axis]).abs() + 255.0 * step);
                            let (low, high) = (at(8 + 4 * axis) - slack, at(10 + 4 * axis) + slack);
                            assert!(triangle.iter().all(|corner| (low..=high).contains(&corner[axis])));
                        }
                    }
                }
            }
            assert_eq!(found, count);
            assert!(bvh.depth < 16);
        }
    }

    #[test]
    fn boxes_are_rounded_outwards() {
        let bounds = Bounds { min: glam::DVec3::splat(0.1), max: glam::DVec3::splat(0.3) };
        assert!(f64::from(lower(bounds).x) <= 0.1 && f64::from(upper(bounds).x) >= 0.3);
        assert_eq!(Bvh::of_boxes(std::iter::empty()).nodes.len(), 1);
    }
}
