//! The model `tree`: its 64-bit referee, held against what is known exactly, and the model on a device, held against both.

#[path = "../common/mod.rs"]
mod common;

mod bodies;
mod closest;
mod convergence;
mod device;
mod extremes;
mod footprints;
mod furnace;
mod limits;
mod media;
mod opaque;
mod referee;
mod referee_gpu;
mod reference;
mod shapes;
mod tracers;
