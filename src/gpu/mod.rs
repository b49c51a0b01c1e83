//! Vulkan 1.3 behind a safe face: the only room of the house with `unsafe`.
//!
//! In flow descriptions and bytes, out flow bytes and times. [`Instance`] finds devices, [`Gpu`] is one of them
//! opened; [`Buffer`], [`Image`], [`AccelerationStructure`], [`BindGroup`] and the pipelines live on it, and
//! [`Commands`] records, submits and waits. Everything holds its [`Gpu`], so no device goes before what was made on
//! it, and [`Commands::run`] returns only when the device is done, so nothing that a recording borrows can go while
//! it is in use.

mod acceleration;
mod bind_group;
mod commands;
mod device;
mod error;
mod faults;
mod image;
mod instance;
mod memory;
mod messages;
mod pipeline;
mod screen;
mod shader;
mod shared;
mod transfer;

pub use acceleration::{AccelerationStructure, MeshStructures, PlacedMesh};
pub use bind_group::{Bind, BindGroup};
pub use commands::{Area, Commands, PassTime, Recorder, RenderPass, Shown, Sides, Target};
pub use device::{Gpu, Witness};
pub use error::GpuError;
pub use faults::Fault;
pub use image::{Format, Image, ImageDesc, Use};
pub(crate) use instance::find as find_device;
pub use instance::{DeviceInfo, DeviceKind, Handicap, Instance, Watch};
pub use memory::{Buffer, BufferDesc, BufferUse};
pub use messages::{Message, MessageObject, Messages, complaint};
pub use pipeline::{ComputePipeline, Depth, GraphicsPipeline, GraphicsPipelineDesc, Specialization};
pub use screen::{Placed, Screen, Shown as OnScreen, Surface};
pub use shader::{Shader, compiled as shaders};
pub use shared::{Frame, InstanceRecord, LightRecord, MaterialRecord, Matrix4x3, SamplePush};

/// What can go wrong here.
pub type Result<T, E = GpuError> = std::result::Result<T, E>;
