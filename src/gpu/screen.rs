//! A window's surface, on which egui draws. In flow a window and what egui made of a frame, out flow presented pictures.
//!
//! The egui side is `egui-ash-renderer`, on dynamic rendering, over pictures that are copied to the screen. One frame is in flight.

use std::sync::{Arc, PoisonError};

use ash::{ext, khr, vk};
use egui_ash_renderer::allocator::DefaultAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};
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

/// A picture on the screen. It is of [`Format::Bgra8Srgb`](super::Format::Bgra8Srgb), and was last used as [`Use::CopySource`](super::Use::CopySource).
#[derive(Clone)]
pub struct Placed {
    /// The picture.
    pub image: Arc<Image>,
    /// Where all of it would be, in pixels of the window.
    pub at: [i32; 2],
    /// How large it is there.
    pub size: [u32; 2],
    /// The columns of the window that it may cover, from the first to before the last.
    pub columns: [i32; 2],
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
    gpu: Gpu,
    /// Held so that it outlives the surface; `None` where there is no window.
    _window: Option<Arc<Window>>,
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
    window: Option<Arc<Window>>,
}

fn failed(error: RendererError) -> GpuError {
    match error {
        RendererError::Vulkan(vk::Result::ERROR_DEVICE_LOST) => GpuError::Lost,
        other => GpuError::Interface(other.to_string()),
    }
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
        Ok(Self { handle, surfaces, _instance: instance.clone(), window: Some(window.clone()) })
    }

    /// One that nobody sees, on an instance that was made [for it](Instance::headless).
    pub fn headless(instance: &Arc<Instance>) -> Result<Self> {
        let functions = ext::headless_surface::Instance::new(&instance.entry, &instance.handle);
        // SAFETY: the instance was made with this extension, or the function fails to load and is never called.
        let handle = unsafe { functions.create_headless_surface(&Default::default(), None) }
            .context("vkCreateHeadlessSurfaceEXT")?;
        let surfaces = khr::surface::Instance::new(&instance.entry, &instance.handle);
        Ok(Self { handle, surfaces, _instance: instance.clone(), window: None })
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
        let has = |wanted: &vk::Format| formats.iter().find(|format| format.format == *wanted);
        let format = wanted.iter().find_map(has);
        let format = *format.ok_or_else(|| GpuError::CannotShow { name: info.name.clone() })?;
        let mailbox = modes.contains(&vk::PresentModeKHR::MAILBOX);
        let present_mode = if mailbox { vk::PresentModeKHR::MAILBOX } else { vk::PresentModeKHR::FIFO };

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
            gpu: gpu.clone(),
            _window: surface.window.clone(),
        };
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format.format,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { srgb_framebuffer: true, ..Options::default() };
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(info.queue_family);
        // SAFETY: the infos point to locals; whatever fails, dropping `screen` destroys what was made and ignores nulls.
        unsafe {
            screen.pool = gpu.device.create_command_pool(&pool, None).context("vkCreateCommandPool")?;
            let buffers = vk::CommandBufferAllocateInfo::default().command_pool(screen.pool).command_buffer_count(1);
            screen.buffer = gpu.device.allocate_command_buffers(&buffers).context("vkAllocateCommandBuffers")?[0];
            screen.fence = gpu.device.create_fence(&Default::default(), None).context("vkCreateFence")?;
            screen.acquired = gpu.device.create_semaphore(&Default::default(), None).context("vkCreateSemaphore")?;
        }
        gpu.name(screen.pool, "frames");
        gpu.name(screen.buffer, "frame");
        gpu.name(screen.fence, "frame is done");
        gpu.name(screen.acquired, "image of the screen is there");
        screen.egui = Some(
            Renderer::with_default_allocator(instance, info.handle, gpu.device.clone(), mode, options)
                .map_err(failed)?,
        );
        Ok(screen)
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

    /// Shows pictures, the later ones in front, and before them what egui tessellated. `size` is that of the window, in pixels.
    pub fn draw(
        &mut self,
        size: [u32; 2],
        pictures: &[Placed],
        pixels_per_point: f32,
        primitives: &[egui::ClippedPrimitive],
    ) -> Result<Shown> {
        if !self.fit(size)? {
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
            .load_op(vk::AttachmentLoadOp::LOAD)
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
            let copies = Stage::CLEAR | Stage::COPY | Stage::BLIT;
            let filled = (copies, Access::TRANSFER_WRITE, Layout::TRANSFER_DST_OPTIMAL);
            let access = Access::COLOR_ATTACHMENT_READ | Access::COLOR_ATTACHMENT_WRITE;
            let to = (output, access, Layout::COLOR_ATTACHMENT_OPTIMAL);
            transition(device, self.buffer, image, (output, Access::NONE, Layout::UNDEFINED), filled);
            let whole = [vk::ImageSubresourceRange::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .level_count(1)
                .layer_count(1)];
            let covers = pictures.iter().any(|picture| picture.covers(swapchain.extent));
            if !covers {
                device.cmd_clear_color_image(self.buffer, image, filled.2, &BACKGROUND, &whole);
            }
            for (number, picture) in pictures.iter().enumerate() {
                if number > 0 || !covers {
                    transition(device, self.buffer, image, filled, filled);
                }
                picture.copy(device, self.buffer, image, self.format.format, swapchain.extent);
            }
            transition(device, self.buffer, image, filled, to);
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
            // One that is not the best any more shows all the same; one of another size is made anew by the next frame.
            Ok(_) => Ok(Shown::Yes),
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                self.forget();
                Ok(Shown::Not)
            }
            Err(result) => Err(result).context("vkQueuePresentKHR"),
        }
    }

    /// Makes a swapchain of the window's size; false where that has no area.
    fn fit(&mut self, [width, height]: [u32; 2]) -> Result<bool> {
        let info = self.gpu.info();
        if width == 0 || height == 0 {
            return Ok(false);
        }
        if self.swapchain.as_ref().is_some_and(|s| (s.extent.width, s.extent.height) == (width, height)) {
            return Ok(true);
        }
        // SAFETY: device and surface are of one instance.
        let can = unsafe { self.surfaces.get_physical_device_surface_capabilities(info.handle, self.surface) }
            .context("vkGetPhysicalDeviceSurfaceCapabilitiesKHR")?;
        let extent = if can.current_extent.width == u32::MAX {
            vk::Extent2D {
                width: width.clamp(can.min_image_extent.width, can.max_image_extent.width),
                height: height.clamp(can.min_image_extent.height, can.max_image_extent.height),
            }
        } else {
            can.current_extent
        };
        if extent.width == 0 || extent.height == 0 {
            return Ok(false);
        }
        if !can.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST) {
            return Err(GpuError::CannotShow { name: info.name.clone() });
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
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_DST)
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
        self.gpu.name(handle, "screen");
        for (number, image) in swapchain.images.iter().enumerate() {
            self.gpu.name(*image, &format!("image {number} of the screen"));
            self.gpu.name(swapchain.views[number], &format!("image {number} of the screen"));
            self.gpu.name(swapchain.drawn[number], &format!("image {number} of the screen is drawn"));
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

/// Behind pictures that do not fill the window: a dark grey.
const BACKGROUND: vk::ClearColorValue = vk::ClearColorValue { float32: [0.009, 0.009, 0.009, 1.0] };

/// A part of two images that are laid on each other: where it starts and ends, in each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Part {
    source: [[i32; 2]; 2],
    target: [[i32; 2]; 2],
}

impl Placed {
    /// What of it is seen in a window of such a size, cut where texels end.
    fn part(&self, extent: vk::Extent2D) -> Option<Part> {
        let texels = [self.image.width(), self.image.height()];
        let ends = [extent.width as i32, extent.height as i32];
        let mut part = Part { source: [[0; 2]; 2], target: [[0; 2]; 2] };
        for axis in 0..2 {
            let (at, size) = (i64::from(self.at[axis]), i64::from(self.size[axis]));
            let (mut low, mut high) = (0, i64::from(ends[axis]));
            if axis == 0 {
                (low, high) = (low.max(self.columns[0].into()), high.min(self.columns[1].into()));
            }
            let (low, high) = (low.max(at), high.min(at + size));
            if low >= high || size == 0 {
                return None;
            }
            let texel = |place: i64, up: bool| {
                let scaled = (place - at) * i64::from(texels[axis]);
                (if up { (scaled + size - 1) / size } else { scaled / size }) as i32
            };
            let (first, last) = (texel(low, false), texel(high, true));
            let place = |texel: i32| (at + i64::from(texel) * size / i64::from(texels[axis])) as i32;
            (part.source[0][axis], part.source[1][axis]) = (first, last);
            // What is cut in the middle of a texel starts there.
            part.target[0][axis] = place(first).max(low as i32);
            part.target[1][axis] = place(last).min(high as i32);
        }
        Some(part)
    }

    /// Whether it fills a window of such a size.
    fn covers(&self, extent: vk::Extent2D) -> bool {
        let ends = [[0, 0], [extent.width as i32, extent.height as i32]];
        self.part(extent).is_some_and(|part| part.target == ends)
    }

    /// # Safety
    ///
    /// The buffer is being recorded outside of rendering, and `target`, of this format and extent, is alive and ready to be copied to.
    unsafe fn copy(
        &self,
        device: &ash::Device,
        buffer: vk::CommandBuffer,
        target: vk::Image,
        format: vk::Format,
        extent: vk::Extent2D,
    ) {
        let Some(Part { source, target: place }) = self.part(extent) else { return };
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let offset = |[x, y]: [i32; 2], z| vk::Offset3D { x, y, z };
        let size = |[from, to]: [[i32; 2]; 2]| [to[0] - from[0], to[1] - from[1]];
        let (from, to) = (vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        let handle = self.image.handle;
        // SAFETY: as the caller promises; the parts lie in both images, and the picture is held by whoever draws.
        unsafe {
            if size(source) == size(place) && format == self.image.format.handle() {
                let [width, height] = size(source).map(|side| side as u32);
                let region = vk::ImageCopy::default()
                    .src_subresource(layers)
                    .src_offset(offset(source[0], 0))
                    .dst_subresource(layers)
                    .dst_offset(offset(place[0], 0))
                    .extent(vk::Extent3D { width, height, depth: 1 });
                device.cmd_copy_image(buffer, handle, from, target, to, &[region]);
            } else {
                let region = vk::ImageBlit::default()
                    .src_subresource(layers)
                    .src_offsets([offset(source[0], 0), offset(source[1], 1)])
                    .dst_subresource(layers)
                    .dst_offsets([offset(place[0], 0), offset(place[1], 1)]);
                device.cmd_blit_image(buffer, handle, from, target, to, &[region], vk::Filter::LINEAR);
            }
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
