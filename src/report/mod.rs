//! What is told about a render, and about a device's arithmetic.

mod explain;
mod numerics;
mod numerics_page;
mod plots;
mod stats;

pub use explain::Explanation;
pub use numerics::{NumericsFiles, NumericsReport};
pub use stats::{BuildTimes, DeviceStats, PassStats, Run, Stats};
