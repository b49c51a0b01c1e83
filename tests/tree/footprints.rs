//! Look-ups as wide as a pixel: nearer to what many samples find, and the same in the limit.

use glam::{DAffine3, DVec3};
use half::f16;

use vitrum::options::Size;
use vitrum::scene::{Environment, Object, Opaque, Panorama, Scene, Surface, Surroundings, Texels, Texture, TextureMap};

use crate::bodies::{ball, built_in, diamond, hollow, in_the_city, in_white, made_prism, pane, slab};
use crate::device::{Device, Picture, Shot};
use crate::shapes::{Part, icosphere, rectangle, scene};

const SMALL: Size = Size { width: 48, height: 36 };

/// Mean squared error relative to the square of the value, as renderers are compared.
fn relative_error(picture: &Picture, expected: &Picture) -> f64 {
    let pairs = picture.radiance.iter().zip(&expected.radiance);
    let errors = pairs.map(|(found, expected)| {
        ((*found - *expected) * (*found - *expected) / (*expected * *expected + 1e-2)).element_sum() / 3.0
    });
    errors.sum::<f64>() / picture.radiance.len() as f64
}

/// An image of squares of 0 and 2, `side` texels wide.
fn squares(width: u32, height: u32, side: u32) -> impl Iterator<Item = f32> {
    (0..width * height).map(move |i| if (i % width / side + i / width / side).is_multiple_of(2) { 0.0 } else { 2.0 })
}

/// With surroundings of squares that are much smaller than a pixel of [`SMALL`].
fn in_squares(scene: Scene) -> Scene {
    let squares = Panorama::new(2048, 1024, squares(2048, 1024, 3).map(|value| [value; 3]).collect());
    let environment = Environment { light: Surroundings::Image(squares), intensity: 1.0, rotation: 0.0, visible: true };
    Scene { environment, ..scene }
}

/// A board of squares in white light, seen at a slant.
fn board() -> Scene {
    let texels = squares(512, 512, 4).map(|value| [f16::from_f32(0.5 * value); 4]).collect();
    let texture = Texture { path: "squares".into(), width: 512, height: 512, texels: Texels::Linear(texels) };
    let worn = Opaque {
        base_color: DVec3::ONE,
        base_color_texture: Some(TextureMap::of(0)),
        specular: 0.0,
        ..Opaque::default()
    };
    let mut board = rectangle(4.0, 4.0);
    board.uvs = board.positions.iter().map(|&[x, y, _]| [x / 4.0, y / 4.0]).collect();
    let tilt = DAffine3::from_rotation_x(-1.1);
    Scene { textures: vec![texture.into()], ..in_white(scene([Part::of(board, Surface::Opaque(worn)).placed(tilt)])) }
}

/// The same through a ball of glass.
fn board_behind_a_ball() -> Scene {
    let mut scene = board();
    let ball = Part::glass(icosphere(4), 1.5).placed(DAffine3::from_translation(DVec3::new(0.0, 0.5, 1.2)));
    let ball = crate::shapes::scene([ball]);
    let (mesh, material) = (scene.meshes.len(), scene.materials.len());
    scene.objects.extend(ball.objects.into_iter().map(|object| Object { mesh, material, number: 2, ..object }));
    scene.meshes.extend(ball.meshes);
    scene.materials.extend(ball.materials);
    scene
}

/// A ball that mirrors everything.
fn mirror() -> Scene {
    let silver = Opaque { base_color: DVec3::ONE, metallic: 1.0, roughness: 0.0, ..Opaque::default() };
    scene([Part::of(icosphere(4), Surface::Opaque(silver))])
}

/// Where everything that is looked up is finer than a pixel, one sample a pixel says nothing: unless it averages what the pixel sees.
#[test]
fn a_sample_sees_what_its_pixel_sees() {
    let Some(device) = Device::open() else { return };
    for (name, scene, gain) in [
        ("nothing", in_squares(scene([])), 8.0),
        ("ball", in_squares(ball()), 3.0),
        ("prism", in_squares(made_prism()), 3.0),
        ("pane", in_squares(pane()), 3.0),
        ("mirror", in_squares(mirror()), 3.0),
        ("board", board(), 3.0),
        ("board behind a ball", board_behind_a_ball(), 2.0),
    ] {
        let shot = Shot { size: SMALL, cutoff: 1e-3, ..Shot::default() };
        let wide = Shot { footprints: true, ..shot };
        let expected = device.picture(&scene, Shot { samples: 100, ..shot });
        let [narrow, once] = [shot, wide].map(|shot| device.picture(&scene, shot).rmse(&expected));
        let many = device.picture(&scene, Shot { samples: 100, ..wide }).rmse(&expected);
        println!("{name}: RMSE {narrow:.1e}, as wide as the pixel {once:.1e}, at 100 samples {many:.1e}");
        assert!(once * gain < narrow, "{name}: {narrow} {once}");
        assert!(1.5 * many < once, "{name}: {once} {many}");
    }
    device.verdict();
}

#[test]
#[ignore = "a measurement: prints figures of docs/tree.md and checks nothing"]
fn what_footprints_save() {
    let Some(device) = Device::open() else { return };
    for (name, scene) in [
        ("ball", ball()),
        ("hollow ball", hollow()),
        ("prism", made_prism()),
        ("slab", slab()),
        ("diamond", diamond()),
        ("teapot and cups", built_in()),
    ] {
        let scene = in_the_city(scene);
        let shot = Shot { size: Size { width: 256, height: 192 }, cutoff: 1e-3, ..Shot::default() };
        let expected = device.picture(&scene, Shot { samples: 144, ..shot });
        for samples in [1, 4, 16] {
            let errors = [false, true].map(|footprints| {
                let picture = device.picture(&scene, Shot { samples, footprints, ..shot });
                relative_error(&picture, &expected)
            });
            println!("{name}, {samples} samples: {:.2e}, as wide as the pixel {:.2e}", errors[0], errors[1]);
        }
    }
    device.verdict();
}

/// Odd sizes, single texels, coordinates that repeat a million times a metre and views along the surface: values stay numbers, and where
/// a pixel sees more than the whole image it sees its mean.
#[test]
fn extreme_images_stay_finite() {
    let Some(device) = Device::open() else { return };
    for (width, height, repeats) in [(1, 1, 1.0), (7, 3, 1.0), (13, 1, 300.0), (1, 255, 1e6), (64, 64, 1e6)] {
        let texels: Vec<_> = squares(width, height, 1).map(|value| [f16::from_f32(0.5 * value); 4]).collect();
        let mean = texels.iter().map(|texel| f64::from(texel[0])).sum::<f64>() / f64::from(width * height);
        let texture = Texture { path: "small".into(), width, height, texels: Texels::Linear(texels) };
        let mut scene = Scene { textures: vec![texture.into()], ..board() };
        let uvs = &mut std::sync::Arc::make_mut(&mut scene.meshes[0]).uvs;
        uvs.iter_mut().flatten().for_each(|coordinate| *coordinate *= repeats);
        scene.objects[0].transform = DAffine3::from_rotation_x(-1.5);
        let picture = device.picture(&scene, Shot { size: SMALL, footprints: true, ..Shot::default() });
        if repeats > 1e5 {
            let middle = picture.radiance[(SMALL.width * SMALL.height / 2 + SMALL.width / 2) as usize];
            assert!((middle - mean).abs().max_element() < 0.01, "{width}x{height}: {middle}, not {mean}");
        }
    }
    for (width, height) in [(1, 1), (5, 1), (1, 9), (7, 3)] {
        let texels = squares(width, height, 1).map(|value| [value; 3]).collect();
        let light = Surroundings::Image(Panorama::new(width, height, texels));
        let environment = Environment { light, intensity: 1.0, rotation: 0.3, visible: true };
        let scene = Scene { environment, ..ball() };
        device.picture(&scene, Shot { size: SMALL, footprints: true, ..Shot::default() });
    }
    device.verdict();
}
