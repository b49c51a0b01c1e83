//! Puts meshes in their places. In flow mesh files and where they stand, out flow meshes, objects and the materials
//! and textures that the files bring along; a file is read once, however many objects show it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DAffine3;

use super::files::Files;
use super::obj::{self, ObjFile};
use super::texture::Textures;
use super::{Bounds, Material, Mesh, Object, Surface};
use crate::Result;

/// Meshes, objects, materials and textures so far.
#[derive(Debug, Default)]
pub struct Assembly {
    pub meshes: Vec<Arc<Mesh>>,
    pub objects: Vec<Object>,
    pub materials: Vec<Material>,
    pub textures: Textures,
    pub warnings: Vec<String>,
    /// Meshes are mended beyond what [`Mesh::new`] does.
    repair: bool,
    read: HashMap<PathBuf, MeshFile>,
    clear_glass: Option<usize>,
}

/// A file that was read.
#[derive(Debug)]
struct MeshFile {
    /// Index of the mesh and, within the file, of its material.
    parts: Vec<(usize, Option<usize>)>,
    /// With indices into `images`, until they are worn.
    materials: Vec<Material>,
    images: Vec<PathBuf>,
    warnings: Vec<String>,
    /// Where the materials went, once something wears them.
    first_material: Option<usize>,
}

/// Where an object stands.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub number: usize,
    pub transform: DAffine3,
    pub smooth: bool,
}

/// What parts of a mesh file wear.
#[derive(Clone, Copy, Debug)]
pub enum Wear {
    /// The material with this index.
    Material(usize),
    /// What the file says, or clear glass.
    Own,
    /// Clear glass, whatever the file says.
    ClearGlass,
}

impl Assembly {
    /// Nothing yet; meshes to come are mended where `repair` says so.
    pub fn new(repair: Option<bool>) -> Self {
        Self { repair: repair == Some(true), ..Self::default() }
    }

    /// Reads mesh files ahead, several at once. The first that cannot be read is the error.
    pub fn read_ahead<'a>(&mut self, files: Files, paths: impl Iterator<Item = &'a Path>) -> Result<()> {
        let mut distinct: Vec<(PathBuf, &Path)> = Vec::new();
        for path in paths {
            let identity = files.identity(path);
            if !self.read.contains_key(&identity) && !distinct.iter().any(|(known, _)| *known == identity) {
                distinct.push((identity, path));
            }
        }
        let repair = self.repair;
        let next = AtomicUsize::new(0);
        let work = || {
            let next = || distinct.get(next.fetch_add(1, Ordering::Relaxed));
            std::iter::from_fn(next)
                .map(|(identity, path)| (identity, obj::read(files, path, repair)))
                .collect::<Vec<_>>()
        };
        let workers = std::thread::available_parallelism().map_or(1, usize::from).min(distinct.len());
        let mut results: HashMap<_, _> = std::thread::scope(|scope| {
            let others: Vec<_> = (1..workers).map(|_| scope.spawn(work)).collect();
            let own = work();
            own.into_iter().chain(others.into_iter().filter_map(|worker| worker.join().ok()).flatten()).collect()
        });
        for (identity, _) in &distinct {
            if let Some(file) = results.remove(identity) {
                self.keep(identity.clone(), file?);
            }
        }
        Ok(())
    }

    fn keep(&mut self, identity: PathBuf, file: ObjFile) {
        let ObjFile { parts, materials, images, mut warnings, material_warnings } = file;
        self.warnings.append(&mut warnings);
        let mut indices = Vec::with_capacity(parts.len());
        for part in parts {
            indices.push((self.meshes.len(), part.material));
            self.meshes.push(Arc::new(part.mesh));
        }
        let file = MeshFile { parts: indices, materials, images, warnings: material_warnings, first_material: None };
        self.read.insert(identity, file);
    }

    /// Adds the parts of the mesh file at `path` as one object.
    pub fn add(&mut self, files: Files, path: &Path, wear: Wear, place: &Placement) -> Result<()> {
        let identity = files.identity(path);
        if !self.read.contains_key(&identity) {
            let file = obj::read(files, path, self.repair)?;
            self.keep(identity.clone(), file);
        }
        let Some(file) = self.read.get_mut(&identity) else { return Ok(()) };
        let own = matches!(wear, Wear::Own);
        if own && file.first_material.is_none() {
            file.first_material = Some(self.materials.len());
            self.warnings.append(&mut file.warnings);
            for mut material in file.materials.drain(..) {
                open_image(files, &mut material, &file.images, &mut self.textures, &mut self.warnings);
                self.materials.push(material);
            }
        }
        if matches!(wear, Wear::ClearGlass) && !file.materials.is_empty() {
            let count = file.materials.len();
            self.warnings.push(format!("{}: shown as clear glass, not with its {count} materials", path.display()));
        }
        let first_material = file.first_material.unwrap_or(0);
        for &(mesh, own) in &file.parts {
            let material = match (wear, own) {
                (Wear::Material(material), _) => material,
                (Wear::Own, Some(own)) => first_material + own,
                (Wear::Own, None) | (Wear::ClearGlass, _) => *self.clear_glass.get_or_insert_with(|| {
                    self.materials.push(Material::clear_glass());
                    self.materials.len() - 1
                }),
            };
            let Placement { number, transform, smooth } = *place;
            self.objects.push(Object { mesh, material, number, transform, smooth });
        }
        Ok(())
    }

    /// The files that were read so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.read.keys().cloned().collect()
    }

    /// The box around an object in the world.
    pub fn bounds_of(&self, object: &Object) -> Bounds {
        Bounds::around_positions(&self.meshes[object.mesh].positions, &object.transform)
    }

    /// The box around all objects.
    pub fn bounds(&self) -> Bounds {
        self.objects.iter().fold(Bounds::EMPTY, |all, object| all.union(self.bounds_of(object)))
    }
}

/// Puts the texture in the place of an index into the `images` of a mesh file. As anywhere in such a file, an image
/// that cannot be read is a warning.
fn open_image(
    files: Files,
    material: &mut Material,
    images: &[PathBuf],
    textures: &mut Textures,
    warnings: &mut Vec<String>,
) {
    let Surface::Opaque(opaque) = &mut material.surface else { return };
    let Some(image) = opaque.base_color_texture else { return };
    opaque.base_color_texture = textures
        .open(files, &images[image], warnings)
        .map_err(|error| {
            warnings.push(format!("{}; material {:?} has its colour instead", error.in_full(), material.name))
        })
        .ok();
}

/// Whether the extension at `path` is one of a mesh that is read; the error says what to do.
pub fn check_mesh_kind(path: &Path) -> Result<(), String> {
    match path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase()).as_deref() {
        Some("obj") => Ok(()),
        Some("glb" | "gltf") => Err("glTF is not read yet; convert to .obj".into()),
        _ => Err("is no mesh of a known kind; known: .obj".into()),
    }
}
