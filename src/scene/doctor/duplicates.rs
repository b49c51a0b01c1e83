//! Faces that are there twice. In flow triangles, out flow those with the corners of another one, whichever side they
//! show.

use super::super::Mesh;
use super::super::topology::place;
use super::{Ailment, Finding};

/// Those of `mesh`; `corners` are its triangles by welded vertices.
pub fn faces(mesh: &Mesh, corners: &[[u32; 3]]) -> Option<Finding> {
    let twins = twins(corners);
    let triangle = twins.iter().flat_map(|group| &group[1..]).copied().min()?;
    let [a, b, c] = corners[triangle].map(|vertex| place(&mesh.positions, vertex));
    Some(Finding {
        ailment: Ailment::DuplicateFaces,
        count: twins.iter().map(|group| group.len() - 1).sum(),
        place: (a + b + c) / 3.0,
        triangle: Some(triangle),
        size: None,
    })
}

/// The triangles that share all corners with others, in groups of two and more, each in its order.
pub fn twins(corners: &[[u32; 3]]) -> Vec<Vec<usize>> {
    let sorted = |mut triangle: [u32; 3]| {
        triangle.sort_unstable();
        triangle
    };
    let mut order: Vec<_> = corners.iter().enumerate().map(|(number, triangle)| (sorted(*triangle), number)).collect();
    order.sort_unstable();
    let groups = order.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1);
    groups.map(|group| group.iter().map(|(_, number)| *number).collect()).collect()
}
