//! Faults, planted to see whether the validation layer notices and names what is broken. In flow a device, out flow its messages.
//!
//! Each is what a change of this room could bring about by mistake, and nothing outside of the room could. Calls that the layer
//! complains of do not reach the driver. What it complains of too late is harmless on drivers as they are: a copy that reads old bytes,
//! a layout that is not the one named, a buffer more when all ends, a write within the block that a buffer lies in. Where it does not
//! notice that a buffer is gone, the driver may crash: plant in a process that may.

use std::sync::Arc;

use ash::vk;

use super::error::Context;
use super::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, DeviceInfo, Format, Gpu, GpuError,
    Image, ImageDesc, Instance, Message, Result, Specialization, Use, Watch, shaders,
};

/// What every planted thing is called.
const PLANTED: &str = "planted fault";

/// A fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// A copy reads what the copy before it may still be writing.
    MissingBarrier,
    /// An image is not in the layout that a barrier says it is in.
    WrongLayout,
    /// A buffer is left when the device goes.
    LeakedBuffer,
    /// A shader is run on a buffer that is gone.
    UseAfterFree,
    /// A shader writes beyond the end of a buffer.
    OutOfBoundsIndex,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::MissingBarrier, Self::WrongLayout, Self::LeakedBuffer, Self::UseAfterFree, Self::OutOfBoundsIndex];

    /// As it is called on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::MissingBarrier => "missing-barrier",
            Self::WrongLayout => "wrong-layout",
            Self::LeakedBuffer => "leaked-buffer",
            Self::UseAfterFree => "use-after-free",
            Self::OutOfBoundsIndex => "out-of-bounds-index",
        }
    }

    /// The name of what is broken.
    pub fn planted(self) -> &'static str {
        match self {
            Self::OutOfBoundsIndex => shaders::PROBE_BOUNDS_COMP.name,
            _ => PLANTED,
        }
    }

    /// What for.
    pub fn about(self) -> &'static str {
        match self {
            Self::MissingBarrier => "a copy reads what the copy before it may still be writing: noticed, and named",
            Self::WrongLayout => "an image is not in the layout that a barrier says it is in: noticed, and named",
            Self::LeakedBuffer => "a buffer is left when the device goes: noticed, and named",
            Self::UseAfterFree => "a shader is run on a buffer that is gone: noticed, and named",
            Self::OutOfBoundsIndex => "a shader writes beyond the end of a buffer: noticed, and named",
        }
    }

    /// Whether `message` is about it: an error that names what is broken, and says how.
    pub fn is_noticed_in(self, message: &Message) -> bool {
        let how = match self {
            Self::MissingBarrier => "SYNC-HAZARD",
            Self::WrongLayout => "layout",
            Self::LeakedBuffer => "vkDestroyDevice",
            Self::UseAfterFree => "destroyed",
            Self::OutOfBoundsIndex => "out of bounds",
        };
        message.is_error && message.names(self.planted()) && (message.rule.contains(how) || message.text.contains(how))
    }

    /// What notices it.
    pub fn watch(self) -> Watch {
        match self {
            Self::OutOfBoundsIndex => Watch::GpuAssisted,
            _ => Watch::Synchronization,
        }
    }

    /// Plants it on the device of that index. What the layer said of it, to the end of the instance, and how it ended.
    pub fn plant(self, device: usize) -> Result<(Vec<Message>, Result<()>)> {
        let instance = Instance::watched(self.watch())?;
        let messages = instance.messages();
        messages.stop_calls();
        messages.echo();
        let devices = instance.devices()?;
        let info: DeviceInfo = devices.into_iter().nth(device).ok_or(GpuError::NoDevice)?;
        let gpu = Gpu::open(&instance, info)?;
        let ended = match self.plant_on(&gpu) {
            // The layer's way of ending a call.
            Err(GpuError::Call { result: vk::Result::ERROR_VALIDATION_FAILED_EXT, .. }) => Ok(()),
            ended => ended,
        };
        drop((gpu, instance));
        Ok((messages.all(), ended))
    }

    fn plant_on(self, gpu: &Gpu) -> Result<()> {
        let mut commands = Commands::new(gpu)?;
        let buffer = |usage| Buffer::new(gpu, &BufferDesc { name: PLANTED, size: 64, usage });
        match self {
            Self::MissingBarrier => {
                let buffers = [BufferUse::Upload, BufferUse::Storage, BufferUse::Readback].map(buffer);
                let [from, by, to] = buffers;
                let (from, by, to) = (from?, by?, to?);
                commands.run(|cmd| {
                    for (from, to) in [(&from, &by), (&by, &to)] {
                        let region = [vk::BufferCopy::default().size(64)];
                        let (device, buffer) = (&cmd.commands.gpu().device, cmd.commands.buffer);
                        // SAFETY: both are alive and of that size. That the second copy may read old bytes is the fault.
                        unsafe { device.cmd_copy_buffer(buffer, from.handle, to.handle, &region) };
                    }
                })?;
            }
            Self::WrongLayout => {
                let uses = &[Use::CopySource, Use::Sampled];
                let desc = ImageDesc { name: PLANTED, width: 4, height: 4, format: Format::Rgba32Float, uses };
                let image = Image::new(gpu, &desc)?;
                commands.run(|cmd| cmd.use_image(&image, Use::Sampled))?;
                image.replace_use(Use::CopySource);
                commands.run(|cmd| cmd.use_image(&image, Use::Sampled))?;
            }
            Self::LeakedBuffer => {
                self.raw_buffer(gpu)?;
            }
            Self::UseAfterFree | Self::OutOfBoundsIndex => {
                let bound = Bind::Buffer(Arc::new(buffer(BufferUse::Storage)?));
                let mut group = BindGroup::new(gpu, PLANTED, vec![bound])?;
                let shader = &shaders::PROBE_BOUNDS_COMP;
                let pipeline = ComputePipeline::new(gpu, shader, &group, 4, &Specialization::default())?;
                let mut index = 0_u32;
                match self {
                    Self::UseAfterFree => group.let_go(),
                    // Some words behind the last, which is the 15th: still within the block of memory.
                    _ => index = 20,
                }
                commands.run(|cmd| cmd.dispatch(&pipeline, &group, &index, [1; 3]))?;
            }
        }
        Ok(())
    }

    /// A buffer that nothing destroys.
    fn raw_buffer(self, gpu: &Gpu) -> Result<vk::Buffer> {
        let info = vk::BufferCreateInfo::default().size(64).usage(vk::BufferUsageFlags::TRANSFER_DST);
        // SAFETY: the device is alive; the size is not 0.
        let handle = unsafe { gpu.device.create_buffer(&info, None) }.context("vkCreateBuffer")?;
        gpu.name(handle, PLANTED);
        Ok(handle)
    }
}
