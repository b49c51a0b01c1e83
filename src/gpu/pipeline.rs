//! Pipelines, and the specialization constants that cut effects out of them.

use std::mem::size_of;

use ash::vk;

use super::error::Context;
use super::shader::Module;
use super::{BindGroup, Format, Gpu, Result, Shader};
use crate::effects::{Effect, Effects};

/// The stages that see push constants.
pub(super) const PUSH_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw()
        | vk::ShaderStageFlags::FRAGMENT.as_raw()
        | vk::ShaderStageFlags::COMPUTE.as_raw(),
);

/// What every device has room for.
const MAX_PUSH_BYTES: u32 = 128;

/// Values of specialization constants, by id.
#[derive(Clone, Debug, Default)]
pub struct Specialization {
    entries: Vec<vk::SpecializationMapEntry>,
    values: Vec<u8>,
}

impl PartialEq for Specialization {
    fn eq(&self, other: &Self) -> bool {
        let ids = |all: &Self| all.entries.iter().map(|entry| (entry.constant_id, entry.offset)).collect::<Vec<_>>();
        self.values == other.values && ids(self) == ids(other)
    }
}

impl Specialization {
    /// One constant an effect, as in `shaders/effects.glsl`; ids that a shader does not have are ignored.
    pub fn effects(effects: Effects) -> Self {
        Effect::all().fold(Self::default(), |all, effect| all.with(effect as u32, effects.contains(effect)))
    }

    /// One more constant.
    #[must_use]
    pub fn with(self, id: u32, value: bool) -> Self {
        self.with_number(id, value.into())
    }

    /// One more constant, a `uint`.
    #[must_use]
    pub fn with_number(mut self, id: u32, value: u32) -> Self {
        let offset = self.values.len() as u32;
        self.entries.push(vk::SpecializationMapEntry { constant_id: id, offset, size: size_of::<u32>() });
        self.values.extend_from_slice(&value.to_ne_bytes());
        self
    }

    fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.values)
    }
}

/// How fragments meet the depth target; depth is reversed, 1 near and 0 at infinity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// There is no depth target.
    Ignored,
    /// The nearer fragment wins and is written.
    Nearest,
    /// Only where nothing was written before.
    Behind,
}

/// How a graphics pipeline is made.
#[derive(Clone, Copy)]
pub struct GraphicsPipelineDesc<'a> {
    /// Its name in messages.
    pub name: &'a str,
    /// Its vertex shader; vertices are pulled from buffers.
    pub vertex: &'a Shader,
    /// Its fragment shader.
    pub fragment: &'a Shader,
    /// What the shaders see.
    pub group: &'a BindGroup,
    /// Size of its push constants.
    pub push_bytes: u32,
    /// Formats of its colour targets.
    pub colors: &'a [Format],
    /// Its depth target, of format D32.
    pub depth: Depth,
    /// Its specialization constants.
    pub specialization: &'a Specialization,
}

/// A pipeline that draws triangles.
pub struct GraphicsPipeline(Pipeline);

/// A pipeline that runs a compute shader.
pub struct ComputePipeline(Pipeline);

pub(super) struct Pipeline {
    pub(super) handle: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    /// Kinds of the resources in its bind group.
    pub(super) kinds: Vec<vk::DescriptorType>,
    /// Size of its push constants.
    pub(super) push_bytes: u32,
    gpu: Gpu,
}

impl Pipeline {
    /// Its layout; the pipeline itself is still missing.
    fn new(gpu: &Gpu, name: &str, group: &BindGroup, push_bytes: u32) -> Result<Self> {
        assert!(push_bytes <= MAX_PUSH_BYTES && push_bytes.is_multiple_of(4), "{push_bytes} bytes of push constants");
        let sets = [group.layout];
        let ranges = [vk::PushConstantRange { stage_flags: PUSH_STAGES, offset: 0, size: push_bytes }];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
        let info = if push_bytes > 0 { info.push_constant_ranges(&ranges) } else { info };
        // SAFETY: the set's layout is alive, and the push constants fit, see above.
        let layout = unsafe { gpu.device.create_pipeline_layout(&info, None) }.context("vkCreatePipelineLayout")?;
        gpu.name(layout, name);
        Ok(Self { handle: vk::Pipeline::null(), layout, kinds: group.kinds.clone(), push_bytes, gpu: gpu.clone() })
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        // SAFETY: `Commands::run` waits, so the pipeline is not in use; nulls are ignored.
        unsafe {
            self.gpu.device.destroy_pipeline(self.handle, None);
            self.gpu.device.destroy_pipeline_layout(self.layout, None);
        }
    }
}

impl GraphicsPipeline {
    /// A pipeline for render passes with these targets.
    pub fn new(gpu: &Gpu, desc: &GraphicsPipelineDesc<'_>) -> Result<Self> {
        let mut pipeline = Pipeline::new(gpu, desc.name, desc.group, desc.push_bytes)?;
        let (vertex, fragment) = (Module::new(gpu, desc.vertex)?, Module::new(gpu, desc.fragment)?);
        let specialization = desc.specialization.info();
        let stage = |stage, module: &Module<'_>| {
            vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module.handle).name(c"main")
        };
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, &vertex).specialization_info(&specialization),
            stage(vk::ShaderStageFlags::FRAGMENT, &fragment).specialization_info(&specialization),
        ];
        let vertices = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster =
            vk::PipelineRasterizationStateCreateInfo::default().polygon_mode(vk::PolygonMode::FILL).line_width(1.0);
        let samples =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(desc.depth != Depth::Ignored)
            .depth_write_enable(desc.depth == Depth::Nearest)
            .depth_compare_op(match desc.depth {
                Depth::Nearest | Depth::Ignored => vk::CompareOp::GREATER,
                Depth::Behind => vk::CompareOp::GREATER_OR_EQUAL,
            });
        let opaque = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
        let blends = vec![opaque; desc.colors.len()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&[
            vk::DynamicState::VIEWPORT,
            vk::DynamicState::SCISSOR,
            vk::DynamicState::CULL_MODE,
            vk::DynamicState::FRONT_FACE,
        ]);
        let depth_format = if desc.depth == Depth::Ignored { vk::Format::UNDEFINED } else { Format::Depth32.handle() };
        let colors: Vec<_> = desc.colors.iter().map(|color| color.view()).collect();
        let mut targets = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&colors)
            .depth_attachment_format(depth_format);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertices)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(pipeline.layout)
            .push_next(&mut targets);
        // SAFETY: every pointer is to a local; modules and layout are alive.
        let made = unsafe { gpu.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
        pipeline.handle = made.map_err(|(_, result)| result).context("vkCreateGraphicsPipelines")?[0];
        gpu.name(pipeline.handle, desc.name);
        Ok(Self(pipeline))
    }

    pub(super) fn inner(&self) -> &Pipeline {
        &self.0
    }
}

impl ComputePipeline {
    /// A pipeline of one compute shader.
    pub fn new(
        gpu: &Gpu,
        shader: &Shader,
        group: &BindGroup,
        push_bytes: u32,
        specialization: &Specialization,
    ) -> Result<Self> {
        let mut pipeline = Pipeline::new(gpu, shader.name, group, push_bytes)?;
        let module = Module::new(gpu, shader)?;
        let specialization = specialization.info();
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.handle)
            .name(c"main")
            .specialization_info(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.layout);
        // SAFETY: every pointer is to a local; module and layout are alive.
        let made = unsafe { gpu.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None) };
        pipeline.handle = made.map_err(|(_, result)| result).context("vkCreateComputePipelines")?[0];
        gpu.name(pipeline.handle, shader.name);
        Ok(Self(pipeline))
    }

    pub(super) fn inner(&self) -> &Pipeline {
        &self.0
    }
}
