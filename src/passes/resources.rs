//! The scene on the device.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bytemuck::NoUninit;
use glam::DVec3;
use half::f16;
use xxhash_rust::xxh3::Xxh3;

use super::double::{Facet, Placed};
use super::emitters;
use super::geometry::{Draw, Geometry, Layout};
use super::materials::{Maps, is_rough, materials, texels};
use super::skylight;
use super::tangents::tangents;
use super::view::View;
use crate::effects::Effect;
use crate::gpu::{
    AccelerationStructure, Bind, BindGroup, Buffer, Commands, Format, Frame, Gpu, GpuError, Image, ImageDesc,
    LightRecord, MaterialRecord, MeshStructures, Result, Specialization, Use,
};
use crate::options::{Model, Trace};
use crate::plan::{Budget, Estimator, Plan};
use crate::scene::{Panorama, PointLight, Scene, Surroundings, Texture};

/// The id of `ENVIRONMENT_IMAGE` in `shaders/environment.glsl`.
const ENVIRONMENT_IMAGE: u32 = 64;

/// The ids of the same names in `shaders/path.glsl`.
const SAMPLE_LIGHTS: u32 = 66;
const SAMPLE_SURFACES: u32 = 67;
const BRANCHES: u32 = 68;

/// The id of `FOOTPRINTS` in `shaders/footprint.glsl`.
const FOOTPRINTS: u32 = 65;

/// Buffers and images that every pass sees, as one group.
pub(super) struct Resources {
    pub(super) group: BindGroup,
    /// The same with what only traced models read.
    pub(super) traced: Vec<Bind>,
    /// The table of what shines, for paths.
    pub(super) emitters: Bind,
    /// The group with what only `double` reads.
    pub(super) layered: Vec<Bind>,
    /// The instances in the picture, of `double`.
    pub(super) placed: Vec<Placed>,
    /// The instances, in their order.
    pub(super) draws: Vec<Draw>,
    /// Of each its object in the scene.
    pub(super) objects: Vec<usize>,
    pub(super) specialization: Specialization,
    /// From lengths on the device to metres.
    pub(super) metres_per_unit: f64,
    /// Whether surfaces are lit that let nothing through.
    pub(super) opaque: bool,
    /// Host time that hierarchies took, if there are any.
    pub(super) acceleration: Option<Duration>,
    frame: (Frame, Arc<Buffer>),
    /// A number that tells all of this from other scenes, if the plan has a use for it.
    pub(super) fingerprint: Option<u128>,
    meshes: Arc<Meshes>,
    sky: Arc<Sky>,
    textures: Arc<Textures>,
}

/// Meshes on the device: what stays while views, materials and places change.
struct Meshes {
    layout: Layout,
    positions: Bind,
    normals: Bind,
    triangles: Bind,
    traced: Option<TracedMeshes>,
    /// For `double`.
    facets: Option<Bind>,
    /// Where tangents begin behind the coordinates, if there are any.
    first_tangent: Option<u32>,
}

/// What only traced models read of meshes.
struct TracedMeshes {
    corners: Bind,
    uvs: Bind,
    hierarchies: Hierarchies,
}

/// A hierarchy a mesh.
enum Hierarchies {
    /// Behind room for so many nodes of the one over the instances.
    Nodes(Arc<Buffer>, u32),
    Structures(Arc<MeshStructures>),
}

impl Meshes {
    /// Whether these are the meshes of `scene`, as `plan` and `trace` need them, with room for so many nodes.
    fn is_of(&self, scene: &Scene, plan: &Plan, trace: Option<Trace>, room: u32) -> bool {
        let fits = match &self.traced {
            Some(TracedMeshes { hierarchies: Hierarchies::Nodes(_, here), .. }) => *here == room,
            _ => true,
        };
        let has_tangents = trace.is_some() && plan.effects.contains(Effect::NormalMaps);
        fits && self.layout.is_of(scene, trace)
            && self.facets.is_some() == (plan.model == Model::Double)
            && self.first_tangent.is_some() == has_tangents
    }

    fn new(
        upload: &mut Upload<'_>,
        scene: &Scene,
        plan: &Plan,
        trace: Option<Trace>,
        room: u32,
    ) -> Result<(Self, Duration)> {
        let start = Instant::now();
        let (layout, mut arrays) = Layout::new(scene, trace);
        let mut acceleration = start.elapsed();
        let has_tangents = trace.is_some() && plan.effects.contains(Effect::NormalMaps);
        let first_tangent = has_tangents.then_some(arrays.uvs.len() as u32 / 2);
        if has_tangents {
            arrays.uvs.extend(scene.meshes.iter().flat_map(|mesh| tangents(mesh)).flatten());
        }
        let mut traced = None;
        if let Some(trace) = trace {
            let corners = Arc::new(upload.commands.upload_buffer("corners of the triangles", &arrays.corners)?);
            let start = Instant::now();
            let hierarchies = match trace {
                Trace::Hardware => {
                    let built = MeshStructures::new(upload.commands, &corners, &layout.ranges)?;
                    acceleration += start.elapsed();
                    Hierarchies::Structures(Arc::new(built))
                }
                Trace::Software => {
                    let mut nodes = vec![[0; 20]; room as usize];
                    nodes.extend(arrays.nodes.iter());
                    upload.hash(&nodes);
                    let nodes = upload.commands.upload_buffer("nodes of the hierarchies", &nodes)?;
                    Hierarchies::Nodes(Arc::new(nodes), room)
                }
            };
            let uvs = upload.buffer("texture coordinates", &arrays.uvs)?;
            traced = Some(TracedMeshes { corners: Bind::Buffer(corners), uvs, hierarchies });
        }
        let facets = match plan.model {
            Model::Double => Some(upload.buffer("facets", &Facet::all(&layout, &arrays))?),
            _ => None,
        };
        let meshes = Self {
            positions: upload.buffer("positions", &arrays.positions)?,
            normals: upload.buffer("normals", &arrays.normals)?,
            triangles: upload.buffer("triangles", &arrays.triangles)?,
            layout,
            traced,
            facets,
            first_tangent,
        };
        Ok((meshes, acceleration))
    }
}

/// The environment on the device.
struct Sky {
    /// The texels that it was made of, if those are an image's.
    texels: Option<Arc<Vec<[f32; 3]>>>,
    size: [u32; 2],
    levels: u32,
    image: Bind,
    /// Its table for paths that look for light, if there are such, and how many texels that has.
    cells: Option<Bind>,
}

impl Sky {
    fn is_of(&self, panorama: Option<&Panorama>, levels: u32, cells: bool) -> bool {
        let same = match (&self.texels, panorama) {
            (Some(texels), Some(panorama)) => {
                Arc::ptr_eq(texels, &panorama.texels) && self.size == [panorama.width, panorama.height]
            }
            (None, None) => true,
            _ => false,
        };
        same && self.levels == levels && self.cells.is_some() == cells
    }

    fn new(upload: &mut Upload<'_>, panorama: Option<&Panorama>, levels: u32, cells: bool) -> Result<Self> {
        let single = Panorama::new(1, 1, vec![[1.0; 3]]);
        let of = panorama.unwrap_or(&single);
        let image = upload_panorama(upload.commands, of, levels)?;
        upload.hash(&of.texels);
        upload.commands.run(|cmd| cmd.use_image(&image, Use::Sampled))?;
        let table = |panorama| upload.buffer("cells of the environment", &skylight::table(panorama));
        Ok(Self {
            texels: panorama.map(|panorama| panorama.texels.clone()),
            size: [of.width, of.height],
            levels,
            image: Bind::Sampled(Arc::new(image)),
            cells: panorama.filter(|_| cells).map(table).transpose()?,
        })
    }
}

/// Textures on the device.
struct Textures {
    of: Vec<Arc<Texture>>,
    maps: Maps,
    texels: Bind,
}

impl Textures {
    fn is_of(&self, textures: &[Arc<Texture>], maps: &Maps) -> bool {
        self.maps == *maps
            && self.of.len() == textures.len()
            && self.of.iter().zip(textures).all(|(a, b)| Arc::ptr_eq(a, b))
    }
}

/// Puts arrays on the device, and takes their fingerprint on the way.
struct Upload<'c> {
    commands: &'c mut Commands,
    hash: Option<Xxh3>,
}

impl Upload<'_> {
    fn hash<T: NoUninit>(&mut self, data: &[T]) {
        if let Some(hash) = &mut self.hash {
            hash.update(&(size_of_val(data) as u64).to_ne_bytes());
            hash.update(bytemuck::cast_slice(data));
        }
    }

    fn buffer<T: NoUninit>(&mut self, name: &str, data: &[T]) -> Result<Bind> {
        self.hash(data);
        Ok(Bind::Buffer(Arc::new(self.commands.upload_buffer(name, data)?)))
    }
}

/// Groups that `shaders/trace_software.glsl` has room for.
const TRACE_STACK: u32 = 48;

impl Resources {
    /// What `before` has of it stays where it is.
    pub(super) fn new(
        commands: &mut Commands,
        scene: &Scene,
        plan: &Plan,
        trace: Option<Trace>,
        before: Option<&Self>,
    ) -> Result<Self> {
        let view = View::new(&scene.camera, scene.bounds(), plan.size);
        let opaque = trace.is_some() && plan.effects.contains(Effect::Opaque);
        // All of a fingerprint has to be seen.
        let before = before.filter(|_| plan.checkpoint.is_none());
        let mut upload = Upload { commands, hash: plan.checkpoint.is_some().then(Xxh3::new) };

        let room = Geometry::room(scene.objects.len());
        let kept = before.map(|before| &before.meshes).filter(|meshes| meshes.is_of(scene, plan, trace, room));
        let (meshes, mut acceleration) = match kept {
            Some(meshes) => (meshes.clone(), Duration::ZERO),
            None => {
                let (meshes, acceleration) = Meshes::new(&mut upload, scene, plan, trace, room)?;
                (Arc::new(meshes), acceleration)
            }
        };
        let start = Instant::now();
        let geometry = Geometry::new(scene, &view, &meshes.layout, room, opaque);
        acceleration += start.elapsed();
        if geometry.depth > TRACE_STACK {
            return Err(GpuError::TooLarge {
                what: "the depth of the hierarchy over the triangles".into(),
                size: geometry.depth.to_string(),
                limit: TRACE_STACK.to_string(),
                advice: "remove triangles that are millions of times smaller than the others",
            });
        }
        let maps = Maps::new(scene, plan);
        let (mut materials, albedos) = materials(scene, plan, &view, &maps);
        if materials.is_empty() {
            // Shaders may read the first one before they know that nothing is there.
            materials.push(MaterialRecord::default());
        }
        let lights = lights(scene, &view);
        let panorama = match &scene.environment.light {
            Surroundings::Image(panorama) => Some(panorama),
            Surroundings::Color(_) => None,
        };
        let levels = levels(upload.commands.gpu(), panorama, scene, plan);
        let rough = plan.model == Model::Path && plan.effects.contains(Effect::Roughness);
        let cells = trace.is_some() && panorama.is_some() && (opaque || rough);
        let kept = before.map(|before| &before.sky).filter(|sky| sky.is_of(panorama, levels, cells));
        let sky = match kept {
            Some(sky) => sky.clone(),
            None => Arc::new(Sky::new(&mut upload, panorama, levels, cells)?),
        };
        let worn: &[_] = if maps.all.is_empty() { &[] } else { &scene.textures };
        let kept = before.map(|before| &before.textures).filter(|textures| textures.is_of(worn, &maps));
        let textures = match kept {
            Some(textures) => textures.clone(),
            None => {
                let texels = upload.buffer("texels", &texels(worn, &maps))?;
                Arc::new(Textures { of: worn.to_vec(), maps, texels })
            }
        };
        let ranked = ranked_materials(scene, &geometry);
        if ranked.len() > 1 << 16 {
            return Err(GpuError::TooLarge {
                what: "the number of dielectric objects".into(),
                size: (ranked.len() - 1).to_string(),
                limit: "65535".into(),
                advice: "join objects of one material into one mesh",
            });
        }
        let nests = trace.is_some() && plan.effects.contains(Effect::Nesting);
        let around = if nests { ranks_around_camera(scene, &geometry) } else { [0; 8] };
        let medium = (around[0] > 0).then(|| ranked[around[0] as usize]);
        let frame = Frame {
            environment_size: sky.size,
            environment_levels: levels,
            camera_bodies: std::array::from_fn(|i| around[2 * i] << 16 | around[2 * i + 1]),
            camera_index: medium.map_or(1.0, |medium| materials[medium as usize].refraction_index),
            camera_medium: medium.map_or(0, |medium| medium + 1),
            first_tangent: meshes.first_tangent.unwrap_or(0),
            ..frame(scene, plan, &view, lights.len() as u32)
        };
        upload.hash(&[paths_frame(frame)]);
        let frame_buffer = Arc::new(upload.commands.upload_buffer("frame", &[frame])?);
        let bindings = vec![
            Bind::Buffer(frame_buffer.clone()),
            upload.buffer("instances", &geometry.instances)?,
            upload.buffer("materials", &materials)?,
            upload.buffer("lights", &lights)?,
            meshes.positions.clone(),
            meshes.normals.clone(),
            meshes.triangles.clone(),
            sky.image.clone(),
            upload.buffer("albedos", &albedos)?,
        ];
        let mut traced = Vec::new();
        if let Some(of_meshes) = &meshes.traced {
            traced.clone_from(&bindings);
            let start = Instant::now();
            traced.push(match &of_meshes.hierarchies {
                Hierarchies::Structures(meshes) => {
                    let built = AccelerationStructure::new(upload.commands, meshes, &geometry.placed)?;
                    acceleration += start.elapsed();
                    Bind::Acceleration(Arc::new(built))
                }
                Hierarchies::Nodes(nodes, _) => {
                    upload.hash(&geometry.nodes);
                    upload.commands.update_buffer(nodes, &geometry.nodes)?;
                    Bind::Buffer(nodes.clone())
                }
            });
            traced.push(of_meshes.corners.clone());
            traced.push(upload.buffer("materials of the bodies", &ranked)?);
            traced.push(of_meshes.uvs.clone());
            traced.push(textures.texels.clone());
            traced.push(match &sky.cells {
                Some(cells) => cells.clone(),
                None => upload.buffer("cells of the environment", &skylight::none())?,
            });
        }
        let emitters = if trace.is_some() && opaque && plan.model == Model::Path {
            emitters::table(scene, &meshes.layout, &geometry)
        } else {
            emitters::none()
        };
        let emitters = upload.buffer("emitters", &emitters)?;
        let mut layered = Vec::new();
        let mut placed = Vec::new();
        if let Some(facets) = &meshes.facets {
            placed = Placed::all(scene, &geometry, &view, plan.size);
            layered.clone_from(&bindings);
            layered.push(facets.clone());
            layered.push(upload.buffer("instances in the picture", &placed)?);
        }
        let is_image = panorama.is_some();
        let footprints = plan.footprints && trace.is_some() && (is_image || !textures.maps.all.is_empty());
        let fingerprint = upload.hash.as_ref().map(Xxh3::digest128);
        Ok(Self {
            group: BindGroup::new(upload.commands.gpu(), "scene", bindings)?,
            traced,
            emitters,
            layered,
            placed,
            draws: geometry.draws,
            objects: geometry.objects,
            specialization: Specialization::effects(plan.effects)
                .with(ENVIRONMENT_IMAGE, is_image)
                .with(FOOTPRINTS, footprints)
                .with(BRANCHES, !(opaque && Effect::Opaque.called_for_by(scene)))
                .with(SAMPLE_LIGHTS, plan.estimator != Estimator::Surfaces)
                .with(SAMPLE_SURFACES, plan.estimator != Estimator::Lights),
            metres_per_unit: 1.0 / view.units_per_metre,
            opaque,
            acceleration: trace.map(|_| acceleration),
            frame: (frame, frame_buffer),
            fingerprint,
            meshes,
            sky,
            textures,
        })
    }

    /// Puts the seed of `plan`, and what limits its samples, in the place of those before.
    pub(super) fn set_limits(&mut self, commands: &mut Commands, plan: &Plan) -> Result<()> {
        let (frame, buffer) = &mut self.frame;
        *frame = limited(*frame, plan);
        commands.update_buffer(buffer, &[*frame])
    }
}

/// The material of each body by its rank, which counts from 1.
fn ranked_materials(scene: &Scene, geometry: &Geometry) -> Vec<u32> {
    let most = geometry.instances.iter().map(|instance| instance.rank).max().unwrap_or(0);
    let mut materials = vec![0; most as usize + 1];
    for (instance, &object) in geometry.instances.iter().zip(&geometry.objects) {
        materials[instance.rank as usize] = scene.objects[object].material as u32;
    }
    materials
}

/// The ranks of the bodies around the camera, the highest first, as many as `shaders/media.glsl` holds; 0: none.
fn ranks_around_camera(scene: &Scene, geometry: &Geometry) -> [u32; 8] {
    let inside = scene.bodies_around_camera();
    let placed = geometry.instances.iter().zip(&geometry.objects);
    let mut ranks: Vec<u32> =
        placed.filter(|(_, object)| inside.contains(object)).map(|(instance, _)| instance.rank).collect();
    ranks.sort_unstable_by(|a, b| b.cmp(a));
    std::array::from_fn(|i| ranks.get(i).copied().unwrap_or(0))
}

fn lights(scene: &Scene, view: &View) -> Vec<LightRecord> {
    let scale = view.units_per_metre;
    let record = |light: &PointLight| {
        let (cone_scale, cone_offset) = light.cone.map_or((0.0, 1.0), |cone| cone.falloff());
        LightRecord {
            position: ((light.position - view.position) * scale).as_vec3(),
            // Irradiance is intensity over distance squared, and distances are scaled.
            intensity: (light.intensity * scale * scale).as_vec3(),
            cone_scale: cone_scale as f32,
            cone_offset: cone_offset as f32,
            axis: light.cone.map_or(DVec3::ZERO, |cone| cone.axis()).as_vec3(),
            ..LightRecord::default()
        }
    };
    scene.lights.iter().map(record).collect()
}

fn frame(scene: &Scene, plan: &Plan, view: &View, light_count: u32) -> Frame {
    let environment = &scene.environment;
    let radiance = match environment.light {
        Surroundings::Image(_) => DVec3::splat(environment.intensity),
        Surroundings::Color(color) => color * environment.intensity,
    };
    Frame {
        view_projection: Frame::columns(view.view_projection),
        ray_corner: view.ray_corner.as_vec3(),
        light_count,
        ray_right: view.ray_right.as_vec3(),
        environment_turn: (environment.rotation / std::f64::consts::TAU).rem_euclid(1.0) as f32,
        ray_down: view.ray_down.as_vec3(),
        environment_visible: environment.visible.into(),
        environment_radiance: radiance.as_vec3(),
        reflection_red: plan.debug.reflection_red,
        reflection_intensity: plan.debug.reflection_intensity,
        transmission_green: plan.debug.transmission_green,
        transmission_intensity: plan.debug.transmission_intensity,
        flipped_ratio: plan.debug.flipped_ratio.into(),
        ..limited(Frame::default(), plan)
    }
}

/// `frame` with the seed of `plan`, and what limits its samples.
fn limited(frame: Frame, plan: &Plan) -> Frame {
    Frame {
        seed: (plan.seed ^ (plan.seed >> 32)) as u32,
        normals: plan.normals(),
        normals_in_all: match plan.budget {
            Budget::Samples(samples) => samples.saturating_mul(plan.normals()),
            Budget::Seconds { .. } => 0,
        },
        max_depth: plan.max_depth.unwrap_or(1),
        cutoff: plan.cutoff as f32,
        tolerance: plan.tolerance as f32,
        ..frame
    }
}

/// What paths read of a frame.
fn paths_frame(frame: Frame) -> Frame {
    Frame { seed: 0, max_depth: 0, normals: 0, normals_in_all: 0, cutoff: 0.0, tolerance: 0.0, ..frame }
}

/// The panorama; with `levels` above 1 it has its halves below, side by side, as `shaders/environment.glsl` finds them. An image
/// of its own levels would do if drivers fetched each pixel of a quad from the level that it asks for; lavapipe takes one for all.
fn upload_panorama(commands: &mut Commands, panorama: &Panorama, levels: u32) -> Result<Image> {
    let is_half = |value: &f32| f16::from_f32(*value).to_f32() == *value;
    // In half precision where that loses nothing of the image itself, as with images that came in it.
    let half = panorama.texels.iter().flatten().all(is_half);
    let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
    let width = panorama.width;
    let height = panorama.height + if levels > 1 { panorama.height / 2 } else { 0 };
    let desc = ImageDesc { name: "environment", width, height, format, uses: &[Use::CopyTarget, Use::Sampled] };
    if levels <= 1 {
        return commands.upload_image(&desc, &pack(&panorama.texels, half));
    }
    let mut texels = panorama.texels.to_vec();
    texels.resize((width * height) as usize, [0.0; 3]);
    let mut level = panorama.halved();
    for i in 1..levels {
        if i > 1 {
            level = level.halved();
        }
        let left = width - (width >> (i - 1));
        for (y, row) in (panorama.height..).zip(level.texels.chunks(level.width as usize)) {
            let start = (y * width + left) as usize;
            texels[start..start + row.len()].copy_from_slice(row);
        }
    }
    commands.upload_image(&desc, &pack(&texels, half))
}

/// Levels of the panorama that rough surfaces and wide look-ups see averages of; 1 where there are none, or where the levels would
/// not fit.
fn levels(gpu: &Gpu, panorama: Option<&Panorama>, scene: &Scene, plan: &Plan) -> u32 {
    let Some(panorama) = panorama else { return 1 };
    let fits = panorama.height + panorama.height / 2 <= gpu.max_image_side();
    let opaque = plan.effects.contains(Effect::Opaque);
    let rough = plan.effects.contains(Effect::Roughness) && scene.materials.iter().any(is_rough);
    // Paths average by being many.
    let needed = plan.model != Model::Path && (plan.footprints || opaque || rough);
    if needed && fits { panorama.width.min(panorama.height).ilog2() + 1 } else { 1 }
}

/// Texels as an image holds them.
fn pack(texels: &[[f32; 3]], half: bool) -> Vec<u8> {
    if half {
        let bits = |value: f32| f16::from_f32(value).to_bits();
        texels
            .iter()
            .flat_map(|&[r, g, b]| bytemuck::cast::<_, [u8; 8]>([bits(r), bits(g), bits(b), bits(1.0)]))
            .collect()
    } else {
        texels.iter().flat_map(|&[r, g, b]| bytemuck::cast::<_, [u8; 16]>([r, g, b, 1.0])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_have_the_same_constants() {
        let environment = include_str!("../../shaders/environment.glsl");
        assert!(environment.contains(&format!("(constant_id = {ENVIRONMENT_IMAGE}) const bool ENVIRONMENT_IMAGE")));
        let footprint = include_str!("../../shaders/footprint.glsl");
        assert!(footprint.contains(&format!("(constant_id = {FOOTPRINTS}) const bool FOOTPRINTS")));
        let path = include_str!("../../shaders/path.glsl");
        assert!(path.contains(&format!("(constant_id = {SAMPLE_LIGHTS}) const bool SAMPLE_LIGHTS")));
        assert!(path.contains(&format!("(constant_id = {SAMPLE_SURFACES}) const bool SAMPLE_SURFACES")));
        assert!(path.contains(&format!("(constant_id = {BRANCHES}) const bool BRANCHES")));
        let trace = include_str!("../../shaders/trace_software.glsl");
        assert!(trace.contains(&format!("const int TRACE_STACK = {TRACE_STACK};")));
    }
}
