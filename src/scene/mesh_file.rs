//! Files that hold meshes, of whatever format. In flow a path, out flows a [`MeshFile`].

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;

use super::files::Files;
use super::light::LightSource;
use super::mesh::Preparation;
use super::texture::Encoding;
use super::{Camera, Material, Mesh, gltf, obj};
use crate::Result;

/// What a mesh file holds.
#[derive(Clone, Debug, Default)]
pub struct MeshFile {
    /// Meshes, each of one material.
    pub meshes: Vec<Mesh>,
    /// Where they stand.
    pub parts: Vec<Part>,
    /// Materials that parts wear; their textures are indices into [`MeshFile::images`].
    pub materials: Vec<Material>,
    /// The images that they name, not opened yet.
    pub images: Vec<Image>,
    /// The first camera.
    pub camera: Option<Camera>,
    /// Lights.
    pub lights: Vec<LightSource>,
    /// Other files that were read.
    pub files: Vec<PathBuf>,
    /// What is wrong with the meshes, one line each.
    pub warnings: Vec<String>,
    /// What is wrong with the materials, which matters only to those who use them.
    pub material_warnings: Vec<String>,
    /// What is wrong with cameras and lights, which matters only where the file is the whole scene.
    pub scene_warnings: Vec<String>,
}

/// A mesh in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Index into [`MeshFile::meshes`].
    pub mesh: usize,
    /// Index into [`MeshFile::materials`].
    pub material: Option<usize>,
    /// From the mesh's space to that of the file.
    pub transform: DAffine3,
    /// Which object of the file it belongs to, from 0.
    pub object: usize,
}

/// An image that a material wears.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Where its bytes are.
    pub source: ImageSource,
    /// What they stand for.
    pub encoding: Encoding,
    /// Whether it stands in the place of the numbers that it would be multiplied with.
    pub replaces: bool,
}

/// Where the bytes of an image are.
#[derive(Clone, Debug, PartialEq)]
pub enum ImageSource {
    /// In a file of their own.
    File(PathBuf),
    /// In the mesh file.
    Embedded {
        /// What messages call it.
        name: PathBuf,
        /// As an image file holds them.
        bytes: Arc<[u8]>,
    },
    /// In a file for roughness, one for what is metal, or both.
    Finish([Option<Channel>; 2]),
}

/// One number of each texel of an image file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Channel {
    /// The file.
    pub path: PathBuf,
    /// Red, green, blue or alpha; `None`: how bright it is.
    pub number: Option<usize>,
}

impl MeshFile {
    /// Reads the mesh file at `path`, of a kind that [`check_kind`] lets pass; meshes are prepared first.
    pub fn read(files: Files, path: &Path, preparation: Preparation) -> Result<Self> {
        match is_gltf(path) {
            true => gltf::read(files, path, preparation),
            false => obj::read(files, path, preparation),
        }
    }
}

/// Whether the extension of `path` is one of glTF.
pub fn is_gltf(path: &Path) -> bool {
    extension(path).is_some_and(|extension| extension == "gltf" || extension == "glb")
}

/// Whether the extension of `path` is one of a mesh that is read; the error says what to do.
pub fn check_kind(path: &Path) -> Result<(), String> {
    match extension(path).as_deref() {
        Some("obj" | "glb" | "gltf") => Ok(()),
        _ => Err("is no mesh of a known kind; known: .obj, .glb, .gltf".into()),
    }
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase())
}

/// The materials that parts wear: a library may hold many more, and their images.
pub fn worn(parts: &mut [Part], materials: Vec<Material>) -> Vec<Material> {
    let mut numbers = vec![None; materials.len()];
    let mut count = 0;
    for number in parts.iter_mut().filter_map(|part| part.material.as_mut()) {
        *number = *numbers[*number].get_or_insert_with(|| {
            count += 1;
            count - 1
        });
    }
    let mut worn: Vec<_> = numbers.into_iter().zip(materials).filter_map(|(number, m)| Some((number?, m))).collect();
    worn.sort_by_key(|(number, _)| *number);
    worn.into_iter().map(|(_, material)| material).collect()
}

/// Keeps the first of the remarks from `start` on, and says how many more of `what` there are.
pub fn shorten(remarks: &mut Vec<String>, start: usize, what: &str) {
    const MOST: usize = 8;
    let more = remarks.len().saturating_sub(start + MOST);
    if more > 0 {
        remarks.truncate(start + MOST);
        remarks.push(format!("... {more} more {what}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_remarks_become_a_few() {
        let mut remarks: Vec<_> = (0..10).map(|number| format!("fault {number}")).collect();
        shorten(&mut remarks, 2, "faults");
        assert_eq!((remarks.len(), remarks[9].as_str()), (10, "fault 9"));
        remarks.push("fault 10".into());
        shorten(&mut remarks, 2, "faults");
        assert_eq!((remarks.len(), remarks[10].as_str()), (11, "... 1 more faults"));
    }

    #[test]
    fn kinds_are_told_by_their_extension() {
        for (name, gltf) in [("a.obj", false), ("a.GLB", true), ("a.b.gltf", true)] {
            assert_eq!((check_kind(Path::new(name)), is_gltf(Path::new(name))), (Ok(()), gltf), "{name}");
        }
        assert!(check_kind(Path::new("a.fbx")).unwrap_err().contains(".obj, .glb, .gltf"));
    }
}
