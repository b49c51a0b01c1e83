//! Vitrum renders glass: raw Vulkan, GLSL shaders, and a scene that says which effects are simulated.
//!
//! The data flows through the modules in this order:
//!
//! ```text
//! scene file -> scene -> effects needed -> plan -> GPU resources -> passes -> image -> metrics -> report
//! ```
//!
//! [`scene`] is plain data without a Vulkan type, [`effects`] the table of what can be simulated, [`plan`] what one
//! render does, [`gpu`] the only room with `unsafe`, [`passes`] the frame, [`image`] pixels and their files,
//! [`compare`] metrics between two images, [`cost`] what accuracy takes, [`regress`] pictures held against references, [`validate`]
//! what a driver is tested with, [`report`] what is told about all of these, [`commands`] what the binary offers.
//! [`optics`] states in 64-bit arithmetic what `shaders/` computes in 32, and [`numerics`] holds one against the other
//! on a device.

#![deny(unsafe_code)]
#![warn(missing_docs)]

pub mod choice;
pub mod commands;
pub mod compare;
pub mod cost;
pub mod effects;
pub mod error;
#[allow(unsafe_code)]
pub mod gpu;
pub mod image;
pub mod numerics;
pub mod optics;
pub mod options;
mod parallel;
pub mod passes;
pub mod plan;
pub mod regress;
pub mod report;
pub mod scene;
mod shell;
pub mod validate;
pub mod viewer;

pub use error::{Error, Result};
