//! What is told about a render.

mod stats;

pub use stats::{BuildTimes, DeviceStats, PassStats, Run, Stats};
