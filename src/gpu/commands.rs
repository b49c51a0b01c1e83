//! Recording, submitting, waiting and timing.

use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use ash::vk;
use bytemuck::NoUninit;

use super::error::Context;
use super::pipeline::{PUSH_STAGES, Pipeline};
use super::{BindGroup, ComputePipeline, Gpu, GpuError, GraphicsPipeline, Image, Result, Use};

/// Passes that one recording can time.
const MAX_TIMED: u32 = 64;

/// Stages, and what they do to memory.
pub(super) type Accesses = (vk::PipelineStageFlags2, vk::AccessFlags2);

/// What writes into buffers.
pub(super) const BUFFER_WRITES: Accesses = (
    vk::PipelineStageFlags2::from_raw(
        vk::PipelineStageFlags2::COMPUTE_SHADER.as_raw() | vk::PipelineStageFlags2::COPY.as_raw(),
    ),
    vk::AccessFlags2::from_raw(
        vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw() | vk::AccessFlags2::TRANSFER_WRITE.as_raw(),
    ),
);

/// How long a pass took on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// The pass.
    pub name: &'static str,
    /// Milliseconds; `None` where the device has no clock.
    pub gpu_ms: Option<f64>,
}

/// What recordings need: a pool, a fence, timestamps. One recording executes at a time.
pub struct Commands {
    pool: vk::CommandPool,
    pub(super) buffer: vk::CommandBuffer,
    fence: vk::Fence,
    queries: vk::QueryPool,
    /// What is set ends the work: nothing more is submitted.
    interrupt: Option<Arc<AtomicBool>>,
    patience: Duration,
    gpu: Gpu,
}

impl Commands {
    /// Ready to record.
    pub fn new(gpu: &Gpu) -> Result<Self> {
        let mut commands = Self {
            pool: vk::CommandPool::null(),
            buffer: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            queries: vk::QueryPool::null(),
            interrupt: None,
            patience: Duration::from_millis(100),
            gpu: gpu.clone(),
        };
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.info().queue_family);
        let queries =
            vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2 * MAX_TIMED);
        // SAFETY: the infos point to locals; whatever fails, dropping `commands` destroys what was made and ignores nulls.
        unsafe {
            commands.pool = gpu.device.create_command_pool(&pool, None).context("vkCreateCommandPool")?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(commands.pool).command_buffer_count(1);
            commands.buffer = gpu.device.allocate_command_buffers(&info).context("vkAllocateCommandBuffers")?[0];
            commands.fence = gpu.device.create_fence(&Default::default(), None).context("vkCreateFence")?;
            commands.queries = gpu.device.create_query_pool(&queries, None).context("vkCreateQueryPool")?;
        }
        gpu.name(commands.pool, "recordings");
        gpu.name(commands.buffer, "recording");
        gpu.name(commands.fence, "recording is done");
        gpu.name(commands.queries, "times of passes");
        Ok(commands)
    }

    /// From now on nothing is submitted while `interrupt` is set: [`GpuError::Interrupted`].
    pub fn interrupt_by(&mut self, interrupt: Arc<AtomicBool>) {
        self.interrupt = Some(interrupt);
    }

    /// How long one submission should take, where work can be cut.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    /// From now on one submission should take no longer than that, where work can be cut.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Records what `record` says, submits it and waits until the device is done. Returns the times of its passes.
    ///
    /// What is recorded is borrowed for `'r`, which outlives this call.
    pub fn run<'r>(&mut self, record: impl FnOnce(&mut Recorder<'_, 'r>)) -> Result<Vec<PassTime>> {
        if self.interrupt.as_ref().is_some_and(|interrupt| interrupt.load(Ordering::Relaxed)) {
            return Err(GpuError::Interrupted);
        }
        let device = &self.gpu.device;
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the last submission was waited for, so pool, buffer and queries are free.
        unsafe {
            device.reset_command_pool(self.pool, Default::default()).context("vkResetCommandPool")?;
            device.begin_command_buffer(self.buffer, &begin).context("vkBeginCommandBuffer")?;
            device.cmd_reset_query_pool(self.buffer, self.queries, 0, 2 * MAX_TIMED);
        }
        let mut recorder = Recorder { commands: self, timed: Vec::new(), recorded: PhantomData };
        record(&mut recorder);
        let timed = recorder.timed;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.buffer)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&buffers)];
        // SAFETY: recording has ended; everything recorded is borrowed for longer than this call, which returns after the
        // fence or, should waiting fail, after the device is idle or lost. The lock keeps submissions of other threads apart.
        unsafe {
            device.end_command_buffer(self.buffer).context("vkEndCommandBuffer")?;
            {
                let queue = self.gpu.queue.lock().unwrap_or_else(PoisonError::into_inner);
                device.queue_submit2(*queue, &submit, self.fence).context("vkQueueSubmit2")?;
            }
            let done = match self.gpu.count_submission() {
                true => Err(vk::Result::ERROR_DEVICE_LOST),
                false => device.wait_for_fences(&[self.fence], true, u64::MAX),
            };
            if let Err(result) = done {
                let _ = device.device_wait_idle();
                return Err(result).context("vkWaitForFences");
            }
            device.reset_fences(&[self.fence]).context("vkResetFences")?;
        }
        self.times(&timed)
    }

    fn times(&self, timed: &[&'static str]) -> Result<Vec<PassTime>> {
        let bits = self.gpu.info().timestamp_bits;
        if bits == 0 || timed.is_empty() {
            return Ok(timed.iter().map(|&name| PassTime { name, gpu_ms: None }).collect());
        }
        let mut ticks = vec![0_u64; 2 * timed.len()];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: these queries were written by the submission that was just waited for.
        unsafe { self.gpu.device.get_query_pool_results(self.queries, 0, &mut ticks, flags) }
            .context("vkGetQueryPoolResults")?;
        let mask = u64::MAX >> (64 - bits);
        let period = f64::from(self.gpu.info().limits.timestamp_period);
        let span = |pair: &[u64]| (pair[1].wrapping_sub(pair[0]) & mask) as f64 * period * 1e-6;
        Ok(timed.iter().zip(ticks.chunks(2)).map(|(&name, pair)| PassTime { name, gpu_ms: Some(span(pair)) }).collect())
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        // SAFETY: every submission was waited for, or the device was lost.
        unsafe {
            self.gpu.device.destroy_query_pool(self.queries, None);
            self.gpu.device.destroy_fence(self.fence, None);
            self.gpu.device.destroy_command_pool(self.pool, None);
        }
    }
}

/// A recording under way, of things borrowed for `'r`.
pub struct Recorder<'a, 'r> {
    pub(super) commands: &'a Commands,
    timed: Vec<&'static str>,
    recorded: PhantomData<&'r ()>,
}

/// A target of a render pass.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The image.
    pub image: &'a Image,
    /// What it holds at first: this, or `None` for what it held before.
    pub clear: Option<[f32; 4]>,
}

impl<'r> Recorder<'_, 'r> {
    pub(super) fn device(&self) -> &ash::Device {
        &self.commands.gpu.device
    }

    /// Times what `record` records, under a name.
    pub fn timed(&mut self, name: &'static str, record: impl FnOnce(&mut Self)) {
        let index = self.timed.len() as u32;
        let (buffer, queries) = (self.commands.buffer, self.commands.queries);
        let clock = index < MAX_TIMED && self.commands.gpu.info().timestamp_bits > 0;
        if index < MAX_TIMED {
            self.timed.push(name);
        }
        let stamp = |recorder: &Self, query| {
            if clock {
                // SAFETY: the query was reset when recording began, and is written once.
                unsafe {
                    recorder.device().cmd_write_timestamp2(
                        buffer,
                        vk::PipelineStageFlags2::ALL_COMMANDS,
                        queries,
                        query,
                    );
                }
            }
        };
        stamp(self, 2 * index);
        self.commands.gpu.label(buffer, Some(name));
        record(self);
        self.commands.gpu.label(buffer, None);
        stamp(self, 2 * index + 1);
    }

    /// Waits for the last use of `image`, then makes it ready for `next`.
    pub fn use_image(&mut self, image: &'r Image, next: Use) {
        let before = image.replace_use(next);
        self.barrier(image, before, before.layout(), next);
    }

    /// As [`use_image`](Self::use_image), for a use that overwrites all of the content.
    pub fn overwrite_image(&mut self, image: &'r Image, next: Use) {
        let before = image.replace_use(next);
        self.barrier(image, before, Use::Nothing.layout(), next);
    }

    fn barrier(&mut self, image: &Image, before: Use, layout: vk::ImageLayout, next: Use) {
        let ((src_stage, src_access), (dst_stage, dst_access)) = (before.access(), next.access());
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)
            .old_layout(layout)
            .new_layout(next.layout())
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image.handle)
            .subresource_range(image.range())];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the image is alive, and its layout is that of its last use, which `Image` keeps, or its content is not needed.
        unsafe { self.device().cmd_pipeline_barrier2(self.commands.buffer, &dependency) };
    }

    /// Draws into `colors` and `depth`, of which there is at least one.
    ///
    /// # Panics
    ///
    /// If they are not of one size.
    pub fn render(
        &mut self,
        colors: &[Target<'r>],
        depth: Option<Target<'r>>,
        draw: impl FnOnce(&mut RenderPass<'_, 'r>),
    ) {
        self.render_area(colors, depth, Area { corner: [0; 2], size: [u32::MAX; 2] }, draw);
    }

    /// As [`render`](Self::render), in a part of the targets: outside of `area` they keep what they hold, or hold nothing that is
    /// known where they are cleared.
    ///
    /// # Panics
    ///
    /// If the targets are not of one size.
    pub fn render_area(
        &mut self,
        colors: &[Target<'r>],
        depth: Option<Target<'r>>,
        area: Area,
        draw: impl FnOnce(&mut RenderPass<'_, 'r>),
    ) {
        let mut extents = colors.iter().chain(&depth).map(|target| target.image.extent);
        let Some(extent) = extents.next() else { return };
        assert!(extents.all(|other| other == extent), "targets of different sizes");
        let mut attach = |target: &Target<'r>, next: Use| {
            let mut info = vk::RenderingAttachmentInfo::default()
                .image_view(target.image.view)
                .image_layout(next.layout())
                .load_op(vk::AttachmentLoadOp::LOAD)
                .store_op(vk::AttachmentStoreOp::STORE);
            match target.clear {
                Some(value) => {
                    self.overwrite_image(target.image, next);
                    info = info.load_op(vk::AttachmentLoadOp::CLEAR).clear_value(match next {
                        Use::DepthTarget => {
                            vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: value[0], stencil: 0 } }
                        }
                        _ => vk::ClearValue { color: vk::ClearColorValue { float32: value } },
                    });
                }
                None => self.use_image(target.image, next),
            }
            info
        };
        let color_infos: Vec<_> = colors.iter().map(|target| attach(target, Use::ColorTarget)).collect();
        let depth_info = depth.as_ref().map(|target| attach(target, Use::DepthTarget));
        let area = area.within(extent);
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&color_infos);
        if let Some(depth) = &depth_info {
            info = info.depth_attachment(depth);
        }
        // Upside down: Vulkan's rows grow downwards, the camera's up points up.
        let viewport = vk::Viewport {
            x: 0.0,
            y: extent.height as f32,
            width: extent.width as f32,
            height: -(extent.height as f32),
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let (device, buffer) = (self.device(), self.commands.buffer);
        // SAFETY: the targets are alive and in the layouts named; begin and end enclose what `draw` records.
        unsafe {
            device.cmd_begin_rendering(buffer, &info);
            device.cmd_set_viewport(buffer, 0, &[viewport]);
            device.cmd_set_scissor(buffer, 0, &[area]);
            draw(&mut RenderPass { commands: self.commands, bound: None });
            device.cmd_end_rendering(buffer);
        }
    }

    /// Runs a compute shader over `groups` workgroups.
    ///
    /// # Panics
    ///
    /// If the pipeline was made for another kind of group or push constants.
    pub fn dispatch<P: NoUninit>(
        &mut self,
        pipeline: &'r ComputePipeline,
        group: &'r BindGroup,
        push: &P,
        groups: [u32; 3],
    ) {
        let point = vk::PipelineBindPoint::COMPUTE;
        bind(self.commands, pipeline.inner(), point, group);
        push_constants(self.commands, pipeline.inner(), push);
        // SAFETY: pipeline, set and push constants are bound.
        unsafe { self.device().cmd_dispatch(self.commands.buffer, groups[0], groups[1], groups[2]) };
    }

    /// Makes what shaders wrote into buffers visible to copies, and what was copied visible to shaders.
    pub fn wait_for_buffers(&mut self) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        self.memory_barrier(
            BUFFER_WRITES,
            (
                Stage::VERTEX_SHADER | Stage::FRAGMENT_SHADER | Stage::COMPUTE_SHADER | Stage::COPY,
                Access::SHADER_STORAGE_READ | Access::SHADER_STORAGE_WRITE | Access::TRANSFER_READ,
            ),
        );
    }

    /// Lets what comes `after` wait for what was `before`, and see what that wrote.
    pub(super) fn memory_barrier(&mut self, before: Accesses, after: Accesses) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(before.0)
            .src_access_mask(before.1)
            .dst_stage_mask(after.0)
            .dst_access_mask(after.1)];
        let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: a barrier of memory names no resource.
        unsafe { self.device().cmd_pipeline_barrier2(self.commands.buffer, &dependency) };
    }
}

/// Which triangles are fronts, by the order of their corners as they are seen, and which are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sides {
    /// Fronts are clockwise, as those of a mesh in a mirror; else counter-clockwise.
    pub clockwise: bool,
    /// Those that are drawn.
    pub shown: Shown,
}

/// Sides of triangles that are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shown {
    /// Fronts and backs.
    #[default]
    Both,
    /// Backs are left out.
    Fronts,
    /// Fronts are left out.
    Backs,
}

/// A rectangle of an image, in texels from the top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Its first column and row.
    pub corner: [u32; 2],
    /// Columns and rows, at least 1.
    pub size: [u32; 2],
}

impl Area {
    /// What of it lies in an image; all of the image where nothing does.
    fn within(self, image: vk::Extent2D) -> vk::Rect2D {
        let whole = [image.width, image.height];
        let corner: [u32; 2] = std::array::from_fn(|i| self.corner[i].min(whole[i]));
        let size: [u32; 2] = std::array::from_fn(|i| self.size[i].min(whole[i] - corner[i]));
        if size.contains(&0) {
            return vk::Rect2D { offset: vk::Offset2D::default(), extent: image };
        }
        // Sides of images are far below 2^31.
        let offset = vk::Offset2D { x: corner[0] as i32, y: corner[1] as i32 };
        vk::Rect2D { offset, extent: vk::Extent2D { width: size[0], height: size[1] } }
    }
}

/// Draws inside of [`Recorder::render`].
pub struct RenderPass<'a, 'r> {
    commands: &'a Commands,
    bound: Option<&'r Pipeline>,
}

impl<'r> RenderPass<'_, 'r> {
    /// The pipeline and the resources of the draws that follow.
    ///
    /// # Panics
    ///
    /// If the pipeline was made for another kind of group.
    pub fn bind(&mut self, pipeline: &'r GraphicsPipeline, group: &'r BindGroup) {
        bind(self.commands, pipeline.inner(), vk::PipelineBindPoint::GRAPHICS, group);
        self.bound = Some(pipeline.inner());
    }

    /// Draws `vertices` vertices, of which the triangles on `sides` show; nothing if no pipeline is bound.
    ///
    /// # Panics
    ///
    /// If the pipeline was made for other push constants.
    pub fn draw<P: NoUninit>(&mut self, push: &P, vertices: u32, sides: Sides) {
        let Some(pipeline) = self.bound else { return };
        push_constants(self.commands, pipeline, push);
        let device = &self.commands.gpu.device;
        // SAFETY: a pipeline, its group and its push constants are bound inside of a rendering.
        unsafe {
            let front = if sides.clockwise { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE };
            let cull = match sides.shown {
                Shown::Both => vk::CullModeFlags::NONE,
                Shown::Fronts => vk::CullModeFlags::BACK,
                Shown::Backs => vk::CullModeFlags::FRONT,
            };
            device.cmd_set_front_face(self.commands.buffer, front);
            device.cmd_set_cull_mode(self.commands.buffer, cull);
            device.cmd_draw(self.commands.buffer, vertices, 1, 0, 0);
        }
    }
}

fn bind(commands: &Commands, pipeline: &Pipeline, point: vk::PipelineBindPoint, group: &BindGroup) {
    assert!(pipeline.kinds == group.kinds, "a bind group of another kind");
    // SAFETY: pipeline and set are borrowed for longer than they execute, and their layouts are the same.
    unsafe {
        let device = &commands.gpu.device;
        device.cmd_bind_pipeline(commands.buffer, point, pipeline.handle);
        device.cmd_bind_descriptor_sets(commands.buffer, point, pipeline.layout, 0, &[group.set], &[]);
    }
}

fn push_constants<P: NoUninit>(commands: &Commands, pipeline: &Pipeline, push: &P) {
    let bytes = bytemuck::bytes_of(push);
    assert_eq!(bytes.len(), pipeline.push_bytes as usize, "push constants of another size");
    if !bytes.is_empty() {
        // SAFETY: the layout has a range of just these bytes.
        unsafe {
            let device = &commands.gpu.device;
            device.cmd_push_constants(commands.buffer, pipeline.layout, PUSH_STAGES, 0, bytes);
        }
    }
}
