//! The device where scenes are as they should not be: open, huge, tiny, far away, of indices that no glass has.

use glam::{DAffine3, DVec3};

use vitrum::options::Size;
use vitrum::scene::{Dielectric, Mesh, RawMesh, Scene, Surface};

use crate::bodies::{asset, balls_in_water, built_in, in_the_city, water_in_a_glass};
use crate::device::{Device, Picture, Shot};
use crate::shapes::{Part, bumpy, cuboid, glass, hollow_ball, icosphere, rectangle, scene};

const SMALL: Size = Size { width: 64, height: 48 };

/// The mesh without one of so many triangles.
fn with_holes(mesh: &Mesh, one_of: usize) -> Mesh {
    let kept = mesh.triangles.iter().enumerate().filter(|(number, _)| number % one_of != 0);
    let triangles: Vec<_> = kept.map(|(_, &triangle)| triangle).collect();
    let Mesh { name, positions, normals, .. } = mesh.clone();
    let mesh = Mesh::new(RawMesh { name, positions, normals, triangles, ..RawMesh::default() }).expect("a mesh");
    assert!(!mesh.faults.is_closed());
    mesh
}

/// How much more or less than all the light a pixel has or has cut off.
fn largest_lack(picture: &Picture) -> f64 {
    let pixels = picture.radiance.iter().zip(&picture.discarded);
    pixels.map(|(value, cut)| (value + *cut - 1.0).abs().max_element()).fold(0.0, f64::max)
}

#[test]
fn open_surfaces_lose_no_light() {
    let Some(device) = Device::open() else { return };
    let triangle = RawMesh {
        name: "triangle".into(),
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        ..RawMesh::default()
    };
    for (name, mesh) in [
        ("rectangle", rectangle(2.0, 1.5)),
        ("triangle", Mesh::new(triangle).expect("a mesh")),
        ("ball with holes", with_holes(&icosphere(3), 5)),
        ("hollow ball with holes", with_holes(&hollow_ball(3, 0.1), 7)),
        ("box with holes", with_holes(&cuboid(-DVec3::splat(0.7), DVec3::splat(0.7)), 6)),
        ("diamond with holes", with_holes(&asset("diamond.obj"), 9)),
    ] {
        let turn = DAffine3::from_rotation_y(0.4);
        let one = vec![Part::glass(mesh.clone(), 1.5).placed(turn)];
        // Nested, media are tracked, and a body may be left that was never entered.
        let inner = Part::glass(mesh, 1.33).placed(DAffine3::from_scale(DVec3::splat(0.6)));
        let two = vec![one[0].clone(), inner];
        for parts in [one, two] {
            let count = parts.len();
            let picture =
                device.picture(&scene(parts), Shot { size: SMALL, depth: 16, cutoff: 1e-4, ..Shot::default() });
            let lack = largest_lack(&picture);
            println!("{name}, {count}: 1 within {lack:.1e}, {:.1e} discarded", picture.most_discarded());
            assert!(lack < 1e-5, "{name}, {count}: {lack:e}");
        }
    }
    device.verdict();
}

#[test]
fn unusual_indices_lose_no_light() {
    let Some(device) = Device::open() else { return };
    for ior in [1e-6, 0.3, 0.999_999, 1.000_001, 3.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e6] {
        for (name, mesh) in [("ball", icosphere(3)), ("bumpy", bumpy(2000)), ("box", cuboid(-DVec3::ONE, DVec3::ONE))] {
            let picture = device.picture(
                &scene([Part::glass(mesh, ior)]),
                Shot { size: SMALL, depth: 12, cutoff: 1e-4, ..Shot::default() },
            );
            let lack = largest_lack(&picture);
            println!("{name}, index {ior}: 1 within {lack:.1e}");
            assert!(lack < 1e-5, "{name}, index {ior}: {lack:e}");
        }
    }
    device.verdict();
}

/// The same scene so many times as large and moved. Absorption goes with the size.
fn moved(scene: &Scene, factor: f64, shift: f64) -> Scene {
    let mut moved = scene.clone();
    let shift = DVec3::splat(shift);
    for object in &mut moved.objects {
        let place = DAffine3::from_translation(shift) * DAffine3::from_scale(DVec3::splat(factor));
        object.transform = place * object.transform;
    }
    for material in &mut moved.materials {
        let Surface::Dielectric(glass) = &mut material.surface else { continue };
        glass.attenuation_distance *= factor;
    }
    moved.camera.position = scene.camera.position * factor + shift;
    moved.camera.target = scene.camera.target * factor + shift;
    moved
}

#[test]
fn huge_tiny_and_far_scenes_look_alike() {
    let Some(device) = Device::open() else { return };
    let colored = Dielectric { attenuation_color: DVec3::new(0.9, 0.4, 0.2), attenuation_distance: 1.0, ..glass(1.5) };
    for (name, scene) in [
        ("hollow ball", scene([Part::of(hollow_ball(4, 0.1), Surface::Dielectric(colored))])),
        ("balls in water", balls_in_water()),
        ("water in a glass", water_in_a_glass()),
        ("teapot and cups", built_in()),
    ] {
        let scene = in_the_city(scene);
        let shot = Shot { size: SMALL, depth: 12, cutoff: 1e-3, footprints: true, ..Shot::default() };
        let expected = device.picture(&scene, shot);
        for (factor, shift) in [(1e6, 0.0), (1e-6, 0.0), (1.0, 1e6)] {
            let found = device.picture(&moved(&scene, factor, shift), shot);
            let (rmse, differing) = (found.rmse(&expected), found.differing(&expected, 1e-2));
            println!("{name}, times {factor}, moved by {shift}: RMSE {rmse:.1e}, {differing} pixels differ");
            assert!(differing <= 12, "{name}, {factor}, {shift}: {differing} pixels differ, RMSE {rmse:e}");
        }
    }
    device.verdict();
}
