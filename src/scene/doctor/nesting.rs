//! Which dielectric lies inside of which. In flow the bodies of glass of a scene, out flow the pairs of them that have
//! to do with each other.
//!
//! Bodies whose surfaces cross overlap. Of the others each shell is on one side of the other body, all of it: one point
//! that does not lie on both surfaces tells which, by its winding number.

use std::ops::ControlFlow;

use glam::DVec3;
use serde::Serialize;

use super::super::containment::winding_number;
use super::super::topology::{Shell, place, shells_of};
use super::super::walls::Walls;
use super::super::{Bounds, Object, Scene};
use super::crossing::{self, tolerance};

/// Pairs of bodies that are looked at.
const MOST_PAIRS: usize = 4096;

/// Pairs of triangles whose boxes meet, and triangles that points are asked about: a few seconds each.
const MOST_TESTS: usize = 50_000_000;
const MOST_VISITS: usize = 100_000_000;

/// Points of a shell that are asked until one of them is clearly on one side.
const MOST_POINTS: usize = 8;

/// How two bodies lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Nesting {
    /// All of the first one, or some of its shells, is where the second one is too.
    Inside,
    /// The first one is in a closed hollow of the second one.
    Hollow,
    /// Their surfaces cross: part of each is where the other one is.
    Overlaps,
}

/// Two bodies of glass that have to do with each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nest {
    /// How the first one lies to the second one.
    pub nesting: Nesting,
    /// Their places among the objects; of two that overlap, the one of the higher rank first.
    pub objects: [usize; 2],
    /// A point of the first one that says so, in the world.
    pub place: DVec3,
}

impl Scene {
    /// The bodies of glass that lie in each other, and whether all were looked at.
    pub fn nests(&self) -> (Vec<Nest>, bool) {
        let closed = |object: &Object| self.body(object).is_some() && self.meshes[object.mesh].faults.is_closed();
        let mut bodies: Vec<_> = (0..self.objects.len())
            .filter(|&number| closed(&self.objects[number]))
            .map(|number| Body::new(self, number))
            .collect();
        let meet = |a: usize, b: usize, bodies: &[Body<'_>]| bodies[a].bounds.intersects(&bodies[b].bounds);
        let pairs = (0..bodies.len()).flat_map(|a| (a + 1..bodies.len()).map(move |b| (a, b)));
        let pairs: Vec<_> = pairs.filter(|&(a, b)| meet(a, b, &bodies)).take(MOST_PAIRS + 1).collect();
        let mut left = Budget { tests: MOST_TESTS, visits: MOST_VISITS };
        let ranks = self.ranks();
        let mut found = Vec::new();
        for &(a, b) in pairs.iter().take(MOST_PAIRS) {
            [a, b].into_iter().for_each(|body| bodies[body].look());
            let (first, second) = match ranks[bodies[a].number] > ranks[bodies[b].number] {
                true => (&bodies[a], &bodies[b]),
                false => (&bodies[b], &bodies[a]),
            };
            let nest = first.overlaps(second, &mut left);
            let nest = nest.or_else(|| first.lies_in(second, &mut left)).or_else(|| second.lies_in(first, &mut left));
            found.extend(nest);
        }
        found.sort_by_key(|nest| nest.objects);
        (found, pairs.len() <= MOST_PAIRS && left.tests > 0 && left.visits > 0)
    }
}

/// What may still be looked at.
struct Budget {
    tests: usize,
    visits: usize,
}

/// A closed body of glass.
struct Body<'a> {
    scene: &'a Scene,
    number: usize,
    bounds: Bounds,
    /// Once they are wanted.
    parts: Option<(Walls, Vec<Shell>)>,
}

impl<'a> Body<'a> {
    fn new(scene: &'a Scene, number: usize) -> Self {
        Self { scene, number, bounds: scene.bounds_of(&scene.objects[number]), parts: None }
    }

    fn object(&self) -> &'a Object {
        &self.scene.objects[self.number]
    }

    fn look(&mut self) {
        let mesh = &self.scene.meshes[self.object().mesh];
        let parts = || (Walls::new(mesh, &self.object().transform), shells_of(&mesh.positions, &mesh.triangles));
        if self.parts.is_none() {
            self.parts = Some(parts());
        }
    }

    fn overlaps(&self, other: &Self, left: &mut Budget) -> Option<Nest> {
        let ((own, _), (others, _)) = (self.parts.as_ref()?, other.parts.as_ref()?);
        let tolerance = tolerance(&self.bounds).min(tolerance(&other.bounds));
        let place = crossing::between(own, others, &other.bounds, tolerance, &mut left.tests)?;
        Some(Nest { nesting: Nesting::Overlaps, objects: [self.number, other.number], place })
    }

    /// As for a body whose surface does not cross that of `other`.
    fn lies_in(&self, other: &Self, left: &mut Budget) -> Option<Nest> {
        let (_, shells) = self.parts.as_ref()?;
        let mut hollow = None;
        for shell in shells.iter().filter(|shell| shell.volume > 0.0) {
            match other.around(self, shell, left) {
                Some((Nesting::Hollow, place)) => hollow = hollow.or(Some((Nesting::Hollow, place))),
                Some(inside) => return Some(self.nest(other, inside)),
                None => {}
            }
        }
        hollow.map(|hollow| self.nest(other, hollow))
    }

    fn nest(&self, other: &Self, (nesting, place): (Nesting, DVec3)) -> Nest {
        Nest { nesting, objects: [self.number, other.number], place }
    }

    /// Whether a shell of `inner` lies in this body or in a hollow of it, and a point that tells.
    fn around(&self, inner: &Self, shell: &Shell, left: &mut Budget) -> Option<(Nesting, DVec3)> {
        let (_, own) = self.parts.as_ref()?;
        let positions = &inner.scene.meshes[inner.object().mesh].positions;
        let mesh = &self.scene.meshes[self.object().mesh];
        let to_own = self.object().transform.inverse();
        let step = shell.triangles.len().div_ceil(MOST_POINTS);
        let tell = |point: DVec3| {
            let place = inner.object().transform.transform_point3(point);
            if !self.bounds.contains(place) {
                return ControlFlow::Break(None);
            }
            left.visits = left.visits.saturating_sub(mesh.triangles.len());
            if left.visits == 0 {
                return ControlFlow::Break(None);
            }
            let windings = own.iter().map(|shell| {
                (shell.volume > 0.0, winding_number(&mesh.positions, &shell.triangles, to_own.transform_point3(place)))
            });
            let windings: Vec<_> = windings.collect();
            // On a surface it is about a half.
            if windings.iter().any(|(_, winding)| (winding - winding.round()).abs() > 0.2) {
                return ControlFlow::Continue(());
            }
            let all = windings.iter().map(|(_, winding)| winding.round()).sum::<f64>();
            let bodies = windings.iter().filter(|(is_body, _)| *is_body).map(|(_, w)| w.round()).sum::<f64>();
            ControlFlow::Break(match (all > 0.5, bodies > 0.5) {
                (true, _) => Some((Nesting::Inside, place)),
                (false, true) => Some((Nesting::Hollow, place)),
                _ => None,
            })
        };
        let points = shell.triangles.iter().step_by(step).map(|triangle| place(positions, triangle[0]));
        points.map(tell).find_map(ControlFlow::break_value).flatten()
    }
}
