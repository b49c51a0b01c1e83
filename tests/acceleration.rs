//! Acceleration structures on a device with ray queries: rays meet what 64-bit arithmetic says they meet.

mod common;

use std::io::Write;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DQuat, DVec3, Vec3};

use common::Validated;
use vitrum::gpu::{
    AccelerationStructure, Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, GpuError,
    MeshStructures, PlacedMesh, Result, Specialization, shaders,
};

/// `Ray` of `shaders/probe_ray_query.comp`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Ray {
    origin: Vec3,
    direction: Vec3,
}

impl Ray {
    fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Self { origin: origin.into(), direction: direction.into() }
    }
}

/// `Hit` of `shaders/probe_ray_query.comp`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Hit {
    instance: u32,
    triangle: u32,
    distance: f32,
    front: u32,
}

const MISS: Hit = Hit { instance: u32::MAX, triangle: 0, distance: 0.0, front: 0 };

/// Four triangles and two, whose corners run counter-clockwise seen from outside and from above.
const CORNERS: [[[f32; 3]; 3]; 6] = [
    [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0]],
    [[-1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]],
];
const TETRAHEDRON: usize = 0;
const QUAD: usize = 1;
const EMPTY: usize = 2;
const MESHES: [Range<u32>; 3] = [0..4, 4..6, 6..6];

/// The corners as a structure reads them, with a fourth number each.
fn padded() -> Vec<[f32; 4]> {
    CORNERS.iter().flatten().map(|&[x, y, z]| [x, y, z, f32::NAN]).collect()
}

fn validated() -> Option<Validated> {
    let validated = Validated::open()?;
    if !validated.gpu.ray_query() {
        // Past the test runner, as in `Validated::open`.
        let _ = writeln!(std::io::stderr(), "skipped: no ray query");
        return None;
    }
    Some(validated)
}

/// Both levels.
fn structure(
    commands: &mut Commands,
    corners: &Buffer,
    meshes: &[Range<u32>],
    placed: &[PlacedMesh],
) -> Result<AccelerationStructure> {
    let meshes = Arc::new(MeshStructures::new(commands, corners, meshes)?);
    AccelerationStructure::new(commands, &meshes, placed)
}

/// What each ray meets, in the eyes of the device.
fn trace(commands: &mut Commands, placed: &[PlacedMesh], rays: &[Ray]) -> Result<Vec<Hit>> {
    let gpu = commands.gpu().clone();
    let corners = commands.upload_buffer("corners", &padded())?;
    let scene = structure(commands, &corners, &MESHES, placed)?;
    drop(corners);
    let size = size_of_val(rays) as u64 / size_of::<Ray>() as u64 * size_of::<Hit>() as u64;
    let hits = Arc::new(Buffer::new(&gpu, &BufferDesc { name: "hits", size, usage: BufferUse::Storage })?);
    let rays_buffer = Arc::new(commands.upload_buffer("rays", rays)?);
    let bindings = vec![Bind::Acceleration(Arc::new(scene)), Bind::Buffer(rays_buffer), Bind::Buffer(hits.clone())];
    let group = BindGroup::new(&gpu, "probe of ray queries", bindings)?;
    let shader = &shaders::PROBE_RAY_QUERY_COMP;
    let pipeline = ComputePipeline::new(&gpu, shader, &group, 0, &Specialization::default())?;
    let groups = [rays.len().div_ceil(64) as u32, 1, 1];
    commands.run(|cmd| cmd.dispatch(&pipeline, &group, &(), groups))?;
    Ok(bytemuck::allocation::pod_collect_to_vec(&commands.read_buffer(&hits)?))
}

/// What a ray meets, and how far it stays from edges there, as a part of the triangle; the distance counts as 0 for
/// rays that miss by that little. Möller and Trumbore 1997, in the space of the mesh.
fn expected(placed: &[PlacedMesh], ray: &Ray) -> (Hit, f64) {
    let (mut nearest, mut margin) = (MISS, f64::INFINITY);
    let mut distance = f64::INFINITY;
    for (instance, placed) in (0..).zip(placed) {
        let to_object = placed.object_to_world.inverse();
        let origin = to_object.transform_point3(ray.origin.as_dvec3());
        let direction = to_object.transform_vector3(ray.direction.as_dvec3());
        for (triangle, index) in (0..).zip(MESHES[placed.mesh].clone()) {
            let [a, b, c] = CORNERS[index as usize].map(|corner| Vec3::from(corner).as_dvec3());
            let normal = (b - a).cross(c - a);
            let slope = direction.dot(normal);
            let t = (a - origin).dot(normal) / slope;
            let at = origin + t * direction - a;
            let area = normal.length_squared();
            let (v, w) = (at.cross(c - a).dot(normal) / area, (b - a).cross(at).dot(normal) / area);
            let inside = v.min(w).min(1.0 - v - w);
            if t.is_finite() && t > 0.0 {
                // A crossing behind another matters little, but is rare enough to be left out too.
                margin = margin.min(inside.abs());
            }
            if t > 0.0 && inside > 0.0 && t < distance {
                distance = t;
                nearest = Hit { instance, triangle, distance: t as f32, front: (slope < 0.0).into() };
            }
        }
    }
    (nearest, margin)
}

/// A mirrored tetrahedron, a quad that is stretched and turned, a tetrahedron as it is, and nothing.
fn scene() -> Vec<PlacedMesh> {
    let stretched = DAffine3::from_scale_rotation_translation(
        DVec3::new(3.0, 0.5, 2.0),
        DQuat::from_rotation_x(0.4) * DQuat::from_rotation_z(0.3),
        DVec3::new(0.0, 0.5, -4.0),
    );
    let mirrored =
        DAffine3 { translation: DVec3::new(-2.0, 0.0, 0.0), ..DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) };
    vec![
        PlacedMesh { mesh: TETRAHEDRON, object_to_world: mirrored },
        PlacedMesh { mesh: QUAD, object_to_world: stretched },
        PlacedMesh { mesh: TETRAHEDRON, object_to_world: DAffine3::from_translation(DVec3::new(2.0, 0.0, 0.0)) },
        PlacedMesh { mesh: EMPTY, object_to_world: DAffine3::IDENTITY },
    ]
}

#[test]
fn rays_meet_the_triangle_that_is_there() {
    let Some(validated) = validated() else { return };
    let rays = [
        // The slanted face of the third mesh from outside: x + y + z = 1 at z = 0.5.
        Ray::new([2.25, 0.25, 5.0], [0.0, 0.0, -1.0]),
        // Its bottom from below, in steps of half a metre.
        Ray::new([2.25, 0.25, -1.0], [0.0, 0.0, 0.5]),
        // Its slanted face from inside.
        Ray::new([2.25, 0.25, 0.25], [0.0, 0.0, 1.0]),
        // The first mesh in its mirror, at x = -2.25.
        Ray::new([-2.25, 0.25, 5.0], [0.0, 0.0, -1.0]),
        Ray::new([-2.25, 0.25, -1.0], [0.0, 0.0, 1.0]),
        // Between the two, and away from everything.
        Ray::new([0.0, 5.0, 5.0], [0.0, 0.0, -1.0]),
        Ray::new([2.25, 0.25, 5.0], [0.0, 0.0, 1.0]),
    ];
    let hit = |instance, triangle, distance, front| Hit { instance, triangle, distance, front };
    let met =
        [hit(2, 3, 4.5, 1), hit(2, 0, 2.0, 1), hit(2, 3, 0.25, 0), hit(0, 3, 4.5, 1), hit(0, 0, 1.0, 1), MISS, MISS];
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    assert_eq!(trace(&mut commands, &scene(), &rays).expect("the probe runs"), met);
    drop(commands);
    validated.verdict();
}

#[test]
fn many_rays_meet_what_arithmetic_says() {
    let Some(validated) = validated() else { return };
    let placed = scene();
    let mut random = fastrand::Rng::with_seed(7);
    let mut point = |reach: f32| Vec3::from_array(std::array::from_fn(|_| reach * (2.0 * random.f32() - 1.0)));
    // At every placed mesh in turn, and past it.
    let rays: Vec<_> = placed
        .iter()
        .cycle()
        .take(4000)
        .map(|placed| {
            let origin = point(6.0);
            let target = placed.object_to_world.transform_point3(point(1.0).as_dvec3()).as_vec3();
            Ray { origin, direction: target - origin }
        })
        .collect();
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    let hits = trace(&mut commands, &placed, &rays).expect("the probe runs");
    let (mut compared, mut seen) = (0, [0; 5]);
    for (ray, hit) in rays.iter().zip(&hits) {
        let (expected, margin) = expected(&placed, ray);
        if margin < 1e-4 {
            continue;
        }
        let apart = (hit.distance - expected.distance).abs();
        assert!(apart <= 1e-5 * expected.distance, "{ray:?} met {hit:?}, not {expected:?}");
        assert_eq!(*hit, Hit { distance: hit.distance, ..expected }, "{ray:?}");
        compared += 1;
        seen[placed.len().min(hit.instance as usize)] += 1;
    }
    assert!(compared > 3900, "only {compared} rays stay off edges");
    let [first, second, third, empty, missed] = seen;
    assert!([first, second, third, missed].iter().all(|&count| count > 100) && empty == 0, "{seen:?}");
    drop(commands);
    validated.verdict();
}

#[test]
fn a_scene_without_meshes_is_met_by_no_ray() {
    let Some(validated) = validated() else { return };
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    let rays = [Ray::new([2.25, 0.25, 5.0], [0.0, 0.0, -1.0]); 3];
    assert_eq!(trace(&mut commands, &[], &rays).expect("the probe runs"), [MISS; 3]);
    let nothing = commands.upload_buffer::<f32>("no corners", &[]).expect("upload");
    structure(&mut commands, &nothing, &[], &[]).expect("an empty scene");
    drop((nothing, commands));
    validated.verdict();
}

#[test]
fn what_cannot_be_traced_is_refused() {
    let Some(validated) = Validated::open() else { return };
    let mut commands = Commands::new(&validated.gpu).expect("commands");
    let corners = commands.upload_buffer("corners", &padded()).expect("upload");
    if !validated.gpu.ray_query() {
        let refusal = structure(&mut commands, &corners, &MESHES, &scene()).err();
        assert!(
            matches!(&refusal, Some(GpuError::Lacking { missing, .. }) if missing == &["ray queries"]),
            "{refusal:?}"
        );
        let desc = BufferDesc { name: "scratch", size: 4, usage: BufferUse::Scratch };
        assert!(Buffer::new(&validated.gpu, &desc).is_err());
    } else {
        let placed = PlacedMesh { mesh: QUAD, object_to_world: DAffine3::IDENTITY };
        let mut panics = |meshes: &[Range<u32>], placed: &[PlacedMesh]| {
            let build = || structure(&mut commands, &corners, meshes, placed).map(drop);
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(build)).is_err()
        };
        assert!(panics(&[0..4, 4..7], &[]), "a mesh beyond the corners");
        assert!(panics(&MESHES, &[PlacedMesh { mesh: 3, ..placed }]), "a mesh that is not in the list");
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        assert!(panics(&MESHES, &[PlacedMesh { object_to_world: flat, ..placed }]), "a flattened mesh");
    }
    drop((corners, commands));
    validated.verdict();
}
