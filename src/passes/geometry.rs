//! Meshes and their places as the device sees them. In flow a scene and a view, out flow arrays for `shaders/shared.glsl`.

use std::ops::Range;

use glam::{DAffine3, DVec3, Vec3};

use super::bvh::{Bvh, Node};
use super::view::View;
use crate::gpu::{InstanceRecord, PlacedMesh, Shown, Sides};
use crate::options::Trace;
use crate::scene::{Bounds, Mesh, Object, Scene, Surface};

/// An instance, as it is drawn.
#[derive(Clone, Copy)]
pub(super) struct Draw {
    pub(super) vertices: u32,
    pub(super) sides: Sides,
}

/// Every mesh once, and the instances that a model sees.
#[derive(Default)]
pub(super) struct Geometry {
    pub(super) positions: Vec<f32>,
    pub(super) normals: Vec<f32>,
    pub(super) triangles: Vec<u32>,
    pub(super) instances: Vec<InstanceRecord>,
    pub(super) draws: Vec<Draw>,
    /// Texture coordinates, as the mesh has them.
    pub(super) uvs: Vec<f32>,
    /// For tracing: the corners of each triangle, in the order of the triangles, four numbers each.
    pub(super) corners: Vec<f32>,
    /// For tracing in software: the hierarchy over the instances, then one a mesh.
    pub(super) nodes: Vec<Node>,
    /// For tracing in hardware: the meshes in their places.
    pub(super) placed: Vec<PlacedMesh>,
    /// The triangles of each mesh.
    pub(super) meshes: Vec<Range<u32>>,
    /// The most groups of nodes that wait while the tracer goes down through both levels.
    pub(super) depth: u32,
    /// For each instance its object in the scene.
    pub(super) objects: Vec<usize>,
}

/// Where a mesh lies in the buffers, scaled to the unit ball; `to_mesh` undoes that.
struct Place {
    first_vertex: u32,
    first_triangle: u32,
    first_node: u32,
    depth: u32,
    to_mesh: DAffine3,
}

impl Geometry {
    /// `opaque`: whether objects are seen that are no dielectrics.
    pub(super) fn new(scene: &Scene, view: &View, trace: Option<Trace>, opaque: bool) -> Self {
        let mut all = Self::default();
        let is_seen = |object: &Object| opaque || is_dielectric(scene, object);
        let mut objects: Vec<usize> =
            (0..scene.objects.len()).filter(|&number| is_seen(&scene.objects[number])).collect();
        let to_device =
            DAffine3::from_scale(DVec3::splat(view.units_per_metre)) * DAffine3::from_translation(-view.position);
        let mut top_depth = 0;
        if trace == Some(Trace::Software) {
            let boxes = objects.iter().map(|&number| box_of(scene, &scene.objects[number], &to_device));
            let top = Bvh::of_boxes(boxes);
            objects = top.order.iter().map(|&place| objects[place as usize]).collect();
            all.nodes = top.nodes;
            top_depth = top.depth;
        }
        let places: Vec<_> = scene.meshes.iter().map(|mesh| all.add(mesh, trace)).collect();
        all.depth = 2 * top_depth + places.iter().map(|place| place.depth).max().unwrap_or(0);
        let ranks = if trace.is_some() { scene.ranks() } else { vec![0; scene.objects.len()] };
        for &number in &objects {
            let object = &scene.objects[number];
            let mesh = &scene.meshes[object.mesh];
            let place = &places[object.mesh];
            let object_to_world = to_device * object.transform * place.to_mesh;
            let world_to_object = object_to_world.inverse();
            all.instances.push(InstanceRecord {
                object_to_world: object_to_world.into(),
                normal_to_world: world_to_object.matrix3.transpose().into(),
                world_to_object: world_to_object.into(),
                first_triangle: place.first_triangle,
                first_vertex: place.first_vertex,
                first_node: place.first_node,
                material: object.material as u32,
                smooth_normals: u32::from(object.smooth && !mesh.normals.is_empty()),
                number: object.number as u32 + 1,
                rank: ranks[number],
                overlaps: mesh.overlaps.into(),
            });
            if trace == Some(Trace::Hardware) {
                all.placed.push(PlacedMesh { mesh: object.mesh, object_to_world });
            }
            all.draws.push(Draw {
                vertices: 3 * mesh.triangles.len() as u32,
                sides: Sides {
                    clockwise: object_to_world.matrix3.determinant() < 0.0,
                    // What is nearest of such a body is a front, unless it cuts through itself inside out: leaving out the
                    // backs changes nothing but the time.
                    shown: if scene.is_seen_from_outside(object) { Shown::Fronts } else { Shown::Both },
                },
            });
        }
        all.objects = objects;
        all
    }

    /// The corners of a triangle, counted through all meshes, in its mesh's space; of geometry for tracing.
    pub(super) fn corners_of(&self, triangle: u32) -> [DVec3; 3] {
        let first = 3 * triangle as usize;
        [0, 1, 2].map(|corner| {
            let [x, y, z] = [0, 1, 2].map(|axis| f64::from(self.corners[4 * (first + corner) + axis]));
            DVec3::new(x, y, z)
        })
    }

    fn add(&mut self, mesh: &Mesh, trace: Option<Trace>) -> Place {
        let bounds = mesh.bounds();
        let center = bounds.center();
        // A power of two, so that scaling rounds nothing.
        let scale = bounds.farthest(center).max(f64::MIN_POSITIVE).log2().ceil().exp2();
        let mut place = Place {
            first_vertex: (self.positions.len() / 3) as u32,
            first_triangle: (self.triangles.len() / 3) as u32,
            first_node: self.nodes.len() as u32,
            depth: 0,
            to_mesh: DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(scale)),
        };
        let unit = |&position: &[f32; 3]| ((Vec3::from(position).as_dvec3() - center) / scale).as_vec3().to_array();
        let units: Vec<[f32; 3]> = mesh.positions.iter().map(unit).collect();
        self.positions.extend(units.iter().flatten());
        match mesh.normals.is_empty() {
            // Never read, but vertices share one numbering.
            true => self.normals.resize(self.positions.len(), 0.0),
            false => self.normals.extend(mesh.normals.iter().flatten()),
        }
        if trace.is_some() {
            match mesh.uvs.is_empty() {
                true => self.uvs.resize(self.positions.len() / 3 * 2, 0.0),
                false => self.uvs.extend(mesh.uvs.iter().flatten()),
            }
        }
        let corners = |&triangle: &[u32; 3]| triangle.map(|vertex| units[vertex as usize]);
        let mut triangles = mesh.triangles.clone();
        if trace == Some(Trace::Software) {
            let bvh = Bvh::of_triangles(triangles.iter().map(corners));
            triangles = bvh.order.iter().map(|&number| mesh.triangles[number as usize]).collect();
            self.nodes.extend(bvh.nodes);
            place.depth = bvh.depth;
        }
        if trace.is_some() {
            self.corners.extend(triangles.iter().flat_map(corners).flat_map(|[x, y, z]| [x, y, z, 0.0]));
        }
        self.triangles.extend(triangles.iter().flatten());
        self.meshes.push(place.first_triangle..(self.triangles.len() / 3) as u32);
        place
    }
}

fn is_dielectric(scene: &Scene, object: &Object) -> bool {
    matches!(scene.materials[object.material].surface, Surface::Dielectric(_))
}

/// The box around an object in the device's space, with room for what 32-bit arithmetic loses on the way there.
fn box_of(scene: &Scene, object: &Object, to_device: &DAffine3) -> Bounds {
    let bounds = Bounds::around_positions(&scene.meshes[object.mesh].positions, &(*to_device * object.transform));
    let room = DVec3::splat(1e-6 * (bounds.reach() + bounds.extent().length()));
    Bounds { min: bounds.min - room, max: bounds.max + room }
}
