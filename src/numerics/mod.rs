//! Whether a device computes the optics functions of `shaders/` as 64-bit arithmetic does.
//!
//! In flow a device and a table of functions, regions and bounds; out flow the worst errors, with the inputs that caused them.
//! [`FUNCTIONS`] says what there is to call, [`REGIONS`] which inputs are tried and what may come out, [`suite`] tries them,
//! [`Probe`] runs `shaders/probe.comp`, which includes the renderer's own files, and [`Table`] evaluates a file of inputs.

mod checks;
mod functions;
mod inputs;
mod measures;
mod probe;
mod regions;
pub mod suite;
mod table;

pub use functions::{FUNCTIONS, Function};
pub use measures::{Measure, ulps};
pub use probe::Probe;
pub use regions::{REGIONS, Region};
pub use table::Table;
