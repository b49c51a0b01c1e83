//! A window's surface, on which egui draws. In flow a window and what egui made of a frame, out flow presented pictures.
//!
//! The egui side is `egui-ash-renderer`, on dynamic rendering. Pictures are drawn where they are, without a copy. One frame is in flight.

use std::sync::{Arc, PoisonError};

use ash::{khr, vk};
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use winit::window::Window;

use super::error::Context;
use super::{DeviceInfo, Gpu, GpuError, Image, Instance, Result};

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// It is on the screen.
    Yes,
    /// The window has no area, or changed while it was drawn: draw it again, later or at once.
    Not,
}

/// A window that pictures are shown in.
pub struct Screen {
    // Dropped in `drop`, before the device that it is on.
    egui: Option<Renderer<DefaultAllocator>>,
    swapchain: Option<Swapchain>,
    surface: vk::SurfaceKHR,
    surfaces: khr::surface::Instance,
    swapchains: khr::swapchain::Device,
    format: vk::SurfaceFormatKHR,
    present_mode: vk::PresentModeKHR,
    pool: vk::CommandPool,
    buffer: vk::CommandBuffer,
    fence: vk::Fence,
    acquired: vk::Semaphore,
    /// Textures that the frame before may still have shown.
    freed: Vec<egui::TextureId>,
    /// What the last frame may have shown, by its number.
    pictures: Vec<Option<Picture>>,
    gpu: Gpu,
    /// Held so that it outlives the surface.
    window: Arc<Window>,
}

/// Images to draw on, of one size.
struct Swapchain {
    handle: vk::SwapchainKHR,
    extent: vk::Extent2D,
    images: Vec<vk::Image>,
    views: Vec<vk::ImageView>,
    /// For each image: it is drawn.
    drawn: Vec<vk::Semaphore>,
}

/// A surface before there is a device for it.
pub struct Surface {
    handle: vk::SurfaceKHR,
    surfaces: khr::surface::Instance,
    /// Both are held so that they outlive the surface.
    _instance: Arc<Instance>,
    window: Arc<Window>,
}

fn failed(error: impl std::fmt::Display) -> GpuError {
    GpuError::Interface(error.to_string())
}

impl Surface {
    /// That of `window`, on an instance that was made for windows.
    pub fn new(instance: &Arc<Instance>, window: &Arc<Window>) -> Result<Self> {
        let none = |error: winit::raw_window_handle::HandleError| GpuError::NoWindow(error.to_string());
        let display = window.display_handle().map_err(none)?.as_raw();
        let handle = window.window_handle().map_err(none)?.as_raw();
        // SAFETY: both handles are of a window that this holds until the surface is destroyed.
        let handle = unsafe { ash_window::create_surface(&instance.entry, &instance.handle, display, handle, None) }
            .context("vkCreateSurfaceKHR")?;
        let surfaces = khr::surface::Instance::new(&instance.entry, &instance.handle);
        Ok(Self { handle, surfaces, _instance: instance.clone(), window: window.clone() })
    }

    /// Whether `device` can show pictures here.
    pub fn takes(&self, device: &DeviceInfo) -> bool {
        // SAFETY: device and surface are of one instance.
        let supported = unsafe {
            self.surfaces.get_physical_device_surface_support(device.handle, device.queue_family, self.handle)
        };
        supported.unwrap_or(false)
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: null where a screen has taken it over; else nothing was made from it.
        unsafe { self.surfaces.destroy_surface(self.handle, None) };
    }
}

impl Screen {
    /// On a device that the surface takes.
    pub fn new(gpu: &Gpu, mut surface: Surface) -> Result<Self> {
        let info = gpu.info();
        if !surface.takes(info) {
            return Err(GpuError::CannotShow { name: info.name.clone() });
        }
        // SAFETY: device and surface are of one instance.
        let (formats, modes) = unsafe {
            (
                surface.surfaces.get_physical_device_surface_formats(info.handle, surface.handle),
                surface.surfaces.get_physical_device_surface_present_modes(info.handle, surface.handle),
            )
        };
        let formats = formats.context("vkGetPhysicalDeviceSurfaceFormatsKHR")?;
        let modes = modes.context("vkGetPhysicalDeviceSurfacePresentModesKHR")?;
        // Encoded by the device, exactly: what egui-ash-renderer does itself is a power of 2.2.
        let wanted = [vk::Format::B8G8R8A8_SRGB, vk::Format::R8G8B8A8_SRGB];
        let format = formats.iter().find(|format| wanted.contains(&format.format)).or(formats.first());
        let format = *format.ok_or_else(|| GpuError::CannotShow { name: info.name.clone() })?;
        let mailbox = modes.contains(&vk::PresentModeKHR::MAILBOX);
        let present_mode = if mailbox { vk::PresentModeKHR::MAILBOX } else { vk::PresentModeKHR::FIFO };
        let srgb = wanted.contains(&format.format);

        let instance = &gpu.instance.handle;
        let mut screen = Self {
            egui: None,
            swapchain: None,
            surface: std::mem::take(&mut surface.handle),
            surfaces: surface.surfaces.clone(),
            swapchains: khr::swapchain::Device::new(instance, &gpu.device),
            format,
            present_mode,
            pool: vk::CommandPool::null(),
            buffer: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            acquired: vk::Semaphore::null(),
            freed: Vec::new(),
            pictures: Vec::new(),
            gpu: gpu.clone(),
            window: surface.window.clone(),
        };
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format.format,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { srgb_framebuffer: srgb, ..Options::default() };
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(info.queue_family);
        // SAFETY: the infos point to locals; whatever fails, dropping `screen` destroys what was made and ignores nulls.
        unsafe {
            screen.pool = gpu.device.create_command_pool(&pool, None).context("vkCreateCommandPool")?;
            let buffers = vk::CommandBufferAllocateInfo::default().command_pool(screen.pool).command_buffer_count(1);
            screen.buffer = gpu.device.allocate_command_buffers(&buffers).context("vkAllocateCommandBuffers")?[0];
            screen.fence = gpu.device.create_fence(&Default::default(), None).context("vkCreateFence")?;
            screen.acquired = gpu.device.create_semaphore(&Default::default(), None).context("vkCreateSemaphore")?;
        }
        screen.egui = Some(
            Renderer::with_default_allocator(instance, info.handle, gpu.device.clone(), mode, options)
                .map_err(failed)?,
        );
        Ok(screen)
    }

    /// Puts `image`, of [`Format::Rgba8`](super::Format::Rgba8), last used as [`Use::Sampled`](super::Use::Sampled) and encoded as
    /// sRGB, in the place of the picture of that number; what egui knows it by.
    pub fn set_picture(&mut self, number: usize, image: Arc<Image>) -> Result<egui::TextureId> {
        let Some(egui) = &mut self.egui else { return Err(GpuError::Interface("nothing draws".into())) };
        let mut picture = Picture::new(&self.gpu, image)?;
        let id = egui.add_user_texture(picture.set);
        picture.id = id;
        if self.pictures.len() <= number {
            self.pictures.resize_with(number + 1, || None);
        }
        // The last frame was waited for: what it showed may go.
        if let Some(before) = self.pictures[number].replace(picture) {
            egui.remove_user_texture(before.id);
        }
        Ok(id)
    }

    /// Takes over textures that changed, and those that are gone.
    pub fn set_textures(&mut self, mut delta: egui::TexturesDelta) -> Result<()> {
        let Some(egui) = &mut self.egui else { return Ok(()) };
        let queue = self.gpu.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // The last frame was waited for: what it showed may go.
        for id in std::mem::take(&mut self.freed) {
            egui.free_texture(id).map_err(failed)?;
        }
        for (id, changes) in delta.set.drain() {
            for change in &changes {
                egui.set_texture(*queue, self.pool, id, change).map_err(failed)?;
            }
        }
        self.freed = delta.free.drain().collect();
        Ok(())
    }

    /// Shows what egui tessellated.
    pub fn draw(&mut self, pixels_per_point: f32, primitives: &[egui::ClippedPrimitive]) -> Result<Shown> {
        if !self.fit()? {
            return Ok(Shown::Not);
        }
        let (Some(swapchain), Some(egui)) = (&self.swapchain, &mut self.egui) else { return Ok(Shown::Not) };
        let device = &self.gpu.device;
        // SAFETY: the semaphore is not waited for by anything: the last frame that did is done.
        let acquired =
            unsafe { self.swapchains.acquire_next_image(swapchain.handle, u64::MAX, self.acquired, vk::Fence::null()) };
        let index = match acquired {
            Ok((index, _)) => index,
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.forget();
                return Ok(Shown::Not);
            }
            Err(result) => return Err(result).context("vkAcquireNextImageKHR"),
        };
        let image = swapchain.images[index as usize];
        let color = [vk::RenderingAttachmentInfo::default()
            .image_view(swapchain.views[index as usize])
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let rendering =
            vk::RenderingInfo::default().render_area(swapchain.extent.into()).layer_count(1).color_attachments(&color);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let output = Stage::COLOR_ATTACHMENT_OUTPUT;
        // SAFETY: the last frame was waited for, so pool and buffer are free; the image is this frame's until it is presented.
        unsafe {
            device.reset_command_pool(self.pool, Default::default()).context("vkResetCommandPool")?;
            device.begin_command_buffer(self.buffer, &begin).context("vkBeginCommandBuffer")?;
            let from = (output, Access::NONE, Layout::UNDEFINED);
            let to = (output, Access::COLOR_ATTACHMENT_WRITE, Layout::COLOR_ATTACHMENT_OPTIMAL);
            transition(device, self.buffer, image, from, to);
            device.cmd_begin_rendering(self.buffer, &rendering);
            egui.cmd_draw(self.buffer, swapchain.extent, pixels_per_point, primitives).map_err(failed)?;
            device.cmd_end_rendering(self.buffer);
            transition(device, self.buffer, image, to, (output, Access::NONE, Layout::PRESENT_SRC_KHR));
            device.end_command_buffer(self.buffer).context("vkEndCommandBuffer")?;
        }
        let stage = |semaphore| [vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(output)];
        let (wait, signal) = (stage(self.acquired), stage(swapchain.drawn[index as usize]));
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.buffer)];
        let submit = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(&wait)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signal)];
        let (drawn, handles, indices) = ([swapchain.drawn[index as usize]], [swapchain.handle], [index]);
        let present =
            vk::PresentInfoKHR::default().wait_semaphores(&drawn).swapchains(&handles).image_indices(&indices);
        // SAFETY: everything named is alive until the fence, which is waited for here; the lock keeps threads apart.
        let presented = unsafe {
            let presented = {
                let queue = self.gpu.queue.lock().unwrap_or_else(PoisonError::into_inner);
                device.queue_submit2(*queue, &submit, self.fence).context("vkQueueSubmit2")?;
                self.swapchains.queue_present(*queue, &present)
            };
            device.wait_for_fences(&[self.fence], true, u64::MAX).context("vkWaitForFences")?;
            device.reset_fences(&[self.fence]).context("vkResetFences")?;
            presented
        };
        match presented {
            Ok(false) => Ok(Shown::Yes),
            Ok(true) | Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.forget();
                Ok(Shown::Not)
            }
            Err(result) => Err(result).context("vkQueuePresentKHR"),
        }
    }

    /// Makes a swapchain of the window's size; false where that has no area.
    fn fit(&mut self) -> Result<bool> {
        let size = self.window.inner_size();
        let info = self.gpu.info();
        if size.width == 0 || size.height == 0 {
            return Ok(false);
        }
        if self.swapchain.as_ref().is_some_and(|s| (s.extent.width, s.extent.height) == (size.width, size.height)) {
            return Ok(true);
        }
        // SAFETY: device and surface are of one instance.
        let can = unsafe { self.surfaces.get_physical_device_surface_capabilities(info.handle, self.surface) }
            .context("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let extent = if can.current_extent.width == u32::MAX {
            vk::Extent2D {
                width: size.width.clamp(can.min_image_extent.width, can.max_image_extent.width),
                height: size.height.clamp(can.min_image_extent.height, can.max_image_extent.height),
            }
        } else {
            can.current_extent
        };
        if extent.width == 0 || extent.height == 0 {
            return Ok(false);
        }
        if self.swapchain.as_ref().is_some_and(|swapchain| swapchain.extent == extent) {
            return Ok(true);
        }
        let most = if can.max_image_count == 0 { u32::MAX } else { can.max_image_count };
        let old = self.swapchain.as_ref().map_or(vk::SwapchainKHR::null(), |swapchain| swapchain.handle);
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT];
        let alpha = alpha.into_iter().find(|&alpha| can.supported_composite_alpha.contains(alpha));
        let create = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface)
            .min_image_count((can.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .pre_transform(can.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE))
            .present_mode(self.present_mode)
            .clipped(true)
            .old_swapchain(old);
        // SAFETY: the surface is alive; what is old is not drawn on any more.
        let handle = unsafe { self.swapchains.create_swapchain(&create, None) }.context("vkCreateSwapchainKHR")?;
        self.forget();
        let swapchain = Swapchain { handle, extent, images: Vec::new(), views: Vec::new(), drawn: Vec::new() };
        let swapchain = self.swapchain.insert(swapchain);
        let device = &self.gpu.device;
        // SAFETY: whatever fails, `forget` destroys what was made.
        unsafe {
            swapchain.images = self.swapchains.get_swapchain_images(handle).context("vkGetSwapchainImagesKHR")?;
            for &image in &swapchain.images {
                let range = vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(1)
                    .layer_count(1);
                let create = vk::ImageViewCreateInfo::default()
                    .image(image)
                    .view_type(vk::ImageViewType::TYPE_2D)
                    .format(self.format.format)
                    .subresource_range(range);
                swapchain.views.push(device.create_image_view(&create, None).context("vkCreateImageView")?);
                swapchain.drawn.push(device.create_semaphore(&Default::default(), None).context("vkCreateSemaphore")?);
            }
        }
        Ok(true)
    }

    /// Lets go of the swapchain.
    fn forget(&mut self) {
        let Some(swapchain) = self.swapchain.take() else { return };
        let device = &self.gpu.device;
        // SAFETY: nothing is drawn; presentation, which has no fence of its own, ends with the queue's work.
        unsafe {
            {
                let queue = self.gpu.queue.lock().unwrap_or_else(PoisonError::into_inner);
                let _ = device.queue_wait_idle(*queue);
            }
            for view in swapchain.views {
                device.destroy_image_view(view, None);
            }
            for semaphore in swapchain.drawn {
                device.destroy_semaphore(semaphore, None);
            }
            self.swapchains.destroy_swapchain(swapchain.handle, None);
        }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.forget();
        self.egui = None;
        self.pictures.clear();
        // SAFETY: every frame was waited for; what was not made is null and ignored. The surface goes before its window.
        unsafe {
            let device = &self.gpu.device;
            device.destroy_semaphore(self.acquired, None);
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
            self.surfaces.destroy_surface(self.surface, None);
        }
    }
}

/// A picture as egui's pipeline sees it.
struct Picture {
    id: egui::TextureId,
    set: vk::DescriptorSet,
    layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    view: vk::ImageView,
    sampler: vk::Sampler,
    /// Held while it is shown.
    image: Arc<Image>,
    gpu: Gpu,
}

impl Picture {
    fn new(gpu: &Gpu, image: Arc<Image>) -> Result<Self> {
        const KIND: vk::DescriptorType = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let mut picture = Self {
            id: egui::TextureId::default(),
            set: vk::DescriptorSet::null(),
            layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            view: vk::ImageView::null(),
            sampler: vk::Sampler::null(),
            image,
            gpu: gpu.clone(),
        };
        let image = &picture.image;
        let view = vk::ImageViewCreateInfo::default()
            .image(image.handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(vk::Format::R8G8B8A8_SRGB)
            .subresource_range(image.range());
        let sampler = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
        let sizes = [vk::DescriptorPoolSize { ty: KIND, descriptor_count: 1 }];
        let pool = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // As egui's renderer makes them for its own textures.
        let bindings = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(KIND)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let layout = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        let device = &gpu.device;
        // SAFETY: the infos point to locals; the image was made with a format that can be changed, and is held; whatever fails,
        // dropping `picture` destroys what was made and ignores nulls.
        unsafe {
            picture.view = device.create_image_view(&view, None).context("vkCreateImageView")?;
            picture.sampler = device.create_sampler(&sampler, None).context("vkCreateSampler")?;
            picture.pool = device.create_descriptor_pool(&pool, None).context("vkCreateDescriptorPool")?;
            picture.layout =
                device.create_descriptor_set_layout(&layout, None).context("vkCreateDescriptorSetLayout")?;
            let layouts = [picture.layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(picture.pool).set_layouts(&layouts);
            picture.set = device.allocate_descriptor_sets(&info).context("vkAllocateDescriptorSets")?[0];
            let image = [vk::DescriptorImageInfo::default()
                .sampler(picture.sampler)
                .image_view(picture.view)
                .image_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL)];
            let write = vk::WriteDescriptorSet::default().dst_set(picture.set).descriptor_type(KIND).image_info(&image);
            device.update_descriptor_sets(&[write], &[]);
        }
        Ok(picture)
    }
}

impl Drop for Picture {
    fn drop(&mut self) {
        // SAFETY: every frame was waited for; the set goes with its pool.
        unsafe {
            let device = &self.gpu.device;
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.layout, None);
            device.destroy_sampler(self.sampler, None);
            device.destroy_image_view(self.view, None);
        }
    }
}

type State = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// # Safety
///
/// The buffer is being recorded, the image is alive and in the layout that it is said to be in.
unsafe fn transition(device: &ash::Device, buffer: vk::CommandBuffer, image: vk::Image, from: State, to: State) {
    let range =
        vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
    let barrier = [vk::ImageMemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .old_layout(from.2)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)
        .new_layout(to.2)
        .image(image)
        .subresource_range(range)];
    let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
    // SAFETY: as the caller promises.
    unsafe { device.cmd_pipeline_barrier2(buffer, &dependency) };
}
