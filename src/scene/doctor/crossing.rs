//! Triangles that cross. In flow walls, out flow the pairs of them that pass through each other.
//!
//! Two triangles cross where each has corners on both sides of the plane of the other, and they share a piece of the
//! line in which the planes meet. Corners nearer to a plane than the tolerance are in it, and pieces shorter than that
//! are none: what touches, neighbours, and what lies in one plane does not cross.

use glam::DVec3;

use super::super::Bounds;
use super::super::touching::NEAR;
use super::super::walls::{Walls, bounds, middle};
use super::{Ailment, Finding, parts};
use crate::parallel;

/// Pairs of triangles whose boxes meet that are looked at: some seconds, or so many for each triangle.
const MOST_TESTS: usize = 100_000_000;
const MOST_TESTS_OF_ONE: usize = 64;

/// The triangles of a mesh that cross others of it.
pub struct Crossings {
    /// How many pairs.
    pub pairs: usize,
    /// Those that are in one, in their order.
    pub triangles: Vec<usize>,
    place: DVec3,
    /// Whether all were looked at.
    pub is_complete: bool,
}

impl Crossings {
    /// As an ailment, if there are any.
    pub fn finding(&self) -> Option<Finding> {
        let triangle = self.triangles.first().copied();
        triangle?;
        let (ailment, count, place) = (Ailment::SelfIntersections, self.pairs, self.place);
        Some(Finding { ailment, count, place, triangle, size: None })
    }
}

/// How deep what lies in `bounds` has to enter: as near as walls that touch, or what 32-bit coordinates lose.
pub fn tolerance(bounds: &Bounds) -> f64 {
    (NEAR * bounds.extent().max_element()).max(4.0 * f64::from(f32::EPSILON) * bounds.reach())
}

/// Those among `walls`, which lie in `bounds`; `corners` are their vertices, welded.
pub fn within(walls: &Walls, corners: &[[u32; 3]], bounds: Bounds) -> Crossings {
    let tolerance = tolerance(&bounds);
    let parts = parts(corners.len());
    let budget = MOST_TESTS.max(MOST_TESTS_OF_ONE * corners.len()) / parts.len().max(1);
    let found = parallel::map(parallel::threads(), parts, |part| {
        let (mut pairs, mut left) = (Vec::new(), budget);
        for number in part {
            let own = &walls.triangles[number];
            let is_neighbour = |other: usize| corners[number].iter().any(|vertex| corners[other].contains(vertex));
            walls.near(self::bounds(own), 0.0, |other| {
                left = left.saturating_sub(1);
                if other > number && !is_neighbour(other) {
                    let place = crossing(own, &walls.triangles[other], tolerance);
                    pairs.extend(place.map(|place| ([number, other], place)));
                }
                left > 0
            });
        }
        (pairs, left > 0)
    });
    let is_complete = found.iter().all(|(_, is_complete)| *is_complete);
    let pairs: Vec<_> = found.into_iter().flat_map(|(pairs, _)| pairs).collect();
    let mut triangles: Vec<_> = pairs.iter().flat_map(|(pair, _)| *pair).collect();
    triangles.sort_unstable();
    triangles.dedup();
    let place = pairs.iter().min_by_key(|(pair, _)| *pair).map_or(DVec3::ZERO, |(_, place)| *place);
    Crossings { pairs: pairs.len(), triangles, place, is_complete }
}

/// A place where `one` and `other`, which lies in `bounds`, cross; takes what it looks at from `budget`.
pub fn between(one: &Walls, other: &Walls, bounds: &Bounds, tolerance: f64, budget: &mut usize) -> Option<DVec3> {
    let mut found = None;
    for own in &one.triangles {
        let reach = self::bounds(own);
        if found.is_some() || *budget == 0 {
            break;
        }
        if reach.intersects(bounds) {
            other.near(reach, 0.0, |candidate| {
                *budget = budget.saturating_sub(1);
                found = crossing(own, &other.triangles[candidate], tolerance);
                found.is_none() && *budget > 0
            });
        }
    }
    found
}

/// The middle of what two triangles that cross have in common.
fn crossing(a: &[DVec3; 3], b: &[DVec3; 3], tolerance: f64) -> Option<DVec3> {
    let (normal_a, normal_b) = (normal_beyond(a, tolerance)?, normal_beyond(b, tolerance)?);
    let from_b = a.map(|corner| normal_b.dot(corner - b[0]));
    let from_a = b.map(|corner| normal_a.dot(corner - a[0]));
    let is_on_both_sides = |distances: &[f64; 3]| {
        distances.iter().any(|distance| *distance > tolerance)
            && distances.iter().any(|distance| *distance < -tolerance)
    };
    if !is_on_both_sides(&from_b) || !is_on_both_sides(&from_a) {
        return None;
    }
    // The vertices of neighbours along a crack are two.
    let is_near = |corner: &DVec3| b.iter().any(|other| corner.distance_squared(*other) < tolerance * tolerance);
    if a.iter().any(is_near) {
        return None;
    }
    let line = normal_a.cross(normal_b).try_normalize()?;
    let (of_a, of_b) = (cut(a, &from_b, line), cut(b, &from_a, line));
    let low = if of_a[0].0 > of_b[0].0 { of_a[0] } else { of_b[0] };
    let high = if of_a[1].0 < of_b[1].0 { of_a[1] } else { of_b[1] };
    (high.0 - low.0 > tolerance).then(|| (low.1 + high.1) * 0.5)
}

/// The unit normal of a triangle that is higher than the tolerance: a sliver's may point anywhere.
fn normal_beyond(corners: &[DVec3; 3], tolerance: f64) -> Option<DVec3> {
    let [a, b, c] = *corners;
    let twice_area = (b - a).cross(c - a);
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (twice_area.length() > tolerance * longest).then(|| twice_area.normalize())
}

/// Where a triangle passes through a plane that its corners have these distances from: the two ends, the lower one
/// along `line` first.
fn cut(corners: &[DVec3; 3], distances: &[f64; 3], line: DVec3) -> [(f64, DVec3); 2] {
    let mut ends = [(f64::INFINITY, middle(corners)), (f64::NEG_INFINITY, middle(corners))];
    for (i, j) in [(0, 1), (1, 2), (2, 0)] {
        if (distances[i] < 0.0) != (distances[j] < 0.0) {
            let point = corners[i].lerp(corners[j], distances[i] / (distances[i] - distances[j]));
            let along = line.dot(point - corners[0]) + line.dot(corners[0]);
            if along < ends[0].0 {
                ends[0] = (along, point);
            }
            if along > ends[1].0 {
                ends[1] = (along, point);
            }
        }
    }
    ends
}
