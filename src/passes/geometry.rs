//! Meshes and their places as the device sees them. In flow a scene and a view, out flow arrays for `shaders/shared.glsl`.

use std::ops::Range;
use std::sync::Arc;

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

/// Where each mesh lies in [`Arrays`]; stays while views, materials and places change.
pub(super) struct Layout {
    /// The triangles of each mesh.
    pub(super) ranges: Vec<Range<u32>>,
    places: Vec<Place>,
    meshes: Vec<Arc<Mesh>>,
    trace: Option<Trace>,
}

/// Every mesh once, one after the other, each scaled to the unit ball.
#[derive(Default)]
pub(super) struct Arrays {
    pub(super) positions: Vec<f32>,
    pub(super) normals: Vec<f32>,
    pub(super) triangles: Vec<u32>,
    /// For tracing: texture coordinates, as the mesh has them.
    pub(super) uvs: Vec<f32>,
    /// For tracing: the corners of each triangle, in the order of the triangles, four numbers each.
    pub(super) corners: Vec<f32>,
    /// For tracing in software: a hierarchy a mesh.
    pub(super) nodes: Vec<Node>,
}

/// Where a mesh lies; `to_mesh` undoes its scaling.
struct Place {
    first_vertex: u32,
    first_triangle: u32,
    first_node: u32,
    depth: u32,
    to_mesh: DAffine3,
    /// The mesh's triangles in their order here, where that is another.
    order: Vec<u32>,
}

impl Layout {
    /// The meshes of `scene`, for tracing or not.
    pub(super) fn new(scene: &Scene, trace: Option<Trace>) -> (Self, Arrays) {
        let mut layout = Self { ranges: Vec::new(), places: Vec::new(), meshes: scene.meshes.clone(), trace };
        let mut arrays = Arrays::default();
        for mesh in &scene.meshes {
            let place = arrays.add(mesh, trace);
            layout.ranges.push(place.first_triangle..(arrays.triangles.len() / 3) as u32);
            layout.places.push(place);
        }
        (layout, arrays)
    }

    /// Whether these are the meshes of `scene`, ready for `trace`.
    pub(super) fn is_of(&self, scene: &Scene, trace: Option<Trace>) -> bool {
        let same = |(a, b): (&Arc<Mesh>, &Arc<Mesh>)| Arc::ptr_eq(a, b);
        self.trace == trace
            && self.meshes.len() == scene.meshes.len()
            && self.meshes.iter().zip(&scene.meshes).all(same)
    }

    /// Of each mesh the first vertex, and the triangles.
    pub(super) fn spans(&self) -> impl Iterator<Item = (u32, &Range<u32>)> {
        self.places.iter().map(|place| place.first_vertex).zip(&self.ranges)
    }

    /// The corners of a triangle of a mesh, counted here, in the mesh's own space.
    pub(super) fn corners_of(&self, mesh: usize, triangle: u32) -> [DVec3; 3] {
        let triangle = *self.places[mesh].order.get(triangle as usize).unwrap_or(&triangle);
        let mesh = &self.meshes[mesh];
        mesh.triangles[triangle as usize].map(|vertex| Vec3::from(mesh.positions[vertex as usize]).as_dvec3())
    }
}

/// The instances that a model sees.
#[derive(Default)]
pub(super) struct Geometry {
    pub(super) instances: Vec<InstanceRecord>,
    pub(super) draws: Vec<Draw>,
    /// For tracing in software: the hierarchy over the instances. Those of the meshes come behind [`Geometry::room`] nodes.
    pub(super) nodes: Vec<Node>,
    /// For tracing in hardware: the meshes in their places.
    pub(super) placed: Vec<PlacedMesh>,
    /// The most groups of nodes that wait while the tracer goes down through both levels.
    pub(super) depth: u32,
    /// For each instance its object in the scene.
    pub(super) objects: Vec<usize>,
    /// From each instance's mesh to the device's space, as the scene places it.
    pub(super) transforms: Vec<DAffine3>,
}

impl Geometry {
    /// `room`: nodes before those of the meshes. `opaque`: whether objects are seen that are no dielectrics.
    pub(super) fn new(scene: &Scene, view: &View, layout: &Layout, room: u32, opaque: bool) -> Self {
        let mut all = Self::default();
        let trace = layout.trace;
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
        all.depth = 2 * top_depth + layout.places.iter().map(|place| place.depth).max().unwrap_or(0);
        let ranks = if trace.is_some() { scene.ranks() } else { vec![0; scene.objects.len()] };
        for &number in &objects {
            let object = &scene.objects[number];
            let mesh = &scene.meshes[object.mesh];
            let place = &layout.places[object.mesh];
            let transform = to_device * object.transform;
            let object_to_world = transform * place.to_mesh;
            let world_to_object = object_to_world.inverse();
            all.instances.push(InstanceRecord {
                object_to_world: object_to_world.into(),
                normal_to_world: world_to_object.matrix3.transpose().into(),
                world_to_object: world_to_object.into(),
                first_triangle: place.first_triangle,
                first_vertex: place.first_vertex,
                first_node: room + place.first_node,
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
                    shown: match scene.is_seen_from_outside(object) && scene.materials[object.material].cutout.is_none()
                    {
                        true => Shown::Fronts,
                        false => Shown::Both,
                    },
                },
            });
            all.transforms.push(transform);
        }
        all.objects = objects;
        all
    }

    /// Nodes that a hierarchy over so many instances has at most: each but the last level's has two children.
    pub(super) fn room(instances: usize) -> u32 {
        instances.max(1) as u32
    }
}

impl Arrays {
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
            order: Vec::new(),
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
            place.order = bvh.order;
        }
        if trace.is_some() {
            self.corners.extend(triangles.iter().flat_map(corners).flat_map(|[x, y, z]| [x, y, z, 0.0]));
        }
        self.triangles.extend(triangles.iter().flatten());
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
