//! Images, and what they are being used for.

use std::sync::{Mutex, PoisonError};

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::error::Context;
use super::memory::bound;
use super::{Gpu, GpuError, Result};

/// What an image is used for next. [`Recorder::use_image`](super::Recorder::use_image) waits for the use before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Its content is not needed.
    Nothing,
    /// A colour target of a render pass.
    ColorTarget,
    /// The depth target of a render pass.
    DepthTarget,
    /// Read by shaders.
    Sampled,
    /// Read and written by compute shaders.
    Storage,
    /// Copied from, scaled or not.
    CopySource,
    /// Copied to.
    CopyTarget,
}

impl Use {
    pub(super) fn layout(self) -> vk::ImageLayout {
        match self {
            Self::Nothing => vk::ImageLayout::UNDEFINED,
            Self::ColorTarget => vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            Self::DepthTarget => vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
            Self::Sampled => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            Self::Storage => vk::ImageLayout::GENERAL,
            Self::CopySource => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            Self::CopyTarget => vk::ImageLayout::TRANSFER_DST_OPTIMAL,
        }
    }

    /// The stages that touch the image, and how.
    pub(super) fn access(self) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        match self {
            Self::Nothing => (Stage::NONE, Access::NONE),
            Self::ColorTarget => {
                (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE)
            }
            Self::DepthTarget => (
                Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS,
                Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE,
            ),
            Self::Sampled => (Stage::FRAGMENT_SHADER | Stage::COMPUTE_SHADER, Access::SHADER_SAMPLED_READ),
            Self::Storage => (Stage::COMPUTE_SHADER, Access::SHADER_STORAGE_READ | Access::SHADER_STORAGE_WRITE),
            Self::CopySource => (Stage::COPY | Stage::BLIT, Access::TRANSFER_READ),
            Self::CopyTarget => (Stage::COPY, Access::TRANSFER_WRITE),
        }
    }

    /// Whether it is through a view; Vulkan makes none of images that are only copied.
    fn has_view(self) -> bool {
        matches!(self, Self::ColorTarget | Self::DepthTarget | Self::Sampled | Self::Storage)
    }

    fn flag(self) -> vk::ImageUsageFlags {
        use vk::ImageUsageFlags as Flags;
        match self {
            Self::Nothing => Flags::empty(),
            Self::ColorTarget => Flags::COLOR_ATTACHMENT,
            Self::DepthTarget => Flags::DEPTH_STENCIL_ATTACHMENT,
            Self::Sampled => Flags::SAMPLED,
            Self::Storage => Flags::STORAGE,
            Self::CopySource => Flags::TRANSFER_SRC,
            Self::CopyTarget => Flags::TRANSFER_DST,
        }
    }
}

/// What a texel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Four 32-bit floats.
    Rgba32Float,
    /// Four 16-bit floats.
    Rgba16Float,
    /// Four bytes, blue first, that hold sRGB. Shaders read and write them as they are, blits and screens as the light that they mean.
    Bgra8Srgb,
    /// A whole number of 32 bits.
    R32Uint,
    /// A depth of 32-bit float.
    Depth32,
}

impl Format {
    pub(super) fn handle(self) -> vk::Format {
        match self {
            Self::Rgba32Float => vk::Format::R32G32B32A32_SFLOAT,
            Self::Rgba16Float => vk::Format::R16G16B16A16_SFLOAT,
            Self::Bgra8Srgb => vk::Format::B8G8R8A8_SRGB,
            Self::R32Uint => vk::Format::R32_UINT,
            Self::Depth32 => vk::Format::D32_SFLOAT,
        }
    }

    /// How shaders see it.
    pub(super) fn view(self) -> vk::Format {
        match self {
            Self::Bgra8Srgb => vk::Format::B8G8R8A8_UNORM,
            other => other.handle(),
        }
    }

    fn bytes(self) -> u64 {
        match self {
            Self::Rgba32Float => 16,
            Self::Rgba16Float => 8,
            Self::Bgra8Srgb | Self::R32Uint | Self::Depth32 => 4,
        }
    }
}

/// How an image is made.
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    /// Its name in messages.
    pub name: &'a str,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Its texels.
    pub format: Format,
    /// Everything that it will be used for.
    pub uses: &'a [Use],
}

/// A two-dimensional image on the device, without mip levels.
pub struct Image {
    pub(super) handle: vk::Image,
    /// Null where no use has one.
    pub(super) view: vk::ImageView,
    pub(super) format: Format,
    pub(super) extent: vk::Extent2D,
    /// The use of the last recording; recordings execute in the order in which they are made.
    current: Mutex<Use>,
    allocation: Option<Allocation>,
    gpu: Gpu,
}

impl Image {
    /// An image without content.
    pub fn new(gpu: &Gpu, desc: &ImageDesc<'_>) -> Result<Self> {
        let limit = gpu.max_image_side();
        if desc.width.max(desc.height) > limit {
            return Err(GpuError::TooLarge {
                what: desc.name.into(),
                size: format!("{}x{} pixels", desc.width, desc.height),
                limit: format!("{limit} a side"),
                advice: "use a smaller one",
            });
        }
        let extent = vk::Extent2D { width: desc.width, height: desc.height };
        let flags = match desc.format.view() == desc.format.handle() {
            true => vk::ImageCreateFlags::empty(),
            false => vk::ImageCreateFlags::MUTABLE_FORMAT,
        };
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(vk::ImageType::TYPE_2D)
            .format(desc.format.handle())
            .extent(extent.into())
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(desc.uses.iter().fold(vk::ImageUsageFlags::empty(), |flags, usage| flags | usage.flag()));
        // SAFETY: the size is within the device's limits; Vulkan guarantees the colour formats for these uses, and a device is
        // only opened if it has the depth format.
        let handle = unsafe { gpu.device.create_image(&info, None) }.context("vkCreateImage")?;
        // From here on, dropping `image` cleans up; a null view is ignored then.
        let mut image = Self {
            handle,
            view: vk::ImageView::null(),
            format: desc.format,
            extent,
            current: Mutex::new(Use::Nothing),
            allocation: None,
            gpu: gpu.clone(),
        };
        gpu.name(handle, desc.name);
        // SAFETY: the image was just made on this device.
        let requirements = unsafe { gpu.device.get_image_memory_requirements(handle) };
        let allocation = gpu.allocate(desc.name, requirements, MemoryLocation::GpuOnly, /* linear: */ false)?;
        // SAFETY: memory and offset come from the allocator for these very requirements; bound once, and kept until the
        // image is destroyed.
        let result = unsafe { gpu.device.bind_image_memory(handle, allocation.memory(), allocation.offset()) };
        image.allocation = Some(allocation);
        bound(desc.name, requirements.size, result)?;
        if !desc.uses.iter().any(|usage| usage.has_view()) {
            return Ok(image);
        }
        let view = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(desc.format.view())
            .subresource_range(image.range());
        // SAFETY: the image is bound to memory, and the view names its own format and its only level.
        image.view = unsafe { gpu.device.create_image_view(&view, None) }.context("vkCreateImageView")?;
        gpu.name(image.view, desc.name);
        Ok(image)
    }

    /// Columns.
    pub fn width(&self) -> u32 {
        self.extent.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.extent.height
    }

    /// Bytes of all texels.
    pub fn bytes(&self) -> u64 {
        self.texel_bytes() * u64::from(self.width()) * u64::from(self.height())
    }

    /// The only level and layer.
    pub(super) fn range(&self) -> vk::ImageSubresourceRange {
        let depth = self.format == Format::Depth32;
        let aspect_mask = if depth { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR };
        vk::ImageSubresourceRange {
            aspect_mask,
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        }
    }

    /// Bytes of one texel.
    pub(super) fn texel_bytes(&self) -> u64 {
        self.format.bytes()
    }

    /// The use before, replaced by `next`.
    pub(super) fn replace_use(&self, next: Use) -> Use {
        std::mem::replace(&mut *self.current.lock().unwrap_or_else(PoisonError::into_inner), next)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: `Commands::run` waits, so no recording that names this image is still executing; the view goes first.
        unsafe {
            self.gpu.device.destroy_image_view(self.view, None);
            self.gpu.device.destroy_image(self.handle, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.gpu.free(allocation);
        }
    }
}
