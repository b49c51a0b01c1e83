//! What is told about a render, about two images, and about a device's arithmetic.

mod compare;
mod cost;
mod cost_page;
mod explain;
mod numerics;
mod numerics_page;
mod plan;
mod plots;
mod stats;

pub use compare::{CompareReport, MetricValues};
pub use cost::CostReport;
pub use explain::Explanation;
pub use numerics::{NumericsFiles, NumericsReport};
pub use stats::{BuildTimes, DeviceStats, DiscardedStats, PassStats, Run, Stats};
