use std::path::Path;

use super::shape::Shape;
use super::*;
use crate::scene::Surface;
use crate::scene::{Material, Overrides};

/// Bodies of clear glass, each in a place of its own, seen from five metres away.
fn scene(bodies: Vec<(Shape, DAffine3)>) -> Scene {
    let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
    scene.camera.position = DVec3::new(0.0, 0.0, 5.0);
    scene.objects = (0..bodies.len())
        .map(|i| Object { mesh: i, material: i, number: i, transform: bodies[i].1, smooth: false })
        .collect();
    scene.materials = vec![Material::clear_glass(); bodies.len()];
    scene.meshes = bodies.into_iter().map(|(shape, _)| shape.mesh().into()).collect();
    scene
}

fn alone(shape: Shape) -> Scene {
    scene(vec![(shape, DAffine3::IDENTITY)])
}

const UNIT: ([f32; 3], [f32; 3]) = ([-0.5; 3], [0.5; 3]);

fn cube() -> Shape {
    Shape::cuboid(UNIT.0, UNIT.1)
}

/// The only thing that is wrong with the only object.
#[track_caller]
fn only(scene: &Scene) -> Finding {
    let found = scene.diagnose();
    assert!(found.len() == 1 && found[0].findings.len() == 1 && found[0].unfinished.is_empty(), "{found:#?}");
    found[0].findings[0]
}

#[track_caller]
fn is_well(scene: &Scene) {
    for found in scene.diagnose() {
        assert!(found.findings.is_empty() && found.unfinished.is_empty(), "{}: {found:#?}", scene.name);
    }
}

fn glass(scene: &mut Scene) -> &mut Dielectric {
    match &mut scene.materials[0].surface {
        Surface::Dielectric(glass) => glass,
        Surface::Opaque(_) => panic!("clear glass is no opaque material"),
    }
}

#[test]
fn sound_bodies_are_well() {
    is_well(&alone(cube()));
    is_well(&alone(Shape::ball(4, 1.0)));
    is_well(&alone(Shape::ball(4, 1.0).and(Shape::ball(4, 0.9).inwards())));
    // Side by side, sharing a face, an edge and a corner.
    for by in [[1.5, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [1.0, 0.3, 0.2]] {
        let found = alone(cube().and(cube().moved(by))).diagnose().remove(0);
        let shared = |finding: &Finding| matches!(finding.ailment, Ailment::NonManifoldEdges | Ailment::DuplicateFaces);
        assert!(found.findings.iter().all(shared), "{by:?}: {found:#?}");
    }
}

#[test]
fn edges_are_told_with_their_places() {
    let mut open = cube();
    open.triangles.remove(4);
    let transform = DAffine3::from_translation(DVec3::new(3.0, 0.0, 0.0));
    let finding = only(&scene(vec![(open.clone(), transform)]));
    assert_eq!((finding.ailment, finding.count), (Ailment::OpenEdges, 3));
    let on_the_hole = [DVec3::new(3.0, -0.5, 0.0), DVec3::new(3.0, -0.5, -0.5), DVec3::new(3.5, -0.5, 0.0)];
    assert!(on_the_hole.contains(&finding.place), "{finding:?}");
    // A pane has edges.
    let mut pane = alone(open);
    glass(&mut pane).thin_walled = true;
    is_well(&pane);

    let mut turned = cube();
    turned.triangles[0].swap(0, 1);
    let finding = only(&alone(turned));
    assert_eq!((finding.ailment, finding.count, finding.place.z), (Ailment::InconsistentEdges, 3, -0.5));

    let finding = only(&alone(cube().inwards()));
    assert_eq!((finding.ailment, finding.count), (Ailment::InvertedShells, 1));
    assert!(finding.place.abs() == DVec3::splat(0.5), "{finding:?}");
}

#[test]
fn duplicate_faces_are_told_whichever_way_they_look() {
    for backward in [false, true] {
        let mut twice = cube();
        twice.triangles.push(twice.triangles[8]);
        if backward {
            twice.triangles[12].swap(0, 1);
        }
        let found = alone(twice).diagnose().remove(0).findings;
        let finding = found.iter().find(|finding| finding.ailment == Ailment::DuplicateFaces).expect("a duplicate");
        assert_eq!((finding.count, finding.triangle, finding.place.x), (1, Some(12), -0.5));
        assert!(found.iter().any(|finding| finding.ailment == Ailment::NonManifoldEdges && finding.count == 3));
        assert!(found.iter().all(|finding| finding.ailment != Ailment::SelfIntersections), "{found:#?}");
    }
}

#[test]
fn triangles_that_cross_are_counted_and_placed() {
    // The edges of one cube go through the middle of sides of the other, where their diagonals are.
    let finding = only(&alone(cube().and(cube().moved([0.5, 0.5, 0.5]))));
    assert_eq!(finding.ailment, Ailment::SelfIntersections);
    assert!(finding.place.abs().max_element() <= 0.5 + 1e-6, "{finding:?}");
    // A spike through a side: its three sides cross the two triangles there along a diagonal, or one of them.
    let spike = Shape {
        positions: vec![[0.2, 0.1, 0.4], [0.3, 0.1, 0.4], [0.2, 0.15, 0.4], [0.25, 0.12, 0.9]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    };
    let finding = only(&alone(cube().and(spike.clone())));
    assert_eq!((finding.ailment, finding.count), (Ailment::SelfIntersections, 3));
    assert!(finding.place.distance(DVec3::new(0.24, 0.12, 0.5)) < 0.05, "{finding:?}");
    // In one shell: a side of a cube whose corner was pulled through the opposite one.
    let mut folded = Shape::ball(3, 1.0);
    let top = folded.positions.iter().position(|p| p[2] == 1.0).expect("a pole");
    folded.positions[top][2] = -1.5;
    let finding = only(&alone(folded));
    assert_eq!(finding.ailment, Ailment::SelfIntersections);
    assert!((-1.1..-0.9).contains(&finding.place.z), "{finding:?}");
    // Far from its origin, and as small as a speck.
    for (size, by) in [(1e6, 0.0), (1e-3, 0.0), (1.0, 1e3)] {
        let mut both = cube().and(spike.clone()).moved([by; 3]);
        both.positions.iter_mut().flatten().for_each(|x| *x *= size);
        let found = alone(both).diagnose().remove(0).findings;
        assert!(
            found.iter().any(|f| f.ailment == Ailment::SelfIntersections && f.count == 3),
            "{size}, {by}: {found:#?}"
        );
    }
}

#[test]
fn rounded_corners_on_a_side_do_not_cross_it() {
    // A foot on a plate, off by what six digits lose.
    for off in [-1e-6, 0.0, 1e-6_f32] {
        let foot = Shape::cuboid([-0.1, 0.5 + off, -0.1], [0.1, 0.7, 0.1]);
        let found = alone(cube().and(foot)).diagnose().remove(0);
        assert!(found.findings.iter().all(|finding| finding.ailment == Ailment::ThinWalls), "{off}: {found:#?}");
    }
}

#[test]
fn bodies_in_bodies_of_one_mesh_are_told_from_cavities() {
    let finding = only(&alone(Shape::ball(3, 1.0).and(Shape::ball(3, 0.5))));
    assert_eq!((finding.ailment, finding.count), (Ailment::NestedShells, 1));
    assert!((finding.place.length() - 0.5).abs() < 1e-6);
    let hollow = Shape::ball(3, 1.0).and(Shape::ball(3, 0.9).inwards());
    let shells = |shape: &Shape| {
        let found = alone(shape.clone()).diagnose().remove(0);
        (found.shells, found.cavities)
    };
    assert_eq!(shells(&hollow), (2, 1));
    // A bead in the hollow is a body of its own.
    let bead = hollow.and(Shape::ball(2, 0.2));
    assert_eq!(shells(&bead), (3, 1));
    is_well(&alone(bead));
}

#[test]
fn walls_that_rays_step_over_are_thin() {
    let sheet = |thickness: f32| Shape::cuboid([-1.0, -1.0, 0.0], [1.0, 1.0, thickness]);
    is_well(&alone(sheet(1e-4)));
    let finding = only(&alone(sheet(2e-6)));
    assert_eq!((finding.ailment, finding.count), (Ailment::ThinWalls, 4));
    assert!((finding.size.expect("a thickness") / 2e-6 - 1.0).abs() < 1e-3, "{finding:?}");
    // From ten kilometres away the arithmetic is coarser.
    let mut far = alone(sheet(1e-4));
    far.camera.position.z = 1e4;
    assert_eq!(only(&far).ailment, Ailment::ThinWalls);
    // Of several places of one mesh each is looked at, unless none of them can be thin.
    let mut both = alone(sheet(1e-4));
    both.objects.push(both.objects[0].clone());
    is_well(&both);
    both.objects[1].transform = DAffine3::from_translation(DVec3::Z * -1e4);
    let found: Vec<_> = both.diagnose().iter().map(|found| found.findings.len()).collect();
    assert_eq!(found, [0, 1]);
    // A gap is no wall, whatever mirrors it.
    for mirror in [1.0, -1.0] {
        let gap = sheet(1.0).and(sheet(1.0).moved([0.0, 0.0, 1.000_004]));
        is_well(&scene(vec![(gap, DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0)))]));
        let thin = scene(vec![(sheet(2e-6), DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0)))]);
        assert_eq!(only(&thin).ailment, Ailment::ThinWalls);
    }
    // A wedge is as thin as one likes along its edge.
    let wedge = Shape {
        positions: vec![
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, -0.05, 0.0],
            [1.0, -0.05, 1.0],
            [1.0, 0.05, 0.0],
            [1.0, 0.05, 1.0],
        ],
        triangles: vec![[0, 2, 3], [0, 3, 1], [0, 5, 4], [0, 1, 5], [2, 4, 5], [2, 5, 3], [0, 4, 2], [1, 3, 5]],
    };
    is_well(&alone(wedge));
}

#[test]
fn sizes_that_glass_has_not_are_told() {
    for (scale, wanted) in
        [(99.0, None), (101.0, Some(Ailment::TooLarge)), (1.1e-4, None), (0.9e-4, Some(Ailment::TooSmall))]
    {
        let mut scene = scene(vec![(cube(), DAffine3::from_scale(DVec3::splat(scale)))]);
        scene.camera.position *= scale;
        let found = scene.diagnose().remove(0).findings;
        assert_eq!(found.first().map(|finding| finding.ailment), wanted, "{scale}");
        assert!(found.iter().all(|finding| (finding.size.expect("a size") / scale - 1.0).abs() < 1e-6));
    }
    // A cup of 80 mm as 80 m, its glass coloured within centimetres.
    let mut cup = scene(vec![(cube(), DAffine3::from_scale(DVec3::splat(80.0)))]);
    is_well(&cup);
    glass(&mut cup).attenuation_distance = 0.05;
    is_well(&cup);
    glass(&mut cup).attenuation_color = DVec3::new(0.2, 0.9, 0.4);
    assert_eq!(only(&cup).ailment, Ailment::TooLarge);
    glass(&mut cup).attenuation_distance = 10.0;
    is_well(&cup);
}

#[test]
fn what_lies_in_what_is_told() {
    let place = |size: f64, x: f64| DAffine3::from_translation(DVec3::X * x) * DAffine3::from_scale(DVec3::splat(size));
    let ball = || Shape::ball(3, 1.0);
    let hollow = || ball().and(Shape::ball(3, 0.8).inwards());
    let nests = |outer: Shape, size: f64, x: f64| {
        let (found, is_complete) = scene(vec![(outer, DAffine3::IDENTITY), (ball(), place(size, x))]).nests();
        assert!(is_complete && found.len() <= 1, "{found:?}");
        found.first().map(|nest| (nest.nesting, nest.objects))
    };
    assert_eq!(nests(ball(), 0.3, 0.2), Some((Nesting::Inside, [1, 0])));
    assert_eq!(nests(ball(), 3.0, 0.2), Some((Nesting::Inside, [0, 1])));
    assert_eq!(nests(ball(), 0.5, 0.8), Some((Nesting::Overlaps, [1, 0])));
    assert_eq!(nests(ball(), 0.5, 1.6), None);
    // Their boxes meet at a corner.
    let aside = scene(vec![(ball(), DAffine3::IDENTITY), (ball(), DAffine3::from_translation(DVec3::splat(1.5)))]);
    assert_eq!(aside.nests(), (vec![], true));
    assert_eq!(nests(hollow(), 0.3, 0.2), Some((Nesting::Hollow, [1, 0])));
    assert_eq!(nests(hollow(), 0.05, 0.9), Some((Nesting::Inside, [1, 0])));
    assert_eq!(nests(hollow(), 0.3, 0.7), Some((Nesting::Overlaps, [1, 0])));
    // The rank decides which one comes first.
    let mut ranked = scene(vec![(ball(), DAffine3::IDENTITY), (ball(), place(0.5, 0.8))]);
    glass(&mut ranked).priority = 1;
    assert_eq!(ranked.nests().0[0].objects, [0, 1]);
    // Twice the same, and one that is not closed, say nothing of a side.
    assert_eq!(nests(ball(), 1.0, 0.0), None);
    let mut open = ball();
    open.triangles.pop();
    assert_eq!(nests(open, 0.3, 0.2), None);
}

/// Everything that comes with the program, and what its pictures are made of.
#[test]
fn what_is_shipped_is_well_but_for_what_is_known() {
    use Ailment::{DuplicateFaces, NonManifoldEdges, SelfIntersections, TooLarge, TooSmall};
    let (mut looked_at, mut ailing) = (0, Vec::new());
    for folder in
        ["assets/meshes", "assets/scenes", "assets/validation", "tests/regress/meshes", "tests/regress/scenes"]
    {
        for entry in std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).expect("a folder") {
            let path = entry.expect("a file").path();
            let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
            // Those two are flat and worn by what is opaque.
            if !(name.ends_with(".obj") || name.ends_with(".toml")) || ["floor.obj", "lamp.obj"].contains(&&*name) {
                continue;
            }
            let mut scene = Scene::load(Some(&path), &Overrides::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
            scene.frame(4.0 / 3.0);
            for found in scene.diagnose() {
                assert_eq!(found.unfinished, [], "{name}");
                let ailments: Vec<_> = found.findings.iter().map(|finding| finding.ailment).collect();
                if !ailments.is_empty() {
                    ailing.push((name.clone(), found.object, ailments));
                }
            }
            looked_at += 1;
        }
    }
    ailing.sort();
    // Where the teapot's handle meets its inside, the surface folds through itself by a tenth of a millimetre.
    let fold = |name: &str| (name.to_owned(), 0, vec![SelfIntersections]);
    let mut wanted: Vec<_> =
        ["figure3-a.toml", "figure3-c.toml", "figure3-d.toml", "teapot.toml", "teapot_body.obj"].map(fold).to_vec();
    // Two cubes that share a face.
    wanted.extend(["cubes.obj", "cubes.toml"].map(|name| (name.into(), 0, vec![NonManifoldEdges, DuplicateFaces])));
    wanted.push(("huge.toml".into(), 0, vec![TooLarge]));
    wanted.push(("tiny.toml".into(), 0, vec![TooSmall]));
    wanted.sort();
    assert_eq!(ailing, wanted);
    assert!(looked_at > 30, "{looked_at}");
}
