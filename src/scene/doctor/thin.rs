//! Walls that rays step over. In flow a mesh, its place and the camera, out flow the triangles whose opposite wall is
//! nearer than the renderer's arithmetic can tell.
//!
//! A ray that leaves a surface starts beyond the rounding error of the point it left from (`shaders/offset.glsl`), so
//! that it may start behind a wall that is nearer. That error grows with the coordinates in the mesh's space and with
//! the distance from the camera, which is where the renderer has its origin.

use std::ops::Range;

use glam::{DAffine3, DMat3, DVec3};

use super::super::Mesh;
use super::super::walls::{Walls, lies_on, middle, normal};
use super::{Ailment, Examined, Finding, parts};
use crate::optics::offset::offset_distance;
use crate::parallel;
use crate::scene::Bounds;

/// Bounds of relative errors after 5 and 7 roundings to 32 bits, as in `shaders/arrival.glsl`: n u / (1 - n u), u =
/// 2^-24.
const GAMMA_5: f64 = 5.0 / 16_777_211.0;
const GAMMA_7: f64 = 7.0 / 16_777_209.0;

/// A wall is thin below so many steps from a surface: its far side is rounded as well, and slanted rays need more.
const FEW: f64 = 4.0;

/// The cosine from which two walls that look away from each other are parallel: an edge of 8 degrees is a wedge, not a
/// wall.
const OPPOSED: f64 = -0.99;

/// Pairs of triangles that are looked at: some seconds.
const MOST_TESTS: usize = 100_000_000;

/// Triangles of `mesh`, put in its place by `transform` and seen from `camera`, whose opposite wall is too near; those
/// that are `folded` into others have another fault.
pub fn walls(mesh: &Mesh, transform: &DAffine3, camera: DVec3, folded: &[bool]) -> Examined {
    let rounding = Rounding::new(transform, camera);
    let range = |corners: &[DVec3; 3], outward| rounding.of_vertices(corners)..FEW * rounding.step(corners, outward);
    thinner(mesh, transform, folded, range)
}

/// Whether no wall of `mesh` is thin in any of these places, for certain: then there is no need to look at each.
pub fn are_thick(mesh: &Mesh, transforms: &[DAffine3], camera: DVec3, folded: &[bool]) -> bool {
    // Where lengths change alike in all directions so do walls, and angles stay.
    let widest = |transform: &DAffine3| {
        let scale = transform.matrix3.determinant().abs().cbrt();
        let square = transform.matrix3.transpose() * transform.matrix3;
        let is_uniform =
            (square * (1.0 / (scale * scale)) - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-6);
        is_uniform.then(|| FEW * Rounding::new(transform, camera).widest_step(&mesh.bounds()) / scale)
    };
    let widest = transforms.iter().map(widest).try_fold(0.0, |all: f64, one| one.map(|one| all.max(one)));
    widest.is_some_and(|reach| {
        let examined = thinner(mesh, &DAffine3::IDENTITY, folded, |_, _| 0.0..1.01 * reach);
        examined.is_complete && examined.finding.is_none()
    })
}

/// Triangles whose opposite wall is in the `range` of distances for a triangle of the mesh and its outward normal.
fn thinner(
    mesh: &Mesh,
    transform: &DAffine3,
    folded: &[bool],
    range: impl Fn(&[DVec3; 3], DVec3) -> Range<f64> + Sync,
) -> Examined {
    let walls = Walls::new(mesh, transform);
    let mirrored = if transform.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
    let is_folded = |number: usize| folded.get(number) == Some(&true);
    let parts = parts(mesh.triangles.len());
    let budget = MOST_TESTS / parts.len().max(1);
    let found = parallel::map(parallel::threads(), parts, |part| {
        let (mut thin, mut left) = (Vec::new(), budget);
        for number in part.filter(|number| !is_folded(*number)) {
            let corners = &walls.triangles[number];
            let (outward, center) = (mirrored * normal(corners), middle(corners));
            let local =
                mesh.triangles[number].map(|vertex| DVec3::from_array(mesh.positions[vertex as usize].map(f64::from)));
            let Range { start: touching, end: reach } = range(&local, outward);
            let mut thinnest = f64::INFINITY;
            walls.near(Bounds { min: center - reach, max: center + reach }, 0.0, |other| {
                left = left.saturating_sub(1);
                let wall = &walls.triangles[other];
                let facing = mirrored * normal(wall);
                if other != number && !is_folded(other) && outward.dot(facing) < OPPOSED {
                    let thickness = facing.dot(center - wall[0]) / facing.dot(outward);
                    // What is nearer than vertices are rounded touches: that is told elsewhere.
                    if (touching..reach).contains(&thickness) && lies_on(center, wall, reach) {
                        thinnest = thinnest.min(thickness);
                    }
                }
                left > 0
            });
            thin.extend(thinnest.is_finite().then_some((number, thinnest)));
        }
        (thin, left > 0)
    });
    let is_complete = found.iter().all(|(_, is_complete)| *is_complete);
    let thin: Vec<_> = found.into_iter().flat_map(|(thin, _)| thin).collect();
    let finding = thin.first().map(|&(triangle, _)| Finding {
        ailment: Ailment::ThinWalls,
        count: thin.len(),
        place: middle(&walls.triangles[triangle]),
        triangle: Some(triangle),
        size: thin.iter().map(|(_, thickness)| *thickness).reduce(f64::min),
    });
    Examined { finding, is_complete }
}

/// How far off points of an object may be: `ArriveAt()` in `shaders/arrival.glsl`.
struct Rounding {
    to_world: DAffine3,
    stretch: DMat3,
    shrink: DMat3,
    back: DVec3,
}

impl Rounding {
    fn new(transform: &DAffine3, camera: DVec3) -> Self {
        let to_world = DAffine3 { translation: transform.translation - camera, ..*transform };
        let to_object = to_world.inverse();
        let [stretch, shrink] = [to_world, to_object]
            .map(|m| DMat3::from_cols(m.matrix3.x_axis.abs(), m.matrix3.y_axis.abs(), m.matrix3.z_axis.abs()));
        Self { to_world, stretch, shrink, back: to_object.translation.abs() }
    }

    /// How far off the corners of a triangle may be because they are 32-bit numbers.
    fn of_vertices(&self, corners: &[DVec3; 3]) -> f64 {
        (self.stretch * middle(&corners.map(DVec3::abs))).max_element() * f64::from(f32::EPSILON)
    }

    /// No less than any [`Rounding::step`] of a triangle within these bounds of the mesh's space.
    fn widest_step(&self, bounds: &Bounds) -> f64 {
        let corners = (0..8).map(|corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
            DVec3::new(pick(0), pick(1), pick(2))
        });
        let (local, position) = corners.fold((DVec3::ZERO, DVec3::ZERO), |(local, position), corner| {
            (local.max(corner.abs()), position.max(self.to_world.transform_point3(corner).abs()))
        });
        let back = GAMMA_5 * (self.shrink * position + self.back);
        let error = self.stretch * (GAMMA_7 * local + back)
            + GAMMA_5 * (self.stretch * local + self.to_world.translation.abs());
        // Of all normals that add up the most of the error, as if they were as long as that.
        offset_distance(error, DVec3::ONE)
    }

    /// How far beyond the middle of a triangle of the mesh's space rays start that leave it.
    fn step(&self, corners: &[DVec3; 3], normal: DVec3) -> f64 {
        let local = middle(corners);
        let reach = middle(&corners.map(DVec3::abs));
        let position = self.to_world.transform_point3(local);
        let back = GAMMA_5 * (self.shrink * position.abs() + self.back);
        let error = self.stretch * (GAMMA_7 * reach + back)
            + GAMMA_5 * (self.stretch * local.abs() + self.to_world.translation.abs());
        offset_distance(error, normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_shader() {
        let shader = include_str!("../../../shaders/arrival.glsl");
        for (name, value) in [("GAMMA_5", GAMMA_5), ("GAMMA_7", GAMMA_7)] {
            let (_, rest) = shader.split_once(&format!("{name} = ")).expect("a constant");
            let theirs: f64 = rest.split(';').next().and_then(|text| text.parse().ok()).expect("a number");
            assert!((theirs / value - 1.0).abs() < 1e-7, "{name}: {theirs}, {value}");
        }
    }
}
