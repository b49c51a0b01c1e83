//! Scenes: plain data, read from files, without a Vulkan type.
//!
//! In flow a scene file, a bare mesh or nothing (the built-in scene); out flows one [`Scene`]: environment, camera,
//! lights, materials, meshes and the objects that place them. Lengths are metres, angles radians (degrees in files),
//! y is up, the system right-handed, colours and radiance are linear Rec. 709.

mod builtin;
mod camera;
mod environment;
mod file;
mod material;
mod mesh;
mod obj;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};

pub use camera::Camera;
pub use environment::{Environment, Panorama, Surroundings};
pub use material::{Dielectric, Material, Opaque, Surface};
pub use mesh::{Mesh, MeshFaults};

use crate::Result;
use crate::options::RenderArgs;

/// Everything that a picture shows.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the stats call it: the path as given, or "built-in".
    pub name: String,
    /// What surrounds the objects.
    pub environment: Environment,
    /// Where it is seen from.
    pub camera: Camera,
    /// Point lights.
    pub lights: Vec<PointLight>,
    /// Materials, each with its name.
    pub materials: Vec<Material>,
    /// Meshes; several objects may share one.
    pub meshes: Vec<Mesh>,
    /// The meshes in their places.
    pub objects: Vec<Object>,
    /// The scene's own render options.
    pub render: RenderArgs,
    /// What was repaired or is worth knowing, one line each.
    pub warnings: Vec<String>,
}

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Position in metres.
    pub position: DVec3,
    /// Radiant intensity in W/sr, linear Rec. 709.
    pub intensity: DVec3,
}

/// A mesh in its place.
#[derive(Clone, Debug)]
pub struct Object {
    /// Index into [`Scene::meshes`].
    pub mesh: usize,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// The number of the object in the scene file, from 0: the parts of one mesh file share it.
    pub number: usize,
    /// From the mesh's space to the world.
    pub transform: DAffine3,
    /// Normals are interpolated; false, or a mesh without normals: those of the faces.
    pub smooth: bool,
}

/// What a command line puts in the place of what a scene says.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Index of every dielectric.
    pub ior: Option<f64>,
    /// Roughness of every dielectric.
    pub roughness: Option<f64>,
    /// Environment image.
    pub environment: Option<PathBuf>,
}

impl Scene {
    /// The built-in scene, a `.toml` scene, or a bare mesh framed automatically.
    pub fn load(path: Option<&Path>, overrides: &Overrides) -> Result<Self> {
        todo!()
    }
}
