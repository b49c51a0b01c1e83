//! The referee itself, against what is known exactly: energy, single rays through slabs, prisms and balls, stacks of
//! media.

use fastrand::Rng;
use glam::{DAffine3, DVec2, DVec3};

use vitrum::optics::fresnel::fresnel_dielectric;
use vitrum::options::Size;
use vitrum::scene::{Dielectric, Dispersion, Scene, Surface, Surroundings};

use crate::bodies::{asset, in_the_city};
use crate::closest::Triangles;
use crate::common::reference::environment_radiance;
use crate::reference::{End, LEAST_COSINE, Leaf, Referee, Sample, Settings};
use crate::shapes::{Part, bumpy, cuboid, glass, hollow_ball, icosphere, prism, scene};

const SMALL: Size = Size { width: 32, height: 24 };

/// The ends of the tree behind a ray from outside of everything.
fn leaves(referee: &Referee, origin: DVec3, direction: DVec3) -> Vec<Leaf> {
    let mut leaves = Vec::new();
    referee.grow(origin, direction.normalize(), &[], &mut |leaf| leaves.push(*leaf));
    leaves.sort_by(|a, b| b.throughput.x.total_cmp(&a.throughput.x));
    leaves
}

/// The end of the ray that is refracted twice and reflected nowhere, which takes most of the light.
fn straight_through(scene: &Scene, settings: Settings, origin: DVec3, direction: DVec3) -> Leaf {
    let leaf = leaves(&Referee::new(scene, settings), origin, direction)[0];
    assert_eq!((leaf.interfaces, leaf.end), (2, End::Environment));
    leaf
}

fn center(size: Size) -> DVec2 {
    0.5 * DVec2::new(size.width.into(), size.height.into())
}

#[test]
fn no_light_is_lost_or_made_in_a_white_furnace() {
    let diamond = Part { smooth: false, ..Part::glass(asset("diamond.obj"), 2.42) };
    for (name, part) in [
        ("ball", Part::glass(icosphere(3), 1.5)),
        ("flat ball", Part { smooth: false, ..Part::glass(icosphere(2), 1.5) }),
        ("coarse ball", Part::glass(icosphere(0), 1.8)),
        ("hollow ball", Part::glass(hollow_ball(3, 0.1), 1.5)),
        ("bubble of air in water", Part::glass(icosphere(3), 1.0 / 1.33)),
        ("prism", Part::glass(asset("prism.obj"), 1.5168)),
        ("made prism", Part::glass(prism(1.0, 1.5), 1.5168)),
        ("slab", Part::glass(asset("slab.obj"), 1.5)),
        ("diamond", diamond),
        ("tumbler", Part::glass(asset("cup_tumbler.obj"), 1.5)),
        ("bumpy", Part::glass(bumpy(2000), 1.5)),
    ] {
        let scene = scene([part]);
        let settings = Settings { max_depth: 24, cutoff: 1e-6, ..Settings::default() };
        let mut rays = 0;
        for nesting in [true, false] {
            for sample in Referee::new(&scene, Settings { nesting, ..settings }).picture(SMALL, &[DVec2::ZERO]) {
                for value in sample.radiance.to_array() {
                    let lack = value + sample.discarded - 1.0;
                    assert!(lack.abs() < 1e-12, "{name}: {value} + {} = 1 + {lack:e}", sample.discarded);
                }
                rays += sample.rays;
            }
        }
        println!("{name}: {:.1} rays a pixel", rays as f64 / 2.0 / f64::from(SMALL.width * SMALL.height));
        assert!(rays > 2000, "{name}: {rays} rays");
    }
}

#[test]
fn what_is_discarded_falls_with_the_depth_and_the_cutoff() {
    let scene = scene([Part::glass(icosphere(4), 1.5)]);
    let discarded = |max_depth, cutoff| {
        let settings = Settings { max_depth, cutoff, ..Settings::default() };
        let sample = Referee::new(&scene, settings).sample(SMALL, center(SMALL) + DVec2::new(3.0, 2.0));
        assert!((sample.radiance.x + sample.discarded - 1.0).abs() < 1e-12);
        sample.discarded
    };
    assert_eq!(discarded(0, 1e-9), 1.0);
    let depths = [1, 2, 3, 4, 8, 16].map(|depth| discarded(depth, 1e-30));
    assert!(depths.is_sorted_by(|a, b| a > b) && depths[5] < 1e-8, "{depths:?}");
    let cutoffs = [1e-1, 1e-2, 1e-4, 1e-6].map(|cutoff| discarded(32, cutoff));
    assert!(cutoffs.is_sorted_by(|a, b| a > b) && cutoffs[3] < 1e-6, "{cutoffs:?}");
}

#[test]
fn glass_of_index_one_is_the_environment() {
    let mut parts = vec![Part::glass(icosphere(3), 1.0), Part::glass(hollow_ball(2, 0.2), 1.0)];
    parts[1].transform = DAffine3::from_translation(DVec3::new(0.5, 0.1, 0.8));
    let scene = in_the_city(scene(parts));
    for nesting in [true, false] {
        let referee = Referee::new(&scene, Settings { nesting, ..Settings::default() });
        let pixels = referee.picture(SMALL, &[DVec2::ZERO]);
        for (sample, i) in pixels.iter().zip(0..) {
            let point = DVec2::new(f64::from(i % SMALL.width) + 0.5, f64::from(i / SMALL.width) + 0.5);
            let expected = environment_radiance(&scene.environment, referee.ray(SMALL, point));
            assert_eq!((sample.radiance, sample.interfaces), (expected, 0.0));
        }
        assert!(pixels.iter().any(|sample| sample.rays > 4));
    }
}

#[test]
fn a_camera_in_glass_sees_the_square_of_its_index() {
    let mut scene = scene([Part::glass(icosphere(3), 1.5)]);
    for (position, expected) in [(DVec3::new(0.2, -0.1, 0.3), 2.25), (DVec3::new(0.2, -0.1, 1.3), 1.0)] {
        scene.camera.position = position;
        for nesting in [true, false] {
            let settings = Settings { max_depth: 64, nesting, ..Settings::default() };
            for sample in Referee::new(&scene, settings).picture(SMALL, &[DVec2::ZERO]) {
                let lack = sample.radiance / expected + sample.discarded - 1.0;
                assert!(lack.abs().max_element() < 1e-12, "{lack}");
            }
        }
    }
}

#[test]
fn a_slab_shifts_a_ray() {
    let (thickness, ior) = (0.125, 1.5);
    let slab = cuboid(DVec3::new(-8.0, -8.0, -thickness), DVec3::new(8.0, 8.0, 0.0));
    let scene = scene([Part::glass(slab, ior)]);
    for degrees in [0.0_f64, 20.0, 45.0, 60.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let (origin, direction) = (DVec3::new(-sine, 0.05, cosine), DVec3::new(sine, 0.0, -cosine));
        let leaf = straight_through(&scene, Settings::default(), origin, direction);
        assert!(leaf.direction.distance(direction) < 1e-14);
        let shift = (leaf.position - origin).cross(direction).length();
        let expected = thickness * sine * (1.0 - cosine / (ior * ior - sine * sine).sqrt());
        assert!((shift - expected).abs() < 1e-14, "{degrees}: {shift}, expected {expected}");
        let through = fresnel_dielectric(cosine, 1.0, ior).transmittance.powi(2);
        assert!((leaf.throughput.x - through).abs() < 1e-14);
    }
}

#[test]
fn a_prism_deviates_least_where_the_ray_is_symmetric() {
    let glass = Dielectric { dispersion: Dispersion::Khr(20.0 / 64.17), ..glass(1.5168) };
    for apex in [0.3_f64, 0.8, 60.0_f64.to_radians()] {
        let part = Part::of(prism(apex, 4.0), Surface::Dielectric(glass.clone()));
        let scene = scene([part]);
        for wavelength in [None, Some(450.0), Some(650.0)] {
            let ior = wavelength.map_or(glass.ior, |wavelength| glass.index_at(wavelength));
            let deviation = |turned: f64| {
                // Symmetric: along +x inside, so that it falls in from below by half of the deviation.
                let angle = (ior * (apex / 2.0).sin()).asin() - apex / 2.0 + turned;
                let middle = DVec3::new(-0.5 * (apex / 2.0).sin(), 1.0 - 0.5 * (apex / 2.0).cos(), 0.0);
                let direction = DVec3::new(angle.cos(), angle.sin(), 0.0);
                let settings = Settings { wavelength, ..Settings::default() };
                let leaf = straight_through(&scene, settings, middle - direction, direction);
                leaf.direction.angle_between(direction)
            };
            let expected = 2.0 * (ior * (apex / 2.0).sin()).asin() - apex;
            let least = deviation(0.0);
            // Corners are rounded to 32 bits.
            assert!((least - expected).abs() < 1e-6, "{apex} {ior}: {least}, expected {expected}");
            assert!(deviation(0.05) > least + 1e-6 && deviation(-0.05) > least + 1e-6);
        }
    }
}

/// Interpolated normals make a ball of triangles one: a ray turns by i - t on entry and as much again on exit.
#[test]
fn a_ball_of_triangles_deviates_a_ray_as_a_ball() {
    let scene = scene([Part::glass(icosphere(6), 1.5)]);
    for height in [0.0, 0.3, 0.6, 0.9] {
        let origin = DVec3::new(0.6, 0.0, 0.8) * height + DVec3::new(0.0, 3.0, 0.0);
        let leaf = straight_through(&scene, Settings::default(), origin, DVec3::NEG_Y);
        let expected = 2.0 * (height.asin() - (height / 1.5).asin());
        let found = leaf.direction.angle_between(DVec3::NEG_Y);
        assert!((found - expected).abs() < 1e-3, "{height}: {found}, expected {expected}");
    }
}

#[test]
fn a_slab_absorbs_as_beer_and_lambert_say() {
    let (color, distance, thickness) = (DVec3::new(0.5, 0.9, 1.0), 0.25, 0.125);
    let glass = Dielectric { attenuation_color: color, attenuation_distance: distance, ..glass(1.5) };
    let slab = cuboid(DVec3::new(-8.0, -8.0, -thickness), DVec3::new(8.0, 8.0, 0.0));
    let scene = scene([Part::of(slab, Surface::Dielectric(glass))]);
    for nesting in [true, false] {
        let settings = Settings { cutoff: 1e-16, nesting, ..Settings::default() };
        for degrees in [0.0_f64, 50.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let origin = DVec3::new(-sine, 0.05, cosine);
            let sample = Referee::new(&scene, settings).look(origin, DVec3::new(sine, 0.0, -cosine), &[]);
            let face = fresnel_dielectric(cosine, 1.0, 1.5);
            let expected = color.to_array().map(|color| {
                // Once across; reflected on entry, and the two series of what leaves on either side.
                let once = color.powf(thickness / face.cos_theta_t / distance);
                let (r, t) = (face.reflectance, face.transmittance);
                r + t * t * once * (1.0 + r * once) / (1.0 - (r * once).powi(2))
            });
            let error = (sample.radiance - DVec3::from_array(expected)).abs().max_element();
            assert!(error < 1e-13, "{degrees}: {error:e}");
        }
    }
}

/// Reflectance and transmittance of layers of these indices at normal incidence, by adding.
fn stack(indices: &[f64]) -> (f64, f64) {
    let interfaces = indices.windows(2).map(|pair| fresnel_dielectric(1.0, pair[0], pair[1]));
    // From below: what the rest reflects.
    interfaces.rev().fold((0.0, 1.0), |(r, t), face| {
        let loops = 1.0 - face.reflectance * r;
        (face.reflectance + face.transmittance.powi(2) * r / loops, face.transmittance * t / loops)
    })
}

/// A ray along -z comes back from `scene` and passes through it as it does with layers of these indices.
fn is_stack(name: &str, scene: &Scene, indices: &[f64]) {
    let referee = Referee::new(scene, Settings { cutoff: 1e-11, max_depth: 64, ..Settings::default() });
    let (mut back, mut through, mut cut) = (0.0, 0.0, 0.0);
    for leaf in leaves(&referee, DVec3::new(0.1, 0.05, 30.0), DVec3::NEG_Z) {
        *match leaf.end {
            End::Environment if leaf.direction.z == 1.0 => &mut back,
            End::Environment if leaf.direction.z == -1.0 => &mut through,
            _ => &mut cut,
        } += leaf.throughput.x;
    }
    let (r, t) = stack(indices);
    assert!(cut < 1e-7, "{name}: {cut} cut");
    for (found, expected) in [(back, r), (through, t)] {
        assert!((found - expected).abs() < cut + 1e-13, "{name}: {found}, expected {expected}, {cut} cut");
    }
}

fn layer(top: f64, bottom: f64, priority: i32, ior: f64) -> Part {
    let mesh = cuboid(DVec3::new(-8.0, -8.0, bottom), DVec3::new(8.0, 8.0, top));
    Part::of(mesh, Surface::Dielectric(Dielectric { priority, ..glass(ior) }))
}

#[test]
fn where_bodies_overlap_the_higher_one_is() {
    for (name, parts, indices) in [
        ("one", vec![layer(2.0, 0.0, 0, 1.5)], vec![1.0, 1.5, 1.0]),
        ("priority", vec![layer(3.0, 1.0, 1, 1.33), layer(2.0, 0.0, 0, 1.5)], vec![1.0, 1.33, 1.5, 1.0]),
        ("the other", vec![layer(3.0, 1.0, 0, 1.33), layer(2.0, 0.0, 1, 1.5)], vec![1.0, 1.33, 1.5, 1.0]),
        ("hidden", vec![layer(2.0, 1.0, 0, 1.33), layer(3.0, 0.0, 1, 1.5)], vec![1.0, 1.5, 1.0]),
        ("smaller", vec![layer(2.0, 1.0, 0, 1.33), layer(3.0, 0.0, 0, 1.5)], vec![1.0, 1.5, 1.33, 1.5, 1.0]),
        ("smaller first", vec![layer(3.0, 0.0, 0, 1.5), layer(2.0, 1.0, 0, 1.33)], vec![1.0, 1.5, 1.33, 1.5, 1.0]),
        ("later", vec![layer(2.0, 0.0, 0, 1.5), layer(3.0, 1.0, 0, 1.33)], vec![1.0, 1.33, 1.5, 1.0]),
        ("of one index", vec![layer(2.0, 0.0, 1, 1.5), layer(3.0, 1.0, 0, 1.5)], vec![1.0, 1.5, 1.0]),
        ("apart", vec![layer(1.0, 0.0, 1, 1.5), layer(3.0, 2.0, 0, 1.8)], vec![1.0, 1.8, 1.0, 1.5, 1.0]),
        (
            "three",
            vec![layer(4.0, 0.0, 0, 1.8), layer(3.0, 1.0, 0, 1.5), layer(5.0, 2.0, 1, 1.2)],
            vec![1.0, 1.2, 1.5, 1.8, 1.0],
        ),
    ] {
        is_stack(name, &scene(parts), &indices);
    }
}

#[test]
fn bodies_of_one_size_are_decided_by_the_later_one() {
    for (first, second, indices) in [(1.33, 1.5, [1.0, 1.33, 1.5, 1.0]), (1.5, 1.33, [1.0, 1.5, 1.33, 1.0])] {
        let overlapping = scene([layer(3.0, 1.0, 0, first), layer(2.0, 0.0, 0, second)]);
        // Absorption in the overlap only through the second.
        let mut absorbing = overlapping.clone();
        let Surface::Dielectric(glass) = &mut absorbing.materials[1].surface else { unreachable!() };
        (glass.attenuation_color, glass.attenuation_distance) = (DVec3::splat(0.5), 2.0);
        is_stack("overlapping", &overlapping, &indices);
        let referee = Referee::new(&absorbing, Settings::default());
        let strongest = leaves(&referee, DVec3::new(0.1, 0.05, 30.0), DVec3::NEG_Z)[0].throughput.x;
        let unattenuated = indices.windows(2).map(|pair| fresnel_dielectric(1.0, pair[0], pair[1]).transmittance);
        // Both lengths of the second layer, 2 m, are of the second body.
        assert!((strongest / unattenuated.product::<f64>() - 0.5).abs() < 1e-12);
    }
}

#[test]
fn a_camera_in_a_nested_body_is_in_the_higher_one() {
    let inner = Part::glass(icosphere(2), 1.33).placed(DAffine3::from_scale(DVec3::splat(0.5)));
    for (priority, expected) in [(0, 1.33), (1, 1.5)] {
        let outer = Part::of(icosphere(3), Surface::Dielectric(Dielectric { priority, ..glass(1.5) }));
        let mut scene = scene([inner.clone(), outer]);
        scene.camera.position = DVec3::new(0.1, 0.05, 0.2);
        for sample in
            Referee::new(&scene, Settings { cutoff: 1e-6, ..Settings::default() }).picture(SMALL, &[DVec2::ZERO])
        {
            let lack = sample.radiance.x / (expected * expected) + sample.discarded - 1.0;
            assert!(lack.abs() < 1e-12, "{lack:e}");
        }
    }
}

#[test]
fn a_pane_has_no_inside() {
    let mesh = cuboid(DVec3::new(-80.0, -80.0, -1.0), DVec3::new(80.0, 80.0, 0.0));
    let glass =
        Dielectric { thin_walled: true, attenuation_color: DVec3::ZERO, attenuation_distance: 0.1, ..glass(1.5) };
    let mut pane = scene([Part::of(mesh, Surface::Dielectric(glass))]);
    let direction = DVec3::new(0.6, 0.0, -0.8);
    for nesting in [true, false] {
        let referee = Referee::new(&pane, Settings { nesting, cutoff: 1e-16, ..Settings::default() });
        let found = leaves(&referee, DVec3::new(-0.6, 0.05, 0.8), direction);
        let once = fresnel_dielectric(0.8, 1.0, 1.5).reflectance;
        let reflected = 2.0 * once / (1.0 + once);
        let shares =
            |sign: f64| found.iter().filter(move |leaf| leaf.direction.z * sign > 0.0).map(|leaf| leaf.throughput.x);
        // Two panes, one behind the other.
        let back = reflected + (1.0 - reflected).powi(2) * reflected / (1.0 - reflected * reflected);
        assert!((shares(1.0).sum::<f64>() - back).abs() < 1e-14);
        assert!((shares(-1.0).sum::<f64>() - (1.0 - back)).abs() < 1e-14);
        assert!(found.iter().all(|leaf| leaf.direction.with_z(0.0).distance(direction.with_z(0.0)) < 1e-14));
    }
    pane.camera.position.z = -0.5;
    assert!(Referee::new(&pane, Settings::default()).inside(pane.camera.position).is_empty());
}

#[test]
fn opaque_bodies_show_what_they_emit_and_nothing_else() {
    let lamp = Part::emitter(icosphere(3), DVec3::new(2.0, 3.0, 4.0)).placed(DAffine3::from_scale(DVec3::splat(0.4)));
    let alone = scene([lamp.clone()]);
    let sample = Referee::new(&alone, Settings::default()).sample(SMALL, center(SMALL));
    assert_eq!((sample.radiance, sample.rays), (DVec3::new(2.0, 3.0, 4.0), 1));
    // In glass: what it emits there is spread over a wider cone outside.
    let mut enclosed = scene([lamp, Part::glass(icosphere(5), 1.5)]);
    enclosed.environment.light = Surroundings::Color(DVec3::ZERO);
    enclosed.camera.position = DVec3::new(0.0, 0.0, 4.0);
    let sample = Referee::new(&enclosed, Settings::default()).sample(SMALL, center(SMALL));
    assert!((sample.radiance.x - 2.0 * 0.96 / 2.25).abs() < 1e-3, "{}", sample.radiance);
}

#[test]
fn an_environment_that_is_not_visible_is_black_to_the_camera_alone() {
    let mut scene = scene([Part::glass(icosphere(3), 1.5)]);
    scene.environment.visible = false;
    let referee = Referee::new(&scene, Settings::default());
    assert_eq!(referee.sample(SMALL, DVec2::new(0.5, 0.5)).radiance, DVec3::ZERO);
    assert!(referee.sample(SMALL, center(SMALL)).radiance.x > 0.99);
}

#[test]
fn a_mirrored_scene_gives_the_mirrored_picture() {
    let mirror = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
    let turn = DAffine3::from_rotation_y(0.3);
    let aside = DAffine3::from_translation(DVec3::new(2.0, 2.0, -3.0));
    for smooth in [true, false] {
        let picture = |mirror: DAffine3| {
            let body = Part { smooth, ..Part::glass(bumpy(2000), 1.5) };
            let lamp = Part::emitter(icosphere(2), DVec3::X);
            let scene = scene([body.placed(mirror * turn), lamp.placed(mirror * aside)]);
            let settings = Settings { cutoff: 1e-4, ..Settings::default() };
            Referee::new(&scene, settings).picture(SMALL, &[DVec2::ZERO])
        };
        let (one, other) = (picture(DAffine3::IDENTITY), picture(mirror));
        let mirrored = other.chunks(SMALL.width as usize).flat_map(|row| row.iter().rev());
        let worst = one.iter().zip(mirrored).map(|(a, b)| a.radiance.distance(b.radiance)).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{worst}");
    }
}

#[test]
fn bent_normals_keep_their_rule() {
    let scene = scene([Part::glass(icosphere(0), 1.5)]);
    let referee = Referee::new(&scene, Settings::default());
    let mut rng = Rng::with_seed(3);
    let mut random = || DVec3::from_array(std::array::from_fn(|_| rng.f64() * 2.0 - 1.0));
    let mut bent = [0; 3];
    for _ in 0..20_000 {
        let (origin, direction) = (1.2 * random(), random().normalize());
        let Some(hit) = referee.triangles.closest(origin, direction, None) else { continue };
        let met = referee.meet(hit, origin, direction);
        let w = -direction;
        assert!(met.ng.dot(w) > 0.0 && (met.ns.length() - 1.0).abs() < 1e-14);
        let ns = met.shading_normal(w);
        let (index_i, index_t) = if met.front { (1.0, 1.5) } else { (1.5, 1.0) };
        let mirrored = met.reflected(w, ns);
        let refracted = met.refracted(w, ns, index_i, index_t);
        // The step is made before normalisation, which can take a little away again.
        let least = 0.49 * LEAST_COSINE;
        assert!(ns.dot(w) > least && mirrored.dot(met.ng) > least);
        assert!(refracted.is_none_or(|refracted| refracted.dot(met.ng) < -least));
        bent[0] += u32::from(ns != met.ns);
        bent[1] += u32::from(mirrored.distance(2.0 * w.dot(ns) * ns - w) > 1e-12);
        bent[2] += u32::from(refracted.is_some_and(|t| t.dot(met.ng) > -2.0 * LEAST_COSINE));
    }
    println!("bent normals, reflected and refracted directions: {bent:?}");
    assert!(bent.iter().all(|&count| count > 10), "{bent:?}");
}

#[test]
fn the_boxes_lose_no_hit_and_closed_bodies_no_ray() {
    for part in [
        Part::glass(bumpy(10_000), 1.5),
        Part::glass(hollow_ball(3, 0.05), 1.5),
        Part::glass(asset("diamond.obj"), 2.4),
    ] {
        let scene = scene([part]);
        let triangles = Triangles::new(&scene);
        let mut rng = Rng::with_seed(5);
        for i in 0..2000 {
            let mut random = || DVec3::from_array(std::array::from_fn(|_| rng.f64() * 2.0 - 1.0));
            // From inside, from outside, and through corners and the middles of edges.
            let origin = if i % 2 == 0 { 0.1 * random() } else { 3.0 * random().normalize() };
            let [a, b, c] = triangles.all[i * 7 % triangles.all.len()].corners;
            let target = [a, 0.5 * (a + b), 0.5 * (b + c), 0.9 * random()][i % 4];
            let direction = (target - origin).normalize();
            let hit = triangles.closest(origin, direction, None);
            assert_eq!(hit, triangles.closest_of_all(origin, direction, None));
            assert!(hit.is_some() || i % 2 == 1, "{origin} {direction}");
        }
    }
    // Along the axes, in the planes of boxes and through the diagonals of faces.
    let boxes = scene([Part::glass(cuboid(DVec3::splat(-1.0), DVec3::ONE), 1.5)]);
    let triangles = Triangles::new(&boxes);
    for direction in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
        for at in [DVec3::ZERO, DVec3::splat(0.25), DVec3::ONE] {
            let across = at - at.dot(direction) * direction;
            let hit = triangles.closest(across - 3.0 * direction, direction, None);
            assert_eq!(hit.map(|hit| hit.distance), Some(2.0), "{direction} {at}");
        }
    }
}

#[test]
fn shapes_are_closed_and_of_the_size_that_was_asked_for() {
    for (mesh, triangles) in [
        (icosphere(4), 20 * 256),
        (hollow_ball(3, 0.1), 40 * 64),
        (cuboid(-DVec3::ONE, DVec3::ONE), 12),
        (prism(1.0, 1.0), 8),
        (bumpy(10_000), 10_000),
        (bumpy(100_000), 100_000),
    ] {
        assert!(mesh.faults.is_empty(), "{}: {}", mesh.name, mesh.faults);
        let count = mesh.triangles.len();
        assert!(count.abs_diff(triangles) * 20 <= triangles, "{}: {count} triangles", mesh.name);
        let unit = |normal: &[f32; 3]| (DVec3::from_array(normal.map(f64::from)).length() - 1.0).abs() < 1e-7;
        assert!(mesh.normals.iter().all(unit));
    }
    assert!((icosphere(0).winding_number(DVec3::ZERO) - 1.0).abs() < 1e-12);
    assert!(hollow_ball(2, 0.1).winding_number(DVec3::ZERO).abs() < 1e-12);
    assert!((hollow_ball(4, 0.1).winding_number(DVec3::new(0.95, 0.0, 0.0)) - 1.0).abs() < 1e-12);
}

#[test]
fn signatures_tell_trees_apart() {
    let scene = scene([Part::glass(bumpy(10_000), 1.5)]);
    let referee = Referee::new(&scene, Settings { cutoff: 1e-4, signature_floor: 1e-2, ..Settings::default() });
    let signatures = |shift: f64| -> Vec<_> {
        referee.picture(SMALL, &[DVec2::splat(shift)]).iter().map(|sample: &Sample| sample.signature).collect()
    };
    let still = signatures(0.0);
    let same = |shift| signatures(shift).iter().zip(&still).filter(|(a, b)| a == b).count();
    let (none, little, much) = (same(0.0), same(1e-7), same(0.2));
    println!("of {}: {none}, {little}, {much} trees are the same", still.len());
    assert!(none == still.len() && little > still.len() * 9 / 10 && much < little);
}

/// How fast the referee is; run alone.
#[test]
#[ignore = "a measurement: prints figures of docs/tree.md and checks nothing"]
fn speed() {
    let size = Size { width: 128, height: 96 };
    for triangles in [10_000, 100_000, 1_000_000] {
        let scene = in_the_city(scene([Part::glass(bumpy(triangles), 1.5)]));
        for cutoff in [1e-2, 1e-4, 1e-9] {
            let started = std::time::Instant::now();
            let referee = Referee::new(&scene, Settings { cutoff, ..Settings::default() });
            let built = started.elapsed();
            let rays: u64 = referee.picture(size, &[DVec2::ZERO]).iter().map(|sample| sample.rays).sum();
            println!(
                "{triangles} triangles, cut-off {cutoff:e}: built in {built:.2?}, {rays} rays in {:.2?}",
                started.elapsed() - built
            );
        }
    }
}
