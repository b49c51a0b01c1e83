//! Walls at one place. In flow bodies of glass, out flow the pairs of them with triangles that lie on each other.
//!
//! Which of two such walls a ray meets first is up to rounding: liquid in a glass has to overlap its wall, or to stay clear of it.

use std::collections::HashMap;

use glam::DVec3;

use super::walls::{Walls, lies_on, middle, normal};
use super::{Bounds, Object, Scene};

/// How far apart walls are that count as touching, in the size of the smaller body, and how parallel.
pub const NEAR: f64 = 1e-5;
const PARALLEL: f64 = 0.9999;

/// Pairs of bodies that are looked at.
const MOST_PAIRS: usize = 4096;

/// Two bodies with walls at one place, or one whose own are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Touch {
    /// Their places among the objects.
    pub objects: [usize; 2],
    /// Triangles of the first whose middle lies on the second.
    pub triangles: usize,
}

impl Scene {
    /// Bodies of glass whose walls lie on each other, of as many pairs as can be looked at.
    pub fn touching(&self) -> Vec<Touch> {
        let is_body = |object: &Object| self.body(object).is_some();
        let bodies: Vec<_> = (0..self.objects.len()).filter(|&number| is_body(&self.objects[number])).collect();
        let bounds: Vec<_> = bodies.iter().map(|&number| self.bounds_of(&self.objects[number])).collect();
        let pairs = (0..bodies.len()).flat_map(|a| (a..bodies.len()).map(move |b| (a, b)));
        let meet = pairs.filter(|&(a, b)| a == b || bounds[a].intersects(&bounds[b])).take(MOST_PAIRS);
        let mut walls: Vec<Option<Walls>> = bodies.iter().map(|_| None).collect();
        let mut found = Vec::new();
        // What lies on itself does so wherever it stands.
        let mut alone: HashMap<usize, usize> = HashMap::new();
        for (a, b) in meet {
            let mesh = self.objects[bodies[a]].mesh;
            if let (true, Some(&triangles)) = (a == b, alone.get(&mesh)) {
                found.extend((triangles > 0).then_some(Touch { objects: [bodies[a]; 2], triangles }));
                continue;
            }
            for body in [a, b] {
                let object = &self.objects[bodies[body]];
                walls[body].get_or_insert_with(|| Walls::new(&self.meshes[object.mesh], &object.transform));
            }
            let (Some(first), Some(second)) = (&walls[a], &walls[b]) else { continue };
            let near = NEAR * bounds[a].extent().max_element().min(bounds[b].extent().max_element());
            // Of large triangles under small ones the middle may lie elsewhere.
            let (some, others) =
                (first.on(second, near, &bounds[b], a == b), second.on(first, near, &bounds[a], a == b));
            if a == b {
                alone.insert(mesh, some);
            }
            if some.max(others) > 0 {
                let objects = if some >= others { [a, b] } else { [b, a] }.map(|body| bodies[body]);
                found.push(Touch { objects, triangles: some.max(others) });
            }
        }
        found
    }
}

impl Walls {
    /// How many triangles have their middle within `near` of one of `other`, which lies in `bounds`, and as it lies.
    fn on(&self, other: &Self, near: f64, bounds: &Bounds, same: bool) -> usize {
        let touches = |(number, corners): &(usize, &[DVec3; 3])| {
            let middle = middle(corners);
            let reach = Bounds { min: middle - near, max: middle + near };
            if !reach.intersects(bounds) {
                return false;
            }
            let own = normal(corners);
            let mut found = false;
            other.near(reach, near, |candidate| {
                let wall = &other.triangles[candidate];
                // Neighbours share corners; what shares all three lies there twice.
                let is_neighbour = || (1..3).contains(&corners.iter().filter(|corner| wall.contains(corner)).count());
                found = !(same && (candidate == *number || is_neighbour()))
                    && own.dot(normal(wall)).abs() > PARALLEL
                    && lies_on(middle, wall, near);
                !found
            });
            found
        };
        self.triangles.iter().enumerate().filter(touches).count()
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::scene::{Mesh, Overrides, RawMesh};

    #[test]
    fn walls_at_one_place_are_found() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        assert_eq!(scene.touching(), [], "the built-in scene");
        let all = scene.meshes[scene.objects[2].mesh].triangles.len();
        // The same again, by an error of the size of a 32-bit number's, and off by more.
        let twin = |offset: f64| {
            let body = scene.objects[2].clone();
            Object { transform: DAffine3::from_translation(DVec3::splat(offset)) * body.transform, ..body }
        };
        let [near, far] = [1e-8, 1e-3].map(twin);
        scene.objects.push(near);
        let found = scene.touching();
        assert_eq!(found.iter().map(|touch| touch.objects).collect::<Vec<_>>(), [[2, 4]]);
        assert!(found[0].triangles > all * 95 / 100, "{} of {all}", found[0].triangles);
        // The smaller one's triangles are the ones that lie on a larger one's, whichever comes first.
        let flat = |size: f32| {
            let corners = [[-size, 0.0, -size], [size, 0.0, -size], [0.0, 0.0, size], [0.0, size, 0.0]];
            let triangles = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
            let raw = RawMesh { name: "flat".into(), positions: corners.to_vec(), triangles, ..RawMesh::default() };
            Mesh::new(raw).expect("a tetrahedron")
        };
        let mut table = scene.clone();
        table.meshes = vec![flat(10.0).into(), flat(0.1).into()];
        table.objects = [0, 1].map(|mesh| Object { mesh, ..scene.objects[0].clone() }).to_vec();
        assert_eq!(table.touching(), [Touch { objects: [1, 0], triangles: 1 }]);
        table.objects.reverse();
        assert_eq!(table.touching(), [Touch { objects: [0, 1], triangles: 1 }]);
        scene.objects[4] = far;
        let touching: usize = scene.touching().iter().map(|touch| touch.triangles).sum();
        assert!(touching < all / 20, "{touching} of {all}");
    }
}
