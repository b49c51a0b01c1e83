//! Lights without extent, in every model: what arrives is what KHR_lights_punctual says.

#[path = "common/mod.rs"]
mod common;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec2, DVec3};

use common::Validated;
use shapes::{Part, glass, icosphere, rectangle, scene};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::render;
use vitrum::plan::Plan;
use vitrum::scene::{Cone, Dielectric, Mesh, Opaque, PointLight, Scene, Surface, Surroundings};

const SIZE: Size = Size { width: 48, height: 36 };
const TRANSPORTS: [Model; 2] = [Model::Path, Model::Tree];

fn picture(validated: &Validated, scene: &Scene, model: Model) -> Vec<DVec3> {
    let args = RenderArgs { model: Some(model.into()), size: Some(SIZE), samples: Some(64), ..RenderArgs::default() };
    let plan = Plan::new(scene, &args).expect("a plan");
    let rendered = render(&validated.gpu, scene, &plan, &mut |_| {}).expect("a picture");
    rendered.radiance.into_iter().map(|pixel| DVec3::from_array(pixel.map(f64::from))).collect()
}

/// A mesh in the dark, seen from +z.
fn in_the_dark(mesh: Mesh, surface: Surface, lights: Vec<PointLight>) -> Scene {
    let mut scene = scene([Part::of(mesh, surface)]);
    scene.environment.light = Surroundings::Color(DVec3::ZERO);
    scene.framed = false;
    scene.camera.position = DVec3::new(0.0, 0.0, 5.0);
    scene.camera.target = DVec3::ZERO;
    scene.camera.vertical_fov = 0.6;
    scene.lights = lights;
    scene
}

/// The point of the plane z = 0 that a pixel shows at this part of its width and height.
fn point(pixel: usize, at: DVec2, scene: &Scene) -> DVec3 {
    let (x, y) = (pixel as u32 % SIZE.width, pixel as u32 / SIZE.width);
    let half = scene.camera.position.z * (0.5 * scene.camera.vertical_fov).tan();
    let step = 2.0 * half / f64::from(SIZE.height);
    let off = |pixel: u32, at: f64, of: u32| f64::from(pixel) + at - 0.5 * f64::from(of);
    DVec3::new(off(x, at.x, SIZE.width) * step, -off(y, at.y, SIZE.height) * step, 0.0)
}

/// A board below a slanted spot: Lambert's law times the falloff of the cone, the mean over each pixel.
#[test]
fn spots_light_what_lies_in_their_cone() {
    let Some(validated) = Validated::open() else { return };
    let (position, direction) = (DVec3::new(0.3, -0.2, 2.0), DVec3::new(0.2, 0.1, -1.0));
    let (inner, outer) = (0.2_f64, 0.45_f64);
    let intensity = DVec3::new(9.0, 5.0, 1.0);
    let cone = Cone::new(direction, inner, outer);
    let light = PointLight { cone, ..PointLight::new(position, intensity) };
    let white = Opaque { base_color: DVec3::ONE, specular: 0.0, ..Opaque::default() };
    let mut scene = in_the_dark(rectangle(8.0, 8.0), Surface::Opaque(white), vec![light]);
    let lit = |point: DVec3| {
        let to_light = position - point;
        let cosine = -to_light.normalize().dot(direction.normalize());
        let falloff = ((cosine - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2);
        intensity * falloff * to_light.normalize().z / (PI * to_light.length_squared())
    };
    // Anywhere in the world, at any size.
    for (scale, offset) in [(1.0, DVec3::ZERO), (1e-3, DVec3::new(0.5, -3.0, 2.0))] {
        let placed = DAffine3::from_scale_rotation_translation(DVec3::splat(scale), DQuat::IDENTITY, offset);
        let mut small = scene.clone();
        small.objects[0].transform = placed * scene.objects[0].transform;
        small.camera.position = placed.transform_point3(scene.camera.position);
        small.camera.target = placed.transform_point3(scene.camera.target);
        small.lights[0].position = placed.transform_point3(position);
        small.lights[0].intensity = intensity * scale * scale;
        for model in TRANSPORTS {
            let mut dark = 0;
            for (pixel, &found) in picture(&validated, &small, model).iter().enumerate() {
                let wanted = (0..64)
                    .map(|i| lit(point(pixel, DVec2::new((i % 8) as f64 + 0.5, (i / 8) as f64 + 0.5) / 8.0, &scene)));
                let wanted = wanted.sum::<DVec3>() / 64.0;
                let off = (found - wanted).abs().max_element();
                assert!(off < 5e-3, "{model:?} {pixel}: {found}, not {wanted}");
                dark += usize::from(wanted == DVec3::ZERO && found == DVec3::ZERO);
            }
            assert!(dark > 500, "{model:?}: {dark} dark");
        }
    }
    // What is behind it is dark.
    scene.lights[0].cone = Cone::new(-direction, inner, outer);
    for model in TRANSPORTS {
        assert!(picture(&validated, &scene, model).iter().all(|&found| found == DVec3::ZERO), "{model:?}");
    }
    validated.verdict();
}

/// In every model a spot that has all it shines on in its full cone is a point light, and one that points away is none.
#[test]
fn highlights_of_spots_are_those_of_points() {
    let Some(validated) = Validated::open() else { return };
    let rough = Surface::Dielectric(Dielectric { roughness: 0.3, ..glass(1.5) });
    let point = PointLight::new(DVec3::new(1.0, 2.0, 4.0), DVec3::splat(20.0));
    let spot = |direction, inner, outer| PointLight { cone: Cone::new(direction, inner, outer), ..point };
    let lights = [point, spot(-point.position, 0.5, 0.7), spot(point.position, 0.5, 1.5)];
    for model in [Model::Single, Model::Double, Model::Path] {
        let [all, within, away] =
            lights.map(|light| picture(&validated, &in_the_dark(icosphere(3), rough.clone(), vec![light]), model));
        assert!(all.iter().any(|found| found.max_element() > 0.1), "{model:?}");
        assert_eq!(all, within, "{model:?}");
        assert!(away.iter().all(|&found| found == DVec3::ZERO), "{model:?}");
    }
    validated.verdict();
}
