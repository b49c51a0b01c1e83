//! The model `path`: held against the enumerated tree, against itself by other estimators, and against white surroundings.

#[allow(dead_code, reason = "each test program uses its share")]
#[path = "../tree/bodies.rs"]
mod bodies;
#[path = "../common/mod.rs"]
mod common;
mod device;
mod estimators;
mod furnace;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "../tree/shapes.rs"]
mod shapes;
mod statistics;
mod truth;
