//! The model `tree`: its 64-bit referee, held against what is known exactly.

#[path = "../common/mod.rs"]
mod common;

mod closest;
mod referee;
mod reference;
mod shapes;
