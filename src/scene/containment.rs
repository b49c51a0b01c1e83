//! Which side of a surface one is on. In flow a scene and a point, out flows whether it lies inside of a body.

use std::f64::consts::TAU;

use glam::DVec3;

use super::{Mesh, Object, Scene};

/// Bodies that are asked for how many others are around their middle.
const MOST_ASKED: usize = 4096;

impl Mesh {
    /// How often the surface winds around `point`, in the mesh's space: 1 inside of a closed mesh, 0 outside and in its
    /// cavities.
    pub fn winding_number(&self, point: DVec3) -> f64 {
        winding_number(&self.positions, &self.triangles, point)
    }

    /// What the surface encloses, in the mesh's space; of one that is not closed, a number without a meaning.
    pub fn volume(&self) -> f64 {
        let center = self.bounds().center();
        let six = self.triangles.iter().map(|triangle| {
            let [a, b, c] =
                triangle.map(|index| DVec3::from_array(self.positions[index as usize].map(f64::from)) - center);
            a.dot(b.cross(c))
        });
        six.sum::<f64>().abs() / 6.0
    }
}

/// The solid angles of `triangles` seen from `point`, over 4 pi: van Oosterom & Strackee 1983, equation 8.
pub(super) fn winding_number(positions: &[[f32; 3]], triangles: &[[u32; 3]], point: DVec3) -> f64 {
    let half_angles = triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|index| DVec3::from_array(positions[index as usize].map(f64::from)) - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        a.dot(b.cross(c)).atan2(denominator)
    });
    half_angles.sum::<f64>() / TAU
}

impl Scene {
    /// Whether the camera sees `object` from its outside only: the mesh is closed and the camera is not in the body.
    pub fn is_seen_from_outside(&self, object: &Object) -> bool {
        let mesh = &self.meshes[object.mesh];
        if !mesh.faults.is_closed() {
            return false;
        }
        let camera = object.transform.inverse().transform_point3(self.camera.position);
        !mesh.bounds().contains(camera) || mesh.winding_number(camera).abs() < 0.5
    }

    /// Which dielectric is there where several overlap: the one of the highest rank. Ranks count from 1, one a dielectric object;
    /// what is no body, opaque or thin-walled, has 0.
    ///
    /// The higher priority wins; of one priority the smaller body, so that what lies in another shows; of one volume the later
    /// object.
    pub fn ranks(&self) -> Vec<u32> {
        let volume = |object: &Object| self.meshes[object.mesh].volume() * object.transform.matrix3.determinant().abs();
        let mut bodies: Vec<(i32, f64, usize)> = (0..self.objects.len())
            .filter_map(|number| {
                let object = &self.objects[number];
                self.body(object).map(|glass| (glass.priority, volume(object), number))
            })
            .collect();
        bodies.sort_by(|a, b| (a.0, b.1).partial_cmp(&(b.0, a.1)).unwrap_or(a.0.cmp(&b.0)).then(a.2.cmp(&b.2)));
        let mut ranks = vec![0; self.objects.len()];
        for (rank, (.., number)) in (1..).zip(bodies) {
            ranks[number] = rank;
        }
        ranks
    }

    /// How many bodies may overlap at the middle of one of them, by their bounding boxes.
    pub fn bodies_at_one_place(&self) -> usize {
        let is_body = |object: &&Object| self.body(object).is_some();
        let boxes: Vec<_> = self.objects.iter().filter(is_body).map(|object| self.bounds_of(object)).collect();
        let around = |point| boxes.iter().filter(|other| other.contains(point)).count();
        // Of thousands of bodies some are enough to find out.
        boxes.iter().take(MOST_ASKED).map(|own| around(own.center())).max().unwrap_or(0)
    }

    /// The objects that the camera is in: closed bodies that wind around it.
    pub fn bodies_around_camera(&self) -> Vec<usize> {
        (0..self.objects.len()).filter(|&number| self.camera_is_in(&self.objects[number])).collect()
    }

    fn camera_is_in(&self, object: &Object) -> bool {
        self.body(object).is_some() && self.meshes[object.mesh].faults.is_closed() && !self.is_seen_from_outside(object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Overrides;

    #[test]
    fn a_body_winds_once_around_its_inside_and_not_around_its_cavity() {
        let scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        let teapot = &scene.meshes[scene.objects[0].mesh];
        // In units of 10 cm: the wall is 2.5 mm thick, the middle of the pot is hollow.
        for (point, expected) in
            [(DVec3::new(0.0, 0.4, 0.0), 0.0), (DVec3::new(5.0, 0.4, 0.0), 0.0), (wall_of(teapot), 1.0)]
        {
            let found = teapot.winding_number(point);
            assert!((found - expected).abs() < 1e-9, "{point}: {found}");
        }
    }

    #[test]
    fn bodies_in_bodies_are_counted() {
        let scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        assert!(scene.bodies_at_one_place() <= 2);
        let nested = Scene { objects: vec![scene.objects[0].clone(); 12], ..scene };
        assert_eq!(nested.bodies_at_one_place(), 12);
    }

    /// A point just beneath the surface.
    fn wall_of(mesh: &Mesh) -> DVec3 {
        let [a, b, c] = mesh.triangles[0].map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)));
        (a + b + c) / 3.0 - 0.001 * (b - a).cross(c - a).normalize()
    }

    #[test]
    fn the_camera_in_the_hollow_is_outside_of_the_glass() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        assert!(scene.objects.iter().all(|object| scene.is_seen_from_outside(object)));
        let pot = scene.objects[0].clone();
        scene.camera.position = pot.transform.transform_point3(DVec3::new(0.0, 0.4, 0.0));
        assert!(scene.is_seen_from_outside(&pot));
        scene.camera.position = pot.transform.transform_point3(wall_of(&scene.meshes[pot.mesh]));
        assert!(!scene.is_seen_from_outside(&pot));
    }
}
