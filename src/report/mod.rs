//! What is told about a render, about two images, and about a device's arithmetic.

mod compare;
mod cost;
mod cost_page;
mod explain;
mod numerics;
mod numerics_page;
mod objects;
mod picture;
mod plan;
mod plots;
mod regress;
mod regress_page;
mod stats;
mod validate;
mod validate_page;

pub use compare::{CompareReport, MetricValues};
pub use cost::CostReport;
pub use explain::Explanation;
pub use numerics::{NumericsFiles, NumericsReport};
pub use picture::{float_image, metadata};
pub use regress::{junit as regress_junit, summary as regress_summary, table as regress_table};
pub use regress_page::html as regress_html;
pub use stats::{BuildTimes, DeviceStats, DiscardedStats, PassStats, Run, Stats};
pub use validate::{summary as validate_summary, table as validate_table};
pub use validate_page::html as validate_html;
