//! What is told about a render.

pub mod evaluate_table;
mod numerics;
mod stats;

pub use numerics::{NumericsReport, folder};
pub use stats::{BuildTimes, DeviceStats, PassStats, Run, Stats};
