//! Surfaces for tests.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::{Mesh, RawMesh};

/// A surface that is put together.
#[derive(Clone, Default)]
pub struct Shape {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    pub fn cuboid(min: [f32; 3], max: [f32; 3]) -> Self {
        let corner = |i: u32| std::array::from_fn(|axis| if i >> axis & 1 == 1 { max[axis] } else { min[axis] });
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        Self {
            positions: (0..8).map(corner).collect(),
            triangles: sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        }
    }

    /// A ball around the origin, of an octahedron whose sides are cut in four so many times.
    pub fn ball(level: u32, radius: f32) -> Self {
        let mut ball = Self {
            positions: vec![
                [1.0, 0.0, 0.0],
                [-1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, -1.0, 0.0],
                [0.0, 0.0, 1.0],
                [0.0, 0.0, -1.0],
            ],
            triangles: vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]],
        };
        for _ in 0..level {
            let mut middles = HashMap::new();
            let Self { positions, triangles } = &mut ball;
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum = (0..3).map(|i| f64::from(positions[a as usize][i]) + f64::from(positions[b as usize][i]));
                    let sum: Vec<_> = sum.collect();
                    positions.push(DVec3::from_slice(&sum).normalize().as_vec3().to_array());
                    positions.len() as u32 - 1
                })
            };
            *triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                })
                .collect();
        }
        ball.positions.iter_mut().flatten().for_each(|x| *x *= radius);
        ball
    }

    pub fn moved(mut self, by: [f32; 3]) -> Self {
        self.positions.iter_mut().for_each(|position| (0..3).for_each(|i| position[i] += by[i]));
        self
    }

    pub fn inwards(mut self) -> Self {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self
    }

    pub fn and(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        self
    }

    pub fn raw(self) -> RawMesh {
        RawMesh { name: "shape".into(), positions: self.positions, triangles: self.triangles, ..RawMesh::default() }
    }

    pub fn mesh(self) -> Mesh {
        Mesh::new(self.raw()).expect("a mesh")
    }
}
