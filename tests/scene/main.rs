//! Scene files, meshes and materials as a user writes them: what is read, and what is said about what is wrong.

mod files;
mod meshes;
mod textures;

use std::fs;
use std::path::PathBuf;

use tempfile::TempDir;
use vitrum::scene::{Dielectric, Opaque, Overrides, Scene, Surface};

/// A folder with a closed mesh, an image and whatever a test adds.
struct Folder(TempDir);

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("body.obj", TETRAHEDRON);
        image::RgbImage::from_pixel(4, 2, image::Rgb([255, 0, 188])).save(folder.path("sky.png")).unwrap();
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    fn load(&self, name: &str) -> vitrum::Result<Scene> {
        Scene::load(Some(&self.path(name)), &Overrides::default())
    }

    fn scene(&self, text: &str) -> vitrum::Result<Scene> {
        self.write("scene.toml", text);
        self.load("scene.toml")
    }

    /// The error in `text`, as "line: message" with the folder's path cut out.
    fn fault(&self, text: &str) -> String {
        let error = self.scene(text).expect_err(text);
        assert_eq!(error.exit_code(), 2);
        let folder = format!("{}/", self.0.path().display());
        error.to_string().replace(&folder, "").replace("scene.toml:", "")
    }

    /// The scene of one object that shows `body.obj` with these lines in its material.
    fn material(&self, kind: &str, lines: &str) -> vitrum::Result<Scene> {
        self.scene(&format!(
            "[material.m]\nkind = {kind:?}\n{lines}\n[[object]]\nmesh = \"body.obj\"\nmaterial = \"m\"\n"
        ))
    }
}

fn dielectric(scene: &Scene, index: usize) -> &Dielectric {
    match &scene.materials[scene.objects[index].material].surface {
        Surface::Dielectric(dielectric) => dielectric,
        other => panic!("{other:?}"),
    }
}

fn opaque(scene: &Scene, index: usize) -> &Opaque {
    match &scene.materials[scene.objects[index].material].surface {
        Surface::Opaque(opaque) => opaque,
        other => panic!("{other:?}"),
    }
}
