//! The host's side of `shaders/shared.glsl`: the same structs, member by member.

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec2, Vec3};

/// An affine map as GLSL's `mat4x3` lies in a buffer: four columns of three, each padded to four.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Matrix4x3([[f32; 4]; 4]);

impl Matrix4x3 {
    /// The map without its translation.
    pub fn linear(&self) -> DMat3 {
        let [x, y, z, _] = self.0.map(|[x, y, z, _]| Vec3::new(x, y, z).as_dvec3());
        DMat3::from_cols(x, y, z)
    }
}

impl From<DAffine3> for Matrix4x3 {
    fn from(map: DAffine3) -> Self {
        let column = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
        let linear = map.matrix3;
        Self([column(linear.x_axis), column(linear.y_axis), column(linear.z_axis), column(map.translation)])
    }
}

impl From<DMat3> for Matrix4x3 {
    fn from(linear: DMat3) -> Self {
        DAffine3::from_mat3(linear).into()
    }
}

/// `Frame`: what is the same for every sample of a picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "shared.glsl describes the members")]
pub struct Frame {
    pub view_projection: [[f32; 4]; 4],
    pub ray_corner: Vec3,
    pub light_count: u32,
    pub ray_right: Vec3,
    pub environment_turn: f32,
    pub ray_down: Vec3,
    pub environment_visible: u32,
    pub environment_radiance: Vec3,
    pub reflection_red: f32,
    pub reflection_intensity: f32,
    pub transmission_green: f32,
    pub transmission_intensity: f32,
    pub flipped_ratio: u32,
    pub seed: u32,
    pub normals: u32,
    pub normals_in_all: u32,
    pub environment_levels: u32,
    pub environment_size: [u32; 2],
    pub max_depth: u32,
    pub cutoff: f32,
    pub camera_bodies: [u32; 4],
    pub camera_index: f32,
    pub camera_medium: u32,
    pub tolerance: f32,
    pub first_tangent: u32,
}

impl Frame {
    /// `matrix` as a shader's `mat4`.
    pub fn columns(matrix: DMat4) -> [[f32; 4]; 4] {
        matrix.as_mat4().to_cols_array_2d()
    }
}

/// `Instance`: a mesh in its place.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "shared.glsl describes the members")]
pub struct InstanceRecord {
    pub object_to_world: Matrix4x3,
    pub normal_to_world: Matrix4x3,
    pub world_to_object: Matrix4x3,
    pub first_triangle: u32,
    pub first_vertex: u32,
    pub first_node: u32,
    pub material: u32,
    pub smooth_normals: u32,
    pub number: u32,
    pub rank: u32,
    pub overlaps: u32,
}

/// `Material`: a surface and what is behind it.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "shared.glsl describes the members")]
pub struct MaterialRecord {
    pub absorption: Vec3,
    pub refraction_index: f32,
    pub base_color: Vec3,
    pub roughness: f32,
    pub emission: Vec3,
    pub metallic: f32,
    pub sellmeier_strengths: Vec3,
    pub dispersion: f32,
    pub sellmeier_resonances: Vec3,
    pub specular: f32,
    pub kind: u32,
    pub albedo_table: u32,
    pub albedo_tables: u32,
    pub color_map: u32,
    pub finish_map: u32,
    pub emission_map: u32,
    pub transmission_map: u32,
    pub normal_map: u32,
    pub alpha_map: u32,
    pub normal_scale: f32,
    pub alpha_cutoff: f32,
    pub alpha: f32,
    pub shines: f32,
    pub head: f32,
    pub transmission: f32,
    pub padding: u32,
}

impl MaterialRecord {
    /// `DIELECTRIC`.
    pub const DIELECTRIC: u32 = 0;
    /// `PANE`.
    pub const PANE: u32 = 1;
    /// `OPAQUE`.
    pub const OPAQUE: u32 = 2;
}

/// `Light`: a light without extent.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "shared.glsl describes the members")]
pub struct LightRecord {
    pub position: Vec3,
    pub cone_scale: f32,
    pub intensity: Vec3,
    pub cone_offset: f32,
    pub axis: Vec3,
    pub padding: f32,
}

/// `Push`: what changes from draw to draw.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[expect(missing_docs, reason = "shared.glsl describes the members")]
pub struct SamplePush {
    pub jitter: Vec2,
    pub clip_offset: Vec2,
    pub instance_index: u32,
    pub sample_index: u32,
    pub first_row: u32,
    pub wavelengths: u32,
    pub footprint: f32,
    pub samples_in_batch: u32,
    pub first_column: u32,
    pub padding: u32,
    pub spectrum: [[f32; 4]; 4],
}
