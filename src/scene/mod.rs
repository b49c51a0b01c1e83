//! Scenes: plain data, read from files, without a Vulkan type.
//!
//! In flow a scene file, a bare mesh or nothing (the built-in scene); out flows one [`Scene`]: environment, camera,
//! lights, materials, meshes and the objects that place them. Lengths are metres, angles radians (degrees in files),
//! y is up, the system right-handed, colours and radiance are linear Rec. 709.

mod assembly;
mod bounds;
mod builtin;
mod camera;
mod containment;
mod doctor;
mod environment;
mod faults;
mod file;
mod files;
mod gltf;
mod light;
mod maps;
mod material;
mod mesh;
mod mesh_file;
mod mtl;
mod obj;
mod obj_text;
pub(crate) mod render_table;
mod settings;
mod smoothing;
pub(crate) mod table;
mod texture;
mod topology;
mod touching;
mod walls;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;

pub use bounds::Bounds;
pub use camera::Camera;
pub use doctor::{Ailment, Diagnosis, Finding, Mending, Nest, Nesting};
pub use environment::{Environment, Panorama, Repairs, Surroundings};
pub(crate) use files::Files;
pub use light::{Cone, PointLight};
pub use maps::{Cutout, NormalMap, TextureMap, Wrap};
pub use material::{Coating, Dielectric, Dispersion, GLASSES, Glass, Material, Opaque, Sellmeier, Surface};
pub use mesh::{FaultSites, Mesh, MeshFaults, Preparation, RawMesh, Refusal};
pub use texture::{Encoding, Texels, Texture};
pub use touching::Touch;

use crate::options::RenderArgs;
use crate::{Error, Result};
use assembly::{Assembly, Placement, Wear};
use faults::{faults_of_meshes, idle_insides, missing_uvs, panes_of_open_bodies};
use file::{EnvironmentTable, Light, SceneFile};
use light::LightSource;
use mesh_file::MeshFile;

/// Everything that a picture shows.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the stats call it: the path as given, or "built-in".
    pub name: String,
    /// What surrounds the objects.
    pub environment: Environment,
    /// Where it is seen from.
    pub camera: Camera,
    /// The camera was not given: [`Scene::frame`] may move it.
    pub framed: bool,
    /// Lights without extent.
    pub lights: Vec<PointLight>,
    /// Materials, each with its name.
    pub materials: Vec<Material>,
    /// The images that materials name; several may share one.
    pub textures: Vec<Arc<Texture>>,
    /// Meshes; several objects may share one.
    pub meshes: Vec<Arc<Mesh>>,
    /// The meshes in their places.
    pub objects: Vec<Object>,
    /// The scene's own render options.
    pub render: RenderArgs,
    /// What was repaired or is worth knowing, one line each.
    pub warnings: Vec<String>,
    /// The files that it was read from, as far as they are on disk: it is another where one of them changes.
    pub files: Vec<PathBuf>,
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
    /// From the mesh's space to the world. A negative determinant mirrors: the outside is then where triangles show their
    /// clockwise side.
    pub transform: DAffine3,
    /// Normals are interpolated; false, or a mesh without normals: those of the faces.
    pub smooth: bool,
}

/// What a command line puts in the place of what a scene says.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Index of every dielectric, in the place of that of a glass and its dispersion.
    pub ior: Option<f64>,
    /// Roughness of every dielectric.
    pub roughness: Option<f64>,
    /// Environment image.
    pub environment: Option<PathBuf>,
    /// Single values, as [`Scene::set`] takes them; they win over the others.
    pub settings: Vec<String>,
    /// Meshes are repaired, or not, whatever the scene's own render options say: docs/doctor.md.
    pub repair: Option<bool>,
    /// Normals that meshes lack are made across edges of at most so many degrees.
    pub smooth_angle: Option<f64>,
    /// The scene's own render options count for nothing.
    pub no_render_table: bool,
}

impl Scene {
    /// The built-in scene, a `.toml` scene, or a bare mesh framed automatically.
    ///
    /// `overrides` win over the scene's `[render]` table, which wins over what its materials and environment say.
    pub fn load(path: Option<&Path>, overrides: &Overrides) -> Result<Self> {
        overrides.check()?;
        let Some(path) = path else { return Self::built_in(builtin::SCENE, "built-in", overrides) };
        let name = path.display().to_string();
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let mut scene = match extension.as_deref() {
            Some("toml") => Self::from_file(file::read(Files::Disk, path, overrides)?, name, overrides),
            Some("obj" | "glb" | "gltf") => Self::from_file(bare_mesh(path, overrides)?, name, overrides),
            _ if path.is_dir() => {
                Err(Error::input(path, 0, "is a folder; name a .toml (scene), .glb, .gltf or .obj (mesh) in it"))
            }
            _ => Err(Error::input(
                path,
                0,
                "is no scene of a known kind; known: .toml (scene), .glb, .gltf, .obj (mesh)",
            )),
        }?;
        scene.files.push(path.into());
        Ok(scene)
    }

    /// A small scene that calls for every effect.
    pub fn of_every_effect() -> Result<Self> {
        Self::built_in(builtin::EVERY_EFFECT, "every effect", &Overrides::default())
    }

    /// A small scene of one body of clear glass.
    pub fn of_clear_glass() -> Result<Self> {
        Self::built_in(builtin::CLEAR_GLASS, "clear glass", &Overrides::default())
    }

    fn built_in(path: &str, name: &str, overrides: &Overrides) -> Result<Self> {
        Self::from_file(file::read(Files::BuiltIn, Path::new(path), overrides)?, name.into(), overrides)
    }

    fn from_file(file: SceneFile, name: String, overrides: &Overrides) -> Result<Self> {
        let SceneFile { environment, camera, lights, render, assembly } = file;
        let render = if overrides.no_render_table { RenderArgs::default() } else { render };
        let overrides = Overrides {
            ior: overrides.ior.or(render.ior),
            roughness: overrides.roughness.or(render.roughness),
            environment: overrides.environment.clone().or_else(|| render.env.clone()),
            ..overrides.clone()
        };
        let framed = camera.is_none();
        let camera = camera.unwrap_or_else(|| Camera::framing(assembly.bounds(), 1.0));
        let mut files = assembly.files();
        let Assembly { meshes, mut objects, mut materials, textures, decided, mut warnings, .. } = assembly;
        files.extend(textures.files);
        let textures = textures.all;
        for material in &mut materials {
            // Most files that blend have nothing to blend.
            let is_whole = |cutout: &Cutout| {
                let has_alpha = cutout.map.is_some_and(|map| textures[map.texture].has_alpha());
                !has_alpha && cutout.alpha >= cutout.cutoff.unwrap_or(1.0)
            };
            material.cutout = material.cutout.filter(|cutout| !is_whole(cutout));
        }
        let opened = panes_of_open_bodies(&mut objects, &meshes, &mut materials, &decided);
        for material in &mut materials {
            if let Surface::Dielectric(dielectric) = &mut material.surface {
                if let Some(ior) = overrides.ior {
                    dielectric.set_ior(ior);
                }
                if let Some(roughness) = overrides.roughness {
                    (dielectric.roughness, dielectric.metallic_roughness_texture) = (roughness, None);
                }
            }
        }
        let EnvironmentTable { light, intensity, rotation, visible } = environment;
        let light = match overrides.environment.map_or(light, |path| Light::Image(Files::Disk, path)) {
            Light::Image(from, path) => {
                let panorama = Panorama::read(from, &path, &mut warnings)?;
                files.push(path);
                Surroundings::Image(panorama)
            }
            Light::Color(color) => Surroundings::Color(color),
        };
        let environment = Environment { light, intensity, rotation, visible };
        files.retain(|file| file.is_file());
        files.sort();
        files.dedup();
        let mut scene = Self {
            name,
            environment,
            camera,
            framed,
            lights,
            materials,
            textures,
            meshes,
            objects,
            render,
            warnings,
            files,
        };
        scene.set(&overrides.settings)?;
        let repaired = overrides.repair.or(scene.render.repair) == Some(true);
        let faults = faults_of_meshes(&scene, &opened, repaired);
        scene.warnings.splice(0..0, faults);
        let idle = [missing_uvs(&scene), idle_insides(&scene)].concat();
        scene.warnings.extend(idle);
        Ok(scene)
    }

    /// Moves a camera that was not given, so that an image that is `aspect` times as wide as high shows all objects.
    pub fn frame(&mut self, aspect: f64) {
        if self.framed {
            self.camera = Camera::framing(self.bounds().unwrap_or(Bounds::EMPTY), aspect);
        }
    }

    /// The glass of an object that has an inside.
    pub fn body(&self, object: &Object) -> Option<&Dielectric> {
        self.materials[object.material].surface.body()
    }

    /// The box around `object` in the world.
    pub fn bounds_of(&self, object: &Object) -> Bounds {
        Bounds::around_positions(&self.meshes[object.mesh].positions, &object.transform)
    }

    /// The box around all objects, if there are any.
    pub fn bounds(&self) -> Option<Bounds> {
        let bounds = self.objects.iter().fold(Bounds::EMPTY, |all, object| all.union(self.bounds_of(object)));
        (!bounds.is_empty()).then_some(bounds)
    }
}

/// A mesh file in the default environment: glTF as the scene that it is, anything else as clear glass.
fn bare_mesh(path: &Path, overrides: &Overrides) -> Result<SceneFile> {
    mesh_file::check_kind(path).map_err(|message| Error::input(path, 0, message))?;
    let mut assembly = Assembly::new(overrides.preparation(&Overrides::default()));
    let (wear, number) = match mesh_file::is_gltf(path) {
        true => (Wear::Own, None),
        false => (Wear::ClearGlass, Some(0)),
    };
    let place = Placement { number, transform: DAffine3::IDENTITY, smooth: true };
    let MeshFile { camera, lights, scene_warnings, .. } = assembly.add(Files::Disk, path, wear, &place)?;
    let (camera, lights, mut warnings) = (*camera, std::mem::take(lights), std::mem::take(scene_warnings));
    let lights = LightSource::placed(&lights, || assembly.bounds());
    // A file's camera looks along a direction: what it turns around lies as far off as the middle of the scene.
    let camera = camera.map(|camera| camera.aimed_at(assembly.bounds().center()));
    assembly.warnings.append(&mut warnings);
    assembly.check_reach(0).map_err(|message| Error::input(path, 0, message))?;
    let (environment, render) = (EnvironmentTable::default(), RenderArgs::default());
    Ok(SceneFile { environment, camera, lights, render, assembly })
}

impl Overrides {
    /// Those among the options of a render.
    pub fn of(args: &RenderArgs) -> Self {
        Self {
            ior: args.ior,
            roughness: args.roughness,
            environment: args.env.clone(),
            settings: args.set.clone().unwrap_or_default(),
            repair: args.repair,
            smooth_angle: args.smooth_angle,
            no_render_table: args.no_render_table == Some(true),
        }
    }

    /// What is done to meshes, as these or else the scene's own say.
    fn preparation(&self, own: &Self) -> Preparation {
        Preparation {
            repair: self.repair.or(own.repair).unwrap_or(false),
            smooth_angle: self.smooth_angle.or(own.smooth_angle).map(f64::to_radians),
        }
    }

    fn check(&self) -> Result<()> {
        if let Some(ior) = self.ior.filter(|ior| !(1e-6..=1e6).contains(ior)) {
            return Err(Error::Usage(format!(
                "index of refraction {ior}: expected a number above 0, from 1e-6 to 1e6"
            )));
        }
        if let Some(roughness) = self.roughness.filter(|roughness| !(0.0..=1.0).contains(roughness)) {
            return Err(Error::Usage(format!("roughness {roughness}: expected a number from 0 to 1")));
        }
        Ok(())
    }
}
