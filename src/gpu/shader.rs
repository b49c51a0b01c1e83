//! The shaders that `build.rs` compiled.

use ash::vk;

use super::error::Context;
use super::{Gpu, Result};

/// An entry point in SPIR-V.
#[derive(Clone, Copy, Debug)]
pub struct Shader {
    /// The file in `shaders/`.
    pub name: &'static str,
    pub(super) spirv: &'static [u8],
}

impl Shader {
    /// Its words, byte by byte.
    pub fn spirv(&self) -> &'static [u8] {
        self.spirv
    }
}

/// Every entry point in `shaders/`.
pub mod compiled {
    use super::Shader;

    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

/// A shader module, for as long as a pipeline is being made.
pub(super) struct Module<'a> {
    pub(super) handle: vk::ShaderModule,
    gpu: &'a Gpu,
}

impl<'a> Module<'a> {
    pub(super) fn new(gpu: &'a Gpu, shader: &Shader) -> Result<Self> {
        let words: Vec<u32> =
            shader.spirv.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the code is what shaderc made for Vulkan 1.3.
        let handle = unsafe { gpu.device.create_shader_module(&info, None) }.context("vkCreateShaderModule")?;
        gpu.name(handle, shader.name);
        Ok(Self { handle, gpu })
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: a module may go once the pipelines made from it exist.
        unsafe { self.gpu.device.destroy_shader_module(self.handle, None) };
    }
}
