//! Pictures for tests: scenes without files, rendered under validation.

use std::fmt::Write;

use glam::DVec3;

use super::Validated;
use vitrum::options::{RenderArgs, Size};
use vitrum::passes::{Rendered, render};
use vitrum::plan::Plan;
use vitrum::scene::{Overrides, Scene};

/// A ball of glass in the default environment.
pub const BALL: &str = r#"
[camera]
position = [0, 0.6, 4]
target = [0, 0, 0]
vertical_fov = 35
[material.glass]
kind = "dielectric"
[[object]]
mesh = "ball.obj"
material = "glass"
"#;

/// Renders under validation; `None` without a device.
pub fn picture(scene: &Scene, args: RenderArgs) -> Option<(Plan, Rendered)> {
    let validated = Validated::open()?;
    let plan = Plan::new(scene, &args).expect("a plan");
    let rendered = render(&validated.gpu, scene, &plan, &mut |_| {}).expect("a picture");
    validated.verdict();
    Some((plan, rendered))
}

/// One sample a pixel.
pub fn sized(width: u32, height: u32) -> RenderArgs {
    RenderArgs { size: Some(Size { width, height }), samples: Some(1), ..RenderArgs::default() }
}

/// A scene file's text, loaded as if it lay in a folder of its own.
pub fn scene(text: &str, overrides: &Overrides) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(folder.path().join("ball.obj"), ball(4)).expect("a mesh");
    std::fs::write(&path, text).expect("a scene");
    Scene::load(Some(&path), overrides).expect("the scene loads")
}

/// A ball of radius 1 as an OBJ with normals: an octahedron, subdivided.
fn ball(levels: u32) -> String {
    let side = 1 << levels;
    let mut text = String::new();
    let mut count = 0;
    for octant in 0..8 {
        let sign = |bit: u32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let outward = sign(0) * sign(1) * sign(2) > 0.0;
        let point = |i: i32, j: i32| {
            let k = side - i - j;
            DVec3::new(sign(0) * f64::from(i), sign(1) * f64::from(j), sign(2) * f64::from(k)).normalize()
        };
        let mut face = |a: DVec3, b: DVec3, c: DVec3| {
            let corners = if outward { [a, b, c] } else { [a, c, b] };
            for DVec3 { x, y, z } in corners {
                writeln!(text, "v {x} {y} {z}\nvn {x} {y} {z}").expect("a string");
            }
            let (a, b, c) = (count + 1, count + 2, count + 3);
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}").expect("a string");
            count += 3;
        };
        for i in 0..side {
            for j in 0..side - i {
                face(point(i, j), point(i + 1, j), point(i, j + 1));
                if i + j + 1 < side {
                    face(point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                }
            }
        }
    }
    text
}

/// Infinite where one of them is not finite.
pub fn largest_difference(a: &Rendered, b: &Rendered) -> f32 {
    let pairs = a.radiance.iter().flatten().zip(b.radiance.iter().flatten());
    let differences = pairs.map(|(a, b)| if (a - b).is_finite() { (a - b).abs() } else { f32::INFINITY });
    differences.fold(0.0, f32::max)
}
