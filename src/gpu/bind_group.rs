//! Resources that a pipeline sees: a descriptor set, written once.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{AccelerationStructure, Buffer, Gpu, Image, Result};

/// A resource at one binding; its position in the list is the binding's number.
#[derive(Clone)]
pub enum Bind {
    /// A storage buffer.
    Buffer(Arc<Buffer>),
    /// An image that shaders fetch texels from.
    Sampled(Arc<Image>),
    /// An image that shaders read and write.
    Storage(Arc<Image>),
    /// What ray queries look into.
    Acceleration(Arc<AccelerationStructure>),
}

impl Bind {
    fn kind(&self) -> vk::DescriptorType {
        match self {
            Self::Buffer(_) => vk::DescriptorType::STORAGE_BUFFER,
            Self::Sampled(_) => vk::DescriptorType::SAMPLED_IMAGE,
            Self::Storage(_) => vk::DescriptorType::STORAGE_IMAGE,
            Self::Acceleration(_) => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }
}

/// Set 0 of a pipeline, and the resources in it.
pub struct BindGroup {
    pub(super) layout: vk::DescriptorSetLayout,
    pub(super) set: vk::DescriptorSet,
    /// What is bound where: a pipeline takes groups of the kinds that it was made with.
    pub(super) kinds: Vec<vk::DescriptorType>,
    pool: vk::DescriptorPool,
    gpu: Gpu,
    resources: Vec<Bind>,
}

impl BindGroup {
    /// A group of `resources`, in the order of their bindings.
    pub fn new(gpu: &Gpu, name: &str, resources: Vec<Bind>) -> Result<Self> {
        let kinds: Vec<_> = resources.iter().map(Bind::kind).collect();
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT | vk::ShaderStageFlags::COMPUTE;
        let bindings: Vec<_> = (0..)
            .zip(&kinds)
            .map(|(binding, &kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        // Kinds that repeat may be listed as often as they occur.
        let sizes: Vec<_> = kinds.iter().map(|&ty| vk::DescriptorPoolSize { ty, descriptor_count: 1 }).collect();
        let mut group = Self {
            layout: vk::DescriptorSetLayout::null(),
            set: vk::DescriptorSet::null(),
            kinds,
            pool: vk::DescriptorPool::null(),
            gpu: gpu.clone(),
            resources,
        };
        let layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the infos point to locals; whatever fails, dropping `group` destroys what was made and ignores nulls.
        unsafe {
            group.layout =
                gpu.device.create_descriptor_set_layout(&layout, None).context("vkCreateDescriptorSetLayout")?;
            group.pool = gpu.device.create_descriptor_pool(&pool, None).context("vkCreateDescriptorPool")?;
            let layouts = [group.layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(group.pool).set_layouts(&layouts);
            group.set = gpu.device.allocate_descriptor_sets(&info).context("vkAllocateDescriptorSets")?[0];
        }
        gpu.name(group.layout, name);
        gpu.name(group.pool, name);
        gpu.name(group.set, name);
        group.write();
        Ok(group)
    }

    /// Lets go of the resources as if nothing used them any more: a fault, planted by [`Fault`](super::Fault).
    pub(super) fn let_go(&mut self) {
        self.resources.clear();
    }

    fn write(&self) {
        for (binding, resource) in (0..).zip(&self.resources) {
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(binding)
                .descriptor_type(resource.kind());
            let image = |image: &Image, layout| {
                [vk::DescriptorImageInfo::default().image_view(image.view).image_layout(layout)]
            };
            // SAFETY: the set is not in use yet; the group holds the resources, and the infos are alive.
            let update = |write| unsafe { self.gpu.device.update_descriptor_sets(&[write], &[]) };
            match resource {
                Bind::Buffer(buffer) => {
                    let info = [vk::DescriptorBufferInfo::default().buffer(buffer.handle).range(vk::WHOLE_SIZE)];
                    update(write.buffer_info(&info));
                }
                Bind::Sampled(sampled) => {
                    update(write.image_info(&image(sampled, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)));
                }
                Bind::Storage(storage) => update(write.image_info(&image(storage, vk::ImageLayout::GENERAL))),
                Bind::Acceleration(structure) => {
                    let handles = [structure.handle()];
                    let mut info =
                        vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&handles);
                    update(write.descriptor_count(1).push_next(&mut info));
                }
            }
        }
    }
}

impl Drop for BindGroup {
    fn drop(&mut self) {
        // SAFETY: `Commands::run` waits, so the set is not in use; it goes with its pool.
        unsafe {
            self.gpu.device.destroy_descriptor_pool(self.pool, None);
            self.gpu.device.destroy_descriptor_set_layout(self.layout, None);
        }
    }
}
