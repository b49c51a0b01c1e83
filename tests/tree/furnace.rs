//! Energy on the device: under white light a pixel is what it did not cut off, and bodies without an index are not there.

use glam::{DAffine3, DVec3};

use vitrum::scene::{Scene, Surface};

use crate::bodies::{self, ball, built_in, hollow, in_the_city, in_white, water_in_a_glass};
use crate::device::{Device, Shot};
use crate::shapes::{Part, icosphere, scene};

/// Every dielectric of index 1.
fn of_index_one(mut scene: Scene) -> Scene {
    for material in &mut scene.materials {
        let Surface::Dielectric(glass) = &mut material.surface else { continue };
        glass.ior = 1.0;
    }
    scene
}

#[test]
fn bodies_of_index_one_are_the_environment_bit_by_bit() {
    let Some(device) = Device::open() else { return };
    let nested = scene(
        [1.0, 0.7, 0.4].map(|size| Part::glass(icosphere(3), 1.0).placed(DAffine3::from_scale(DVec3::splat(size)))),
    );
    for (name, glass) in [("ball", ball()), ("hollow", hollow()), ("teapot and cups", built_in()), ("nested", nested)]
        .into_iter()
        .chain([("water in a glass", water_in_a_glass())])
    {
        let glass = in_the_city(of_index_one(glass));
        let empty = Scene { objects: Vec::new(), ..glass.clone() };
        // As a render does it: with look-ups as wide as the pixel.
        let shot = Shot { footprints: true, ..Shot::default() };
        let [found, expected] = [glass, empty].map(|scene| device.picture(&scene, shot));
        let differing = found.differing(&expected, 0.0);
        assert_eq!(differing, 0, "{name}: {differing} pixels, the worst by {}", found.largest_difference(&expected));
        assert!(found.discarded.iter().chain(&found.interfaces).all(|&count| count == 0.0), "{name}");
    }
    device.verdict();
}

#[test]
fn no_light_is_lost_or_made_in_a_white_furnace() {
    let Some(device) = Device::open() else { return };
    for (name, scene) in bodies::all() {
        for depth in [4, 32] {
            let picture = device.picture(&scene, Shot { depth, ..Shot::default() });
            let pixels = || picture.radiance.iter().zip(&picture.discarded);
            let lack = pixels().map(|(value, cut)| (value + *cut - 1.0).abs().max_element()).fold(0.0, f64::max);
            let brightest = picture.radiance.iter().map(|value| value.max_element()).fold(0.0, f64::max);
            let discarded = picture.most_discarded();
            println!("{name}, depth {depth}: 1 within {lack:.1e}, at most {brightest:.7}, discarded {discarded:.1e}");
            assert!(lack < 1e-5, "{name}, depth {depth}: {lack:e} is lost or made");
            assert!(brightest < 1.0 + 1e-5, "{name}, depth {depth}: {brightest}");
            assert!(picture.interfaces.iter().any(|&count| count > 0.0), "{name}: nothing was met");
        }
    }
    device.verdict();
}

#[test]
fn a_camera_in_glass_sees_the_square_of_its_index() {
    let Some(device) = Device::open() else { return };
    let mut ball = in_white(ball());
    let shot = Shot { depth: 64, ..Shot::default() };
    // Near the centre nothing is totally reflected; along the wall rays go round for ever.
    for (position, target, share) in [
        (DVec3::new(0.2, -0.1, 0.3), DVec3::ZERO, 1.0..=1.0),
        (DVec3::new(0.0, 0.9, 0.0), DVec3::new(1.0, 0.1, 0.0), 0.05..=0.95),
    ] {
        (ball.camera.position, ball.camera.target) = (position, target);
        let picture = device.picture(&ball, shot);
        let pixels = || picture.radiance.iter().zip(&picture.discarded);
        let lack = pixels().map(|(value, cut)| (value + *cut - 2.25).abs().max_element()).fold(0.0, f64::max);
        let seen = pixels().filter(|(value, _)| (value.x - 2.25).abs() < 1e-3).count();
        println!("at {position}: 2.25 within {lack:.1e}; {seen} pixels of {} see it all", picture.radiance.len());
        assert!(lack < 2.25e-4, "{lack:e}");
        assert!(share.contains(&(seen as f64 / picture.radiance.len() as f64)), "{seen}");
    }
    device.verdict();
}
