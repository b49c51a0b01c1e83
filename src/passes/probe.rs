//! What the tracers meet, for tests and measurements. In flow a scene and rays in it, out flow hits, times and leaks.
//!
//! The scene is on the device as it is for the models that trace, and `shaders/probe_*.glsl` call the same `Trace()`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use super::resources::Resources;
use crate::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Gpu, SamplePush, Specialization, shaders,
};
use crate::options::{Model, RenderArgs, Trace};
use crate::plan::Plan;
use crate::scene::Scene;

/// What `Trace()` and `ArriveAt()` read ends with this binding; the probe's own buffers follow.
const LAST_TRACED: usize = 10;

/// The id of the one constant that each probe has.
const CONSTANT: u32 = 128;

/// Threads of a workgroup.
const GROUP: u32 = 64;

/// Rays of a chain that one dispatch follows.
const SEGMENTS: u32 = 32;

/// A ray in the world, lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Where to, of any length above 0.
    pub direction: DVec3,
}

/// What a ray meets first, in the world, lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// [`Object::number`](crate::scene::Object::number).
    pub object: usize,
    /// Of the object's mesh, in the order of the device.
    pub triangle: u32,
    /// The surface is seen from the inside.
    pub behind: bool,
    /// From the ray's origin.
    pub distance: f64,
    /// Where.
    pub position: DVec3,
    /// Of the face, of unit length, towards the outside.
    pub normal: DVec3,
    /// The same, interpolated where the object is smooth.
    pub shading: DVec3,
    /// Index into [`Scene::objects`].
    pub index: usize,
}

/// What became of rays that cannot get out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Leaks {
    /// Rays in all.
    pub rays: u64,
    /// Rays that met nothing.
    pub misses: u64,
    /// Rays that met a surface from the outside.
    pub wrong_sides: u64,
    /// One of those, of each chain that has any.
    pub lost: Vec<Ray>,
}

/// `ProbeRay` of `shaders/probe_trace.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RayRecord {
    origin: Vec3,
    direction: Vec3,
}

/// `ProbeHit` there.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct HitRecord {
    object: u32,
    triangle: u32,
    behind: u32,
    distance: f32,
    position: Vec3,
    normal: Vec3,
    shading: Vec3,
    instance: u32,
}

/// `Chain` of `shaders/probe_chain.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ChainRecord {
    start: Vec3,
    misses: u32,
    origin: Vec3,
    wrong_sides: u32,
    direction: Vec3,
    rays: u32,
    lost: RayRecord,
}

/// A scene on the device, to be asked what rays meet there.
pub struct TraceProbe {
    commands: Commands,
    trace: Trace,
    resources: Resources,
    camera: DVec3,
    /// What was compiled, by the shader's name and its constant.
    pipelines: Vec<((&'static str, u32), ComputePipeline)>,
}

impl TraceProbe {
    /// The scene of `scene` as `trace` needs it.
    ///
    /// # Errors
    ///
    /// If the device has no ray queries for [`Trace::Hardware`], or the scene does not fit.
    pub fn new(gpu: &Gpu, scene: &Scene, trace: Trace) -> crate::Result<Self> {
        let args = RenderArgs { model: Some(Model::Tree.into()), trace: Some(trace), ..RenderArgs::default() };
        let plan = Plan::new(scene, &args)?;
        super::check(gpu, &plan)?;
        let mut commands = Commands::new(gpu)?;
        let resources = Resources::new(&mut commands, scene, &plan, Some(trace), None)?;
        let camera = scene.camera.position;
        Ok(Self { commands, trace, resources, camera, pipelines: Vec::new() })
    }

    /// Where `point` lies in the device's space, where the camera is the origin and the farthest corner of the scene
    /// at distance 1.
    fn to_device(&self, point: DVec3) -> Vec3 {
        ((point - self.camera) / self.resources.metres_per_unit).as_vec3()
    }

    fn record(&self, ray: &Ray) -> RayRecord {
        RayRecord { origin: self.to_device(ray.origin), direction: ray.direction.normalize().as_vec3() }
    }

    fn ray(&self, record: &RayRecord) -> Ray {
        let origin = record.origin.as_dvec3() * self.resources.metres_per_unit + self.camera;
        Ray { origin, direction: record.direction.as_dvec3() }
    }

    fn group(&self, own: impl IntoIterator<Item = Arc<Buffer>>) -> crate::Result<BindGroup> {
        let mut bindings = self.resources.traced[..=LAST_TRACED].to_vec();
        bindings.extend(own.into_iter().map(Bind::Buffer));
        Ok(BindGroup::new(self.commands.gpu(), "probe of the tracer", bindings)?)
    }

    /// Dispatches one thread a ray `rounds` times; milliseconds of each on a device that has a clock.
    fn dispatch(
        &mut self,
        shaders: [&'static crate::gpu::Shader; 2],
        constant: u32,
        group: &BindGroup,
        count: usize,
        rounds: usize,
    ) -> crate::Result<Vec<f64>> {
        let [software, hardware] = shaders;
        let shader = if self.trace == Trace::Hardware { hardware } else { software };
        let push = SamplePush::default();
        let key = (shader.name, constant);
        if !self.pipelines.iter().any(|(known, _)| *known == key) {
            let bytes = size_of::<SamplePush>() as u32;
            let constants = Specialization::default().with_number(CONSTANT, constant);
            let pipeline = ComputePipeline::new(self.commands.gpu(), shader, group, bytes, &constants)?;
            self.pipelines.push((key, pipeline));
        }
        let Some((_, pipeline)) = self.pipelines.iter().find(|(known, _)| *known == key) else { return Ok(Vec::new()) };
        let groups = [(count as u32).div_ceil(GROUP), 1, 1];
        let mut times = Vec::new();
        for _ in 0..rounds {
            let passes = self.commands.run(|cmd| {
                cmd.wait_for_buffers();
                cmd.timed("probe", |cmd| cmd.dispatch(pipeline, group, &push, groups));
            })?;
            times.extend(passes.iter().filter_map(|pass| pass.gpu_ms));
        }
        Ok(times)
    }

    fn run(&mut self, rays: &[Ray], arrives: bool, rounds: usize) -> crate::Result<(Vec<HitRecord>, Vec<f64>)> {
        let records: Vec<_> = rays.iter().map(|ray| self.record(ray)).collect();
        let gpu = self.commands.gpu().clone();
        let records = Arc::new(self.commands.upload_buffer("rays", &records)?);
        let size = size_of::<HitRecord>() * rays.len();
        let desc = BufferDesc { name: "hits", size: size as u64, usage: BufferUse::Storage };
        let hits = Arc::new(Buffer::new(&gpu, &desc)?);
        let group = self.group([records, hits.clone()])?;
        let shaders = [&shaders::PROBE_TRACE_COMP, &shaders::PROBE_TRACE_HARDWARE_COMP];
        let times = self.dispatch(shaders, arrives.into(), &group, rays.len(), rounds)?;
        Ok((bytemuck::allocation::pod_collect_to_vec(&self.commands.read_buffer(&hits)?), times))
    }

    /// What each of `rays` meets.
    pub fn hits(&mut self, rays: &[Ray]) -> crate::Result<Vec<Option<Hit>>> {
        let (records, _) = self.run(rays, /* arrives: */ true, 1)?;
        let metres = self.resources.metres_per_unit;
        let hit = |record: &HitRecord| {
            (record.object > 0).then(|| Hit {
                object: record.object as usize - 1,
                triangle: record.triangle,
                behind: record.behind != 0,
                distance: f64::from(record.distance) * metres,
                position: record.position.as_dvec3() * metres + self.camera,
                normal: record.normal.as_dvec3(),
                shading: record.shading.as_dvec3().normalize_or(record.normal.as_dvec3()),
                index: self.resources.objects[record.instance as usize],
            })
        };
        Ok(records.iter().take(rays.len()).map(hit).collect())
    }

    /// Milliseconds that the device takes to find what all of `rays` meet, once for each of `rounds`, and without the
    /// points on the surfaces; nothing on a device without a clock. The first round may hold the shader's
    /// compilation.
    pub fn times(&mut self, rays: &[Ray], rounds: usize) -> crate::Result<Vec<f64>> {
        Ok(self.run(rays, /* arrives: */ false, rounds)?.1)
    }

    /// Follows rays from wall to wall inside of closed bodies, a chain of at least `segments` for each of `starts`,
    /// whose origins lie inside.
    pub fn leaks(&mut self, starts: &[Ray], segments: u32) -> crate::Result<Leaks> {
        let chain = |ray: &Ray| {
            let RayRecord { origin, direction } = self.record(ray);
            ChainRecord { start: origin, origin, direction, ..ChainRecord::zeroed() }
        };
        let chains: Vec<_> = starts.iter().map(chain).collect();
        let chains = Arc::new(self.commands.upload_buffer("chains", &chains)?);
        let group = self.group([chains.clone()])?;
        let shaders = [&shaders::PROBE_CHAIN_COMP, &shaders::PROBE_CHAIN_HARDWARE_COMP];
        let rounds = segments.div_ceil(SEGMENTS) as usize;
        self.dispatch(shaders, SEGMENTS, &group, starts.len(), rounds)?;
        let chains: Vec<ChainRecord> = bytemuck::allocation::pod_collect_to_vec(&self.commands.read_buffer(&chains)?);
        let mut leaks = Leaks::default();
        for chain in &chains[..starts.len()] {
            leaks.rays += u64::from(chain.rays);
            leaks.misses += u64::from(chain.misses);
            leaks.wrong_sides += u64::from(chain.wrong_sides);
            if chain.misses + chain.wrong_sides > 0 {
                leaks.lost.push(self.ray(&chain.lost));
            }
        }
        Ok(leaks)
    }
}
