//! The device evaluates one function at many inputs.

use std::sync::Arc;

use super::Function;
use crate::gpu::{
    Bind, BindGroup, Buffer, BufferDesc, BufferUse, Commands, ComputePipeline, Gpu, Result, Specialization, shaders,
};

/// The id of `FUNCTION` in `shaders/probe.comp`.
const FUNCTION: u32 = 128;

/// Inputs of one dispatch: few enough for every device, many enough to keep it busy.
pub(super) const CHUNK: usize = 1 << 17;

/// One function, ready to be evaluated.
pub struct Probe {
    function: &'static Function,
    commands: Commands,
    pipeline: Option<ComputePipeline>,
}

impl Probe {
    /// A probe of `function` on `gpu`.
    pub fn new(gpu: &Gpu, function: &'static Function) -> Result<Self> {
        Ok(Self { function, commands: Commands::new(gpu)?, pipeline: None })
    }

    /// The outputs at `inputs`, both packed: as many values a row as the function has columns.
    pub fn evaluate(&mut self, inputs: &[f32]) -> Result<Vec<f32>> {
        let (columns, results) = (self.function.inputs.len(), self.function.outputs.len());
        let mut outputs = Vec::with_capacity(inputs.len() / columns * results);
        for chunk in inputs.chunks(CHUNK * columns) {
            outputs.extend(self.chunk(chunk, chunk.len() / columns, results)?);
        }
        Ok(outputs)
    }

    fn chunk(&mut self, inputs: &[f32], count: usize, results: usize) -> Result<Vec<f32>> {
        let gpu = self.commands.gpu().clone();
        let inputs = Arc::new(self.commands.upload_buffer("inputs", inputs)?);
        let size = (count * results * size_of::<f32>()) as u64;
        let outputs = Arc::new(Buffer::new(&gpu, &BufferDesc { name: "outputs", size, usage: BufferUse::Storage })?);
        let group = BindGroup::new(&gpu, "probe", vec![Bind::Buffer(inputs), Bind::Buffer(outputs.clone())])?;
        let pipeline = match self.pipeline.take() {
            Some(pipeline) => pipeline,
            None => {
                let constants = Specialization::default().with_number(FUNCTION, self.function.id);
                ComputePipeline::new(&gpu, &shaders::PROBE_COMP, &group, size_of::<u32>() as u32, &constants)?
            }
        };
        let push = count as u32;
        self.commands.run(|cmd| cmd.dispatch(&pipeline, &group, &push, [push.div_ceil(64), 1, 1]))?;
        self.pipeline = Some(pipeline);
        Ok(bytemuck::allocation::pod_collect_to_vec(&self.commands.read_buffer(&outputs)?))
    }
}
