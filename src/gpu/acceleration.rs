//! Acceleration structures: what ray queries in shaders look into.
//!
//! In flow the corners of triangles in a [`Buffer`], the meshes that they make and where those are placed; out flows
//! an [`AccelerationStructure`] of two levels, for a [`Bind`](super::Bind). Its bottom level, [`MeshStructures`], has
//! one structure a mesh, in the mesh's own space, and several top levels may share it; the top level has one entry a
//! placed mesh. Both are made once, for being traced fast, and never change.

use std::ops::Range;
use std::slice;
use std::sync::Arc;

use ash::{khr, vk};
use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, Mat3};

use super::commands::{Accesses, BUFFER_WRITES};
use super::error::Context;
use super::{Buffer, BufferDesc, BufferUse, Commands, Gpu, GpuError, Recorder, Result};

/// Bytes of a corner: x, y, z and one that is not read, in 32 bits each: shaders fetch it at once.
const CORNER_BYTES: u64 = 16;
/// Bytes of a triangle: its three corners.
const TRIANGLE_BYTES: u64 = 3 * CORNER_BYTES;

/// Bits of the number by which shaders know a placed mesh.
const NUMBER_BITS: u32 = 24;

/// A mesh in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedMesh {
    /// Index into the list of meshes.
    pub mesh: usize,
    /// From the mesh's space to the world, rounded to 32 bits. It may mirror, but not flatten.
    pub object_to_world: DAffine3,
}

/// Meshes in their places, ordered so that the device finds what a ray meets.
///
/// In a shader, `rayQueryGetIntersectionInstanceCustomIndexEXT` is the position of a placed mesh in the list, and
/// `rayQueryGetIntersectionPrimitiveIndexEXT` counts the triangles of its mesh from 0. All triangles are opaque and
/// none is culled, whatever a ray's flags say of facing. A triangle's front is the side from which its corners run
/// counter-clockwise in the mesh's own space, in a mirror too.
pub struct AccelerationStructure {
    // First: it refers to the meshes.
    top: Level,
    _meshes: Arc<MeshStructures>,
}

/// One structure for each of some meshes.
pub struct MeshStructures(Vec<Level>);

impl MeshStructures {
    /// Builds them and waits for them.
    ///
    /// `corners` is a [storage buffer](BufferUse::Storage) of triangles, twelve 32-bit floats each; a mesh is a range
    /// of them. The buffer is not needed afterwards. Meshes without triangles are met by no ray.
    ///
    /// # Panics
    ///
    /// If `corners` is no storage buffer or does not hold all meshes.
    pub fn new(commands: &mut Commands, corners: &Buffer, meshes: &[Range<u32>]) -> Result<Self> {
        let gpu = commands.gpu().clone();
        // Before a buffer's address is asked for.
        gpu.acceleration()?;
        let limits = gpu.info().acceleration;
        let mut builds = Vec::with_capacity(meshes.len());
        for mesh in meshes {
            within("a mesh", "triangles", mesh.len() as u64, limits.triangles, "use smaller meshes")?;
            builds.push(Build::new(&gpu, "acceleration structure of a mesh", Input::mesh(corners, mesh))?);
        }
        build(commands, &builds)?;
        Ok(Self(builds.into_iter().map(|build| build.level).collect()))
    }
}

impl AccelerationStructure {
    /// Builds the top level and waits for it. Scenes without meshes are met by no ray.
    ///
    /// # Panics
    ///
    /// If a placed mesh is not in the list, or if its placement cannot be inverted in 32 bits.
    pub fn new(commands: &mut Commands, meshes: &Arc<MeshStructures>, placed: &[PlacedMesh]) -> Result<Self> {
        let gpu = commands.gpu().clone();
        let most = gpu.info().acceleration.instances.min(1 << NUMBER_BITS);
        within("the scene", "placed meshes", placed.len() as u64, most, "place fewer objects")?;
        let entries: Vec<_> = (0..)
            .zip(placed)
            .map(|(number, p)| Entry::new(number, p.object_to_world, meshes.0[p.mesh].address()))
            .collect();
        let count = entries.len() as u32;
        let entries = commands.upload_buffer("placed meshes", &entries)?;
        let scene = Build::new(&gpu, "acceleration structure of the scene", Input::scene(&entries, count))?;
        build(commands, slice::from_ref(&scene))?;
        Ok(Self { top: scene.level, _meshes: meshes.clone() })
    }

    pub(super) fn handle(&self) -> vk::AccelerationStructureKHR {
        self.top.handle
    }
}

/// Makes what was prepared, one after the other.
fn build(commands: &mut Commands, builds: &[Build<'_>]) -> Result<()> {
    let gpu = commands.gpu().clone();
    let scratch = Scratch::new(&gpu, builds.iter().map(|build| build.scratch).max().unwrap_or(0))?;
    commands.run(|cmd| {
        cmd.memory_barrier(BUFFER_WRITES, BUILD_INPUT);
        // The top level reads what was built before.
        cmd.memory_barrier(BUILD, BUILD);
        for build in builds {
            cmd.build(build, &scratch);
            // The next one works in the same memory.
            cmd.memory_barrier(BUILD, BUILD);
        }
        cmd.memory_barrier(BUILD, TRACE);
    })?;
    Ok(())
}

/// What a build does to the buffers that it is given.
const BUILD_INPUT: Accesses =
    (vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR, vk::AccessFlags2::SHADER_READ);

/// What a build does to acceleration structures and to the memory that it works in.
const BUILD: Accesses = (
    vk::PipelineStageFlags2::ACCELERATION_STRUCTURE_BUILD_KHR,
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR.as_raw()
            | vk::AccessFlags2::ACCELERATION_STRUCTURE_WRITE_KHR.as_raw(),
    ),
);

/// What ray queries do, in the stages that see a bind group.
const TRACE: Accesses = (
    vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::VERTEX_SHADER.as_raw()
            | vk::PipelineStageFlags2::FRAGMENT_SHADER.as_raw()
            | vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw(),
    ),
    vk::AccessFlags2::ACCELERATION_STRUCTURE_READ_KHR,
);

fn within(what: &str, unit: &str, count: u64, limit: u64, advice: &'static str) -> Result<()> {
    if count <= limit {
        return Ok(());
    }
    let (size, limit) = (format!("{count} {unit}"), format!("{limit} {unit}"));
    Err(GpuError::TooLarge { what: what.into(), size, limit, advice })
}

/// A placed mesh as the device reads it: `VkAccelerationStructureInstanceKHR`, in which bit fields are pairs.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Entry {
    /// Three rows of four.
    object_to_world: [[f32; 4]; 3],
    /// 24 bits and 8.
    number_and_mask: u32,
    /// 24 bits and 8; the offset is one of shader binding tables, which ray queries do without.
    offset_and_flags: u32,
    mesh: vk::DeviceAddress,
}

const _: () = assert!(size_of::<Entry>() == size_of::<vk::AccelerationStructureInstanceKHR>());

impl Entry {
    fn new(number: u32, object_to_world: DAffine3, mesh: vk::DeviceAddress) -> Self {
        /// Every ray sees it.
        const MASK: u32 = 0xff;
        let [x, y, z, to] =
            [object_to_world.x_axis, object_to_world.y_axis, object_to_world.z_axis, object_to_world.translation]
                .map(|column| column.as_vec3());
        let volume = Mat3::from_cols(x, y, z).as_dmat3().determinant();
        let sound = volume != 0.0 && volume.is_finite() && to.is_finite();
        assert!(sound, "placed mesh {number} cannot be traced: {object_to_world}");
        Self {
            object_to_world: [[x.x, y.x, z.x, to.x], [x.y, y.y, z.y, to.y], [x.z, y.z, z.z, to.z]],
            number_and_mask: number | MASK << NUMBER_BITS,
            offset_and_flags: vk::GeometryInstanceFlagsKHR::TRIANGLE_FACING_CULL_DISABLE.as_raw() << NUMBER_BITS,
            mesh,
        }
    }
}

/// What one structure is built from, for as long as the buffer with it lives.
struct Input<'b> {
    kind: vk::AccelerationStructureTypeKHR,
    geometry: vk::AccelerationStructureGeometryKHR<'b>,
    /// Triangles, or placed meshes.
    count: u32,
}

impl<'b> Input<'b> {
    /// Triangles among `corners`.
    fn mesh(corners: &'b Buffer, mesh: &Range<u32>) -> Self {
        let (start, end) = (u64::from(mesh.start), u64::from(mesh.end));
        assert!(
            start <= end && end * TRIANGLE_BYTES <= corners.size(),
            "mesh {mesh:?} is not among {} triangles",
            corners.size() / TRIANGLE_BYTES
        );
        let count = mesh.end - mesh.start;
        // Nothing is read for a mesh without triangles, which may stand where the buffer ends.
        let offset = if count == 0 { 0 } else { start * TRIANGLE_BYTES };
        // A buffer has less than 2^32 bytes, so that corners can be counted in 32 bits.
        let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
            .vertex_format(vk::Format::R32G32B32_SFLOAT)
            .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: corners.address() + offset })
            .vertex_stride(CORNER_BYTES)
            .max_vertex((3 * count).saturating_sub(1))
            .index_type(vk::IndexType::NONE_KHR);
        Self {
            kind: vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL,
            geometry: vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
                .flags(vk::GeometryFlagsKHR::OPAQUE),
            count,
        }
    }

    /// The first `count` of `entries`.
    fn scene(entries: &'b Buffer, count: u32) -> Self {
        let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
            .data(vk::DeviceOrHostAddressConstKHR { device_address: entries.address() });
        Self {
            kind: vk::AccelerationStructureTypeKHR::TOP_LEVEL,
            geometry: vk::AccelerationStructureGeometryKHR::default()
                .geometry_type(vk::GeometryTypeKHR::INSTANCES)
                .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
                .flags(vk::GeometryFlagsKHR::OPAQUE),
            count,
        }
    }

    /// How it is built; where to is still missing.
    fn info(&self) -> vk::AccelerationStructureBuildGeometryInfoKHR<'_> {
        vk::AccelerationStructureBuildGeometryInfoKHR::default()
            .ty(self.kind)
            .flags(vk::BuildAccelerationStructureFlagsKHR::PREFER_FAST_TRACE)
            .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
            .geometries(slice::from_ref(&self.geometry))
    }
}

/// One acceleration structure, of a mesh or of the scene.
struct Level {
    handle: vk::AccelerationStructureKHR,
    functions: khr::acceleration_structure::Device,
    /// Where it lies. It holds the device.
    _buffer: Buffer,
}

impl Level {
    /// A structure of `size` bytes that is not built yet.
    fn new(gpu: &Gpu, name: &str, kind: vk::AccelerationStructureTypeKHR, size: u64) -> Result<Self> {
        let functions = gpu.acceleration()?.clone();
        let buffer = Buffer::new(gpu, &BufferDesc { name, size, usage: BufferUse::Acceleration })?;
        let info = vk::AccelerationStructureCreateInfoKHR::default().buffer(buffer.handle).size(size).ty(kind);
        // SAFETY: the buffer was made to hold acceleration structures, is as large and holds no other.
        let handle = unsafe { functions.create_acceleration_structure(&info, None) }
            .context("vkCreateAccelerationStructureKHR")?;
        gpu.name(handle, name);
        Ok(Self { handle, functions, _buffer: buffer })
    }

    /// By what the scene refers to a mesh.
    fn address(&self) -> vk::DeviceAddress {
        let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(self.handle);
        // SAFETY: the structure is alive, and so is its buffer, which has an address.
        unsafe { self.functions.get_acceleration_structure_device_address(&info) }
    }
}

impl Drop for Level {
    fn drop(&mut self) {
        // SAFETY: `Commands::run` waits, so neither a build nor a ray query uses it any more; its buffer goes after
        // it.
        unsafe { self.functions.destroy_acceleration_structure(self.handle, None) };
    }
}

/// A structure and what it is going to be built from.
struct Build<'b> {
    level: Level,
    input: Input<'b>,
    /// Bytes that the build works in.
    scratch: u64,
}

impl<'b> Build<'b> {
    fn new(gpu: &Gpu, name: &str, input: Input<'b>) -> Result<Self> {
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        // SAFETY: the info describes one geometry, and one count is given; no address is read.
        unsafe {
            gpu.acceleration()?.get_acceleration_structure_build_sizes(
                vk::AccelerationStructureBuildTypeKHR::DEVICE,
                &input.info(),
                &[input.count],
                &mut sizes,
            );
        }
        let level = Level::new(gpu, name, input.kind, sizes.acceleration_structure_size)?;
        Ok(Self { level, input, scratch: sizes.build_scratch_size })
    }
}

/// The memory that builds work in, one after another.
struct Scratch {
    address: vk::DeviceAddress,
    _buffer: Buffer,
}

impl Scratch {
    /// Enough for each build that needs up to `size` bytes.
    fn new(gpu: &Gpu, size: u64) -> Result<Self> {
        let alignment = gpu.info().acceleration.scratch_alignment.max(1);
        // Buffers may be aligned to less.
        let size = size + alignment;
        let buffer = Buffer::new(
            gpu,
            &BufferDesc { name: "scratch of acceleration structures", size, usage: BufferUse::Scratch },
        )?;
        Ok(Self { address: buffer.address().next_multiple_of(alignment), _buffer: buffer })
    }
}

impl<'r> Recorder<'_, 'r> {
    /// Builds one structure; `scratch` has room for it, and no build before is still at work there.
    fn build(&mut self, build: &'r Build<'r>, scratch: &'r Scratch) {
        let info = build
            .input
            .info()
            .dst_acceleration_structure(build.level.handle)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch.address });
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(build.input.count)];
        // SAFETY: the structure was made for this input, and scratch memory for the largest; both, and the buffer
        // with the input, which `Input` holds on to, are borrowed for longer than the build executes.
        unsafe { build.level.functions.cmd_build_acceleration_structures(self.commands.buffer, &[info], &[&range]) };
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn what_is_too_large_is_named_with_the_limit() {
        assert!(within("the scene", "placed meshes", 7, 7, "place fewer objects").is_ok());
        let refusal = within("the scene", "placed meshes", 8, 7, "place fewer objects").map_err(|e| e.to_string());
        let text =
            "the scene is 8 placed meshes, more than this device's limit of 7 placed meshes; place fewer objects";
        assert_eq!(refusal, Err(text.into()));
    }

    #[test]
    fn an_entry_has_the_rows_of_its_placement_and_its_bits_where_they_belong() {
        let columns = [1.0, 5.0, 9.0, 2.0, 6.0, 11.0, 3.0, 8.0, 12.0, 4.0, 7.0, 10.0];
        let entry = Entry::new(0x23_4567, DAffine3::from_cols_array(&columns), 42);
        assert_eq!(entry.object_to_world, [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 8.0, 7.0], [9.0, 11.0, 12.0, 10.0]]);
        assert_eq!((entry.number_and_mask, entry.offset_and_flags, entry.mesh), (0xff23_4567, 0x0100_0000, 42));
    }

    #[test]
    #[should_panic(expected = "placed mesh 3 cannot be traced")]
    fn a_placement_that_flattens_is_refused() {
        Entry::new(3, DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)), 0);
    }
}
