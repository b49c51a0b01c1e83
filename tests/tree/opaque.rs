//! Opaque surfaces on the device, where what they send is known exactly.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};
use half::f16;

use vitrum::options::Size;
use vitrum::scene::{Camera, Dielectric, Dispersion, Opaque, PointLight, Scene, Surface, Texels, Texture, TextureMap};

use crate::bodies::in_white;
use crate::device::{Device, Picture, Shot};
use crate::shapes::{Part, cuboid, glass, icosphere, rectangle, scene};

const SIZE: Size = Size { width: 16, height: 12 };

/// A Lambertian board in the plane z = 0, seen from the front.
fn board(color: DVec3) -> Part {
    let matte = Opaque { base_color: color, specular: 0.0, ..Opaque::default() };
    Part::of(rectangle(3.0, 3.0), Surface::Opaque(matte))
}

/// Seen from z = 2, in the dark.
fn in_the_dark(parts: impl IntoIterator<Item = Part>, lights: Vec<PointLight>) -> Scene {
    let mut scene = scene(parts);
    scene.environment.light = vitrum::scene::Surroundings::Color(DVec3::ZERO);
    scene.camera = Camera { position: DVec3::Z * 2.0, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 0.3 };
    scene.lights = lights;
    scene
}

fn light(position: DVec3) -> PointLight {
    PointLight::new(position, DVec3::new(10.0, 4.0, 1.0))
}

/// Of each pixel the point of the board that its centre sees.
fn points(scene: &Scene) -> Vec<DVec3> {
    let half = (scene.camera.vertical_fov / 2.0).tan() * scene.camera.position.z;
    let pixel = |i: u32| {
        let x = (f64::from(i % SIZE.width) + 0.5) / f64::from(SIZE.width) * 2.0 - 1.0;
        let y = 1.0 - (f64::from(i / SIZE.width) + 0.5) / f64::from(SIZE.height) * 2.0;
        DVec3::new(x * half * f64::from(SIZE.width) / f64::from(SIZE.height), y * half, 0.0)
    };
    (0..SIZE.width * SIZE.height).map(pixel).collect()
}

/// What a Lambertian board sends at a point under a light.
fn lambertian(point: DVec3, color: DVec3, light: &PointLight) -> DVec3 {
    let way = light.position - point;
    color / PI * light.intensity * way.z / way.length().powi(3)
}

fn largest_error(picture: &Picture, expected: impl IntoIterator<Item = DVec3>) -> f64 {
    let pairs = picture.radiance.iter().zip(expected);
    pairs.map(|(found, expected)| (*found - expected).abs().max_element() / expected.max_element()).fold(0.0, f64::max)
}

#[test]
fn a_board_under_a_point_light_is_lambertian_in_air_and_in_glass() {
    let Some(device) = Device::open() else { return };
    let (color, light) = (DVec3::new(0.8, 0.3, 0.5), light(DVec3::new(0.3, 0.7, 1.2)));
    let air = in_the_dark([board(color)], vec![light]);
    // Camera, light and board inside: no interface is between them, and radiance there is radiance there.
    let tinted = Dielectric { attenuation_color: DVec3::new(0.9, 0.5, 0.2), attenuation_distance: 1.5, ..glass(1.5) };
    let body = |dielectric| Part::of(cuboid(-DVec3::splat(60.0), DVec3::splat(60.0)), Surface::Dielectric(dielectric));
    let clear = in_the_dark([board(color), body(glass(1.5))], vec![light]);
    let colored = in_the_dark([board(color), body(tinted.clone())], vec![light]);
    for (name, scene, tint) in [("air", air, None), ("glass", clear, None), ("tinted glass", colored, Some(tinted))] {
        let picture = device.picture(&scene, Shot { size: SIZE, ..Shot::default() });
        let expected = points(&scene).into_iter().map(|point| {
            let way = point.distance(light.position) + point.distance(scene.camera.position);
            let left = tint.as_ref().map_or(DVec3::ONE, |tint: &Dielectric| {
                DVec3::from_array(tint.attenuation_color.to_array().map(|c| c.powf(way / tint.attenuation_distance)))
            });
            lambertian(point, color, &light) * left
        });
        let worst = largest_error(&picture, expected);
        println!("{name}: within {worst:.1e}");
        assert!(worst < 1e-5, "{name}: {worst:e}");
    }
    device.verdict();
}

#[test]
fn opaque_bodies_cast_shadows_and_panes_take_what_they_mirror() {
    let Some(device) = Device::open() else { return };
    let (color, light) = (DVec3::splat(0.5), light(DVec3::new(1.0, 0.0, 1.0)));
    let between = DAffine3::from_translation(DVec3::new(0.5, 0.0, 0.5)) * DAffine3::from_scale(DVec3::splat(0.2));
    let ball = Part::of(icosphere(3), Surface::Opaque(Opaque::default())).placed(between);
    let scene = in_the_dark([board(color), ball], vec![light]);
    let picture = device.picture(&scene, Shot { size: SIZE, ..Shot::default() });
    for (found, point) in picture.radiance.iter().zip(points(&scene)) {
        let way = light.position - point;
        let centre = DVec3::new(0.5, 0.0, 0.5) - point;
        let distance = centre.reject_from(way).length();
        let expected = lambertian(point, color, &light);
        match distance {
            0.0..0.18 => assert_eq!(*found, DVec3::ZERO, "{point}"),
            0.21.. => assert!((*found - expected).abs().max_element() < 1e-5, "{point}: {found} {expected}"),
            _ => {}
        }
    }
    device.verdict();
}

#[test]
fn in_white_light_a_board_has_its_colour_a_mirror_mirrors_and_lamps_shine() {
    let Some(device) = Device::open() else { return };
    let texels = [[0.25_f32, 0.5, 0.75], [1.0, 0.0, 0.125]];
    let texel = |[r, g, b]: [f32; 3]| [r, g, b, 1.0].map(f16::from_f32);
    let texture =
        Texture { path: "two".into(), width: 2, height: 1, texels: Texels::Linear(texels.map(texel).to_vec()) };
    let mut textured = rectangle(3.0, 3.0);
    // Its left half, from the middle of one texel to the other and farther.
    textured.uvs = textured.positions.iter().map(|&[x, _, _]| [0.25 + 5.0 * x, 0.5]).collect();
    let worn = Opaque {
        base_color: DVec3::ONE,
        base_color_texture: Some(TextureMap::of(0)),
        specular: 0.0,
        ..Opaque::default()
    };
    let image = Scene {
        textures: vec![texture.into()],
        ..in_the_dark([Part::of(textured, Surface::Opaque(worn))], Vec::new())
    };
    let silver = Opaque { base_color: DVec3::new(0.9, 0.6, 0.3), metallic: 1.0, roughness: 0.0, ..Opaque::default() };
    let mirror = in_the_dark([Part::of(rectangle(3.0, 3.0), Surface::Opaque(silver.clone()))], Vec::new());
    let color = DVec3::new(0.8, 0.3, 0.5);
    let plain = in_the_dark([board(color)], Vec::new());
    let lamp = in_the_dark([Part::emitter(rectangle(3.0, 3.0), DVec3::new(3.0, 2.0, 1.0))], Vec::new());
    let (left, right) = (DVec3::from_array(texels[0].map(f64::from)), DVec3::from_array(texels[1].map(f64::from)));
    let of_image = |point: DVec3| {
        // Texels are at 1/4 and 3/4 of an image that repeats.
        let place = ((5.0 * point.x).rem_euclid(1.0) * 2.0).rem_euclid(2.0);
        left.lerp(right, if place < 1.0 { place } else { 2.0 - place })
    };
    // Schlick's mirror along the direction of each pixel.
    let of_mirror = |point: DVec3| {
        let cosine = 2.0 / point.distance(DVec3::Z * 2.0);
        silver.base_color + (DVec3::ONE - silver.base_color) * (1.0 - cosine).powi(5)
    };
    type Expected<'a> = &'a dyn Fn(DVec3) -> DVec3;
    let cases: [(&str, Scene, Expected<'_>, f64); 3] =
        [("board", plain, &|_| color, 1e-6), ("image", image, &of_image, 2e-4), ("mirror", mirror, &of_mirror, 1e-5)];
    for (name, scene, expected, bound) in cases {
        let scene = in_white(scene);
        let picture = device.picture(&scene, Shot { size: SIZE, ..Shot::default() });
        let worst = largest_error(&picture, points(&scene).into_iter().map(expected));
        println!("{name}: within {worst:.1e}");
        assert!(worst < bound, "{name}: {worst:e}");
    }
    let picture = device.picture(&lamp, Shot { size: SIZE, ..Shot::default() });
    assert!(picture.radiance.iter().all(|value| *value == DVec3::new(3.0, 2.0, 1.0)));
    device.verdict();
}

/// White light stays white whatever bends its colours apart, and coloured light behind a disperser keeps its colour, the parts of a
/// spectrum that no screen can show included.
#[test]
fn dispersing_bodies_keep_the_colour_of_what_is_behind_them() {
    let Some(device) = Device::open() else { return };
    let disperser = Dielectric { dispersion: Dispersion::Khr(2.0), ..glass(1.6) };
    let ball = Part::of(icosphere(4), Surface::Dielectric(disperser));
    let white = device.picture(&in_white(scene([ball])), Shot { size: SIZE, samples: 4, depth: 64, ..Shot::default() });
    for (value, cut) in white.radiance.iter().zip(&white.discarded) {
        assert!((*value - DVec3::ONE).abs().max_element() <= cut * 1.7 + 1e-5, "{value}, {cut} cut off");
    }

    // A slab in front of a board under a light: what it reflects within is left out, so that one path is left for each colour.
    let (color, light) = (DVec3::new(0.8, 0.0, 0.0), light(DVec3::new(0.0, 0.0, 0.6)));
    let slab = |dispersion| {
        let glass = Dielectric { dispersion, ..glass(1.6) };
        let slab = cuboid(DVec3::new(-20.0, -20.0, 1.0), DVec3::new(20.0, 20.0, 1.1));
        in_the_dark([board(color), Part::of(slab, Surface::Dielectric(glass))], vec![light])
    };
    let shot = Shot { size: SIZE, samples: 16, effects: "auto,-reflection", ..Shot::default() };
    let [plain, dispersed] =
        [Dispersion::None, Dispersion::Khr(0.2)].map(|dispersion| device.picture(&slab(dispersion), shot));
    for (plain, dispersed) in plain.radiance.iter().zip(&dispersed.radiance) {
        assert!((dispersed.x / plain.x - 1.0).abs() < 0.01, "{dispersed}, without dispersion {plain}");
        assert!(dispersed.y.abs().max(dispersed.z.abs()) < 1e-6, "{dispersed}");
    }
    device.verdict();
}

#[test]
fn what_is_not_simulated_is_not_there() {
    let Some(device) = Device::open() else { return };
    let body = Part::of(icosphere(3), Surface::Opaque(Opaque::default()));
    let pane = Part::glass(cuboid(DVec3::new(-0.4, -0.4, 1.1), DVec3::new(0.4, 0.4, 1.2)), 1.5);
    let shot = Shot { size: SIZE, effects: "auto,-opaque", ..Shot::default() };
    let with = device.picture(&in_white(scene([body, pane.clone()])), shot);
    let without = device.picture(&in_white(scene([pane])), shot);
    assert_eq!(with.largest_difference(&without), 0.0);
    device.verdict();
}
