//! The scenes that tests of the model on a device share.

use std::path::Path;
use std::sync::OnceLock;

use glam::{DAffine3, DVec3};

use vitrum::scene::{Dielectric, Environment, Mesh, Overrides, Scene, Surface, Surroundings};

use crate::shapes::{Part, cuboid, glass, hollow_ball, icosphere, prism, rectangle, revolved, scene};

/// The first mesh of a file of `assets/meshes`.
pub fn asset(name: &str) -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/meshes").join(name);
    Scene::load(Some(&path), &Overrides::default()).unwrap().meshes[0].as_ref().clone()
}

/// Teapot and cups.
pub fn built_in() -> Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| Scene::load(None, &Overrides::default()).unwrap()).clone()
}

/// With a surrounding that differs everywhere.
pub fn in_the_city(scene: Scene) -> Scene {
    Scene { environment: built_in().environment, ..scene }
}

/// In radiance 1 from everywhere.
pub fn in_white(scene: Scene) -> Scene {
    let white = Environment { light: Surroundings::Color(DVec3::ONE), intensity: 1.0, rotation: 0.0, visible: true };
    Scene { environment: white, ..scene }
}

/// The brightest that `scene`'s surroundings are.
pub fn brightest(scene: &Scene) -> f64 {
    let largest = match &scene.environment.light {
        Surroundings::Color(color) => color.max_element(),
        Surroundings::Image(image) => image.texels.iter().flatten().copied().fold(0.0, f32::max).into(),
    };
    largest * scene.environment.intensity
}

/// Glass where it is not to give way to what it holds.
pub fn of_priority(priority: i32, ior: f64) -> Surface {
    Surface::Dielectric(Dielectric { priority, ..glass(ior) })
}

pub fn ball() -> Scene {
    scene([Part::glass(icosphere(4), 1.5)])
}

pub fn hollow() -> Scene {
    scene([Part::glass(hollow_ball(4, 0.1), 1.5)])
}

pub fn diamond() -> Scene {
    let mut diamond = scene([Part { smooth: false, ..Part::glass(asset("diamond.obj"), 2.42) }]);
    diamond.framed = true;
    diamond.frame(4.0 / 3.0);
    diamond
}

/// A tumbler with water that reaches into its wall, as far as priorities let it.
pub fn water_in_a_glass() -> Scene {
    let wall = [(0.0, -1.0), (0.7, -1.0), (0.8, 1.0), (0.7, 1.0), (0.6, -0.8), (0.0, -0.8)];
    let water = [(0.0, -0.9), (0.65, -0.9), (0.7, 0.4), (0.0, 0.4)];
    scene([Part::of(revolved(&water, 48), of_priority(0, 1.33)), Part::of(revolved(&wall, 48), of_priority(1, 1.5))])
}

pub fn slab() -> Scene {
    let turn = DAffine3::from_rotation_y(0.5);
    scene([Part::glass(cuboid(DVec3::new(-1.0, -0.8, -0.1), DVec3::new(1.0, 0.8, 0.1)), 1.5).placed(turn)])
}

pub fn made_prism() -> Scene {
    let place = DAffine3::from_translation(DVec3::new(0.0, -0.5, 0.0)) * DAffine3::from_rotation_y(0.4);
    scene([Part::glass(prism(60_f64.to_radians(), 1.5), 1.5168).placed(place)])
}

/// A pane without an inside.
pub fn thin(ior: f64) -> Surface {
    Surface::Dielectric(Dielectric { thin_walled: true, ..glass(ior) })
}

pub fn pane() -> Scene {
    scene([Part::of(rectangle(2.0, 1.5), thin(1.5)).placed(DAffine3::from_rotation_y(0.5))])
}

/// Balls in balls: water with a bubble of air and a ball of glass in it.
pub fn balls_in_water() -> Scene {
    let small = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.2)) * DAffine3::from_scale(DVec3::splat(0.3));
    scene([
        Part::glass(icosphere(3), 1.0).placed(small(0.4)),
        Part::glass(icosphere(4), 1.33),
        Part::glass(icosphere(3), 1.5).placed(small(-0.4)),
    ])
}

/// Every scene of this file, under white light.
pub fn all() -> Vec<(&'static str, Scene)> {
    vec![
        ("ball", ball()),
        ("hollow ball", hollow()),
        ("teapot and cups", in_white(built_in())),
        ("diamond", diamond()),
        ("water in a glass", water_in_a_glass()),
        ("slab", slab()),
        ("prism", made_prism()),
        ("pane", pane()),
        ("balls in water", balls_in_water()),
    ]
}
