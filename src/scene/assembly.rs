//! Puts meshes in their places. In flow mesh files and where they stand, out flow meshes, objects and the materials
//! and textures that the files bring along; a file is read once, however many objects show it.

use std::collections::hash_map::Entry;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DAffine3, DVec3};

use super::files::Files;
use super::mesh::{FARTHEST, Preparation};
use super::mesh_file::{Image, ImageSource, MeshFile};
use super::texture::Textures;
use super::{Bounds, Material, Mesh, Object, Opaque, Surface, TextureMap};
use crate::Result;

/// Meshes, objects, materials and textures so far.
#[derive(Debug, Default)]
pub struct Assembly {
    pub meshes: Vec<Arc<Mesh>>,
    pub objects: Vec<Object>,
    pub materials: Vec<Material>,
    pub textures: Textures,
    pub warnings: Vec<String>,
    /// Materials that a scene file says of whether they are panes.
    pub decided: HashSet<usize>,
    preparation: Preparation,
    read: HashMap<PathBuf, Loaded>,
    clear_glass: Option<usize>,
}

/// A file that was read.
#[derive(Debug)]
struct Loaded {
    /// What it holds, but for the meshes.
    file: MeshFile,
    /// Where its meshes went.
    first_mesh: usize,
    /// Where the materials went, once something wears them.
    first_material: Option<usize>,
}

impl Loaded {
    /// Moves what `file` holds to all other `meshes`, and what is wrong with them to the `warnings`.
    fn new(mut file: MeshFile, meshes: &mut Vec<Arc<Mesh>>, warnings: &mut Vec<String>) -> Self {
        warnings.append(&mut file.warnings);
        let first_mesh = meshes.len();
        meshes.extend(std::mem::take(&mut file.meshes).into_iter().map(Arc::new));
        Self { file, first_mesh, first_material: None }
    }
}

/// Where an object stands.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// The number of the object; `None`: each object of the file counts as one.
    pub number: Option<usize>,
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
    /// Nothing yet; meshes to come are prepared like that.
    pub fn new(preparation: Preparation) -> Self {
        Self { preparation, ..Self::default() }
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
        let preparation = self.preparation;
        let next = AtomicUsize::new(0);
        let work = || {
            let next = || distinct.get(next.fetch_add(1, Ordering::Relaxed));
            std::iter::from_fn(next)
                .map(|(identity, path)| (identity, MeshFile::read(files, path, preparation)))
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
                let loaded = Loaded::new(file?, &mut self.meshes, &mut self.warnings);
                self.read.insert(identity.clone(), loaded);
            }
        }
        Ok(())
    }

    /// Adds what the mesh file at `path` holds. Out flows what else there is in it.
    pub fn add(&mut self, files: Files, path: &Path, wear: Wear, place: &Placement) -> Result<&mut MeshFile> {
        let loaded = match self.read.entry(files.identity(path)) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => {
                let file = MeshFile::read(files, path, self.preparation)?;
                place.insert(Loaded::new(file, &mut self.meshes, &mut self.warnings))
            }
        };
        let Loaded { file, first_mesh, first_material } = loaded;
        let own = matches!(wear, Wear::Own);
        if own && first_material.is_none() {
            *first_material = Some(self.materials.len());
            self.warnings.append(&mut file.material_warnings);
            for mut material in file.materials.drain(..) {
                open_images(files, &mut material, &file.images, &mut self.textures, &mut self.warnings);
                self.materials.push(material);
            }
        }
        if matches!(wear, Wear::ClearGlass) && !file.materials.is_empty() {
            let count = file.materials.len();
            self.warnings.push(format!("{}: shown as clear glass, not with its {count} materials", path.display()));
        }
        let first_material = first_material.unwrap_or(0);
        for part in &file.parts {
            let material = match (wear, part.material) {
                (Wear::Material(material), _) => material,
                (Wear::Own, Some(own)) => first_material + own,
                (Wear::Own, None) | (Wear::ClearGlass, _) => *self.clear_glass.get_or_insert_with(|| {
                    self.materials.push(Material::clear_glass());
                    self.materials.len() - 1
                }),
            };
            self.objects.push(Object {
                mesh: *first_mesh + part.mesh,
                material,
                number: place.number.unwrap_or(part.object),
                transform: place.transform * part.transform,
                smooth: place.smooth,
            });
        }
        Ok(file)
    }

    /// Whether the objects from `first` on are where they can be rendered; the error says what to do.
    pub fn check_reach(&self, first: usize) -> Result<(), String> {
        let reach = self.objects[first..].iter().map(|object| self.bounds_of(object).reach()).fold(0.0, f64::max);
        match reach <= FARTHEST {
            true => Ok(()),
            false => Err(format!("the object reaches {reach:.1e} m; at most 1e9 m can be rendered, scale it down")),
        }
    }

    /// The files that were read so far.
    pub fn files(&self) -> Vec<PathBuf> {
        self.read.iter().flat_map(|(path, read)| std::iter::once(path).chain(&read.file.files)).cloned().collect()
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

/// Puts textures in the places of indices into the `images` of a mesh file. As anywhere in such a file, an image that
/// cannot be read is a warning.
fn open_images(
    files: Files,
    material: &mut Material,
    images: &[Image],
    textures: &mut Textures,
    warnings: &mut Vec<String>,
) {
    let name = material.name.clone();
    let finish = match &material.surface {
        Surface::Opaque(opaque) => opaque.metallic_roughness_texture,
        Surface::Dielectric(glass) => glass.metallic_roughness_texture,
    };
    let color = match &material.surface {
        Surface::Opaque(opaque) => opaque.base_color_texture,
        Surface::Dielectric(_) => None,
    };
    let replaced = |map: Option<TextureMap>| map.map(|map| &images[map.texture]).filter(|image| image.replaces);
    let (color, finish) = (replaced(color).is_some(), replaced(finish).map(|image| &image.source));
    let shines = matches!(&material.surface, Surface::Opaque(opaque) if opaque.emission_texture.is_some());
    material.retain_maps(|map| match textures.open(files, &images[map.texture], warnings) {
        Ok(texture) => {
            map.texture = texture;
            true
        }
        Err(error) => {
            warnings.push(format!("{}; material {name:?} goes without it", error.in_full()));
            false
        }
    });
    if let Surface::Opaque(Opaque { emission, emission_texture: None, .. }) = &mut material.surface
        && shines
    {
        // Where an image does not say what shines nothing does.
        *emission = DVec3::ZERO;
    }
    if let Surface::Opaque(Opaque { base_color, base_color_texture: Some(_), .. }) = &mut material.surface
        && color
    {
        *base_color = DVec3::ONE;
    }
    if let Some(ImageSource::Finish([rough, metal])) = finish {
        match &mut material.surface {
            Surface::Opaque(opaque) if opaque.metallic_roughness_texture.is_some() => {
                opaque.roughness = if rough.is_some() { 1.0 } else { opaque.roughness };
                opaque.metallic = if metal.is_some() { 1.0 } else { opaque.metallic };
            }
            Surface::Dielectric(glass) if glass.metallic_roughness_texture.is_some() => glass.roughness = 1.0,
            _ => {}
        }
    }
}
