//! The scene and the environment that need no file: those of `assets/`, compiled in. In flow paths that start at
//! `built-in` and mirror `assets/`, out flow bytes.

use std::path::Path;

/// The scene that is shown when none is named.
pub const SCENE: &str = "built-in/scenes/teapot.toml";

/// What surrounds a scene that says nothing about it.
pub const ENVIRONMENT: &str = "built-in/environments/city.exr";

/// A small scene that calls for every effect, and one of clear glass alone: what drivers are validated with.
pub const EVERY_EFFECT: &str = "built-in/validation/all.toml";
pub const CLEAR_GLASS: &str = "built-in/validation/plain.toml";

/// The files, by their path.
const FILES: [(&str, &[u8]); 15] = [
    (SCENE, include_bytes!("../../assets/scenes/teapot.toml")),
    (ENVIRONMENT, include_bytes!("../../assets/environments/city.exr")),
    ("built-in/meshes/teapot_body.obj", include_bytes!("../../assets/meshes/teapot_body.obj")),
    ("built-in/meshes/teapot_lid.obj", include_bytes!("../../assets/meshes/teapot_lid.obj")),
    ("built-in/meshes/cup_tumbler.obj", include_bytes!("../../assets/meshes/cup_tumbler.obj")),
    ("built-in/meshes/cup_tea.obj", include_bytes!("../../assets/meshes/cup_tea.obj")),
    ("built-in/meshes/prism.obj", include_bytes!("../../assets/meshes/prism.obj")),
    ("built-in/meshes/diamond.obj", include_bytes!("../../assets/meshes/diamond.obj")),
    (EVERY_EFFECT, include_bytes!("../../assets/validation/all.toml")),
    (CLEAR_GLASS, include_bytes!("../../assets/validation/plain.toml")),
    ("built-in/validation/ball.obj", include_bytes!("../../assets/validation/ball.obj")),
    ("built-in/validation/floor.obj", include_bytes!("../../assets/validation/floor.obj")),
    ("built-in/validation/lamp.obj", include_bytes!("../../assets/validation/lamp.obj")),
    ("built-in/validation/checker.png", include_bytes!("../../assets/validation/checker.png")),
    ("built-in/validation/leaf.png", include_bytes!("../../assets/validation/leaf.png")),
];

/// The bytes of the file at `path`, which holds neither `.` nor `..`.
pub fn file(path: &Path) -> Option<&'static [u8]> {
    FILES.iter().find(|(known, _)| Path::new(known) == path).map(|&(_, bytes)| bytes)
}
