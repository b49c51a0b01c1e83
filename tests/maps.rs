//! Images on surfaces, and what is cut out of them and painted on glass: pictures where what comes out is known.

#[path = "common/mod.rs"]
mod common;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::f64::consts::PI;

use glam::{DAffine3, DMat2, DVec2, DVec3};

use common::Validated;
use shapes::{Part, cuboid, icosphere, rectangle, scene};
use vitrum::effects::Selection;
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::render;
use vitrum::plan::Plan;
use vitrum::scene::{
    Camera, Coating, Cutout, Dielectric, Mesh, NormalMap, Opaque, Panorama, PointLight, Scene, Surface, Surroundings,
    Texels, Texture, TextureMap, Wrap,
};

const SIZE: Size = Size { width: 24, height: 18 };

fn picture(validated: &Validated, scene: &Scene, model: Model, samples: u32, effects: &str) -> Vec<DVec3> {
    let args = RenderArgs {
        model: Some(model.into()),
        size: Some(SIZE),
        samples: Some(samples),
        effects: Some(effects.parse::<Selection>().expect("effects")),
        ..RenderArgs::default()
    };
    let plan = Plan::new(scene, &args).expect("a plan");
    let rendered = render(&validated.gpu, scene, &plan, &mut |_| {}).expect("a picture");
    rendered.radiance.iter().map(|pixel| DVec3::from_array(pixel.map(f64::from))).collect()
}

fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f64::max)
}

/// Of numbers from 0 to 255.
fn image(width: u32, texels: &[[u8; 4]]) -> Texture {
    let height = texels.len() as u32 / width;
    Texture { path: "image".into(), width, height, texels: Texels::Unorm(texels.to_vec()) }
}

/// Texture coordinates that are x and y.
fn with_uvs(mesh: Mesh) -> Mesh {
    let uvs = mesh.positions.iter().map(|[x, y, _]| [*x, *y]).collect();
    Mesh { uvs, ..mesh }
}

/// A board in the plane z = 0, from -3 to 3, whose coordinates are x and y.
fn board(surface: Surface) -> Part {
    Part::of(with_uvs(rectangle(6.0, 6.0)), surface)
}

/// Straight from the front, 2 away.
fn from_the_front(mut scene: Scene) -> Scene {
    scene.camera = Camera { position: DVec3::Z * 2.0, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 0.5 };
    scene
}

/// Of each pixel's centre the direction of the camera's ray, as [`from_the_front`] has it.
fn rays() -> Vec<DVec3> {
    let half = 0.25_f64.tan();
    let ray = |i: u32| {
        let x = (f64::from(i % SIZE.width) + 0.5) / f64::from(SIZE.width) * 2.0 - 1.0;
        let y = 1.0 - (f64::from(i / SIZE.width) + 0.5) / f64::from(SIZE.height) * 2.0;
        DVec3::new(x * half * 4.0 / 3.0, y * half, -1.0).normalize()
    };
    (0..SIZE.width * SIZE.height).map(ray).collect()
}

/// Light that tells where it comes from: 1 plus half the direction.
fn directions() -> Surroundings {
    let (width, height) = (512, 256);
    let texel = |i: u32| {
        let theta = (f64::from(i / width) + 0.5) / f64::from(height) * PI;
        // The first column is -z, to the right is +x.
        let phi = (f64::from(i % width) + 0.5) / f64::from(width) * 2.0 * PI;
        let direction = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        (DVec3::ONE + 0.5 * direction).as_vec3().to_array()
    };
    Surroundings::Image(Panorama::new(width, height, (0..width * height).map(texel).collect()))
}

fn seen(direction: DVec3) -> DVec3 {
    DVec3::ONE + 0.5 * direction.normalize()
}

/// An image that is the same everywhere is a number, whatever it is an image of.
#[test]
fn uniform_images_are_numbers() {
    let Some(validated) = Validated::open() else { return };
    let value = [51, 102, 204, 255];
    let [r, g, b, _] = value.map(|code| f64::from(code) / 255.0);
    let map = Some(TextureMap::of(0));
    let numbers = Opaque {
        base_color: DVec3::new(r, g, b) * 0.5,
        metallic: b,
        roughness: g * 0.75,
        emission: DVec3::new(r, g, b) * 0.25,
        ..Opaque::default()
    };
    let images = Opaque {
        base_color: DVec3::splat(0.5),
        base_color_texture: map,
        metallic: 1.0,
        roughness: 0.75,
        metallic_roughness_texture: map,
        emission: DVec3::splat(0.25),
        emission_texture: map,
        ..Opaque::default()
    };
    let glass_of = |coating: Coating, metallic_roughness_texture| {
        let roughness = if metallic_roughness_texture == map { 0.5 } else { 0.5 * g };
        Surface::Dielectric(Dielectric {
            roughness,
            metallic_roughness_texture,
            coating: Some(Box::new(coating)),
            ..Dielectric::default()
        })
    };
    let painted = Coating {
        base_color: DVec3::new(r, g, b) * 0.5,
        transmission: 0.5 * r,
        metallic: 0.5 * b,
        ..Coating::default()
    };
    let of_images = Coating {
        base_color: DVec3::splat(0.5),
        base_color_texture: map,
        transmission: 0.5,
        transmission_texture: map,
        metallic: 0.5,
    };
    let pairs =
        [(Surface::Opaque(numbers), Surface::Opaque(images)), (glass_of(painted, None), glass_of(of_images, map))];
    for (model, samples) in [(Model::Tree, 4), (Model::Path, 64)] {
        for (number, (numbers, images)) in pairs.iter().enumerate() {
            let scene_of = |surface: &Surface| {
                let ball = Part::of(with_uvs(icosphere(3)), surface.clone());
                let mut scene = scene([
                    ball,
                    board(Surface::Opaque(Opaque::default())).placed(DAffine3::from_translation(-DVec3::Z)),
                ]);
                scene.environment.light = directions();
                scene.lights = vec![PointLight::new(DVec3::new(1.0, 2.0, 3.0), DVec3::splat(4.0))];
                scene.textures.push(image(1, &[value]).into());
                scene
            };
            let [wanted, found] =
                [numbers, images].map(|surface| picture(&validated, &scene_of(surface), model, samples, "auto"));
            let error = farthest(&wanted, &found);
            // Texels are rounded, so that one path in many turns out another.
            assert!(error < 2e-2, "{model:?}, pair {number}: {error}");
            // The mean of an image stands for it where it is not looked at.
            let found = picture(&validated, &scene_of(images), model, samples, "auto,-textures");
            let error = farthest(&wanted, &found);
            assert!(error < 2e-2, "{model:?}, pair {number}, by its mean: {error}");
        }
    }
    validated.verdict();
}

/// Glass that is smooth on one side and as rough as can be on the other loses nothing anywhere: what facets lose is given back
/// for each texel.
#[test]
fn glass_of_all_roughnesses_is_white() {
    let Some(validated) = Validated::open() else { return };
    let greens: Vec<[u8; 4]> = (0..16).map(|i| [0, 17 * i, 0, 255]).collect();
    let worn = |thin_walled| {
        Surface::Dielectric(Dielectric {
            roughness: 1.0,
            metallic_roughness_texture: Some(TextureMap { wrap: [Wrap::Clamp; 2], ..TextureMap::of(0) }),
            thin_walled,
            ..Dielectric::default()
        })
    };
    for (name, thin_walled) in [("ball", false), ("bubble", true)] {
        let mut scene = scene([Part::of(with_uvs(icosphere(5)), worn(thin_walled))]);
        scene.textures.push(image(16, &greens).into());
        scene.environment.light = Surroundings::Color(DVec3::ONE);
        scene.frame(4.0 / 3.0);
        let found = picture(&validated, &scene, Model::Path, 1024, "auto");
        let lossy = picture(&validated, &scene, Model::Path, 1024, "auto,-energy-compensation");
        // Columns of the picture are columns of the image.
        let column = |pixels: &[DVec3], x: u32| {
            let rows = SIZE.height * 2 / 5..SIZE.height * 3 / 5;
            let count = f64::from(rows.end - rows.start);
            rows.map(|y| pixels[(y * SIZE.width + x) as usize].x).sum::<f64>() / count
        };
        let (middle, reach) = (SIZE.width / 2, SIZE.height / 3);
        for x in middle - reach..middle + reach {
            let value = column(&found, x);
            assert!((value - 1.0).abs() < 2e-2, "{name}, column {x}: {value}");
        }
        let darkest = (middle - reach..middle + reach).map(|x| column(&lossy, x)).fold(1.0, f64::min);
        assert!(darkest < 0.9, "{name}: {darkest}");
    }
    validated.verdict();
}

/// A board that is seen from the front and shines with its image: each pixel is a texel.
#[test]
fn images_lie_where_they_should() {
    let Some(validated) = Validated::open() else { return };
    let colors: Vec<[u8; 4]> = (0..16).map(|i| [10 * i as u8, 250 - 10 * i as u8, 100, 255]).collect();
    // The coordinates of an image, v downwards.
    let place = |at: DVec2, wrap: [Wrap; 2]| {
        let texel = |x: f64, wrap: Wrap| {
            let cell = (x * 4.0).floor() as i32;
            match wrap {
                Wrap::Repeat => cell.rem_euclid(4),
                Wrap::Clamp => cell.clamp(0, 3),
                Wrap::Mirror => {
                    let cell = cell.rem_euclid(8);
                    cell.min(7 - cell)
                }
            }
        };
        let [r, g, b, _] = colors[(4 * texel(at.y, wrap[1]) + texel(at.x, wrap[0])) as usize];
        DVec3::new(r.into(), g.into(), b.into()) / 255.0
    };
    let quarter = DMat2::from_cols_array(&[0.0, -1.0, 1.0, 0.0]);
    for map in [
        TextureMap::of(0),
        TextureMap { wrap: [Wrap::Clamp, Wrap::Mirror], offset: DVec2::new(0.3, -0.8), ..TextureMap::of(0) },
        TextureMap { wrap: [Wrap::Mirror, Wrap::Clamp], turn: quarter, ..TextureMap::of(0) },
    ] {
        let shown = Opaque {
            base_color: DVec3::ZERO,
            specular: 0.0,
            emission: DVec3::ONE,
            emission_texture: Some(map),
            ..Opaque::default()
        };
        let mut scene = from_the_front(scene([board(Surface::Opaque(shown))]));
        scene.textures.push(image(4, &colors).into());
        let found = picture(&validated, &scene, Model::Path, 256, "auto");
        let mut close = 0;
        for (ray, found) in rays().iter().zip(&found) {
            let point = *ray * (-2.0 / ray.z);
            let at = map.turn * DVec2::new(point.x, 1.0 - point.y) + map.offset;
            // In the middle of texels: pixels are a twentieth of one wide, and between texels colours are mixed.
            let within = (at * 4.0 - (at * 4.0).floor() - 0.5).abs();
            if within.max_element() < 0.1 {
                let wanted = place(at, map.wrap);
                assert!((*found - wanted).abs().max_element() < 0.03, "{map:?} at {at}: {found}, not {wanted}");
                close += 1;
            }
        }
        assert!(close > 8, "{close}");
    }
    validated.verdict();
}

/// What an image does to the normal of a mirror and of glass, against the law of reflection and Snell's.
#[test]
fn maps_of_normals_turn_light_as_tilted_surfaces_do() {
    let Some(validated) = Validated::open() else { return };
    let code = |x: f64| ((x * 0.5 + 0.5) * 255.0).round() as u8;
    let bump = DVec3::new(0.3, -0.2, (1.0_f64 - 0.13).sqrt());
    let texel = [code(bump.x), code(bump.y), code(bump.z), 255];
    let [x, y, z, _] = texel.map(|code| f64::from(code) / 255.0 * 2.0 - 1.0);
    let turned = |turn: DMat2, scale: f64, mirrored: bool| {
        let uvs = |[x, y, _]: &[f32; 3]| [if mirrored { -*x } else { *x }, *y];
        let mut mesh = rectangle(6.0, 6.0);
        mesh.uvs = mesh.positions.iter().map(uvs).collect();
        (mesh, NormalMap { map: TextureMap { turn, ..TextureMap::of(0) }, scale })
    };
    let quarter = DMat2::from_cols_array(&[0.0, -1.0, 1.0, 0.0]);
    let cases = [
        (turned(DMat2::IDENTITY, 1.0, false), DVec3::new(x, y, z)),
        (turned(DMat2::IDENTITY, -0.5, false), DVec3::new(-0.5 * x, -0.5 * y, z)),
        (turned(DMat2::IDENTITY, 1.0, true), DVec3::new(-x, y, z)),
        // A quarter turn of the coordinates: the image's right is the mesh's down, and its up the mesh's right.
        (turned(quarter, 1.0, false), DVec3::new(y, -x, z)),
    ];
    for ((mesh, normal_map), normal) in cases {
        let normal = normal.normalize();
        let mirror = Opaque { base_color: DVec3::ONE, metallic: 1.0, roughness: 0.0, ..Opaque::default() };
        let glass = Dielectric { ior: 1.5, roughness: 0.0, ..Dielectric::default() };
        for surface in [Surface::Opaque(mirror), Surface::Dielectric(glass)] {
            let is_mirror = matches!(surface, Surface::Opaque(_));
            let mut scene = from_the_front(scene([Part::of(mesh.clone(), surface)]));
            scene.environment.light = directions();
            scene.textures.push(image(1, &[texel]).into());
            scene.materials[0].normal_map = Some(normal_map);
            for (model, samples) in [(Model::Tree, 1), (Model::Path, 64)] {
                // Of glass a single interface.
                let found = picture(&validated, &scene, model, samples, "auto,-interior");
                let mut worst: f64 = 0.0;
                for (ray, found) in rays().iter().zip(&found) {
                    let cosine = -ray.dot(normal);
                    let reflected = *ray + 2.0 * cosine * normal;
                    let wanted = if is_mirror {
                        seen(reflected)
                    } else {
                        let eta = 1.0 / 1.5;
                        let inner = (1.0 - eta * eta * (1.0 - cosine * cosine)).sqrt();
                        let refracted = eta * *ray + (eta * cosine - inner) * normal;
                        let across = (cosine - 1.5 * inner) / (cosine + 1.5 * inner);
                        let along = (1.5 * cosine - inner) / (1.5 * cosine + inner);
                        let reflectance = 0.5 * (across * across + along * along);
                        reflectance * seen(reflected) + (1.0 - reflectance) * seen(refracted)
                    };
                    worst = worst.max((*found - wanted).abs().max_element());
                }
                assert!(worst < 5e-3, "{model:?}, {normal}, mirror: {is_mirror}: {worst}");
            }
        }
    }
    validated.verdict();
}

/// Bent as it may be, smooth glass in white light stays white, and no direction ends on the wrong side of the surface.
#[test]
fn glass_with_bent_normals_loses_no_light() {
    let Some(validated) = Validated::open() else { return };
    let texels: Vec<[u8; 4]> = (0..64).map(|i| [(i * 97 % 256) as u8, (i * 57 % 256) as u8, 160, 255]).collect();
    for mesh in [with_uvs(icosphere(3)), with_uvs(cuboid(DVec3::splat(-0.7), DVec3::splat(0.7)))] {
        let glass = Dielectric { ior: 1.5, roughness: 0.0, ..Dielectric::default() };
        let mut scene = scene([Part::of(mesh, Surface::Dielectric(glass))]);
        scene.textures.push(image(8, &texels).into());
        scene.materials[0].normal_map = Some(NormalMap { map: TextureMap::of(0), scale: 1.0 });
        let args = RenderArgs {
            model: Some(Model::Path.into()),
            size: Some(SIZE),
            samples: Some(256),
            max_depth: Some(256),
            ..RenderArgs::default()
        };
        let plan = Plan::new(&scene, &args).expect("a plan");
        let rendered = render(&validated.gpu, &scene, &plan, &mut |_| {}).expect("a picture");
        let mean =
            rendered.radiance.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / rendered.radiance.len() as f64;
        assert!((mean - 1.0).abs() < 2e-3, "{mean}");
    }
    validated.verdict();
}

/// What alpha leaves out is not there, for what is seen and for shadows, of glass and of what is opaque.
#[test]
fn cut_out_surfaces_are_not_there() {
    let Some(validated) = Validated::open() else { return };
    let matte = || Surface::Opaque(Opaque::default());
    let clear = || Surface::Dielectric(Dielectric { roughness: 0.0, ..Dielectric::default() });
    let wall = || board(matte()).placed(DAffine3::from_translation(DVec3::Z * -2.0));
    let lit = |mut scene: Scene| {
        scene.environment.light = directions();
        scene.lights = vec![PointLight::new(DVec3::new(0.5, 1.0, 2.5), DVec3::splat(9.0))];
        scene.textures.push(image(2, &[[255, 255, 255, 0], [255, 255, 255, 255]]).into());
        scene
    };
    for (model, samples) in [(Model::Tree, 2), (Model::Path, 64)] {
        let without = picture(&validated, &lit(scene([wall()])), model, samples, "auto");
        for surface in [matte(), clear()] {
            let ball = || Part::of(with_uvs(icosphere(3)), surface.clone());
            let with = |cutout| {
                let mut scene = lit(scene([wall(), ball()]));
                scene.materials[1].cutout = Some(cutout);
                scene
            };
            let gone = with(Cutout { alpha: 0.4, map: None, cutoff: Some(0.5) });
            // The traced path is longer by a few hops, and rounds otherwise.
            let error = farthest(&picture(&validated, &gone, model, samples, "auto"), &without);
            assert!(error < 2e-3, "{model:?}: {error}");
            let there = with(Cutout { alpha: 0.6, map: None, cutoff: Some(0.5) });
            let whole = picture(&validated, &lit(scene([wall(), ball()])), model, samples, "auto");
            assert_eq!(farthest(&picture(&validated, &there, model, samples, "auto"), &whole), 0.0, "{model:?}");
            assert!(farthest(&whole, &without) > 0.1);
        }
    }
    // Of a board the half whose image has alpha is there: the same as half a board.
    let half = Cutout {
        alpha: 1.0,
        map: Some(TextureMap { wrap: [Wrap::Clamp; 2], offset: DVec2::splat(0.5), ..TextureMap::of(0) }),
        cutoff: Some(0.5),
    };
    let mut cut = lit(from_the_front(scene([board(matte()), wall()])));
    cut.materials[0].cutout = Some(half);
    let mut right = rectangle(3.0, 6.0);
    right.positions.iter_mut().for_each(|[x, ..]| *x += 1.5);
    let halved = lit(from_the_front(scene([Part::of(right, matte()), wall()])));
    for (model, samples) in [(Model::Tree, 1), (Model::Path, 1024)] {
        let [found, wanted] = [&cut, &halved].map(|scene| picture(&validated, scene, model, samples, "auto"));
        let far = found.iter().zip(&wanted).filter(|(a, b)| (**a - **b).abs().max_element() > 0.05).count();
        assert!(far == 0, "{model:?}: {far} pixels");
    }
    validated.verdict();
}

/// What blends is there as often as alpha says, in front of light and in its way.
#[test]
fn blending_surfaces_are_there_in_part() {
    let Some(validated) = Validated::open() else { return };
    let lamp =
        Opaque { base_color: DVec3::ZERO, specular: 0.0, emission: DVec3::new(0.2, 0.4, 3.0), ..Opaque::default() };
    let mut scene = from_the_front(scene([board(Surface::Opaque(lamp))]));
    scene.environment.light = Surroundings::Color(DVec3::ONE);
    scene.materials[0].cutout = Some(Cutout { alpha: 0.25, map: None, cutoff: None });
    let found = picture(&validated, &scene, Model::Path, 1024, "auto");
    let mean = found.iter().sum::<DVec3>() / found.len() as f64;
    let wanted = DVec3::new(0.2, 0.4, 3.0) * 0.25 + DVec3::splat(0.75);
    assert!((mean - wanted).abs().max_element() < 5e-3, "{mean}, not {wanted}");
    validated.verdict();
}

/// Glass that colours light at its surface, against what a pane does; painted in part it loses none.
#[test]
fn coated_glass_colours_and_keeps_light() {
    let Some(validated) = Validated::open() else { return };
    let color = DVec3::new(0.9, 0.5, 0.1);
    let pane = |coating: Coating, roughness: f64| {
        Surface::Dielectric(Dielectric {
            roughness,
            thin_walled: true,
            coating: Some(Box::new(coating)),
            ..Dielectric::default()
        })
    };
    // In white light a pane sends what it reflects, and through it what is left in its colour.
    let tinted = from_the_front(scene([board(pane(Coating { base_color: color, ..Coating::default() }, 0.0))]));
    for (model, samples) in [(Model::Tree, 1), (Model::Path, 64)] {
        for (ray, found) in rays().iter().zip(picture(&validated, &tinted, model, samples, "auto")) {
            let cosine = -ray.z;
            let inner = (1.0 - (1.0 - cosine * cosine) / 2.25_f64).sqrt();
            let across = (cosine - 1.5 * inner) / (cosine + 1.5 * inner);
            let along = (1.5 * cosine - inner) / (1.5 * cosine + inner);
            let once = 0.5 * (across * across + along * along);
            let reflectance = 2.0 * once / (1.0 + once);
            let wanted = DVec3::splat(reflectance) + (1.0 - reflectance) * color;
            assert!((found - wanted).abs().max_element() < 2e-3, "{model:?}: {found}, not {wanted}");
        }
    }
    // A body colours light at both of its interfaces.
    let slab = |base_color| {
        let glass = Dielectric {
            roughness: 0.0,
            coating: Some(Box::new(Coating { base_color, ..Coating::default() })),
            ..Dielectric::default()
        };
        let slab = cuboid(DVec3::new(-3.0, -3.0, -0.5), DVec3::new(3.0, 3.0, 0.0));
        let mut scene = from_the_front(scene([Part::of(slab, Surface::Dielectric(glass))]));
        scene.environment.light = Surroundings::Color(DVec3::ONE);
        picture(&validated, &scene, Model::Tree, 1, "auto")[(SIZE.height / 2 * SIZE.width + SIZE.width / 2) as usize]
    };
    let clear = slab(DVec3::ONE);
    let found = slab(color);
    // What is reflected inside comes through once more, an odd number of times on either side.
    let once = 0.04;
    let back = once + (1.0 - once) * (1.0 - once) * once / (1.0 - once * once) * color * color;
    let through = (1.0 - once) * (1.0 - once) / (1.0 - once * once) * color * color;
    assert!((clear - DVec3::ONE).abs().max_element() < 1e-2, "{clear}");
    assert!((found - back - through).abs().max_element() < 5e-3, "{found}, not {}", back + through);

    // White paint takes nothing away.
    for (transmission, roughness) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.5)] {
        let mut scene = from_the_front(scene([board(pane(Coating { transmission, ..Coating::default() }, roughness))]));
        scene.environment.light = Surroundings::Color(DVec3::ONE);
        let found = picture(&validated, &scene, Model::Path, 1024, "auto");
        let mean = found.iter().sum::<DVec3>() / found.len() as f64;
        assert!((mean - DVec3::ONE).abs().max_element() < 2e-2, "{transmission} {roughness}: {mean}");
    }
    validated.verdict();
}

/// A lamp whose image is half dark is half a lamp, however its light is looked for.
#[test]
fn half_dark_lamps_are_half_lamps() {
    let Some(validated) = Validated::open() else { return };
    let floor = || board(Surface::Opaque(Opaque { specular: 0.0, ..Opaque::default() }));
    let above = DAffine3::from_translation(DVec3::Z * 1.5) * DAffine3::from_rotation_y(PI);
    let shine = |emission_texture| {
        let emission = DVec3::new(4.0, 2.0, 1.0);
        Surface::Opaque(Opaque {
            base_color: DVec3::ZERO,
            specular: 0.0,
            emission,
            emission_texture,
            ..Opaque::default()
        })
    };
    let dark = |mut scene: Scene| {
        scene.environment.light = Surroundings::Color(DVec3::ZERO);
        scene.camera =
            Camera { position: DVec3::new(0.0, -4.0, 1.2), target: DVec3::ZERO, up: DVec3::Z, vertical_fov: 0.4 };
        scene.textures.push(image(2, &[[0, 0, 0, 255], [255, 255, 255, 255]]).into());
        scene
    };
    let half = TextureMap {
        wrap: [Wrap::Clamp; 2],
        offset: DVec2::splat(0.5),
        turn: DMat2::IDENTITY * 200.0,
        ..TextureMap::of(0)
    };
    let whole = Part::of(with_uvs(rectangle(2.0, 2.0)), shine(Some(half))).placed(above);
    let mut right = rectangle(1.0, 2.0);
    right.positions.iter_mut().for_each(|[x, ..]| *x += 0.5);
    let halved = Part::of(right, shine(None)).placed(above);
    let [found, wanted] = [whole, halved]
        .map(|lamp| picture(&validated, &dark(scene([floor(), lamp])), Model::Path, 2048, "auto"))
        .map(|picture| picture.iter().sum::<DVec3>() / picture.len() as f64);
    assert!((found - wanted).abs().max_element() < 0.01 * wanted.max_element(), "{found}, not {wanted}");
    validated.verdict();
}
