//! The device in limits that are known exactly: single rays through slabs and prisms, total reflection, absorption, panes
//! that get thinner.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec2, DVec3};

use vitrum::optics::fresnel::{fresnel_dielectric, refract};
use vitrum::options::Size;
use vitrum::scene::{Camera, Dielectric, Panorama, Scene, Surface, Surroundings};

use crate::bodies::{in_the_city, thin};
use crate::device::{Device, Picture, Shot};
use crate::reference::{Referee, Settings};
use crate::shapes::{Part, block, cuboid, glass, hollow_ball, icosphere, prism, rectangle, scene};

/// Only what is refracted; nothing else adds to the picture.
const THROUGH: &str = "auto,-reflection";

/// A look from `position` towards `target`, of that vertical angle in degrees.
fn seen(scene: Scene, position: DVec3, target: DVec3, degrees: f64) -> Scene {
    let up = if position.x == target.x && position.z == target.z { DVec3::Z } else { DVec3::Y };
    Scene { camera: Camera { position, target, up, vertical_fov: degrees.to_radians() }, ..scene }
}

/// A body so wide that no side of it is seen, from the plane at `back` to that at `front`.
fn wide(back: f64, front: f64) -> vitrum::scene::Mesh {
    cuboid(DVec3::new(-8.0, -8.0, back), DVec3::new(8.0, 8.0, front))
}

/// The rays of the pixels, in their order.
fn rays(scene: &Scene, size: Size) -> Vec<DVec3> {
    let referee = Referee::new(scene, Settings::default());
    let centre = |i: u32| DVec2::new(f64::from(i % size.width) + 0.5, f64::from(i / size.width) + 0.5);
    (0..size.width * size.height).map(|i| referee.ray(size, centre(i))).collect()
}

/// Surroundings whose radiance says in which direction they were seen: the direction, moved by 2 in each coordinate.
fn directions() -> Surroundings {
    let (width, height) = (2048, 1024);
    let texel = |i: u32| {
        let azimuth = (f64::from(i % width) + 0.5) / f64::from(width) * TAU;
        let (sine, cosine) = ((f64::from(i / width) + 0.5) / f64::from(height) * PI).sin_cos();
        let direction = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
        (direction + 2.0).as_vec3().to_array()
    };
    Surroundings::Image(Panorama::new(width, height, (0..width * height).map(texel).collect()))
}

/// The directions in which light leaves that is nowhere reflected, and its share; `None` where nothing arrives.
fn directions_through(device: &Device, scene: &Scene, shot: Shot) -> Vec<Option<(DVec3, f64)>> {
    let shot = Shot { effects: THROUGH, ..shot };
    let white = device.picture(scene, shot);
    let mut coded = scene.clone();
    coded.environment.light = directions();
    let coded = device.picture(&coded, shot);
    let pixels = coded.radiance.iter().zip(&white.radiance).zip(&white.discarded);
    pixels
        .map(|((code, white), &cut)| (cut == 0.0 && white.x > 0.0).then(|| (*code / white.x - 2.0, white.x)))
        .collect()
}

#[test]
fn directions_are_told_by_the_surroundings() {
    let Some(device) = Device::open() else { return };
    let empty = scene([]);
    let found = directions_through(&device, &empty, Shot::default());
    let worst = found
        .iter()
        .zip(rays(&empty, Shot::default().size))
        .map(|(found, ray)| found.expect("nothing is cut off").0.distance(ray));
    let worst = worst.fold(0.0, f64::max);
    println!("directions within {worst:.1e}");
    assert!(worst < 3e-6, "{worst:e}");
    device.verdict();
}

/// Behind the slab a wedge of index 1 absorbs: how much says where the ray crosses it.
#[test]
fn a_slab_shifts_rays_and_does_not_turn_them() {
    let Some(device) = Device::open() else { return };
    let (thickness, ior, back, slope, absorption) = (0.5, 1.5, -3.0, 0.1, 0.5_f64);
    // From a plane at `back` to one that falls away along x.
    let wedge = block(std::array::from_fn(|i| {
        let (x, y) = (if i & 1 == 0 { -8.0 } else { 8.0 }, if i & 2 == 0 { -8.0 } else { 8.0 });
        DVec3::new(x, y, if i & 4 == 0 { back - slope * (x + 9.0) } else { back })
    }));
    let dark =
        Dielectric { attenuation_color: DVec3::splat((-absorption).exp()), attenuation_distance: 1.0, ..glass(1.0) };
    let slab = Part::glass(wide(-thickness, 0.0), ior);
    let scene = scene([slab.clone(), Part::of(wedge, Surface::Dielectric(dark))]);
    let scene = seen(scene, DVec3::new(-1.5, 0.2, 1.0), DVec3::new(0.0, 0.0, -1.0), 20.0);
    let bare = Scene { objects: scene.objects[1..].to_vec(), ..scene.clone() };
    let clear = Scene { objects: scene.objects[..1].to_vec(), ..scene.clone() };
    let shot = Shot { cutoff: 1e-9, effects: THROUGH, ..Shot::default() };
    let [shifted, straight, clear_value] = [&scene, &bare, &clear].map(|scene| device.picture(scene, shot));
    let turned = directions_through(&device, &clear, shot);
    let (mut worst, mut most_turned, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (i, ray) in rays(&scene, shot.size).into_iter().enumerate() {
        let length = |picture: &Picture, clear: f64| -(picture.radiance[i].x / clear).ln() / absorption;
        let lengths = length(&shifted, clear_value.radiance[i].x) - length(&straight, 1.0);
        // The length in the wedge grows along x by this much.
        let rate = slope / (-ray.z - slope * ray.x);
        let inside = refract(-ray, DVec3::Z, 1.0, ior).expect("a ray inside");
        let expected = thickness * (inside.x / -inside.z - ray.x / -ray.z);
        worst = worst.max((lengths / rate - expected).abs());
        largest = largest.max(expected.abs());
        most_turned = most_turned.max(turned[i].expect("nothing is cut off").0.distance(ray));
    }
    println!("shifts of up to {largest:.3} m within {worst:.1e} m, directions within {most_turned:.1e}");
    assert!(worst < 1e-4 && largest > 0.1 && most_turned < 3e-6, "{worst:e} {largest} {most_turned:e}");
    device.verdict();
}

#[test]
fn a_prism_deviates_as_it_should_and_least_where_the_ray_is_symmetric() {
    let Some(device) = Device::open() else { return };
    let size = Size { width: 161, height: 1 };
    for (apex, ior) in [(60_f64.to_radians(), 1.5168), (0.5, 1.5168), (0.5, 2.0)] {
        let half: f64 = apex / 2.0;
        let least = 2.0 * (ior * half.sin()).asin() - apex;
        // Symmetric: along +x inside. The rays fan out from there by a tenth of a degree a pixel.
        let middle = DVec3::new(-0.5 * half.sin(), 1.0 - 0.5 * half.cos(), 0.0);
        let direction = DVec3::new((least / 2.0).cos(), (least / 2.0).sin(), 0.0);
        let scene = seen(scene([Part::glass(prism(apex, 4.0), ior)]), middle - 0.5 * direction, middle, 0.1);
        let scene = Scene { camera: Camera { up: DVec3::Z, ..scene.camera }, ..scene };
        let found = directions_through(&device, &scene, Shot { size, ..Shot::default() });
        let (mut worst, mut counted, mut minimum) = (0.0_f64, 0, f64::INFINITY);
        for (ray, found) in rays(&scene, size).into_iter().zip(found) {
            // Onto the left face and out of the right one, and nowhere near an edge.
            let normals = [DVec3::new(-half.cos(), half.sin(), 0.0), DVec3::new(half.cos(), half.sin(), 0.0)];
            let expected = refract(-ray, normals[0], 1.0, ior).and_then(|ray| refract(-ray, -normals[1], ior, 1.0));
            let (Some(expected), Some((found, _))) = (expected, found) else { continue };
            let deviation = found.angle_between(ray);
            if found.angle_between(expected) < 0.01 {
                worst = worst.max((deviation - expected.angle_between(ray)).abs());
                minimum = minimum.min(deviation);
                counted += 1;
            }
        }
        let error = (minimum - least).abs().to_degrees();
        let (least, worst) = (least.to_degrees(), worst.to_degrees());
        println!("{ior}: least deviation {least:.4} within {error:.1e}, all {counted} within {worst:.1e} degrees");
        assert!(error < 1e-3 && worst < 1e-3 && counted > 100, "{error:e} {worst:e} {counted}");
    }
    device.verdict();
}

#[test]
fn total_reflection_loses_nothing_in_a_thousand_interfaces() {
    let Some(device) = Device::open() else { return };
    let cube = scene([Part::glass(cuboid(-DVec3::ONE, DVec3::ONE), 1.5)]);
    // Towards a corner, every side is met at about 55 degrees; from 41.8 on they reflect totally.
    let cube = seen(cube, DVec3::new(0.1, 0.2, -0.3), DVec3::new(1.1, 1.2, 0.7), 4.0);
    let size = Size { width: 16, height: 12 };
    let picture = device.picture(&cube, Shot { size, depth: 1000, ..Shot::default() });
    for (i, value) in picture.radiance.iter().enumerate() {
        let whole = (*value + picture.discarded[i]) / 2.25;
        assert!((whole - 1.0).abs().max_element() < 1e-6, "pixel {i}: {whole}");
        assert_eq!(picture.interfaces[i], 1000.0, "pixel {i}");
        assert_eq!(picture.discarded[i], 2.25, "pixel {i}");
    }
    device.verdict();
}

/// A rod of glass guides everything that enters its end to the other one, hundreds of reflections along triangles that are two
/// hundred times as long as wide.
#[test]
fn a_light_guide_brings_light_to_its_end() {
    let Some(device) = Device::open() else { return };
    let rod = scene([Part::glass(cuboid(DVec3::new(-0.1, -0.1, -20.0), DVec3::new(0.1, 0.1, 0.0)), 1.5)]);
    // Not in the middle, from where many rays meet its edges.
    let rod = seen(rod, DVec3::new(0.0131, 0.0073, 0.1), DVec3::new(0.0, 0.0, -10.0), 70.0);
    let size = Size { width: 48, height: 48 };
    let (depth, cutoff) = (400, 1e-7);
    let referee = Referee::new(&rod, Settings { max_depth: depth, cutoff, ..Settings::default() });
    let expected = referee.picture(size, &[DVec2::ZERO]);
    for trace in device.tracers() {
        let picture = device.picture(&rod, Shot { size, depth, cutoff, trace: Some(trace), ..Shot::default() });
        let (mut other, mut most) = (0, 0);
        for (i, expected) in expected.iter().enumerate() {
            let whole = picture.radiance[i] + picture.discarded[i];
            assert!((whole - 1.0).abs().max_element() < 1e-5, "pixel {i}: {whole}");
            other += usize::from(picture.interfaces[i] != expected.events as f64);
            most = most.max(expected.events);
        }
        println!(
            "{trace:?}: {other} of {} rays are not guided as they should; up to {most} interfaces",
            expected.len()
        );
        assert!(other <= 5 && most > 300, "{trace:?}: {other} {most}");
    }
    device.verdict();
}

/// Beer and Lambert, and the sum of all orders of reflection between the faces.
#[test]
fn a_slab_absorbs_as_it_should() {
    let Some(device) = Device::open() else { return };
    let (color, distance, thickness) = (DVec3::new(0.5, 0.9, 1.0), 0.25, 0.125);
    let glass = Dielectric { attenuation_color: color, attenuation_distance: distance, ..glass(1.5) };
    let scene = scene([Part::of(wide(-thickness, 0.0), Surface::Dielectric(glass))]);
    let scene = seen(scene, DVec3::new(0.1, 0.05, 1.0), DVec3::new(0.1, 0.05, 0.0), 60.0);
    let size = Size { width: 33, height: 25 };
    for (effects, orders) in [("auto", f64::INFINITY), (THROUGH, 0.0)] {
        let picture = device.picture(&scene, Shot { size, depth: 64, cutoff: 1e-8, effects, ..Shot::default() });
        let (mut worst, mut straight) = (0.0_f64, 0.0_f64);
        for (i, ray) in rays(&scene, size).into_iter().enumerate() {
            let face = fresnel_dielectric(-ray.z, 1.0, 1.5);
            let (r, t) = (face.reflectance, face.transmittance);
            let expected = color.to_array().map(|color| {
                let once = color.powf(thickness / face.cos_theta_t / distance);
                match orders {
                    0.0 => t * t * once,
                    _ => r + t * t * once * (1.0 + r * once) / (1.0 - (r * once).powi(2)),
                }
            });
            let error = (picture.radiance[i] / DVec3::from_array(expected) - 1.0).abs().max_element();
            worst = worst.max(error);
            if i == picture.radiance.len() / 2 {
                straight = error;
            }
        }
        println!("{effects}: relative error {straight:.1e} at normal incidence, {worst:.1e} up to 38 degrees");
        assert!(straight < 1e-5 && worst < 1e-5, "{effects}: {straight:e} {worst:e}");
    }
    device.verdict();
}

#[test]
fn a_pane_is_the_sum_of_all_reflections_and_real_ones_are_as_thick_as_may_be() {
    let Some(device) = Device::open() else { return };
    let size = Size { width: 33, height: 25 };
    let look = |part| seen(scene([part]), DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.5, 0.1, 0.0), 70.0);
    let pane = look(Part::of(rectangle(60.0, 60.0), thin(1.5)));
    let rays = rays(&pane, size);
    let closed = |ray: DVec3| {
        let once = fresnel_dielectric(-ray.z, 1.0, 1.5).reflectance;
        2.0 * once / (1.0 + once)
    };
    // What is behind the camera is black: only what passes is seen.
    let half = |i: u32| if (64..192).contains(&(i % 256)) { [0.0; 3] } else { [1.0; 3] };
    let half = Surroundings::Image(Panorama::new(256, 128, (0..256 * 128).map(half).collect()));
    let worst = |scene: &Scene, trace, effects| {
        let mut scene = scene.clone();
        if effects == "auto" {
            scene.environment.light = half.clone();
        }
        let picture = device.picture(&scene, Shot { size, cutoff: 1e-9, effects, trace, ..Shot::default() });
        let errors = picture.radiance.iter().zip(&rays).map(|(value, &ray)| {
            let expected = if effects == "auto,-transmission" { closed(ray) } else { 1.0 - closed(ray) };
            // Near the border of black and white both are seen.
            if ray.x.abs() > 0.99 { 0.0 } else { (*value - expected).abs().max_element() }
        });
        errors.fold(0.0, f64::max)
    };
    let errors = ["auto,-transmission", THROUGH, "auto"].map(|effects| worst(&pane, None, effects));
    println!("a pane reflects, passes, and both: within {errors:?}");
    assert!(errors.iter().all(|&error| error < 1e-6), "{errors:?}");
    for (trace, thickness) in
        device.tracers().into_iter().flat_map(|trace| [0.1, 1e-2, 1e-3, 1e-4, 1e-5].map(|thickness| (trace, thickness)))
    {
        let slab = cuboid(DVec3::new(-30.0, -30.0, -thickness), DVec3::new(30.0, 30.0, 0.0));
        let error = worst(&look(Part::glass(slab, 1.5)), Some(trace), "auto");
        println!("{trace:?}, {thickness} m thick: within {error:.1e}");
        assert!(error < 1e-5, "{trace:?}, {thickness}: {error:e}");
    }
    device.verdict();
}

/// A wall that gets thinner becomes a pane, in the place and in the direction of light.
#[test]
fn thin_walls_become_panes() {
    let Some(device) = Device::open() else { return };
    let ball_of_pane = in_the_city(scene([Part::of(icosphere(4), thin(1.5))]));
    let plate = |half: f64| cuboid(DVec3::new(-1.0, -0.8, -half), DVec3::new(1.0, 0.8, half));
    let turn = DAffine3::from_rotation_y(0.5);
    let flat_pane = in_the_city(scene([Part::of(rectangle(2.0, 1.6), thin(1.5)).placed(turn)]));
    let shot = Shot { depth: 24, cutoff: 1e-4, ..Shot::default() };
    let panes = [&ball_of_pane, &flat_pane].map(|scene| device.picture(scene, shot));
    let mut before = [f64::INFINITY; 2];
    for wall in [1e-1, 1e-2, 1e-3, 1e-4] {
        let ball = in_the_city(scene([Part::glass(hollow_ball(4, wall), 1.5)]));
        let flat = in_the_city(scene([Part::glass(plate(wall / 2.0), 1.5).placed(turn)]));
        let pictures = [ball, flat].map(|scene| device.picture(&scene, shot));
        let errors = [0, 1].map(|i| pictures[i].rmse(&panes[i]));
        let lost = [0, 1].map(|i| pictures[i].most_discarded());
        println!("wall of {wall}: RMSE to panes: ball {:.1e}, plate {:.1e}; discarded {lost:?}", errors[0], errors[1]);
        assert!(errors[0] < 0.5 * before[0] && errors[1] < before[1], "{wall}: {errors:?} after {before:?}");
        before = errors;
    }
    assert!(before[0] < 2e-3 && before[1] < 2e-3, "{before:?}");
    // Where nothing is reflected, nothing is turned either.
    let ball = scene([Part::glass(hollow_ball(5, 1e-5), 1.5)]);
    let rays = rays(&ball, shot.size);
    let turned: Vec<_> = directions_through(&device, &ball, shot)
        .iter()
        .zip(rays)
        .filter_map(|(found, ray)| found.map(|(found, _)| found.normalize_or_zero().angle_between(ray)))
        .collect();
    let mean = turned.iter().sum::<f64>() / turned.len() as f64;
    println!(
        "a wall of 1e-5 turns rays by {mean:.1e} on average, {} of {} seen",
        turned.len(),
        shot.size.width * shot.size.height
    );
    assert!(mean < 1e-3, "{mean:e}");
    device.verdict();
}
