//! The original model once more, one pixel at a time in 64-bit arithmetic: its own camera, its own rays against every
//! triangle, its own look-up of the environment. It shares nothing with the passes but the scene and the equations.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use vitrum::optics::original;
use vitrum::options::Size;
use vitrum::scene::{Environment, Scene, Surface, Surroundings};

/// What a ray meets first.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub object: usize,
    pub triangle: usize,
    pub distance: f64,
    pub normal: DVec3,
    pub face_normal: DVec3,
}

struct Triangle {
    object: usize,
    index: usize,
    corners: [DVec3; 3],
    normals: Option<[DVec3; 3]>,
}

/// A scene, ready to be looked at.
pub struct Reference<'a> {
    scene: &'a Scene,
    size: Size,
    triangles: Vec<Triangle>,
}

/// Radiance that `environment` sends from `direction`, bilinear between texels.
pub fn environment_radiance(environment: &Environment, direction: DVec3) -> DVec3 {
    let panorama = match &environment.light {
        Surroundings::Color(color) => return *color * environment.intensity,
        Surroundings::Image(panorama) => panorama,
    };
    let d = direction.normalize();
    let u = (d.x.atan2(-d.z) + environment.rotation) / TAU;
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    let (width, height) = (i64::from(panorama.width), i64::from(panorama.height));
    let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
    let texel = |column: f64, row: f64| {
        let column = (column as i64).rem_euclid(width);
        let row = (row as i64).clamp(0, height - 1);
        DVec3::from_array(panorama.texels[(row * width + column) as usize].map(f64::from))
    };
    let (left, top) = (x.floor(), y.floor());
    let across = |row| texel(left, row).lerp(texel(left + 1.0, row), x - left);
    across(top).lerp(across(top + 1.0), y - top) * environment.intensity
}

impl<'a> Reference<'a> {
    pub fn new(scene: &'a Scene, size: Size) -> Self {
        let mut triangles = Vec::new();
        for (object, placed) in scene.objects.iter().enumerate() {
            let mesh = &scene.meshes[placed.mesh];
            let wide = |v: [f32; 3]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
            let to_world = placed.transform.matrix3.inverse().transpose();
            let smooth = placed.smooth && !mesh.normals.is_empty();
            for (index, corners) in mesh.triangles.iter().enumerate() {
                triangles.push(Triangle {
                    object,
                    index,
                    corners: corners.map(|i| placed.transform.transform_point3(wide(mesh.positions[i as usize]))),
                    normals: smooth.then(|| corners.map(|i| to_world * wide(mesh.normals[i as usize]))),
                });
            }
        }
        Self { scene, size, triangles }
    }

    /// Unit direction through a point of the image, in pixels from its top left corner.
    pub fn ray(&self, pixel: DVec2) -> DVec3 {
        let camera = &self.scene.camera;
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let (width, height) = (f64::from(self.size.width), f64::from(self.size.height));
        let scale = 2.0 * (camera.vertical_fov / 2.0).tan() / height;
        let x = (pixel.x - width / 2.0) * scale;
        let y = (height / 2.0 - pixel.y) * scale;
        (forward + x * right + y * up).normalize()
    }

    pub fn hit(&self, direction: DVec3) -> Option<Hit> {
        let origin = self.scene.camera.position;
        let mut nearest: Option<Hit> = None;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.corners;
            let face = (b - a).cross(c - a);
            let slope = face.dot(direction);
            let distance = face.dot(a - origin) / slope;
            // Not a number where the face is seen on edge.
            if distance.is_nan() || distance <= 0.0 || nearest.is_some_and(|hit| hit.distance <= distance) {
                continue;
            }
            let point = origin + distance * direction;
            let area = face.length_squared();
            let weights = [(b, c), (c, a), (a, b)].map(|(p, q)| (q - p).cross(point - p).dot(face) / area);
            if weights.iter().any(|&weight| weight < 0.0) {
                continue;
            }
            let normal = match triangle.normals {
                Some(normals) => (0..3).map(|i| weights[i] * normals[i]).sum::<DVec3>(),
                None => face,
            };
            nearest = Some(Hit {
                object: triangle.object,
                triangle: triangle.index,
                distance,
                normal: normal.normalize(),
                face_normal: face.normalize(),
            });
        }
        nearest
    }

    /// Radiance of the environment, bilinear between texels.
    pub fn environment(&self, direction: DVec3) -> DVec3 {
        environment_radiance(&self.scene.environment, direction)
    }

    /// Light that a surface sends to the viewer.
    pub fn shade(&self, hit: &Hit, direction: DVec3, flipped: bool) -> DVec3 {
        let Surface::Dielectric(glass) = &self.scene.materials[self.scene.objects[hit.object].material].surface else {
            panic!("the original knows no opaque surface");
        };
        let view_dir = -direction;
        // From behind the original reflects more than everything; a picture holds no less than no light.
        let fresnel = original::fresnel_bsdf(hit.normal.dot(view_dir), 1.0, glass.ior).min(1.0);
        let reflection = self.environment(original::reflection_dir(view_dir, hit.normal));
        let transmission = original::transmission_dir(view_dir, hit.normal, glass.ior, flipped)
            .map_or(DVec3::ZERO, |direction| self.environment(direction));
        let mut lighting = transmission.lerp(reflection, fresnel);
        let position = self.scene.camera.position + hit.distance * direction;
        for light in &self.scene.lights {
            let to_light = light.position - position;
            let mirrored =
                original::specular_reflection_direct(view_dir, to_light.normalize(), hit.normal, glass.roughness);
            lighting += fresnel * mirrored * light.intensity / to_light.length_squared();
        }
        lighting
    }
}
