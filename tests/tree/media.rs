//! Bodies in bodies on the device: who is there where they overlap, and who is not.

use glam::{DAffine3, DVec2, DVec3};

use vitrum::options::Size;
use vitrum::scene::{Dielectric, Scene, Surface};

use crate::bodies::{balls_in_water, in_the_city, of_priority, water_in_a_glass};
use crate::device::{Device, Shot};
use crate::reference::{Referee, Settings};
use crate::shapes::{Part, cuboid, glass, hollow_ball, icosphere, scene};

const SMALL: Size = Size { width: 64, height: 48 };

fn shot() -> Shot {
    Shot { size: SMALL, depth: 12, cutoff: 1e-4, ..Shot::default() }
}

/// The same scene with its objects in another order.
fn in_order(scene: &Scene, order: &[usize]) -> Scene {
    Scene { objects: order.iter().map(|&number| scene.objects[number].clone()).collect(), ..scene.clone() }
}

fn scaled(size: f64) -> DAffine3 {
    DAffine3::from_scale(DVec3::splat(size))
}

/// A bubble is a body of index 1 in the other; a hollow mesh has the other's wall around nothing.
#[test]
fn a_bubble_in_water_is_a_hollow_in_it() {
    let Some(device) = Device::open() else { return };
    let hollow = in_the_city(scene([Part::glass(hollow_ball(4, 0.3), 1.33)]));
    let expected = device.picture(&hollow, shot());
    for (inner, outer) in [(0, 0), (1, 0), (3, -2)] {
        let bubble = Part::of(icosphere(4), of_priority(inner, 1.0)).placed(scaled(0.7));
        let water = Part::of(icosphere(4), of_priority(outer, 1.33));
        let nested = in_the_city(scene([bubble, water]));
        let found = device.picture(&nested, shot());
        let (rmse, differing) = (found.rmse(&expected), found.differing(&expected, 1e-2));
        println!("priorities {inner} and {outer}: RMSE {rmse:.1e}, {differing} pixels differ");
        assert!(rmse < 1e-3 && differing < 5, "{inner} {outer}: {rmse:e}, {differing}");
    }
    // Below the water's priority it is not there.
    let hidden = Part::of(icosphere(4), of_priority(-1, 1.0)).placed(scaled(0.7));
    let water = Part::of(icosphere(4), of_priority(0, 1.33));
    let found = device.picture(&in_the_city(scene([hidden, water.clone()])), shot());
    let solid = device.picture(&in_the_city(scene([water])), shot());
    let (rmse, differing) = (found.rmse(&solid), found.differing(&solid, 1e-2));
    println!("hidden: RMSE {rmse:.1e}, {differing} pixels differ");
    assert!(rmse < 1e-3 && differing < 5 && solid.rmse(&expected) > 0.05, "{rmse:e}, {differing}");
    device.verdict();
}

#[test]
fn the_smaller_of_two_bodies_shows_and_the_order_in_the_file_does_not_matter() {
    let Some(device) = Device::open() else { return };
    for (name, scene, orders) in [
        ("balls in water", balls_in_water(), vec![[0, 1, 2], [2, 1, 0], [1, 0, 2], [1, 2, 0]]),
        ("water in a glass", three_in_a_glass(), vec![[0, 1, 2], [2, 1, 0], [1, 0, 2], [1, 2, 0]]),
    ] {
        let scene = in_the_city(scene);
        let referee = Referee::new(&scene, Settings { max_depth: 12, cutoff: 1e-4, ..Settings::default() });
        let expected = referee.picture(SMALL, &[DVec2::ZERO]);
        let first = device.picture(&scene, shot());
        let other = (0..expected.len())
            .filter(|&i| {
                let radiance = expected[i].radiance + expected[i].stand_in;
                (first.radiance[i] - radiance).abs().max_element() > 1e-2 * radiance.max_element().max(1.0)
            })
            .count();
        println!("{name}: {other} pixels are not as the referee has them");
        assert!(other < 10, "{name}: {other}");
        for order in orders {
            let found = device.picture(&in_order(&scene, &order), shot());
            let (rmse, differing) = (found.rmse(&first), found.differing(&first, 1e-3));
            assert!(rmse < 1e-4 && differing < 3, "{name}, {order:?}: {rmse:e}, {differing}");
        }
        // Without one of them it is another picture.
        for left_out in 0..3 {
            let rest: Vec<_> = (0..3).filter(|&number| number != left_out).collect();
            let rmse = device.picture(&in_order(&scene, &rest), shot()).rmse(&first);
            assert!(rmse > 5e-3, "{name} without {left_out}: {rmse:e}");
        }
    }
    device.verdict();
}

/// A tumbler, water in it that overlaps its wall, and a ball of ice that swims in both air and water.
fn three_in_a_glass() -> Scene {
    let mut scene = water_in_a_glass();
    let ice = Part::of(icosphere(3), of_priority(0, 1.31));
    scene.meshes.push(ice.mesh.into());
    scene.materials.push(vitrum::scene::Material::new("ice".into(), ice.surface));
    let transform = DAffine3::from_translation(DVec3::Y * 0.35) * scaled(0.35);
    scene.objects.push(vitrum::scene::Object { mesh: 2, material: 2, number: 2, transform, smooth: true });
    scene
}

/// A layer of a stack that is seen from above, so wide that its sides are not seen.
fn layer(top: f64, bottom: f64, priority: i32, ior: f64) -> Part {
    Part::of(cuboid(DVec3::new(-9.0, -9.0, bottom), DVec3::new(9.0, 9.0, top)), of_priority(priority, ior))
}

#[test]
fn where_layers_overlap_the_higher_one_is() {
    let Some(device) = Device::open() else { return };
    for (name, parts) in [
        ("priority", vec![layer(-1.0, -3.0, 1, 1.33), layer(-2.0, -4.0, 0, 1.5)]),
        ("the other", vec![layer(-1.0, -3.0, 0, 1.33), layer(-2.0, -4.0, 1, 1.5)]),
        ("hidden", vec![layer(-2.0, -3.0, 0, 1.33), layer(-1.0, -4.0, 1, 1.5)]),
        ("smaller", vec![layer(-2.0, -3.0, 0, 1.33), layer(-1.0, -4.0, 0, 1.5)]),
        ("later", vec![layer(-2.0, -4.0, 0, 1.5), layer(-1.0, -3.0, 0, 1.33)]),
        ("of one index", vec![layer(-1.0, -3.0, 0, 1.5), layer(-2.0, -4.0, 1, 1.5)]),
        ("three", vec![layer(-2.0, -6.0, 0, 1.8), layer(-3.0, -5.0, 0, 1.5), layer(-1.0, -4.0, 1, 1.2)]),
    ] {
        let mut scene = in_the_city(scene(parts));
        (scene.camera.position, scene.camera.target) = (DVec3::new(0.3, 0.1, 1.0), DVec3::new(-0.2, 0.0, -1.0));
        let found = device.picture(&scene, Shot { cutoff: 1e-6, ..shot() });
        let settings = Settings { max_depth: 12, cutoff: 1e-6, ..Settings::default() };
        let expected = Referee::new(&scene, settings).picture(SMALL, &[DVec2::ZERO]);
        let differences = expected.iter().zip(&found.radiance).map(|(sample, found)| {
            let radiance = sample.radiance + sample.stand_in;
            (radiance - *found).abs().max_element() / radiance.max_element().max(1.0)
        });
        let worst = differences.fold(0.0, f64::max);
        println!("{name}: the worst pixel differs by {worst:.1e}");
        assert!(worst < 1e-3, "{name}: {worst:e}");
    }
    device.verdict();
}

/// Faces that coincide: nothing but numbers, and no light from nowhere.
#[test]
fn faces_that_coincide_lose_no_light() {
    let Some(device) = Device::open() else { return };
    let unit = |min: DVec3, max: DVec3, priority, ior| Part::of(cuboid(min, max), of_priority(priority, ior));
    let (low, high) = (-DVec3::splat(0.6), DVec3::splat(0.6));
    for (name, parts) in [
        ("twice the same", vec![unit(low, high, 0, 1.5), unit(low, high, 0, 1.5)]),
        ("the same of two indices", vec![unit(low, high, 0, 1.5), unit(low, high, 0, 1.33)]),
        ("the same of two priorities", vec![unit(low, high, 0, 1.5), unit(low, high, 1, 1.33)]),
        ("side by side", vec![unit(low, high.with_x(0.0), 0, 1.5), unit(low.with_x(0.0), high, 0, 1.33)]),
        ("one in the corner of the other", vec![unit(low, high, 0, 1.5), unit(low, DVec3::ZERO, 0, 1.33)]),
        (
            "balls that touch",
            [-0.5, 0.5]
                .map(|x| Part::glass(icosphere(4), 1.5).placed(DAffine3::from_translation(DVec3::X * x) * scaled(0.5)))
                .into(),
        ),
    ] {
        let picture = device.picture(&scene(parts), Shot { depth: 24, ..shot() });
        let pixels = picture.radiance.iter().zip(&picture.discarded);
        let lack = pixels.map(|(value, cut)| (value + *cut - 1.0).abs().max_element()).fold(0.0, f64::max);
        println!("{name}: 1 within {lack:.1e}, {:.1e} discarded", picture.most_discarded());
        assert!(lack < 1e-5, "{name}: {lack:e}");
    }
    device.verdict();
}

/// A body that is there twice is there once.
#[test]
fn twice_the_same_body_is_one() {
    let Some(device) = Device::open() else { return };
    let cube = || Part::glass(cuboid(-DVec3::splat(0.6), DVec3::splat(0.6)), 1.5);
    let [one, two] = [vec![cube()], vec![cube(), cube()]].map(|parts| {
        let mut scene = in_the_city(scene(parts));
        scene.camera.position = DVec3::new(1.3, 1.7, 3.0);
        device.picture(&scene, shot())
    });
    let (rmse, differing) = (one.rmse(&two), one.differing(&two, 1e-2));
    println!("twice the same cube: RMSE {rmse:.1e}, {differing} pixels differ");
    assert!(differing < 30, "{rmse:e}, {differing}");
    device.verdict();
}

#[test]
fn a_camera_in_nested_bodies_is_in_the_higher_one() {
    let Some(device) = Device::open() else { return };
    for (priority, expected) in [(0, 1.33 * 1.33), (1, 2.25)] {
        let outer = Part::of(icosphere(4), of_priority(priority, 1.5));
        let mut scene = scene([Part::glass(icosphere(3), 1.33).placed(scaled(0.5)), outer]);
        scene.camera.position = DVec3::new(0.1, 0.05, 0.2);
        let picture = device.picture(&scene, shot());
        for (value, cut) in picture.radiance.iter().zip(&picture.discarded) {
            let lack = (value + *cut) / expected - 1.0;
            assert!(lack.abs().max_element() < 1e-5, "{lack}");
        }
    }
    device.verdict();
}

/// Each way through one of two bodies is through the one that is there: their absorption says which.
#[test]
fn light_is_absorbed_by_the_body_that_is_there() {
    let Some(device) = Device::open() else { return };
    let colored = |color: DVec3, priority| {
        let glass = Dielectric { attenuation_color: color, attenuation_distance: 1.0, priority, ..glass(1.0) };
        Surface::Dielectric(glass)
    };
    let (red, blue) = (DVec3::new(1.0, 0.5, 0.25), DVec3::new(0.25, 0.5, 1.0));
    let body = |top, bottom| cuboid(DVec3::new(-9.0, -9.0, bottom), DVec3::new(9.0, 9.0, top));
    for (priorities, lengths) in [([1, 0], [2.0, 1.0]), ([0, 1], [1.0, 2.0])] {
        let parts = [
            Part::of(body(-1.0, -3.0), colored(red, priorities[0])),
            Part::of(body(-2.0, -4.0), colored(blue, priorities[1])),
        ];
        let mut scene = scene(parts);
        (scene.camera.position, scene.camera.target) = (DVec3::new(0.1, 0.07, 1.0), DVec3::new(0.1, 0.07, 0.0));
        let size = Size { width: 9, height: 9 };
        let picture = device.picture(&scene, Shot { size, ..shot() });
        let expected = red.powf(lengths[0]) * blue.powf(lengths[1]);
        let error = (picture.radiance[40] / expected - 1.0).abs().max_element();
        println!("priorities {priorities:?}: relative error {error:.1e}");
        // Three lengths, each by a device's own exp.
        assert!(error < 2e-5, "{priorities:?}: {}, expected {expected}", picture.radiance[40]);
    }
    device.verdict();
}
